#pragma once

#include <cstddef>

#include "levelset/fields/grid.h"
#include "levelset/progress.h"
#include "mapping/distortion/fold_certificate.h"
#include "mapping/patches/patch.h"

namespace mapping {

struct JacobianFieldOptions {
  double voxelSize = 0;  ///< voxel size of the field, world units, positive
  /// Depth of the texture below the surface, in w; negative: its lift above w = 1.
  double embedDepth = 0;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
};

/// Computes the Jacobian determinant of a map at the grid points in the space above a patch,
/// divided by the median determinant of the certificate. It is ≤ 0 where the map is inverted. Where
/// a folded patch overlaps itself, the field has the least of the overlapping values. The
/// determinants at the worst points of the certificate are written to the nearest grid points. The
/// background is 1.
/// @throws UsageError for a voxel size that is not positive
/// @throws ResourceLimit if it needs more than `maxMemory` bytes
[[nodiscard]] levelset::FieldGrid jacobianField(const Patch& patch, const RbfMap& map,
                                                const FoldCertificate& certificate,
                                                const JacobianFieldOptions& options);
[[nodiscard]] levelset::FieldGrid jacobianField(const Patch& patch, const PrismMap& map,
                                                const FoldCertificate& certificate,
                                                const JacobianFieldOptions& options);
/// Computes the Jacobian field for the piecewise linear map through the particle layers
/// (layer_map.h).
[[nodiscard]] levelset::FieldGrid jacobianField(const Patch& patch,
                                                const FoldCertificate& certificate,
                                                const JacobianFieldOptions& options);

}  // namespace mapping
