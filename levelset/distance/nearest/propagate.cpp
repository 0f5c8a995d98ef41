#include "levelset/distance/nearest/propagate.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "levelset/geometry/search/point_search.h"

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

/// Grid points of a neighbour block that touch a block, in coordinates of that block.
openvdb::CoordBBox borderOf(int neighbour) {
  const Coord d = direction(neighbour);
  openvdb::CoordBBox box;
  for (int i = 0; i < 3; ++i) {
    box.min()[i] = d[i] < 0 ? -1 : d[i] > 0 ? 8 : 0;
    box.max()[i] = d[i] < 0 ? -1 : d[i] > 0 ? 8 : 7;
  }
  return box;
}

/// Prefetches the data that BlockWorker reads first: the block and the borders of its changed
/// neighbours.
void prefetchAround(const Block& block) {
  const auto prefetchRow = [](const Block& of, int x, int y) {
    __builtin_prefetch(&of.nearest[offsetOf(x & 7, y & 7, 0)]);
  };
  for (openvdb::Index n = 0; n < 512; n += 16) {
    __builtin_prefetch(&block.nearest[n]);
    __builtin_prefetch(&block.squared[n]);
  }
  const std::uint32_t news = block.dirtyNeighbours.load(std::memory_order_relaxed);
  for (int i = 0; i < 27; ++i) {
    if (!(news >> i & 1)) continue;
    const openvdb::CoordBBox box = borderOf(i);
    for (int x = box.min().x(); x <= box.max().x(); ++x)
      for (int y = box.min().y(); y <= box.max().y(); ++y)
        prefetchRow(*block.neighbours[static_cast<std::size_t>(i)], x, y);
  }
}

/// Propagates surface points inside one block, and from its neighbours into it, until no distance
/// in the block decreases.
class BlockWorker {
 public:
  BlockWorker(Block& block, const SurfacePoints& points) : block_(block), points_(points) {
    held_.fill(-1);
    for (int x = block.low.x(); x <= block.high.x(); ++x)
      for (int y = block.low.y(); y <= block.high.y(); ++y)
        std::copy(block.squared.begin() + offsetOf(x, y, block.low.z()),
                  block.squared.begin() + offsetOf(x, y, block.high.z()) + 1,
                  held_.begin() + slot(x, y, block.low.z()));
  }

  void relax() {
    const std::uint32_t news = block_.dirtyNeighbours.exchange(0, std::memory_order_relaxed);
    for (int i = 0; i < 27; ++i)
      if (news >> i & 1)
        forEachBeside(i, [&](const Coord&, std::uint32_t point) { prefetch(point); });
    changed_ = block_.queued;
    for (auto it = block_.queued.beginOn(); it; ++it) {
      prefetch(block_.nearest[it.pos()]);
      queue_[end_++] = static_cast<std::uint16_t>(it.pos());
    }
    for (std::size_t i = 0; i < end_; ++i) at_[queue_[i]] = local(block_.nearest[queue_[i]]);
    for (int i = 0; i < 27; ++i)
      if (news >> i & 1)
        forEachBeside(
            i, [&](const Coord& c, std::uint32_t point) { offerAround(c, point, local(point)); });
    for (; begin_ != end_; ++begin_) {
      const openvdb::Index n = queue_[begin_ % kQueue];
      block_.queued.setOff(n);
      offerAround(FloatTree::LeafNodeType::offsetToLocalCoord(n), block_.nearest[n], at_[n]);
    }
  }

  /// Returns the neighbour blocks in which a changed surface point of this block may be nearer than
  /// the present one: bit i for neighbour i. Ignores squared distances of `limit`, voxels², and
  /// more.
  [[nodiscard]] std::uint32_t outbox(float limit) const;

 private:
  // Squared distances of the block in rows along z, with a padding of kBefore values before each
  // row and more after it. Values in the padding are -1, so no offered surface point is nearer
  // there, and four values are compared at once without a bounds check.
  static constexpr int kRow = 16, kBefore = 2;
  static std::ptrdiff_t slot(int x, int y, int z) {
    return static_cast<std::ptrdiff_t>((x * 8 + y) * kRow + z + kBefore);
  }

