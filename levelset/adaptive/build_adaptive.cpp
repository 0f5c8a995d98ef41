#include "levelset/adaptive/build_adaptive.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "levelset/adaptive/octree/adaptive_tree.h"
#include "levelset/adaptive/octree/hanging_nodes.h"
#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/mesh.h"

namespace levelset {
namespace {

using Imath::V3d;
using Imath::V3i;

// Shares of the tolerance for the interpolation in a leaf, and again for corners that take over the
// figures of a larger leaf. Cubics vary more between the tested points, so a tenth is left for
// them.
constexpr double kTestedShare = 0.5, kTestedShareOfCubics = 0.45;
/// Step of numerical gradients, in edges of the cell.
constexpr double kGradientStep = 1e-3;
/// Largest value of a cubic on [0, 1] with a slope of 1 at one end, and values and slope 0 else.
constexpr double kSlopeShare = 4.0 / 27;

/// Figures at the corners of the children of one block.
struct BlockData {
  CornerValues values;
  CornerGradients gradients;  ///< for tricubic interpolation only
};

/// Appends the figures of a new block.
void append(const BlockData& block, bool isTricubic, CornerData& data) {
  data.values.push_back(block.values);
  if (isTricubic) data.gradients.push_back(block.gradients);
}

/// Figures of a block and of the points half way between its corners: a lattice of 5³ points, x
/// fastest. Points are evaluated when they are first read.
class FineLattice {
 public:
  FineLattice(const AdaptiveTree& tree, const SignedDistance& distance, std::uint32_t block)
      : distance_(distance) {
    const CellKey parent = tree.octree.parent(block);
    origin_ = tree.origin;
    halfUnit_ = tree.unit / 2;
    low_ = parent.low() * 2;
    steps_ = static_cast<int>(parent.edge() / 2);
    isTricubic_ = tree.data.isTricubic();
    values_.fill(NAN);
    if (isTricubic_) gradients_.fill(V3d(NAN));
    for (int z = 0; z < 3; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x) {
          const std::size_t to = index({2 * x, 2 * y, 2 * z});
          const auto from = static_cast<std::size_t>(x + 3 * y + 9 * z);
          values_[to] = tree.data.values[block][from];
          if (!isTricubic_) continue;
          const CornerGradients& known = tree.data.gradients[block];
          gradients_[to] = V3d(known[0][from], known[1][from], known[2][from]);
        }
  }

  [[nodiscard]] double value(const V3i& at) {
    double& value = values_[index(at)];
    if (std::isnan(value)) {
      // The nearest point with a value: a corner of a child.
      const V3i corner(at.x & ~1, at.y & ~1, at.z & ~1);
      const SignedDistance::Known known{values_[index(corner)],
                                        V3d(at - corner).length() * steps_ * halfUnit_};
      value = static_cast<float>(distance_.at(position(at), known));
      ++evaluations_;
    }
    return value;
  }
  [[nodiscard]] V3d gradient(const V3i& at) {
    V3d& gradient = gradients_[index(at)];
    if (std::isnan(gradient.x)) {
      const V3d exact = distance_.gradient(position(at), value(at), kGradientStep * childEdge());
      gradient = V3d(Imath::V3f(exact));
      ++evaluations_;
    }
    return gradient;
  }
  /// Figures of a child's lattice of 3³ points.
  [[nodiscard]] BlockData childData(const V3i& low) {
    BlockData data;
    for (int z = 0; z < 3; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x) {
          const auto i = static_cast<std::size_t>(x + 3 * y + 9 * z);
          data.values[i] = static_cast<float>(value(low + V3i(x, y, z)));
          if (!isTricubic_) continue;
          const V3d slopes = gradient(low + V3i(x, y, z));
          for (int axis = 0; axis < 3; ++axis)
            data.gradients[static_cast<std::size_t>(axis)][i] = static_cast<float>(slopes[axis]);
        }
    return data;
  }
  /// Interpolant of a child.
  [[nodiscard]] LeafInterpolant interpolant(const V3i& low) {
    LeafInterpolant result;
    result.isTricubic = isTricubic_;
    for (int c = 0; c < 8; ++c) {
      const V3i at = low + V3i(c & 1, c >> 1 & 1, c >> 2) * 2;
      const auto corner = static_cast<std::size_t>(c);
      result.values[corner] = value(at);
      if (!isTricubic_) continue;
      const V3d slopes = gradient(at) * childEdge();
      for (int axis = 0; axis < 3; ++axis)
        result.slopes[static_cast<std::size_t>(axis)][corner] = slopes[axis];
    }
    return result;
  }
  /// World position of a point.
  [[nodiscard]] V3d position(const V3i& at) const {
    return origin_ + V3d(low_ + at * steps_) * halfUnit_;  // the same bits in all blocks
  }
  [[nodiscard]] std::size_t evaluations() const { return evaluations_; }
  /// Edge of a child, world units.
  [[nodiscard]] double childEdge() const { return 2 * steps_ * halfUnit_; }

