#pragma once

#include <Imath/ImathBox.h>

#include <functional>
#include <optional>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct RedistanceOptions {
  std::optional<double> halfWidth = {};     ///< of the result, voxels; empty: as the operand
  std::optional<Imath::Box3d> region = {};  ///< world box: distances are made only inside it
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Makes a signed distance again out of a field that has the right zero set, without moving that.
/// Beside the interface each grid point finds the closest point on a local high-order interpolant;
/// from there closest points travel outwards block by block, and each grid point keeps the nearest.
/// The result does not depend on the order of blocks or on the number of threads.
/// @param field  right sign everywhere, Lipschitz, any slope; only values beside the zero set are
/// read
/// @throws InvalidInput if the field has no zero crossing
[[nodiscard]] NarrowBand redistance(NarrowBand field, const RedistanceOptions& options = {});

}  // namespace levelset
