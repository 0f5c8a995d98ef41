#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cstdint>
#include <vector>

#include "levelset/points/creases/pieces.h"
#include "levelset/points/projection/point_surface.h"

namespace levelset::points {

/// Position where three or more pieces meet.
struct CreaseCorner {
  Imath::V3d position;
  std::vector<std::uint32_t> pieces;  ///< ascending
};

/// Curve where two pieces meet, as positions about half a spacing apart.
struct CreaseCurve {
  std::array<std::uint32_t, 2> pieces;  ///< left and right of the curve, seen from outside
  std::vector<Imath::V3d> positions;    ///< a closed curve does not repeat its first one
  std::vector<std::array<Imath::V3d, 2>> normals;  ///< both pieces, at each position
  std::array<std::uint32_t, 2> corners = {PointSurface::kNone, PointSurface::kNone};  ///< ends

  [[nodiscard]] bool isClosed() const { return corners[0] == PointSurface::kNone; }
};

/// Curve on the outline of a piece, which lies to its left.
struct PieceSide {
  std::uint32_t curve;
  bool isReversed;
};

/// Sharp edges and corners of a surface through points.
struct CreaseNetwork {
  std::vector<CreaseCorner> corners;
  std::vector<CreaseCurve> curves;
  /// Loops of curves around each piece.
  std::vector<std::vector<std::vector<PieceSide>>> loops;
  /// Pieces whose common curve was not found as a whole, or does not end in a corner.
  std::vector<std::array<std::uint32_t, 2>> conflicts;
  /// Pieces of which one has normals that point inwards.
  std::vector<std::array<std::uint32_t, 2>> opposed;
};

/// Finds the curves where pieces meet. Corners first: positions on three pieces or more. Then a
/// predictor and corrector follow each curve, from a position beside an edge of the graph between
/// two pieces, along the cross product of their normals. Each such edge must lie near a curve or a
/// corner.
/// @param whole    surface before PointSurface::divide()
/// @param divided  surface after it
[[nodiscard]] CreaseNetwork traceCreases(const PointSurface& whole, const PointSurface& divided,
                                         const Pieces& pieces);

}  // namespace levelset::points
