#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/patches/patch.h"

namespace mapping {

/// Slopes of the map from texture coordinates to positions, as columns: ∂x/∂u, ∂x/∂v, ∂x/∂w, where
/// u, v and w are lengths in the undeformed (rest) shape.
using ElementSlopes = std::array<Imath::V3d, 3>;

/// Energy density of one element, per unit of its volume in the rest shape, and its derivative with
/// respect to the slopes.
struct ElementEnergy {
  double value = 0;  ///< infinite for slopes that the energy forbids
  ElementSlopes stress{Imath::V3d(0), Imath::V3d(0), Imath::V3d(0)};
};

/// Returns |F|² + |F⁻¹|², the symmetric Dirichlet energy: 6 for a rotation, infinite where det F ≤
/// 0 [Smith15]. F is the matrix of the slopes.
[[nodiscard]] ElementEnergy symmetricDirichlet(const ElementSlopes& slopes);

/// Returns |F|² / χ^⅔ + (1 + det²) / χ, with F the matrix of the slopes and det its determinant. χ
/// = (det + √(ε² + det²)) / 2 replaces det. The energy is finite for every F if ε > 0, and forbids
/// folds in the limit ε → 0 [Garanzha21].
[[nodiscard]] ElementEnergy foldoverEnergy(const ElementSlopes& slopes, double epsilon);

[[nodiscard]] double determinantOf(const ElementSlopes& slopes);

/// The cells of a patch (PrismCells), split into elements whose slopes are linear in the particle
/// positions. Each cell has 14 elements: its eight corners, where a trilinear map inverts first,
/// and its six tetrahedra.
class PrismElements {
 public:
  /// @param rest  size of the unit cube of u, v, w in the undeformed shape, world units
  /// @param embedDepth  depth of the texture below the surface, in w, see PrismCells
  PrismElements(const Patch& patch, const Imath::V3d& rest, double embedDepth);

  [[nodiscard]] std::size_t size() const { return weights_.size(); }
  [[nodiscard]] std::size_t particleCount() const { return particles_; }
  /// Share of an element in the total volume of the rest shape.
  [[nodiscard]] double weight(std::size_t element) const { return weights_[element]; }
  [[nodiscard]] ElementSlopes slopes(std::size_t element,
                                     const std::vector<Imath::V3d>& positions) const;
  /// Computes the derivatives of the weighted sum of the element energies with respect to particle
  /// positions. `stress` has the derivatives of each energy with respect to the element's slopes.
  [[nodiscard]] std::vector<Imath::V3d> gather(const std::vector<ElementSlopes>& stress) const;

  /// Contribution of one particle to an element: slopes += position × slope, column by column.
  struct Entry {
    std::uint32_t particle;
    Imath::V3d slope;
  };
  /// Calls visit(entry) for each particle of an element.
  template <typename Visit>
  void forEachEntry(std::size_t element, const Visit& visit) const {
    for (std::size_t n = first_[element]; n < first_[element + 1]; ++n) visit(entries_[n]);
  }
  /// Memory for the elements and for minimising an energy over them, bytes.
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
  /// For each particle n, the uses firstUse_[n] … firstUse_[n + 1] − 1: index of an element that
  /// depends on the particle, and index of the element's entry for it.
  std::vector<std::array<std::uint32_t, 2>> uses_;
};

}  // namespace mapping
