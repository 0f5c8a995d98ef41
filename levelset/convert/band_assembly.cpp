#include "levelset/convert/band_assembly.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>

#include "levelset/convert/prisms/prism_scan.h"
#include "levelset/convert/surface_blocks.h"
#include "levelset/mesh_sign/triangle_distance.h"

namespace levelset::convert {
namespace {

using Imath::V3d;
using Imath::V3i;
using openvdb::Coord;
using openvdb::FloatTree;
using LeafNode = FloatTree::LeafNodeType;

static_assert(LeafNode::DIM == kBlockDim && LeafNode::SIZE == kBlockVoxels);

using Root = FloatTree::RootNodeType;
using Upper = Root::ChildNodeType;
using Lower = Upper::ChildNodeType;

/// Distance below which a grid point counts as on the surface, voxels. It is far below the accuracy
/// of the distances and far above their rounding error.
constexpr double kOnSurface = 1e-6;

Coord toCoord(const V3i& p) {
  return {p.x, p.y, p.z};
}
V3i toV3i(const Coord& p) {
  return {p.x(), p.y(), p.z()};
}

/// Computes leaves in several threads, each with its own list, and assembles them into a grid.
class LeafCollector {
 public:
  LeafCollector(double reach, double voxelSize, std::size_t maxMemory)
      : voxelSize_(voxelSize), background_(backgroundOf(reach, voxelSize)), maxMemory_(maxMemory) {}

  /// @param distance  measures the grid points of a block, BlockDistance or PrismScan
  template <typename Distance>
  void add(Distance& distance, const LocalMesh& surface, const SignField& field, const V3i& block,
           std::span<const std::uint32_t> candidates, const V3i& origin, double reach) {
    if (!distance.measure(surface, candidates, V3d(block))) return;
    SignField::BlockWinding winding;
    field.winding(block, winding);
    auto leaf = std::make_unique<LeafNode>(toCoord(block + origin), background_, false);
    float* values = leaf->buffer().data();
    for (openvdb::Index i = 0; i < LeafNode::SIZE; ++i) {
      // A grid point on the surface gets distance 0 and so counts as outside. Otherwise rounding
      // could leave isolated inside points.
      const double d = distance.distances()[i] < kOnSurface ? 0 : distance.distances()[i];
      const bool isActive = d < reach;
      const float value =
          isActive ? std::min(static_cast<float>(d * voxelSize_), background_) : background_;
      values[i] = winding[i] > 0.5 && value > 0 ? -value : value;
      if (isActive) leaf->setValueOn(i);
    }
    leaves_.local().push_back(std::move(leaf));
    constexpr std::size_t kStep = 4096;
    const std::size_t count = count_.fetch_add(1, std::memory_order_relaxed) + 1;
    if (count % kStep == 0)
      requireMemory(static_cast<double>(count) * sizeof(LeafNode) +
                        static_cast<double>(count) * LeafNode::SIZE * sizeof(float),
                    maxMemory_);
  }

  openvdb::FloatGrid::Ptr finish(double halfWidth) {
    std::vector<std::unique_ptr<LeafNode>> all;
    for (auto& part : leaves_)
      for (auto& leaf : part) all.push_back(std::move(leaf));
    std::sort(all.begin(), all.end(),
              [](const auto& a, const auto& b) { return a->origin() < b->origin(); });
    auto grid = emptyLevelSet(uniformTransform(voxelSize_), halfWidth);
    for (auto& leaf : all) grid->tree().addLeaf(leaf.release());
    return grid;
  }

