#pragma once

#include <array>
#include <optional>
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

/// First sign change of a function that is a cubic on each piece of a segment.
/// @param overPieces  calls visit(cubic, from, to) for the pieces in order, with the fractions of
/// the
///        segment where they begin and end, while visit returns true
/// @return fraction of the segment
template <typename OverPieces>
std::optional<double> firstSignChangeOn(const OverPieces& overPieces) {
  std::optional<double> first;
  overPieces([&](const BernsteinCubic& cubic, double from, double to) {
    if (const double s = firstSignChange(cubic); s >= 0) first = from + s * (to - from);
    return !first;
  });
  return first;
}

/// Appends the fractions of all sign changes, in ascending order. @param overPieces  as above
template <typename OverPieces>
void addSignChangesOn(const OverPieces& overPieces, std::vector<double>& found) {
  std::vector<double> shares;
  overPieces([&](const BernsteinCubic& cubic, double from, double to) {
    shares.clear();
    addSignChanges(cubic, shares);
    for (const double s : shares) found.push_back(from + s * (to - from));
    return true;
  });
}

}  // namespace render
