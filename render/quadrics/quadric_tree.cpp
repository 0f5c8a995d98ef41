#include "render/quadrics/quadric_tree.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

namespace render {
namespace {

constexpr int kSplitBins = 16;
constexpr std::size_t kSmallRange = 512;  // primitives; smaller ranges are sorted to be split
constexpr std::size_t kParallelRange = 1u << 14;
constexpr int kMostNodeDepth = 32;  // below, ranges are halved

struct BinBox {
  float low[3], high[3];

  BinBox() {
    std::fill(low, low + 3, std::numeric_limits<float>::infinity());
    std::fill(high, high + 3, -std::numeric_limits<float>::infinity());
  }
  void add(const float* otherLow, const float* otherHigh) {
    for (int c = 0; c < 3; ++c) {
      low[c] = otherLow[c] < low[c] ? otherLow[c] : low[c];
      high[c] = otherHigh[c] > high[c] ? otherHigh[c] : high[c];
    }
  }
  void add(const BinBox& other) { add(other.low, other.high); }
  /// Half of the surface area; 0 for an empty box.
  [[nodiscard]] float area() const {
    const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
    return x < 0 ? 0 : x * y + y * z + z * x;
  }
};

/// Twice the centre.
float centreOf(const PrimitiveBox& box, int axis) {
  return box.low[axis] + box.high[axis];
}

/// A range of primitives with their box and the box of the doubled centres.
struct BoxRange {
  std::size_t begin = 0, end = 0;
  BinBox box, centres;

  [[nodiscard]] std::size_t size() const { return end - begin; }
};

struct SplitBins {
  std::array<std::array<BinBox, kSplitBins>, 3> box;
  std::array<std::array<std::size_t, kSplitBins>, 3> count{};

  void add(const SplitBins& other) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t n = 0; n < kSplitBins; ++n) {
        box[axis][n].add(other.box[axis][n]);
        count[axis][n] += other.count[axis][n];
      }
  }
};

class TreeBuilder {
 public:
  TreeBuilder(std::vector<PrimitiveBox>& boxes, std::size_t width) : boxes_(boxes), width_(width) {}

  BuiltTree build() {
    BoxRange all = measured(0, boxes_.size());
    return subtree(all, 0);
  }

 private:
  struct Both {
    BinBox box, centres;
    void add(const PrimitiveBox& of) {
      box.add(of.low, of.high);
      const float centre[3] = {centreOf(of, 0), centreOf(of, 1), centreOf(of, 2)};
      centres.add(centre, centre);
    }
  };

  [[nodiscard]] BoxRange measured(std::size_t begin, std::size_t end) const {
    Both both;
    const auto add = [&](std::size_t from, std::size_t to, Both sum) {
      for (std::size_t n = from; n < to; ++n) sum.add(boxes_[n]);
      return sum;
    };
    if (end - begin < kParallelRange)
      both = add(begin, end, both);
    else
      both = tbb::parallel_reduce(
          tbb::blocked_range<std::size_t>(begin, end, kParallelRange / 2), Both(),
          [&](const auto& part, Both sum) { return add(part.begin(), part.end(), sum); },
          [](Both a, const Both& b) {
            a.box.add(b.box);
            a.centres.add(b.centres);
            return a;
          });
    return {begin, end, both.box, both.centres};
  }

  /// Bin of a primitive along an axis.
  struct BinScale {
    float low[3], scale[3];

    explicit BinScale(const BinBox& centres) {
      for (int c = 0; c < 3; ++c) {
        low[c] = centres.low[c];
        const float size = centres.high[c] - centres.low[c];
        scale[c] = size > 0 ? 0.999f * kSplitBins / size : 0;
        if (!std::isfinite(scale[c])) scale[c] = 0;
      }
    }
    [[nodiscard]] std::size_t of(const PrimitiveBox& box, int axis) const {
      return static_cast<std::size_t>((centreOf(box, axis) - low[axis]) * scale[axis]);
    }
  };

