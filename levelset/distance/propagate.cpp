#include "levelset/distance/propagate.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "levelset/geometry/point_tree.h"
#include "levelset/grids/padded_leaf_vdb.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using openvdb::Vec3d;
using Block = NearestPoints::Block;

// Margin added to the largest distances, voxels: the nearest surface points of two neighbouring
// grid points may lie half a voxel apart along the surface.
constexpr double kBlockMargin = 0.5;

int directionIndex(const Coord& d) {
  return (d.x() + 1) * 9 + (d.y() + 1) * 3 + d.z() + 1;
}
Coord direction(int index) {
  return {index / 9 - 1, index / 3 % 3 - 1, index % 3 - 1};
}

Coord blockStep(int index) {
  const Coord d = direction(index);
  return {8 * d.x(), 8 * d.y(), 8 * d.z()};
}

int parity(const Coord& origin) {
  return ((origin.x() >> 3) & 1) * 4 + ((origin.y() >> 3) & 1) * 2 + ((origin.z() >> 3) & 1);
}

openvdb::Index offsetOf(int x, int y, int z) {
  return static_cast<openvdb::Index>((x << 6) + (y << 3) + z);
}

float squareOf(double x) {
  return static_cast<float>(x * x);
}

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));

/// Propagates surface points inside one block, and from its neighbours into it, until no distance
/// in the block decreases.
class BlockWorker {
 public:
  BlockWorker(Block& block, const SurfacePoints& points) : block_(block), points_(points) {
    held_.values.fill(-1);
    for (int x = block.low.x(); x <= block.high.x(); ++x)
      for (int y = block.low.y(); y <= block.high.y(); ++y)
        for (int z = block.low.z(); z <= block.high.z(); ++z)
          held_.values[Held::slot(x, y, z)] = block.squared[offsetOf(x, y, z)];
  }

  void relax() {
    changed_ = block_.queued;
    for (auto it = block_.queued.beginOn(); it; ++it) queue_.push_back(it.pos());
    const std::uint32_t news = block_.dirtyNeighbours.exchange(0, std::memory_order_relaxed);
    for (int i = 0; i < 27; ++i)
      if (news >> i & 1) readNeighbour(i);
    for (std::size_t head = 0; head < queue_.size(); ++head) {
      const openvdb::Index n = queue_[head];
      block_.queued.setOff(n);
      offerAround(FloatTree::LeafNodeType::offsetToLocalCoord(n), block_.nearest[n]);
    }
  }

  /// Returns the neighbour blocks in which a changed surface point of this block may be nearer than
  /// the present one: bit i for neighbour i. Ignores squared distances of `limit`, voxels², and
  /// more.
  [[nodiscard]] std::uint32_t outbox(float limit) const;

 private:
  // Squared distances of the block, with a padding of two grid points. Values in the padding are
  // -1, so no offered surface point is nearer there, and rows of four need no bounds check. The
  // padding holds no values of neighbour blocks: readNeighbour() reads them from their blocks.
  using Held = PaddedLeaf<2, 16>;

  [[nodiscard]] openvdb::Vec3f local(std::uint32_t point) const {
    return openvdb::Vec3f(points_.positions[point] - block_.origin.asVec3d());
  }

  void accept(int x, int y, int z, std::uint32_t point, float squared) {
    const openvdb::Index n = offsetOf(x, y, z);
    held_.values[Held::slot(x, y, z)] = squared;
    block_.squared[n] = squared;
    block_.nearest[n] = point;
    block_.own.setOff(n);
    changed_.setOn(n);
    if (block_.queued.isOn(n)) return;
    block_.queued.setOn(n);
    queue_.push_back(n);
  }

  /// Offers a surface point to the 27 grid points around `c`, in coordinates of the block. A grid
  /// point takes it if it is nearer than its present one. `c` may lie one grid point outside the
  /// block.
  void offerAround(const Coord& c, std::uint32_t point) {
    const openvdb::Vec3f at = local(point);
    const float dz = at[2] - static_cast<float>(c.z() - 1);
    const Float4 alongZ = {dz, dz - 1, dz - 2, 1e18f};
    const Float4 squareZ = alongZ * alongZ;
    for (int x = c.x() - 1; x <= c.x() + 1; ++x) {
      const float dx = at[0] - static_cast<float>(x);
      for (int y = c.y() - 1; y <= c.y() + 1; ++y) {
        const float dy = at[1] - static_cast<float>(y);
        const Float4 squared = squareZ + (dx * dx + dy * dy);
        Float4 held;
        std::memcpy(&held, held_.at(x, y, c.z() - 1), sizeof(held));
        // A tie keeps the earlier point. The order of offers is fixed, and so is the result.
        const Int4 better = squared < held;
        std::uint64_t any[2];
        std::memcpy(any, &better, sizeof(any));
        if (!(any[0] | any[1])) continue;
        for (int i = 0; i < 3; ++i)
          if (better[i]) accept(x, y, c.z() - 1 + i, point, squared[i]);
      }
    }
  }

