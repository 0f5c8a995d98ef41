#include <algorithm>
#include <cmath>

#include "render/embree/spline_cell_vdb.h"

namespace render {
namespace {

using Imath::V3d;
using openvdb::Coord;

constexpr int kMostSegmentHalvings = 40;  // largest number of halvings of a segment

/// Values w of the four cubic basis functions at a in [0, 1], or of their derivatives.
/// @param isBernstein  true: Bernstein polynomials; false: uniform B-splines
void basis(double a, bool isBernstein, bool isSlope, double (&w)[4]) {
  const double b = 1 - a;
  if (isBernstein) {
    const double values[4] = {b * b * b, 3 * a * b * b, 3 * a * a * b, a * a * a};
    const double slopes[4] = {-3 * b * b, 3 * b * (b - 2 * a), 3 * a * (2 * b - a), 3 * a * a};
    std::copy_n(isSlope ? slopes : values, 4, w);
    return;
  }
  if (isSlope) {
    w[0] = -b * b / 2;
    w[1] = a * (3 * a - 4) / 2;
    w[2] = -b * (3 * b - 4) / 2;
    w[3] = a * a / 2;
    return;
  }
  w[0] = b * b * b / 6;
  w[1] = (a * a * (3 * a - 6) + 4) / 6;
  w[2] = (b * b * (3 * b - 6) + 4) / 6;
  w[3] = a * a * a / 6;
}

double weighed(const double (&c)[4][4][4], const double (&x)[4], const double (&y)[4],
               const double (&z)[4]) {
  double sum = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 4; ++k) sum += x[i] * y[j] * z[k] * c[i][j][k];
  return sum;
}

/// The spline along the line p + s · direction in the cell: value and slope at s, and bounds on the
/// changes of both per unit of s (slope_ and bend_).
class LineSearch {
 public:
  LineSearch(const double (&c)[4][4][4], bool isBernstein, const V3d& p, const V3d& direction)
      : c_(c), isBernstein_(isBernstein), p_(p), direction_(direction) {
    // A derivative of a spline is a convex combination of differences of its coefficients, so the
    // largest difference bounds the derivative. For Bernstein polynomials it is 3 times that along
    // one axis, 6 times for the second derivative along an axis, and 9 times for a mixed one.
    for (int a = 0; a < 3; ++a) {
      const double first = (isBernstein ? 3 : 1) * mostDifference(a, -1);
      slope_ += std::abs(direction[a]) * first;
      for (int b = 0; b < 3; ++b) {
        const double factor = !isBernstein ? 1 : a == b ? 6 : 9;
        bend_ += std::abs(direction[a] * direction[b]) * factor *
                 mostDifference(std::min(a, b), std::max(a, b));
      }
    }
  }

  [[nodiscard]] double value(double s) const {
    double w[3][4];
    place(s, w, -1);
    return weighed(c_, w[0], w[1], w[2]);
  }

  /// Returns false when the value at s = 0 is so large that the spline has no zero for s in [0, 1].
  /// The result also holds for all directions whose components have the same absolute values.
  [[nodiscard]] bool mayCross() const { return std::abs(value(0)) <= slope_ * (1 + 1e-9); }

  /// Reports the sign changes for s between low and high, in order. The caller passes the signs at
  /// both ends. So two cells with a common face use the same sign on it, whatever the rounding
  /// within a cell.
  /// @param take  called with s at each sign change; returns false to stop the search
  /// @return true when the search was stopped
  template <typename Take>
  bool search(double low, bool lowInside, double high, bool highInside, int depth,
              const Take& take) {
    const auto stops = [&](bool isChange, double at) { return isChange && !take(at); };
    const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
    const bool differ = lowInside != highInside;
    // If the line lies within the zero set or touches it, the signs of the ends decide.
    if (depth == 0 || slope_ == 0 || evaluations_ > kMostEvaluations) return stops(differ, middle);
    const double v = value(middle);
    ++evaluations_;
    const bool inside = v < 0;
    if (std::abs(v) > slope_ * half)
      return stops(lowInside != inside, low) || stops(highInside != inside, high);
    if (std::abs(slope(middle)) > bend_ * half)
      return differ && stops(true, bisected(low, lowInside, high));
    return search(low, lowInside, middle, inside, depth - 1, take) ||
           search(middle, inside, high, highInside, depth - 1, take);
  }

