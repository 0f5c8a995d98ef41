#include "levelset/distance/surface/interpolant.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::Vec3d;
LEVELSET_INLINE FloatLanes loadFour(const float* values) {
  FloatLanes result;
  std::memcpy(&result, values, sizeof(result));
  return result;
}

LEVELSET_INLINE float narrow(double x) {
  return static_cast<float>(x);
}
LEVELSET_INLINE FloatLanes narrow(const DoubleLanes& x) {
  return __builtin_convertvector(x, FloatLanes);
}

/// Catmull-Rom weights of four samples at -1, 0, 1 and 2 for a position t in [0, 1), with their
/// first and second derivatives. Does not use AxisWeights of interpolate_vdb.h, because these
/// weights are in single precision for vector instructions, and two of the polynomials of
/// AxisWeights round differently.
/// @tparam T, F  type of positions and weights: double and float, or one number for each lane
template <typename T, typename F>
struct WeightsOf {
  F w[4], d[4], dd[4];
  LEVELSET_INLINE explicit WeightsOf(const T& t) {
    w[0] = narrow(((-0.5 * t + 1.0) * t - 0.5) * t);
    w[1] = narrow((1.5 * t - 2.5) * t * t + 1.0);
    w[2] = narrow(((-1.5 * t + 2.0) * t + 0.5) * t);
    w[3] = narrow((0.5 * t - 0.5) * t * t);
    d[0] = narrow((-1.5 * t + 2.0) * t - 0.5);
    d[1] = narrow((4.5 * t - 5.0) * t);
    d[2] = narrow((-4.5 * t + 4.0) * t + 0.5);
    d[3] = narrow((1.5 * t - 1.0) * t);
    dd[0] = narrow(2.0 - 3.0 * t);
    dd[1] = narrow(9.0 * t - 5.0);
    dd[2] = narrow(4.0 - 9.0 * t);
    dd[3] = narrow(3.0 * t - 1.0);
  }
};
using Weights = WeightsOf<double, float>;
using LaneWeights = WeightsOf<DoubleLanes, FloatLanes>;

/// Weights of one lane.
struct WeightsOfLane {
  const FloatLanes (&weights)[4];
  int lane;
  LEVELSET_INLINE float operator[](int k) const { return weights[k][lane]; }
};

template <typename W>
LEVELSET_INLINE FloatLanes combine(const W& w, const FloatLanes (&rows)[4]) {
  return w[0] * rows[0] + w[1] * rows[1] + w[2] * rows[2] + w[3] * rows[3];
}

double dot(const float (&w)[4], const FloatLanes& v) {
  return static_cast<double>((w[0] * v[0] + w[1] * v[1]) + (w[2] * v[2] + w[3] * v[3]));
}

/// Computes dot() for each lane. Row i of `v` holds the values of sample i, one for each lane.
LEVELSET_INLINE DoubleLanes dot(const FloatLanes (&w)[4], const FloatLanes (&v)[4]) {
  return toDouble((w[0] * v[0] + w[1] * v[1]) + (w[2] * v[2] + w[3] * v[3]));
}

/// Cells that contain a position for each lane, and the places of the positions in the cells.
struct LaneCells {
  IntLanes x, y, z;
  LaneWeights wx, wy, wz;

  LEVELSET_INLINE explicit LaneCells(const Triple<DoubleLanes>& p)
      : x(floorOf(p.x)),
        y(floorOf(p.y)),
        z(floorOf(p.z)),
        wx(p.x - __builtin_convertvector(x, DoubleLanes)),
        wy(p.y - __builtin_convertvector(y, DoubleLanes)),
        wz(p.z - __builtin_convertvector(z, DoubleLanes)) {}
};

}  // namespace

