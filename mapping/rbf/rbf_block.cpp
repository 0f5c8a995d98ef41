#include "mapping/rbf/rbf_block.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "levelset/rbf/sums/chebyshev.h"
#include "levelset/rbf/sums/rbf_sum.h"

namespace mapping {

using Imath::M33d;
using Imath::V3d;
using levelset::rbf::chebyshevNodes;
using levelset::rbf::interpolation;
using levelset::rbf::NodeWeights;
using levelset::rbf::RbfFunction;
using levelset::rbf::RbfParticle;
using levelset::rbf::RbfPoints;
using levelset::rbf::transformCube;

namespace {

constexpr std::size_t kNodes = 6;
constexpr std::size_t kCubeNodes = kNodes * kNodes * kNodes;
constexpr std::size_t kLeaf = GridBlock::kLeafEdge;

using ToNodes = NodeWeights<kNodes, kNodes>;

const std::array<double, kNodes>& kChebyshev = chebyshevNodes<kNodes>();

/// Weights that convert values at the Chebyshev nodes to coefficients of the Chebyshev polynomials
/// T_0 … T_5.
ToNodes makeToCoefficients() {
  ToNodes weights;
  for (std::size_t k = 0; k < kNodes; ++k)
    for (std::size_t m = 0; m < kNodes; ++m)
      weights[k][m] = (k == 0 ? 1.0 : 2.0) / kNodes *
                      std::cos(static_cast<double>(k) * std::acos(kChebyshev[m]));
  return weights;
}
const ToNodes kToCoefficients = makeToCoefficients();

NodeWeights<kNodes, kLeaf> makeToGridPoints() {
  std::array<double, kLeaf> at;
  for (std::size_t i = 0; i < kLeaf; ++i) at[i] = 2 * static_cast<double>(i) / (kLeaf - 1) - 1;
  return interpolation<kNodes>(at);
}
const NodeWeights<kNodes, kLeaf> kToGridPoints = makeToGridPoints();

/// Interpolation weights from the Chebyshev nodes of a block to those of its lower or upper half
/// along an axis.
ToNodes toHalf(int edge, bool isUpper) {
  const double half = (0.5 * edge - 1) / (edge - 1), middle = isUpper ? 1 - half : half - 1;
  std::array<double, kNodes> at;
  for (std::size_t m = 0; m < kNodes; ++m) at[m] = middle + half * kChebyshev[m];
  return interpolation<kNodes>(at);
}

/// Half the longest diagonal of the block's hull.
double radiusOf(const GridBlock& block) {
  const V3d a = block.row(0), b = block.row(1), c = block.row(2);
  const double longest = std::max(
      {(a + b + c).length2(), (a + b - c).length2(), (a - b + c).length2(), (a - b - c).length2()});
  return 0.5 * (block.edge - 1) * std::sqrt(longest);
}

// Lebesgue constant for six Chebyshev nodes.
constexpr double kLebesgue = 2.11;

/// Error bound of the polynomial for a particle of weight 1 at distance `gap` from the block's
/// hull, whose longest edge is 2 halfEdge. It is the smaller of a bound from the kernel's sixth
/// derivatives, and a bound from the values of a decaying kernel.
template <typename Kernel>
double farError(double halfEdge, double gap) {
  const double a = halfEdge / 2, squared = a * a;
  const double axis = 2 * squared * squared * squared * Kernel::sixth(gap);
  const double cube = axis * (1 + kLebesgue + kLebesgue * kLebesgue);
  return std::min(cube, Kernel::farBound(gap) * (1 + kLebesgue * kLebesgue * kLebesgue));
}

/// Bounds the difference between the kernel of a particle and its linear expansion around the
/// centre of a ball. The particle is at `distance` from the centre and has weight 1.
template <typename Kernel>
double beyondTangent(double distance, double radius) {
  const double lo = std::max(distance - radius, 0.0), hi = distance + radius;
  return std::min(2 * radius * Kernel::slopeBound(lo, hi),
                  0.5 * radius * radius * Kernel::bendBound(lo, hi));
}

/// Block in the map's own coordinates: in its unit of length, relative to the map's origin.
GridBlock scaled(const GridBlock& block, const V3d& origin, double unit) {
  GridBlock result = block;
  result.origin = (block.origin - origin) / unit;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result.rows[i][j] = block.rows[i][j] / unit;
  return result;
}

}  // namespace

RbfBlock::RbfBlock(const RbfFunction& function, const GridBlock& block, double tolerance)
    : function_(function),
      block_(scaled(block, function.origin(), function.unit())),
      tolerance_(tolerance) {
  const double half = 0.5 * (block.edge - 1);
  std::size_t n = 0;
  for (const double a : kChebyshev)
    for (const double b : kChebyshev)
      for (const double c : kChebyshev) {
        const V3d x =
            block_.center() + (block_.row(0) * a + block_.row(1) * b + block_.row(2) * c) * half;
        const V3d value = function.affine(x);
        for (std::size_t k = 0; k < 3; ++k) far_[k][n] = value[static_cast<int>(k)];
        ++n;
      }
  std::vector<std::uint32_t> all(function.particles().size());
  std::iota(all.begin(), all.end(), 0u);
  chooseFar(all);
}

RbfBlock::RbfBlock(const RbfBlock& parent, int bits)
    : function_(parent.function_),
      block_(parent.block_.octant(bits)),
      tolerance_(parent.tolerance_),
      error_(parent.error_) {
  const ToNodes lower = toHalf(parent.block_.edge, false), upper = toHalf(parent.block_.edge, true);
  for (std::size_t k = 0; k < 3; ++k)
    transformCube(bits & 4 ? upper : lower, bits & 2 ? upper : lower, bits & 1 ? upper : lower,
                  parent.far_[k].data(), far_[k].data());
  chooseFar(parent.near_);
}

void RbfBlock::chooseFar(std::span<const std::uint32_t> candidates) {
  if (!(tolerance_ > 0)) {
    near_.assign(candidates.begin(), candidates.end());
    return;
  }
  const std::vector<std::uint32_t> far =
      withKernel(function_.kernel(), [&](auto kernel) { return split(kernel, candidates); });
  if (!far.empty()) sumFar(far);
}

template <typename Kernel>
std::vector<std::uint32_t> RbfBlock::split(Kernel, std::span<const std::uint32_t> candidates) {
  const V3d center = block_.center();
  const double radius = radiusOf(block_), half = 0.5 * (block_.edge - 1);
  double halfEdge = 0;
  for (int i = 0; i < 3; ++i) halfEdge = std::max(halfEdge, half * block_.row(i).length());

  // The far particles are those with the smallest error bounds, as many as the tolerance allows for
  // their sum. A share of the tolerance is reserved for the octants. Error bounds are sorted only
  // by their power of two.
  constexpr int kPowers = 128;
  constexpr std::int8_t kNothing = -1;  // a particle that is too far to add anything
  std::array<double, kPowers> errors{};
  std::vector<std::int8_t> power(candidates.size());
  for (std::size_t n = 0; n < candidates.size(); ++n) {
    const std::uint32_t i = candidates[n];
    const double gap = (function_.particles()[i].position - center).length() - radius;
    if (gap > 0 && Kernel::farBound(gap) == 0) {
      power[n] = kNothing;
      continue;
    }
    const double error =
        gap > 0 ? function_.weightNorms()[i] * farError<Kernel>(halfEdge, gap) / tolerance_
                : HUGE_VAL;
    power[n] = static_cast<std::int8_t>(
        error < 1 ? std::clamp(std::ilogb(std::max(error, 1e-300)) + kPowers - 1, 0, kPowers - 2)
                  : kPowers - 1);
    if (error < 1) errors[static_cast<std::size_t>(power[n])] += error * tolerance_;
  }
  const double share = block_.edge == GridBlock::kLeafEdge ? 1 : 0.75;
  const double room = error_ + share * (tolerance_ - error_);
  int last = 0;
  for (; last < kPowers - 1 && error_ + errors[static_cast<std::size_t>(last)] <= room; ++last)
    error_ += errors[static_cast<std::size_t>(last)];

  std::vector<std::uint32_t> far;
  for (std::size_t n = 0; n < candidates.size(); ++n)
    if (power[n] != kNothing) (power[n] < last ? far : near_).push_back(candidates[n]);
  return far;
}

void RbfBlock::sumFar(std::span<const std::uint32_t> far) {
  const V3d center = block_.center();
  const double half = 0.5 * (block_.edge - 1);
  RbfPoints nodes(kCubeNodes);
  std::size_t n = 0;
  for (const double a : kChebyshev)
    for (const double b : kChebyshev)
      for (const double c : kChebyshev) {
        const V3d x = center + (block_.row(0) * a + block_.row(1) * b + block_.row(2) * c) * half;
        nodes.x[n] = x.x, nodes.y[n] = x.y, nodes.z[n] = x.z;
        ++n;
      }
  addRbfSums(function_.kernel(), function_.particles(), far, nodes);
  for (std::size_t i = 0; i < kCubeNodes; ++i) {
    far_[0][i] += nodes.u[i];
    far_[1][i] += nodes.v[i];
    far_[2][i] += nodes.w[i];
  }
}

Imath::Box3d RbfBlock::imageBounds() const {
  return withKernel(function_.kernel(), [&](auto kernel) { return boundsFor(kernel); });
}

template <typename Kernel>
Imath::Box3d RbfBlock::boundsFor(Kernel) const {
  const V3d center = block_.center();
  const double radius = radiusOf(block_), half = 0.5 * (block_.edge - 1);
  V3d value(0), remainder(error_);
  M33d gradient(0, 0, 0, 0, 0, 0, 0, 0, 0);
  for (const std::uint32_t i : near_) {
    const V3d offset = center - function_.particles()[i].position,
              weight = function_.particles()[i].weight;
    const double distance = offset.length();
    value += weight * Kernel::value(distance);
    const V3d slope = distance > 0 ? offset * (Kernel::slope(distance) / distance) : V3d(0);
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis) gradient[k][axis] += weight[k] * slope[axis];
    const double beyond = beyondTangent<Kernel>(distance, radius);
    for (int k = 0; k < 3; ++k) remainder[k] += std::abs(weight[k]) * beyond;
  }
  V3d extent = remainder;
  for (int k = 0; k < 3; ++k) {
    // |T_n| ≤ 1, so the magnitudes of the coefficients bound all terms except the constant and
    // linear ones.
    std::array<double, kCubeNodes> coefficients;
    transformCube(kToCoefficients, kToCoefficients, kToCoefficients,
                  far_[static_cast<std::size_t>(k)].data(), coefficients.data());
    constexpr std::array<std::size_t, 3> kSlopes = {kNodes * kNodes, kNodes, 1};
    value[k] += coefficients[0];
    for (std::size_t n = 1; n < kCubeNodes; ++n)
      if (std::find(kSlopes.begin(), kSlopes.end(), n) == kSlopes.end())
        extent[k] += std::abs(coefficients[n]);
    const V3d slope(gradient[k][0], gradient[k][1], gradient[k][2]);
    for (int i = 0; i < 3; ++i)
      extent[k] += std::abs(slope.dot(block_.row(i)) * half +
                            coefficients[kSlopes[static_cast<std::size_t>(i)]]);
  }
  return {value - extent, value + extent};
}

