#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/patches/patch.h"

namespace mapping {

/// A place as a weighted sum of particles, counted through all layers, row by row, without rims.
struct ParticleSum {
  struct Term {
    std::uint32_t particle = 0;
    double weight = 0;
  };
  std::array<Term, 8> terms{};
  std::size_t count = 0;  ///< of the terms that are used
};

/// A box of texture space in which the straight map through the particles (see layer_map.h) is
/// trilinear, and its corners: bits 0, 1, 2 of the index tell the upper end of u, v, w.
struct PrismCell {
  Imath::Box3d box;
  std::array<ParticleSum, 8> corners;
};

/// All such boxes between the layers of a patch, and as far below or above them as a texture is
/// sunk or lifted. Between layers of unlike counts they end wherever a cell of either does.
class PrismCells {
 public:
  /// @param sink  of the texture, in w: below the surface, above w = 1 if negative
  /// @pre two layers or more
  explicit PrismCells(const Patch& patch, double embedDepth = 0);

  [[nodiscard]] std::size_t size() const { return slabs_.back().first + slabs_.back().count(); }
  [[nodiscard]] PrismCell at(std::size_t index) const;

 private:
  struct Slab {
    std::size_t lower = 0;     ///< layer; the upper is the next
    std::size_t first = 0;     ///< index of its first cell
    double from = 0, to = 0;   ///< in w
    std::vector<double> u, v;  ///< where its cells end
    [[nodiscard]] std::size_t count() const { return (u.size() - 1) * (v.size() - 1); }
  };
  void addLayer(ParticleSum& sum, std::size_t layer, double u, double v, double share) const;

  std::vector<Slab> slabs_;
  std::vector<std::array<std::size_t, 3>> layers_;  ///< columns, rows, first particle
  std::vector<double> w_;
};

/// Mean lengths of the rows and columns on the surface, and the height: with u, v and w multiplied
/// by them, slopes are about 1.
[[nodiscard]] Imath::V3d meanExtents(const Patch& patch);

/// Positions of all particles but the rims', layer by layer.
[[nodiscard]] std::vector<Imath::V3d> particlePositions(const Patch& patch);

/// The world position of a weighted sum of particles.
[[nodiscard]] Imath::V3d positionOf(const ParticleSum& sum,
                                    const std::vector<Imath::V3d>& positions);

}  // namespace mapping
