#include "levelset/segmented/sources/segment_mesh.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "levelset/convert/closest_triangles.h"
#include "levelset/convert/mesh_to_band_input.h"
#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "levelset/geometry/closest_on_triangle.h"
#include "levelset/geometry/exact_predicates.h"
#include "levelset/geometry/mesh_sides.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/mesh_sign/mesh_topology.h"
#include "levelset/mesh_sign/self_intersections.h"
#include "levelset/segmented/local/block_surroundings.h"
#include "levelset/segmented/local/kuhn_cell.h"
#include "levelset/segmented/segmented_data_vdb.h"
#include "levelset/segmented/sources/double_triangles.h"
#include "levelset/segmented/sources/grid_crossings.h"
#include "levelset/segmented/sources/near_triangles_vdb.h"
#include "levelset/segmented/sources/sheet_builder.h"
#include "levelset/segmented/sources/sheet_features.h"

namespace levelset {
namespace {

using Imath::V3d;
using Imath::V3i;
using openvdb::Coord;

/// Regions of the grid points around a mesh.
class MeshRegions {
 public:
  MeshRegions(const TriMesh& mesh, double voxelSize, const SegmentMeshOptions& options)
      : mesh_(mesh), voxelSize_(voxelSize), options_(options), sets_(0) {}

  SegmentMeshResult run() {
    findPatches();
    findClosest();
    collectBlocks();
    near_ = NearTriangles(mesh_.triangles, points_);
    report(options_.progress, 0.5);
    SegmentMeshResult result;
    result.patches = patchCount_;
    if (options_.keepsSheets) {
      runWithSheets(result);
    } else {
      joinGridPoints();
      joinPatchSides();
      report(options_.progress, 0.7);
      numberRegions();
      checkSides();
      listPairs();
      result.field = makeField(nullptr);
    }
    report(options_.progress, 1);
    return result;
  }

 private:
  [[nodiscard]] std::array<V3d, 3> corners(std::uint32_t triangle) const {
    const auto& t = mesh_.triangles[triangle];
    return {points_[t[0]], points_[t[1]], points_[t[2]]};
  }

  void findPatches() {
    points_.reserve(mesh_.positions.size());
    for (const V3d& p : mesh_.positions) points_.push_back(p / voxelSize_);
    DisjointSets patches = connectedPatches(mesh_.triangles, [](std::uint32_t) { return true; });
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      patchOf_.push_back(patches.find(t));
      patchCount_ += patchOf_.back() == t;
    }
    // With sheets, sides of single triangles are joined where this is safe.
    if (options_.keepsSheets) std::iota(patchOf_.begin(), patchOf_.end(), 0u);
  }

  void findClosest() {
    const ClosestTriangles closest =
        closestTriangles(mesh_, voxelSize_,
                         {.halfWidth = options_.halfWidth + 1,
                          .maxMemory = options_.maxMemory,
                          .progress = subProgress(options_.progress, 0, 0.4)});
    index_ = nearIndex_ = closest.triangle.shared()->scalar;
    vector_ = nearVector_ = closest.vector.shared()->vector;
  }

  /// Numbers the blocks with distances, and the box of all blocks with a margin of one.
  void collectBlocks() {
    openvdb::CoordBBox box;
    for (auto leaf = index_->tree().cbeginLeaf(); leaf; ++leaf) {
      leaves_.push_back(leaf.getLeaf());
      box.expand(SegmentedData::blockCoord(leaf->origin()));
    }
    box.expand(1);
    low_ = box.min();
    size_ = box.dim();
    const double count = static_cast<double>(size_[0]) * size_[1] * size_[2];
    requireMemory(count * 12 + static_cast<double>(leaves_.size()) * 512 * 12,
                  memoryLeft(options_.maxMemory));
    if (count + static_cast<double>(leaves_.size()) * 512 + 2.0 * double(mesh_.triangles.size()) >
        4e9)
      throw ResourceLimit("the grid around the mesh is too large; use larger voxels");
    numbers_.assign(static_cast<std::size_t>(count), -1);
    for (std::size_t n = 0; n < leaves_.size(); ++n)
      numbers_[blockIndex(SegmentedData::blockCoord(leaves_[n]->origin()))] =
          static_cast<std::int32_t>(n);
  }
  [[nodiscard]] std::size_t blockIndex(const Coord& block) const {
    const Coord at = block - low_;
    return (static_cast<std::size_t>(at[0]) * static_cast<std::size_t>(size_[1]) +
            static_cast<std::size_t>(at[1])) *
               static_cast<std::size_t>(size_[2]) +
           static_cast<std::size_t>(at[2]);
  }
  [[nodiscard]] bool isInBox(const Coord& block) const {
    for (int axis = 0; axis < 3; ++axis)
      if (block[axis] < low_[axis] || block[axis] >= low_[axis] + size_[axis]) return false;
    return true;
  }

