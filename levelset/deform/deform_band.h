#pragma once

#include <cstddef>
#include <optional>

#include "levelset/deform/deformation.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

/// Largest width of the certified domain beside the surface, voxels of the result.
inline constexpr double kWidestDeformationDomain = 10;

struct DeformBandOptions {
  std::optional<double> voxelSize = {};  ///< voxel size of the result; empty: that of the operand
  std::optional<double> halfWidth = {};  ///< half width of the result, voxels; empty: as above
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct DeformBandResult {
  NarrowBand band;
  FoldCertificate certificate;
};

/// Deforms a solid. Each grid point beside the deformed surface finds the point that is moved
/// to it, by Newton's method, and takes the value of the solid there from a tricubic
/// interpolant. The distances to the zero set of these values are then computed exactly, as
/// redistance() does. The surface is accurate to second order in the voxel size, and to fourth
/// order where the interpolants are smooth; edges that turn by 40 degrees or more stay sharp. An
/// identity returns the operand, unless another grid is asked for.
/// @throws InvalidInput for an empty solid, an open surface, a map that is not proven to be
///         injective, a surface that leaves its domain, or voxels that are too large for the result
/// @throws UsageError for a voxel size or half width out of range
/// @throws ResourceLimit, Cancelled
[[nodiscard]] DeformBandResult deformBand(const NarrowBand& solid, const Deformation& deformation,
                                          const DeformBandOptions& options = {});
[[nodiscard]] inline DeformBandResult deformBand(const NarrowBand& solid,
                                                 const ControlLattice& lattice,
                                                 const DeformBandOptions& options = {}) {
  return deformBand(solid, LatticeDeformation(lattice), options);
}

}  // namespace levelset
