#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "render/bricks/surface_bricks_vdb.h"

namespace render {
namespace {

constexpr int kSiteBlock = BrickPool::kBlock, kSitesBefore = 2, kPointsAfter = 3;
constexpr int kSitePoints = kSiteBlock + kSitesBefore + kPointsAfter;
constexpr int kSitesOfAxis = 6;  // of one parity

/// A vector of three numbers, by index.
using SiteVector = std::array<float, 3>;

/// Range of the Bernstein coefficients of a cell, from values mean + difference · v.
struct SiteRange {
  float low = std::numeric_limits<float>::max(), high = std::numeric_limits<float>::lowest();

  void add(float value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  void add(float middle, float reach) {
    add(middle - reach);
    add(middle + reach);
  }
};

/// Numbers of the sites of a brick (BrickPool::kSites).
class BrickSites {
 public:
  explicit BrickSites(const std::vector<float>& numbers) : numbers_(numbers) {}

  /// Range in the cell (x, y, z) of the block. All vertices at which a coefficient takes the affine
  /// function of a site lie in the octahedron of the site.
  [[nodiscard]] SiteRange rangeOf(const std::array<int, 3>& cell) const {
    const int odd = oddAxis(cell);
    SiteRange range;
    if (odd < 0)
      addOctahedron(cell, range);
    else
      addBetween(cell, static_cast<std::size_t>(odd), range);
    return range;
  }

 private:
  struct Numbers {
    float mean;
    SiteVector difference;
  };
  [[nodiscard]] Numbers at(const std::array<int, 3>& site) const {
    const auto half = [](int n) { return static_cast<std::size_t>((n + 2) >> 1); };
    const std::size_t parity = site[0] & 1 ? 1 : 0;
    const float* v = numbers_.data() +
                     4 * (((parity * kSitesOfAxis + half(site[0])) * kSitesOfAxis + half(site[1])) *
                              kSitesOfAxis +
                          half(site[2]));
    return {v[0], {v[1], v[2], v[3]}};
  }
  /// The axis whose number has another parity than the two others, or −1.
  static int oddAxis(const std::array<int, 3>& cell) {
    const bool xy = ((cell[0] ^ cell[1]) & 1) == 0, yz = ((cell[1] ^ cell[2]) & 1) == 0;
    if (xy && yz) return -1;
    return yz ? 0 : xy ? 2 : 1;
  }
  /// A cell with a site: all tetrahedra of its octahedron, whose 14 neighbours count at the shared
  /// faces.
  void addOctahedron(const std::array<int, 3>& cell, SiteRange& range) const {
    const Numbers own = at(cell);
    SiteVector size;
    for (std::size_t a = 0; a < 3; ++a) size[a] = std::abs(own.difference[a]);
    std::sort(size.begin(), size.end());
    range.add(own.mean, size[2] + 0.5f * size[1]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int sign : {-1, 1}) {
        std::array<int, 3> other = cell;
        other[axis] += 2 * sign;
        const Numbers n = at(other);
        range.add(n.mean - static_cast<float>(sign) * n.difference[axis],
                  0.5f * std::max(std::abs(n.difference[(axis + 1) % 3]),
                                  std::abs(n.difference[(axis + 2) % 3])));
      }
    for (int corner = 0; corner < 8; ++corner) {
      std::array<int, 3> other = cell;
      SiteVector sign;
      for (std::size_t a = 0; a < 3; ++a) {
        sign[a] = corner >> a & 1 ? 1.0f : -1.0f;
        other[a] += corner >> a & 1 ? 1 : -1;
      }
      const Numbers n = at(other);
      SiteVector towards;
      for (std::size_t a = 0; a < 3; ++a) towards[a] = -sign[a] * n.difference[a];
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b)
          if (a != b) range.add(n.mean + towards[a] + 0.5f * towards[b]);
    }
  }
  /// A cell without a site: the tetrahedra of two octahedra that meet at a square in its middle,
  /// and those of four octahedra beside it.
  void addBetween(const std::array<int, 3>& cell, std::size_t along, SiteRange& range) const {
    const std::size_t second = (along + 1) % 3, third = (along + 2) % 3;
    for (const int sign : {-1, 1}) {
      std::array<int, 3> site = cell;
      site[along] += sign;
      const Numbers n = at(site);
      const float towards = -static_cast<float>(sign) * n.difference[along];
      const float b = std::abs(n.difference[second]), c = std::abs(n.difference[third]);
      range.add(n.mean);
      range.add(n.mean + towards, 0.5f * std::max(b, c));
      range.add(n.mean + 0.5f * towards, 0.5f * (b + c));
      range.add(n.mean + 0.75f * towards, 0.75f * std::max(b, c));
    }
    for (int corner = 0; corner < 4; ++corner) {
      std::array<int, 3> site = cell;
      const int signB = corner & 1 ? 1 : -1, signC = corner & 2 ? 1 : -1;
      site[second] += signB;
      site[third] += signC;
      const Numbers n = at(site);
      const float b = -static_cast<float>(signB) * n.difference[second],
                  c = -static_cast<float>(signC) * n.difference[third],
                  across = std::abs(n.difference[along]);
      range.add(n.mean);
      range.add(n.mean + 0.5f * (b + c), 0.5f * across);
      range.add(n.mean + 0.75f * (b + c));
      for (const auto& [first, other] : {std::pair{b, c}, std::pair{c, b}}) {
        range.add(n.mean + first + 0.25f * other, 0.25f * across);
        range.add(n.mean + first + 0.5f * other);
        range.add(n.mean + 0.75f * first, 0.75f * across);
        range.add(n.mean + first, 0.5f * across);
      }
    }
  }

