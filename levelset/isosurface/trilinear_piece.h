#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cmath>
#include <cstdint>

#include "levelset/vdb.h"

namespace levelset::trilinear {

using openvdb::Mat3d;
using openvdb::Vec3d;

/// Largest bend of a piece, relative to the gradient and to the edge of the piece. A cell is split
/// until its pieces bend less, or three times.
inline constexpr double kMostBend = 0.2;

/// Trilinear function on the unit cube, as a polynomial.
struct Cubic {
  /// Coefficients of 1, x, y, z, xy, xz, yz, xyz.
  std::array<double, 8> c{};

  Cubic() = default;
  /// @param corner  values at the corners, x slowest: corner 4x + 2y + z
  explicit Cubic(const std::array<double, 8>& corner);
  explicit Cubic(const std::array<float, 8>& corner);

  [[nodiscard]] double value(const Vec3d& p) const {
    return c[0] + c[1] * p[0] + p[1] * (c[2] + c[4] * p[0]) +
           p[2] * (c[3] + c[5] * p[0] + p[1] * (c[6] + c[7] * p[0]));
  }
  [[nodiscard]] Vec3d gradient(const Vec3d& p) const {
    return {c[1] + c[4] * p[1] + p[2] * (c[5] + c[7] * p[1]),
            c[2] + c[4] * p[0] + p[2] * (c[6] + c[7] * p[0]),
            c[3] + c[5] * p[0] + p[1] * (c[6] + c[7] * p[0])};
  }
  /// Second derivatives by xy, xz and yz; the others are zero.
  [[nodiscard]] Vec3d mixed(const Vec3d& p) const {
    return {c[4] + c[7] * p[2], c[5] + c[7] * p[1], c[6] + c[7] * p[0]};
  }
  /// Returns true if the bend exceeds kMostBend, relative to the gradient.
  [[nodiscard]] bool isBent() const;
  /// Returns true if the same holds for the curve of zeros on a face of the cube, although the
  /// surface itself may bend little. This happens where the surface touches the face.
  [[nodiscard]] bool isBentOnFace() const;
  /// Returns true if bounds of the function show that its zeros in the cube are further from a
  /// point than a distance. The zeros lie between two planes: those of the linear part at the
  /// centre plus and minus the bend.
  /// @param metric, inverse  as squaredDistance()
  /// @param squared          squared distance
  /// @param start            receives a point of the cube near its closest zero, if the result is
  ///                         false
  [[nodiscard]] bool isFurther(const Mat3d& metric, const Mat3d& inverse, const Vec3d& target,
                               double squared, Vec3d& start) const;
  /// Bound of the difference between the function and its linear part at the centre of the cube.
  [[nodiscard]] double bend() const;
};

/// Part of a cell of a volume, in which the surface bends little. `corner` are the values of the
/// function whose zero set is the surface, positive inside. A part is the complete cell or one of
/// its 8, 64, … subcells.
struct Piece {
  std::array<float, 8> corner;
  std::array<float, 3> first;      ///< lowest corner, index coordinates of the volume
  float edge = 1;                  ///< edge length, index coordinates
  std::array<float, 3> low, high;  ///< bounds of the surface, in the frame of the search
};

/// Face of a border cell, where the face itself bounds the solid. The solid covers the part where
/// all functions are positive.
struct BorderFace {
  /// Values of up to two functions at the corners, u slowest: corner 2u + v.
  std::array<std::array<float, 4>, 2> corner;
  int functions = 1;
  Vec3d first, u, v;               ///< lowest corner and the two edges, in the frame of the search
  std::array<float, 3> low, high;  ///< bounds, in the frame of the search
};

/// Finds the closest point of the zero set in a piece. A point with the property of a closest point
/// is the closest one if the Lagrangian with its multiplier is convex on the piece. Without this
/// proof, the search begins at further points, and then in octants of the piece.
/// @param metric    inner products of the edges of the piece, in the frame of the search
/// @param inverse   inverse of `metric`
/// @param target    position whose closest point is searched, in the unit cube of the piece
/// @param most      squared distance above which the result does not matter
/// @return squared distance in the frame of the search; `most` or more if it is at least `most`
[[nodiscard]] double squaredDistance(const Cubic& f, const Mat3d& metric, const Mat3d& inverse,
                                     const Vec3d& target, double most);

/// Squared distance of a point from the part of a border face that the solid covers; infinite if it
/// covers none. The curves at which a function is zero are left out: they belong to pieces.
[[nodiscard]] double squaredDistance(const BorderFace& face, const Vec3d& from);

/// Area of the part of a border face that the solid covers. Exact along v, and by the midpoint rule
/// along u.
[[nodiscard]] double coveredArea(const BorderFace& face);

}  // namespace levelset::trilinear
