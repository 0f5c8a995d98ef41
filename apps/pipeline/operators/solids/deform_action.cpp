#include "apps/pipeline/operators/solids/deform_action.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/solids/deformation_options.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/deform/cage/cage.h"
#include "levelset/deform/deform_band.h"
#include "levelset/deform/deform_mesh.h"
#include "levelset/deform/lattice_file.h"
#include "levelset/deform/ready_lattices.h"
#include "levelset/error.h"
#include "levelset/mesh_files/mesh_file.h"
#include "mapping/placement/deform_patches.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::UsageError;

/// Options of which each deformation has exactly one, unless the last operand is the deformation.
const std::vector<std::string> kDeformations = {"bend",    "twist",   "taper",
                                                "stretch", "lattice", "cage"};
/// Default of --tolerance over the diagonal of the box.
constexpr double kMeshTolerance = 1e-4;

/// Returns true if the last operand is the deformation.
bool takesValue(const Invocation& in) {
  return in.operands.size() > 1;
}

/// Reads a cage mesh, without attributes, so that vertices are not doubled along seams.
levelset::TriMesh cageMesh(const Invocation& in, const char* option) {
  return levelset::readMesh(in.text(option), {.attributes = false, .maxMemory = in.maxMemory});
}

void requireFixedHeight(const Value& operand) {
  if (operand.kind() == Kind::Patch && operand.patch().atHeight)
    throw UsageError(
        "this patch has --height auto, and its height is unknown without a texture; give --height "
        "a length");
}

/// Builds or reads the deformation of the options, before it is untangled.
DeformationValue givenDeformation(Invocation& in, bool isPlan) {
  if (takesValue(in)) return in.operands[1].deformation();
  const std::string kind = onlyOption(in, kDeformations);
  if (kind == "cage")
    return {std::make_shared<levelset::CageDeformation>(
        cageMesh(in, "cage"), cageMesh(in, "to"),
        in.text("coordinates") == "green" ? levelset::CageCoordinates::Green
                                          : levelset::CageCoordinates::MeanValue)};
  if (kind == "lattice")
    return {std::make_shared<levelset::LatticeDeformation>(
        levelset::readLattice(in.text("lattice"), in.maxMemory))};
  const Value& operand = in.operands[0];
  const auto directions = levelset::directionsAlong(
      in.point("axis"), in.given("towards") ? in.point("towards") : V3d(0));
  return readyLattice(in, kind,
                      isPlan ? cornersOf(operand.plan().bounds) : extentOf(operand, directions),
                      marginOf(operand));
}

