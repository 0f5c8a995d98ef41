#include "apps/pipeline/operators/solids/deformation_options.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "levelset/deform/cage/cage.h"
#include "levelset/deform/deform_band.h"
#include "levelset/deform/ready_lattices.h"
#include "levelset/error.h"
#include "levelset/meshing/band_to_mesh.h"
#include "mapping/placement/deform_patches.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::UsageError;

/// Tolerance of bent and twisted lattices over the diagonal of the box.
constexpr double kClosedFormTolerance = 1e-8;
/// Width of the box around a level set beyond its surface, voxels.
constexpr double kBandMargin = 2;

levelset::UntangledCage untangledCage(const levelset::CageDeformation& cage, const Value& operand,
                                      Invocation& in, const levelset::UntangleOptions& options) {
  if (operand.kind() == Kind::Mesh)
    return levelset::untangled(cage, {operand.mesh().positions, operand.mesh().triangles}, options);
  const levelset::TriMesh surface = levelset::bandToMesh(operand.band());
  const double voxelSize = in.given("voxel") ? in.length("voxel") : operand.band().voxelSize();
  return levelset::untangled(
      cage, {surface.positions, surface.triangles, levelset::kWidestDeformationDomain * voxelSize},
      options);
}

}  // namespace

const std::vector<std::string>& readyLattices() {
  static const std::vector<std::string> names = {"bend", "twist", "taper", "stretch"};
  return names;
}

std::string onlyOption(const Invocation& in, const std::vector<std::string>& names) {
  std::string given;
  for (const std::string& name : names) {
    if (!in.given(name)) continue;
    if (!given.empty())
      throw UsageError(fmt::format(
          "{}: --{} and --{} exclude each other; use one, and a second '{}' for the other",
          in.op().name, given, name, in.op().name));
    given = name;
  }
  if (!given.empty()) return given;
  std::string list;
  for (std::size_t n = 0; n < names.size(); ++n)
    list += fmt::format("{}--{}", n == 0 ? "" : n + 1 == names.size() ? " or " : ", ", names[n]);
  throw UsageError(fmt::format("{}: the deformation is missing; give {}", in.op().name, list));
}

std::vector<V3d> extentOf(const Value& operand, const std::array<V3d, 3>& directions) {
  if (operand.kind() == Kind::Mesh && !operand.mesh().positions.empty())
    return operand.mesh().positions;
  if (operand.kind() == Kind::Points) return operand.cloud().positions;
  if (operand.kind() == Kind::Patch) return mapping::particlesOf(operand.patch().patches);
  std::vector<V3d> all;
  for (const V3d& d : directions) {
    all.push_back(d);
    all.push_back(-d);
  }
  const std::vector<double> extents = operand.band().zeroSetExtents(all);
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

DeformationValue readyLattice(const Invocation& in, const std::string& kind,
                              const std::vector<V3d>& points, double margin) {
  const auto directions = levelset::directionsAlong(
      in.point("axis"), in.given("towards") ? in.point("towards") : V3d(0));
  const levelset::OrientedBox box = levelset::boxAround(points, directions, margin);
  const double tolerance = kClosedFormTolerance * 2 * box.halfSize.length();
  levelset::ReadyLattice ready =
      kind == "bend"    ? levelset::bendLattice(box, in.radians("bend"), tolerance)
      : kind == "twist" ? levelset::twistLattice(box, in.radians("twist"), tolerance)
      : kind == "taper" ? levelset::taperLattice(box, in.number("taper"))
                        : levelset::stretchLattice(box, in.number("stretch"));
  return {std::make_shared<levelset::LatticeDeformation>(std::move(ready.lattice)), ready.error};
}

double marginOf(const Value& operand) {
  return operand.kind() == Kind::Band ? kBandMargin * operand.plan().voxelSize : 0;
}

ChosenDeformation untangledDeformation(const DeformationValue& deformation, const Value* operand,
                                       Invocation& in) {
  const levelset::UntangleOptions options{.maxMemory = in.maxMemory,
                                          .progress = levelset::subProgress(in.progress, 0, 0.4)};
  if (const levelset::ControlLattice* lattice = deformation.lattice()) {
    levelset::UntangledLattice result = levelset::untangled(*lattice, options);
    return {{std::make_shared<levelset::LatticeDeformation>(std::move(result.lattice)),
             deformation.error},
            result.report};
  }
  if (!operand || (operand->kind() != Kind::Mesh && operand->kind() != Kind::Band))
    throw UsageError(
        fmt::format("{}: --untangle of a cage needs a surface, but the operand is {}; leave it out",
                    in.op().name, operand ? kindPhrase(operand->kind()) : "missing"));
  levelset::UntangledCage result = untangledCage(
      dynamic_cast<const levelset::CageDeformation&>(*deformation.map), *operand, in, options);
  return {{std::make_shared<levelset::CageDeformation>(std::move(result.cage))}, result.report};
}

void tellDeformation(Invocation& in, const ChosenDeformation& chosen, Json& details) {
  const std::size_t points = chosen.value.controlPoints();
  details["control_points"] = points;
  if (chosen.value.lattice()) details["lattice_error"] = chosen.value.error;
  if (chosen.value.error > 0)
    in.notes.errors.push_back(
        {"distance of the lattice from the closed form", chosen.value.error, "world units"});
  if (!chosen.untangled) return;
  const levelset::UntangleReport& report = *chosen.untangled;
  details["untangle"] = {{"moved_points", report.movedPoints},
                         {"largest_move", report.largestMove},
                         {"root_mean_square_move", report.rootMeanSquareMove},
                         {"certificates", report.rounds}};
  in.notes.notes.push_back(
      fmt::format("untangling moved {} of {} control points, by at most {:.4g}", report.movedPoints,
                  points, report.largestMove));
}

void addDeformation(Json& json, const DeformationValue& deformation) {
  const levelset::ControlLattice* lattice = deformation.lattice();
  json["form"] = lattice ? "lattice" : "cage";
  json["control_points"] = deformation.controlPoints();
  json["identity"] = deformation.map->isIdentity();
  if (!lattice) return;
  const levelset::LatticeData& data = lattice->data();
  for (const levelset::LatticeAxis& axis : data.axes) {
    json["degree"].push_back(axis.degree);
    json["count"].push_back(axis.count());
  }
  json["rational"] = lattice->isRational();
  const Imath::M44d& m = data.boxToWorld;
  json["origin"] = {m[3][0], m[3][1], m[3][2]};
  for (int axis = 0; axis < 3; ++axis)
    json["edges"].push_back({m[axis][0], m[axis][1], m[axis][2]});
}

std::vector<Param> readyLatticeParams() {
  return {{.name = "bend",
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
           .range = Range::Positive}};
}

std::vector<Param> latticePlaceParams() {
  return {{.name = "axis",
           .type = ParamType::Point,
           .doc = "direction of the axis; it passes through the middle of the operand",
           .fallback = "0,0,1"},
          {.name = "towards",
           .type = ParamType::Point,
           .doc = "direction towards which --bend moves the ends of the axis; default: any across "
                  "the axis"}};
}

void validateLatticePlace(const Invocation& in, const std::string& kind) {
  if (in.given("towards") && kind != "bend")
    throw UsageError(fmt::format("{}: --towards is for --bend, but --{} is given; leave it out",
                                 in.op().name, kind));
  (void)levelset::directionsAlong(in.point("axis"),
                                  in.given("towards") ? in.point("towards") : V3d(0));
}

}  // namespace pipeline
