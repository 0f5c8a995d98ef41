#include "apps/pipeline/operators/solids/deform_action.h"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/deform/cage/cage.h"
#include "levelset/deform/deform_band.h"
#include "levelset/deform/deform_mesh.h"
#include "levelset/deform/lattice_file.h"
#include "levelset/deform/ready_lattices.h"
#include "levelset/deform/untangle/untangle_deformation.h"
#include "levelset/error.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/meshing/band_to_mesh.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::OrientedBox;
using levelset::ReadyLattice;
using levelset::UsageError;

/// Options of which each deformation has exactly one.
const std::vector<std::string> kDeformations = {"bend",    "twist",   "taper",
                                                "stretch", "lattice", "cage"};
/// Tolerance of bent and twisted lattices, and default of --tolerance, over the diagonal of the
/// box.
constexpr double kClosedFormTolerance = 1e-8, kMeshTolerance = 1e-4;
/// Width of the box around a level set beyond its surface, voxels.
constexpr double kBandMargin = 2;

std::string deformationOf(const Invocation& in) {
  std::string given;
  for (const std::string& name : kDeformations) {
    if (!in.given(name)) continue;
    if (!given.empty())
      throw UsageError(fmt::format(
          "deform: --{} and --{} exclude each other; use one, and a second 'deform' for the other",
          given, name));
    given = name;
  }
  if (given.empty())
    throw UsageError(
        "deform: the deformation is missing; give --bend, --twist, --taper, --stretch, --lattice "
        "or --cage");
  return given;
}

/// Corners of the box around the operand along the axes of the deformation, or points of the
/// operand: all that the box must contain.
std::vector<V3d> extentOf(const Invocation& in, const std::array<V3d, 3>& directions) {
  const Value& operand = in.operands[0];
  if (operand.kind() == Kind::Mesh && !in.mesh().positions.empty()) return in.mesh().positions;
  if (operand.kind() == Kind::Points) return operand.cloud().positions;
  std::vector<V3d> all;
  for (const V3d& d : directions) {
    all.push_back(d);
    all.push_back(-d);
  }
  const std::vector<double> extents = in.band().zeroSetExtents(all);
  std::vector<V3d> corners;
  for (unsigned corner = 0; corner < 8 && extents[0] > -extents[1]; ++corner) {
    V3d p(0);
    for (std::size_t axis = 0; axis < 3; ++axis)
      p += directions[axis] *
           ((corner >> axis & 1) != 0 ? extents[2 * axis] : -extents[2 * axis + 1]);
    corners.push_back(p);
  }
  return corners;
}

std::vector<V3d> cornersOf(const Imath::Box3d& box) {
  std::vector<V3d> corners;
  for (int corner = 0; corner < 8 && !box.isEmpty(); ++corner)
    corners.emplace_back((corner & 1) ? box.max.x : box.min.x, (corner & 2) ? box.max.y : box.min.y,
                         (corner & 4) ? box.max.z : box.min.z);
  return corners;
}

/// A deformation of the options, and its largest distance from a closed form.
struct ChosenDeformation {
  std::shared_ptr<const levelset::Deformation> map;
  double error = 0;
  std::size_t controlPoints = 0;
  std::optional<levelset::UntangleReport> untangled = {};
};

/// Builds the lattice of the options around points, or reads it.
ReadyLattice latticeFor(Invocation& in, bool isPlan) {
  const std::string kind = deformationOf(in);
  if (kind == "lattice") return {levelset::readLattice(in.text("lattice"), in.maxMemory), 0};
  const auto directions = levelset::directionsAlong(
      in.point("axis"), in.given("towards") ? in.point("towards") : V3d(0));
  const double margin =
      in.operands[0].kind() == Kind::Band ? kBandMargin * in.operands[0].plan().voxelSize : 0;
  const OrientedBox box = levelset::boxAround(
      isPlan ? cornersOf(in.operands[0].plan().bounds) : extentOf(in, directions), directions,
      margin);
  const double tolerance = kClosedFormTolerance * 2 * box.halfSize.length();
  if (kind == "bend") return levelset::bendLattice(box, in.radians("bend"), tolerance);
  if (kind == "twist") return levelset::twistLattice(box, in.radians("twist"), tolerance);
  if (kind == "taper") return levelset::taperLattice(box, in.number("taper"));
  return levelset::stretchLattice(box, in.number("stretch"));
}

