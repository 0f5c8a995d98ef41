#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/patches/patch.h"

namespace mapping {

/// Slopes of texture → patch as columns: ∂x/∂u, ∂x/∂v, ∂x/∂w in units of the shape at rest.
using ElementSlopes = std::array<Imath::V3d, 3>;

/// The energy of one element for each volume at rest, and its derivative by the slopes.
struct ElementEnergy {
  double value = 0;  ///< infinite where the element must not be
  ElementSlopes stress{Imath::V3d(0), Imath::V3d(0), Imath::V3d(0)};
};

/// |F|² + |F⁻¹|², the symmetric Dirichlet energy: 6 for a rotation, infinite where F turns over
/// [Smith15].
[[nodiscard]] ElementEnergy symmetricDirichlet(const ElementSlopes& slopes);

/// |F|² / χ^⅔ + (1 + det²) / χ with χ = (det + √(ε² + det²)) / 2 in place of det: finite for any F,
/// and as ε goes to nothing it forbids folds [Garanzha21].
[[nodiscard]] ElementEnergy foldoverEnergy(const ElementSlopes& slopes, double epsilon);

[[nodiscard]] double determinantOf(const ElementSlopes& slopes);

/// The cells of a patch's shell as elements in which slopes are linear in the particles: the eight
/// corners of each cell, where a trilinear map turns over first, and its six tetrahedra.
class PrismElements {
 public:
  /// @param rest  size of the unit cube at rest, world units
  /// @param sink  see PrismCells
  PrismElements(const Patch& patch, const Imath::V3d& rest, double embedDepth);

  [[nodiscard]] std::size_t size() const { return weights_.size(); }
  [[nodiscard]] std::size_t particleCount() const { return particles_; }
  /// Share of an element in the volume at rest.
  [[nodiscard]] double weight(std::size_t element) const { return weights_[element]; }
  [[nodiscard]] ElementSlopes slopes(std::size_t element,
                                     const std::vector<Imath::V3d>& positions) const;
  /// Derivatives by each particle's position, from those by each element's slopes.
  [[nodiscard]] std::vector<Imath::V3d> gather(const std::vector<ElementSlopes>& stress) const;

  /// A particle's share in an element: slopes += position × slope, column by column.
  struct Entry {
    std::uint32_t particle;
    Imath::V3d slope;
  };
  /// Calls visit(entry) for each particle of an element.
  template <typename Visit>
  void forEachEntry(std::size_t element, const Visit& visit) const {
    for (std::size_t n = first_[element]; n < first_[element + 1]; ++n) visit(entries_[n]);
  }
  /// What elements and their solution take.
  [[nodiscard]] static double estimateBytes(const Patch& patch);

 private:
  using Corners = std::array<struct ParticleSum, 8>;
  void addElement(const Corners& corners, const std::array<std::array<std::size_t, 2>, 3>& edges,
                  const Imath::V3d& sides, double weight);
  void addTransposed();

  std::size_t particles_ = 0;
  std::vector<std::size_t> first_ = {0};
  std::vector<Entry> entries_;
  std::vector<double> weights_;
  std::vector<std::size_t> firstUse_;
  std::vector<std::array<std::uint32_t, 2>> uses_;  ///< element and entry, particle by particle
};

}  // namespace mapping