 private:
  [[nodiscard]] double slope(double s) const {
    double sum = 0;
    for (int a = 0; a < 3; ++a) {
      double w[3][4];
      place(s, w, a);
      sum += direction_[a] * weighed(c_, w[0], w[1], w[2]);
    }
    return sum;
  }
  void place(double s, double (&w)[3][4], int along) const {
    for (int a = 0; a < 3; ++a)
      basis(std::clamp(p_[a] + s * direction_[a], 0.0, 1.0), isBernstein_, a == along, w[a]);
  }
  [[nodiscard]] double bisected(double low, bool lowInside, double high) const {
    for (int n = 0; n < 60; ++n) {
      const double middle = 0.5 * (low + high);
      if (!(middle > low && middle < high)) break;
      ((value(middle) < 0) == lowInside ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }
  /// Largest magnitude of a second difference of the coefficients along the axes a and b; for b =
  /// −1, of a first difference along a.
  [[nodiscard]] double mostDifference(int a, int b) const {
    double most = 0;
    int n[3];
    for (n[0] = 0; n[0] < 4; ++n[0])
      for (n[1] = 0; n[1] < 4; ++n[1])
        for (n[2] = 0; n[2] < 4; ++n[2]) {
          const int needA = n[a] + 1 + (b == a), needB = b < 0 ? 0 : n[b] + 1 + (b == a);
          if (needA > 3 || needB > 3) continue;
          const auto at = [&](int stepA, int stepB) {
            int m[3] = {n[0], n[1], n[2]};
            m[a] += stepA;
            if (b >= 0) m[b] += stepB;
            return c_[m[0]][m[1]][m[2]];
          };
          const double d = b < 0    ? at(1, 0) - at(0, 0)
                           : a == b ? at(2, 0) - 2 * at(1, 0) + at(0, 0)
                                    : at(1, 1) - at(1, 0) - at(0, 1) + at(0, 0);
          most = std::max(most, std::abs(d));
        }
    return most;
  }

  const double (&c_)[4][4][4];
  bool isBernstein_;
  V3d p_, direction_;
  double slope_ = 0, bend_ = 0;
  int evaluations_ = 0;
  static constexpr int kMostEvaluations = 4000;
};

}  // namespace

void SplineCell::toBernstein() {
  // Hermite form of the Catmull-Rom spline: the slope at a grid point is half the difference of its
  // neighbours, and the inner coefficients lie a third of the slope beside the outer ones.
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        double* f[4];
        for (int n = 0; n < 4; ++n)
          f[n] = axis == 0 ? &c_[n][i][j] : axis == 1 ? &c_[i][n][j] : &c_[i][j][n];
        const double low = *f[1], high = *f[2];
        const double slopeLow = 0.5 * (high - *f[0]), slopeHigh = 0.5 * (*f[3] - low);
        *f[0] = low;
        *f[1] = low + slopeLow / 3;
        *f[2] = high - slopeHigh / 3;
        *f[3] = high;
      }
}

bool SplineCell::mayCross() const {
  bool anyInside = false, anyOutside = false;
  for (const auto& plane : c_)
    for (const auto& row : plane)
      for (const double c : row) (c < 0 ? anyInside : anyOutside) = true;
  if (!anyInside || !anyOutside) return false;
  // The slope bound for the line from the centre to a corner covers all points of the cell: on each
  // axis, no point is farther from the centre than the corner.
  const LineSearch toCorner(c_, isBernstein_, V3d(0.5), V3d(0.5));
  return toCorner.mayCross();
}

double SplineCell::value(const V3d& p) const {
  return LineSearch(c_, isBernstein_, p, V3d(0)).value(0);
}

std::optional<double> SplineCell::firstSignChange(const V3d& p, const V3d& q) const {
  std::optional<double> first;
  LineSearch line(c_, isBernstein_, p, q - p);
  line.search(0, value(p) < 0, 1, value(q) < 0, kMostSegmentHalvings, [&](double at) {
    first = at;
    return false;
  });
  return first;
}

void SplineCell::addSignChanges(const V3d& p, const V3d& q, std::vector<double>& found) const {
  LineSearch line(c_, isBernstein_, p, q - p);
  line.search(0, value(p) < 0, 1, value(q) < 0, kMostSegmentHalvings, [&](double at) {
    found.push_back(at);
    return true;
  });
}

}  // namespace render
