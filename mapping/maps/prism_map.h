#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "mapping/maps/cell_tree.h"
#include "mapping/maps/lattice.h"
#include "mapping/maps/patch_map.h"
#include "mapping/patches/patch.h"

namespace mapping {

/// Piecewise linear map on the tetrahedra of a patch's lattice: a hybrid of particle layers and
/// shell maps [Brodersen07 §9; Porumbescu05]. It is continuous and defined only in the lattice. It
/// is invertible if no tetrahedron is inverted. The outermost cells continue the lattice linearly
/// and may reach back into it where the patch bends. An inner cell then has precedence.
class PrismMap final : public PatchMap {
 public:
  PrismMap(const Patch& patch, const LatticeBorder& border);

  [[nodiscard]] Imath::V3d operator()(const Imath::V3d& x) const override;
  [[nodiscard]] Imath::M33d jacobian(const Imath::V3d& x) const override;
  [[nodiscard]] std::unique_ptr<BlockMap> restrictTo(const GridBlock& block,
                                                     double tolerance) const override;
  /// Samples one point in every tetrahedron that contains a part of the texture. The texture fills
  /// the unit cube of the patch, extended below or above it by the embedding depth.
  [[nodiscard]] std::vector<MapSample> samples() const;
  [[nodiscard]] bool isLocal() const override { return true; }
  /// Memory for building the map and for sampling all its tetrahedra, bytes.
  [[nodiscard]] static double estimateBytes(const Patch& patch);
  /// Maps texture coordinates to a world position above the patch; NaN outside the lattice.
  [[nodiscard]] Imath::V3d toPatch(const Imath::V3d& uvw) const;
  /// toPatch() with derivatives. On a face between two tetrahedra they are those of the one that
  /// Lattice::locate finds.
  [[nodiscard]] ForwardFrame frame(const Imath::V3d& uvw) const;
  [[nodiscard]] const Lattice& lattice() const { return lattice_; }
  /// Counts the samples whose position the map sends to texture coordinates inside the texture
  /// other than their own. Such a sample means that the offset layer passes through itself.
  /// @param first  set to the first such sample; unchanged if there is none
  [[nodiscard]] std::size_t countOverlaps(std::span<const MapSample> samples,
                                          MapSample& first) const;
  /// True if a point of texture space lies in the unit cube, extended below or above it by the
  /// embedding depth.
  [[nodiscard]] bool holdsTexture(const Imath::V3d& uvw) const;

 private:
  friend class PrismBlock;
  /// Small world box around a point, so that it meets the box of the cell that contains the point,
  /// despite rounding.
  [[nodiscard]] Imath::Box3d aroundPoint(const Imath::V3d& x) const;
  /// Finds the tetrahedron that contains x.
  /// @return false if there is none
  [[nodiscard]] bool find(const Imath::V3d& x, Tetrahedron& t) const;

  Lattice lattice_;
  /// Depth of the texture below w = 0; if negative, its lift above w = 1; in w.
  double embedDepth_;
  CellTree tree_;
};

}  // namespace mapping
