// The actions `lattice` and `cage`, which make deformations.

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/solids/deformation_options.h"
#include "levelset/deform/cage/cage.h"
#include "levelset/deform/ready_lattices.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::UsageError;

const std::vector<std::string> kLattices = {"bend", "twist", "taper", "stretch", "count"};
constexpr double kUsualDegree = 3;

/// Reads one integer for all axes, or three.
std::array<std::size_t, 3> integersOf(const Invocation& in, const char* name, double most) {
  std::vector<double> given = in.numbers(name);
  if (given.size() == 1) given.assign(3, given[0]);
  std::array<std::size_t, 3> result{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!(given[axis] >= 1) || given[axis] > most || given[axis] != std::floor(given[axis]))
      throw UsageError(fmt::format("{}: {} is not an integer from 1 to {}; give one",
                                   in.where(name), given[axis], most));
    result[axis] = static_cast<std::size_t>(given[axis]);
  }
  return result;
}

std::array<levelset::LatticeAxis, 3> axesOf(const Invocation& in) {
  const auto counts = integersOf(in, "count", static_cast<double>(levelset::kMostControlPoints));
  std::array<std::size_t, 3> degrees{};
  if (in.given("degree"))
    degrees = integersOf(in, "degree", levelset::kMostDegree);
  else
    for (std::size_t axis = 0; axis < 3; ++axis)
      degrees[axis] = static_cast<std::size_t>(
          std::min(kUsualDegree, std::max(1.0, static_cast<double>(counts[axis]) - 1)));
  const double points = static_cast<double>(counts[0]) * static_cast<double>(counts[1]) *
                        static_cast<double>(counts[2]);
  if (points > static_cast<double>(levelset::kMostControlPoints))
    throw levelset::ResourceLimit(
        fmt::format("lattice: --count makes {} control points, but {} are the most; give fewer",
                    points, levelset::kMostControlPoints));
  std::array<levelset::LatticeAxis, 3> axes;
  for (std::size_t axis = 0; axis < 3; ++axis)
    axes[axis] = levelset::uniformAxis(static_cast<int>(degrees[axis]), counts[axis]);
  return axes;
}

/// Builds the lattice that moves nothing, in the box around points.
DeformationValue restingLattice(const Invocation& in, const std::vector<V3d>& points,
                                double margin) {
  const auto directions = levelset::directionsAlong(
      in.point("axis"), in.given("towards") ? in.point("towards") : V3d(0));
  const levelset::OrientedBox box = levelset::boxAround(points, directions, margin);
  Imath::M44d frame;
  V3d corner = box.centre;
  for (int axis = 0; axis < 3; ++axis) {
    const V3d half = box.directions[static_cast<std::size_t>(axis)] * box.halfSize[axis];
    corner -= half;
    for (int c = 0; c < 3; ++c) frame[axis][c] = 2 * half[c];
  }
  for (int c = 0; c < 3; ++c) frame[3][c] = corner[c];
  return {
      std::make_shared<levelset::LatticeDeformation>(levelset::identityLattice(axesOf(in), frame))};
}

DeformationValue latticeOf(const Invocation& in, bool isPlan) {
  const std::string kind = onlyOption(in, kLattices);
  std::vector<V3d> points;
  double margin = 0;
  if (in.given("box")) {
    points = cornersOf(in.box("box"));
  } else {
    const Value& operand = in.operands[0];
    const auto directions = levelset::directionsAlong(
        in.point("axis"), in.given("towards") ? in.point("towards") : V3d(0));
    if (!isPlan && operand.kind() == Kind::Patch && operand.patch().atHeight)
      throw UsageError(
          "this patch has --height auto, and its height is unknown without a texture; give "
          "--height a length");
    points = isPlan ? cornersOf(operand.plan().bounds) : extentOf(operand, directions);
    margin = marginOf(operand);
  }
  return kind == "count" ? restingLattice(in, points, margin)
                         : readyLattice(in, kind, points, margin);
}

Value runLattice(Invocation& in) {
  ChosenDeformation chosen{latticeOf(in, /*isPlan=*/false)};
  if (in.flag("untangle")) chosen = untangledDeformation(chosen.value, nullptr, in);
  Json details;
  tellDeformation(in, chosen, details);
  in.notes.detailsJson = details.dump();
  return Value(std::move(chosen.value));
}

