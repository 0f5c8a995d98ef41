#pragma once

// Quadrics for tests and benchmarks.

#include <Imath/ImathVec.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "render/quadrics/quadric.h"

namespace quadric_scenes {

using Imath::V3d;

/// Pseudo-random numbers that are equal on all machines.
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : state_(seed) {}
  /// The next number in [0, 1).
  double operator()() {
    state_ += 0x9e3779b97f4a7c15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }
  double between(double low, double high) { return low + (high - low) * (*this)(); }
  V3d unit() {
    const double z = between(-1, 1), angle = between(0, 2 * std::numbers::pi);
    const double r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }
  V3d inBox(double half) {
    const double x = between(-half, half), y = between(-half, half);
    return {x, y, between(-half, half)};
  }

 private:
  std::uint64_t state_;
};

/// A random quadric of a kind near a position.
/// @param ratio  largest ratio of the lengths of two axes
inline render::Quadric randomQuadric(render::QuadricKind kind, const V3d& position, double ratio,
                                     Numbers& numbers) {
  render::Quadric quadric;
  quadric.kind = kind;
  quadric.position = position;
  const V3d x = numbers.unit(), y = x.cross(numbers.unit()).normalized(), z = x.cross(y);
  const V3d frame[3] = {x, y, z};
  for (std::size_t n = 0; n < 3; ++n) quadric.axes[n] = frame[n] * std::pow(ratio, -numbers());
  quadric.axes[1] += quadric.axes[0] * numbers.between(-0.3, 0.3);  // not orthogonal
  quadric.range = render::defaultRange(kind);
  if (kind != render::QuadricKind::Ellipsoid) {
    quadric.range.low += numbers.between(-0.3, 0.3);
    quadric.range.high += numbers.between(-0.3, 0.3);
  }
  quadric.isCapped = numbers() < 0.6;
  quadric.colour = {static_cast<float>(numbers()), static_cast<float>(numbers()), 0.5f};
  return quadric;
}

/// Balls of equal density in a cube from −1 to 1: their mean distance decreases as their number
/// grows.
inline std::vector<render::Ball> ballsInCube(std::size_t count, Numbers& numbers) {
  const double radius = 0.5 * 2 / std::cbrt(static_cast<double>(count));
  std::vector<render::Ball> balls;
  balls.reserve(count);
  for (std::size_t n = 0; n < count; ++n) {
    const V3d centre = numbers.inBox(1);
    const auto of = static_cast<float>(radius * numbers.between(0.6, 1));
    const auto colour = static_cast<std::uint32_t>(numbers.between(0, 1 << 24));
    balls.push_back({centre, of, colour});
  }
  return balls;
}

/// Cylinders with the sizes of ballsInCube().
inline std::vector<render::Stick> sticksInCube(std::size_t count, Numbers& numbers) {
  const double length = 2 / std::cbrt(static_cast<double>(count));
  std::vector<render::Stick> sticks;
  sticks.reserve(count);
  for (std::size_t n = 0; n < count; ++n) {
    const V3d a = numbers.inBox(1), b = a + numbers.unit() * (length * numbers.between(0.7, 1.5));
    const auto radius = static_cast<float>(0.15 * length);
    sticks.push_back({a, b, radius, static_cast<std::uint32_t>(numbers.between(0, 1 << 24))});
  }
  return sticks;
}

}  // namespace quadric_scenes
