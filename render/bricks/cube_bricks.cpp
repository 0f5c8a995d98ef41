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

/// The 27 data around each cube of a row.
struct CubeData {
  std::array<CubeRow, 27> rows;

  [[nodiscard]] const CubeRow& at(const std::array<int, 3>& offset) const {
    return rows[static_cast<std::size_t>(9 * (offset[0] + 1) + 3 * (offset[1] + 1) + offset[2] +
                                         1)];
  }
};

CubeRow scaled(CubeRow row, float factor) {
  for (float& v : row.v) v *= factor;
  return row;
}

/// The same as levelset::CubicC1Spline::determiningSet(), with sums that are computed once.
levelset::CubicDeterminingSet<CubeRow> cubicSet(const CubeData& data) {
  // Sums of the data at 0 or a sign along two axes, at a height of −1, 0 or 1 along the third.
  std::array<std::array<std::array<std::array<CubeRow, 3>, 2>, 2>, 3> around;
  for (int axis = 0; axis < 3; ++axis)
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b)
        for (int height = -1; height <= 1; ++height) {
          CubeRow& sum = around[static_cast<std::size_t>(axis)][static_cast<std::size_t>(a)]
                               [static_cast<std::size_t>(b)][static_cast<std::size_t>(height + 1)];
          for (int n = 0; n < 4; ++n) {
            std::array<int, 3> offset{};
            offset[static_cast<std::size_t>(axis)] = height;
            offset[static_cast<std::size_t>((axis + 1) % 3)] = n & 1 ? 2 * a - 1 : 0;
            offset[static_cast<std::size_t>((axis + 2) % 3)] = n & 2 ? 2 * b - 1 : 0;
            sum += data.at(offset);
          }
        }
  const auto aroundAt = [&](std::size_t axis, const std::array<int, 3>& s,
                            int height) -> const CubeRow& {
    return around[axis][s[(axis + 1) % 3] > 0 ? 1 : 0][s[(axis + 2) % 3] > 0 ? 1 : 0]
                 [static_cast<std::size_t>(height + 1)];
  };
  levelset::CubicDeterminingSet<CubeRow> set;
  overSigns([&](const std::array<int, 3>& s) {
    const auto corner = static_cast<std::size_t>(set.cornerOf(s));
    set.corners[corner] = scaled(aroundAt(2, s, 0) + aroundAt(2, s, s[2]), 1.0f / 8);
    for (std::size_t along = 0; along < 3; ++along)
      set.edges[corner][along] = scaled(aroundAt(along, s, 0), 5.0f / 24) +
                                 scaled(aroundAt(along, s, s[along]), 1.0f / 24);
  });
  for (std::size_t along = 0; along < 3; ++along) {
    const std::size_t a = (along + 1) % 3, b = (along + 2) % 3;
    for (int n = 0; n < 4; ++n) {
      std::array<int, 3> s{};
      s[a] = n & 1 ? 1 : -1;
      s[b] = n & 2 ? 1 : -1;
      const CubeRow fours = scaled(aroundAt(along, s, 0), 14.0f / 96) +
                            scaled(aroundAt(along, s, 1) + aroundAt(along, s, -1), 1.0f / 96);
      for (const auto& [face, other] : {std::array{a, b}, std::array{b, a}}) {
        std::array<int, 3> middle{}, up{}, down{};
        up[along] = 1;
        down[along] = -1;
        CubeRow near = data.at(middle), beside = data.at(up) + data.at(down);
        middle[face] = up[face] = down[face] = s[face];
        near += data.at(middle);
        beside += data.at(up) + data.at(down);
        const auto axis = static_cast<int>(face), edgeAxis = static_cast<int>(other);
        set.centroids[static_cast<std::size_t>(set.faceOf(axis, s[face]))]
                     [static_cast<std::size_t>(set.faceOf(edgeAxis, s[other]))] =
            fours + scaled(near, 12.0f / 96) + scaled(beside, 2.0f / 96);
      }
    }
  }
  return set;
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
      CubeData around;
      for (int n = 0; n < 27; ++n)
        std::copy_n(data + first + (n / 9 * kData + n / 3 % 3) * kData + n % 3, kCubes,
                    around.rows[static_cast<std::size_t>(n)].v.begin());
      const auto sample = [&](int i, int j, int k) { return around.at({i, j, k}); };
      const CoefficientRange range =
          filter == Filter::CubicC1
              ? rangeOf(cubicSet(around))
              : rangeOf(levelset::QuadraticSuperSpline::determiningSet(sample, {0, 0, 0}));
      for (std::size_t z = 0; z < kCubes; ++z)
        if (!(range.low.v[z] < room[z] && range.high.v[z] >= -room[z])) open &= ~(1u << z);
      const unsigned bit = static_cast<unsigned>(x << 6 | y << 3);
      brick.mask[bit >> 5] |= open << (bit & 31);
    }
}

}  // namespace render