 private:
  double voxelSize_;
  float background_;
  std::size_t maxMemory_;
  std::atomic<std::size_t> count_{0};
  tbb::enumerable_thread_specific<std::vector<std::unique_ptr<LeafNode>>> leaves_;
};

using Region = std::optional<openvdb::CoordBBox>;

/// Computes the signs of the tiles of a node. The grid points of a tile lie at least a voxel from
/// the surface, so adjacent tiles have the same sign. Only a tile without an adjacent tile before
/// it on an axis evaluates the winding number. Where `region`, the index box to compute, covers a
/// part of a tile, the sign is that of this part; the parts of two adjacent tiles are adjacent too.
template <typename Node>
void signTiles(Node& node, const SignField& field, const V3i& origin, float background,
               const Region& region) {
  constexpr openvdb::Index kZ = 1, kY = 1u << Node::LOG2DIM, kX = 1u << (2 * Node::LOG2DIM);
  // −1: inside, 1: outside, 0: a child node, or a tile outside the region.
  std::vector<signed char> side(Node::NUM_VALUES, 0);
  for (auto it = node.beginValueAll(); it; ++it) {
    const openvdb::Index n = it.pos();
    signed char& s = side[n];
    Coord at = it.getCoord();
    if (region) {
      const Coord last = at.offsetBy(static_cast<int>(Node::ChildNodeType::DIM) - 1);
      if (!region->hasOverlap({at, last})) {
        it.setValue(background);
        continue;
      }
      at.maxComponent(region->min());
    }
    if (n % kY != 0) s = side[n - kZ];
    if (s == 0 && n % kX >= kY) s = side[n - kY];
    if (s == 0 && n >= kX) s = side[n - kX];
    if (s == 0) s = field.isInside(toV3i(at) - origin) ? -1 : 1;
    it.setValue(s < 0 ? -background : background);
  }
}

template <typename Node>
void signTilesOfAll(FloatTree& tree, const SignField& field, const V3i& origin, float background,
                    const Region& region) {
  std::vector<Node*> nodes;
  tree.getNodes(nodes);
  tbb::parallel_for(std::size_t{0}, nodes.size(), [&](std::size_t i) {
    signTiles(*nodes[i], field, origin, background, region);
  });
}

/// Adds the root tiles inside the solid. They form rows along x between two child nodes, since only
/// child nodes contain the surface.
void signRootTiles(FloatTree& tree, const SignField& field, const V3i& origin, float background) {
  std::vector<Coord> keys;
  for (auto it = tree.root().cbeginChildOn(); it; ++it) keys.push_back(it->origin());
  std::sort(keys.begin(), keys.end(), [](const Coord& a, const Coord& b) {
    return std::make_tuple(a.y(), a.z(), a.x()) < std::make_tuple(b.y(), b.z(), b.x());
  });
  constexpr std::int64_t kDim = Upper::DIM;
  for (std::size_t i = 0; i + 1 < keys.size(); ++i) {
    const Coord &from = keys[i], &to = keys[i + 1];
    if (from.y() != to.y() || from.z() != to.z() || to.x() - kDim == from.x()) continue;
    const Coord first(static_cast<int>(from.x() + kDim), from.y(), from.z());
    if (!field.isInside(toV3i(first) - origin)) continue;
    for (std::int64_t x = first.x(); x < to.x(); x += kDim)
      tree.root().addTile(Coord(static_cast<int>(x), from.y(), from.z()), -background, false);
  }
}

/// Adds the root tiles inside the solid that intersect the region. Evaluates the sign of each,
/// because with a region a row of tiles need not end at a child node.
void signRootTilesIn(const openvdb::CoordBBox& region, FloatTree& tree, const SignField& field,
                     const V3i& origin, float background) {
  constexpr int kDim = static_cast<int>(Upper::DIM);
  const Coord first = region.min() & ~(kDim - 1);
  for (std::int64_t x = first.x(); x <= region.max().x(); x += kDim)
    for (std::int64_t y = first.y(); y <= region.max().y(); y += kDim)
      for (std::int64_t z = first.z(); z <= region.max().z(); z += kDim) {
        const Coord at(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z));
        if (tree.probeConstNode<Upper>(at)) continue;
        const Coord within(std::max(at.x(), region.min().x()), std::max(at.y(), region.min().y()),
                           std::max(at.z(), region.min().z()));
        if (field.isInside(toV3i(within) - origin)) tree.root().addTile(at, -background, false);
      }
}

}  // namespace

openvdb::FloatGrid::Ptr assembleBand(const LocalMesh& surface, const SignField& field,
                                     const V3i& origin, double voxelSize, double halfWidth,
                                     DistanceMethod method,
                                     const std::optional<openvdb::CoordBBox>& region,
                                     std::size_t maxMemory, const Progress& progress) {
  std::optional<Imath::Box3i> visited;
  if (region) visited = {toV3i(region->min()) - origin, toV3i(region->max()) - origin};
  LeafCollector collector(halfWidth, voxelSize, maxMemory);
  // Each thread measures with a copy of `distance`.
  const auto collect = [&](const auto& distance, const CellTest& isNeeded) {
    tbb::enumerable_thread_specific<std::decay_t<decltype(distance)>> scratch(distance);
    forEachBlock(
        surface, halfWidth,
        [&](const V3i& block, std::span<const std::uint32_t> candidates) {
          collector.add(scratch.local(), surface, field, block, candidates, origin, halfWidth);
        },
        progress, visited, isNeeded);
  };
  if (method == DistanceMethod::Prisms) {
    const PrismCovering prisms(surface, halfWidth);
    collect(PrismScan(prisms), prismTest(surface, prisms));
  } else {
    collect(BlockDistance(halfWidth), {});
  }
  openvdb::FloatGrid::Ptr grid = collector.finish(halfWidth);
  const float background = grid->background();
  signTilesOfAll<Lower>(grid->tree(), field, origin, background, region);
  signTilesOfAll<Upper>(grid->tree(), field, origin, background, region);
  if (region)
    signRootTilesIn(*region, grid->tree(), field, origin, background);
  else
    signRootTiles(grid->tree(), field, origin, background);
  return grid;
}

double ambiguousShare(const openvdb::FloatGrid& grid, const SignField& field, const V3i& origin) {
  if (!field.isOpen()) return 0;
  std::vector<const LeafNode*> leaves;
  grid.tree().getNodes(leaves);
  // For each leaf, the numbers of voxels next to the zero set and of ambiguous ones among them.
  std::vector<std::array<std::size_t, 2>> counts(leaves.size());
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t n) {
    const LeafNode& leaf = *leaves[n];
    const V3i block = toV3i(leaf.origin()) - origin;
    const bool clear = field.isUnambiguousIn(block);
    SignField::BlockWinding winding;
    if (!clear) field.winding(block, winding);
    auto accessor = grid.getConstAccessor();
    for (auto it = leaf.cbeginValueOn(); it; ++it) {
      bool atZero = false;
      for (int k = 0; k < 6 && !atZero; ++k) {
        Coord next = it.getCoord();
        next[k / 2] += k % 2 ? 1 : -1;
        atZero = (accessor.getValue(next) < 0) != (*it < 0);
      }
      counts[n][0] += atZero;
      counts[n][1] += atZero && !clear && std::abs(winding[it.pos()] - 0.5) < 0.25;
    }
  });
  std::array<std::size_t, 2> sum{};
  for (const auto& c : counts) sum[0] += c[0], sum[1] += c[1];
  return sum[0] ? static_cast<double>(sum[1]) / static_cast<double>(sum[0]) : 1;
}

}  // namespace levelset::convert
