#pragma once

#include <functional>
#include <string>

#include "levelset/fields/field.h"

/// Fields given by formulas. Their variables are x, y, z (world units) and r = |(x, y, z)|, or t
/// (time), or all five; a speed has more. The grammar is muParser's: + − * / ^, comparison, ?:, &&,
/// ||, sin … atan2, exp, ln, sqrt, min, max, abs, sign, rint, sum, avg; and `pi`. A formula with
/// any other variable is refused.
namespace levelset {

/// Parses one formula in x, y, z, r.
/// @throws UsageError, with the position, for an invalid formula
[[nodiscard]] ScalarField scalarExpression(const std::string& text);

/// Parses three formulas in x, y, z, r, t, separated by commas: "-y, x, 0.1*sin(t)".
/// @throws UsageError when there are not three, or one is invalid
[[nodiscard]] VectorField vectorExpression(const std::string& text);

/// Parses one formula in t. @throws UsageError for an invalid formula
[[nodiscard]] std::function<double(double time)> timeExpression(const std::string& text);

/// Parses the speed of a surface: one formula in x, y, z, r, t, the normal nx, ny, nz and the
/// curvature k, see SurfacePoint. The flags of the result state which of them it contains.
/// @throws UsageError for an invalid formula
[[nodiscard]] NormalSpeed speedExpression(const std::string& text);

}  // namespace levelset