  // === Sets: grid points of blocks with distances, other blocks as a whole, sides of patches
  [[nodiscard]] std::uint32_t setOf(const Coord& at) const {
    const std::size_t block = blockIndex(SegmentedData::blockCoord(at));
    if (numbers_[block] < 0) return static_cast<std::uint32_t>(leaves_.size() * 512 + block);
    return static_cast<std::uint32_t>(static_cast<std::size_t>(numbers_[block]) * 512 +
                                      SegmentedData::offsetOf(at));
  }
  [[nodiscard]] std::uint32_t setOfSide(std::uint32_t triangle, bool isFront) const {
    return static_cast<std::uint32_t>(leaves_.size() * 512 + numbers_.size()) +
           2 * patchOf_[triangle] + isFront;
  }

  void joinGridPoints() {
    sets_ = DisjointSets(leaves_.size() * 512 + numbers_.size() + 2 * mesh_.triangles.size());
    // Tests the edges of the grid in parallel, then joins in order.
    std::vector<std::array<std::uint8_t, 512>> blocked(leaves_.size());
    tbb::parallel_for(std::size_t{0}, leaves_.size(), [&](std::size_t n) {
      openvdb::Vec3SGrid::ConstAccessor vectors = vector_->getConstAccessor();
      for (std::uint32_t v = 0; v < 512; ++v) {
        blocked[n][v] = 0;
        const Coord at = leaves_[n]->offsetToGlobalCoord(v);
        if (!leaves_[n]->isValueOn(v)) continue;
        const double distance = lengthOf(vectors.getValue(at));
        for (int axis = 0; axis < 3; ++axis) {
          Coord next = at;
          next[axis] += 1;
          openvdb::Vec3s other;
          if (!vectors.probeValue(next, other)) continue;
          // A point on the line between them is as far from both as the surface is, or farther.
          if (distance + lengthOf(other) > 1.001) continue;
          if (near_.separate(at, next)) blocked[n][v] |= static_cast<std::uint8_t>(1 << axis);
        }
      }
    });
    for (std::size_t n = 0; n < leaves_.size(); ++n)
      for (std::uint32_t v = 0; v < 512; ++v) {
        const Coord at = leaves_[n]->offsetToGlobalCoord(v);
        for (int axis = 0; axis < 3; ++axis) {
          Coord next = at;
          next[axis] += 1;
          if (!(blocked[n][v] >> axis & 1)) sets_.join(setOf(at), setOf(next));
          // The lower neighbour may be a block without distances.
          next[axis] -= 2;
          if (at[axis] % 8 == 0 && numbers_[blockIndex(SegmentedData::blockCoord(next))] < 0)
            sets_.join(setOf(at), setOf(next));
        }
      }
    joinBlocks();
  }

  /// Joins blocks without distances with each other and with the grid points above them.
  void joinOtherBlocks() {
    for (std::uint32_t n = 0; n < leaves_.size() * 512; ++n) {
      const Coord at = leaves_[n / 512]->offsetToGlobalCoord(n % 512);
      for (int axis = 0; axis < 3; ++axis) {
        Coord next = at;
        next[axis] -= 1;
        if (at[axis] % 8 == 0 && numbers_[blockIndex(SegmentedData::blockCoord(next))] < 0)
          sets_.join(n, setOf(next));
      }
    }
    joinBlocks();
  }

