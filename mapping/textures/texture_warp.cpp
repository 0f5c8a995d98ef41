#include "mapping/textures/texture_warp.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <iterator>
#include <memory>
#include <vector>

#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/progress_gate.h"
#include "levelset/transform/resample_vdb.h"
#include "levelset/vdb.h"
#include "mapping/maps/layer_map.h"

namespace mapping {
namespace {

using Imath::Box3d;
using Imath::M33d;
using Imath::V3d;
using openvdb::Coord;
using openvdb::CoordBBox;
using LeafNode = openvdb::FloatTree::LeafNodeType;

constexpr int kRootEdge = 64;  // grid points along a block at the top of the hierarchy
constexpr double kLeafBytes = sizeof(LeafNode) + LeafNode::SIZE * sizeof(float);

/// Summed-area table of the leaf nodes of a texture's grid: counts the leaves in a box in constant
/// time. A cell of the table has 2^shift_ voxels along each axis.
class Occupancy {
 public:
  explicit Occupancy(const openvdb::FloatGrid& grid) : grid_(grid) {
    CoordBBox box;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) box.expand(leaf->origin());
    constexpr double kMostCells = 1 << 25;
    for (shift_ = 3;; ++shift_) {
      origin_ = cell(box.min());
      size_ = cell(box.max()) - origin_ + Coord(1);
      if (static_cast<double>(size_.x()) * size_.y() * size_.z() <= kMostCells) break;
    }
    sums_.assign(index(size_) + 1, 0);
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
      sums_[index(cell(leaf->origin()) - origin_ + Coord(1))] += 1;
    for (int axis = 0; axis < 3; ++axis) accumulate(axis);
  }

  /// True if a leaf node meets a box of world coordinates, widened by `pad` voxels.
  [[nodiscard]] bool touches(const Box3d& world, double pad) const {
    openvdb::Vec3d low(std::numeric_limits<double>::max()), high(-low);
    for (int corner = 0; corner < 8; ++corner) {
      const openvdb::Vec3d p = grid_.worldToIndex(openvdb::Vec3d(
          corner & 1 ? world.max.x : world.min.x, corner & 2 ? world.max.y : world.min.y,
          corner & 4 ? world.max.z : world.min.z));
      low = openvdb::math::minComponent(low, p);
      high = openvdb::math::maxComponent(high, p);
    }
    Coord a, b;
    for (int axis = 0; axis < 3; ++axis) {
      const double first = std::floor((low[axis] - pad) / (1 << shift_)) - origin_[axis];
      const double last = std::floor((high[axis] + pad) / (1 << shift_)) - origin_[axis];
      if (!(last >= 0) || !(first < size_[axis])) return false;
      a[axis] = static_cast<int>(std::max(first, 0.0));
      b[axis] = static_cast<int>(std::min(last, size_[axis] - 1.0)) + 1;
    }
    std::uint32_t count = 0;  // may wrap around temporarily
    for (int corner = 0; corner < 8; ++corner) {
      const Coord c(corner & 1 ? a.x() : b.x(), corner & 2 ? a.y() : b.y(),
                    corner & 4 ? a.z() : b.z());
      const bool isNegative = ((corner & 1) + (corner >> 1 & 1) + (corner >> 2 & 1)) % 2 == 1;
      count += isNegative ? 0u - sums_[index(c)] : sums_[index(c)];
    }
    return count != 0;
  }

 private:
  Coord cell(const Coord& c) const { return c >> static_cast<std::size_t>(shift_); }
  std::size_t index(const Coord& c) const {
    const auto wide = [](int x) { return static_cast<std::size_t>(x); };
    return (wide(c.x()) * (wide(size_.y()) + 1) + wide(c.y())) * (wide(size_.z()) + 1) +
           wide(c.z());
  }
  void accumulate(int axis) {
    Coord step(0);
    step[axis] = 1;
    for (int x = step.x(); x <= size_.x(); ++x)
      for (int y = step.y(); y <= size_.y(); ++y)
        for (int z = step.z(); z <= size_.z(); ++z)
          sums_[index({x, y, z})] += sums_[index(Coord(x, y, z) - step)];
  }

