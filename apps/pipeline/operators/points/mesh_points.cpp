#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/points/meshing/points_to_mesh.h"

namespace pipeline {
namespace {

using levelset::UsageError;

Kind makesMeshOfPoints(const Invocation&) {
  return Kind::Mesh;
}

Value runMeshPoints(Invocation& in) {
  levelset::PointsToMeshResult result = levelset::pointsToMesh(
      in.operands[0].cloud(),
      {.edgeLength = in.given("edge") ? in.length("edge") : 0,
       .angle = in.number("angle") * std::numbers::pi / 180,
       .smoothing = in.number("smoothing"),
       .gap = in.number("gap"),
       .sharpAngle = in.given("sharp") ? in.number("sharp") * std::numbers::pi / 180 : 0,
       .acceptHoles = in.flag("accept-holes"),
       .maxMemory = in.maxMemory,
       .progress = in.progress});
  const levelset::PointsToMeshReport& found = result.report;
  const double triangles =
      static_cast<double>(std::max<std::size_t>(1, result.mesh.triangles.size()));
  in.notes.detailsJson = Json{{"components", found.components},
                              {"incomplete_components", found.incomplete},
                              {"borders", found.borders},
                              {"border_length", found.borderLength},
                              {"filled_share", static_cast<double>(found.filled) / triangles},
                              {"smallest_scale", found.smallestScale},
                              {"unused_points", found.unusedPoints},
                              {"missed_points", found.missedPoints},
                              {"guessed_parts", found.guessed},
                              {"pieces", found.pieces},
                              {"sharp_curves", found.sharpCurves},
                              {"sharp_corners", found.sharpCorners},
                              {"sharp_length", found.sharpLength},
                              {"rounded_pairs", found.roundedPairs},
                              {"spacing", found.spacing},
                              {"connectivity_seconds", found.connectivitySeconds},
                              {"reconstruction_seconds", found.reconstructionSeconds},
                              {"triangulation_seconds", found.triangulationSeconds}}
                             .dump();
  in.notes.notes.push_back(
      fmt::format("mesh-points: {} triangles in {} parts, {} borders of length {:.6g}, {:.2g} % of "
                  "the triangles fill holes of the front",
                  result.mesh.triangles.size(), found.components, found.borders, found.borderLength,
                  100 * static_cast<double>(found.filled) / triangles));
  if (in.given("sharp") && found.sharpCurves == 0)
    in.notes.notes.push_back("mesh-points: no sharp edge was found");
  else if (in.given("sharp"))
    in.notes.notes.push_back(
        fmt::format("mesh-points: {} sharp edges along curves of length {:.6g}, and {} corners, "
                    "between {} smooth pieces",
                    found.sharpCurves, found.sharpLength, found.sharpCorners, found.pieces));
  if (found.roundedPairs > 0)
    in.notes.notes.push_back(
        fmt::format("mesh-points: {} pairs of neighbouring points lie across a sharp edge that is "
                    "rounded, since it fades out, meets a border, or was not found as a whole",
                    found.roundedPairs));
  if (found.unusedPoints > 0)
    in.notes.warnings.push_back(fmt::format(
        "mesh-points: {} points belong to no surface, since too few others lie beside them",
        found.unusedPoints));
  if (found.incomplete > 0)
    in.notes.warnings.push_back(fmt::format(
        "mesh-points: the mesh of {} of {} parts has holes or misses points ({} points)",
        found.incomplete, found.components, found.missedPoints));
  if (found.smallestScale < 1)
    in.notes.warnings.push_back(fmt::format(
        "mesh-points: some edges are {:.2g} times as long as asked for, since the front "
        "did not close with longer ones",
        found.smallestScale));
  if (found.guessed > 0)
    in.notes.warnings.push_back(fmt::format(
        "mesh-points: the outside of {} of {} parts is a guess, since they enclose nothing",
        found.guessed, found.components));
  return Value(std::move(result.mesh));
}

// The bunny's 34,835 points get 22,000 triangles. Shorter edges than those cover its area with
// more.
double expectedTriangles(Invocation& in, const Plan& cloud) {
  const double fromPoints = 0.7 * cloud.points;
  if (!in.given("edge")) return fromPoints;
  const double edge = in.length("edge");
  return std::max(fromPoints, cloud.area / (std::sqrt(3.0) / 4 * edge * edge));
}

Plan planMeshPoints(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Mesh;
  plan.triangles = expectedTriangles(in, plan);
  return plan;
}

std::optional<Cost> costOfMeshPoints(Invocation& in) {
  const Plan cloud = in.operands[0].plan();
  if (!(cloud.points > 0)) return std::nullopt;
  // A second set of polynomials, on each side of sharp edges.
  const double passes = in.given("sharp") ? 2 : 1;
  // A ball of 5,000 points takes 17 microseconds and 340 bytes for each of 74,000 triangles.
  const double further = expectedTriangles(in, cloud) - 0.7 * cloud.points;
  return Cost{passes * 3e-4 * cloud.points + 1.7e-5 * further,
              passes * 1800 * cloud.points + 340 * further};
}

}  // namespace

Operator meshPointsOperator() {
  return {
      .name = "mesh-points",
      .group = "Points",
      .summary = "turn the points of a surface into a triangle mesh, without a level set",
      .details =
          "Polynomials are fitted to the neighbours of each point along the surface. An "
          "advancing front covers their blend with nearly equilateral triangles. Borders stay "
          "open. Edges are shorter where the surface bends more, but not below the spacing of "
          "the points. Normals are not needed. Given ones decide on the side; it is an error if "
          "more than 10 % of them oppose their neighbours. Raise --smoothing for noise. Sharp "
          "edges are rounded over about a spacing. With --sharp they are kept, and so are "
          "corners. Polynomials then are fitted on each side of a sharp edge, and a front starts "
          "from the edges around each smooth piece. An edge that fades out, meets a border or "
          "lies in noise above a tenth of the spacing may be rounded. A mesh that misses points "
          "or has holes is an error without --accept-holes. The action needs a build with CGAL.",
      .example =
          "levelsmith sphere --radius 1 --voxel 0.05 ! mesh ! sample --count 2000 ! mesh-points ! "
          "write ball.ply",
      .params = {{.name = "edge",
                  .type = ParamType::Length,
                  .doc = "largest target length of edges; default: 8 point spacings",
                  .range = Range::Positive,
                  .allowsVoxels = false},
                 {.name = "angle",
                  .type = ParamType::Number,
                  .doc = "angle between the normals at the ends of an edge, degrees, at most 57",
                  .fallback = "20",
                  .range = Range::Positive},
                 {.name = "smoothing",
                  .type = ParamType::Number,
                  .doc = "width of the weight of a fit, in point spacings, 1 to 10",
                  .fallback = "2",
                  .range = Range::Positive},
                 {.name = "gap",
                  .type = ParamType::Number,
                  .doc = "radius of the largest disc without points that the surface covers, in "
                         "point spacings, 1.5 to 4; larger holes get a border",
                  .fallback = "2.5",
                  .range = Range::Positive},
                 {.name = "sharp",
                  .type = ParamType::Number,
                  .doc = "least angle between the normals on both sides of an edge that is kept "
                         "sharp, degrees, 10 to 90, such as 30; default: edges are rounded",
                  .range = Range::Positive},
                 {.name = "accept-holes",
                  .type = ParamType::Flag,
                  .doc = "accept a mesh that misses points or has holes"}},
      .operands = {{Kind::Points}},
      .resultKind = makesMeshOfPoints,
      .run = runMeshPoints,
      .plan = planMeshPoints,
      .cost = costOfMeshPoints,
      .validate =
          [](const Invocation& in) {
            if (!(in.number("angle") <= 57))
              throw UsageError("mesh-points: --angle must be at most 57 degrees");
            if (!(in.number("smoothing") >= 1 && in.number("smoothing") <= 10))
              throw UsageError("mesh-points: --smoothing must lie between 1 and 10");
            if (!(in.number("gap") >= 1.5 && in.number("gap") <= 4))
              throw UsageError("mesh-points: --gap must lie between 1.5 and 4");
            if (in.given("sharp") && !(in.number("sharp") >= 10 && in.number("sharp") <= 90))
              throw UsageError("mesh-points: --sharp must lie between 10 and 90 degrees");
            if (!levelset::canMeshPoints())
              throw UsageError(
                  "mesh-points: this build has no Delaunay triangulation, since CGAL was not "
                  "found; "
                  "install CGAL (Debian: libcgal-dev) and build again, or use 'level-set' and "
                  "'mesh'");
          },
  };
}

}  // namespace pipeline
