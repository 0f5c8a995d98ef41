#pragma once

#include <array>
#include <vector>

namespace render {

/// A cubic on [0, 1] by its Bernstein coefficients.
using BernsteinCubic = std::array<double, 4>;

/// First parameter in [0, 1] at which the cubic changes sign; negative when there is none. Zero
/// counts as positive, so a cubic that only touches zero has no root. Leftmost-first halving
/// steered by Descartes' rule of signs: no tolerance, and nothing but sums and halves of the
/// coefficients.
[[nodiscard]] double firstSignChange(const BernsteinCubic& cubic);

/// Appends all parameters at which it changes sign, in order. Each turns to the other side.
void addSignChanges(const BernsteinCubic& cubic, std::vector<double>& found);

/// True when there is one; cheaper than finding where.
[[nodiscard]] bool hasSignChange(const BernsteinCubic& cubic);

}  // namespace render