/// Reads a cage mesh, without attributes, so that vertices are not doubled along seams.
levelset::TriMesh cageMesh(const Invocation& in, const char* option) {
  return levelset::readMesh(in.text(option), {.attributes = false, .maxMemory = in.maxMemory});
}

/// Removes the folds of a cage in the operand.
levelset::UntangledCage untangledCage(const levelset::CageDeformation& cage, Invocation& in) {
  const levelset::UntangleOptions options{.maxMemory = in.maxMemory,
                                          .progress = levelset::subProgress(in.progress, 0, 0.4)};
  if (in.operands[0].kind() == Kind::Mesh)
    return levelset::untangled(cage, {in.mesh().positions, in.mesh().triangles}, options);
  const levelset::TriMesh surface = levelset::bandToMesh(in.band());
  const double voxelSize = in.given("voxel") ? in.length("voxel") : in.band().voxelSize();
  return levelset::untangled(
      cage, {surface.positions, surface.triangles, levelset::kWidestDeformationDomain * voxelSize},
      options);
}

ChosenDeformation deformationFor(Invocation& in, bool isPlan) {
  const bool isUntangled = in.flag("untangle") && !isPlan;
  ChosenDeformation chosen;
  if (in.given("cage")) {
    const auto coordinates = in.text("coordinates") == "green"
                                 ? levelset::CageCoordinates::Green
                                 : levelset::CageCoordinates::MeanValue;
    levelset::CageDeformation cage(cageMesh(in, "cage"), cageMesh(in, "to"), coordinates);
    chosen.controlPoints = cage.rest().size();
    if (isUntangled) {
      levelset::UntangledCage result = untangledCage(cage, in);
      cage = result.cage;
      chosen.untangled = result.report;
    }
    chosen.map = std::make_shared<levelset::CageDeformation>(std::move(cage));
    return chosen;
  }
  ReadyLattice ready = latticeFor(in, isPlan);
  chosen.controlPoints = ready.lattice.data().points.size();
  chosen.error = ready.error;
  if (isUntangled) {
    levelset::UntangledLattice result = levelset::untangled(
        ready.lattice,
        {.maxMemory = in.maxMemory, .progress = levelset::subProgress(in.progress, 0, 0.4)});
    ready.lattice = result.lattice;
    chosen.untangled = result.report;
  }
  chosen.map = std::make_shared<levelset::LatticeDeformation>(std::move(ready.lattice));
  return chosen;
}

Value runDeform(Invocation& in) {
  const ChosenDeformation chosen = deformationFor(in, /*isPlan=*/false);
  const levelset::Deformation& map = *chosen.map;
  Json details = {{"control_points", chosen.controlPoints}};
  if (!in.given("cage")) details["lattice_error"] = chosen.error;
  if (chosen.error > 0)
    in.notes.errors.push_back(
        {"distance of the lattice from the closed form", chosen.error, "world units"});
  if (chosen.untangled) {
    const levelset::UntangleReport& report = *chosen.untangled;
    details["untangle"] = {{"moved_points", report.movedPoints},
                           {"largest_move", report.largestMove},
                           {"root_mean_square_move", report.rootMeanSquareMove},
                           {"certificates", report.rounds}};
    in.notes.notes.push_back(
        fmt::format("untangling moved {} of {} control points, by at most {:.4g}",
                    report.movedPoints, chosen.controlPoints, report.largestMove));
  }
  const levelset::Progress progress =
      chosen.untangled ? levelset::subProgress(in.progress, 0.4, 1) : in.progress;
  DeformValueOptions options{.maxMemory = in.maxMemory, .progress = progress};
  if (in.given("voxel")) options.voxelSize = in.length("voxel");
  if (in.given("half-width")) options.halfWidth = in.number("half-width");
  if (in.given("tolerance")) options.tolerance = in.length("tolerance");
  DeformedValue result = deformed(in.operands[0], map, options);
  if (result.value.kind() == Kind::Mesh) {
    details["halved_edges"] = result.halvedEdges;
    details["bend"] = result.bend;
    in.notes.errors.push_back(
        {"largest distance of edges from their deformed curves", result.bend, "world units"});
  }
  details["certificate"] = foldCertificateJson(result.certificate);
  in.notes.notes.push_back(levelset::describe(result.certificate));
  in.notes.detailsJson = details.dump();
  return std::move(result.value);
}

