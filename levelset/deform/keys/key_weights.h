#pragma once

#include <cstddef>
#include <span>
#include <vector>

/// Interpolation of control points between key frames.
namespace levelset {

enum class KeyInterpolation {
  Linear,  ///< constant velocity between two keys
  /// Piecewise cubic with continuous velocity. At an inner key the velocity is that of the parabola
  /// through this key and its neighbours; at the first and the last key it is zero.
  Smooth
};

/// Share of a key in an interpolated value.
struct KeyWeight {
  std::size_t key = 0;
  double weight = 1;
};

/// Weights of the keys at a time. They sum to 1, and the key with the number
/// `result.front().key` has the base value of blendOf(). At the time of a key, before the first and
/// after the last, the result is that key alone.
/// @param times  times of the keys, ascending, not empty
[[nodiscard]] std::vector<KeyWeight> keyWeights(std::span<const double> times, double time,
                                                KeyInterpolation interpolation);

/// The motion from one key to the next as a Bézier curve in time: the weights of the keys in each
/// of its control values, two for linear motion, else four.
/// @param interval  number of the key at which it begins; not that of the last key
[[nodiscard]] std::vector<std::vector<KeyWeight>> motionWeights(std::span<const double> times,
                                                                std::size_t interval,
                                                                KeyInterpolation interpolation);

/// Interpolates a value that each key has. A value that is the same for all keys keeps its bits,
/// and so does that of a single key.
/// @param valueOf  value of the key with a number; a number or a vector
template <class ValueOf>
[[nodiscard]] auto blendOf(const std::vector<KeyWeight>& weights, const ValueOf& valueOf) {
  const auto base = valueOf(weights.front().key);
  auto sum = base;
  for (std::size_t i = 1; i < weights.size(); ++i)
    sum += (valueOf(weights[i].key) - base) * weights[i].weight;
  return sum;
}

}  // namespace levelset
