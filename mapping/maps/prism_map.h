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

/// The map that is straight in each tetrahedron of a patch's lattice, the hybrid of particle layers
/// and shell maps [Brodersen07 §9; Porumbescu05]. Continuous, defined in the lattice only, and
/// where no tetrahedron is turned over it goes both ways.
class PrismMap final : public PatchMap {
 public:
  PrismMap(const Patch& patch, const LatticeBorder& border);

  [[nodiscard]] Imath::V3d operator()(const Imath::V3d& x) const override;
  [[nodiscard]] Imath::M33d jacobian(const Imath::V3d& x) const override;
  [[nodiscard]] std::unique_ptr<BlockMap> restrictTo(const GridBlock& block,
                                                     double tolerance) const override;
  /// Of every tetrahedron where the texture lies: the unit cube of the patch, and as far below or
  /// above it as it is sunk or lifted.
  [[nodiscard]] std::vector<MapSample> samples() const;
  [[nodiscard]] bool isLocal() const override { return true; }
  /// What making it and looking at all of its tetrahedra takes.
  [[nodiscard]] static double estimateBytes(const Patch& patch);
  /// From texture coordinates to patch space; NaN outside the lattice.
  [[nodiscard]] Imath::V3d toPatch(const Imath::V3d& uvw) const;
  [[nodiscard]] const Lattice& lattice() const { return lattice_; }
  /// How many of these places the map sends elsewhere in the texture than where they come from:
  /// there the shell passes through itself. @param first  one of them, unchanged where there is
  /// none
  [[nodiscard]] std::size_t countOverlaps(std::span<const MapSample> samples,
                                          MapSample& first) const;
  /// Is a place of texture space in the unit cube, or as far below or above it as the texture is
  /// sunk or lifted?
  [[nodiscard]] bool holdsTexture(const Imath::V3d& uvw) const;

 private:
  friend class PrismBlock;
  /// A point with what rounding may leave between it and the cell that holds it.
  [[nodiscard]] Imath::Box3d aroundPoint(const Imath::V3d& x) const;
  /// @return false where no tetrahedron holds x
  [[nodiscard]] bool find(const Imath::V3d& x, Tetrahedron& t) const;

  Lattice lattice_;
  double embedDepth_;  ///< in w
  CellTree tree_;
};

}  // namespace mapping