 private:
  [[nodiscard]] static std::size_t index(const V3i& at) {
    return static_cast<std::size_t>(at.x + 5 * at.y + 25 * at.z);
  }
  const SignedDistance& distance_;
  V3d origin_;       ///< lowest corner of the root, world units
  double halfUnit_;  ///< half of the edge of a cell of level 0, world units
  V3i low_;          ///< lowest point, half units
  int steps_;        ///< distance of the points, half units
  bool isTricubic_;
  std::array<double, 125> values_;
  std::array<V3d, 125> gradients_;
  std::size_t evaluations_ = 0;
};

/// Lowest point of a child in the lattice of its block.
V3i lowOf(int octant) {
  return {2 * (octant & 1), 2 * (octant >> 1 & 1), 2 * (octant >> 2)};
}

/// Decisions on the children of a block.
struct Decisions {
  int split = 0, tested = 0;  ///< bits by octant; tested: leaves within the half width
  std::array<BlockData, 8> data;
  double testedError = 0;  ///< largest one of the children that stay leaves
  std::size_t evaluations = 0;
};

class Builder {
 public:
  Builder(const SignedDistance& distance, AdaptiveTree& tree, const AdaptiveOptions& options)
      : distance_(distance),
        tree_(tree),
        limit_((options.isTricubic ? kTestedShareOfCubics : kTestedShare) * options.tolerance),
        isTricubic_(options.isTricubic),
        maxMemory_(memoryLimit(options.maxMemory)) {}

  void makeRoot();
  /// Divides leaves in the blocks from a number on, and in the new blocks.
  void divide(std::uint32_t first, const Progress& progress);
  /// Makes the field continuous. Divides leaves that give wrong values to smaller ones.
  void connect(const Progress& progress);
  [[nodiscard]] const AdaptiveReport& figures() const { return figures_; }

 private:
  void decide(std::uint32_t block, Decisions& decisions) const;
  void apply(std::uint32_t block, const Decisions& decisions);
  /// Corner of a leaf with its exact figures.
  struct Corner {
    V3i at;
    float value;
    V3d gradient;  ///< 0 for trilinear interpolation
    double edge;   ///< edge of the leaf, world units
  };
  [[nodiscard]] Corner cornerOf(std::uint32_t block, int octant, int corner) const;
  [[nodiscard]] std::vector<Corner> testedCorners(std::uint32_t first) const;
  [[nodiscard]] std::vector<Corner> wrongCorners(const CornerData& data,
                                                 const std::vector<std::uint32_t>& blocks) const;
  [[nodiscard]] double changeAt(const Corner& corner, double value, const V3d& gradient) const;
  [[nodiscard]] double changeAt(const CornerData& data, std::uint32_t block, int octant,
                                int corner) const;
  void measureHanging(const CornerData& data);
  [[nodiscard]] std::vector<CellKey> leavesWithout(std::vector<Corner>& corners,
                                                   bool isWrong) const;
  void splitAll(const std::vector<CellKey>& leaves);
  void requireMemory(std::size_t newBlocks) const;
  [[nodiscard]] double errorOf(FineLattice& lattice, const V3i& low, double limit) const;
  [[nodiscard]] double errorOnSurface(const FineLattice& lattice, const V3i& low,
                                      const LeafInterpolant& leaf, double limit) const;

