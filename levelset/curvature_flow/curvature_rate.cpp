#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstring>

#include "levelset/curvature_flow/curvature_rate_vdb.h"

namespace levelset::flow {
namespace {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));

// Below this squared slope |∇φ|² the direction of the gradient is not reliable.
constexpr float kFlat = 0.01f;
// Bound of the difference between the fourth-order and the second-order rate: a fraction of the
// second-order rate plus a constant in voxels⁻¹.
constexpr float kCorrectionShare = 0.3f, kCorrectionFloor = 0.02f;

Float4 load(const float* p) {
  Float4 v;
  std::memcpy(&v, p, sizeof(v));
  return v;
}

Float4 smaller(Float4 a, Float4 b) {
  return a < b ? a : b;
}
Float4 larger(Float4 a, Float4 b) {
  return a > b ? a : b;
}

/// First and second derivatives of four neighbouring grid points.
struct Derivatives {
  Float4 x, y, z, xx, yy, zz, xy, xz, yz;

  [[nodiscard]] Float4 squaredSlope() const { return x * x + y * y + z * z; }
  /// Returns κ|∇φ| = Δφ − n·Hn, with the unit normal n and the Hessian H.
  [[nodiscard]] Float4 rate() const {
    const Float4 along =
        x * x * xx + y * y * yy + z * z * zz + 2.0f * (x * y * xy + x * z * xz + y * z * yz);
    const Float4 tiny = {1e-12f, 1e-12f, 1e-12f, 1e-12f};
    return xx + yy + zz - along / larger(squaredSlope(), tiny);
  }
};

/// Computes central differences over `k` voxels to each side, second order.
template <int k>
Derivatives differences(const float* centre) {
  constexpr int sx = k * PaddedBlock::kStepX, sy = k * PaddedBlock::kStepY, sz = k;
  constexpr float first = 0.5f / k, second = 1.0f / (k * k), mixed = 0.25f / (k * k);
  const auto at = [&](int i, int j, int l) { return load(centre + i * sx + j * sy + l * sz); };
  const Float4 twice = 2.0f * load(centre);
  const Float4 x1 = at(1, 0, 0), x0 = at(-1, 0, 0), y1 = at(0, 1, 0), y0 = at(0, -1, 0),
               z1 = at(0, 0, 1), z0 = at(0, 0, -1);
  Derivatives d;
  d.x = first * (x1 - x0);
  d.y = first * (y1 - y0);
  d.z = first * (z1 - z0);
  d.xx = second * (x1 + x0 - twice);
  d.yy = second * (y1 + y0 - twice);
  d.zz = second * (z1 + z0 - twice);
  d.xy = mixed * (at(1, 1, 0) - at(1, -1, 0) - at(-1, 1, 0) + at(-1, -1, 0));
  d.xz = mixed * (at(1, 0, 1) - at(1, 0, -1) - at(-1, 0, 1) + at(-1, 0, -1));
  d.yz = mixed * (at(0, 1, 1) - at(0, 1, -1) - at(0, -1, 1) + at(0, -1, -1));
  return d;
}

/// Extrapolates differences over one and two voxels to fourth order (Richardson).
Derivatives combine(const Derivatives& one, const Derivatives& two) {
  const auto mix = [](Float4 a, Float4 b) { return (4.0f * a - b) * (1.0f / 3); };
  return {mix(one.x, two.x),   mix(one.y, two.y),   mix(one.z, two.z),
          mix(one.xx, two.xx), mix(one.yy, two.yy), mix(one.zz, two.zz),
          mix(one.xy, two.xy), mix(one.xz, two.xz), mix(one.yz, two.yz)};
}

/// Returns κ|∇φ| where the gradient has no direction: the sum of the eigenvalues of the Hessian
/// without the one of largest magnitude, whose eigenvector stands for the normal.
float rateWithoutNormal(const Derivatives& d, int lane) {
  Eigen::Matrix3f h;
  h << d.xx[lane], d.xy[lane], d.xz[lane], d.xy[lane], d.yy[lane], d.yz[lane], d.xz[lane],
      d.yz[lane], d.zz[lane];
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(h, Eigen::EigenvaluesOnly);
  const Eigen::Vector3f e = solver.eigenvalues();
  return std::abs(e[0]) > std::abs(e[2]) ? e[1] + e[2] : e[0] + e[1];
}

Float4 rateOfFour(const float* centre, float shift) {
  const Derivatives one = differences<1>(centre), both = combine(one, differences<2>(centre));
  Float4 rate = one.rate();
  const Float4 magnitude = larger(rate, -rate);
  const Float4 bound = kCorrectionShare * magnitude + kCorrectionFloor;
  rate += larger(-bound, smaller(bound, both.rate() - rate));
  const Float4 squared = one.squaredSlope();
  const Int4 flat = squared < kFlat;
  for (int lane = 0; lane < 4; ++lane)
    if (flat[lane]) rate[lane] = rateWithoutNormal(one, lane);
  if (shift != 0) {
    const Float4 slope = both.squaredSlope();
    for (int lane = 0; lane < 4; ++lane) rate[lane] -= shift * std::sqrt(slope[lane]);
  }
  return rate;
}

}  // namespace

void curvatureRate(const PaddedBlock& block, const BandBlocks::Mask& rows, float shift,
                   Values& rate) {
  for (int x = 0; x < 8; ++x) {
    const auto slice = rows.getWord<std::uint64_t>(static_cast<openvdb::Index>(x));
    for (int y = 0; y < 8; ++y)
      for (int half = 0; half < 2; ++half) {
        if (!(slice >> (8 * y + 4 * half) & 0xf)) continue;
        const Float4 four = rateOfFour(block.at(x, y, 4 * half), shift);
        std::memcpy(&rate[static_cast<std::size_t>(64 * x + 8 * y + 4 * half)], &four,
                    sizeof(four));
      }
  }
}

}  // namespace levelset::flow
