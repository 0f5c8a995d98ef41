#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/level_set_operator.h"
#include "apps/pipeline/operators/volume_params.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/isosurface/isosurface.h"
#include "levelset/isosurface/isosurface_mesh.h"
#include "levelset/transform/resample.h"
#include "levelset/volumes/filters/resample_volume.h"
#include "levelset/volumes/histogram.h"
#include "levelset/volumes/synthetic.h"

namespace pipeline {
namespace {

using levelset::Volume;

Kind makesVolume(const Invocation&) {
  return Kind::Volume;
}

// === Synthetic volumes

Value makeVolume(Invocation& in) {
  const std::string form = in.text("form");
  const int size = in.integerAs<int>("size");
  if (form == "sphere")
    return Value(levelset::sphereVolume(size, in.number("radius"), in.maxMemory));
  if (form == "torus")
    return Value(levelset::torusVolume(size, in.number("radius"), in.number("tube"), in.maxMemory));
  return Value(levelset::marschnerLobb(size, in.maxMemory));
}

Plan planVolume(Invocation& in) {
  const int size = in.integerAs<int>("size");
  const double step = 2.0 / std::max(size - 1, 1);
  return planOf(
      {Imath::V3i(size), Imath::M44d(step, 0, 0, 0, 0, step, 0, 0, 0, 0, step, 0, -1, -1, -1, 1)},
      levelset::VolumeType::F32);
}

void validateVolume(const Invocation& in) {
  const std::string form = in.text("form");
  if (form == "marschner-lobb" && in.given("radius"))
    throw levelset::UsageError(
        "volume: --radius is for sphere and torus, and marschner-lobb has none; leave it out");
  if (form != "torus" && in.given("tube"))
    throw levelset::UsageError("volume: --tube is for torus; leave it out");
}

// === Histogram

Value printHistogram(Invocation& in) {
  const levelset::VolumeHistogram found =
      levelset::histogram(volumeIn(in), {.bins = in.integerAs<int>("bins"),
                                         .classes = in.integerAs<int>("classes"),
                                         .progress = in.progress});
  Json json;
  json["low"] = found.low;
  json["high"] = found.high;
  json["otsu"] = found.otsu;
  json["steepest"] = found.steepest;
  json["counts"] = found.counts;
  json["mean_gradient"] = found.meanGradient;
  in.notes.detailsJson = Json{{"otsu", found.otsu}, {"steepest", found.steepest}}.dump();
  if (asksJson(in)) {
    in.output = printed(json);
    return in.operands[0];
  }
  for (std::size_t n = 0; n < found.otsu.size(); ++n)
    in.output += fmt::format("otsu {}          {:.6g}\n", n + 1, found.otsu[n]);
  in.output += fmt::format("steepest        {:.6g}\n", found.steepest);
  // At most 32 lines, each with a bar in proportion to the root of the count.
  constexpr std::size_t kMostLines = 32;
  constexpr double kBar = 40;
  const std::size_t bins = found.counts.size(), joined = (bins + kMostLines - 1) / kMostLines;
  std::vector<std::uint64_t> lines((bins + joined - 1) / joined, 0);
  for (std::size_t bin = 0; bin < bins; ++bin) lines[bin / joined] += found.counts[bin];
  const auto most = static_cast<double>(*std::max_element(lines.begin(), lines.end()));
  const double width = (found.high - found.low) / static_cast<double>(bins);
  for (std::size_t n = 0; n < lines.size(); ++n) {
    const double share = std::sqrt(static_cast<double>(lines[n]) / most);
    in.output += fmt::format("{:>12.6g} {:>12} {}\n",
                             found.low + static_cast<double>(n * joined) * width, lines[n],
                             std::string(static_cast<std::size_t>(std::lround(share * kBar)), '#'));
  }
  return in.operands[0];
}

// === Solids

levelset::ValueRange valueRangeOf(const Invocation& in) {
  if (in.op().name == "threshold") return {in.number("low"), in.number("high")};
  const double value = in.number("value");
  return in.text("inside") == "below" ? levelset::ValueRange{{}, value}
                                      : levelset::ValueRange{value, {}};
}

Value makeIsosurface(Invocation& in) {
  const Volume volume = volumeIn(in);
  levelset::IsosurfaceOptions options{.filter = *levelset::volumeFilterNamed(in.text("filter")),
                                      .halfWidth = in.number("half-width"),
                                      .maxMemory = in.maxMemory,
                                      .progress = in.progress};
  if (in.given("voxel")) options.voxelSize = in.length("voxel");
  if (in.text("border") == "refuse") options.border = levelset::VolumeBorder::Refuse;
  levelset::IsosurfaceResult made = levelset::isosurface(volume, valueRangeOf(in), options);
  const levelset::IsosurfaceReport& report = made.report;
  in.notes.detailsJson = Json{
      {"filter", in.text("filter")},
      {"closed_area", report.closedArea},
      {"cells", report.cells},
      {"pieces",
       report.pieces}}.dump();
  if (report.closedArea > 0)
    in.notes.warnings.push_back(fmt::format(
        "the solid reaches the border of the volume and was closed there, on an area of {:.6g} "
        "square world units",
        report.closedArea));
  return Value(std::move(made.band));
}

/// Plans the solid. Its surface is unknown before the volume is read; that of the bounding box
/// stands for it.
Plan planIsosurface(Invocation& in) {
  const Plan& of = in.operands[0].plan();
  Plan plan{.kind = Kind::Band, .bounds = of.bounds};
  plan.voxelSize = in.given("voxel") ? in.length("voxel") : of.voxelSize;
  plan.halfWidth = in.number("half-width");
  if (!of.bounds.isEmpty()) {
    const Imath::V3d size = of.bounds.size();
    plan.area = 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
  }
  return plan;
}

void validateIsosurface(const Invocation& in) {
  if (!(in.number("half-width") > 1))
    throw levelset::UsageError(fmt::format("{}: --half-width is {}; give more than 1 voxel",
                                           in.op().name, in.text("half-width")));
  if (in.op().name == "threshold" && !(in.number("low") < in.number("high")))
    throw levelset::UsageError(
        fmt::format("threshold: the lower limit {} is not below the upper limit {}; swap them",
                    in.text("low"), in.text("high")));
}

/// Names of all filters that are continuous to an order; −1: of all filters.
std::vector<std::string> filterNames(int continuity) {
  std::vector<std::string> names;
  for (const levelset::VolumeFilter filter : levelset::kVolumeFilters)
    if (levelset::factsOf(filter).continuity >= continuity)
      names.emplace_back(levelset::factsOf(filter).name);
  return names;
}

std::vector<Param> solidParams() {
  return {{.name = "filter",
           .type = ParamType::Choice,
           .doc = "function between the grid points, on whose surface the distances are measured",
           .fallback = "trilinear",
           .choices = filterNames(0)},
          {.name = "border",
           .type = ParamType::Choice,
           .doc = "treatment of a solid that reaches the border of the volume: close it with the "
                  "faces of the volume's box, or refuse it",
           .fallback = "close",
           .choices = {"close", "refuse"}},
          voxelParam("voxel size: edge length of a voxel; default: the smallest spacing of the "
                     "volume"),
          halfWidthParam()};
}

/// An exact search for each voxel of the band. docs/volumes.md has the times of the filters.
std::optional<Cost> costOfSolid(Invocation& in) {
  const std::string filter = in.text("filter");
  const double nanoseconds = filter == "trilinear"                         ? 6500
                             : filter == "windowed-sinc"                   ? 227'000
                             : filter == "tricubic" || filter == "bspline" ? 58'000
                                                                           : 97'000;
  return costPerVoxel(nanoseconds, 60)(in);
}

Operator solidOperator(const char* name, const char* summary) {
  return {.name = name,
          .group = "Volumes",
          .summary = summary,
          .operands = {{Kind::Volume, Kind::Field}},
          .resultKind = [](const Invocation&) { return Kind::Band; },
          .run = makeIsosurface,
          .plan = planIsosurface,
          .cost = costOfSolid,
          .slope = Slope::One,
          .validate = validateIsosurface};
}

// === Meshes

Value makeIsosurfaceMesh(Invocation& in) {
  using levelset::MeshBorder;
  const std::string border = in.text("border");
  const levelset::IsosurfaceMeshOptions options{
      .isInsideBelow = in.text("inside") == "below",
      .filter = *levelset::volumeFilterNamed(in.text("filter")),
      .border = border == "open"     ? MeshBorder::Open
                : border == "refuse" ? MeshBorder::Refuse
                                     : MeshBorder::Close,
      .hasNormals = !in.flag("no-normals"),
      .maxMemory = in.maxMemory,
      .progress = in.progress};
  levelset::IsosurfaceMesh made =
      levelset::isosurfaceMesh(volumeIn(in), in.number("value"), options);
  in.notes.detailsJson = Json{
      {"filter", in.text("filter")},
      {"cells", made.cells},
      {"border_points",
       made.borderPoints}}.dump();
  if (made.borderPoints > 0)
    in.notes.warnings.push_back(
        fmt::format("the solid reaches the border of the volume at {} grid points; the mesh {}",
                    made.borderPoints, border == "open" ? "is open there" : "was closed there"));
  return Value(std::move(made.mesh));
}

/// Plans the mesh. As with the solid, the surface of the bounding box stands for that of the mesh.
Plan planIsosurfaceMesh(Invocation& in) {
  const Plan& of = in.operands[0].plan();
  Plan plan{.kind = Kind::Mesh, .bounds = of.bounds};
  if (!of.bounds.isEmpty() && of.voxelSize > 0) {
    const Imath::V3d size = of.bounds.size();
    plan.area = 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
    plan.triangles = 2 * plan.area / (of.voxelSize * of.voxelSize);
  }
  return plan;
}

// === Resampling

bool isVolumeOperand(const Invocation& in) {
  return !in.operands.empty() &&
         (in.operands[0].kind() == Kind::Volume || in.operands[0].kind() == Kind::Field);
}

double spacingIn(Invocation& in) {
  const Imath::Box3d& bounds = in.operands[0].plan().bounds;
  const Imath::V3d size = bounds.isEmpty() ? Imath::V3d(0) : bounds.size();
  return in.voxelSize(std::max({size.x, size.y, size.z}));
}

Value resampleVolume(Invocation& in) {
  const double spacing = spacingIn(in);
  const Volume volume = volumeIn(in);
  const Imath::V3d present = volume.grid().spacing();
  if (spacing > 1.5 * std::min({present.x, present.y, present.z}))
    in.notes.warnings.push_back(
        fmt::format("resample: the voxels are larger than those of the volume; detail finer than "
                    "{:.4g} becomes false detail unless 'blur' removes it first",
                    2 * spacing));
  return Value(levelset::resampled(volume, spacing,
                                   {.filter = *levelset::volumeFilterNamed(in.text("filter")),
                                    .maxMemory = in.maxMemory,
                                    .progress = in.progress}));
}

Plan planResampledVolume(Invocation& in) {
  const Plan& of = in.operands[0].plan();
  Plan plan = of;
  plan.kind = Kind::Volume;
  const double spacing = spacingIn(in);
  if (of.bounds.isEmpty() || !(spacing > 0)) return plan;
  // The grid of the result depends on the bounds only.
  levelset::VolumeGrid grid;
  grid.size = Imath::V3i(2);
  grid.indexToWorld.setScale(of.bounds.size());
  for (int axis = 0; axis < 3; ++axis) grid.indexToWorld[3][axis] = of.bounds.min[axis];
  return planOf(levelset::resampledGrid(grid, spacing), levelset::VolumeType::F32);
}

}  // namespace

Operator resampleOperator() {
  const Operator ofSolids = levelSetOperator<levelset::ResampleOperator>();
  Operator op = ofSolids;
  op.summary = "resample a solid or a volume on an axis-aligned grid of another voxel size";
  op.details =
      "The grid points of the result lie at multiples of the voxel size. A filter removes no "
      "detail: blur a volume before you resample it on a coarser grid.";
  op.params.push_back(
      {.name = "filter",
       .type = ParamType::Choice,
       .doc =
           "for a volume: function between its grid points; box, the nearest value, keeps labels",
       .fallback = "tricubic",
       .choices = filterNames(-1)});
  op.operands = {{Kind::Band, Kind::Volume, Kind::Field}};
  op.resultKind = [](const Invocation& in) {
    return isVolumeOperand(in) ? Kind::Volume : Kind::Band;
  };
  op.run = [ofSolids](Invocation& in) {
    return isVolumeOperand(in) ? resampleVolume(in) : ofSolids.run(in);
  };
  op.plan = [ofSolids](Invocation& in) {
    return isVolumeOperand(in) ? planResampledVolume(in) : ofSolids.plan(in);
  };
  op.cost = [ofSolids](Invocation& in) -> std::optional<Cost> {
    if (isVolumeOperand(in)) return std::nullopt;
    return ofSolids.cost(in);
  };
  op.validate = [ofSolids](const Invocation& in) {
    const bool isVolume = isVolumeOperand(in);
    for (const char* name : {"filter", "half-width"})
      if (in.given(name) && isVolume == (std::string(name) == "half-width"))
        throw levelset::UsageError(fmt::format("resample: --{} is for {}; leave it out", name,
                                               isVolume ? "solids" : "volumes"));
    isVolume ? in.requireVoxelSize() : ofSolids.validate(in);
  };
  return op;
}

Operator volumeOperator() {
  return {
      .name = "volume",
      .group = "Volumes",
      .summary = "sample a formula on the cube from -1,-1,-1 to 1,1,1: a volume for tests",
      .details =
          "marschner-lobb is the test signal with fM = 6 and alpha = 0.25; its customary "
          "isovalue is 0.5. sphere and torus are distances, positive inside; their isovalue "
          "is 0.",
      .example = "levelsmith volume marschner-lobb --size 41 ! isosurface 0.5 ! measure",
      .params = {{.name = "form",
                  .type = ParamType::Choice,
                  .doc = "formula",
                  .choices = {"marschner-lobb", "sphere", "torus"},
                  .required = true,
                  .position = 0},
                 {.name = "size",
                  .type = ParamType::Integer,
                  .doc = "number of grid points along each axis",
                  .fallback = "41",
                  .range = Range::Positive},
                 {.name = "radius",
                  .type = ParamType::Number,
                  .doc = "radius of the sphere, or of the circle of the torus",
                  .fallback = "0.6",
                  .range = Range::Positive},
                 {.name = "tube",
                  .type = ParamType::Number,
                  .doc = "radius of the tube of the torus",
                  .fallback = "0.25",
                  .range = Range::Positive}},
      .resultKind = makesVolume,
      .run = makeVolume,
      .plan = planVolume,
      .validate = validateVolume,
  };
}

Operator blurOperator() {
  return {
      .name = "blur",
      .group = "Volumes",
      .summary = "convolve a volume with a Gaussian, to remove noise before 'isosurface'",
      .example = "levelsmith volume marschner-lobb ! blur --sigma 0.05 ! isosurface 0.5 ! measure",
      .params = {{.name = "sigma",
                  .type = ParamType::Length,
                  .doc = "standard deviation; 1vx is the smallest spacing of the volume",
                  .range = Range::Positive,
                  .required = true,
                  .position = 0}},
      .operands = {{Kind::Volume, Kind::Field}},
      .resultKind = makesVolume,
      .run =
          [](Invocation& in) {
            const double sigma = in.length("sigma");
            return Value(levelset::blurred(volumeIn(in), sigma,
                                           {.maxMemory = in.maxMemory, .progress = in.progress}));
          },
      .plan =
          [](Invocation& in) {
            Plan plan = in.operands[0].plan();
            plan.kind = Kind::Volume;
            return plan;
          },
  };
}

Operator histogramOperator() {
  return {
      .name = "histogram",
      .group = "Volumes",
      .summary = "count the values of a volume and suggest isovalues",
      .details =
          "otsu are the limits that separate classes of values with the least variance "
          "within the classes. steepest is the isovalue at which the mean gradient is "
          "largest: surfaces there are the sharpest. The volume stays on the stack.",
      .example = "levelsmith volume marschner-lobb ! histogram --classes 2",
      .params = {{.name = "bins",
                  .type = ParamType::Integer,
                  .doc = "number of bins, 2 to 65536; fewer if the values are integers in a "
                         "smaller range",
                  .fallback = "256",
                  .range = Range::Positive},
                 {.name = "classes",
                  .type = ParamType::Integer,
                  .doc = "number of classes of values, 2 to 6",
                  .fallback = "3",
                  .range = Range::Positive},
                 jsonParam()},
      .operands = {{Kind::Volume, Kind::Field}},
      .flow = Flow::PassesThrough,
      .run = printHistogram,
      .usesStandardOutput = asksJson,
  };
}

Operator isosurfaceOperator() {
  Operator op = solidOperator(
      "isosurface",
      "make a solid of all points of a volume with values above an isovalue, or below it");
  op.details =
      "The distances are those to the surface of the interpolated values itself, not to "
      "triangles, in world space: the volume may be anisotropic, oblique or sheared. A value that "
      "equals the isovalue is outside.";
  op.example = "levelsmith volume sphere --size 33 ! isosurface 0 ! measure";
  op.params = {{.name = "value",
                .type = ParamType::Number,
                .doc = "isovalue",
                .required = true,
                .position = 0},
               insideParam()};
  for (Param& param : solidParams()) op.params.push_back(std::move(param));
  return op;
}

Operator thresholdOperator() {
  Operator op = solidOperator(
      "threshold", "make a solid of all points of a volume with values between two limits");
  op.details =
      "The interpolated values decide, and the distances are exact as those of 'isosurface'. "
      "'keep' and 'fill-cavities' then choose its parts.";
  op.example = "levelsmith volume sphere --size 33 ! threshold 0 0.2 ! measure";
  op.params = {{.name = "low",
                .type = ParamType::Number,
                .doc = "values above it belong to the solid",
                .required = true,
                .position = 0},
               {.name = "high",
                .type = ParamType::Number,
                .doc = "values below it belong to the solid",
                .required = true,
                .position = 1}};
  for (Param& param : solidParams()) op.params.push_back(std::move(param));
  return op;
}

Operator isosurfaceMeshOperator() {
  return {
      .name = "isosurface-mesh",
      .group = "Volumes",
      .summary = "make a triangle mesh of the isosurface of a volume, by marching cubes",
      .details =
          "Fast, without a level set between. Vertices lie on the surface of the filter, triangles "
          "do not. For a certified solid with exact distances use 'isosurface'. A grid point of "
          "the isovalue is outside.",
      .example =
          "levelsmith volume marschner-lobb ! isosurface-mesh 0.5 --filter tricubic ! measure",
      .params = {{.name = "value",
                  .type = ParamType::Number,
                  .doc = "isovalue",
                  .required = true,
                  .position = 0},
                 insideParam(),
                 {.name = "filter",
                  .type = ParamType::Choice,
                  .doc = "function between the grid points, on whose surface the vertices lie",
                  .fallback = "trilinear",
                  .choices = {"trilinear", "tricubic"}},
                 {.name = "border",
                  .type = ParamType::Choice,
                  .doc = "treatment of a surface that reaches the border of the volume: close it "
                         "with the faces of the volume's box, leave it open, or refuse it",
                  .fallback = "close",
                  .choices = {"close", "open", "refuse"}},
                 {.name = "no-normals",
                  .type = ParamType::Flag,
                  .doc = "leave out the normals of the vertices"}},
      .operands = {{Kind::Volume, Kind::Field}},
      .resultKind = [](const Invocation&) { return Kind::Mesh; },
      .run = makeIsosurfaceMesh,
      .plan = planIsosurfaceMesh,
  };
}

}  // namespace pipeline
