#include "levelset/adaptive/adaptive_to_band.h"

#include "levelset/adaptive/adaptive_to_mesh.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"

namespace levelset {

NarrowBand adaptiveToBand(const AdaptiveField& field, double voxelSize,
                          const AdaptiveToBandOptions& options) {
  const TriMesh mesh = adaptiveToMesh(
      field, {.maxMemory = options.maxMemory, .progress = subProgress(options.progress, 0, 0.3)});
  if (mesh.isEmpty())
    throw InvalidInput("the adaptive field has no surface; check how it was made");
  return meshToBand(mesh, voxelSize,
                    {.halfWidth = options.halfWidth,
                     .sign = SignMode::Closed,
                     .searchSelfIntersections = false,
                     .maxMemory = options.maxMemory,
                     .progress = subProgress(options.progress, 0.3, 1)})
      .band;
}

}  // namespace levelset
