#include "levelset/rbf/rbf_taylor.h"

#include <cmath>
#include <numeric>

namespace levelset::rbf {
namespace {

using Imath::M33d;
using Imath::V3d;

constexpr int kDegree = TaylorPolynomial::kDegree;
constexpr std::size_t kTerms = TaylorPolynomial::kTerms;
using TermIndex =
    std::array<std::array<std::array<std::size_t, kDegree + 1>, kDegree + 1>, kDegree + 1>;

std::array<TaylorPolynomial::Powers, kTerms> makePowers() {
  std::array<TaylorPolynomial::Powers, kTerms> powers{};
  std::size_t n = 0;
  for (int total = 0; total <= kDegree; ++total)
    for (int x = total; x >= 0; --x)
      for (int y = total - x; y >= 0; --y) powers[n++] = {x, y, total - x - y};
  return powers;
}
const std::array<TaylorPolynomial::Powers, kTerms> kPowersOfTerms = makePowers();

std::size_t& termAt(TermIndex& index, int x, int y, int z) {
  return index[static_cast<std::size_t>(x)][static_cast<std::size_t>(y)]
              [static_cast<std::size_t>(z)];
}

TermIndex makeTermIndex() {
  TermIndex index{};
  for (std::size_t n = 0; n < kTerms; ++n) {
    const auto& p = kPowersOfTerms[n];
    termAt(index, p.x, p.y, p.z) = n;
  }
  return index;
}
const TermIndex kTermIndex = makeTermIndex();

std::size_t termOf(int x, int y, int z) {
  return kTermIndex[static_cast<std::size_t>(x)][static_cast<std::size_t>(y)]
                   [static_cast<std::size_t>(z)];
}

constexpr std::size_t kNoTerm = kTerms;

/// Recurrence of one coefficient of the Taylor expansion of |x|: indices of the terms with one
/// power less and with two powers less of x, y and z, and the factors of their sums.
struct TermParents {
  std::array<std::size_t, 3> one, two;
  double firstShare = 0, secondShare = 0;
};

std::array<TermParents, kTerms> makeParents() {
  std::array<TermParents, kTerms> parents{};
  for (std::size_t n = 1; n < kTerms; ++n) {
    const auto& p = kPowersOfTerms[n];
    TermParents& at = parents[n];
    at.one = {p.x > 0 ? termOf(p.x - 1, p.y, p.z) : kNoTerm,
              p.y > 0 ? termOf(p.x, p.y - 1, p.z) : kNoTerm,
              p.z > 0 ? termOf(p.x, p.y, p.z - 1) : kNoTerm};
    at.two = {p.x > 1 ? termOf(p.x - 2, p.y, p.z) : kNoTerm,
              p.y > 1 ? termOf(p.x, p.y - 2, p.z) : kNoTerm,
              p.z > 1 ? termOf(p.x, p.y, p.z - 2) : kNoTerm};
    const double degree = p.total();
    at.firstShare = (3 - 2 * degree) / degree;
    at.secondShare = (3 - degree) / degree;
  }
  return parents;
}
const std::array<TermParents, kTerms> kParents = makeParents();

/// Bounds the remainder of the gradient of |x + s| beyond kDegree, a series in `ratio` = |s| / |x|.
/// The factor of (|s| / |x|)ⁿ is at most √((n + 1) / n). With t the cosine between x and s, this
/// factor is P_n(t) x̂ − P_{n−1}(t) ŝ. Its square is (1 − t²) (P_n² + (1 − t²) P_n′² / n²), and
/// P_n² + (1 − t²) P_n′² / (n (n + 1)) ≤ 1.
double gradientRest(double ratio) {
  const double squared = ratio * ratio;
  return std::sqrt((kDegree + 1.0) / kDegree) * squared * squared * ratio / (1 - ratio);
}

}  // namespace

const std::array<TaylorPolynomial::Powers, kTerms>& TaylorPolynomial::powers() {
  return kPowersOfTerms;
}

void TaylorPolynomial::addAffine(const V3d& value, const M33d& rows) {
  terms_[0] += value;
  for (int k = 0; k < 3; ++k) {
    terms_[1][k] += rows[k][0];
    terms_[2][k] += rows[k][1];
    terms_[3][k] += rows[k][2];
  }
}

// Applied to |x|, x·∇ gives |x| and r² ∇ gives x |x|. Together they give each Taylor coefficient
// from those of one and two degrees less.
void TaylorPolynomial::addDistance(const V3d& offset, const V3d& weight) {
  std::array<double, kTerms + 1> a;
  a[kNoTerm] = 0;
  const double squared = offset.length2(), inverse = 1 / squared;
  a[0] = std::sqrt(squared);
  for (std::size_t n = 1; n < kTerms; ++n) {
    const TermParents& parents = kParents[n];
    const double first =
        offset.x * a[parents.one[0]] + offset.y * a[parents.one[1]] + offset.z * a[parents.one[2]];
    const double second = a[parents.two[0]] + a[parents.two[1]] + a[parents.two[2]];
    a[n] = (parents.firstShare * first + parents.secondShare * second) * inverse;
  }
  for (std::size_t n = 0; n < kTerms; ++n) terms_[n] += weight * a[n];
}

void TaylorPolynomial::shift(const V3d& by) {
  for (int axis = 0; axis < 3; ++axis)
    for (int b = 0; b <= kDegree; ++b)
      for (int c = 0; b + c <= kDegree; ++c) {
        const auto term = [&](int k) -> V3d& {
          return terms_[axis == 0   ? termOf(k, b, c)
                        : axis == 1 ? termOf(b, k, c)
                                    : termOf(b, c, k)];
        };
        for (int from = 0, most = kDegree - b - c; from < most; ++from)
          for (int k = most - 1; k >= from; --k) term(k) += term(k + 1) * by[axis];
      }
}

V3d TaylorPolynomial::value(const V3d& s) const {
  V3d result(0);
  for (int x = kDegree; x >= 0; --x) {
    V3d alongY(0);
    for (int y = kDegree - x; y >= 0; --y) {
      V3d alongZ(0);
      for (int z = kDegree - x - y; z >= 0; --z) alongZ = alongZ * s.z + terms_[termOf(x, y, z)];
      alongY = alongY * s.y + alongZ;
    }
    result = result * s.x + alongY;
  }
  return result;
}

M33d TaylorPolynomial::slopes(const V3d& s) const {
  std::array<std::array<double, kDegree + 1>, 3> power;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    power[axis][0] = 1;
    for (std::size_t n = 1; n <= kDegree; ++n)
      power[axis][n] = power[axis][n - 1] * s[static_cast<int>(axis)];
  }
  M33d result(0, 0, 0, 0, 0, 0, 0, 0, 0);
  for (std::size_t n = 1; n < kTerms; ++n) {
    const Powers p = kPowersOfTerms[n];
    const std::array<std::size_t, 3> degree = {static_cast<std::size_t>(p.x),
                                               static_cast<std::size_t>(p.y),
                                               static_cast<std::size_t>(p.z)};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (degree[axis] == 0) continue;
      double value = static_cast<double>(degree[axis]) * power[axis][degree[axis] - 1];
      for (const std::size_t other : {(axis + 1) % 3, (axis + 2) % 3})
        value *= power[other][degree[other]];
      for (int k = 0; k < 3; ++k) result[k][static_cast<int>(axis)] += terms_[n][k] * value;
    }
  }
  return result;
}

