#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "levelset/splines/cubic_c1_spline.h"
#include "levelset/splines/quadratic_super_spline.h"
#include "render/bricks/surface_bricks_vdb.h"

namespace render {
namespace {

constexpr int kCubes = BrickPool::kBlock, kData = BrickPool::kCubeEdge;

/// Numbers of a row of cubes along z.
struct CubeRow {
  std::array<float, kCubes> v{};

  CubeRow() = default;
  explicit CubeRow(int all) { v.fill(static_cast<float>(all)); }

  CubeRow& operator+=(const CubeRow& b) {
    return apply(b, [](float& x, float y) { x += y; });
  }
  CubeRow& operator-=(const CubeRow& b) {
    return apply(b, [](float& x, float y) { x -= y; });
  }
  CubeRow& operator*=(const CubeRow& b) {
    return apply(b, [](float& x, float y) { x *= y; });
  }
  CubeRow& operator/=(const CubeRow& b) {
    return apply(b, [](float& x, float y) { x /= y; });
  }
  friend CubeRow operator+(CubeRow a, const CubeRow& b) { return a += b; }
  friend CubeRow operator-(CubeRow a, const CubeRow& b) { return a -= b; }
  friend CubeRow operator*(CubeRow a, const CubeRow& b) { return a *= b; }
  friend CubeRow operator/(CubeRow a, const CubeRow& b) { return a /= b; }
  friend CubeRow operator-(const CubeRow& a) { return CubeRow(0) - a; }

 private:
  template <typename Work>
  CubeRow& apply(const CubeRow& b, const Work& work) {
    for (std::size_t z = 0; z < v.size(); ++z) work(v[z], b.v[z]);
    return *this;
  }
};

/// Ranges of the Bernstein coefficients in the cubes of a row.
struct CoefficientRange {
  CubeRow low, high;

  CoefficientRange() {
    low.v.fill(std::numeric_limits<float>::max());
    high.v.fill(std::numeric_limits<float>::lowest());
  }
  void add(const CubeRow& b) {
    for (std::size_t z = 0; z < b.v.size(); ++z) {
      low.v[z] = std::min(low.v[z], b.v[z]);
      high.v[z] = std::max(high.v[z], b.v[z]);
    }
  }
};

template <typename Use>
void overSigns(const Use& use) {
  for (int n = 0; n < 8; ++n)
    use(std::array<int, 3>{n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1});
}

/// All coefficients are means of those that are visited here.
CoefficientRange rangeOf(const levelset::QuadraticDeterminingSet<CubeRow>& set) {
  CoefficientRange range;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if ((x == 0) + (y == 0) + (z == 0) < 2) range.add(set.at({x, y, z}));
  overSigns([&](const std::array<int, 3>& s) { range.add(set.spoke(s)); });
  return range;
}

CoefficientRange rangeOf(const levelset::CubicDeterminingSet<CubeRow>& set) {
  CoefficientRange range;
  for (const CubeRow& b : set.corners) range.add(b);
  for (const auto& edges : set.edges)
    for (const CubeRow& b : edges) range.add(b);
  for (int face = 0; face < 6; ++face)
    for (int other = 0; other < 6; ++other)
      if (face / 2 != other / 2)
        range.add(set.centroids[static_cast<std::size_t>(face)][static_cast<std::size_t>(other)]);
  overSigns([&](const std::array<int, 3>& s) {
    range.add(set.spoke(s));
    range.add(set.innerSpoke(s));
    for (int along = 0; along < 3; ++along)
      if (s[static_cast<std::size_t>(along)] > 0) range.add(set.besideEdge(s, along));
  });
  return range;
}

}  // namespace

void fillCubes(GridReader& grid, Filter filter, Brick& brick) {
  brick.value.resize(BrickPool::kCubeValues);
  grid.copyPadded(brick.origin, 1, 1, brick.value.data());
  brick.mask = {};
  const float* data = brick.value.data();
  // Least and largest datum of the 27 around each cube, axis by axis.
  std::array<std::array<float, BrickPool::kCubeValues>, 2> most;
  std::copy(brick.value.begin(), brick.value.end(), most[0].begin());
  most[1] = most[0];
  for (const int step : {1, kData, kData * kData})
    for (int n = 0; n + 2 * step < BrickPool::kCubeValues; ++n) {
      const auto i = static_cast<std::size_t>(n), j = static_cast<std::size_t>(n + step),
                 k = static_cast<std::size_t>(n + 2 * step);
      most[0][i] = std::min({most[0][i], most[0][j], most[0][k]});
      most[1][i] = std::max({most[1][i], most[1][j], most[1][k]});
    }
  constexpr float kRounding = 1e-5f;  // of single precision here and in the kernel, with a margin
  for (int x = 0; x < kCubes; ++x)
    for (int y = 0; y < kCubes; ++y) {
      const int first = (x * kData + y) * kData;
      std::array<float, kCubes> room;
      unsigned open = 0;
      for (int z = 0; z < kCubes; ++z) {
        const auto n = static_cast<std::size_t>(first + z);
        const float low = most[0][n], high = most[1][n];
        // Negative weights of the quadratic super spline have a sum of at most 1/16.
        const float widening = filter == Filter::SuperQuadratic ? (high - low) / 16 : 0;
        const float around = kRounding * std::max(std::abs(low), std::abs(high));
        room[static_cast<std::size_t>(z)] = around;
        if (low - widening < around && high + widening >= -around) open |= 1u << z;
      }
      if (open == 0) continue;
      const auto sample = [&](int i, int j, int k) {
        CubeRow row;
        std::copy_n(data + first + ((i + 1) * kData + j + 1) * kData + k + 1, kCubes,
                    row.v.begin());
        return row;
      };
      const CoefficientRange range =
          filter == Filter::CubicC1
              ? rangeOf(levelset::CubicC1Spline::determiningSet(sample, {0, 0, 0}))
              : rangeOf(levelset::QuadraticSuperSpline::determiningSet(sample, {0, 0, 0}));
      for (std::size_t z = 0; z < kCubes; ++z)
        if (!(range.low.v[z] < room[z] && range.high.v[z] >= -room[z])) open &= ~(1u << z);
      const unsigned bit = static_cast<unsigned>(x << 6 | y << 3);
      brick.mask[bit >> 5] |= open << (bit & 31);
    }
}

}  // namespace render
