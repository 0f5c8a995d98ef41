#pragma once

#include <array>
#include <vector>

namespace render {

/// A cubic on [0, 1], given by its Bernstein coefficients.
using BernsteinCubic = std::array<double, 4>;

/// Finds the first parameter in [0, 1] at which the cubic changes sign; negative when there is
/// none. Zero counts as positive, so a cubic that only touches zero has no root. Subdivides by
/// halving, leftmost half first, guided by Descartes' rule of signs. Uses no tolerance and only
/// sums and halves of the coefficients.
[[nodiscard]] double firstSignChange(const BernsteinCubic& cubic);

/// Appends all parameters with a sign change, in ascending order. The directions of the changes
/// alternate.
void addSignChanges(const BernsteinCubic& cubic, std::vector<double>& found);

/// True when there is a sign change; cheaper than firstSignChange().
[[nodiscard]] bool hasSignChange(const BernsteinCubic& cubic);

}  // namespace render
