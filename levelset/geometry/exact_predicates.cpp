#include "levelset/geometry/exact_predicates.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace levelset::convert {
namespace {

using Imath::V2d;
using Imath::V3d;

constexpr double kUnit = std::numeric_limits<double>::epsilon() / 2;
// Error bounds of [Shewchuk97, figures 21 and 23], rounded up.
constexpr double kOrient2dBound = (3 + 16 * kUnit) * kUnit;
constexpr double kOrient3dBound = (8 + 64 * kUnit) * kUnit;

/// An exact sum of doubles, stored as nonoverlapping components of increasing magnitude.
class Expansion {
 public:
  void add(double value) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      const double sum = value + parts_[i];
      const double back = sum - value;
      const double error = (value - (sum - back)) + (parts_[i] - back);
      if (error != 0) parts_[kept++] = error;
      value = sum;
    }
    if (value != 0) parts_[kept++] = value;
    size_ = kept;
  }

  void addProduct(double a, double b) {
    const double product = a * b;
    add(std::fma(a, b, -product));
    add(product);
  }

  void addProduct(double a, double b, double c) {
    const double high = a * b;
    addProduct(std::fma(a, b, -high), c);
    addProduct(high, c);
  }

  /// Sign of the sum. The largest component outweighs all others together.
  [[nodiscard]] int sign() const {
    if (size_ == 0) return 0;
    return parts_[size_ - 1] > 0 ? 1 : -1;
  }

 private:
  std::array<double, 128> parts_;  // at most 24 products of three factors, four components each
  std::size_t size_ = 0;
};

int signOf(double value) {
  return (value > 0) - (value < 0);
}

/// Returns true when a − b equals `difference` exactly.
bool isExact(double a, double b, double difference) {
  const double virtualB = a - difference;
  return (a - (difference + virtualB)) + (virtualB - b) == 0;
}

int orient2dExact(const V2d& a, const V2d& b, const V2d& c) {
  Expansion det;
  const V2d u = a - c, v = b - c;
  if (isExact(a.x, c.x, u.x) && isExact(a.y, c.y, u.y) && isExact(b.x, c.x, v.x) &&
      isExact(b.y, c.y, v.y)) {
    det.addProduct(u.x, v.y);
    det.addProduct(-u.y, v.x);
    return det.sign();
  }
  det.addProduct(a.x, b.y);
  det.addProduct(-a.x, c.y);
  det.addProduct(-c.x, b.y);
  det.addProduct(-a.y, b.x);
  det.addProduct(a.y, c.x);
  det.addProduct(c.y, b.x);
  return det.sign();
}

/// Adds the triple product u × v · w times `factor`.
void addTriple(Expansion& det, const V3d& u, const V3d& v, const V3d& w, double factor) {
  det.addProduct(factor * u.y, v.z, w.x);
  det.addProduct(-factor * u.z, v.y, w.x);
  det.addProduct(factor * u.z, v.x, w.y);
  det.addProduct(-factor * u.x, v.z, w.y);
  det.addProduct(factor * u.x, v.y, w.z);
  det.addProduct(-factor * u.y, v.x, w.z);
}

bool isExact(const V3d& a, const V3d& b, const V3d& difference) {
  return isExact(a.x, b.x, difference.x) && isExact(a.y, b.y, difference.y) &&
         isExact(a.z, b.z, difference.z);
}

int orient3dExact(const V3d& a, const V3d& b, const V3d& c, const V3d& d) {
  Expansion det;
  const V3d u = b - a, v = c - a, w = d - a;
  if (isExact(b, a, u) && isExact(c, a, v) && isExact(d, a, w)) {
    addTriple(det, u, v, w, 1);
    return det.sign();
  }
  // The expanded form of (b − a) × (c − a) · (d − a).
  addTriple(det, b, c, d, 1);
  addTriple(det, a, c, d, -1);
  addTriple(det, a, b, d, 1);
  addTriple(det, a, b, c, -1);
  return det.sign();
}

}  // namespace

int orient2d(const V2d& a, const V2d& b, const V2d& c) {
  const V2d u = a - c, v = b - c;
  // Exact, since differences are 0 for equal numbers only. Faces along the axes often have such
  // differences.
  if ((u.x == 0 || v.y == 0) && (u.y == 0 || v.x == 0)) return 0;
  const double left = u.x * v.y, right = u.y * v.x;
  const double det = left - right;
  if (std::abs(det) > kOrient2dBound * (std::abs(left) + std::abs(right))) return signOf(det);
  return orient2dExact(a, b, c);
}

int orient3d(const V3d& a, const V3d& b, const V3d& c, const V3d& d) {
  const V3d u = b - a, v = c - a, w = d - a;
  for (int axis = 0; axis < 3; ++axis)  // exact, as in orient2d()
    if (u[axis] == 0 && v[axis] == 0 && w[axis] == 0) return 0;
  const double yz = u.y * v.z, zy = u.z * v.y;
  const double zx = u.z * v.x, xz = u.x * v.z;
  const double xy = u.x * v.y, yx = u.y * v.x;
  const double det = (yz - zy) * w.x + (zx - xz) * w.y + (xy - yx) * w.z;
  const double permanent = (std::abs(yz) + std::abs(zy)) * std::abs(w.x) +
                           (std::abs(zx) + std::abs(xz)) * std::abs(w.y) +
                           (std::abs(xy) + std::abs(yx)) * std::abs(w.z);
  if (std::abs(det) > kOrient3dBound * permanent) return signOf(det);
  return orient3dExact(a, b, c, d);
}

}  // namespace levelset::convert