  const std::vector<float>& numbers_;
};

}  // namespace

void fillSites(GridReader& grid, Brick& brick) {
  std::vector<float> points(std::size_t{kSitePoints} * kSitePoints * kSitePoints);
  grid.copyPadded(brick.origin, kSitesBefore, kPointsAfter, points.data());
  brick.value.resize(4 * BrickPool::kSites);
  brick.mask = {};
  const auto [least, largest] = std::minmax_element(points.begin(), points.end());
  if (*least >= 0 && *least > 0.125f * (*largest - *least)) return;
  if (*largest < 0 && -*largest > 0.125f * (*largest - *least)) return;
  std::size_t n = 0;
  for (int parity = 0; parity < 2; ++parity)
    for (int x = 0; x < kSitesOfAxis; ++x)
      for (int y = 0; y < kSitesOfAxis; ++y)
        for (int z = 0; z < kSitesOfAxis; ++z) {
          const float* first = points.data() +
                               ((2 * x + parity) * kSitePoints + 2 * y + parity) * kSitePoints +
                               2 * z + parity;
          std::array<double, 4> sum{};
          for (int corner = 0; corner < 8; ++corner) {
            const int i = corner >> 2, j = corner >> 1 & 1, k = corner & 1;
            const auto f = static_cast<double>(first[(i * kSitePoints + j) * kSitePoints + k]);
            sum[0] += f;
            sum[1] += i ? f : -f;
            sum[2] += j ? f : -f;
            sum[3] += k ? f : -f;
          }
          for (const double s : sum) brick.value[n++] = static_cast<float>(s / 8);
        }
  constexpr float kRounding = 1e-5f;  // of single precision here and in the kernel, with a margin
  const BrickSites sites(brick.value);
  const float room = kRounding * std::max(std::abs(*least), std::abs(*largest));
  for (int x = 0; x < kSiteBlock; ++x)
    for (int y = 0; y < kSiteBlock; ++y)
      for (int z = 0; z < kSiteBlock; ++z) {
        const SiteRange range = sites.rangeOf({x, y, z});
        const int bit = x << 6 | y << 3 | z;
        if (range.low < room && range.high >= -room)
          brick.mask[static_cast<std::size_t>(bit >> 5)] |= 1u << (bit & 31);
      }
}

}  // namespace render
