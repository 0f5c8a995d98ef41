#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "apps/pipeline/values/value.h"
#include "levelset/deform/untangle/untangle_deformation.h"

/// Options of the actions `deform` and `lattice` that give a deformation.
namespace pipeline {

/// Options of ready lattices: bend, twist, taper, stretch.
[[nodiscard]] const std::vector<std::string>& readyLattices();

/// Returns the only option among `names` that is given.
/// @throws UsageError if none or several are given
[[nodiscard]] std::string onlyOption(const Invocation& in, const std::vector<std::string>& names);

/// A deformation, and the report of its untangling.
struct ChosenDeformation {
  DeformationValue value;
  std::optional<levelset::UntangleReport> untangled = {};
};

/// Corners of the box around an operand along three directions, or its points: all that the box of
/// a lattice must contain.
[[nodiscard]] std::vector<Imath::V3d> extentOf(const Value& operand,
                                               const std::array<Imath::V3d, 3>& directions);

/// Corners of a box; none of an empty box.
[[nodiscard]] std::vector<Imath::V3d> cornersOf(const Imath::Box3d& box);

/// Builds a ready lattice from --bend, --twist, --taper or --stretch.
/// @param points  all that the box must contain
/// @param margin  width of the box beyond the points, world units
[[nodiscard]] DeformationValue readyLattice(const Invocation& in, const std::string& kind,
                                            const std::vector<Imath::V3d>& points, double margin);

/// Width of the box of a lattice beyond an operand, world units: two voxels of a level set.
[[nodiscard]] double marginOf(const Value& operand);

/// Removes the folds of a lattice, or of a cage in an operand.
/// @param operand  a level set or a mesh for a cage; may be null for a lattice
/// @throws UsageError for a cage without a surface
[[nodiscard]] ChosenDeformation untangledDeformation(const DeformationValue& deformation,
                                                     const Value* operand, Invocation& in);

/// Adds the figures of a deformation to the details of a step, and to its notes.
void tellDeformation(Invocation& in, const ChosenDeformation& chosen, Json& details);

/// Adds the description of a deformation for `info`.
void addDeformation(Json& json, const DeformationValue& deformation);

/// Parameters --bend, --twist, --taper and --stretch, and those that place them.
[[nodiscard]] std::vector<Param> readyLatticeParams();
[[nodiscard]] std::vector<Param> latticePlaceParams();

/// Refuses --axis and --towards where they do not apply.
/// @param kind  the option that gives the deformation
void validateLatticePlace(const Invocation& in, const std::string& kind);

}  // namespace pipeline
