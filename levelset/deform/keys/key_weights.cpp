#include "levelset/deform/keys/key_weights.h"

#include <algorithm>
#include <array>

namespace levelset {
namespace {

/// Weights of the keys n − 1, n and n + 1 in the velocity at the inner key n: the slope of the
/// parabola through them.
std::array<double, 3> slopeWeights(std::span<const double> times, std::size_t n) {
  const double before = times[n] - times[n - 1], after = times[n + 1] - times[n];
  const double first = -after / (before * (before + after)),
               last = before / (after * (before + after));
  return {first, -first - last, last};
}

}  // namespace

std::vector<KeyWeight> keyWeights(std::span<const double> times, double time,
                                  KeyInterpolation interpolation) {
  const auto next =
      static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), time) - times.begin());
  if (next == 0) return {{0, 1}};
  const std::size_t n = next - 1;  // the last key at or before the time
  if (next == times.size() || times[n] == time) return {{n, 1}};
  const double length = times[next] - times[n], s = (time - times[n]) / length;
  if (interpolation == KeyInterpolation::Linear) return {{n, 1 - s}, {next, s}};
  // Cubic Hermite polynomials.
  const double rise = s * s * (3 - 2 * s), begin = length * s * (1 - s) * (1 - s),
               end = -length * s * s * (1 - s);
  std::array<double, 4> weights = {0, 1 - rise, rise, 0};  // of the keys n − 1 to n + 2
  if (n > 0) {
    const std::array<double, 3> slope = slopeWeights(times, n);
    for (std::size_t i = 0; i < 3; ++i) weights[i] += begin * slope[i];
  }
  if (next + 1 < times.size()) {
    const std::array<double, 3> slope = slopeWeights(times, next);
    for (std::size_t i = 0; i < 3; ++i) weights[i + 1] += end * slope[i];
  }
  std::vector<KeyWeight> all = {{n, weights[1]}, {next, weights[2]}};
  if (n > 0) all.push_back({n - 1, weights[0]});
  if (next + 1 < times.size()) all.push_back({next + 1, weights[3]});
  return all;
}

std::vector<std::vector<KeyWeight>> motionWeights(std::span<const double> times,
                                                  std::size_t interval,
                                                  KeyInterpolation interpolation) {
  const std::size_t next = interval + 1;
  if (interpolation == KeyInterpolation::Linear) return {{{interval, 1}}, {{next, 1}}};
  // The inner control values of a cubic lie a third of the interval along its end velocities.
  const double third = (times[next] - times[interval]) / 3;
  const auto along = [&](std::size_t key, double length) {
    std::vector<KeyWeight> weights{{key, 1}};
    if (key == 0 || key + 1 == times.size()) return weights;  // no velocity
    const std::array<double, 3> slope = slopeWeights(times, key);
    weights[0].weight += length * slope[1];
    weights.push_back({key - 1, length * slope[0]});
    weights.push_back({key + 1, length * slope[2]});
    return weights;
  };
  return {{{interval, 1}}, along(interval, third), along(next, -third), {{next, 1}}};
}

}  // namespace levelset