  /// Joins neighbouring blocks without distances.
  void joinBlocks() {
    for (std::size_t b = 0; b < numbers_.size(); ++b) {
      if (numbers_[b] >= 0) continue;
      const Coord block = blockAt(b);
      for (int axis = 0; axis < 3; ++axis) {
        Coord next = block;
        next[axis] += 1;
        if (!isInBox(next) || numbers_[blockIndex(next)] >= 0) continue;
        sets_.join(static_cast<std::uint32_t>(leaves_.size() * 512 + b),
                   static_cast<std::uint32_t>(leaves_.size() * 512 + blockIndex(next)));
      }
    }
  }
  [[nodiscard]] Coord blockAt(std::size_t index) const {
    const auto sizeZ = static_cast<std::size_t>(size_[2]),
               sizeY = static_cast<std::size_t>(size_[1]);
    return low_ + Coord(static_cast<int>(index / sizeZ / sizeY),
                        static_cast<int>(index / sizeZ % sizeY), static_cast<int>(index % sizeZ));
  }
  [[nodiscard]] double lengthOf(const openvdb::Vec3s& vector) const {
    return openvdb::Vec3d(vector).length() / voxelSize_;
  }

  [[nodiscard]] std::uint32_t triangleAt(const openvdb::FloatTree::LeafNodeType& leaf,
                                         std::uint32_t voxel) const {
    return static_cast<std::uint32_t>(leaf.getValue(voxel));
  }
  /// Returns true for grid points in front of a triangle, or in its plane.
  [[nodiscard]] bool isInFront(std::uint32_t triangle, const Coord& at) const {
    const std::array<V3d, 3> c = corners(triangle);
    return convert::orient3d(c[0], c[1], c[2], V3d(at[0], at[1], at[2])) >= 0;
  }

  /// Joins the grid points whose closest point is inside a triangle with that side of its patch.
  void joinPatchSides() {
    for (const auto* leaf : leaves_)
      for (std::uint32_t v = 0; v < 512; ++v) {
        if (!leaf->isValueOn(v)) continue;
        const std::uint32_t t = triangleAt(*leaf, v);
        const Coord at = leaf->offsetToGlobalCoord(v);
        const std::array<V3d, 3> c = corners(t);
        if (closestOnTriangle(V3d(at[0], at[1], at[2]), c[0], c[1], c[2]).part == 6)
          sets_.join(setOf(at), setOfSide(t, isInFront(t, at)));
      }
    // Grid points on the mesh are cut off from all others.
    std::vector<bool> hasSide(sets_.size());
    hasSide[sets_.find(setOf(Coord(low_[0] << 3, low_[1] << 3, low_[2] << 3)))] = true;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      for (const bool isFront : {false, true}) hasSide[sets_.find(setOfSide(t, isFront))] = true;
    for (const auto* leaf : leaves_)
      for (std::uint32_t v = 0; v < 512; ++v) {
        if (!leaf->isValueOn(v)) continue;
        const Coord at = leaf->offsetToGlobalCoord(v);
        if (hasSide[sets_.find(setOf(at))]) continue;
        const std::uint32_t t = triangleAt(*leaf, v), side = setOfSide(t, isInFront(t, at));
        sets_.join(setOf(at), side);
        hasSide[sets_.find(side)] = true;
      }
  }

  void numberRegions() {
    const std::uint32_t outside =
        sets_.find(setOf(Coord(low_[0] << 3, low_[1] << 3, low_[2] << 3)));
    std::vector<std::uint64_t> volumes(sets_.size());
    for (std::uint32_t n = 0; n < leaves_.size() * 512; ++n) ++volumes[sets_.find(n)];
    for (std::size_t b = 0; b < numbers_.size(); ++b)
      if (numbers_[b] < 0)
        volumes[sets_.find(static_cast<std::uint32_t>(leaves_.size() * 512 + b))] += 512;
    std::vector<std::pair<std::uint64_t, std::uint32_t>> regions;
    for (std::uint32_t n = 0; n < sets_.size(); ++n)
      if (sets_.find(n) == n && n != outside && volumes[n] > 0) regions.emplace_back(volumes[n], n);
    std::sort(regions.begin(), regions.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    if (regions.size() > std::numeric_limits<RegionLabel>::max()) {
      throw ResourceLimit(fmt::format(
          "the mesh separates {} regions, but there are 65535 labels only", regions.size()));
    }
    labels_.assign(sets_.size(), kVoid);
    for (std::size_t n = 0; n < regions.size(); ++n)
      labels_[regions[n].second] = static_cast<RegionLabel>(n + 1);
    for (std::uint32_t n = 0; n < sets_.size(); ++n) labels_[n] = labels_[sets_.find(n)];
  }

  void checkSides() {
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      const std::uint32_t behind = sets_.find(setOfSide(t, false)),
                          front = sets_.find(setOfSide(t, true));
      if (behind != front) continue;
      const V3d p = mesh_.positions[mesh_.triangles[t][0]];
      throw InvalidInput(fmt::format(
          "the mesh has the same region on both sides at {:.6g},{:.6g},{:.6g}; close holes and "
          "borders, let parts that meet share their edges, use smaller voxels, or keep such sheets "
          "with --sheets",
          p.x, p.y, p.z));
    }
  }

