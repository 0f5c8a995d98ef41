#pragma once

#include <array>
#include <vector>

namespace render {

/// A cubic on [0, 1], given by its Bernstein coefficients.
using BernsteinCubic = std::array<double, 4>;

/// Returns the first parameter in [0, 1] at which the cubic changes sign; negative when there is
/// none. Zero counts as positive, so a cubic that touches zero from above has no root. The interval
/// [0, 1] is halved repeatedly, leftmost half first, guided by Descartes' rule of signs. The search
/// uses no tolerance, and only sums and halves of the coefficients.
[[nodiscard]] double firstSignChange(const BernsteinCubic& cubic);

/// Appends all parameters in [0, 1] at which the cubic changes sign, in ascending order. The
/// directions of the changes alternate.
void addSignChanges(const BernsteinCubic& cubic, std::vector<double>& found);

/// Returns true when the cubic changes sign in [0, 1]; cheaper than firstSignChange().
[[nodiscard]] bool hasSignChange(const BernsteinCubic& cubic);

}  // namespace render