  [[nodiscard]] openvdb::Vec3f local(std::uint32_t point) const {
    return openvdb::Vec3f(points_.positions[point] - block_.origin.asVec3d());
  }
  void prefetch(std::uint32_t point) const {
    // A position may extend over two cache lines.
    const Vec3d* position = &points_.positions[point];
    __builtin_prefetch(position);
    __builtin_prefetch(position->asPointer() + 2);
  }

  void accept(int x, int y, int z, std::uint32_t point, const openvdb::Vec3f& at, float squared) {
    const openvdb::Index n = offsetOf(x, y, z);
    held_[static_cast<std::size_t>(slot(x, y, z))] = squared;
    at_[n] = at;
    block_.squared[n] = squared;
    block_.nearest[n] = point;
    block_.own.setOff(n);
    changed_.setOn(n);
    if (block_.queued.isOn(n)) return;
    block_.queued.setOn(n);
    queue_[end_++ % kQueue] = static_cast<std::uint16_t>(n);
  }

  /// Offers a surface point to the 27 grid points around `c`, in coordinates of the block. A grid
  /// point takes it if it is nearer than its present one. `c` may lie one grid point outside the
  /// block.
  /// @param at  position of the surface point relative to the block
  void offerAround(const Coord& c, std::uint32_t point, const openvdb::Vec3f& at) {
    const Float4 squareX = squaresAround(at[0], c.x()), squareY = squaresAround(at[1], c.y());
    const float dz = at[2] - static_cast<float>(c.z() - 1);
    const Float4 alongZ = {dz, dz - 1, dz - 2, 1e18f};
    const Float4 squareZ = alongZ * alongZ;
    const int firstX = std::max(c.x() - 1, 0), lastX = std::min(c.x() + 1, 7),
              firstY = std::max(c.y() - 1, 0), lastY = std::min(c.y() + 1, 7);
    for (int x = firstX; x <= lastX; ++x)
      for (int y = firstY; y <= lastY; ++y) {
        const Float4 squared = squareZ + (squareX[x - c.x() + 1] + squareY[y - c.y() + 1]);
        Float4 held;
        std::memcpy(&held, held_.data() + slot(x, y, c.z() - 1), sizeof(held));
        // A tie keeps the earlier point. The order of offers is fixed, and so is the result.
        const Int4 better = squared < held;
        std::uint64_t any[2];
        std::memcpy(any, &better, sizeof(any));
        if (!(any[0] | any[1])) continue;
        for (int i = 0; i < 3; ++i)
          if (better[i]) accept(x, y, c.z() - 1 + i, point, at, squared[i]);
      }
  }

  /// Returns the squared distances along one axis from a position to grid points c − 1, c and c
  /// + 1.
  static Float4 squaresAround(float position, int c) {
    const Float4 along = position - Float4{static_cast<float>(c - 1), static_cast<float>(c),
                                           static_cast<float>(c + 1), 0};
    return along * along;
  }

  /// Calls work(grid point, its nearest surface point) for the border of a neighbour block.
  template <typename Work>
  void forEachBeside(int index, const Work& work) const {
    const openvdb::CoordBBox box = borderOf(index);
    const Block& other = *block_.neighbours[static_cast<std::size_t>(index)];
    for (int x = box.min().x(); x <= box.max().x(); ++x)
      for (int y = box.min().y(); y <= box.max().y(); ++y)
        for (int z = box.min().z(); z <= box.max().z(); ++z) {
          const std::uint32_t point = other.nearest[offsetOf(x & 7, y & 7, z & 7)];
          if (point != NearestPoints::kNone) work(Coord(x, y, z), point);
        }
  }

  Block& block_;
  const SurfacePoints& points_;
  std::array<float, std::size_t{8} * 8 * kRow> held_;
  std::array<openvdb::Vec3f, 512> at_;  ///< position of the nearest surface point, if queued
  // Ring buffer of the queued grid points. None is queued twice, so it holds at most 512.
  static constexpr std::size_t kQueue = 512;
  std::array<std::uint16_t, kQueue> queue_;
  std::size_t begin_ = 0, end_ = 0;
  NearestPoints::Mask changed_;
};

/// Returns the neighbour blocks that touch a grid point at a side, edge or corner of its block: bit
/// i for neighbour i.
/// @param side  for each axis −1 or 1 at that end of the block, else 0
std::uint32_t blocksBeside(const Coord& side) {
  std::uint32_t bits = 0;
  for (int part = 1; part < 8; ++part) {
    const Coord toward(part & 1 ? side.x() : 0, part & 2 ? side.y() : 0, part & 4 ? side.z() : 0);
    if (toward != Coord(0)) bits |= 1u << directionIndex(toward);
  }
  return bits;
}

