#pragma once

#include <array>

namespace render {

/// A cubic on [0, 1] by its Bernstein coefficients.
using BernsteinCubic = std::array<double, 4>;

/// First parameter in [0, 1] at which the cubic changes sign; negative when there is none. Zero
/// counts as positive, so a cubic that only touches zero has no root. Leftmost-first halving
/// steered by Descartes' rule of signs: no tolerance, and nothing but sums and halves of the
/// coefficients.
[[nodiscard]] double firstSignChange(const BernsteinCubic& cubic);

/// True when there is one; cheaper than finding where.
[[nodiscard]] bool hasSignChange(const BernsteinCubic& cubic);

}  // namespace render
