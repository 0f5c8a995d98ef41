#pragma once

#include <cstddef>

#include "levelset/fields/grid.h"
#include "levelset/progress.h"
#include "mapping/distortion/fold_certificate.h"
#include "mapping/patches/patch.h"

namespace mapping {

struct JacobianFieldOptions {
  double voxelSize = 0;   ///< world units, positive
  double embedDepth = 0;  ///< of the texture, in w
  std::size_t maxMemory = levelset::kNoMemoryLimit;
};

/// The Jacobian of a map on the grid points of patch space, in the unit of its certificate: 1 where
/// it is the median, ≤ 0 where the map turns over. Where parts of a folded patch lie upon each
/// other the least one counts; the worst places of the certificate are set even between grid
/// points. The background is 1.
/// @throws UsageError for a voxel size that is not positive; ResourceLimit
[[nodiscard]] levelset::FieldGrid jacobianField(const Patch& patch, const RbfMap& map,
                                                const FoldCertificate& certificate,
                                                const JacobianFieldOptions& options);
[[nodiscard]] levelset::FieldGrid jacobianField(const Patch& patch, const PrismMap& map,
                                                const FoldCertificate& certificate,
                                                const JacobianFieldOptions& options);
/// Of the map that is straight between the particles, see layer_map.h.
[[nodiscard]] levelset::FieldGrid jacobianField(const Patch& patch,
                                                const FoldCertificate& certificate,
                                                const JacobianFieldOptions& options);

}  // namespace mapping