bool isDue(const Block& block) {
  return block.dirtyNeighbours.load(std::memory_order_relaxed) || !block.queued.isOff();
}

std::uint32_t BlockWorker::outbox(float limit) const {
  static const auto kBeside = [] {
    std::array<std::uint32_t, 27> all{};
    for (int i = 0; i < 27; ++i) all[static_cast<std::size_t>(i)] = blocksBeside(direction(i));
    return all;
  }();
  std::uint32_t bits = 0;
  for (auto it = changed_.beginOn(); it; ++it) {
    const Coord c = FloatTree::LeafNodeType::offsetToLocalCoord(it.pos());
    const Coord side((c.x() == 7) - (c.x() == 0), (c.y() == 7) - (c.y() == 0),
                     (c.z() == 7) - (c.z() == 0));
    const std::uint32_t around = kBeside[static_cast<std::size_t>(directionIndex(side))];
    if ((bits & around) == around) continue;
    // Smallest squares of the distances, along each axis, from the surface point to the neighbours
    // of the grid point: inside this block's range, and beyond it.
    double within[3], beyond[3];
    for (int axis = 0; axis < 3; ++axis) {
      const auto square = [&](int step) {
        const double along = static_cast<double>(at_[it.pos()][axis]) - (c[axis] + step);
        return along * along;
      };
      within[axis] = square(0);
      for (const int step : {-1, 1})
        if (step != side[axis]) within[axis] = std::min(within[axis], square(step));
      beyond[axis] = side[axis] != 0 ? square(side[axis]) : 0;
    }
    for (int part = 1; part < 8; ++part) {
      Coord toward(0);
      double squared = 0;
      bool exists = true;
      for (int axis = 0; axis < 3; ++axis) {
        const bool leaves = part >> axis & 1;
        exists = exists && (!leaves || side[axis] != 0);
        toward[axis] = leaves ? side[axis] : 0;
        squared += leaves ? beyond[axis] : within[axis];
      }
      if (exists && squared < static_cast<double>(limit)) bits |= 1u << directionIndex(toward);
    }
  }
  return bits;
}

}  // namespace

NearestPoints::NearestPoints(const FloatTree& field, const SurfacePoints& points,
                             const Reach& reach)
    : field_(field),
      accessor_(field),
      points_(points),
      reach_(reach),
      reachInSlabs_(static_cast<int>(
          std::min(1e6, std::ceil((std::max(reach.inside, reach.outside) + kBlockMargin) / 8)))) {}

