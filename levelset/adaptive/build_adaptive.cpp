#include "levelset/adaptive/build_adaptive.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "levelset/adaptive/adaptive_tree.h"
#include "levelset/adaptive/hanging_nodes.h"
#include "levelset/error.h"
#include "levelset/memory_limit.h"
#include "levelset/mesh.h"

namespace levelset {
namespace {

using Imath::V3d;
using Imath::V3i;

// An error between the tested points can be twice the one at them, and the corners of a leaf beside
// a larger one take over its error.
constexpr double kTestedShare = 0.5;

/// Values of a block and of the points half way between them: a lattice of 5³ points, x fastest.
/// Points are evaluated when they are first read.
class FineLattice {
 public:
  FineLattice(const AdaptiveTree& tree, const SignedDistance& distance, std::uint32_t block)
      : distance_(distance) {
    const CellKey parent = tree.octree.parent(block);
    origin_ = tree.origin;
    halfUnit_ = tree.unit / 2;
    low_ = parent.low() * 2;
    steps_ = static_cast<int>(parent.edge() / 2);
    values_.fill(NAN);
    for (int z = 0; z < 3; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x)
          values_[index({2 * x, 2 * y, 2 * z})] = tree.values[block][x + 3 * y + 9 * z];
  }

  [[nodiscard]] double value(const V3i& at) {
    double& value = values_[index(at)];
    if (std::isnan(value)) {
      // The nearest point with a value: a corner of a child.
      const V3i corner(at.x & ~1, at.y & ~1, at.z & ~1);
      const SignedDistance::Known known{values_[index(corner)],
                                        V3d(at - corner).length() * steps_ * halfUnit_};
      // Blocks that share a point compute the same bits of its position.
      const V3d position = origin_ + V3d(low_ + at * steps_) * halfUnit_;
      value = static_cast<float>(distance_.at(position, known));
      ++evaluations_;
    }
    return value;
  }
  [[nodiscard]] std::size_t evaluations() const { return evaluations_; }
  /// Edge of a child, world units.
  [[nodiscard]] double childEdge() const { return 2 * steps_ * halfUnit_; }

 private:
  [[nodiscard]] static std::size_t index(const V3i& at) {
    return static_cast<std::size_t>(at.x + 5 * at.y + 25 * at.z);
  }
  const SignedDistance& distance_;
  V3d origin_;       ///< of the root
  double halfUnit_;  ///< half of the edge of a cell of level 0, world units
  V3i low_;          ///< lowest point, half units
  int steps_;        ///< distance of the points, half units
  std::array<double, 125> values_;
  std::size_t evaluations_ = 0;
};

/// Decisions on the children of a block.
struct Decisions {
  int split = 0, tested = 0;  ///< bits by octant; tested: leaves within the tolerance
  std::array<BlockValues, 8> values;
  double testedError = 0;  ///< of children that stay leaves
  std::size_t evaluations = 0;
};

class Builder {
 public:
  Builder(const SignedDistance& distance, AdaptiveTree& tree, const AdaptiveOptions& options)
      : distance_(distance),
        tree_(tree),
        limit_(kTestedShare * options.tolerance),
        maxMemory_(memoryLimit(options.maxMemory)) {}

  void makeRoot();
  /// Divides the leaves within the half width of the surface.
  void divide(const Progress& progress);
  /// Divides leaves beyond the half width that give values to smaller ones within it.
  void divideBeside(const Progress& progress);
  [[nodiscard]] const AdaptiveReport& figures() const { return figures_; }

 private:
  /// Child of a block.
  struct Leaf {
    std::uint32_t block;
    int octant;
    auto operator<=>(const Leaf&) const = default;
  };
  void decide(std::uint32_t block, int octants, bool everywhere, Decisions& decisions) const;
  void apply(std::uint32_t block, const Decisions& decisions);
  void requireMemory() const;
  [[nodiscard]] double errorOf(FineLattice& lattice, const V3i& low, double limit) const;

