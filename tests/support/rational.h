#pragma once

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstdint>

/// Exact rational arithmetic and random data for tests of splines.
namespace support {

using Rational = boost::multiprecision::number<boost::multiprecision::cpp_rational_backend,
                                               boost::multiprecision::et_off>;

/// Returns a random whole number from −50 to 50 that depends on the arguments only.
inline int randomWhole(int seed, int i, int j = 0, int k = 0) {
  std::uint64_t x = 0x9e3779b97f4a7c15U;
  for (const int n : {seed, i, j, k}) {
    x ^= static_cast<std::uint64_t>(static_cast<std::uint32_t>(n));
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
    x ^= x >> 31;
  }
  return static_cast<int>(x % 101) - 50;
}

/// Random data of a grid: sample(i, j, k).
template <class Scalar = Rational>
struct RandomGrid {
  int seed = 1;
  Scalar operator()(int i, int j, int k) const {
    return Scalar(randomWhole(seed, i, j, k)) / Scalar(7);
  }
};

/// Returns random coordinates that sum to `sum`: barycentric coordinates of a point for 1, of a
/// direction for 0.
template <class Scalar, int Vertices>
std::array<Scalar, Vertices> randomWeights(int seed, int sum) {
  std::array<Scalar, Vertices> weights;
  weights[0] = Scalar(sum);
  for (int v = 1; v < Vertices; ++v) {
    weights[v] = Scalar(randomWhole(seed, v)) / Scalar(60);
    weights[0] -= weights[v];
  }
  return weights;
}

}  // namespace support