  const openvdb::FloatGrid& grid_;
  int shift_ = 3;
  Coord origin_, size_;
  // Number of leaves in all cells of the table with smaller indices along every axis; one entry
  // more than cells along each axis.
  std::vector<std::uint32_t> sums_;
};

struct Block {
  Coord origin;
  int edge;
};

/// Hash of the coordinates by the finaliser of SplitMix64.
std::uint64_t hashOf(const Coord& c) {
  std::uint64_t hash = 0;
  for (int axis = 0; axis < 3; ++axis) {
    hash += 0x9e3779b97f4a7c15ull + static_cast<std::uint64_t>(static_cast<std::uint32_t>(c[axis]));
    hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9ull;
    hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebull;
    hash ^= hash >> 31;
  }
  return hash;
}

enum class Meets { Nothing, Inside, Band };

/// Results for one root block or a part of it.
struct Piece {
  std::vector<std::unique_ptr<LeafNode>> leaves;
  std::vector<Block> inside;  ///< blocks that lie completely inside the warped texture
  std::size_t tested = 0, ghosts = 0, operations = 0, checked = 0;
  /// Largest error of the map's fast evaluation, texture voxels.
  double mapError = 0;

  void add(Piece&& part) {
    std::move(part.leaves.begin(), part.leaves.end(), std::back_inserter(leaves));
    inside.insert(inside.end(), part.inside.begin(), part.inside.end());
    tested += part.tested;
    ghosts += part.ghosts;
    operations += part.operations;
    checked += part.checked;
    mapError = std::max(mapError, part.mapError);
  }
};

/// Evaluates a warped texture on the grid of the result.
class TextureWarp {
 public:
  TextureWarp(const levelset::NarrowBand& texture, const TexturePlacement& placement,
              const Patch& patch, const PatchMap& map, const WarpOptions& options)
      : texture_(texture),
        placement_(placement),
        patch_(patch),
        map_(map),
        options_(options),
        occupancy_(levelset::vdb(texture)),
        textureBackground_(texture.halfWidth() * texture.voxelSize()),
        ghostDistance_(1.5 * longestCellEdge(patch)) {
    transform_ = levelset::transformOf(options.indexToWorld);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) step_[i][j] = options.indexToWorld[i][j];
    const V3d size = placement.box.size();
    tolerance_ = options.mapTolerance * texture.voxelSize() / std::max({size.x, size.y, size.z});
  }

  Warp run() {
    const double halfWidth = textureBackground_ * options_.scale / transform_->voxelSize()[0];
    const openvdb::FloatGrid::Ptr grid = levelset::emptyLevelSet(transform_->copy(), halfWidth);
    background_ = grid->background();

    const std::vector<Block> roots = rootBlocks();
    std::vector<Piece> pieces(roots.size());
    levelset::ProgressGate gate(options_.progress, 8 * roots.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, roots.size(), 1), [&](const auto& range) {
      for (std::size_t n = range.begin(); n != range.end(); ++n)
        pieces[n] = descendRoot(roots[n], gate);
    });