double areaOf(const Imath::Box3d& box) {
  const V3d size = box.size();
  return size.x * size.y + size.y * size.z + size.z * size.x;
}

Plan planDeform(Invocation& in) {
  Plan plan = in.operands[0].plan();
  if (plan.bounds.isEmpty()) return plan;
  const ChosenDeformation chosen = deformationFor(in, /*isPlan=*/true);
  const double before = areaOf(plan.bounds);
  plan.bounds = chosen.map->bounds();
  if (plan.kind == Kind::Band) {
    if (in.given("voxel")) plan.voxelSize = in.length("voxel");
    if (in.given("half-width")) plan.halfWidth = in.number("half-width");
  }
  // Bends and twists keep the area within some percent; the others scale it about as their box.
  if (!in.given("bend") && !in.given("twist") && before > 0)
    plan.area *= areaOf(plan.bounds) / before;
  if (plan.kind == Kind::Mesh) {
    if (in.given("tolerance")) (void)in.length("tolerance");
    plan.triangles = 0;  // unknown until the triangles are divided
  }
  return plan;
}

void validateDeform(const Invocation& in) {
  const std::string kind = deformationOf(in);
  if (kind == "lattice" || kind == "cage")
    for (const char* name : {"axis", "towards"})
      if (in.given(name))
        throw UsageError(
            fmt::format("deform: --{} does not apply to --{}, whose file has a place; leave it out",
                        name, kind));
  if (kind == "cage" && !in.given("to"))
    throw UsageError("deform: --to is missing; give the mesh file of the moved cage");
  for (const char* name : {"to", "coordinates"})
    if (in.given(name) && kind != "cage")
      throw UsageError(
          fmt::format("deform: --{} is for --cage, but --{} is given; leave it out", name, kind));
  if (in.given("towards") && kind != "bend")
    throw UsageError(
        fmt::format("deform: --towards is for --bend, but --{} is given; leave it out", kind));
  if (in.given("untangle") && kind == "cage" && !in.operands.empty() &&
      in.operands[0].kind() == Kind::Points)
    throw UsageError(
        "deform: --untangle of a cage needs a surface, but the operand is a point cloud; leave it "
        "out");
  (void)levelset::directionsAlong(in.point("axis"),
                                  in.given("towards") ? in.point("towards") : V3d(0));
  if (in.operands.empty()) return;
  const Kind operand = in.operands[0].kind();
  for (const char* name : {"voxel", "half-width"})
    if (in.given(name) && operand != Kind::Band)
      throw UsageError(
          fmt::format("deform: --{} is for level sets, but the operand is a {}; leave "
                      "it out",
                      name, kindName(operand)));
  if (in.given("tolerance") && operand != Kind::Mesh)
    throw UsageError(
        fmt::format("deform: --tolerance is for meshes, but the operand is a {}; leave it out",
                    kindName(operand)));
}

}  // namespace

nlohmann::ordered_json foldCertificateJson(const levelset::FoldCertificate& certificate) {
  return {{"verdict", levelset::foldVerdictName(certificate.verdict)},
          {"least_jacobian_low", certificate.leastLow},
          {"least_jacobian_high", certificate.leastHigh},
          {"least_jacobian_at", {certificate.place.x, certificate.place.y, certificate.place.z}},
          {"pieces", certificate.pieces},
          {"boxes", certificate.boxes},
          {"overlaps", certificate.overlaps}};
}

DeformedValue deformed(const Value& operand, const levelset::Deformation& map,
                       const DeformValueOptions& options) {
  if (operand.kind() == Kind::Points) {
    levelset::DeformPointsResult result = levelset::deformPoints(
        operand.cloud(), map, {.maxMemory = options.maxMemory, .progress = options.progress});
    return {Value(std::move(result.cloud)), result.certificate};
  }
  if (operand.kind() == Kind::Mesh) {
    const double diagonal = map.bounds().size().length();
    levelset::DeformMeshResult result =
        levelset::deformMesh(operand.mesh(), map,
                             {.tolerance = options.tolerance.value_or(kMeshTolerance * diagonal),
                              .maxMemory = options.maxMemory,
                              .progress = options.progress});
    return {Value(std::move(result.mesh)), result.certificate, result.halvedEdges, result.bend};
  }
  levelset::DeformBandResult result = levelset::deformBand(operand.band(), map,
                                                           {.voxelSize = options.voxelSize,
                                                            .halfWidth = options.halfWidth,
                                                            .maxMemory = options.maxMemory,
                                                            .progress = options.progress});
  return {Value(std::move(result.band)), result.certificate};
}

