#include "levelset/deform/keys/lattice_keys.h"

#include <fmt/core.h>

#include <cstddef>
#include <utility>

#include "levelset/error.h"

namespace levelset {

void requireSameLattices(const std::vector<ControlLattice>& keys) {
  for (std::size_t k = 1; k < keys.size(); ++k) {
    const LatticeData &first = keys.front().data(), &other = keys[k].data();
    const char* part = first.boxToWorld != other.boxToWorld ? "the box"
                       : first.axes != other.axes           ? "degrees, knots or numbers of points"
                       : first.weights.empty() != other.weights.empty() ? "weights"
                                                                        : nullptr;
    if (part)
      throw InvalidInput(
          fmt::format("lattice {} and lattice 1 differ in {}; give lattices that differ in their "
                      "control points only",
                      k + 1, part));
  }
}

ControlLattice latticeBetween(const std::vector<ControlLattice>& keys,
                              const std::vector<KeyWeight>& weights) {
  if (weights.size() == 1) return keys[weights.front().key];
  LatticeData data = keys.front().data();
  for (std::size_t n = 0; n < data.points.size(); ++n)
    data.points[n] = blendOf(weights, [&](std::size_t key) { return keys[key].data().points[n]; });
  for (std::size_t n = 0; n < data.weights.size(); ++n)
    data.weights[n] =
        blendOf(weights, [&](std::size_t key) { return keys[key].data().weights[n]; });
  return ControlLattice(std::move(data));
}

}  // namespace levelset
