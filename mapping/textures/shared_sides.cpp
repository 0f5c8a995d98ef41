#include "mapping/textures/shared_sides.h"

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cstddef>

namespace mapping {
namespace {

using Imath::V3d;

struct Side {
  V3d first, middle, last;
  std::size_t patch, side;

  [[nodiscard]] bool liesOn(const Side& other, double tolerance) const {
    const auto near = [&](const V3d& a, const V3d& b) { return (a - b).length() <= tolerance; };
    return near(middle, other.middle) && ((near(first, other.first) && near(last, other.last)) ||
                                          (near(first, other.last) && near(last, other.first)));
  }
};

/// Sides of a patch in the order of SharedSides.
std::array<Side, 4> sidesOf(const Patch& patch, std::size_t number) {
  const ParticleLayer& layer = patch.layers.front();
  const std::size_t right = layer.columns - 1, top = layer.rows - 1;
  const auto alongV = [&](std::size_t column) {
    return (layer.at(column, top / 2) + layer.at(column, (top + 1) / 2)) / 2.0;
  };
  const auto alongU = [&](std::size_t row) {
    return (layer.at(right / 2, row) + layer.at((right + 1) / 2, row)) / 2.0;
  };
  return {{{layer.at(0, 0), alongV(0), layer.at(0, top), number, 0},
           {layer.at(right, 0), alongV(right), layer.at(right, top), number, 1},
           {layer.at(0, 0), alongU(0), layer.at(right, 0), number, 2},
           {layer.at(0, top), alongU(top), layer.at(right, top), number, 3}}};
}

}  // namespace

std::vector<SharedSides> sharedSides(std::span<const Patch> patches) {
  constexpr double kTolerance = 1e-3;  // largest distance of coinciding points, particle spacings
  std::vector<Side> sides;
  for (std::size_t n = 0; n < patches.size(); ++n)
    for (const Side& side : sidesOf(patches[n], n)) sides.push_back(side);
  std::sort(sides.begin(), sides.end(),
            [](const Side& a, const Side& b) { return a.middle.x < b.middle.x; });
  std::vector<SharedSides> shared(patches.size(), SharedSides{});
  for (auto a = sides.begin(); a != sides.end(); ++a) {
    const double tolerance = kTolerance * patches[a->patch].spacing;
    for (auto b = a + 1; b != sides.end() && b->middle.x - a->middle.x <= tolerance; ++b)
      if (a->liesOn(*b, tolerance)) shared[a->patch][a->side] = shared[b->patch][b->side] = true;
  }
  return shared;
}

}  // namespace mapping