  const SignedDistance& distance_;
  AdaptiveTree& tree_;
  double limit_;
  bool isTricubic_;
  std::size_t maxMemory_;
  AdaptiveReport figures_;
  std::vector<std::uint8_t> tested_;  ///< for each block, bits by octant
};

void Builder::makeRoot() {
  tree_.octree.split(tree_.octree.root());
  tested_.push_back(0);
  figures_.evaluations = 27;
  BlockData root;
  const int half = 1 << (tree_.octree.depth() - 1);
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 3; ++x) {
        const auto i = static_cast<std::size_t>(x + 3 * y + 9 * z);
        const V3d position = tree_.toWorld(V3i(x, y, z) * half);
        const double value = distance_.at(position, {});
        root.values[i] = static_cast<float>(value);
        if (!isTricubic_) continue;
        const V3d slopes = distance_.gradient(position, value, kGradientStep * half * tree_.unit);
        for (int axis = 0; axis < 3; ++axis)
          root.gradients[static_cast<std::size_t>(axis)][i] = static_cast<float>(slopes[axis]);
      }
  append(root, isTricubic_, tree_.data);
}

/// Largest difference between the values of a child's lattice and the interpolant of its corners.
/// Stops above `limit`.
double Builder::errorOf(FineLattice& lattice, const V3i& low, double limit) const {
  const LeafInterpolant leaf = lattice.interpolant(low);
  double largest = 0;
  // The centre first, then faces, then edges: it fails most often.
  for (int wanted = 3; wanted >= 1; --wanted)
    for (int z = 0; z < 3; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x) {
          if ((x & 1) + (y & 1) + (z & 1) != wanted) continue;
          const double expected = leaf.value(V3d(x, y, z) * 0.5);
          largest = std::max(largest, std::abs(expected - lattice.value(low + V3i(x, y, z))));
          if (largest > limit) return largest;
        }
  return std::max(largest, errorOnSurface(lattice, low, leaf, limit));
}

/// Largest error of the interpolant at the visited points of the surface in a child.
double Builder::errorOnSurface(const FineLattice& lattice, const V3i& low,
                               const LeafInterpolant& leaf, double limit) const {
  const Imath::Box3d box(lattice.position(low), lattice.position(low + V3i(2)));
  double largest = 0;
  distance_.visitSurface(box, [&](const V3d& p, double value) {
    V3d at;
    for (int axis = 0; axis < 3; ++axis)
      at[axis] = std::clamp((p[axis] - box.min[axis]) / (box.max[axis] - box.min[axis]), 0.0, 1.0);
    largest = std::max(largest, std::abs(leaf.value(at) - value));
    return largest <= limit;
  });
  return largest;
}

void Builder::decide(std::uint32_t block, Decisions& decisions) const {
  FineLattice lattice(tree_, distance_, block);
  const CellKey parent = tree_.octree.parent(block);
  const int level = parent.level - 1;
  const double radius = 0.5 * std::sqrt(3.0) * lattice.childEdge();
  for (int octant = 0; octant < 8; ++octant) {
    if (tree_.octree.isSplit(parent.child(octant))) continue;  // by connect()
    const V3i low = lowOf(octant);
    if (std::abs(lattice.value(low + V3i(1))) > tree_.halfWidth + radius) continue;
    decisions.tested |= 1 << octant;
    const double error = errorOf(lattice, low, level == 0 ? INFINITY : limit_);
    if (error <= limit_ || level == 0) {
      decisions.testedError = std::max(decisions.testedError, error);
      continue;
    }
    decisions.split |= 1 << octant;
    decisions.data[static_cast<std::size_t>(octant)] = lattice.childData(low);
  }
  decisions.evaluations = lattice.evaluations();
}

void Builder::apply(std::uint32_t block, const Decisions& decisions) {
  figures_.evaluations += decisions.evaluations;
  figures_.testedError = std::max(figures_.testedError, decisions.testedError);
  tested_[block] |= static_cast<std::uint8_t>(decisions.tested);
  const CellKey parent = tree_.octree.parent(block);
  for (int octant = 0; octant < 8; ++octant) {
    if (!(decisions.split >> octant & 1)) continue;
    tree_.octree.split(parent.child(octant));
    append(decisions.data[static_cast<std::size_t>(octant)], isTricubic_, tree_.data);
    tested_.push_back(0);
  }
}

/// Compares the estimated memory after new blocks were added with the limit. Vectors hold their
/// values twice while they grow, and connect() makes a copy.
void Builder::requireMemory(std::size_t newBlocks) const {
  const double kBytesPerBlock =
      2.0 * (sizeof(CornerValues) + (isTricubic_ ? sizeof(CornerGradients) : 0)) + 40;
  levelset::requireMemory(kBytesPerBlock * double(tree_.octree.blockCount() + newBlocks),
                          maxMemory_);
}

void Builder::divide(std::uint32_t first, const Progress& progress) {
  // Blocks are decided on in parallel, then applied in their order.
  constexpr std::uint32_t kBatch = 1u << 13;
  std::vector<Decisions> decisions;
  std::size_t round = 0;
  while (first < tree_.octree.blockCount()) {
    const auto end = static_cast<std::uint32_t>(tree_.octree.blockCount());
    ++round;
    for (std::uint32_t start = first; start < end; start += kBatch) {
      const std::uint32_t count = std::min(kBatch, end - start);
      decisions.resize(std::max<std::size_t>(decisions.size(), count));
      tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, count, 8),
                        [&](const tbb::blocked_range<std::uint32_t>& range) {
                          for (std::uint32_t k = range.begin(); k < range.end(); ++k) {
                            decisions[k] = {};
                            decide(start + k, decisions[k]);
                          }
                        });
      std::size_t added = 0;
      for (std::uint32_t k = 0; k < count; ++k)
        added += static_cast<std::size_t>(std::popcount(static_cast<unsigned>(decisions[k].split)));
      requireMemory(added);
      for (std::uint32_t k = 0; k < count; ++k) apply(start + k, decisions[k]);
      const double share = double(start + count - first) / double(end - first);
      report(progress, std::min(1.0, (double(round - 1) + share) / double(tree_.octree.depth())));
    }
    first = end;
  }
}