NearestPoints::Block& NearestPoints::touch(const Coord& origin) {
  Block*& slot = index_[origin];
  if (slot) return *slot;
  auto& owners = slabs_[slabOf(origin)][static_cast<std::size_t>(parity(origin) & 3)];
  Block& block = *owners.emplace_back(std::make_unique<Block>());
  slot = &block;
  block.origin = origin;
  std::fill_n(&block.nearest[0], 512, kNone);
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

void NearestPoints::seed(const std::vector<Coord>& gridPoints, std::size_t first) {
  for (std::size_t i = 0; i < gridPoints.size(); ++i)
    if (!reach_.region || reach_.region->isInside(gridPoints[i]))
      seed(gridPoints[i], static_cast<std::uint32_t>(first + i), true);
}

void NearestPoints::seedFeatures(std::size_t first) {
  for (std::size_t i = first; i < points_.size(); ++i) seedCorners(i, {});
}

void NearestPoints::seedFeatures(std::size_t first, int slab) {
  if (features_.empty())
    for (std::size_t i = first; i < points_.size(); ++i) {
      const Coord cell = Coord::floor(points_.positions[i]);
      features_[slabOf(cell)].push_back(i);
      if (const int next = slabOf(cell.offsetBy(1, 0, 0)); next != slabOf(cell))
        features_[next].push_back(i);
    }
  if (const auto found = features_.find(slab); found != features_.end())
    for (const std::size_t i : found->second) seedCorners(i, slab);
}

void NearestPoints::seedCorners(std::size_t point, std::optional<int> slab) {
  const Coord cell = Coord::floor(points_.positions[point]);
  for (int corner = 0; corner < 8; ++corner) {
    const Coord c = cell.offsetBy(corner >> 2, corner >> 1 & 1, corner & 1);
    if ((!slab || slabOf(c) == *slab) && (!reach_.region || reach_.region->isInside(c)))
      seed(c, static_cast<std::uint32_t>(point), false);
  }
}

void NearestPoints::seedRegionBoundary(const std::vector<Coord>& gridPoints) {
  // If the closest point of a grid point lies outside the region, the segment between both crosses
  // the boundary of the region. With correct surface points on the boundary, no block outside the
  // region is needed.
  const PointSearch tree = makePointSearch(points_.positions);
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
      nearest.assign(face.volume(), kNone);
      tbb::parallel_for(std::size_t{0}, nearest.size(), [&](std::size_t i) {
        nearest[i] = tree.closest(toImath(gridPoint(i).asVec3d()), limit * limit).index;
      });
      for (std::size_t i = 0; i < nearest.size(); ++i)
        if (nearest[i] != kNone)
          seed(gridPoint(i), nearest[i],
               nearest[i] < gridPoints.size() && gridPoints[nearest[i]] == gridPoint(i));
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

void NearestPoints::runRound(int slab) {
  for (std::size_t parity = 0; parity < 4; ++parity) {
    const auto found = slabs_.find(slab);
    if (found == slabs_.end()) return;
    std::vector<Block*> due;
    for (const auto& block : found->second[parity])
      if (isDue(*block)) due.push_back(block.get());
    if (due.empty()) continue;
    std::vector<std::vector<Coord>> missing(due.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, due.size(), 8), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        if (i + 1 != range.end()) prefetchAround(*due[i + 1]);
        process(*due[i], missing[i]);
      }
    });
    for (std::size_t i = 0; i < due.size(); ++i)
      for (const Coord& origin : missing[i]) {
        const openvdb::CoordBBox extent(origin, origin.offsetBy(7));
        if (slabOf(origin) <= final_ ||
            !BlockSelection{reach_.region, reach_.leaves}.holdsBlock(extent))
          continue;
        Block& block = touch(origin);
        const Coord back = due[i]->origin - origin;
        block.dirtyNeighbours.fetch_or(
            1u << directionIndex({back.x() / 8, back.y() / 8, back.z() / 8}));
      }
  }
}

bool NearestPoints::isQuiet(int slab) const {
  const auto found = slabs_.find(slab);
  if (found == slabs_.end()) return true;
  for (const auto& blocks : found->second)
    for (const auto& block : blocks)
      if (isDue(*block)) return false;
  return true;
}

void NearestPoints::advance(int g) {
  for (int even = 2 * g; even > final_; even -= 2) {
    runRound(even);
    if (even - 1 > final_) runRound(even - 1);
  }
  // All slabs up to 2g have run a round.
  while (final_ + 1 + reachInSlabs_ <= 2 * g) {
    for (int slab = final_ + 1; slab <= final_ + 1 + reachInSlabs_; ++slab)
      if (!isQuiet(slab)) return;
    ++final_;
  }
}

std::vector<Block*> NearestPoints::blocksOf(int slab) const {
  std::vector<Block*> blocks;
  const auto found = slabs_.find(slab);
  if (found == slabs_.end()) return blocks;
  for (const auto& some : found->second)
    for (const auto& block : some) blocks.push_back(block.get());
  return blocks;
}

void NearestPoints::releaseUpTo(int slab) {
  while (!slabs_.empty() && slabs_.begin()->first <= slab) {
    for (const auto& some : slabs_.begin()->second)
      for (const auto& block : some) {
        for (std::size_t i = 0; i < 27; ++i)
          if (block->neighbours[i]) block->neighbours[i]->neighbours[26 - i] = nullptr;
        index_.erase(block->origin);
      }
    slabs_.erase(slabs_.begin());
  }
}

void NearestPoints::run(const Progress& progress) {
  if (slabs_.empty()) return;
  const int first = firstSlab() - reachInSlabs_;
  beginAt(first, lastSlab() + reachInSlabs_);
  for (int g = first >> 1; final_ < lastSlab(); ++g) {
    advance(g);
    const double range = std::max(1, lastSlab() - first + 1);
    report(progress, std::clamp((final_ - first) / range, 0.0, 1.0));
  }
}

}  // namespace levelset::eikonal
