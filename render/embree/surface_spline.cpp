#include <algorithm>
#include <cmath>

#include "render/embree/surface_spline_vdb.h"

namespace render {
namespace {

using Imath::V3d;
using openvdb::Coord;

/// Values of the 6³ grid points around a cell, from two points before its lowest corner on. The
/// corners of the cell have the indices 2 and 3 on each axis.
struct ShapeWindow {
  double f[6][6][6];

  ShapeWindow(const openvdb::FloatTree& tree, const Coord& cell) {
    openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> accessor(tree);
    for (int x = 0; x < 6; ++x)
      for (int y = 0; y < 6; ++y)
        for (int z = 0; z < 6; ++z)
          f[x][y][z] = static_cast<double>(accessor.getValue(cell.offsetBy(x - 2, y - 2, z - 2)));
  }
  [[nodiscard]] V3d secondDifferences(int x, int y, int z) const {
    const double twice = 2 * f[x][y][z];
    return {f[x + 1][y][z] + f[x - 1][y][z] - twice, f[x][y + 1][z] + f[x][y - 1][z] - twice,
            f[x][y][z + 1] + f[x][y][z - 1] - twice};
  }
};

/// Weights w[d] of the four coefficients for the derivative of order d of a uniform cubic B-spline,
/// at the fraction a in [0, 1] of a cell. For Filter::Tricubic, weights of the values.
struct SplineWeights {
  double w[3][4];

  SplineWeights(double a, Filter filter) {
    const double b = 1 - a;
    const double convolution[3][4] = {{((2 - a) * a - 1) * a / 2, (a * a * (3 * a - 5) + 2) / 2,
                                       (a * a * (4 - 3 * a) + a) / 2, (a - 1) * a * a / 2},
                                      {((4 - 3 * a) * a - 1) / 2, (9 * a - 10) * a / 2,
                                       ((8 - 9 * a) * a + 1) / 2, (3 * a - 2) * a / 2},
                                      {2 - 3 * a, 9 * a - 5, 4 - 9 * a, 3 * a - 1}};
    const double bspline[3][4] = {
        {b * b * b / 6, (3 * a * a * a - 6 * a * a + 4) / 6, (3 * b * b * b - 6 * b * b + 4) / 6,
         a * a * a / 6},
        {-b * b / 2, (3 * a * a - 4 * a) / 2, -(3 * b * b - 4 * b) / 2, a * a / 2},
        {b, 3 * a - 2, 3 * b - 2, a}};
    for (int d = 0; d < 3; ++d)
      for (int i = 0; i < 4; ++i)
        w[d][i] = filter == Filter::Tricubic ? convolution[d][i] : bspline[d][i];
  }
};

V3d trilinearGradientOf(const ShapeWindow& window, const V3d& a) {
  V3d g(0);
  const double w[3][2] = {{1 - a.x, a.x}, {1 - a.y, a.y}, {1 - a.z, a.z}};
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      for (int k = 0; k < 2; ++k) {
        const double f = window.f[2 + i][2 + j][2 + k];
        g.x += (i ? f : -f) * w[1][j] * w[2][k];
        g.y += (j ? f : -f) * w[0][i] * w[2][k];
        g.z += (k ? f : -f) * w[0][i] * w[1][j];
      }
    }
  }
  return g;
}

}  // namespace

SurfaceShape surfaceShape(const openvdb::FloatTree& tree, const V3d& position, Filter filter) {
  const V3d base(std::floor(position.x), std::floor(position.y), std::floor(position.z));
  const V3d a = position - base;
  const ShapeWindow window(
      tree, Coord(static_cast<int>(base.x), static_cast<int>(base.y), static_cast<int>(base.z)));
  const SplineWeights weights[3] = {{a.x, filter}, {a.y, filter}, {a.z, filter}};

  // sum[p][q][r]: derivative of the B-spline of order p, q, r along x, y, z, with p + q + r ≤ 2.
  double sum[3][3][3] = {};
  double error = 0;
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 4; ++y) {
      double row[3] = {};
      for (int z = 0; z < 4; ++z) {
        const V3d second = window.secondDifferences(x + 1, y + 1, z + 1);
        double c = window.f[x + 1][y + 1][z + 1];
        if (filter == Filter::Trilinear || filter == Filter::BSplineQi)
          c -= (second.x + second.y + second.z) / 6;
        for (int r = 0; r < 3; ++r) row[r] += c * weights[2].w[r][z];
        const bool isCorner = (x == 1 || x == 2) && (y == 1 || y == 2) && (z == 1 || z == 2);
        if (isCorner) {
          error =
              std::max(error, (std::abs(second.x) + std::abs(second.y) + std::abs(second.z)) / 8);
        }
      }
      for (int p = 0; p < 3; ++p)
        for (int q = 0; p + q < 3; ++q)
          for (int r = 0; p + q + r < 3; ++r)
            sum[p][q][r] += weights[0].w[p][x] * weights[1].w[q][y] * row[r];
    }
  }
  SurfaceShape shape;
  shape.gradient = {sum[1][0][0], sum[0][1][0], sum[0][0][1]};
  const bool isSpline = filter != Filter::Trilinear;
  shape.trilinearGradient = isSpline ? shape.gradient : trilinearGradientOf(window, a);
  shape.hessian = Imath::M33d(sum[2][0][0], sum[1][1][0], sum[1][0][1],  //
                              sum[1][1][0], sum[0][2][0], sum[0][1][1],  //
                              sum[1][0][1], sum[0][1][1], sum[0][0][2]);
  shape.interpolationError = isSpline ? 0 : error;
  return shape;
}

}  // namespace render
