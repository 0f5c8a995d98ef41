#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/patches/patch.h"

namespace mapping {

/// A position as a weighted sum of particles. Particles are counted layer by layer and row by row,
/// without rims.
struct ParticleSum {
  struct Term {
    std::uint32_t particle = 0;
    double weight = 0;
  };
  std::array<Term, 8> terms{};
  std::size_t count = 0;  ///< number of terms in use
};

/// A box of texture space in which the piecewise linear map through the particles (see layer_map.h)
/// is trilinear, with its eight corners. Bits 0, 1, 2 of a corner's index select the upper end of
/// u, v, w.
struct PrismCell {
  Imath::Box3d box;
  std::array<ParticleSum, 8> corners;
};

/// All trilinear boxes between the layers of a patch. They continue below or above the layers by
/// the embedding depth of the texture. Between layers of different counts the boxes end at the cell
/// borders of both layers.
class PrismCells {
 public:
  /// @param embedDepth  depth of the texture below the surface, in w; if negative, its lift above w
  ///         = 1
  /// @pre two layers or more
  explicit PrismCells(const Patch& patch, double embedDepth = 0);

  [[nodiscard]] std::size_t size() const { return slabs_.back().first + slabs_.back().count(); }
  [[nodiscard]] PrismCell at(std::size_t index) const;

 private:
  struct Slab {
    std::size_t lower = 0;     ///< index of the lower layer; the upper layer is the next
    std::size_t first = 0;     ///< index of its first box, see PrismCells::at
    double from = 0, to = 0;   ///< range of w; the end slab includes the embedding depth
    std::vector<double> u, v;  ///< cell borders along u and v
    [[nodiscard]] std::size_t count() const { return (u.size() - 1) * (v.size() - 1); }
  };
  void addLayer(ParticleSum& sum, std::size_t layer, double u, double v, double share) const;

  std::vector<Slab> slabs_;
  /// For each layer: number of columns, number of rows, and index of its first particle.
  std::vector<std::array<std::size_t, 3>> layers_;
  std::vector<double> w_;
};

/// Mean lengths of the rows and columns on the surface, and the height of the patch, world units.
/// With u, v and w multiplied by these lengths, slopes are about 1.
[[nodiscard]] Imath::V3d meanExtents(const Patch& patch);

/// Positions of all particles except those of the rims, layer by layer.
[[nodiscard]] std::vector<Imath::V3d> particlePositions(const Patch& patch);

/// World position of a weighted sum of particles.
[[nodiscard]] Imath::V3d positionOf(const ParticleSum& sum,
                                    const std::vector<Imath::V3d>& positions);

}  // namespace mapping
