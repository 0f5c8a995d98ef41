#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/points/projection/point_surface.h"

namespace levelset::points {

inline constexpr std::uint32_t kNoPiece = PointSurface::kNone;

/// Smooth pieces of a surface through points, between sharp edges.
struct Pieces {
  std::size_t count = 0;
  std::vector<std::uint32_t> pieces;  ///< piece of each point; kNoPiece for points without a part
  std::vector<Imath::V3d> normals;    ///< unit normals on the side of the piece, outwards
  /// Normals by the points around alone. Points of tiny pieces keep them.
  std::vector<Imath::V3d> ownNormals;
  std::vector<bool> isClear;         ///< the points around give a clear normal
  std::vector<std::uint32_t> parts;  ///< part of each piece
  double noise = 0;                  ///< error of the fits away from sharp edges, spacings

  /// Joins pieces, drops those without points, and numbers the others anew.
  /// @param pairs  numbers of two pieces each
  void join(const std::vector<std::array<std::uint32_t, 2>>& pairs);
};

/// Divides the parts of a surface where normals of neighbours differ by more than an angle. Each
/// point gets a normal of its own side: beside a sharp edge, the plane through the point that
/// passes near most of its neighbours. Connected points with consistent normals make a piece.
/// Others, and those of tiny pieces, join the piece whose tangent planes pass nearest to them. The
/// two sides of a sharp edge that fades out belong to one piece.
/// @param angle  radians
/// @param sides  vectors to the outside, about, at each point
[[nodiscard]] Pieces findPieces(const PointSurface& surface, double angle,
                                std::span<const Imath::V3d> sides);

/// Moves points beside sharp edges to the piece whose polynomials pass nearest to them.
/// @param whole    surface before PointSurface::divide()
/// @param divided  surface after it
/// @return the number of points that moved
std::size_t reassign(const PointSurface& whole, const PointSurface& divided, Pieces& pieces);

/// Counts the edges of the graph within a piece across which the normals differ by more than an
/// angle: sharp edges that are rounded.
/// @param surface    before PointSurface::divide()
/// @param isRounded  for each part: all of its sharp edges are rounded
[[nodiscard]] std::size_t countRoundedPairs(const PointSurface& surface, const Pieces& pieces,
                                            double angle, const std::vector<bool>& isRounded);

}  // namespace levelset::points