void DenseBlock::load(const openvdb::FloatGrid::ConstAccessor& accessor, const Coord& origin) {
  origin_ = origin;
  // Rows of a neighbour block: address of the first, and steps to the next one along x and y. The
  // rows of a constant block are one row.
  struct Rows {
    const float* first;
    int stepX, stepY;
  };
  std::array<float, 8> constants[27];
  Rows rows[27];
  for (int i = 0; i < 27; ++i) {
    const BlockValues values = blockValues(
        accessor, origin.offsetBy(8 * (i / 9) - 8, 8 * (i / 3 % 3) - 8, 8 * (i % 3) - 8));
    if (!values.values) constants[i].fill(values.constant);
    rows[i] = values.values ? Rows{values.values, 64, 8} : Rows{constants[i].data(), 0, 0};
  }
  // This is faster than copyPadded(), because the sizes of the copies are constants.
  static_assert(kPad == 4);
  float* out = values_.values.data();
  for (int x = -kPad; x < 8 + kPad; ++x)
    for (int y = -kPad; y < 8 + kPad; ++y, out += kSide) {
      const Rows* along = rows + ((x >> 3) + 1) * 9 + ((y >> 3) + 1) * 3;
      const auto row = [&](int i) {
        return along[i].first + (x & 7) * along[i].stepX + (y & 7) * along[i].stepY;
      };
      std::memcpy(out, row(0) + 4, 4 * sizeof(float));
      std::memcpy(out + 4, row(1), 8 * sizeof(float));
      std::memcpy(out + 12, row(2), 4 * sizeof(float));
    }
}

bool DenseBlock::changesSign(const std::array<int, 3>& low, const std::array<int, 3>& high) const {
  // Reads four values of each row at once, and ignores those outside the box. Reads nine rows, some
  // of them twice in a small box. So there are no branches, which would be taken at random.
  const int z = std::min(low[2], kSide - kPad - kLanes);
  const IntLanes place = IntLanes{0, 1, 2, 3} + z, isIn = (place >= low[2]) & (place <= high[2]);
  const float* first = values_.at(low[0], low[1], z);
  const std::ptrdiff_t lastX = (high[0] - low[0]) * std::ptrdiff_t{kSide * kSide},
                       lastY = (high[1] - low[1]) * std::ptrdiff_t{kSide};
  IntLanes any = {0, 0, 0, 0}, all = {-1, -1, -1, -1};
  for (const std::ptrdiff_t x : {std::ptrdiff_t{0}, std::ptrdiff_t{kSide * kSide}, lastX})
    for (const std::ptrdiff_t y : {std::ptrdiff_t{0}, std::ptrdiff_t{kSide}, lastY}) {
      const IntLanes inside = loadFour(first + x + y) < 0;
      any |= inside;
      all &= inside;
    }
  any &= isIn;
  all |= ~isIn;
  std::int64_t some[2], every[2];
  std::memcpy(some, &any, sizeof(any));
  std::memcpy(every, &all, sizeof(all));
  return (some[0] | some[1]) != 0 && (every[0] & every[1]) != -1;
}

Jet DenseBlock::jet(const Vec3d& p) const {
  const int cx = static_cast<int>(std::floor(p.x())), cy = static_cast<int>(std::floor(p.y())),
            cz = static_cast<int>(std::floor(p.z()));
  const Weights wx(p.x() - cx), wy(p.y() - cy), wz(p.z() - cz);
  const float* corner = values_.at(cx - 1, cy - 1, cz - 1);
  FloatLanes v[4], dx[4], dxx[4];  // rows along z, summed over x
  for (int j = 0; j < 4; ++j) {
    FloatLanes rows[4];
    for (int i = 0; i < 4; ++i) rows[i] = loadFour(corner + (i * kSide + j) * kSide);
    v[j] = combine(wx.w, rows);
    dx[j] = combine(wx.d, rows);
    dxx[j] = combine(wx.dd, rows);
  }
  const FloatLanes value = combine(wy.w, v), dy = combine(wy.d, v), dyy = combine(wy.dd, v);
  const FloatLanes gx = combine(wy.w, dx), gxy = combine(wy.d, dx), gxx = combine(wy.w, dxx);
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
  FloatLanes v[4], dx[4];
  for (int j = 0; j < 4; ++j) {
    FloatLanes rows[4];
    for (int i = 0; i < 4; ++i) rows[i] = loadFour(corner + (i * kSide + j) * kSide);
    v[j] = combine(wx.w, rows);
    dx[j] = combine(wx.d, rows);
  }
  const FloatLanes value = combine(wy.w, v), gx = combine(wy.w, dx), dy = combine(wy.d, v);
  jet.value = dot(wz.w, value);
  jet.gradient = Vec3d(dot(wz.w, gx), dot(wz.w, dy), dot(wz.d, value));
}