  [[nodiscard]] SplitBins binsOf(const BoxRange& range, const BinScale& scale) const {
    const auto add = [&](std::size_t from, std::size_t to, SplitBins bins) {
      for (std::size_t n = from; n < to; ++n)
        for (int axis = 0; axis < 3; ++axis) {
          const std::size_t bin = scale.of(boxes_[n], axis);
          const auto a = static_cast<std::size_t>(axis);
          bins.box[a][bin].add(boxes_[n].low, boxes_[n].high);
          ++bins.count[a][bin];
        }
      return bins;
    };
    if (range.size() < kParallelRange) return add(range.begin, range.end, {});
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(range.begin, range.end, kParallelRange / 2), SplitBins(),
        [&](const auto& part, const SplitBins& bins) {
          return add(part.begin(), part.end(), bins);
        },
        [](SplitBins a, const SplitBins& b) {
          a.add(b);
          return a;
        });
  }

  /// Number of blocks that a number of primitives fills.
  [[nodiscard]] float blocksOf(std::size_t count) const {
    return static_cast<float>((count + width_ - 1) / width_);
  }

  /// Splits a range in two by the heuristic.
  [[nodiscard]] std::pair<BoxRange, BoxRange> split(const BoxRange& range, int depth) {
    if (range.size() <= kSmallRange || depth > kMostNodeDepth) return splitSorted(range);
    const BinScale scale(range.centres);
    const SplitBins bins = binsOf(range, scale);
    float best = std::numeric_limits<float>::infinity();
    int bestAxis = -1;
    std::size_t bestBin = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      std::array<float, kSplitBins> above{};  // cost of the bins from n on
      BinBox box;
      std::size_t count = 0;
      for (std::size_t n = kSplitBins - 1; n > 0; --n) {
        box.add(bins.box[a][n]);
        count += bins.count[a][n];
        above[n] = box.area() * blocksOf(count);
      }
      box = {};
      count = 0;
      for (std::size_t n = 1; n < kSplitBins; ++n) {
        box.add(bins.box[a][n - 1]);
        count += bins.count[a][n - 1];
        if (count == 0 || count == range.size()) continue;
        const float cost = box.area() * blocksOf(count) + above[n];
        if (!(cost < best)) continue;
        best = cost;
        bestAxis = axis;
        bestBin = n;
      }
    }
    if (bestAxis < 0) return splitSorted(range);
    const auto middle =
        std::partition(at(range.begin), at(range.end),
                       [&](const PrimitiveBox& box) { return scale.of(box, bestAxis) < bestBin; });
    const auto place = static_cast<std::size_t>(middle - boxes_.begin());
    return {measured(range.begin, place), measured(place, range.end)};
  }

  /// Number of primitives below a child of a full node whose range has a size: a block of them, or
  /// full nodes of such blocks.
  [[nodiscard]] std::size_t unitOf(std::size_t size) const {
    std::size_t unit = width_;
    while (unit * kQuadricLanes < size) unit *= kQuadricLanes;
    return unit;
  }

  /// Sorts a range along its longest axis, and splits it so that blocks and nodes are full as far
  /// as possible.
  [[nodiscard]] std::pair<BoxRange, BoxRange> splitSorted(const BoxRange& range) {
    int axis = 0;
    for (int c = 1; c < 3; ++c)
      if (range.centres.high[c] - range.centres.low[c] >
          range.centres.high[axis] - range.centres.low[axis])
        axis = c;
    std::sort(at(range.begin), at(range.end), [&](const PrimitiveBox& a, const PrimitiveBox& b) {
      const float x = centreOf(a, axis), y = centreOf(b, axis);
      return x != y ? x < y : a.number < b.number;
    });
    const std::size_t unit = unitOf(range.size());
    std::size_t middle = range.begin + (range.size() / 2 + unit - 1) / unit * unit;
    if (range.size() <= kSmallRange) {
      std::array<float, kSmallRange + 1> above{};
      BinBox box;
      for (std::size_t n = range.size(); n-- > 1;) {
        const PrimitiveBox& of = boxes_[range.begin + n];
        box.add(of.low, of.high);
        above[n] = box.area() * blocksOf(range.size() - n);
      }
      box = {};
      float best = std::numeric_limits<float>::infinity();
      for (std::size_t n = 1; n < range.size(); ++n) {
        const PrimitiveBox& of = boxes_[range.begin + n - 1];
        box.add(of.low, of.high);
        if (n % unit != 0) continue;
        const float cost = box.area() * blocksOf(n) + above[n];
        if (!(cost < best)) continue;
        best = cost;
        middle = range.begin + n;
      }
    }
    return {measured(range.begin, middle), measured(middle, range.end)};
  }

  [[nodiscard]] std::vector<PrimitiveBox>::iterator at(std::size_t n) const {
    return boxes_.begin() + static_cast<std::ptrdiff_t>(n);
  }

  /// Children of a node: the range is split until there are eight, the largest box first.
  [[nodiscard]] std::vector<BoxRange> childrenOf(const BoxRange& range, int depth) {
    std::vector<BoxRange> children{range};
    while (children.size() < kQuadricLanes) {
      std::size_t largest = children.size();
      float most = -1;
      for (std::size_t n = 0; n < children.size(); ++n)
        if (children[n].size() > width_ && children[n].box.area() > most) {
          most = children[n].box.area();
          largest = n;
        }
      if (largest == children.size()) break;
      auto [low, high] = split(children[largest], depth);
      children[largest] = low;
      children.push_back(high);
    }
    return children;
  }

  BuiltTree subtree(const BoxRange& range, int depth) {
    BuiltTree tree;
    addNode(range, depth, tree);
    return tree;
  }

  void addLeaf(const BoxRange& range, BuiltTree& tree) const {
    for (std::size_t n = 0; n < width_; ++n)
      tree.order.push_back(n < range.size() ? boxes_[range.begin + n].number : kEmptyPlace);
  }

  void addNode(const BoxRange& range, int depth, BuiltTree& tree) {
    const std::vector<BoxRange> children = childrenOf(range, depth);
    const std::size_t number = tree.nodes.size();
    QuadricNode& node = tree.nodes.emplace_back();
    for (std::size_t n = 0; n < kQuadricLanes; ++n) {
      const BinBox box = n < children.size() ? children[n].box : BinBox();
      for (std::size_t c = 0; c < 3; ++c) {
        node.planes[c][n] = box.low[c];
        node.planes[c + 3][n] = box.high[c];
      }
      node.child[n] = 0;
    }
    std::vector<BuiltTree> parts(children.size());
    const bool isParallel = range.size() >= kParallelRange;
    if (isParallel)
      tbb::parallel_for(std::size_t{0}, children.size(), [&](std::size_t n) {
        if (children[n].size() > width_) parts[n] = subtree(children[n], depth + 1);
      });
    for (std::size_t n = 0; n < children.size(); ++n) {
      if (children[n].size() <= width_) {
        tree.nodes[number].child[n] =
            QuadricNode::kLeaf | static_cast<std::uint32_t>(tree.order.size() / width_);
        addLeaf(children[n], tree);
        continue;
      }
      tree.nodes[number].child[n] = static_cast<std::uint32_t>(tree.nodes.size());
      if (isParallel)
        append(std::exchange(parts[n], {}), tree);
      else
        addNode(children[n], depth + 1, tree);
    }
  }

  void append(BuiltTree part, BuiltTree& tree) const {
    const auto nodes = static_cast<std::uint32_t>(tree.nodes.size()),
               blocks = static_cast<std::uint32_t>(tree.order.size() / width_);
    for (QuadricNode& node : part.nodes)
      for (std::uint32_t& child : node.child)
        child += (child & QuadricNode::kLeaf) != 0 ? blocks : nodes;
    tree.nodes.insert(tree.nodes.end(), part.nodes.begin(), part.nodes.end());
    tree.order.insert(tree.order.end(), part.order.begin(), part.order.end());
  }

  std::vector<PrimitiveBox>& boxes_;
  std::size_t width_;
};

}  // namespace

BuiltTree buildQuadricTree(std::vector<PrimitiveBox>& boxes, std::size_t width) {
  return TreeBuilder(boxes, width).build();
}

}  // namespace render