RbfCubes::RbfCubes(const RbfFunction& function, const V3d& sizes, double tolerance)
    : particles_(function.particles().begin(), function.particles().end()),
      linear_(function.linearPart()),
      constant_(function.constantPart() * sizes) {
  // The map uses mean particle spacings as its unit, so the weights of the kernel r are divided by
  // the spacing to get world units.
  const double spacing = function.unit();
  double sum = 0;
  for (RbfParticle& particle : particles_) {
    particle.position *= spacing;
    particle.weight *= sizes / spacing;
    norms_.push_back(particle.weight.length());
    sum += norms_.back();
  }
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 3; ++axis) linear_[k][axis] *= sizes[k] / spacing;
  constexpr double kLargestRatio = 0.4;
  farRatio_ = kLargestRatio;
  while (sum * gradientRest(farRatio_) > tolerance) farRatio_ *= 0.95;
}

RbfCube RbfCubes::root(const V3d& center, double half) const {
  RbfCube cube;
  cube.center = center;
  cube.half = half;
  V3d value = constant_;
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 3; ++axis) value[k] += linear_[k][axis] * center[axis];
  cube.far.addAffine(value, linear_);
  std::vector<std::uint32_t> all(particles_.size());
  std::iota(all.begin(), all.end(), 0u);
  sumFar(cube, all);
  return cube;
}

RbfCube RbfCubes::octant(const RbfCube& cube, int bits) const {
  const double half = cube.half / 2;
  const V3d by(bits & 1 ? half : -half, bits & 2 ? half : -half, bits & 4 ? half : -half);
  RbfCube result;
  result.center = cube.center + by;
  result.half = half;
  result.far = cube.far;
  result.far.shift(by);
  result.slopeError = cube.slopeError;
  result.valueError = cube.valueError;
  sumFar(result, cube.near);
  return result;
}

void RbfCubes::sumFar(RbfCube& cube, std::span<const std::uint32_t> candidates) const {
  const double radius = cube.radius();
  for (const std::uint32_t i : candidates) {
    const V3d offset = cube.center - particles_[i].position;
    const double distance = offset.length();
    if (!(radius <= farRatio_ * distance)) {
      cube.near.push_back(i);
      continue;
    }
    const double error = norms_[i] * gradientRest(radius / distance);
    cube.slopeError += error;
    cube.valueError += error * radius;
    cube.far.addDistance(offset, particles_[i].weight);
  }
}

M33d RbfCubes::slopes(const RbfCube& cube, const V3d& point) const {
  M33d result = cube.far.slopes(point - cube.center);
  for (const std::uint32_t i : cube.near) {
    const V3d offset = point - particles_[i].position;
    const double distance = offset.length();
    if (distance == 0) continue;
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis)
        result[k][axis] += particles_[i].weight[k] * offset[axis] / distance;
  }
  return result;
}

V3d RbfCubes::value(const RbfCube& cube, const V3d& point) const {
  V3d result = cube.far.value(point - cube.center);
  for (const std::uint32_t i : cube.near)
    result += particles_[i].weight * (point - particles_[i].position).length();
  return result;
}

}  // namespace levelset::rbf
