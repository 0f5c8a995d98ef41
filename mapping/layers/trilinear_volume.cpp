#include "mapping/layers/trilinear_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace mapping {
namespace {

using Imath::V3d;

// Bernstein coefficients of degree two in u, v and w. Coefficient i, j, k is at 9 i + 3 j + k.
using Bernstein = std::array<double, 27>;
constexpr std::array<std::size_t, 3> kBernsteinStep = {9, 3, 1};

/// Edge vectors of the image of the unit cube, world units. In along[axis][n], bits 0 and 1 of n
/// select the ends along the two axes that follow `axis`. longest[axis] is the largest length along
/// an axis.
struct CornerEdges {
  std::array<std::array<V3d, 4>, 3> along;
  std::array<double, 3> longest{};

  explicit CornerEdges(const std::array<V3d, 8>& corners) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t bit = 1u << axis, first = 1u << (axis + 1) % 3,
                        second = 1u << (axis + 2) % 3;
      for (std::size_t n = 0; n < 4; ++n) {
        const std::size_t low = (n & 1 ? first : 0) + (n & 2 ? second : 0);
        along[axis][n] = corners[low + bit] - corners[low];
        longest[axis] = std::max(longest[axis], along[axis][n].length());
      }
    }
  }
};

/// Bernstein coefficients of det(∂x/∂u, ∂x/∂v, ∂x/∂w). Along each axis, the derivatives along the
/// two other axes are linear. The middle Bernstein coefficient of the product of two linear
/// functions is the mean of the mixed products.
Bernstein coefficientsOf(const CornerEdges& edges, double hand) {
  Bernstein sums{};
  for (std::size_t u = 0; u < 4; ++u)      // edge along u; bits 0 and 1: ends along v, w
    for (std::size_t v = 0; v < 4; ++v)    // edge along v; bits 0 and 1: ends along w, u
      for (std::size_t w = 0; w < 4; ++w)  // edge along w; bits 0 and 1: ends along u, v
      {
        const std::size_t i = (v >> 1) + (w & 1), j = (u & 1) + (w >> 1), k = (u >> 1) + (v & 1);
        sums[9 * i + 3 * j + k] +=
            hand * edges.along[0][u].dot(edges.along[1][v].cross(edges.along[2][w]));
      }
  for (std::size_t n = 0; n < 27; ++n)
    for (const std::size_t degree : {n / 9, n / 3 % 3, n % 3})
      if (degree == 1) sums[n] /= 2;
  return sums;
}

/// Splits the polynomial at the middle of an axis by de Casteljau's algorithm, into a lower and an
/// upper half.
void halve(const Bernstein& whole, std::size_t axis, Bernstein& low, Bernstein& high) {
  const std::size_t step = kBernsteinStep[axis];
  for (std::size_t n = 0; n < 27; ++n) {
    if (n / step % 3 != 0) continue;
    const double a = whole[n], b = whole[n + step], c = whole[n + 2 * step];
    const double ab = 0.5 * (a + b), bc = 0.5 * (b + c), middle = 0.5 * (ab + bc);
    low[n] = a, low[n + step] = ab, low[n + 2 * step] = middle;
    high[n] = middle, high[n + step] = bc, high[n + 2 * step] = c;
  }
}

/// Axis along which neighbouring coefficients differ most.
std::size_t liveliestAxis(const Bernstein& values) {
  std::array<double, 3> change{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t n = 0; n < 27; ++n)
      if (n / kBernsteinStep[axis] % 3 != 2)
        change[axis] =
            std::max(change[axis], std::abs(values[n + kBernsteinStep[axis]] - values[n]));
  return static_cast<std::size_t>(std::max_element(change.begin(), change.end()) - change.begin());
}

struct BernsteinPiece {
  Bernstein values;
  V3d low, size;
};

}  // namespace

VolumeSign signOfTrilinear(const std::array<V3d, 8>& corners, double rounding, double hand,
                           std::size_t mostPieces) {
  const CornerEdges edges(corners);
  const auto& longest = edges.longest;
  // Rounding error bound of a coefficient: sums of eight triple products and their halvings, and
  // the errors of the corners.
  const double slack =
      64 * std::numeric_limits<double>::epsilon() * longest[0] * longest[1] * longest[2] +
      8 * rounding * (longest[0] * longest[1] + longest[1] * longest[2] + longest[2] * longest[0]);
  VolumeSign result;
  result.least = std::numeric_limits<double>::infinity();
  std::vector<BernsteinPiece> pieces = {{coefficientsOf(edges, hand), V3d(0), V3d(1)}};
  for (std::size_t n = 0; n < pieces.size(); ++n) {
    const BernsteinPiece piece = pieces[n];
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const V3d end(static_cast<double>(corner & 1), static_cast<double>(corner >> 1 & 1),
                    static_cast<double>(corner >> 2));
      const double value =
          piece.values[18 * (corner & 1) + 6 * (corner >> 1 & 1) + 2 * (corner >> 2)];
      if (!(value >= result.least)) result.least = value, result.at = piece.low + piece.size * end;
    }
    const auto [least, most] = std::minmax_element(piece.values.begin(), piece.values.end());
    const double volume = piece.size.x * piece.size.y * piece.size.z;
    if (*least > slack) continue;
    if (*most <= slack) {
      result.negative += volume;
    } else if (pieces.size() + 2 > mostPieces) {
      result.undecided += volume;
    } else {
      const std::size_t axis = liveliestAxis(piece.values);
      BernsteinPiece low{{}, piece.low, piece.size}, high = low;
      low.size[static_cast<int>(axis)] /= 2;
      high.size = low.size;
      high.low[static_cast<int>(axis)] += low.size[static_cast<int>(axis)];
      halve(piece.values, axis, low.values, high.values);
      pieces.push_back(low);
      pieces.push_back(high);
    }
  }
  result.pieces = pieces.size();
  result.folds = !(result.least > slack);
  return result;
}

}  // namespace mapping
