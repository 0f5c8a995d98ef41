#include <fmt/core.h>

#include <algorithm>
#include <string>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/level_set_operator.h"
#include "apps/pipeline/operators/terrain/terrain_figures.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/convert/surface_band.h"
#include "levelset/error.h"
#include "levelset/terrain/ground_mesh.h"

namespace pipeline {
namespace {

using levelset::UsageError;

Param allowMissingParam(const char* doc) {
  return {.name = "allow-missing", .type = ParamType::Flag, .doc = doc};
}

/// Height of the base. Without --base, it lies a twentieth of the longer side below the ground.
double baseOf(Invocation& in, const Imath::Box3d& ground) {
  if (in.given("base")) return in.length("base");
  const Imath::V3d size = ground.size();
  return ground.min.z - std::max(size.x, size.y) / 20;
}

/// Bounds of the solid.
Imath::Box3d solidBounds(Invocation& in) {
  Imath::Box3d bounds = in.operands[0].plan().bounds;
  if (!bounds.isEmpty()) bounds.min.z = std::min(bounds.min.z, baseOf(in, bounds));
  return bounds;
}

double longestSideOf(const Imath::Box3d& box) {
  const Imath::V3d size = box.isEmpty() ? Imath::V3d(0) : box.size();
  return std::max({size.x, size.y, size.z});
}

/// Options of the conversion of the mesh, as of 'level-set'.
levelset::LevelSetOperator::Options conversionOf(Invocation& in) {
  const double voxel = in.voxelSize(longestSideOf(solidBounds(in)));
  in.setReference(voxel, in.operands[0].diagonal());  // of --lower-edges
  return {.voxel = {.edge = voxel},
          .halfWidth = in.number("half-width"),
          .sign = levelset::SignMode::Closed};
}

/// Estimate of the mesh: base, ground and four walls. The ground is taken to be flat.
levelset::ValuePlan meshEstimate(Invocation& in) {
  const Plan& ground = in.operands[0].plan();
  levelset::ValuePlan mesh{.bounds = solidBounds(in)};
  const Imath::V3d size = mesh.bounds.size();
  mesh.area = 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
  mesh.triangles = 4.0 * ground.samples.x * ground.samples.y;
  return mesh;
}

levelset::TriMesh groundSolidOf(Invocation& in, const levelset::HeightField& terrain) {
  const double base = baseOf(in, in.operands[0].plan().bounds);
  const levelset::GroundMeshOptions options{.allowMissing = in.flag("allow-missing"),
                                            .maxMemory = in.maxMemory};
  if (!in.given("lower-edges")) return levelset::groundSolidMesh(terrain, base, options);
  levelset::requireMemory(static_cast<double>(terrain.memoryUse()), in.maxMemory);
  return levelset::groundSolidMesh(levelset::loweredEdges(terrain, in.length("lower-edges")), base,
                                   options);
}

Value makeTerrainSolid(Invocation& in) {
  const levelset::HeightField& terrain = in.operands[0].terrain();
  levelset::requireLengths(terrain);
  const levelset::LevelSetOperator::Options options = conversionOf(in);
  levelset::TriMesh mesh = groundSolidOf(in, terrain);
  levelset::OperatorRun run = detail::runOf(in);
  run.releaseOperands = [&] {
    mesh = {};
    detail::releaseOperands(in);
  };
  try {
    Value result(levelset::LevelSetOperator::run(mesh, options, run));
    detail::fileNotes(run, in.notes);
    return result;
  } catch (...) {
    detail::fileNotes(run, in.notes);
    throw;
  }
}

Plan planTerrainSolid(Invocation& in) {
  Plan plan{.kind = Kind::Band, .bounds = solidBounds(in)};
  const levelset::LevelSetOperator::Options options = conversionOf(in);
  plan.voxelSize = options.voxel.edge;
  plan.halfWidth = options.halfWidth;
  if (plan.bounds.isEmpty()) return plan;
  const levelset::ValuePlan mesh = meshEstimate(in);
  plan.set(levelset::LevelSetOperator::plan(options, {&mesh, 1}, detail::runOf(in)));
  return plan;
}

std::optional<Cost> costOfTerrainSolid(Invocation& in) {
  if (!in.planned || in.operands[0].plan().samples.x == 0) return std::nullopt;
  const levelset::ValuePlan mesh = meshEstimate(in);
  std::optional<Cost> cost = levelset::LevelSetOperator::cost(
      conversionOf(in), {levelset::Plans(&mesh, 1), in.planned->estimate()});
  constexpr double kTriangleBytes = 40;  // of the mesh
  if (cost) cost->bytes += kTriangleBytes * mesh.triangles;
  return cost;
}

Value makeGroundBand(Invocation& in) {
  const levelset::HeightField& terrain = in.operands[0].terrain();
  const Imath::Box3d box = in.given("box") ? in.box("box") : levelset::kEverywhere;
  const double side = longestSideOf(in.given("box") ? box : in.operands[0].plan().bounds);
  const levelset::SurfaceBandResult result =
      levelset::groundBand(terrain, in.voxelSize(side),
                           {.halfWidth = in.number("half-width"),
                            .box = box,
                            .allowMissing = in.flag("allow-missing"),
                            .maxMemory = in.maxMemory,
                            .progress = in.progress});
  in.notes.notes.push_back(fmt::format("surface-band: {} border edges", result.borderEdges));
  return Value(result.band);
}

Plan planGroundBand(Invocation& in) {
  Plan plan{.kind = Kind::Surface};
  plan.bounds = in.operands[0].plan().bounds;
  double side = longestSideOf(plan.bounds);
  if (in.given("box")) {
    const Imath::Box3d box = in.box("box");
    side = longestSideOf(box);
    for (int axis = 0; axis < 3; ++axis) {
      plan.bounds.min[axis] = std::max(plan.bounds.min[axis], box.min[axis]);
      plan.bounds.max[axis] = std::min(plan.bounds.max[axis], box.max[axis]);
    }
  }
  plan.voxelSize = in.voxelSize(side);
  plan.halfWidth = in.number("half-width");
  if (plan.bounds.isEmpty()) return plan;
  const Imath::V3d size = plan.bounds.size();
  plan.area = size.x * size.y;
  return plan;
}

}  // namespace

Operator solidifyOperator() {
  return {
      .name = "solidify",
      .group = "Terrain",
      .summary = "turn a terrain into a solid: the earth between the ground and a base",
      .details =
          "The solid is that of a closed mesh: the triangles of the ground, vertical walls below "
          "their border and a level base. Distances are exact, and the report has the sign "
          "certificate of 'level-set'. Missing samples are refused unless --allow-missing is "
          "given.",
      .example =
          "levelsmith read <(printf 'ncols 3\\nnrows 3\\nxllcorner 0\\nyllcorner 0\\ncellsize "
          "1\\n0 1 0\\n1 2 1\\n0 1 0\\n') --format asc ! solidify --base -1 --voxel "
          "0.05 ! measure",
      .params = {{.name = "base",
                  .type = ParamType::Length,
                  .doc = "height of the base, below the ground; default: a twentieth of the longer "
                         "side below the lowest sample",
                  .allowsVoxels = false},
                 {.name = "lower-edges",
                  .type = ParamType::Length,
                  .doc = "lower the samples at the border of the terrain by this length, so that "
                         "the terrain around the solid covers its edges in pictures, see 'scene "
                         "--outside'; half a voxel suffices",
                  .range = Range::NonNegative},
                 allowMissingParam("make vertical walls around samples without data"),
                 voxelParam(),
                 resolutionParam(),
                 halfWidthParam()},
      .operands = {{Kind::Terrain}},
      .resultKind = [](const Invocation&) { return Kind::Band; },
      .run = makeTerrainSolid,
      .plan = planTerrainSolid,
      .cost = costOfTerrainSolid,
      .slope = levelset::Slope::One,
      .validate = requireVoxelSize,
  };
}

Operator surfaceBandOperator() {
  const auto validate = [](const Invocation& in) {
    for (const char* option : {"box", "allow-missing"})
      if (in.given(option) && !isTerrain(in))
        throw UsageError(fmt::format("surface-band: --{} is for terrains; leave it out", option));
  };
  Operator op = levelSetOperator<levelset::SurfaceBandOperator>(
      {.params = {{.name = "box",
                   .type = ParamType::Box,
                   .doc = "for terrains: compute the band in this box only; --resolution counts "
                          "along its longest side"},
                  allowMissingParam("for terrains: end the band at samples without data")},
       .validate = validate});
  op.operands = {{Kind::Mesh, Kind::Terrain}};
  op.details += " A terrain is negative below its ground.";
  op.run = [ofMesh = op.run](Invocation& in) {
    return isTerrain(in) ? makeGroundBand(in) : ofMesh(in);
  };
  op.plan = [ofMesh = op.plan](Invocation& in) {
    return isTerrain(in) ? planGroundBand(in) : ofMesh(in);
  };
  return op;
}

}  // namespace pipeline