  const SignedDistance& distance_;
  AdaptiveTree& tree_;
  double limit_;
  std::size_t maxMemory_;
  AdaptiveReport figures_;
  std::vector<std::uint8_t> tested_;  ///< for each block, bits by octant
};

void Builder::makeRoot() {
  tree_.octree.split(tree_.octree.root());
  tested_.push_back(0);
  figures_.evaluations = 27;
  BlockValues& values = tree_.values.emplace_back();
  const int half = 1 << (tree_.octree.depth() - 1);
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 3; ++x)
        values[x + 3 * y + 9 * z] =
            static_cast<float>(distance_.at(tree_.toWorld(V3i(x, y, z) * half), {}));
}

/// Largest difference between the values of a child's lattice and the interpolant of its corners.
/// Stops above `limit`.
double Builder::errorOf(FineLattice& lattice, const V3i& low, double limit) const {
  std::array<double, 8> corners;
  for (int c = 0; c < 8; ++c) corners[c] = lattice.value(low + V3i(c & 1, c >> 1 & 1, c >> 2) * 2);
  double largest = 0;
  // The centre first, then faces, then edges: it fails most often.
  for (int wanted = 3; wanted >= 1; --wanted)
    for (int z = 0; z < 3; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x) {
          if ((x & 1) + (y & 1) + (z & 1) != wanted) continue;
          const double expected = trilinear(corners, V3d(x, y, z) * 0.5);
          largest = std::max(largest, std::abs(expected - lattice.value(low + V3i(x, y, z))));
          if (largest > limit) return largest;
        }
  return largest;
}

/// @param octants     bits of the children to decide on
/// @param everywhere  also those beyond the half width
void Builder::decide(std::uint32_t block, int octants, bool everywhere,
                     Decisions& decisions) const {
  FineLattice lattice(tree_, distance_, block);
  const int level = tree_.octree.parent(block).level - 1;
  const double radius = 0.5 * std::sqrt(3.0) * lattice.childEdge();
  for (int octant = 0; octant < 8; ++octant) {
    if (!(octants >> octant & 1)) continue;
    const V3i low(2 * (octant & 1), 2 * (octant >> 1 & 1), 2 * (octant >> 2));
    if (!everywhere && std::abs(lattice.value(low + V3i(1))) > tree_.halfWidth + radius) continue;
    const double error = errorOf(lattice, low, level == 0 ? INFINITY : limit_);
    if (error <= limit_ || level == 0) {
      decisions.tested |= 1 << octant;
      decisions.testedError = std::max(decisions.testedError, error);
      continue;
    }
    decisions.split |= 1 << octant;
    BlockValues& values = decisions.values[static_cast<std::size_t>(octant)];
    for (int z = 0; z < 3; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x)
          values[x + 3 * y + 9 * z] = static_cast<float>(lattice.value(low + V3i(x, y, z)));
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
    tree_.values.push_back(decisions.values[static_cast<std::size_t>(octant)]);
    tested_.push_back(0);
  }
}

void Builder::requireMemory() const {
  levelset::requireMemory(
      double(tree_.octree.memoryUse() + tree_.values.capacity() * sizeof(BlockValues)), maxMemory_);
}

void Builder::divide(const Progress& progress) {
  constexpr int kAll = 0xff;
  const int depth = tree_.octree.depth();
  std::uint32_t first = 0;
  for (int level = depth; level > 0; --level) {
    const auto end = static_cast<std::uint32_t>(tree_.octree.blockCount());
    // Blocks of a level are decided on in parallel, then applied in their order.
    constexpr std::uint32_t kBatch = 1u << 14;
    std::vector<Decisions> decisions(std::min(kBatch, end - first));
    for (std::uint32_t start = first; start < end; start += kBatch) {
      const std::uint32_t count = std::min(kBatch, end - start);
      tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, count, 8),
                        [&](const tbb::blocked_range<std::uint32_t>& range) {
                          for (std::uint32_t k = range.begin(); k < range.end(); ++k) {
                            decisions[k] = {};
                            decide(start + k, kAll, false, decisions[k]);
                          }
                        });
      for (std::uint32_t k = 0; k < count; ++k) apply(start + k, decisions[k]);
      requireMemory();
      const double share = double(start + count - first) / double(end - first);
      report(progress, (double(depth - level) + share) / double(depth));
    }
    first = end;
  }
}

