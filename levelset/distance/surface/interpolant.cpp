#include "levelset/distance/surface/interpolant.h"

#include <cmath>
#include <cstring>

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::Vec3d;
using Float4 = float __attribute__((vector_size(16)));

Float4 load4(const float* values) {
  Float4 result;
  std::memcpy(&result, values, sizeof(result));
  return result;
}

/// Catmull-Rom weights of four samples at -1, 0, 1 and 2 for a position t in [0, 1), with their
/// first and second derivatives. Does not use AxisWeights of interpolate_vdb.h, because these
/// weights are in single precision for vector instructions, and two of the polynomials of
/// AxisWeights round differently.
struct Weights {
  float w[4], d[4], dd[4];
  explicit Weights(double t) {
    const auto f = [](double x) { return static_cast<float>(x); };
    w[0] = f(((-0.5 * t + 1) * t - 0.5) * t);
    w[1] = f((1.5 * t - 2.5) * t * t + 1);
    w[2] = f(((-1.5 * t + 2) * t + 0.5) * t);
    w[3] = f((0.5 * t - 0.5) * t * t);
    d[0] = f((-1.5 * t + 2) * t - 0.5);
    d[1] = f((4.5 * t - 5) * t);
    d[2] = f((-4.5 * t + 4) * t + 0.5);
    d[3] = f((1.5 * t - 1) * t);
    dd[0] = f(2 - 3 * t);
    dd[1] = f(9 * t - 5);
    dd[2] = f(4 - 9 * t);
    dd[3] = f(3 * t - 1);
  }
};

Float4 combine(const float (&w)[4], const Float4 (&rows)[4]) {
  return w[0] * rows[0] + w[1] * rows[1] + w[2] * rows[2] + w[3] * rows[3];
}

double dot(const float (&w)[4], const Float4& v) {
  return static_cast<double>((w[0] * v[0] + w[1] * v[1]) + (w[2] * v[2] + w[3] * v[3]));
}

}  // namespace

void DenseBlock::load(const openvdb::FloatGrid::ConstAccessor& accessor, const Coord& origin) {
  origin_ = origin;
  values_.fill([&](const Coord& step) {
    return blockValues(accessor, origin.offsetBy(8 * step.x(), 8 * step.y(), 8 * step.z()));
  });
}

Jet DenseBlock::jet(const Vec3d& p) const {
  const int cx = static_cast<int>(std::floor(p.x())), cy = static_cast<int>(std::floor(p.y())),
            cz = static_cast<int>(std::floor(p.z()));
  const Weights wx(p.x() - cx), wy(p.y() - cy), wz(p.z() - cz);
  const float* corner = values_.at(cx - 1, cy - 1, cz - 1);
  Float4 v[4], dx[4], dxx[4];  // rows along z, summed over x
  for (int j = 0; j < 4; ++j) {
    Float4 rows[4];
    for (int i = 0; i < 4; ++i) rows[i] = load4(corner + (i * kSide + j) * kSide);
    v[j] = combine(wx.w, rows);
    dx[j] = combine(wx.d, rows);
    dxx[j] = combine(wx.dd, rows);
  }
  const Float4 value = combine(wy.w, v), dy = combine(wy.d, v), dyy = combine(wy.dd, v);
  const Float4 gx = combine(wy.w, dx), gxy = combine(wy.d, dx), gxx = combine(wy.w, dxx);
  Jet jet;
  jet.value = dot(wz.w, value);
  jet.gradient = Vec3d(dot(wz.w, gx), dot(wz.w, dy), dot(wz.d, value));
  jet.xx = dot(wz.w, gxx);
  jet.yy = dot(wz.w, dyy);
  jet.zz = dot(wz.dd, value);
  jet.xy = dot(wz.w, gxy);
  jet.xz = dot(wz.d, gx);
  jet.yz = dot(wz.d, dy);
  return jet;
}

void DenseBlock::slope(const Vec3d& p, Jet& jet) const {
  const int cx = static_cast<int>(std::floor(p.x())), cy = static_cast<int>(std::floor(p.y())),
            cz = static_cast<int>(std::floor(p.z()));
  const Weights wx(p.x() - cx), wy(p.y() - cy), wz(p.z() - cz);
  const float* corner = values_.at(cx - 1, cy - 1, cz - 1);
  Float4 v[4], dx[4];
  for (int j = 0; j < 4; ++j) {
    Float4 rows[4];
    for (int i = 0; i < 4; ++i) rows[i] = load4(corner + (i * kSide + j) * kSide);
    v[j] = combine(wx.w, rows);
    dx[j] = combine(wx.d, rows);
  }
  const Float4 value = combine(wy.w, v), gx = combine(wy.w, dx), dy = combine(wy.d, v);
  jet.value = dot(wz.w, value);
  jet.gradient = Vec3d(dot(wz.w, gx), dot(wz.w, dy), dot(wz.d, value));
}

const DenseBlock& DenseBlockCache::around(const Vec3d& position) {
  const Coord origin = leafOrigin(position);
  const auto hash = static_cast<std::size_t>((origin.x() >> 3) & 3) * 16 +
                    static_cast<std::size_t>((origin.y() >> 3) & 3) * 4 +
                    static_cast<std::size_t>((origin.z() >> 3) & 3);
  Slot& slot = slots_[hash % kSlots];
  if (!slot.used || slot.block.origin() != origin) {
    slot.block.load(accessor_, origin);
    slot.used = true;
  }
  return slot.block;
}

}  // namespace levelset::eikonal