std::unique_ptr<BlockMap> RbfBlock::octant(int bits) const {
  return std::unique_ptr<BlockMap>(new RbfBlock(*this, bits));
}

std::size_t RbfBlock::evaluate(std::span<V3d, 512> uvw) const {
  RbfPoints points(uvw.size());
  transformCube(kToGridPoints, kToGridPoints, kToGridPoints, far_[0].data(), points.u.data());
  transformCube(kToGridPoints, kToGridPoints, kToGridPoints, far_[1].data(), points.v.data());
  transformCube(kToGridPoints, kToGridPoints, kToGridPoints, far_[2].data(), points.w.data());
  for (std::size_t n = 0; n < uvw.size(); ++n) {
    const V3d x = block_.origin + block_.row(0) * static_cast<double>(n >> 6) +
                  block_.row(1) * static_cast<double>((n >> 3) & 7) +
                  block_.row(2) * static_cast<double>(n & 7);
    points.x[n] = x.x, points.y[n] = x.y, points.z[n] = x.z;
  }
  addRbfSums(function_.kernel(), function_.particles(), near_, points);
  for (std::size_t n = 0; n < uvw.size(); ++n) uvw[n] = V3d(points.u[n], points.v[n], points.w[n]);
  return near_.size() * uvw.size();
}

}  // namespace mapping