Plan planLattice(Invocation& in) {
  Plan plan{.kind = Kind::Deformation};
  if (!in.given("box") && in.operands[0].plan().bounds.isEmpty()) return plan;
  plan.bounds = latticeOf(in, /*isPlan=*/true).map->bounds();
  return plan;
}

void validateLattice(const Invocation& in) {
  const std::string kind = onlyOption(in, kLattices);
  if (in.given("degree") && kind != "count")
    throw UsageError(
        fmt::format("lattice: --degree is for --count, but --{} is given; leave it out", kind));
  validateLatticePlace(in, kind == "count" ? "bend" : kind);  // both take --towards
  if (kind == "count") (void)axesOf(in);
}

Value runCage(Invocation& in) {
  DeformationValue value{std::make_shared<levelset::CageDeformation>(
      in.mesh(0), in.mesh(1),
      in.text("coordinates") == "green" ? levelset::CageCoordinates::Green
                                        : levelset::CageCoordinates::MeanValue,
      in.progress)};
  Json details;
  tellDeformation(in, {value}, details);
  in.notes.detailsJson = details.dump();
  return Value(std::move(value));
}

}  // namespace

Operator latticeOperator() {
  std::vector<Param> params = readyLatticeParams();
  const std::vector<Param> own = {
      {.name = "count",
       .type = ParamType::Numbers,
       .doc = "number of control points along each axis of a lattice that moves nothing, to be "
              "edited in its file",
       .range = Range::Positive},
      {.name = "degree",
       .type = ParamType::Numbers,
       .doc = "for --count: degree along each axis, 1 to 20; default: 3, or less with fewer than 4 "
              "points",
       .range = Range::Positive},
      {.name = "box",
       .type = ParamType::Box,
       .doc = "box of the lattice, in place of the box around the operand"}};
  params.insert(params.end(), own.begin(), own.end());
  for (Param& param : latticePlaceParams()) params.push_back(std::move(param));
  params.push_back({.name = "untangle",
                    .type = ParamType::Flag,
                    .doc = "move the control points of a lattice that folds by little, until it "
                           "does not"});
  return {
      .name = "lattice",
      .group = "Placement",
      .summary = "make a deformation: a lattice that bends, twists, tapers or stretches",
      .details =
          "The box of the lattice is around the operand, as of 'deform', or --box. 'deform' moves "
          "values by the result, and 'write' saves it. One lattice moves several values in the "
          "same way; all of them must lie in its box. --count makes a lattice that moves nothing. "
          "A lattice that folds is refused when 'deform' uses it.",
      .example =
          "levelsmith lattice --bend 60 --towards 1,0,0 --box \"-1,-1,-3 1,1,3\" --as bent ! box "
          "--size 1,1,4 --voxel 0.05 ! deform @bent ! measure",
      .params = std::move(params),
      .operands = {{Kind::Band, Kind::Mesh, Kind::Points, Kind::Patch}},
      .noneWith = {"box"},
      .resultKind = [](const Invocation&) { return Kind::Deformation; },
      .run = runLattice,
      .plan = planLattice,
      .validate = validateLattice,
  };
}

Operator cageOperator() {
  return {
      .name = "cage",
      .group = "Placement",
      .summary = "make a deformation: a closed mesh at rest, and the same mesh with moved vertices",
      .details =
          "The first operand is the cage at rest, and the second one the moved cage, with the same "
          "triangles. 'deform' moves values in the cage by the result.",
      .example =
          "levelsmith box --size 6.5,6.5,6.5 --voxel 1 ! mesh --as rest ! deform --stretch 1.5 "
          "--tolerance 0 --as moved ! cage @rest @moved --as long ! sphere --radius 1 --voxel 0.1 "
          "! "
          "mesh ! deform @long ! measure",
      .params = {{.name = "coordinates",
                  .type = ParamType::Choice,
                  .doc = "coordinates of the cage, as of deform",
                  .fallback = "mean-value",
                  .choices = {"mean-value", "green"}}},
      .operands = {{Kind::Mesh}, {Kind::Mesh}},
      .resultKind = [](const Invocation&) { return Kind::Deformation; },
      .run = runCage,
      .plan =
          [](Invocation& in) {
            return Plan{.kind = Kind::Deformation, .bounds = in.operands[1].plan().bounds};
          },
  };
}

}  // namespace pipeline
