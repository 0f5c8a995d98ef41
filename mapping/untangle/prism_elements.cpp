#include "mapping/untangle/prism_elements.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "mapping/untangle/prism_cells.h"

namespace mapping {
namespace {

using Imath::V3d;

/// Derivatives of the determinant of f with respect to its columns.
ElementSlopes cofactors(const ElementSlopes& f) {
  return {f[1].cross(f[2]), f[2].cross(f[0]), f[0].cross(f[1])};
}

double squaredNorm(const ElementSlopes& f) {
  return f[0].length2() + f[1].length2() + f[2].length2();
}

// Paths from the first corner of a cell to its last, one axis after the other, as in Lattice.
constexpr std::array<std::array<std::size_t, 3>, 6> kPaths = {
    {{0, 1, 2}, {0, 2, 1}, {2, 0, 1}, {1, 0, 2}, {1, 2, 0}, {2, 1, 0}}};

}  // namespace

double determinantOf(const ElementSlopes& f) {
  return f[0].dot(f[1].cross(f[2]));
}

ElementEnergy symmetricDirichlet(const ElementSlopes& f) {
  const ElementSlopes c = cofactors(f);
  const double det = f[0].dot(c[0]);
  ElementEnergy result;
  if (!(det > 0)) {
    result.value = std::numeric_limits<double>::infinity();
    return result;
  }
  const double inverse = squaredNorm(c) / (det * det);
  result.value = squaredNorm(f) + inverse;
  if (!std::isfinite(result.value)) result.value = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const V3d ofCofactors = c[j].cross(f[k]) - c[k].cross(f[j]);
    result.stress[i] = f[i] * 2.0 + ofCofactors * (2 / (det * det)) - c[i] * (2 * inverse / det);
  }
  return result;
}

ElementEnergy foldoverEnergy(const ElementSlopes& f, double epsilon) {
  const ElementSlopes c = cofactors(f);
  const double det = f[0].dot(c[0]), root = std::hypot(epsilon, det);
  // For negative determinants the sum would suffer cancellation, so a quotient of equal value is
  // used.
  const double chi = det >= 0 ? 0.5 * (det + root) : 0.5 * epsilon * epsilon / (root - det);
  ElementEnergy result;
  if (!(chi > 0)) {
    result.value = std::numeric_limits<double>::infinity();
    return result;
  }
  const double slope = chi / root;  // dχ / d det
  const double norm = squaredNorm(f), scale = 1 / std::cbrt(chi * chi);
  result.value = norm * scale + (1 + det * det) / chi;
  const double byDet =
      -2.0 / 3 * norm * scale / chi * slope + 2 * det / chi - (1 + det * det) / (chi * chi) * slope;
  for (std::size_t i = 0; i < 3; ++i) result.stress[i] = f[i] * (2 * scale) + c[i] * byDet;
  return result;
}

PrismElements::PrismElements(const Patch& patch, const V3d& rest, double embedDepth) {
  for (const ParticleLayer& layer : patch.layers) particles_ += layer.positions.size();
  const PrismCells cells(patch, embedDepth);
  double volume = 0;
  for (std::size_t n = 0; n < cells.size(); ++n) {
    const PrismCell cell = cells.at(n);
    V3d sides = cell.box.size() * rest;
    const double size = sides.x * sides.y * sides.z;
    volume += size;
    // A mirrored patch without folds has negative determinants. Reversing one side of the box in
    // the rest shape makes them positive.
    if (patch.mirrored) sides.x = -sides.x;
    for (std::size_t corner = 0; corner < 8; ++corner)
      addElement(
          cell.corners,
          {{{corner & 6u, corner | 1u}, {corner & 5u, corner | 2u}, {corner & 3u, corner | 4u}}},
          sides, size / 16);
    for (const auto& path : kPaths) {
      std::array<std::array<std::size_t, 2>, 3> edges;
      std::size_t at = 0;
      for (const std::size_t axis : path) {
        edges[axis] = {at, at + (1u << axis)};
        at = edges[axis][1];
      }
      addElement(cell.corners, edges, sides, size / 12);
    }
  }
  for (double& weight : weights_) weight /= volume;
  addTransposed();
}

void PrismElements::addElement(const Corners& corners,
                               const std::array<std::array<std::size_t, 2>, 3>& edges,
                               const V3d& sides, double weight) {
  const std::size_t first = entries_.size();
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const std::size_t end : {0u, 1u}) {
      const ParticleSum& corner = corners[edges[axis][end]];
      const double sign = (end ? 1 : -1) / sides[static_cast<int>(axis)];
      for (std::size_t n = 0; n < corner.count; ++n) {
        const auto same =
            std::find_if(entries_.begin() + static_cast<std::ptrdiff_t>(first), entries_.end(),
                         [&](const Entry& e) { return e.particle == corner.terms[n].particle; });
        V3d slope(0);
        slope[static_cast<int>(axis)] = sign * corner.terms[n].weight;
        if (same != entries_.end())
          same->slope += slope;
        else
          entries_.push_back({corner.terms[n].particle, slope});
      }
    }
  first_.push_back(entries_.size());
  weights_.push_back(weight);
}

void PrismElements::addTransposed() {
  firstUse_.assign(particles_ + 1, 0);
  for (const Entry& entry : entries_) ++firstUse_[entry.particle + 1];
  for (std::size_t n = 0; n < particles_; ++n) firstUse_[n + 1] += firstUse_[n];
  uses_.resize(entries_.size());
  std::vector<std::size_t> next(firstUse_.begin(), firstUse_.end() - 1);
  for (std::size_t element = 0; element < size(); ++element)
    for (std::size_t n = first_[element]; n < first_[element + 1]; ++n)
      uses_[next[entries_[n].particle]++] = {static_cast<std::uint32_t>(element),
                                             static_cast<std::uint32_t>(n)};
}

ElementSlopes PrismElements::slopes(std::size_t element, const std::vector<V3d>& positions) const {
  ElementSlopes result = {V3d(0), V3d(0), V3d(0)};
  forEachEntry(element, [&](const Entry& entry) {
    const V3d& p = positions[entry.particle];
    for (std::size_t axis = 0; axis < 3; ++axis)
      result[axis] += p * entry.slope[static_cast<int>(axis)];
  });
  return result;
}

std::vector<V3d> PrismElements::gather(const std::vector<ElementSlopes>& stress) const {
  std::vector<V3d> result(particles_);
  tbb::parallel_for(std::size_t{0}, particles_, [&](std::size_t n) {
    V3d sum(0);
    for (std::size_t use = firstUse_[n]; use < firstUse_[n + 1]; ++use) {
      const auto [element, entry] = uses_[use];
      const V3d& slope = entries_[entry].slope;
      sum += (stress[element][0] * slope.x + stress[element][1] * slope.y +
              stress[element][2] * slope.z) *
             weights_[element];
    }
    result[n] = sum;
  });
  return result;
}

double PrismElements::estimateBytes(const Patch& patch) {
  // Memory for 14 elements of at least four particles each, stored twice, and for a factorised
  // matrix.
  constexpr double kBytesPerParticle = 8000;
  return kBytesPerParticle * static_cast<double>(patch.particleCount());
}

}  // namespace mapping