  [[nodiscard]] RegionLabel labelAt(const Coord& at) const {
    return isInBox(SegmentedData::blockCoord(at)) ? labels_[setOf(at)] : kVoid;
  }

  // === Meshes with sheets
  void runWithSheets(SegmentMeshResult& result) {
    constexpr int kMargin = 8;
    const Coord size = size_ + Coord(4);
    if (std::max({size[0], size[1], size[2]}) > 1 << 16)
      throw ResourceLimit("the grid around the mesh is too large; use larger voxels");
    const GridSimplices simplices(V3i(low_[0], low_[1], low_[2]) * 8 - V3i(kMargin));
    const std::vector<GridCrossing> crossings =
        findGridCrossings(points_, mesh_.triangles, simplices);
    // The edges and faces that they make, and the field.
    requireMemory(static_cast<double>(crossings.size()) * 96, memoryLeft(options_.maxMemory));
    const std::vector<convert::TrianglePair> pairs = convert::findSelfIntersections(
        mesh_.triangles, points_, subProgress(options_.progress, 0.5, 0.6));
    std::vector<bool> isCrossing(mesh_.triangles.size());
    for (const auto& [s, t] : pairs) isCrossing[s] = isCrossing[t] = true;
    joinUncrossed(simplices, crossings);
    joinSides(isCrossing);
    joinEnclosed();
    report(options_.progress, 0.7);
    numberRegions();
    listPairsWithSheets(simplices, crossings, isCrossing);
    findClosestInterfaces();
    const SheetFeatures features(points_, mesh_.triangles, pairs);
    SheetBuilder builder(
        points_, mesh_.triangles, simplices, crossings, features,
        [&](const V3i& at) { return labelAt(Coord(at.x, at.y, at.z)); },
        [&](std::uint32_t t, RegionLabel label) {
          const auto holdsOther = [&](std::uint32_t set) {
            return holdsPoints_[set] && labels_[set] != label;
          };
          return !isCrossing[t] && !holdsOther(setOfSide(t, false)) &&
                 !holdsOther(setOfSide(t, true));
        });
    std::vector<V3i> origins;
    for (const auto* leaf : leaves_)
      origins.emplace_back(leaf->origin()[0], leaf->origin()[1], leaf->origin()[2]);
    std::sort(origins.begin(), origins.end(), [](const V3i& a, const V3i& b) {
      return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
    });
    result.field = makeField(builder.run(origins));
    result.rimEdges = features.rimCount();
    result.crossingTriangles =
        static_cast<std::size_t>(std::count(isCrossing.begin(), isCrossing.end(), true));
    result.thinParts = thinPartsOf(builder.narrowGaps(), voxelSize_);
  }

  /// Joins the ends of all edges of the tetrahedra of the grid that the mesh does not cross.
  void joinUncrossed(const GridSimplices& simplices, const std::vector<GridCrossing>& crossings) {
    sets_ = DisjointSets(leaves_.size() * 512 + numbers_.size() + 2 * mesh_.triangles.size());
    std::vector<std::uint8_t> crossed(leaves_.size() * 512);
    for (const GridCrossing& crossing : crossings) {
      const V3i at = simplices.pointOf(crossing.edge);
      const std::uint32_t set = setOf(Coord(at.x, at.y, at.z));
      if (set < crossed.size())
        crossed[set] |= static_cast<std::uint8_t>(1u << GridSimplices::slotOf(crossing.edge));
    }
    for (std::uint32_t n = 0; n < crossed.size(); ++n) {
      const Coord at = leaves_[n / 512]->offsetToGlobalCoord(n % 512);
      for (std::uint32_t step = 1; step < 8; ++step)
        if (!(crossed[n] >> kuhn::edgeSlot(step) & 1))
          sets_.join(n, setOf(at + SegmentedCell::cornerOffset(static_cast<int>(step))));
    }
    joinOtherBlocks();
  }