/// Bound of the change of a leaf by other figures at one of its corners.
double Builder::changeAt(const Corner& corner, double value, const V3d& gradient) const {
  const V3d turn = gradient - corner.gradient;
  return std::abs(value - double(corner.value)) +
         kSlopeShare * corner.edge * (std::abs(turn.x) + std::abs(turn.y) + std::abs(turn.z));
}

double Builder::changeAt(const CornerData& data, std::uint32_t block, int octant,
                         int corner) const {
  const std::size_t i = AdaptiveTree::latticeIndex(octant, corner);
  V3d gradient(0);
  if (isTricubic_)
    for (int axis = 0; axis < 3; ++axis)
      gradient[axis] = data.gradients[block][static_cast<std::size_t>(axis)][i];
  return changeAt(cornerOf(block, octant, corner), data.values[block][i], gradient);
}

/// Finds the corners of tested leaves in some blocks at which larger leaves change them by more
/// than the limit.
std::vector<Builder::Corner> Builder::wrongCorners(const CornerData& data,
                                                   const std::vector<std::uint32_t>& blocks) const {
  using Found = std::pair<std::uint64_t, Corner>;
  tbb::enumerable_thread_specific<std::vector<Found>> found;
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t k) {
    const std::uint32_t n = blocks[k];
    for (int octant = 0; octant < 8; ++octant) {
      if (!(tested_[n] >> octant & 1)) continue;
      for (int corner = 0; corner < 8; ++corner) {
        if (changeAt(data, n, octant, corner) <= limit_) continue;
        const Corner wrong = cornerOf(n, octant, corner);
        found.local().emplace_back(static_cast<std::uint64_t>(wrong.at.x) |
                                       static_cast<std::uint64_t>(wrong.at.y) << 20 |
                                       static_cast<std::uint64_t>(wrong.at.z) << 40,
                                   wrong);
      }
    }
  });
  std::vector<Found> all;
  for (const std::vector<Found>& some : found) all.insert(all.end(), some.begin(), some.end());
  // The largest one of the leaves with a corner changes most.
  std::sort(all.begin(), all.end(), [](const Found& a, const Found& b) {
    return a.first != b.first ? a.first < b.first : a.second.edge > b.second.edge;
  });
  std::vector<Corner> corners;
  for (std::size_t n = 0; n < all.size(); ++n)
    if (n == 0 || all[n].first != all[n - 1].first) corners.push_back(all[n].second);
  return corners;
}