    Warp warp;
    for (Piece& piece : pieces) {
      for (const Block& block : piece.inside)
        grid->sparseFill(CoordBBox::createCube(block.origin, block.edge), -background_, false);
      for (std::unique_ptr<LeafNode>& leaf : piece.leaves) grid->tree().addLeaf(leaf.release());
      warp.blocksTested += piece.tested;
      warp.blocksEvaluated += piece.leaves.size();
      warp.ghosts += piece.ghosts;
      warp.operations += piece.operations;
      warp.checked += piece.checked;
      warp.mapError = std::max(warp.mapError, piece.mapError);
    }
    if (warp.blocksEvaluated == 0) {
      throw levelset::InvalidInput(
          "no part of the texture falls into the patch; check --texture-box and --embed");
    }
    warp.crumbs = dropCrumbs(*grid);
    warp.field = levelset::makeBand(grid);
    return warp;
  }

  /// Removes isolated inside grid points. Where a face of the texture coincides with a plane of the
  /// grid, rounding errors of the map decide the sign of the points on it. Each of them could
  /// become a separate solid. If the warped texture has no other inside points, the isolated ones
  /// are kept.
  /// @return number of removed points
  static std::size_t dropCrumbs(openvdb::FloatGrid& grid) {
    constexpr double kDepth = 0.1;  // voxels; deeper points are not due to rounding
    const auto deepest = static_cast<float>(-kDepth * grid.voxelSize()[0]);
    const auto accessor = grid.getConstAccessor();
    std::vector<Coord> crumbs;
    std::size_t inside = 0;
    for (auto it = grid.cbeginValueOn(); it; ++it) {
      if (*it >= 0) continue;
      ++inside;
      if (*it < deepest) continue;
      const Coord c = it.getCoord();
      bool isAlone = true;
      for (int axis = 0; axis < 3 && isAlone; ++axis)
        for (const int step : {-1, 1}) {
          Coord next = c;
          next[axis] += step;
          isAlone = isAlone && accessor.getValue(next) >= 0;
        }
      if (isAlone) crumbs.push_back(c);
    }
    if (crumbs.size() == inside) return 0;
    auto writer = grid.getAccessor();
    for (const Coord& c : crumbs) writer.setValue(c, -writer.getValue(c));
    return crumbs.size();
  }

 private:
  V3d world(const openvdb::Vec3d& index) const {
    return levelset::toImath(transform_->indexToWorld(index));
  }

  /// Blocks of kRootEdge³ grid points, aligned to multiples of kRootEdge, that cover the image of
  /// the texture's band under the layer map (see layerPosition). A margin of ghostDistance_ allows
  /// for the difference between the layer map and the map that is evaluated.
  std::vector<Block> rootBlocks() const {
    const openvdb::FloatGrid& grid = levelset::vdb(texture_);
    const CoordBBox active = grid.evalActiveVoxelBoundingBox();
    Box3d uvw;
    for (int corner = 0; corner < 8; ++corner) {
      const openvdb::Vec3d p(corner & 1 ? active.max().x() : active.min().x(),
                             corner & 2 ? active.max().y() : active.min().y(),
                             corner & 4 ? active.max().z() : active.min().z());
      uvw.extendBy(placement_.toUvw(levelset::toImath(grid.indexToWorld(p))));
    }
    constexpr int kSamples = 24;
    openvdb::BBoxd box;
    for (int i = 0; i <= kSamples; ++i)
      for (int j = 0; j <= kSamples; ++j)
        for (int k = 0; k <= kSamples; ++k) {
          const V3d t = uvw.min + uvw.size() * V3d(i, j, k) / kSamples;
          box.expand(transform_->worldToIndex(levelset::toVdb(layerPosition(patch_, t))));
        }
    box.expand(ghostDistance_ / transform_->voxelSize()[0]);
    constexpr double kMostIndex = 1e9;
    double count = 1;
    for (int axis = 0; axis < 3; ++axis) {
      count *= box.extents()[axis] / kRootEdge + 2;
      if (!(std::abs(box.min()[axis]) < kMostIndex) || !(std::abs(box.max()[axis]) < kMostIndex)) {
        throw levelset::ResourceLimit(
            fmt::format("with a voxel size of {:.3g} the grid exceeds the range of 32-bit "
                        "indices; use larger voxels",
                        transform_->voxelSize()[0]));
      }
    }
    levelset::requireMemory(count * (sizeof(Block) + sizeof(Piece)), options_.maxMemory);
    std::vector<Block> blocks;
    const Coord low = Coord::floor(box.min()) & ~(kRootEdge - 1), high = Coord::ceil(box.max());
    for (int x = low.x(); x <= high.x(); x += kRootEdge)
      for (int y = low.y(); y <= high.y(); y += kRootEdge)
        for (int z = low.z(); z <= high.z(); z += kRootEdge)
          blocks.push_back({{x, y, z}, kRootEdge});
    return blocks;
  }

  /// Samplers of the texture for one thread.
  struct Samplers {
    explicit Samplers(const levelset::NarrowBand& texture)
        : linear(texture), cubic(texture, levelset::Interpolation::Tricubic) {}
    levelset::BandSampler linear, cubic;
  };

  Piece descendRoot(const Block& root, levelset::ProgressGate& gate) {
    Piece piece;
    const V3d origin = world(root.origin.asVec3d());
    const std::unique_ptr<BlockMap> map = map_.restrictTo({origin, step_, root.edge}, tolerance_);
    if (!splits(root, *map, Samplers(texture_), piece)) {
      gate.advance(8);
      return piece;
    }
    std::array<Piece, 8> parts;
    tbb::parallel_for(0, 8, [&](int bits) {
      const Samplers samplers(texture_);
      descend(octant(root, bits), *map->octant(bits), samplers,
              parts[static_cast<std::size_t>(bits)]);
      gate.advance(1);
    });
    for (Piece& part : parts) piece.add(std::move(part));
    return piece;
  }

  void descend(const Block& block, const BlockMap& map, const Samplers& samplers, Piece& piece) {
    if (!splits(block, map, samplers, piece)) return;
    if (block.edge == GridBlock::kLeafEdge) {
      requireLeaves(++leafCount_);
      piece.leaves.push_back(std::make_unique<LeafNode>(block.origin, background_, false));
      fillLeaf(*piece.leaves.back(), map, samplers, piece);
      return;
    }
    for (int bits = 0; bits < 8; ++bits)
      descend(octant(block, bits), *map.octant(bits), samplers, piece);
  }

  /// True if the block must be subdivided or evaluated. Records the block if it lies completely
  /// inside the warped texture.
  bool splits(const Block& block, const BlockMap& map, const Samplers& samplers,
              Piece& piece) const {
    ++piece.tested;
    const Meets meets = testBlock(block, map, samplers);
    if (meets == Meets::Inside) piece.inside.push_back(block);
    return meets == Meets::Band;
  }

  static Block octant(const Block& block, int bits) {
    const int half = block.edge / 2;
    return {block.origin.offsetBy(bits & 4 ? half : 0, bits & 2 ? half : 0, bits & 1 ? half : 0),
            half};
  }

  void requireLeaves(std::size_t count) const {
    // Up to three fields have these leaves: the warped field, its copy while distances are
    // restored, and the result.
    levelset::requireMemory(static_cast<double>(count) * 3 * kLeafBytes, options_.maxMemory);
  }

  Meets testBlock(const Block& block, const BlockMap& map, const Samplers& samplers) const {
    const Box3d uvw = map.imageBounds();
    if (uvw.isEmpty()) return Meets::Nothing;
    const Box3d image(placement_.toTexture(uvw.min), placement_.toTexture(uvw.max));
    if (occupancy_.touches(image, 1)) return Meets::Band;
    const V3d middle = uvw.center();
    if (samplers.linear.value(placement_.toTexture(middle)) >= 0) return Meets::Nothing;
    if (!map.isTotal()) return Meets::Band;
    const V3d center = world(block.origin.asVec3d() + openvdb::Vec3d(0.5 * (block.edge - 1)));
    return isGhost(center, middle) ? Meets::Nothing : Meets::Inside;
  }

  /// True if the map sends a point far from the particles back into the texture. The layer map then
  /// maps the resulting u, v, w to a position far from the point.
  bool isGhost(const V3d& place, const V3d& uvw) const {
    return !map_.isLocal() && (layerPosition(patch_, uvw) - place).length() > ghostDistance_;
  }

  void fillLeaf(LeafNode& leaf, const BlockMap& map, const Samplers& samplers, Piece& piece) const {
    std::array<V3d, LeafNode::SIZE> uvw;
    piece.operations += map.evaluate(uvw);
    checkAgainstDirect(leaf, uvw, piece);
    const double rim = textureBackground_ * (1 - 1e-6);
    for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) {
      if (std::isnan(uvw[n].x)) continue;
      const V3d place = placement_.toTexture(uvw[n]);
      double value = samplers.linear.value(place);
      if (value >= rim) continue;
      const openvdb::Vec3d index = leaf.offsetToGlobalCoord(n).asVec3d();
      if (isGhost(world(index), uvw[n])) {
        ++piece.ghosts;
        continue;
      }
      if (value > -rim) value = samplers.cubic.value(place);
      const float scaled = static_cast<float>(value * options_.scale);
      if (scaled <= -background_) {
        leaf.setValueOff(n, -background_);
      } else if (scaled < background_) {
        leaf.setValueOn(n, scaled);
      }
    }
  }

  /// Evaluates the map directly, without the block's expansion, at one point of some leaves, chosen
  /// by a hash of their coordinates. So the choice does not depend on the threads. The cost is
  /// about a twentieth of that of the fast evaluations.
  void checkAgainstDirect(const LeafNode& leaf, const std::array<V3d, LeafNode::SIZE>& uvw,
                          Piece& piece) const {
    if (map_.isLocal()) return;  // a prism map has no approximate evaluation
    constexpr std::uint64_t kParticlesOfLeaf = 250;
    const std::uint64_t hash = hashOf(leaf.origin());
    const std::uint64_t every = 1 + patch_.particleCount() / kParticlesOfLeaf;
    if ((hash >> 32) % every != 0) return;
    const auto n = static_cast<openvdb::Index>(hash % LeafNode::SIZE);
    const V3d direct = map_(world(leaf.offsetToGlobalCoord(n).asVec3d()));
    if (std::isnan(uvw[n].x) || std::isnan(direct.x)) return;
    const V3d off = (uvw[n] - direct) * placement_.box.size();
    ++piece.checked;
    piece.mapError = std::max(piece.mapError, off.length() / texture_.voxelSize());
  }

  const levelset::NarrowBand& texture_;
  const TexturePlacement& placement_;
  const Patch& patch_;
  const PatchMap& map_;
  const WarpOptions& options_;
  Occupancy occupancy_;
  openvdb::math::Transform::Ptr transform_;
  M33d step_;  ///< world steps of the grid's axes as rows
  double textureBackground_, tolerance_ = 0, ghostDistance_;
  float background_ = 0;
  std::atomic<std::size_t> leafCount_ = 0;
};

}  // namespace

Warp warpTexture(const levelset::NarrowBand& texture, const TexturePlacement& placement,
                 const Patch& patch, const PatchMap& map, const WarpOptions& options) {
  return TextureWarp(texture, placement, patch, map, options).run();
}

}  // namespace mapping
