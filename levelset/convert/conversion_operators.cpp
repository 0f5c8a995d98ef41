#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/convert/surface_band.h"
#include "levelset/error.h"

namespace levelset {
namespace {

Figures figuresOf(const SignCertificate& c) {
  Figures figures{{"closed", c.closed},
                  {"boundary_edges", c.boundaryEdges},
                  {"non_manifold_edges", c.nonManifoldEdges}};
  if (c.selfIntersections < 0)
    figures.emplace_back("self_intersections", std::string("not searched"));
  else
    figures.emplace_back("self_intersections", static_cast<std::size_t>(c.selfIntersections));
  figures.emplace_back("method", std::string(c.method == SignMode::Closed ? "closed" : "winding"));
  figures.emplace_back("flipped", c.flipped);
  figures.emplace_back("ambiguous_share", c.ambiguousShare);
  figures.emplace_back("dropped_triangles", c.droppedTriangles);
  return figures;
}

}  // namespace

const OperatorText LevelSetOperator::text{
    .name = "level-set",
    .group = "Conversion",
    .summary = "turn a mesh into a level set with exact distances",
    .details =
        "--sign auto selects 'closed' when every edge has two faces and no self-intersection is "
        "found, otherwise 'winding' (inside where the generalised winding number exceeds one "
        "half). The sign certificate in the report lists the properties of the mesh. A mesh whose "
        "sign would be a guess is an error "
        "without --accept-sign. --method prism is faster for wide bands.",
    .example = "levelsmith read dragon.ply ! level-set --resolution 512 ! write dragon.vdb"};

double LevelSetOperator::longestSide(const Options&, Plans operands) {
  return operands[0].longestSide();
}

NarrowBand LevelSetOperator::run(const TriMesh& mesh, const Options& options, OperatorRun& run) {
  const MeshToBandOptions settings{.halfWidth = options.halfWidth,
                                   .sign = options.sign,
                                   .nesting = options.nesting,
                                   .acceptSign = options.acceptsSign,
                                   .searchSelfIntersections = !options.skipsIntersectionTest,
                                   .method = options.method,
                                   .roi = run.roi,
                                   .maxMemory = run.maxMemory,
                                   .progress = run.progress,
                                   .onMeshRead = run.releaseOperands,
                                   .onCertificate = [&](const SignCertificate& certificate) {
                                     run.certificate = figuresOf(certificate);
                                     run.notes.push_back(describe(certificate));
                                   }};
  MeshToBandResult result = meshToBand(mesh, options.voxel.edge, settings);
  if (options.acceptsSign && result.band.zeroSetBounds().isEmpty()) {
    run.warnings.push_back(
        "no grid point lies inside: the band contains distances to the mesh but no zero set; close "
        "the mesh to get a solid");
  } else if (options.acceptsSign && result.certificate.ambiguousShare > kAmbiguousLimit) {
    run.warnings.push_back(
        fmt::format("inside and outside are a guess at a fraction of {:.2g} of the voxels next to "
                    "the surface; close the holes to get a reliable sign",
                    result.certificate.ambiguousShare));
  }
  return std::move(result.band);
}

ValuePlan LevelSetOperator::plan(const Options& options, Plans operands, const OperatorRun&) {
  ValuePlan plan = operands[0];
  plan.triangles = 0;
  plan.voxelSize = options.voxel.edge;
  plan.halfWidth = options.halfWidth;
  checkVoxelSize(plan.voxelSize, plan.longestSide());
  double reach = 0;
  for (int axis = 0; axis < 3; ++axis)
    reach = std::max({reach, std::abs(plan.bounds.min[axis]), std::abs(plan.bounds.max[axis])});
  if (!(reach / plan.voxelSize < std::numeric_limits<std::int32_t>::max()))
    throw ResourceLimit(
        fmt::format("the mesh extends to {:.3g} voxels from the origin, beyond the range of 32-bit "
                    "indices; use larger voxels or move the mesh to the origin",
                    reach / plan.voxelSize));
  return plan;
}

std::optional<Cost> LevelSetOperator::cost(const Options& options, const OperatorPlans& plans) {
  const double triangles = plans.operands[0].triangles, voxels = plans.result.activeVoxels();
  if (triangles == 0) return {};
  if (options.method == DistanceMethod::Prisms)
    return Cost{1e-9 * (4000 * triangles + 130 * voxels), 340 * triangles + 4 * voxels};
  return Cost{1e-9 * (2800 * triangles + 500 * voxels), 60 * triangles + 4 * voxels};
}

const OperatorText SurfaceBandOperator::text{
    .name = "surface-band",
    .group = "Conversion",
    .summary = "turn an open mesh (terrain, a sheet) into a base for patches",
    .details =
        "Computes signed distances to an open, consistently oriented mesh, up to its border. The "
        "band has no inside: 'patch', 'decal', 'patch-grid', 'scatter' and 'folds' accept it as "
        "base, and 'texture' accepts it with --alone or --map mesh. Patches end at the border. The "
        "half width must be at least the height of the patches plus six voxels, unless their "
        "layers follow a spline. Use "
        "'level-set' for a closed mesh.",
    .example =
        "levelsmith heightmap --image <(printf '0 1 0\\n1 2 1\\n0 1 0\\n') --size 8,8 --height 2 "
        "--voxel 0.2 --sheet ! surface-band --voxel 0.2 --half-width 12 ! patch --at "
        "0,0,2 --size 3,3 --height 1 ! mesh ! measure"};

double SurfaceBandOperator::longestSide(const Options&, Plans operands) {
  return operands[0].longestSide();
}

void SurfaceBandOperator::check(const Options& options, const GivenOptions&) {
  if (options.halfWidth < kMinSurfaceHalfWidth) {
    throw UsageError(fmt::format("--half-width is {} voxels; give at least {}", options.halfWidth,
                                 kMinSurfaceHalfWidth));
  }
}

NarrowBand SurfaceBandOperator::run(const TriMesh& mesh, const Options& options, OperatorRun& run) {
  SurfaceBandResult result = surfaceBand(
      mesh, options.voxel.edge,
      {.halfWidth = options.halfWidth, .maxMemory = run.maxMemory, .progress = run.progress});
  run.notes.push_back(fmt::format("{} border edges, {} degenerate or duplicate triangles dropped",
                                  result.borderEdges, result.droppedTriangles));
  if (result.removedVoxels > 0)
    run.notes.push_back(
        fmt::format("removed {} voxels half way between the front of one part of the surface and "
                    "the back of another; patches cannot extend there",
                    result.removedVoxels));
  return std::move(result.band);
}

ValuePlan SurfaceBandOperator::plan(const Options& options, Plans operands, const OperatorRun&) {
  ValuePlan plan = operands[0];
  plan.triangles = 0;
  plan.voxelSize = options.voxel.edge;
  plan.halfWidth = options.halfWidth;
  checkVoxelSize(plan.voxelSize, plan.longestSide());
  return plan;
}

}  // namespace levelset
