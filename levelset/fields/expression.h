#pragma once

#include <string>

#include "levelset/fields/field.h"

/// Fields written as formulas in x, y, z (world units), r = |(x, y, z)| and, for vectors, t (time):
/// muParser's grammar (+ − * / ^, comparison, ?:, &&, ||, sin … atan2, exp, ln, sqrt, min, max,
/// abs, sign, rint, sum, avg), and `pi`.
namespace levelset {

/// @param action  for messages
/// @throws UsageError with the place when the text is no such formula
[[nodiscard]] ScalarField scalarExpression(const std::string& text, const char* action);

/// Three formulas with commas between them: "-y, x, 0.1*sin(t)".
/// @throws UsageError when there are not three, or one is none
[[nodiscard]] VectorField vectorExpression(const std::string& text, const char* action);

}  // namespace levelset