void Builder::divideBeside(const Progress& progress) {
  std::vector<Leaf> asking;
  for (std::uint32_t block = 0; block < tested_.size(); ++block)
    for (int octant = 0; octant < 8; ++octant)
      if (tested_[block] >> octant & 1) asking.push_back({block, octant});
  while (!asking.empty()) {
    report(progress, 0);
    // === Larger leaves without a test that give a value to a tested leaf
    using Pair = std::pair<Leaf, Leaf>;  // giving, asking
    tbb::enumerable_thread_specific<std::vector<Pair>> found;
    tbb::parallel_for(std::size_t{0}, asking.size(), [&](std::size_t n) {
      const CellKey leaf = tree_.octree.parent(asking[n].block).child(asking[n].octant);
      for (int corner = 0; corner < 8; ++corner) {
        const V3i at =
            leaf.low() + V3i(corner & 1, corner >> 1 & 1, corner >> 2) * int(leaf.edge());
        const auto larger = tree_.octree.leafWithout(at);
        if (!larger) continue;
        const Leaf giving{tree_.octree.block(larger->parent()), larger->octant()};
        if (!(tested_[giving.block] >> giving.octant & 1))
          found.local().emplace_back(giving, asking[n]);
      }
    });
    std::vector<Pair> pairs;
    for (const std::vector<Pair>& some : found) pairs.insert(pairs.end(), some.begin(), some.end());
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    std::vector<Leaf> giving;
    for (const Pair& pair : pairs)
      if (giving.empty() || giving.back() != pair.first) giving.push_back(pair.first);

    // === Tests. A leaf that fails is divided, and its children may give values.
    std::vector<Decisions> decisions(giving.size());
    tbb::parallel_for(std::size_t{0}, giving.size(), [&](std::size_t n) {
      decide(giving[n].block, 1 << giving[n].octant, true, decisions[n]);
    });
    std::vector<Leaf> next;
    for (std::size_t n = 0, p = 0; n < giving.size(); ++n) {
      apply(giving[n].block, decisions[n]);
      const bool isSplit = decisions[n].split != 0;
      if (!isSplit) next.push_back(giving[n]);
      for (; p < pairs.size() && pairs[p].first == giving[n]; ++p)
        if (isSplit) next.push_back(pairs[p].second);
    }
    requireMemory();
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    asking = std::move(next);
  }
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
  if (!(options.halfWidth >= 0))
    throw UsageError(
        fmt::format("the half width {} is negative; give 0 or more", options.halfWidth));
  const double halfWidth = options.halfWidth > 0 ? options.halfWidth : 0.02 * diagonal;
  double reach = 0;
  for (int axis = 0; axis < 3; ++axis)
    reach = std::max({reach, std::abs(box.min[axis]), std::abs(box.max[axis])});
  if (spacingAt(reach, CoordinatePrecision::Double) > options.tolerance / 8)
    throw InvalidInput(fmt::format(
        "the coordinates reach {:.3g}, where double precision is coarser than the tolerance {}; "
        "move the surface to the origin or raise the tolerance",
        reach, options.tolerance));
  // Beyond the margin all values at corners of the root are positive.
  const double margin =
      std::min(std::isfinite(halfWidth) ? halfWidth : 0.1 * longest, 0.1 * longest);
  const double side = longest + 2 * std::max(margin, 2 * options.tolerance);
  const int depth = std::max(2, static_cast<int>(std::ceil(std::log2(side / options.tolerance))));
  if (depth > kMaxOctreeDepth)
    throw UsageError(
        fmt::format("a tolerance of {} is below 2^-{} of the size {:.3g}; give at least {:.3g}",
                    options.tolerance, kMaxOctreeDepth, side, std::ldexp(side, -kMaxOctreeDepth)));
  return {HashedOctree(depth),
          {},
          box.min + size * 0.5 - V3d(0.5 * side),
          std::ldexp(side, -depth),
          options.tolerance,
          halfWidth};
}

}  // namespace

AdaptiveField buildAdaptive(const SignedDistance& distance, const Imath::Box3d& box,
                            const AdaptiveOptions& options, AdaptiveReport* report) {
  auto tree = std::make_shared<AdaptiveTree>(emptyTree(box, options));
  levelset::report(options.progress, 0);
  Builder builder(distance, *tree, options);
  builder.makeRoot();
  builder.divide(subProgress(options.progress, 0, 0.8));
  builder.divideBeside(subProgress(options.progress, 0.8, 0.9));
  levelset::report(options.progress, 0.9);
  constrainHangingNodes(*tree);
  tree->values.shrink_to_fit();
  levelset::report(options.progress, 1);
  if (report) *report = builder.figures();
  return AdaptiveField(std::move(tree));
}

}  // namespace levelset
