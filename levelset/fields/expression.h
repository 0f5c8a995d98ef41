#pragma once

#include <functional>
#include <string>

#include "levelset/fields/field.h"

/// Fields written as formulas in x, y, z (world units) and r = |(x, y, z)|, in t (time), or in all
/// of them: muParser's grammar (+ − * / ^, comparison, ?:, &&, ||, sin … atan2, exp, ln, sqrt, min,
/// max, abs, sign, rint, sum, avg), and `pi`. A formula that reads what has no meaning for it is
/// refused.
namespace levelset {

/// One formula in x, y, z, r.
/// @param action  for messages
/// @throws UsageError with the place when the text is no such formula
[[nodiscard]] ScalarField scalarExpression(const std::string& text, const char* action);

/// Three formulas in x, y, z, r, t with commas between them: "-y, x, 0.1*sin(t)".
/// @throws UsageError when there are not three, or one is none
[[nodiscard]] VectorField vectorExpression(const std::string& text, const char* action);

/// One formula in t. @throws UsageError when the text is no such formula
[[nodiscard]] std::function<double(double time)> timeExpression(const std::string& text,
                                                                const char* action);

}  // namespace levelset
