#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/solids/adaptive_actions.h"
#include "apps/pipeline/operators/solids/segment_actions.h"
#include "apps/pipeline/operators/terrain/terrain_figures.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/adaptive/adaptive_to_mesh.h"
#include "levelset/adaptive/compare_adaptive.h"
#include "levelset/error.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/compare.h"
#include "levelset/inspect/measure.h"
#include "levelset/inspect/mesh_quality.h"

namespace pipeline {
namespace {

std::string figureText(const Json& figure) {
  return figure.is_number_float() ? fmt::format("{:.9g}", figure.get<double>()) : figure.dump();
}

std::string coordinates(const Imath::V3d& v) {
  return fmt::format("{:.6g},{:.6g},{:.6g}", v.x, v.y, v.z);
}

/// Text of the figures of a segmentation: one line for each region and interface.
std::string regionsText(const Json& json) {
  std::string text;
  for (const auto& [key, entry] : json.items())
    if (!entry.is_array() && !entry.is_object())
      text += fmt::format("{:<22}{}\n", key, figureText(entry));
  for (const Json& material : json["materials"])
    text += fmt::format("material {:<13}volume {:.9g}, area {:.9g}\n", material["label"].get<int>(),
                        material["volume"].get<double>(), material["area"].get<double>());
  for (const Json& side : json["interfaces"])
    text += fmt::format(
        "interface {:<12}area {:.9g}\n",
        fmt::format("{}|{}", side["labels"][0].get<int>(), side["labels"][1].get<int>()),
        side["area"].get<double>());
  return text;
}

Value measureRegions(Invocation& in) {
  const Json json = measuresOf(in.operands[0].segmentation(), in);
  in.notes.detailsJson = json.dump();
  in.output = asksJson(in) ? printed(json) : regionsText(json);
  return in.operands[0];
}

Value measure(Invocation& in) {
  const Value& value = in.operands[0];
  if (value.kind() == Kind::Segmentation) return measureRegions(in);
  if (value.kind() == Kind::Terrain) return measureTerrain(in);
  levelset::Measurement m;
  if (value.kind() == Kind::Band)
    m = in.flag("sharp") ? levelset::measureSharp(value.band(), in.progress)
                         : levelset::measure(value.band(), in.progress);
  else if (value.kind() == Kind::Mesh)
    m = levelset::measure(value.mesh(), in.progress);
  else
    m = levelset::measure(
        levelset::adaptiveToMesh(
            value.adaptive(),
            {.maxMemory = in.maxMemory, .progress = levelset::subProgress(in.progress, 0, 0.5)}),
        levelset::subProgress(in.progress, 0.5, 1));
  Json json;
  json["volume"] = m.volume;
  json["area"] = m.area;
  json["bounds"] = toJson(m.bounds);
  json["active_voxels"] = m.activeVoxels;
  json["voxel_size"] = m.voxelSize;
  json["half_width"] = m.halfWidth;
  json["components"] = m.components;
  json["shells"] = m.surfaces;
  json["cavities"] = m.cavities;
  json["euler"] = m.euler;
  json["centroid"] = toJson(m.centroid);
  json["inertia"] = Json::array();
  for (int i = 0; i < 3; ++i)
    json["inertia"].push_back(
        toJson(Imath::V3d(m.inertia[i][0], m.inertia[i][1], m.inertia[i][2])));
  json["mean_curvature"] = m.meanCurvature;
  if (value.kind() == Kind::Adaptive) {
    json["cells"] = value.adaptive().leafCount();
    json["tolerance"] = value.adaptive().tolerance();
  }
  if (value.kind() == Kind::Mesh) {
    const levelset::Manifoldness manifold = levelset::manifoldness(value.mesh());
    json["closed_manifold"] = manifold.isClosedManifold();
    json["boundary_edges"] = manifold.boundaryEdges;
    json["non_manifold_edges"] = manifold.nonManifoldEdges;
    json["misoriented_edges"] = manifold.misorientedEdges;
    json["non_manifold_vertices"] = manifold.nonManifoldVertices;
    json["triangles"] = value.mesh().triangles.size();
    json["vertices"] = value.mesh().positions.size();
    const levelset::MeshQuality quality = levelset::meshQuality(value.mesh());
    constexpr double kDegrees = 180 / std::numbers::pi;
    json["least_angle_degrees"] = quality.leastAngle * kDegrees;
    json["mean_least_angle_degrees"] = quality.meanLeast * kDegrees;
    json["radius_ratio"] = quality.radiusRatio;
    json["valence_six"] = quality.valenceSix;
    json["shortest_edge"] = quality.shortestEdge;
    json["longest_edge"] = quality.longestEdge;
  }
  in.notes.detailsJson = json.dump();
  if (asksJson(in)) {
    in.output = printed(json);
    return value;
  }
  for (const auto& [key, entry] : json.items()) {
    if (key == "bounds" && !m.bounds.isEmpty())
      in.output += fmt::format("{:<22}{} to {}\n", key, coordinates(m.bounds.min),
                               coordinates(m.bounds.max));
    else
      in.output += fmt::format("{:<22}{}\n", key, figureText(entry));
  }
  return value;
}

Value compare(Invocation& in) {
  const levelset::CompareOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  const levelset::Comparison c =
      in.operands[0].kind() == Kind::Adaptive
          ? levelset::compare(in.operands[0].adaptive(), in.operands[1].adaptive(), options)
          : levelset::compare(in.band(0), in.band(1), options);
  Json json;
  json["hausdorff"] = c.hausdorff();
  json["hausdorff_a_to_b"] = c.hausdorffAtoB;
  json["hausdorff_b_to_a"] = c.hausdorffBtoA;
  json["mean_a_to_b"] = c.meanAtoB;
  json["mean_b_to_a"] = c.meanBtoA;
  json["chamfer"] = c.chamfer();
  json["symmetric_difference"] = c.symmetricDifference;
  in.notes.detailsJson = json.dump();
  if (asksJson(in)) {
    in.output = printed(json);
  } else {
    for (const auto& [key, entry] : json.items())
      in.output += fmt::format("{:<22}{:.9g}\n", key, entry.get<double>());
  }
  if (in.given("tolerance")) {
    const double tolerance = in.length("tolerance");
    if (c.hausdorff() > tolerance)
      throw levelset::NumericalError(
          fmt::format("compare: the Hausdorff distance of the surfaces is {:.6g}, more than the "
                      "tolerance of {:.6g}; see the figures above, or raise --tolerance",
                      c.hausdorff(), tolerance));
  }
  return in.operands[1];
}

Value check(Invocation& in) {
  const levelset::CheckReport report = levelset::check(in.band(), in.progress);
  Json json;
  json["passed"] = report.passed();
  json["items"] = Json::array();
  std::string failed;
  for (const levelset::CheckItem& item : report.items) {
    json["items"].push_back(
        {{"name", item.name}, {"passed", item.passed}, {"detail", item.detail}});
    if (!asksJson(in)) {
      in.output += fmt::format("{:<6}{}{}{}\n", item.passed ? "ok" : "FAIL", item.name,
                               item.detail.empty() ? "" : ": ", item.detail);
    }
    if (!item.passed && failed.empty())
      failed = item.name + (item.detail.empty() ? "" : " (" + item.detail + ")");
  }
  json["eikonal_mean"] = report.eikonalMean;
  json["eikonal_max"] = report.eikonalMax;
  in.notes.detailsJson = json.dump();
  in.notes.errors.push_back({"eikonal residual, mean", report.eikonalMean, ""});
  if (asksJson(in))
    in.output = printed(json);
  else
    in.output += fmt::format("eikonal residual: mean {:.3g}, largest {:.3g}\n", report.eikonalMean,
                             report.eikonalMax);
  if (!report.passed()) {
    throw levelset::NumericalError(fmt::format(
        "check: the level set fails this check: {}; rebuild it with 'resample', or from its mesh",
        failed));
  }
  return in.operands[0];
}

std::optional<Cost> costOfMeasure(Invocation& in) {
  // With --sharp, the extended mesh and its crossings come on top.
  return in.flag("sharp") ? costPerVoxel(1000, 160, 800)(in) : costPerVoxel(720, 130, 520)(in);
}

void validateMeasure(const Invocation& in) {
  if (in.given("above") && !isTerrain(in))
    throw levelset::UsageError("measure: --above is for terrains; leave it out");
  if (!in.flag("sharp") || in.operands.empty() || in.operands[0].kind() == Kind::Band) return;
  throw levelset::UsageError(
      fmt::format("measure: --sharp is for level sets, but the operand is a {}; leave it out",
                  kindName(in.operands[0].kind())));
}

std::optional<Cost> costOfCompare(Invocation& in) {
  if (in.operands[0].kind() == Kind::Adaptive) return {};
  return costPerVoxel(1500, 60)(in);
}

}  // namespace

Operator measureOperator() {
  return {
      .name = "measure",
      .group = "Inspection",
      .summary =
          "measure volume, area, bounds, topology, centroid, inertia and mean curvature of a solid",
      .details =
          "Inertia is about the centroid for density 1; mean_curvature is the integral of "
          "(k1 + k2) / 2 over the surface; euler is V - E + F of the surface. For a mesh, "
          "radius_ratio is the mean of 2 r / R of its triangles, with the radii of the inscribed "
          "and "
          "the circumscribed circle, and valence_six the share of vertices with six triangles. For "
          "a "
          "segmentation, materials has the volume and the area of each region, interfaces the area "
          "between each pair of regions, and junction_length the length of the curves where three "
          "regions meet. Sheets have the same label on both sides; sheet_area is their area and "
          "rim_length the length of their borders. A level set rounds sharp edges by half a voxel² "
          "of the cross-section; --sharp measures the solid with the edges that its distances "
          "imply. For a terrain, area and volumes are those of its triangles: volume_above lies "
          "between the ground and a horizontal plane where the ground is above it, volume_below "
          "where it is below. Slopes are in degrees.",
      .example = "levelsmith sphere --radius 1 --voxel 0.05 ! measure --json",
      .params = {{.name = "sharp",
                  .type = ParamType::Flag,
                  .doc =
                      "reconstruct the sharp edges and corners that the distances of a level set "
                      "imply"},
                 {.name = "above",
                  .type = ParamType::Number,
                  .doc = "for terrains: height of the plane from which volumes are measured; "
                         "default: 0"},
                 jsonParam()},
      .operands = {{Kind::Band, Kind::Mesh, Kind::Adaptive, Kind::Segmentation, Kind::Terrain}},
      .flow = Flow::PassesThrough,
      .run = measure,
      .cost = costOfMeasure,
      .validate = validateMeasure,
      .usesStandardOutput = asksJson,
  };
}

Operator compareOperator() {
  return {
      .name = "compare",
      .group = "Inspection",
      .summary =
          "measure the difference of two solids: Hausdorff, mean and Chamfer distance, volume",
      .details =
          "Both solids stay on the stack. hausdorff is the larger of the two directed distances, "
          "chamfer the sum of the two means, symmetric_difference the volume inside exactly one of "
          "the solids. The grids may differ. Two adaptive fields are compared by their meshes. An "
          "adaptive field is compared with a level set after 'to-band'.",
      .example =
          "levelsmith sphere --radius 1 --voxel 0.05 ! sphere --radius 1 --center 0.1,0,0 "
          "--voxel 0.05 ! compare --tolerance 0.11",
      .params = {{.name = "tolerance",
                  .type = ParamType::Length,
                  .doc =
                      "largest accepted Hausdorff distance; if it is exceeded, the exit code is 5",
                  .range = Range::NonNegative},
                 jsonParam()},
      .operands = {{Kind::Band, Kind::Adaptive}, {Kind::Band, Kind::Adaptive}},
      .flow = Flow::PassesThrough,
      .run = compare,
      .cost = costOfCompare,
      .validate = requireOneKind,
      .usesStandardOutput = asksJson,
  };
}

Operator checkOperator() {
  return {
      .name = "check",
      .group = "Inspection",
      .summary =
          "check the values, signs and gradients of a level set; exit code 5 if a check fails",
      .example = "levelsmith box --size 1,1,1 --voxel 0.05 ! check",
      .params = {jsonParam()},
      .operands = {{Kind::Band}},
      .flow = Flow::PassesThrough,
      .run = check,
      .cost = costPerVoxel(75),
      .usesStandardOutput = asksJson,
  };
}

}  // namespace pipeline
