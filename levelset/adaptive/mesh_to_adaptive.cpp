#include "levelset/adaptive/mesh_to_adaptive.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/adaptive/mesh_distance.h"
#include "levelset/error.h"

namespace levelset {
namespace {

/// Resolution of the surface that spans holes: the tolerance, but at most this many voxels along
/// the longest side.
constexpr double kLargestGrid = 1024;

}  // namespace

MeshToAdaptiveResult meshToAdaptive(const TriMesh& mesh, const MeshToAdaptiveOptions& options) {
  const Imath::Box3d box = bounds(mesh);
  if (box.isEmpty()) throw InvalidInput("the mesh has no triangles; read another file");
  const Imath::V3d size = box.max - box.min;
  const double longest = std::max({size.x, size.y, size.z});
  if (!(options.tolerance > 0) || !std::isfinite(options.tolerance))
    throw UsageError(
        fmt::format("the tolerance {} is not positive; give a positive one", options.tolerance));
  const double voxel = std::clamp(options.tolerance, longest / kLargestGrid,
                                  std::max(longest / 8, options.tolerance));
  const MeshDistance distance(mesh, std::min(voxel, longest / 8),
                              {.sign = options.sign,
                               .nesting = options.nesting,
                               .acceptSign = options.acceptSign,
                               .searchSelfIntersections = options.searchSelfIntersections,
                               .maxMemory = options.maxMemory,
                               .progress = subProgress(options.progress, 0, 0.2)});
  MeshToAdaptiveResult result;
  result.field = buildAdaptive(distance, box,
                               {.tolerance = options.tolerance,
                                .halfWidth = options.halfWidth,
                                .maxMemory = options.maxMemory,
                                .progress = subProgress(options.progress, 0.2, 1)},
                               &result.report);
  result.certificate = distance.certificate();
  if (result.certificate.ambiguousShare > kAmbiguousLimit && !options.acceptSign)
    throw InvalidInput(fmt::format(
        "inside and outside are a guess at {:.2g} % of the points next to the surface ({} boundary "
        "edges, {} non-manifold); close the holes, or accept the guess with --accept-sign",
        100 * result.certificate.ambiguousShare, result.certificate.boundaryEdges,
        result.certificate.nonManifoldEdges));
  return result;
}

}  // namespace levelset
