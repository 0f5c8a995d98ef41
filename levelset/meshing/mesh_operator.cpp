#include <fmt/core.h>

#include <numbers>

#include "levelset/error.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/meshing/extended_mesh.h"
#include "levelset/meshing/front_mesh.h"

namespace levelset {
namespace {

TriMesh runExtended(const NarrowBand& band, const MeshOperator::Options& options,
                    OperatorRun& run) {
  ExtendedMesh result =
      bandToExtendedMesh(band, {.original = options.original, .progress = run.progress});
  run.figures = {{"edge_vertices", result.edgeVertices},
                 {"corner_vertices", result.cornerVertices},
                 {"missing_crossings", result.missingCrossings}};
  if (result.missingCrossings > 0)
    run.notes.push_back(
        fmt::format("{} of {} grid edges that the surface crosses miss the mesh --original; the "
                    "level set gives their crossings",
                    result.missingCrossings, result.crossings));
  return std::move(result.mesh);
}

TriMesh runFront(const NarrowBand& band, const MeshOperator::Options& options, OperatorRun& run) {
  BandFrontMesh result =
      bandToFrontMesh(band, {.edgeLength = options.edgeLength.value_or(0),
                             .angle = options.angleDegrees * std::numbers::pi / 180,
                             .progress = run.progress});
  run.figures = {{"components", result.components},
                 {"uniform_components", result.uniform},
                 {"filled_triangles", result.filled}};
  if (result.uniform > 0)
    run.notes.push_back(
        fmt::format("the front found no mesh of {} of {} components, so they have the triangles of "
                    "marching cubes; smooth the solid first, or use a finer voxel",
                    result.uniform, result.components));
  return std::move(result.mesh);
}

}  // namespace

const OperatorText MeshOperator::text{
    .name = "mesh",
    .group = "Conversion",
    .summary = "turn a level set, or the space of a patch, into a closed triangle mesh",
    .details =
        "The mesh of a patch is one closed surface: its lowest layer, its highest layer and its "
        "sides. With --sheets it is the separate surfaces of all layers. An advancing front suits "
        "smooth solids. Where it finds no mesh, as on noisy scans, a component keeps the triangles "
        "of marching cubes, with a note. Its long edges cut material off curved parts: give a "
        "smaller --angle for more accuracy.",
    .example = "levelsmith box --size 2,2,2 --voxel 0.1 ! mesh --sharp ! write box.ply"};

void MeshOperator::check(const Options& options, const GivenOptions& given) {
  if (options.adaptivity > 1) throw UsageError("--adaptivity must lie between 0 and 1");
  if (options.sharp && options.adaptivity > 0)
    throw UsageError("--sharp and --adaptivity exclude each other; give one");
  if (options.sharp && given("method") && options.method != MeshMethod::Dual)
    throw UsageError("--sharp is --method dual; leave out --sharp, or give --method dual");
  if (options.method != MeshMethod::AdvancingFront && (given("edge-length") || given("angle")))
    throw UsageError(
        "--edge-length and --angle are for --method advancing-front; give that method, or leave "
        "them out");
  if (!(options.angleDegrees <= 57)) throw UsageError("--angle must be at most 57 degrees");
  if (options.adaptivity > 0 && options.method != MeshMethod::MarchingCubes)
    throw UsageError("--adaptivity is for --method marching-cubes; leave one of them out");
}

TriMesh MeshOperator::run(std::vector<NarrowBand> operands, const Options& options,
                          OperatorRun& run) {
  if (options.method == MeshMethod::Extended) return runExtended(operands[0], options, run);
  if (options.method == MeshMethod::AdvancingFront) return runFront(operands[0], options, run);
  return bandToMesh(operands[0], {.adaptivity = options.adaptivity,
                                  .sharp = options.sharp || options.method == MeshMethod::Dual,
                                  .progress = run.progress});
}

ValuePlan MeshOperator::plan(const Options&, Plans operands, const OperatorRun&) {
  // Number of triangles per voxel² of surface area. An advancing front yields far fewer, the other
  // methods few more.
  constexpr double kTriangles = 3.35;
  const ValuePlan& solid = operands[0];
  return {.bounds = solid.bounds, .area = solid.area, .triangles = kTriangles * solid.layer()};
}

/// Requests a half width of 1.5 voxels. The ends of a grid edge that the zero set crosses are less
/// than a voxel from it; half a voxel is added for distances that are not exact.
RegionOfInterest MeshOperator::regionOfInterest(const Options& options, const OperatorPlans&,
                                                std::size_t, const RegionOfInterest&) {
  if (!options.isUniform()) return {};
  return {.halfWidth = 1.5};
}

std::optional<Cost> MeshOperator::cost(const Options& options, const OperatorPlans& plans) {
  const ValuePlan& solid = plans.operands[0];
  if (!solid.isBand()) return {};
  const double layer = solid.layer();
  if (options.method == MeshMethod::Extended) return Cost{1e-9 * 1300 * layer, 420 * layer};
  if (options.method == MeshMethod::AdvancingFront) return Cost{1e-9 * 20000 * layer, 550 * layer};
  if (options.sharp || options.method == MeshMethod::Dual)
    return Cost{1e-9 * 1300 * layer, 420 * layer};
  return Cost{1e-9 * 330 * layer, 40 * layer};
}

}  // namespace levelset
