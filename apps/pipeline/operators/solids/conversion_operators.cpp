#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/pipeline/graph/region_of_interest.h"
#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/convert/surface_band.h"
#include "levelset/error.h"
#include "levelset/meshing/band_to_mesh.h"
#include "mapping/patches/patch_mesh.h"

namespace pipeline {
namespace {

using levelset::SignCertificate;
using levelset::SignMode;

std::string certificateJson(const SignCertificate& c) {
  nlohmann::ordered_json json;
  json["closed"] = c.closed;
  json["boundary_edges"] = c.boundaryEdges;
  json["non_manifold_edges"] = c.nonManifoldEdges;
  if (c.selfIntersections < 0)
    json["self_intersections"] = "not searched";
  else
    json["self_intersections"] = c.selfIntersections;
  json["method"] = c.method == SignMode::Closed ? "closed" : "winding";
  json["flipped"] = c.flipped;
  json["ambiguous_share"] = c.ambiguousShare;
  json["dropped_triangles"] = c.droppedTriangles;
  return json.dump();
}

double longestSide(const Value& value) {
  const Imath::V3d size = value.plan().bounds.size();
  return std::max({size.x, size.y, size.z});
}

Value levelSet(Invocation& in) {
  levelset::MeshToBandOptions options{.halfWidth = in.number("half-width"),
                                      .acceptSign = in.flag("sign-anyway"),
                                      .searchSelfIntersections = !in.flag("trust-mesh"),
                                      .roi = in.roi,
                                      .maxMemory = in.maxMemory,
                                      .progress = in.progress};
  const std::string sign = in.text("sign");
  options.sign = sign == "closed"    ? SignMode::Closed
                 : sign == "winding" ? SignMode::Winding
                                     : SignMode::Auto;
  options.nesting = in.text("nested") == "orientation" ? levelset::Nesting::Orientation
                                                       : levelset::Nesting::Parity;
  options.onCertificate = [&](const SignCertificate& certificate) {
    in.notes.certificateJson = certificateJson(certificate);
    in.notes.notes.push_back(describe(certificate));
  };
  levelset::MeshToBandResult result =
      levelset::meshToBand(in.mesh(), in.voxelSize(longestSide(in.operands[0])), options);
  if (options.acceptSign && result.band.zeroSetBounds().isEmpty()) {
    in.notes.warnings.push_back(
        "no grid point lies inside: the band holds distances to the mesh and no surface; close the "
        "mesh to get a solid");
  } else if (options.acceptSign && result.certificate.ambiguousShare > levelset::kAmbiguousLimit) {
    in.notes.warnings.push_back(
        fmt::format("the sign is a guess at a share of {:.2g} of the voxels beside the surface",
                    result.certificate.ambiguousShare));
  }
  return Value(std::move(result.band));
}

Plan planLevelSet(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.triangles = 0;
  plan.kind = Kind::Band;
  plan.voxelSize = in.voxelSize(longestSide(in.operands[0]));
  plan.halfWidth = in.number("half-width");
  levelset::checkVoxelSize(plan.voxelSize, longestSide(in.operands[0]));
  double reach = 0;
  for (int axis = 0; axis < 3; ++axis)
    reach = std::max({reach, std::abs(plan.bounds.min[axis]), std::abs(plan.bounds.max[axis])});
  if (!(reach / plan.voxelSize < std::numeric_limits<std::int32_t>::max()))
    throw levelset::ResourceLimit(
        fmt::format("level-set: the mesh reaches {:.3g} voxels from the origin, more than can be "
                    "counted; use larger voxels or move it",
                    reach / plan.voxelSize));
  return plan;
}

std::optional<Cost> costOfLevelSet(Invocation& in) {
  const double triangles = in.operands[0].plan().triangles, voxels = in.planned->activeVoxels();
  if (triangles == 0) return {};
  return Cost{1e-9 * (2800 * triangles + 500 * voxels), 60 * triangles + 4 * voxels};
}

Value surfaceBand(Invocation& in) {
  const levelset::SurfaceBandResult result = levelset::surfaceBand(
      in.mesh(), in.voxelSize(longestSide(in.operands[0])),
      {.halfWidth = in.number("half-width"), .maxMemory = in.maxMemory, .progress = in.progress});
  in.notes.notes.push_back(fmt::format("{} border edges, {} triangles dropped", result.borderEdges,
                                       result.droppedTriangles));
  if (result.removedVoxels > 0)
    in.notes.notes.push_back(
        fmt::format("{} voxels lie half way between the front of one part of the surface and the "
                    "back of another, and are cut out: patches cannot pass there",
                    result.removedVoxels));
  return Value(result.band);
}

void validateSurfaceBand(const Invocation& in) {
  requireVoxelSize(in);
  if (in.number("half-width") < levelset::kMinSurfaceHalfWidth) {
    throw levelset::UsageError(
        fmt::format("surface-band: --half-width is {} voxels; give at least {}",
                    in.text("half-width"), levelset::kMinSurfaceHalfWidth));
  }
}

Plan planSurfaceBand(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.triangles = 0;
  plan.kind = Kind::Surface;
  plan.voxelSize = in.voxelSize(longestSide(in.operands[0]));
  plan.halfWidth = in.number("half-width");
  levelset::checkVoxelSize(plan.voxelSize, longestSide(in.operands[0]), "surface-band");
  return plan;
}

/// All patches of a set in one mesh.
levelset::TriMesh meshOfPatches(const std::vector<mapping::Patch>& patches,
                                mapping::PatchMeshKind kind) {
  levelset::TriMesh all;
  for (const mapping::Patch& patch : patches) append(all, mapping::patchMesh(patch, kind));
  return all;
}

Value mesh(Invocation& in) {
  if (in.operands[0].kind() == Kind::Patch) {
    return Value(meshOfPatches(
        in.operands[0].patch().patches,
        in.flag("sheets") ? mapping::PatchMeshKind::Sheets : mapping::PatchMeshKind::Solid));
  }
  return Value(levelset::bandToMesh(
      in.band(),
      {.adaptivity = in.number("adaptivity"), .sharp = in.flag("sharp"), .progress = in.progress}));
}

Plan planMesh(Invocation& in) {
  const Plan solid = in.operands[0].plan();
  Plan plan{.kind = Kind::Mesh, .bounds = solid.bounds, .area = solid.area};
  // Of a surface for each square of a voxel's side; no more with --sharp and --adaptivity.
  constexpr double kTriangles = 3.35;
  if (solid.kind == Kind::Band) plan.triangles = kTriangles * layerOf(solid);
  return plan;
}

/// The ends of edges that the zero set crosses are less than a voxel from it; half a one is for
/// distances that are not quite.
RegionOfInterest roiOfMesh(Invocation& in, std::size_t, const RegionOfInterest&) {
  const bool isUniform = !in.flag("sharp") && in.number("adaptivity") == 0;
  if (in.operands[0].kind() != Kind::Band || !isUniform) return {};
  return {.halfWidth = 1.5};
}

std::optional<Cost> costOfMesh(Invocation& in) {
  const Plan solid = in.operands[0].plan();
  if (solid.kind != Kind::Band) return {};
  const double layer = layerOf(solid);
  if (in.flag("sharp")) return Cost{1e-9 * 1300 * layer, 420 * layer};
  return Cost{1e-9 * 330 * layer, 40 * layer};
}

}  // namespace

void addConversionOperators(std::vector<Operator>& all) {
  all.push_back({
      .name = "level-set",
      .group = "Conversion",
      .summary = "turn a mesh into a level set with exact distances",
      .details =
          "auto takes 'closed' when every edge has two faces and no self-intersection is found, "
          "otherwise "
          "'winding' (inside where the generalised winding number passes one half). The sign "
          "certificate says what "
          "was found; where the sign would be a guess the mesh is refused unless --sign-anyway.",
      .example = "levelsmith read dragon.ply ! level-set --resolution 512 ! write dragon.vdb",
      .params = {voxelParam(),
                 resolutionParam(),
                 halfWidthParam(),
                 {.name = "sign",
                  .type = ParamType::Choice,
                  .doc = "how inside is told from outside",
                  .fallback = "auto",
                  .choices = {"auto", "closed", "winding"}},
                 {.name = "nested",
                  .type = ParamType::Choice,
                  .doc = "under 'closed': shells in shells alternate, or follow the way they face",
                  .fallback = "parity",
                  .choices = {"parity", "orientation"}},
                 {.name = "sign-anyway",
                  .type = ParamType::Flag,
                  .doc = "accept a sign that is a guess, or distances without an inside"},
                 {.name = "trust-mesh",
                  .type = ParamType::Flag,
                  .doc = "under 'auto': do not search self-intersections"}},
      .operands = {{Kind::Mesh}},
      .run = levelSet,
      .plan = planLevelSet,
      .cost = costOfLevelSet,
      .slope = Slope::One,
      .makesParts = true,
      .validate = requireVoxelSize,
  });
  all.push_back({
      .name = "surface-band",
      .group = "Conversion",
      .summary = "make an open mesh (terrain, a sheet) a base for patches",
      .details =
          "Distances to one side and the other of a mesh whose faces are all turned to one side, "
          "up "
          "to its border. It has no inside: 'patch', 'decal', 'patch-grid', 'scatter' and 'folds' "
          "take it as base, 'texture' with --alone or --map mesh. Patches end at the border. The "
          "band has to be as wide as patches are high, and six voxels more, unless their levels "
          "follow a spline. A closed mesh is for 'level-set'.",
      .example =
          "levelsmith heightmap --image <(printf '0 1 0\\n1 2 1\\n0 1 0\\n') --size 8,8 --height 2 "
          "--voxel 0.2 --sheet ! surface-band --voxel 0.2 --half-width 12 ! patch --at "
          "0,0,2 --size 3,3 --height 1 ! mesh ! measure",
      .params = {voxelParam(),
                 resolutionParam(),
                 {.name = "half-width",
                  .type = ParamType::Number,
                  .doc = "half width of the band, voxels, at least 4; 16 are enough for patches of "
                         "up to ten voxels",
                  .fallback = "16",
                  .range = Range::Positive}},
      .operands = {{Kind::Mesh}},
      .resultKind = [](const Invocation&) { return Kind::Surface; },
      .run = surfaceBand,
      .plan = planSurfaceBand,
      .validate = validateSurfaceBand,
  });
  all.push_back({
      .name = "mesh",
      .group = "Conversion",
      .summary = "turn a level set, or the space of a patch, into a closed triangle mesh",
      .details = "Of a patch: its lowest and highest particles and its sides, one closed shell to "
                 "each, or with --sheets every level as it is.",
      .example = "levelsmith box --size 2,2,2 --voxel 0.1 ! mesh --sharp ! write box.ply",
      .params = {{.name = "adaptivity",
                  .type = ParamType::Number,
                  .doc = "0 to 1: how far flat parts are coarsened",
                  .fallback = "0",
                  .range = Range::NonNegative},
                 {.name = "sharp",
                  .type = ParamType::Flag,
                  .doc = "keep the edges and corners that the field implies"},
                 {.name = "sheets",
                  .type = ParamType::Flag,
                  .doc = "of a patch: its levels of particles, each by itself"}},
      .operands = {{Kind::Band, Kind::Patch}},
      .resultKind = [](const Invocation&) { return Kind::Mesh; },
      .run = mesh,
      .plan = planMesh,
      .cost = costOfMesh,
      .regionOfInterest = roiOfMesh,
      .validate =
          [](const Invocation& in) {
            const bool isPatch = in.operands[0].kind() == Kind::Patch;
            if (isPatch && (in.given("adaptivity") || in.flag("sharp")))
              throw levelset::UsageError(
                  "mesh: --adaptivity and --sharp are for level sets, not for a patch");
            if (!isPatch && in.flag("sheets"))
              throw levelset::UsageError("mesh: --sheets is for a patch, not for a level set");
            if (in.number("adaptivity") > 1)
              throw levelset::UsageError("mesh: --adaptivity must lie between 0 and 1");
            if (in.flag("sharp") && in.number("adaptivity") > 0)
              throw levelset::UsageError(
                  "mesh: --sharp and --adaptivity exclude each other; give one");
          },
  });
}

}  // namespace pipeline