/// Finds the largest leaves that touch corners without having them. Removes the corners without
/// such a leaf.
/// @param isWrong  false: also the corners for which the leaf interpolates the figures
std::vector<CellKey> Builder::leavesWithout(std::vector<Corner>& corners, bool isWrong) const {
  constexpr std::uint64_t kNone = ~std::uint64_t{0};
  std::vector<std::uint64_t> keys(corners.size(), kNone);
  tbb::parallel_for(std::size_t{0}, corners.size(), [&](std::size_t n) {
    const auto leaf = tree_.octree.leafWithout(corners[n].at);
    if (!leaf) return;
    if (!isWrong) {
      const V3d local = V3d(corners[n].at - leaf->low()) / leaf->edge();
      const LeafInterpolant larger = tree_.interpolant({*leaf, tree_.octree.block(leaf->parent())});
      const V3d gradient = isTricubic_ ? larger.slope(local) / (tree_.unit * leaf->edge()) : V3d(0);
      if (changeAt(corners[n], larger.value(local), gradient) <= limit_) return;
    }
    keys[n] = leaf->packed();
  });
  std::size_t kept = 0;
  for (std::size_t n = 0; n < corners.size(); ++n)
    if (keys[n] != kNone) corners[kept++] = corners[n];
  corners.resize(kept);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::vector<CellKey> leaves;
  for (const std::uint64_t key : keys)
    if (key != kNone) leaves.push_back(CellKey::unpacked(key));
  return leaves;
}

void Builder::splitAll(const std::vector<CellKey>& leaves) {
  requireMemory(leaves.size());
  std::vector<BlockData> added(leaves.size());
  std::atomic<std::size_t> evaluations = 0;
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t n) {
    FineLattice lattice(tree_, distance_, tree_.octree.block(leaves[n].parent()));
    added[n] = lattice.childData(lowOf(leaves[n].octant()));
    evaluations += lattice.evaluations();
  });
  figures_.evaluations += evaluations;
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    tree_.octree.split(leaves[n]);
    append(added[n], isTricubic_, tree_.data);
    tested_.push_back(0);
  }
}

void Builder::connect(const Progress& progress) {
  CornerData data = continuousData(tree_);
  std::vector<std::uint32_t> blocks(data.values.size());
  std::iota(blocks.begin(), blocks.end(), 0u);
  while (true) {
    report(progress, 0);
    std::vector<Corner> corners = wrongCorners(data, blocks);
    if (corners.empty()) break;
    const auto before = static_cast<std::uint32_t>(tree_.octree.blockCount());
    // Divide each leaf at least once, then until the leaf at the corner interpolates its figures.
    // The new leaves have new corners on larger leaves.
    for (bool isWrong = true; !corners.empty();) {
      const auto first = static_cast<std::uint32_t>(tree_.octree.blockCount());
      for (; !corners.empty(); isWrong = false) splitAll(leavesWithout(corners, isWrong));
      divide(first, {});
      corners = testedCorners(first);
    }
    blocks = updateData(tree_, before, data);
  }
  measureHanging(data);
  tree_.data = std::move(data);
}

/// Finds the largest change at a corner of a tested leaf.
void Builder::measureHanging(const CornerData& data) {
  figures_.hangingError = 0;
  for (std::uint32_t n = 0; n < data.values.size(); ++n)
    for (int octant = 0; octant < 8; ++octant)
      if (tested_[n] >> octant & 1)
        for (int corner = 0; corner < 8; ++corner)
          figures_.hangingError =
              std::max(figures_.hangingError, changeAt(data, n, octant, corner));
}

/// Returns the corners of the tested leaves in the blocks from a number on, with exact values. A
/// corner may come several times.
std::vector<Builder::Corner> Builder::testedCorners(std::uint32_t first) const {
  std::vector<Corner> corners;
  for (std::size_t n = first; n < tree_.octree.blockCount(); ++n)
    for (int octant = 0; octant < 8; ++octant)
      if (tested_[n] >> octant & 1)
        for (int corner = 0; corner < 8; ++corner)
          corners.push_back(cornerOf(static_cast<std::uint32_t>(n), octant, corner));
  return corners;
}