Value runDeform(Invocation& in) {
  requireFixedHeight(in.operands[0]);
  ChosenDeformation chosen{givenDeformation(in, /*isPlan=*/false)};
  if (in.flag("untangle")) chosen = untangledDeformation(chosen.value, in.operands.data(), in);
  Json details;
  tellDeformation(in, chosen, details);
  const levelset::Progress progress =
      chosen.untangled ? levelset::subProgress(in.progress, 0.4, 1) : in.progress;
  DeformValueOptions options{.maxMemory = in.maxMemory, .progress = progress};
  if (in.given("voxel")) options.voxelSize = in.length("voxel");
  if (in.given("half-width")) options.halfWidth = in.number("half-width");
  if (in.given("tolerance")) options.tolerance = in.length("tolerance");
  if (in.given("onto")) options.onto = &in.named.at("onto").band();
  DeformedValue result = deformed(in.operands[0], *chosen.value.map, options);
  if (result.value.kind() == Kind::Mesh) {
    details["halved_edges"] = result.halvedEdges;
    details["bend"] = result.bend;
    in.notes.errors.push_back(
        {"largest distance of edges from their deformed curves", result.bend, "world units"});
  }
  if (in.given("onto")) {
    details["largest_snap"] = result.largestSnap;
    in.notes.errors.push_back(
        {"largest distance of a particle from the surface, before it was "
         "moved onto it",
         result.largestSnap, "world units"});
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
  const double before = areaOf(plan.bounds);
  plan.bounds = takesValue(in) ? in.operands[1].plan().bounds
                               : givenDeformation(in, /*isPlan=*/true).map->bounds();
  if (plan.kind == Kind::Band) {
    if (in.given("voxel")) plan.voxelSize = in.length("voxel");
    if (in.given("half-width")) plan.halfWidth = in.number("half-width");
  }
  // Bends and twists keep the area within some percent; the others scale it about as their box.
  // The box of a given lattice may be larger than the operand.
  if (!in.given("bend") && !in.given("twist") && !takesValue(in) && before > 0)
    plan.area *= areaOf(plan.bounds) / before;
  if (plan.kind == Kind::Mesh) {
    if (in.given("tolerance")) (void)in.length("tolerance");
    plan.triangles = 0;  // unknown until the triangles are divided
  }
  return plan;
}

/// Refuses options that do not apply to the way in which the deformation is given.
void validateDeformation(const Invocation& in) {
  if (takesValue(in)) {
    for (const char* name : {"axis", "towards", "to", "coordinates"})
      if (in.given(name))
        throw UsageError(fmt::format(
            "deform: --{} does not apply to a deformation that is given as a value; leave it out",
            name));
    return;
  }
  const std::string kind = onlyOption(in, kDeformations);
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
  if (in.given("untangle") && kind == "cage" && !in.operands.empty() &&
      (in.operands[0].kind() == Kind::Points || in.operands[0].kind() == Kind::Patch))
    throw UsageError(
        fmt::format("deform: --untangle of a cage needs a surface, but the operand is {}; leave it "
                    "out",
                    kindPhrase(in.operands[0].kind())));
  validateLatticePlace(in, kind);
}

void validateDeform(const Invocation& in) {
  validateDeformation(in);
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
  if (in.given("onto") && operand != Kind::Patch)
    throw UsageError(fmt::format(
        "deform: --onto is for patches, but the operand is a {}; leave it out", kindName(operand)));
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
  if (operand.kind() == Kind::Patch) {
    mapping::DeformPatchesResult result = mapping::deformPatches(
        operand.patch().patches, map,
        {.onto = options.onto, .maxMemory = options.maxMemory, .progress = options.progress});
    return {.value = Value(PatchValue{.patches = std::move(result.patches)}),
            .certificate = result.certificate,
            .largestSnap = result.largestSnap};
  }
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
  std::vector<Param> params = readyLatticeParams();
  const std::vector<Param> own = {
      {.name = "lattice", .type = ParamType::Path, .doc = "JSON file of a lattice"},
      {.name = "cage",
       .type = ParamType::Path,
       .doc = "mesh file of a closed cage around the operand, at rest"},
      {.name = "to",
       .type = ParamType::Path,
       .doc = "mesh file of the moved cage, with the same triangles"},
      {.name = "coordinates",
       .type = ParamType::Choice,
       .doc = "coordinates of a cage: mean-value follows its faces and keeps affine maps; green "
              "also turns with them, and distorts less",
       .fallback = "mean-value",
       .choices = {"mean-value", "green"}},
      {.name = "untangle",
       .type = ParamType::Flag,
       .doc = "move the control points of a deformation that folds by little, until it does not"}};
  params.insert(params.end(), own.begin(), own.end());
  for (Param& param : latticePlaceParams()) params.push_back(std::move(param));
  const std::vector<Param> ofOperand = {
      {.name = "tolerance",
       .type = ParamType::Length,
       .doc = "for meshes: largest distance of an edge from its deformed curve; default: 1e-4 of "
              "the diagonal; 0: divide no triangle",
       .range = Range::NonNegative,
       .allowsVoxels = false},
      {.name = "onto",
       .type = ParamType::Solid,
       .doc = "for patches: deformed base, onto whose surface the lowest particles are moved"},
      {.name = "voxel",
       .type = ParamType::Length,
       .doc = "for level sets: voxel size of the result; default: that of the operand",
       .range = Range::Positive,
       .allowsVoxels = false},
      {.name = "half-width",
       .type = ParamType::Number,
       .doc = "for level sets: half width of the result, in voxels; default: that of the operand",
       .range = Range::Positive}};
  params.insert(params.end(), ofOperand.begin(), ofOperand.end());
  return {
      .name = "deform",
      .group = "Placement",
      .summary =
          "bend, twist, taper or stretch a solid, a mesh, points or patches, or move them by a "
          "lattice or a cage",
      .details =
          "The deformation is a lattice of control points around the operand: a trivariate Bézier "
          "or B-spline volume. It is given by an option, or as the last operand: the result of "
          "'lattice' or 'cage', or a lattice file that 'read' has read. --lattice reads one, of "
          "any degree up to 20, from a JSON file. A lattice that folds, or whose deformed box "
          "overlaps itself, is refused; the report has the least Jacobian. --cage and --to read a "
          "closed mesh around the operand, at rest and with moved vertices. A cage that folds "
          "somewhere in the operand is refused too. --untangle removes folds, and the report has "
          "the distances of the control points. A level set gets exact distances again. Triangles "
          "are divided where the deformation bends them. Of patches, all particles move. The "
          "middle of the operand stays in its place; --taper leaves the cross-section at the begin "
          "of the axis as it is.",
      .example =
          "levelsmith box --size 1,1,4 --voxel 0.05 ! deform --twist 90 ! deform --bend 60 "
          "--towards 1,0,0 ! measure",
      .params = std::move(params),
      .operands = {{Kind::Band, Kind::Mesh, Kind::Points, Kind::Patch}, {Kind::Deformation}},
      .aloneWith = kDeformations,
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
