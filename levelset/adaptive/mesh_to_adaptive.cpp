#include "levelset/adaptive/mesh_to_adaptive.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/adaptive/mesh_distance.h"
#include "levelset/convert/mesh_to_band_input.h"
#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

namespace levelset {
namespace {

/// Limits of the resolution of the surface that spans holes, voxels along the longest side.
constexpr double kLargestGrid = 1024, kSmallestGrid = 8;

}  // namespace

MeshToAdaptiveResult meshToAdaptive(const TriMesh& mesh, const MeshToAdaptiveOptions& options) {
  if (!(options.tolerance > 0) || !std::isfinite(options.tolerance))
    throw UsageError(
        fmt::format("the tolerance {} is not positive; give a positive one", options.tolerance));
  convert::checkElements(mesh);
  const Imath::Box3d box = bounds(mesh);
  const Imath::V3d size = box.max - box.min;
  const double longest = std::max({size.x, size.y, size.z});
  if (!(longest > 0))
    throw InvalidInput("all vertices of the mesh coincide; there is no surface to convert");
  constexpr double kBytesPerTriangle = 900;  // search tree, pseudonormals, winding numbers, sides
  requireMemory(kBytesPerTriangle * double(mesh.triangles.size()), memoryLimit(options.maxMemory));
  const double voxel =
      std::clamp(options.tolerance, longest / kLargestGrid, longest / kSmallestGrid);
  const MeshDistance distance(mesh, voxel,
                              {.sign = options.sign,
                               .nesting = options.nesting,
                               .acceptSign = options.acceptSign,
                               .searchSelfIntersections = options.searchSelfIntersections,
                               .maxMemory = options.maxMemory,
                               .progress = subProgress(options.progress, 0, 0.2)});
  MeshToAdaptiveResult result;
  result.certificate = distance.certificate();
  if (result.certificate.ambiguousShare > kAmbiguousLimit && !options.acceptSign)
    throw InvalidInput(fmt::format(
        "inside and outside are a guess at {:.2g} % of the surface ({} boundary edges, {} "
        "non-manifold); close the holes, or accept the guess with --accept-sign",
        100 * result.certificate.ambiguousShare, result.certificate.boundaryEdges,
        result.certificate.nonManifoldEdges));
  result.field = buildAdaptive(distance, box,
                               {.tolerance = options.tolerance,
                                .halfWidth = options.halfWidth,
                                .isTricubic = options.isTricubic,
                                .maxMemory = options.maxMemory,
                                .progress = subProgress(options.progress, 0.2, 1)},
                               &result.report);
  if (!options.acceptSign && result.field.zeroSetBounds().isEmpty())
    throw InvalidInput(
        fmt::format("the mesh encloses no volume: no corner of a cell lies inside ({} boundary "
                    "edges); close it first, or accept distances without an inside with "
                    "--accept-sign",
                    result.certificate.boundaryEdges));
  return result;
}

}  // namespace levelset