Builder::Corner Builder::cornerOf(std::uint32_t block, int octant, int corner) const {
  const CellKey leaf = tree_.octree.parent(block).child(octant);
  V3d gradient(0);
  if (isTricubic_)
    for (int axis = 0; axis < 3; ++axis)
      gradient[axis] = tree_.data.gradients[block][static_cast<std::size_t>(axis)]
                                           [AdaptiveTree::latticeIndex(octant, corner)];
  return {
      leaf.low() + V3i(corner & 1, corner >> 1 & 1, corner >> 2) * static_cast<int>(leaf.edge()),
      tree_.corner(block, octant, corner), gradient, tree_.unit * leaf.edge()};
}

/// Checks the options and places the root.
AdaptiveTree emptyTree(const Imath::Box3d& box, const AdaptiveOptions& options) {
  if (box.isEmpty() || !std::isfinite((box.max - box.min).length()))
    throw InvalidInput("the surface has no finite bounds; check the coordinates");
  const V3d size = box.max - box.min;
  const double longest = std::max({size.x, size.y, size.z}), diagonal = size.length();
  if (!(options.tolerance > 0) || !std::isfinite(options.tolerance))
    throw UsageError(
        fmt::format("the tolerance {} is not positive; give a positive one", options.tolerance));
  if (!(options.halfWidth >= 0 && std::isfinite(options.halfWidth)))
    throw UsageError(
        fmt::format("the half width {} is negative or infinite; give a finite number of 0 or more",
                    options.halfWidth));
  const double halfWidth = options.halfWidth > 0 ? options.halfWidth : 0.02 * diagonal;
  double reach = 0;
  for (int axis = 0; axis < 3; ++axis)
    reach = std::max({reach, std::abs(box.min[axis]), std::abs(box.max[axis])});
  if (spacingAt(reach, CoordinatePrecision::Double) > options.tolerance / 8)
    throw InvalidInput(fmt::format(
        "the coordinates reach {:.3g}, where double precision is coarser than the tolerance {}; "
        "move the surface to the origin or raise the tolerance",
        reach, options.tolerance));
  // The tolerance holds up to the half width, and all values at corners of the root are positive.
  const double side = longest + 2 * std::max(halfWidth, 2 * options.tolerance);
  // The interpolant of a distance is off by at most 0.87 edges.
  const int depth =
      std::max(2, static_cast<int>(std::ceil(std::log2(2 * side / options.tolerance))));
  if (depth > kMaxOctreeDepth)
    throw UsageError(
        fmt::format("a tolerance of {} is too small for the size {:.3g}; give at least {:.3g}",
                    options.tolerance, side, std::ldexp(2 * side, -kMaxOctreeDepth)));
  return {HashedOctree(depth),
          {},
          box.min + size * 0.5 - V3d(0.5 * side),
          std::ldexp(side, -depth),
          options.tolerance,
          halfWidth};
}

}  // namespace

V3d SignedDistance::gradient(const V3d& position, double value, double step) const {
  V3d result;
  for (int axis = 0; axis < 3; ++axis) {
    V3d low = position, high = position;
    low[axis] -= step;
    high[axis] += step;
    result[axis] = (at(high, {value, step}) - at(low, {value, step})) / (high[axis] - low[axis]);
  }
  return result;
}

AdaptiveField buildAdaptive(const SignedDistance& distance, const Imath::Box3d& box,
                            const AdaptiveOptions& options, AdaptiveReport* report) {
  auto tree = std::make_shared<AdaptiveTree>(emptyTree(box, options));
  levelset::report(options.progress, 0);
  Builder builder(distance, *tree, options);
  builder.makeRoot();
  builder.divide(0, subProgress(options.progress, 0, 0.9));
  builder.connect(subProgress(options.progress, 0.9, 0.9));
  tree->data.values.shrink_to_fit();
  tree->data.gradients.shrink_to_fit();
  levelset::report(options.progress, 1);
  if (report) *report = builder.figures();
  return AdaptiveField(std::move(tree));
}

}  // namespace levelset