  /// Joins the sides of neighbouring triangles, and grid points with the side to which they are
  /// closest. Leaves out triangles that cross others, whose sides lie in several regions.
  void joinSides(const std::vector<bool>& isCrossing) {
    forEachEdge(sortedSides(mesh_.triangles), [&](auto first, auto end) {
      const MeshSide &a = *first, &b = *(end - 1);
      if (end - first != 2 || isCrossing[a.triangle] || isCrossing[b.triangle]) return;
      for (const bool isFront : {false, true})
        sets_.join(setOfSide(a.triangle, isFront),
                   setOfSide(b.triangle, isFront == (a.rises != b.rises)));
    });
    for (const auto* leaf : leaves_)
      for (std::uint32_t v = 0; v < 512; ++v) {
        if (!leaf->isValueOn(v)) continue;
        const std::uint32_t t = triangleAt(*leaf, v);
        if (isCrossing[t]) continue;
        const Coord at = leaf->offsetToGlobalCoord(v);
        const std::array<V3d, 3> c = corners(t);
        if (closestOnTriangle(V3d(at[0], at[1], at[2]), c[0], c[1], c[2]).part == 6)
          sets_.join(setOf(at), setOfSide(t, perturbedSide(c, {at[0], at[1], at[2]}) > 0));
      }
  }

  /// Joins small sets of grid points, which surfaces around them cut off from their neighbours,
  /// with grid points that they see up to two voxels away. Such sets lie in narrow wedges.
  void joinEnclosed() {
    constexpr std::uint32_t kFew = 8;
    constexpr int kReach = 2;
    std::vector<std::uint32_t> sizes(sets_.size());
    for (std::uint32_t n = 0; n < leaves_.size() * 512; ++n) ++sizes[sets_.find(n)];
    for (std::uint32_t n = 0; n < leaves_.size() * 512; ++n) {
      if (sizes[sets_.find(n)] > kFew) continue;
      const Coord at = leaves_[n / 512]->offsetToGlobalCoord(n % 512);
      for (int x = -kReach; x <= kReach; ++x)
        for (int y = -kReach; y <= kReach; ++y)
          for (int z = -kReach; z <= kReach; ++z) {
            const Coord to = at.offsetBy(x, y, z);
            if (sets_.find(n) != sets_.find(setOf(to)) && near_.sees(at, to))
              sets_.join(n, setOf(to));
          }
    }
  }

