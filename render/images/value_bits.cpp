#include "render/images/value_bits.h"

#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>

#include "levelset/vdb.h"

namespace render {
namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;
using Leaves = openvdb::tree::LeafManager<const openvdb::FloatTree>;

template <typename Result, typename Add, typename Join>
Result overLeaves(const openvdb::FloatTree& tree, const Add& add, const Join& join) {
  const Leaves leaves(tree);
  return tbb::parallel_deterministic_reduce(
      tbb::blocked_range<std::size_t>(0, leaves.leafCount(), 64), Result(),
      [&](const auto& range, Result sum) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) add(leaves.leaf(i), sum);
        return sum;
      },
      join);
}

float largestOf(const openvdb::FloatTree& tree) {
  const float inLeaves = overLeaves<float>(
      tree,
      [](const Leaf& leaf, float& largest) {
        for (auto value = leaf.cbeginValueAll(); value; ++value)
          largest = std::max(largest, std::abs(*value));
      },
      [](float a, float b) { return std::max(a, b); });
  return std::max(inLeaves, tree.background());
}

struct Shifts {
  double largest = 0, squares = 0, count = 0;
};

Shifts shiftsOf(const openvdb::FloatTree& before, const openvdb::FloatTree& after, double voxel) {
  return overLeaves<Shifts>(
      before,
      [&](const Leaf& leaf, Shifts& sum) {
        const openvdb::tree::ValueAccessor<const openvdb::FloatTree> old(before), now(after);
        for (auto value = leaf.cbeginValueOn(); value; ++value)
          for (int a = 0; a < 3; ++a) {
            const Coord here = value.getCoord();
            Coord next = here;
            ++next[a];
            const double f = *value, g = old.getValue(next);
            if ((f < 0) == (g < 0)) continue;
            const double share = f / (f - g);
            const double moved = std::abs((1 - share) * static_cast<double>(now.getValue(here)) +
                                          share * static_cast<double>(now.getValue(next))) /
                                 voxel;
            sum.largest = std::max(sum.largest, moved);
            sum.squares += moved * moved;
            ++sum.count;
          }
      },
      [](const Shifts& a, const Shifts& b) {
        return Shifts{std::max(a.largest, b.largest), a.squares + b.squares, a.count + b.count};
      });
}

/// Step for which `largest`, the largest |φ| of a band, is a quantized value, so that the half
/// width does not change. If rounding prevents this, the last bit of the half width may differ.
float stepOf(float largest, int bits) {
  const float last = static_cast<float>(1 << (bits - 1)) - 0.5f;
  const float step = largest / last;
  for (const float near_ : {step, std::nextafter(step, 0.0f), std::nextafter(step, HUGE_VALF)})
    if (last * near_ == largest) return near_;
  return step;
}

}  // namespace

int ValueBits::codeOf(float value) const {
  const int half = 1 << (bits - 1);
  return std::clamp(static_cast<int>(std::floor(value / step)), -half, half - 1) + half;
}

float ValueBits::valueOf(int code) const {
  const float fromZero = static_cast<float>(code) + (0.5f - static_cast<float>(1 << (bits - 1)));
  return fromZero * step;
}

QuantizedBand quantized(const levelset::NarrowBand& band, int bits) {
  QuantizedBand result{.band = band, .quantization = {.bits = bits}, .shift = {}};
  const openvdb::FloatTree& before = levelset::vdb(band).tree();
  result.quantization.step = stepOf(largestOf(before), bits);
  openvdb::FloatTree& after = levelset::editVdb(result.band).tree();
  const auto held = [&](float value) {
    return result.quantization.valueOf(result.quantization.codeOf(value));
  };
  openvdb::tools::changeBackground(after, held(before.background()));
  openvdb::tree::LeafManager<openvdb::FloatTree>(after).foreach ([&](Leaf& leaf, std::size_t) {
    for (auto value = leaf.beginValueAll(); value; ++value) value.setValue(held(*value));
  });
  const Shifts shifts = shiftsOf(before, after, band.voxelSize());
  result.shift = {shifts.largest, shifts.count > 0 ? std::sqrt(shifts.squares / shifts.count) : 0};
  return result;
}

}  // namespace render