  void readNeighbour(int index) {
    const Block& other = *block_.neighbours[static_cast<std::size_t>(index)];
    const Coord d = direction(index);
    Coord from, to;  // block coordinates
    for (int i = 0; i < 3; ++i) {
      from[i] = d[i] < 0 ? -1 : d[i] > 0 ? 8 : 0;
      to[i] = d[i] < 0 ? -1 : d[i] > 0 ? 8 : 7;
    }
    for (int x = from.x(); x <= to.x(); ++x)
      for (int y = from.y(); y <= to.y(); ++y)
        for (int z = from.z(); z <= to.z(); ++z) {
          const std::uint32_t point = other.nearest[offsetOf(x & 7, y & 7, z & 7)];
          if (point != NearestPoints::kNone) offerAround({x, y, z}, point);
        }
  }

  Block& block_;
  const SurfacePoints& points_;
  Held held_;
  std::vector<openvdb::Index> queue_;
  NearestPoints::Mask changed_;
};

std::uint32_t BlockWorker::outbox(float limit) const {
  std::uint32_t bits = 0;
  for (auto it = changed_.beginOn(); it; ++it) {
    const Coord c = FloatTree::LeafNodeType::offsetToLocalCoord(it.pos());
    const Coord side((c.x() == 7) - (c.x() == 0), (c.y() == 7) - (c.y() == 0),
                     (c.z() == 7) - (c.z() == 0));
    if (side == Coord(0)) continue;
    const openvdb::Vec3d at(local(block_.nearest[it.pos()]));
    for (int dx = -1; dx <= 1; ++dx)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dz = -1; dz <= 1; ++dz) {
          const Coord toward(dx && dx == side.x() ? dx : 0, dy && dy == side.y() ? dy : 0,
                             dz && dz == side.z() ? dz : 0);
          const int index = directionIndex(toward);
          if (toward == Coord(0) || bits >> index & 1) continue;
          if ((at - c.offsetBy(dx, dy, dz).asVec3d()).lengthSqr() < static_cast<double>(limit))
            bits |= 1u << index;
        }
  }
  return bits;
}

}  // namespace

NearestPoints::NearestPoints(const FloatTree& field, const SurfacePoints& points,
                             const Reach& reach)
    : field_(field), accessor_(field), points_(points), reach_(reach) {
  seedBesideSurface();
  if (reach_.region) seedRegionBoundary();
}

NearestPoints::Block& NearestPoints::touch(const Coord& origin) {
  Block*& slot = index_[origin];
  if (slot) return *slot;
  Block& block = blocks_.emplace_back();
  slot = &block;
  block.origin = origin;
  block.nearest.fill(kNone);
  block.low = Coord(0);
  block.high = Coord(7);
  if (reach_.region) {
    block.low.maxComponent(reach_.region->min() - origin);
    block.high.minComponent(reach_.region->max() - origin);
  }
  if (const auto* leaf = accessor_.probeConstLeaf(origin)) {
    for (openvdb::Index n = 0; n < 512; ++n)
      if (leaf->getValue(n) < 0) block.inside.setOn(n);
  } else {
    block.inside.set(accessor_.getValue(origin) < 0);
  }
  const float inside = squareOf(reach_.inside + kBlockMargin),
              outside = squareOf(reach_.outside + kBlockMargin);
  for (openvdb::Index n = 0; n < 512; ++n)
    block.squared[n] = block.inside.isOn(n) ? inside : outside;
  for (int i = 0; i < 27; ++i) {
    const auto found = index_.find(origin + blockStep(i));
    if (i == 13 || found == index_.end()) continue;
    block.neighbours[static_cast<std::size_t>(i)] = found->second;
    found->second->neighbours[static_cast<std::size_t>(26 - i)] = &block;
  }
  return block;
}

void NearestPoints::seed(const Coord& gridPoint, std::uint32_t point, bool own) {
  Block& block = touch(gridPoint & ~7);
  const openvdb::Index n = FloatTree::LeafNodeType::coordToOffset(gridPoint);
  const auto squared =
      static_cast<float>((points_.positions[point] - gridPoint.asVec3d()).lengthSqr());
  if (block.nearest[n] != kNone && squared >= block.squared[n]) return;
  block.squared[n] = squared;
  block.nearest[n] = point;
  block.own.set(n, own);
  block.queued.setOn(n);
}

