#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/splines/cubic_c1_spline.h"
#include "levelset/splines/quadratic_super_spline.h"
#include "render/bricks/surface_bricks_vdb.h"

namespace render {
namespace {

constexpr int kCubes = BrickPool::kBlock, kData = BrickPool::kCubeEdge;

/// Range of the Bernstein coefficients in a cube.
struct CoefficientRange {
  double low = HUGE_VAL, high = -HUGE_VAL;
  void add(double b) {
    low = std::min(low, b);
    high = std::max(high, b);
  }
};

template <typename Use>
void overSigns(const Use& use) {
  for (int n = 0; n < 8; ++n)
    use(std::array<int, 3>{n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1});
}

/// All coefficients are means of those that are visited here.
CoefficientRange rangeOf(const levelset::QuadraticDeterminingSet<double>& set) {
  CoefficientRange range;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if ((x == 0) + (y == 0) + (z == 0) < 2) range.add(set.at({x, y, z}));
  overSigns([&](const std::array<int, 3>& s) { range.add(set.spoke(s)); });
  return range;
}

CoefficientRange rangeOf(const levelset::CubicDeterminingSet<double>& set) {
  CoefficientRange range;
  for (const double b : set.corners) range.add(b);
  for (const auto& edges : set.edges)
    for (const double b : edges) range.add(b);
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
  const auto at = [data](int x, int y, int z) {
    return data[((x + 1) * kData + y + 1) * kData + z + 1];
  };
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
  constexpr double kRounding = 1e-5;  // of single precision in the kernel, with a margin
  for (int x = 0; x < kCubes; ++x)
    for (int y = 0; y < kCubes; ++y)
      for (int z = 0; z < kCubes; ++z) {
        const auto n = static_cast<std::size_t>((x * kData + y) * kData + z);
        const auto low = static_cast<double>(most[0][n]), high = static_cast<double>(most[1][n]);
        // Negative weights of the quadratic super spline have a sum of at most 1/16.
        const double widening = filter == Filter::SuperQuadratic ? (high - low) / 16 : 0;
        const double room = kRounding * std::max(std::abs(low), std::abs(high));
        if (low - widening >= room || high + widening < -room) continue;
        const auto sample = [&](int i, int j, int k) { return static_cast<double>(at(i, j, k)); };
        const CoefficientRange range =
            filter == Filter::CubicC1
                ? rangeOf(levelset::CubicC1Spline::determiningSet(sample, {x, y, z}))
                : rangeOf(levelset::QuadraticSuperSpline::determiningSet(sample, {x, y, z}));
        if (range.low >= room || range.high < -room) continue;
        const unsigned bit = static_cast<unsigned>(x << 6 | y << 3 | z);
        brick.mask[bit >> 5] |= 1u << (bit & 31);
      }
}

}  // namespace render