Operator deformOperator() {
  return {
      .name = "deform",
      .group = "Placement",
      .summary =
          "bend, twist, taper or stretch a solid, a mesh or a point cloud, or move it by a cage",
      .details =
          "The deformation is a lattice of control points around the operand: a trivariate Bézier "
          "or B-spline volume. --lattice reads one, of any degree up to 20, from a JSON file. A "
          "lattice that folds, or whose deformed box overlaps itself, is refused; the report has "
          "the least Jacobian. --cage and --to read a closed mesh around the operand, at rest and "
          "with moved vertices. A cage that folds somewhere in the operand is refused too. "
          "--untangle removes folds, and the report has the distances of the control points. A "
          "level "
          "set gets exact distances again. Triangles are divided where "
          "the deformation bends them. The middle of the operand stays in its place; --taper "
          "leaves the cross-section at the begin of the axis as it is.",
      .example =
          "levelsmith box --size 1,1,4 --voxel 0.05 ! deform --twist 90 ! deform --bend 60 "
          "--towards 1,0,0 ! measure",
      .params =
          {{.name = "bend",
            .type = ParamType::Degrees,
            .doc = "angle between the ends of the axis, which becomes an arc"},
           {.name = "twist",
            .type = ParamType::Degrees,
            .doc = "angle about the axis from one end to the other"},
           {.name = "taper",
            .type = ParamType::Number,
            .doc = "scale factor of the cross-section at the end of the axis; 1 at its begin",
            .range = Range::Positive},
           {.name = "stretch",
            .type = ParamType::Number,
            .doc = "scale factor along the axis",
            .range = Range::Positive},
           {.name = "lattice", .type = ParamType::Path, .doc = "JSON file of a lattice"},
           {.name = "cage",
            .type = ParamType::Path,
            .doc = "mesh file of a closed cage around the operand, at rest"},
           {.name = "to",
            .type = ParamType::Path,
            .doc = "mesh file of the moved cage, with the same triangles"},
           {.name = "coordinates",
            .type = ParamType::Choice,
            .doc = "coordinates of a cage: mean-value follows its faces and keeps affine maps; "
                   "green also turns with them, and distorts less",
            .fallback = "mean-value",
            .choices = {"mean-value", "green"}},
           {.name = "untangle",
            .type = ParamType::Flag,
            .doc = "move the control points of a deformation that folds by little, until it does "
                   "not"},
           {.name = "axis",
            .type = ParamType::Point,
            .doc = "direction of the axis; it passes through the middle of the operand",
            .fallback = "0,0,1"},
           {.name = "towards",
            .type = ParamType::Point,
            .doc = "direction towards which --bend moves the ends of the axis; default: any across "
                   "the axis"},
           {.name = "tolerance",
            .type = ParamType::Length,
            .doc = "for meshes: largest distance of an edge from its deformed curve; default: 1e-4 "
                   "of the diagonal; 0: divide no triangle",
            .range = Range::NonNegative,
            .allowsVoxels = false},
           {.name = "voxel",
            .type = ParamType::Length,
            .doc = "for level sets: voxel size of the result; default: that of the operand",
            .range = Range::Positive,
            .allowsVoxels = false},
           {.name = "half-width",
            .type = ParamType::Number,
            .doc = "for level sets: half width of the result, in voxels; default: that of the "
                   "operand",
            .range = Range::Positive}},
      .operands = {{Kind::Band, Kind::Mesh, Kind::Points}},
      .resultKind =
          [](const Invocation& in) {
            return in.operands.empty() ? Kind::Band : in.operands[0].kind();
          },
      .run = runDeform,
      .plan = planDeform,
      .slope = levelset::Slope::One,
      .validate = validateDeform,
  };
}

}  // namespace pipeline