LEVELSET_AVX2_CLONE
void DenseBlock::jets(const Triple<DoubleLanes>& p, JetOf<DoubleLanes>& result) const {
  const LaneCells cells(p);
  FloatLanes value[4], dy[4], dyy[4], gx[4], gxy[4], gxx[4];
  for (int lane = 0; lane < kLanes; ++lane) {
    const WeightsOfLane xw{cells.wx.w, lane}, xd{cells.wx.d, lane}, xdd{cells.wx.dd, lane},
        yw{cells.wy.w, lane}, yd{cells.wy.d, lane}, ydd{cells.wy.dd, lane};
    const float* corner = values_.at(cells.x[lane] - 1, cells.y[lane] - 1, cells.z[lane] - 1);
    FloatLanes v[4], dx[4], dxx[4];  // rows along z, summed over x
    for (int j = 0; j < 4; ++j) {
      FloatLanes rows[4];
      for (int i = 0; i < 4; ++i) rows[i] = loadFour(corner + (i * kSide + j) * kSide);
      v[j] = combine(xw, rows);
      dx[j] = combine(xd, rows);
      dxx[j] = combine(xdd, rows);
    }
    value[lane] = combine(yw, v);
    dy[lane] = combine(yd, v);
    dyy[lane] = combine(ydd, v);
    gx[lane] = combine(yw, dx);
    gxy[lane] = combine(yd, dx);
    gxx[lane] = combine(yw, dxx);
  }
  for (auto* rows : {&value, &dy, &dyy, &gx, &gxy, &gxx}) transpose(*rows);
  const LaneWeights& wz = cells.wz;
  result.value = dot(wz.w, value);
  result.gradient = {dot(wz.w, gx), dot(wz.w, dy), dot(wz.d, value)};
  result.xx = dot(wz.w, gxx);
  result.yy = dot(wz.w, dyy);
  result.zz = dot(wz.dd, value);
  result.xy = dot(wz.w, gxy);
  result.xz = dot(wz.d, gx);
  result.yz = dot(wz.d, dy);
}

const DenseBlock& DenseBlockCache::around(const Vec3d& position) {
  return at(leafOrigin(position));
}

const DenseBlock& DenseBlockCache::at(const Coord& origin) {
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

LEVELSET_AVX2_CLONE
void DenseBlockCache::slopes(const Triple<DoubleLanes>& positions, JetOf<DoubleLanes>& result) {
  const IntLanes x = floorOf(positions.x) & ~7, y = floorOf(positions.y) & ~7,
                 z = floorOf(positions.z) & ~7;
  const LaneCells cells({positions.x - __builtin_convertvector(x, DoubleLanes),
                         positions.y - __builtin_convertvector(y, DoubleLanes),
                         positions.z - __builtin_convertvector(z, DoubleLanes)});
  FloatLanes value[4], dy[4], gx[4];
  for (int lane = 0; lane < kLanes; ++lane) {
    const WeightsOfLane xw{cells.wx.w, lane}, xd{cells.wx.d, lane}, yw{cells.wy.w, lane},
        yd{cells.wy.d, lane};
    const DenseBlock& block = at(Coord(x[lane], y[lane], z[lane]));
    const float* corner = block.values_.at(cells.x[lane] - 1, cells.y[lane] - 1, cells.z[lane] - 1);
    FloatLanes v[4], dx[4];
    for (int j = 0; j < 4; ++j) {
      FloatLanes rows[4];
      for (int i = 0; i < 4; ++i)
        rows[i] = loadFour(corner + (i * DenseBlock::kSide + j) * DenseBlock::kSide);
      v[j] = combine(xw, rows);
      dx[j] = combine(xd, rows);
    }
    value[lane] = combine(yw, v);
    dy[lane] = combine(yd, v);
    gx[lane] = combine(yw, dx);
  }
  for (auto* rows : {&value, &dy, &gx}) transpose(*rows);
  const LaneWeights& wz = cells.wz;
  result.value = dot(wz.w, value);
  result.gradient = {dot(wz.w, gx), dot(wz.w, dy), dot(wz.d, value)};
}

}  // namespace levelset::eikonal