void NearestPoints::seedBesideSurface() {
  for (std::uint32_t i = 0; i < points_.gridPoints.size(); ++i)
    if (!reach_.region || reach_.region->isInside(points_.gridPoints[i]))
      seed(points_.gridPoints[i], i, true);
  // Points on edges and corners may be nearer to a grid point than all points on faces, so they are
  // offered to the corners of the grid cells that contain them.
  for (std::size_t i = points_.gridPoints.size(); i < points_.size(); ++i) {
    const Coord cell = Coord::floor(points_.positions[i]);
    for (int corner = 0; corner < 8; ++corner) {
      const Coord c = cell.offsetBy(corner >> 2, corner >> 1 & 1, corner & 1);
      if (!reach_.region || reach_.region->isInside(c))
        seed(c, static_cast<std::uint32_t>(i), false);
    }
  }
}

void NearestPoints::seedRegionBoundary() {
  // If the closest point of a grid point lies outside the region, the segment between both crosses
  // the boundary of the region. With correct surface points on the boundary, no block outside the
  // region is needed.
  const PointTree tree(points_.positions);
  const openvdb::CoordBBox& box = *reach_.region;
  const double limit = std::max(reach_.inside, reach_.outside) + kBlockMargin;
  std::vector<std::uint32_t> nearest;
  for (int axis = 0; axis < 3; ++axis)
    for (const int level : {box.min()[axis], box.max()[axis]}) {
      openvdb::CoordBBox face = box;
      face.min()[axis] = face.max()[axis] = level;
      const auto rows = static_cast<std::size_t>(face.dim().y()),
                 row = static_cast<std::size_t>(face.dim().z());
      const auto gridPoint = [&](std::size_t i) {
        return face.min().offsetBy(static_cast<int>(i / row / rows),
                                   static_cast<int>(i / row % rows), static_cast<int>(i % row));
      };
      nearest.assign(face.volume(), PointTree::kNone);
      tbb::parallel_for(std::size_t{0}, nearest.size(), [&](std::size_t i) {
        nearest[i] = tree.nearest(gridPoint(i).asVec3d(), limit);
      });
      for (std::size_t i = 0; i < nearest.size(); ++i)
        if (nearest[i] != PointTree::kNone)
          seed(gridPoint(i), nearest[i],
               nearest[i] < points_.gridPoints.size() &&
                   points_.gridPoints[nearest[i]] == gridPoint(i));
    }
}

void NearestPoints::process(Block& block, std::vector<Coord>& missing) const {
  BlockWorker worker(block, points_);
  worker.relax();
  const std::uint32_t news =
      worker.outbox(squareOf(std::max(reach_.inside, reach_.outside) + kBlockMargin));
  for (int i = 0; i < 27; ++i) {
    if (!(news >> i & 1)) continue;
    if (Block* other = block.neighbours[static_cast<std::size_t>(i)])
      other->dirtyNeighbours.fetch_or(1u << (26 - i), std::memory_order_relaxed);
    else
      missing.push_back(block.origin + blockStep(i));
  }
}

void NearestPoints::run(const Progress& progress) {
  std::array<std::vector<Block*>, 8> byParity;
  std::size_t sorted = 0;
  const auto sortNew = [&] {
    for (; sorted < blocks_.size(); ++sorted)
      byParity[static_cast<std::size_t>(parity(blocks_[sorted].origin))].push_back(
          &blocks_[sorted]);
  };
  sortNew();
  double fraction = 0;
  for (bool again = true; again;) {
    again = false;
    for (auto& candidates : byParity) {
      std::vector<Block*> due;
      for (Block* block : candidates)
        if (block->dirtyNeighbours.load(std::memory_order_relaxed) || !block->queued.isOff())
          due.push_back(block);
      if (due.empty()) continue;
      again = true;
      std::vector<std::vector<Coord>> missing(due.size());
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, due.size(), 8), [&](const auto& range) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) process(*due[i], missing[i]);
      });
      for (std::size_t i = 0; i < due.size(); ++i)
        for (const Coord& origin : missing[i]) {
          const openvdb::CoordBBox extent(origin, origin.offsetBy(7));
          if (!BlockSelection{reach_.region, reach_.leaves}.holdsBlock(extent)) continue;
          Block& block = touch(origin);
          const Coord back = due[i]->origin - origin;
          block.dirtyNeighbours.fetch_or(
              1u << directionIndex({back.x() / 8, back.y() / 8, back.z() / 8}));
        }
      sortNew();
    }
    fraction += (1 - fraction) / 8;
    report(progress, fraction);
  }
}

}  // namespace levelset::eikonal
