#include "levelset/shapes/spherical_product.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "levelset/error.h"

namespace levelset {
namespace {

using Imath::V2d;
using Imath::V3d;

constexpr double kPi = std::numbers::pi;
constexpr double kSamplesAcross = 100;  // spacing of the samples, as a share of the size
constexpr std::size_t kMostRows = 20'000;
constexpr double kLargestRatio = 50;
constexpr std::size_t kMostStarts = 24;
// Steps of the differences at a minimum, as a share of the size. Their error moves the minimum by
// the square of this.
constexpr double kDifference = 1e-4;
constexpr double kConverged = 1e-7;   // last step of Newton's method
constexpr double kLeastStep = 3e-11;  // last step of the search where Newton's method fails
constexpr double kWidestStep = 0.2;   // radians
// At a cusp, second differences are not proportional to the square of their step.
constexpr double kCuspChange = 0.3;
// There, angles are as the square of the step or a higher power.
constexpr double kLeastCuspStep = 3e-16;

double squaredLength(const V3d& a, const V3d& b) {
  return (a - b).length2();
}

}  // namespace

double Superformula::radius(double angle) const {
  if (symmetry == 0) return 1;
  const double a = symmetry * angle / 4;
  return std::pow(
      std::pow(std::abs(std::cos(a)), exponents.y) + std::pow(std::abs(std::sin(a)), exponents.z),
      -1 / exponents.x);
}

SphericalProduct::Row SphericalProduct::rowAt(const Superformula& curve, double angle) {
  const double radius = curve.radius(angle);
  return {angle, radius * std::cos(angle), radius * std::sin(angle)};
}

std::vector<SphericalProduct::Row> SphericalProduct::rowsOf(const Superformula& curve, double from,
                                                            double to, const V2d& scale,
                                                            double spacing) const {
  // Creases lie at multiples of 2π / symmetry. They and the axes are samples.
  std::vector<double> angles;
  for (int n = 0; n <= 8; ++n) angles.push_back(from + (to - from) * n / 8);
  if (curve.symmetry > 0) {
    const double step = 2 * kPi / curve.symmetry;
    for (double a = std::ceil(from / step) * step; a < to; a += step) angles.push_back(a);
  }
  std::sort(angles.begin(), angles.end());
  std::vector<Row> rows = {rowAt(curve, angles.front())};
  std::vector<Row> open;  // the next one last
  for (auto n = angles.size(); n-- > 1;) open.push_back(rowAt(curve, angles[n]));
  while (!open.empty()) {
    const Row &a = rows.back(), b = open.back();
    const double chord = std::hypot(scale.x * (b.cosine - a.cosine), scale.y * (b.sine - a.sine));
    if (chord > spacing && b.angle - a.angle > 1e-12) {
      open.push_back(rowAt(curve, (a.angle + b.angle) / 2));
    } else {
      open.pop_back();
      if (b.angle > a.angle) rows.push_back(b);
    }
    if (rows.size() + open.size() > kMostRows)
      throw InvalidInput(
          "the curves of the shape are too spiky; give exponents nearer to each other");
  }
  return rows;
}

SphericalProduct::SphericalProduct(const Superformula& around, const Superformula& upright,
                                   const V3d& scale)
    : aroundCurve_(around), uprightCurve_(upright), scale_(scale) {
  constexpr int kScan = 4096;
  double widest[2] = {0, 0};
  for (int c = 0; c < 2; ++c) {
    const Superformula& curve = c == 0 ? around : upright;
    double least = std::numeric_limits<double>::infinity();
    for (int n = 0; n < kScan; ++n) {
      const double r = curve.radius((c == 0 ? 2 : 1) * kPi * (n / double{kScan} - 0.5));
      least = std::min(least, r);
      widest[c] = std::max(widest[c], r);
    }
    if (!(widest[c] <= kLargestRatio * least))
      throw InvalidInput(fmt::format(
          "the radius of the {} curve varies from {:.3g} to {:.3g}, by a factor of more "
          "than {}; give exponents nearer to each other",
          c == 0 ? "around" : "upright", least, widest[c], kLargestRatio));
  }
  const double across = std::max(scale.x, scale.y) * widest[0];
  size_ = 2 * widest[1] * std::max(across, scale.z);
  spacing_ = size_ / kSamplesAcross;
  around_ = rowsOf(around, -kPi, kPi, V2d(scale.x, scale.y) * widest[1], spacing_);
  around_.pop_back();  // π is −π
  upright_ = rowsOf(upright, -kPi / 2, kPi / 2, V2d(across, scale.z), spacing_);
  std::vector<V3d> positions;
  positions.reserve(around_.size() * upright_.size());
  for (std::size_t i = 0; i < around_.size(); ++i)
    for (std::size_t j = 0; j < upright_.size(); ++j) {
      positions.push_back(sample(i, j));
      bounds_.extendBy(positions.back());
      if (j == 0) continue;
      const std::size_t next = (i + 1) % around_.size();
      const V3d a = sample(i, j - 1), b = sample(i, j), c = sample(next, j),
                d = sample(next, j - 1);
      area_ += (c - a).cross(d - b).length() / 2;
    }
  samples_ = makePointSearch(positions);
}

V3d SphericalProduct::at(double theta, double phi) const {
  return product(rowAt(aroundCurve_, theta), rowAt(uprightCurve_, phi));
}

bool SphericalProduct::isInside(const V3d& point) const {
  const double x = point.x / scale_.x, y = point.y / scale_.y, z = point.z / scale_.z;
  const double across = std::hypot(x, y);
  const double flat = across > 0 ? across / aroundCurve_.radius(std::atan2(y, x)) : 0;
  return std::hypot(flat, z) < uprightCurve_.radius(std::atan2(z, flat));
}

bool SphericalProduct::isLocalMinimum(std::size_t i, std::size_t j, const V3d& point,
                                      double squared) const {
  const std::size_t count = around_.size(), last = upright_.size() - 1;
  if (j == 0 || j == last) return i == 0;  // a pole: all i are one point
  for (const std::size_t u : {(i + count - 1) % count, i, (i + 1) % count})
    for (const std::size_t v : {j - 1, j, j + 1})
      if (squaredLength(sample(u, v), point) < squared) return false;
  return true;
}

double SphericalProduct::distance(const V3d& point, double reach) const {
  const double sign = isInside(point) ? -1 : 1;
  const FoundItem nearest = samples_.closest(point, std::numeric_limits<double>::infinity());
  const double first = std::sqrt(nearest.squared);
  if (first - spacing_ > reach) return sign * (first - spacing_);
  thread_local std::vector<FoundItem> found;
  samples_.within(point, (first + spacing_) * (first + spacing_), found);
  std::sort(found.begin(), found.end(), [](const FoundItem& a, const FoundItem& b) {
    return a.squared != b.squared ? a.squared < b.squared : a.index < b.index;
  });
  double least = first;
  std::size_t starts = 0;
  for (const FoundItem& item : found) {
    const std::size_t i = item.index / upright_.size(), j = item.index % upright_.size();
    if (!isLocalMinimum(i, j, point, item.squared)) continue;
    least = std::min(least, descend(point, around_[i].angle, upright_[j].angle));
    if (++starts == kMostStarts) break;
  }
  return sign * least;
}

double SphericalProduct::descend(const V3d& point, double theta, double phi) const {
  const auto clamped = [](double angle) { return std::clamp(angle, -kPi / 2, kPi / 2); };
  double step = spacing_ / 4;  // world units
  bool isSmooth = false;       // Newton's method has ended at a minimum
  bool isCusp = false;         // Newton's method is of no use
  V3d along(0), aside(0);      // differences along the surface there
  double least = squaredLength(at(theta, phi), point);
  constexpr int kMostSteps = 800;
  for (int n = 0; n < kMostSteps && step > (isCusp ? kLeastCuspStep : kLeastStep) * size_; ++n) {
    // Angles of about one step along the surface.
    const V3d here = at(theta, phi);
    constexpr double kProbe = 1e-6;
    const double ahead = phi > 0 ? -kProbe : kProbe;
    const double du =
        std::min(kWidestStep, step * kProbe / ((at(theta + kProbe, phi) - here).length() + 1e-300));
    const double dv =
        std::min(kWidestStep, step * kProbe / ((at(theta, phi + ahead) - here).length() + 1e-300));
    double f[3][3];
    int bestU = 1, bestV = 1;
    const Row us[3] = {rowAt(aroundCurve_, theta - du), rowAt(aroundCurve_, theta),
                       rowAt(aroundCurve_, theta + du)};
    const Row vs[3] = {rowAt(uprightCurve_, clamped(phi - dv)), rowAt(uprightCurve_, phi),
                       rowAt(uprightCurve_, clamped(phi + dv))};
    for (int u = 0; u < 3; ++u)
      for (int v = 0; v < 3; ++v) f[u][v] = squaredLength(product(us[u], vs[v]), point);
    for (int u = 0; u < 3; ++u)
      for (int v = 0; v < 3; ++v)
        if (f[u][v] < f[bestU][bestV]) {
          bestU = u;
          bestV = v;
        }
    along = product(us[2], vs[1]) - product(us[0], vs[1]);
    aside = product(us[1], vs[2]) - product(us[1], vs[0]);
    const double gu = (f[2][1] - f[0][1]) / 2, gv = (f[1][2] - f[1][0]) / 2;
    const double huu = f[2][1] - 2 * f[1][1] + f[0][1], hvv = f[1][2] - 2 * f[1][1] + f[1][0];
    if (!isCusp && step <= 2 * kDifference * size_ && step > kDifference / 100 * size_) {
      const auto valueAt = [&](const Row& u, const Row& v) {
        return squaredLength(product(u, v), point);
      };
      const double halfU = valueAt(rowAt(aroundCurve_, theta - du / 2), vs[1]) - 2 * f[1][1] +
                           valueAt(rowAt(aroundCurve_, theta + du / 2), vs[1]);
      const double halfV = valueAt(us[1], rowAt(uprightCurve_, clamped(phi - dv / 2))) -
                           2 * f[1][1] +
                           valueAt(us[1], rowAt(uprightCurve_, clamped(phi + dv / 2)));
      isCusp = std::abs(4 * halfU - huu) > kCuspChange * std::abs(huu) ||
               std::abs(4 * halfV - hvv) > kCuspChange * std::abs(hvv);
    }
    const double huv = (f[2][2] - f[2][0] - f[0][2] + f[0][0]) / 4;
    const double determinant = huu * hvv - huv * huv;
    if (!isCusp && huu > 0 && determinant > 1e-6 * huu * hvv) {
      const double su = (huv * gv - hvv * gu) / determinant,
                   sv = (huv * gu - huu * gv) / determinant;
      const double length = std::max(std::abs(su), std::abs(sv));  // in steps
      if (length < 8) {
        const double newTheta = theta + su * du, newPhi = clamped(phi + sv * dv);
        const double squared = squaredLength(at(newTheta, newPhi), point);
        const bool isFine = step <= 2 * kDifference * size_;
        if (squared <= f[1][1]) {
          theta = newTheta;
          phi = newPhi;
          least = std::min(least, squared);
          isSmooth = isFine && length * step < kConverged * size_;
          if (isSmooth) break;
          step = std::min(step, std::max(length * step, kDifference * size_));
          continue;
        }
        // At the minimum, values differ by rounding errors only.
        isSmooth = isFine && length * step < kConverged * size_;
        if (isSmooth) break;
      }
    }
    if (bestU != 1 || bestV != 1) {
      theta = us[bestU].angle;
      phi = vs[bestV].angle;
      least = std::min(least, f[bestU][bestV]);
    } else {
      step /= 4;
    }
  }
  if (isSmooth) {
    // Along the normal, an error of the closest point counts with its square only.
    const V3d normal = along.cross(aside);
    const double length = normal.length();
    if (length > 0) {
      const double distance = std::abs((point - at(theta, phi)).dot(normal)) / length;
      if (distance * distance >= least - kConverged * kConverged * size_ * size_) return distance;
    }
  }
  return std::sqrt(least);
}

}  // namespace levelset