  /// Lists the pairs of regions that each triangle separates. Where triangles cross each other,
  /// only edges of the grid tell.
  void listPairsWithSheets(const GridSimplices& simplices,
                           const std::vector<GridCrossing>& crossings,
                           const std::vector<bool>& isCrossing) {
    using Entry = std::pair<std::uint32_t, std::pair<RegionLabel, RegionLabel>>;
    // For all numbers, so that threads only read.
    std::vector<char> holds(sets_.size());
    for (std::uint32_t n = 0; n < leaves_.size() * 512; ++n) holds[sets_.find(n)] = true;
    holdsPoints_.resize(sets_.size());
    for (std::uint32_t n = 0; n < sets_.size(); ++n) holdsPoints_[n] = holds[sets_.find(n)];
    std::vector<Entry> entries;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      const std::uint32_t behind = setOfSide(t, false), front = setOfSide(t, true);
      if (!isCrossing[t] && labels_[behind] != labels_[front] && holdsPoints_[behind] &&
          holdsPoints_[front])
        entries.push_back({t, std::minmax(labels_[behind], labels_[front])});
    }
    for (std::size_t n = 0; n < crossings.size(); ++n) {
      const GridSimplices::Key edge = crossings[n].edge;
      if ((n > 0 && crossings[n - 1].edge == edge) ||
          (n + 1 < crossings.size() && crossings[n + 1].edge == edge))
        continue;
      const V3i at = simplices.pointOf(edge),
                to = at + offsetOfCorner(GridSimplices::slotOf(edge) + 1);
      const RegionLabel a = labelAt(Coord(at.x, at.y, at.z)), b = labelAt(Coord(to.x, to.y, to.z));
      if (a != b) entries.push_back({crossings[n].triangle, std::minmax(a, b)});
    }
    std::sort(entries.begin(), entries.end());
    entries.erase(std::unique(entries.begin(), entries.end()), entries.end());
    firstPair_.assign(mesh_.triangles.size() + 1, 0);
    for (const Entry& entry : entries) {
      ++firstPair_[entry.first + 1];
      pairs_.push_back({entry.second.first, entry.second.second});
    }
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) firstPair_[t + 1] += firstPair_[t];
  }

  /// Computes the distances to the triangles that separate regions, without those of sheets.
  void findClosestInterfaces() {
    TriMesh interfaces;
    interfaces.positions = mesh_.positions;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (firstPair_[t] == firstPair_[t + 1]) continue;
      interfaces.triangles.push_back(mesh_.triangles[t]);
      originals_.push_back(t);
    }
    nearIndex_ = nullptr;
    nearVector_ = nullptr;
    if (interfaces.triangles.empty()) return;
    const ClosestTriangles closest =
        closestTriangles(interfaces, voxelSize_,
                         {.halfWidth = options_.halfWidth + 1,
                          .maxMemory = options_.maxMemory,
                          .progress = subProgress(options_.progress, 0.7, 0.8)});
    nearIndex_ = closest.triangle.shared()->scalar;
    nearVector_ = closest.vector.shared()->vector;
  }

  /// Lists the pair of regions of each triangle of a mesh without sheets.
  void listPairs() {
    firstPair_.resize(mesh_.triangles.size() + 1);
    std::iota(firstPair_.begin(), firstPair_.end(), 0u);
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      pairs_.push_back({labelOfSide(t, false), labelOfSide(t, true)});
  }

  SegmentedField makeField(std::shared_ptr<const SheetData> sheets) {
    const float background = backgroundOf(options_.halfWidth, voxelSize_);
    const auto tiles = std::make_shared<openvdb::Int32Tree>(SegmentedData::tile(kVoid));
    for (std::size_t b = 0; b < numbers_.size(); ++b) {
      const RegionLabel label = labels_[leaves_.size() * 512 + b];
      if (numbers_[b] < 0 && label != kVoid)
        tiles->setValueOff(blockAt(b), SegmentedData::tile(label));
    }
    std::vector<PackedBlock> blocks(leaves_.size());
    tbb::parallel_for(std::size_t{0}, leaves_.size(),
                      [&](std::size_t n) { blocks[n] = makeBlock(*leaves_[n], background); });
    std::sort(blocks.begin(), blocks.end(),
              [](const auto& a, const auto& b) { return a.block.origin < b.block.origin; });
    return assembleSegmented(index_->transform().copy(), options_.halfWidth, tiles,
                             std::move(blocks), std::move(sheets));
  }

  [[nodiscard]] PackedBlock makeBlock(const openvdb::FloatTree::LeafNodeType& leaf,
                                      float background) const {
    SegmentedBlockValues values;
    values.origin = leaf.origin();
    BlockSurroundings around;
    around.fill([&](int i, int j, int k, int x, int y, RegionLabel* row) {
      for (int z = 0; z < 8; ++z)
        row[z] = labelAt(leaf.origin() + Coord(8 * i + x, 8 * j + y, 8 * k + z));
    });
    around.findNeighbours();
    const auto* near = nearIndex_ ? nearIndex_->tree().probeConstLeaf(leaf.origin()) : nullptr;
    const auto* vectors = near ? nearVector_->tree().probeConstLeaf(leaf.origin()) : nullptr;
    std::vector<RegionLabel> others;
    for (std::uint32_t n = 0; n < 512; ++n) {
      const Coord local = SegmentedData::localOf(n);
      const RegionLabel own = around.at(local[0], local[1], local[2]);
      values.labels[n] = values.neighbours[n] = own;
      values.distances[n] = background;
      if (!near || !near->isValueOn(n)) continue;
      const auto distance = static_cast<float>(lengthOf(vectors->getValue(n)) * voxelSize_);
      if (around.palette().size() > 1) around.others(n, own, 1, others);
      const std::uint32_t t = triangleAt(*near, n);
      const RegionLabel neighbour =
          neighbourAcross(originals_.empty() ? t : originals_[t], own, others);
      values.neighbours[n] = neighbour;
      values.distances[n] =
          others.empty() ? distance : std::min(distance, std::nextafter(background, 0.0f));
      for (const RegionLabel other : others)
        if (other != neighbour)
          values.extras.push_back(
              {static_cast<std::uint16_t>(n), other,
               std::min(background, distanceTo(leaf.origin() + local, own, other))});
    }
    return packBlock(values, background);
  }
  [[nodiscard]] RegionLabel labelOfSide(std::uint32_t triangle, bool isFront) const {
    return labels_[setOfSide(triangle, isFront)];
  }

  /// Region on the other side of a triangle.
  [[nodiscard]] RegionLabel neighbourAcross(std::uint32_t triangle, RegionLabel own,
                                            const std::vector<RegionLabel>& others) const {
    for (std::uint32_t n = firstPair_[triangle]; n < firstPair_[triangle + 1]; ++n)
      for (std::size_t side = 0; side < 2; ++side)
        if (pairs_[n][side] == own) return pairs_[n][1 - side];
    // At a junction the closest triangle may belong to any of the interfaces.
    return others.empty() ? pairs_[firstPair_[triangle]][0] : others[0];
  }
  [[nodiscard]] bool separates(std::uint32_t triangle, RegionLabel a, RegionLabel b) const {
    for (std::uint32_t n = firstPair_[triangle]; n < firstPair_[triangle + 1]; ++n)
      if (std::minmax(pairs_[n][0], pairs_[n][1]) == std::minmax(a, b)) return true;
    return false;
  }

  /// Distance of a grid point to the triangles between two regions, world units.
  [[nodiscard]] float distanceTo(const Coord& at, RegionLabel own, RegionLabel other) const {
    constexpr int kReach = 2;
    const V3d p(at[0], at[1], at[2]);
    double least = std::numeric_limits<double>::infinity();
    for (int x = -kReach; x <= kReach; ++x)
      for (int y = -kReach; y <= kReach; ++y)
        for (int z = -kReach; z <= kReach; ++z)
          for (const auto& entry : near_.at(at.offsetBy(x, y, z))) {
            if (!separates(entry.second, own, other)) continue;
            const std::array<V3d, 3> c = corners(entry.second);
            least = std::min(least, (closestOnTriangle(p, c[0], c[1], c[2]).point - p).length());
          }
    return static_cast<float>(least * voxelSize_);
  }

  const TriMesh& mesh_;
  double voxelSize_;
  const SegmentMeshOptions& options_;
  std::vector<V3d> points_;             ///< voxels
  std::vector<std::uint32_t> patchOf_;  ///< by triangle: the first one of its patch
  std::size_t patchCount_ = 0;
  openvdb::FloatGrid::ConstPtr index_;
  openvdb::Vec3SGrid::ConstPtr vector_;
  // The same for triangles that separate regions.
  openvdb::FloatGrid::ConstPtr nearIndex_;
  openvdb::Vec3SGrid::ConstPtr nearVector_;
  std::vector<std::uint32_t> originals_;  ///< numbers of these triangles; empty: all of the mesh
  std::vector<std::uint32_t> firstPair_;  ///< by triangle, and one more for the end
  std::vector<std::array<RegionLabel, 2>> pairs_;  ///< regions that triangles separate
  std::vector<const openvdb::FloatTree::LeafNodeType*> leaves_;
  Coord low_, size_;  ///< box of blocks
  std::vector<std::int32_t> numbers_;
  NearTriangles near_;
  DisjointSets sets_;
  std::vector<RegionLabel> labels_;
  std::vector<char> holdsPoints_;  ///< by number: grid points belong to its set
};

}  // namespace

SegmentMeshResult segmentMesh(const TriMesh& mesh, double voxelSize,
                              const SegmentMeshOptions& options) {
  if (!(options.halfWidth >= 2 && options.halfWidth <= 8)) {
    throw UsageError(fmt::format("the half width is {} voxels; give 2 to 8", options.halfWidth));
  }
  convert::checkElements(mesh);
  TriMesh welded;
  welded.positions = mesh.positions;
  welded.triangles = withoutDoubles(convert::findTopology(mesh).triangles);
  if (welded.isEmpty()) throw InvalidInput("the mesh has no triangle with an area");
  return MeshRegions(welded, voxelSize, options).run();
}

}  // namespace levelset
