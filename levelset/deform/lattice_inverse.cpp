#include "levelset/deform/lattice_inverse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace levelset {
namespace {

using Imath::V3d;

/// Largest accepted distance between the image of a result and the position, over the diagonal of
/// the deformed box, and over the rounding error of its coordinates.
constexpr double kInverseTolerance = 1e-11, kRoundings = 16;
constexpr int kMostPieceHalvings = 90;  // 30 for each parameter

/// Bounds of the control points. With positive weights the image of a piece lies inside.
Imath::Box3d hullOf(const BezierPiece& piece) {
  Imath::Box3d box;
  const bool isRational = piece.weight.coefficients.size() > 1;
  for (std::size_t n = 0; n < piece.numerator[0].coefficients.size(); ++n) {
    const double weight = isRational ? piece.weight.coefficients[n] : 1;
    box.extendBy(V3d(piece.numerator[0].coefficients[n], piece.numerator[1].coefficients[n],
                     piece.numerator[2].coefficients[n]) /
                 weight);
  }
  return box;
}

/// Halves a piece along the parameter with the longest control polygon.
std::array<BezierPiece, 2> halvesOf(const BezierPiece& piece) {
  int axis = 0;
  double longest = -1;
  for (int a = 0; a < 3; ++a) {
    double length = 0;
    for (const TensorBernstein& form : piece.numerator) {
      const CoefficientRange range = rangeOf(derivative(form, a));
      length = std::max({length, std::abs(range.least), std::abs(range.most)});
    }
    if (length > longest) longest = length, axis = a;
  }
  std::array<BezierPiece, 2> result = {piece, piece};
  for (std::size_t c = 0; c < 3; ++c)
    std::tie(result[0].numerator[c], result[1].numerator[c]) = halves(piece.numerator[c], axis);
  if (piece.weight.coefficients.size() > 1)
    std::tie(result[0].weight, result[1].weight) = halves(piece.weight, axis);
  result[0].high[axis] = result[1].low[axis] = 0.5 * (piece.low[axis] + piece.high[axis]);
  return result;
}

bool containsWithin(const Imath::Box3d& box, const V3d& p, double margin) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(p[axis] >= box.min[axis] - margin && p[axis] <= box.max[axis] + margin)) return false;
  return true;
}

}  // namespace

LatticeInverse::LatticeInverse(const ControlLattice& lattice)
    : lattice_(lattice), pieces_(lattice) {
  bounds_.reserve(pieces_.size());
  for (std::size_t n = 0; n < pieces_.size(); ++n) bounds_.push_back(hullOf(pieces_.piece(n)));
  const Imath::Box3d bounds = lattice.bounds();
  tolerance_ = std::max(kInverseTolerance * bounds.size().length(),
                        kRoundings * std::numeric_limits<double>::epsilon() *
                            std::max(bounds.min.length(), bounds.max.length()));
  Imath::Box3d box;
  for (int corner = 0; corner < 8; ++corner)
    box.extendBy(lattice.worldOf(V3d(corner & 1, (corner >> 1) & 1, corner >> 2)));
  boxSize_ = box.size().length();
}

std::optional<V3d> LatticeInverse::newton(const V3d& position, const V3d& guess) const {
  return NewtonInverse{tolerance_, 1e-3 * tolerance_, 0.5 * boxSize_}.find(
      [&](const V3d& p) { return lattice_.jet(p); }, position, guess);
}

std::optional<V3d> LatticeInverse::near(const V3d& position, const V3d& guess) const {
  if (auto found = newton(position, guess)) return found;
  return at(position);
}

std::optional<V3d> LatticeInverse::at(const V3d& position) const {
  for (std::size_t n = 0; n < bounds_.size(); ++n) {
    if (!containsWithin(bounds_[n], position, tolerance_)) continue;
    std::vector<std::pair<BezierPiece, int>> parts;
    parts.emplace_back(pieces_.piece(n), 0);
    while (!parts.empty()) {
      const auto [part, depth] = std::move(parts.back());
      parts.pop_back();
      if (!containsWithin(hullOf(part), position, tolerance_)) continue;
      const auto found = newton(position, lattice_.worldOf(0.5 * (part.low + part.high)));
      if (found && lattice_.contains(*found)) return found;
      if (depth == kMostPieceHalvings) continue;
      for (BezierPiece& half : halvesOf(part)) parts.emplace_back(std::move(half), depth + 1);
    }
  }
  return {};
}

}  // namespace levelset
