#pragma once

#include <array>
#include <cmath>
#include <cstddef>

/// Polynomial interpolation at Chebyshev nodes, along one axis and over cubes of nodes.
namespace levelset::rbf {

template <std::size_t In, std::size_t Out>
/// Weights of the In input values in each of the Out output values: [output][input].
using NodeWeights = std::array<std::array<double, In>, Out>;

/// Chebyshev nodes of [−1, 1].
template <std::size_t Nodes>
const std::array<double, Nodes>& chebyshevNodes() {
  static const std::array<double, Nodes> nodes = [] {
    std::array<double, Nodes> result;
    for (std::size_t m = 0; m < Nodes; ++m)
      result[m] = -std::cos(M_PI * (2 * static_cast<double>(m) + 1) / (2 * Nodes));
    return result;
  }();
  return nodes;
}

/// Values at `at` of the Lagrange polynomials of the Chebyshev nodes, each of which is 1 at one
/// node and 0 at all other nodes.
template <std::size_t Nodes>
std::array<double, Nodes> lagrangeAt(double at) {
  const std::array<double, Nodes>& nodes = chebyshevNodes<Nodes>();
  std::array<double, Nodes> values;
  for (std::size_t m = 0; m < Nodes; ++m) {
    double product = 1;
    for (std::size_t j = 0; j < Nodes; ++j)
      if (j != m) product *= (at - nodes[j]) / (nodes[m] - nodes[j]);
    values[m] = product;
  }
  return values;
}

/// Weights that interpolate at each of the points `at` from the values at the Chebyshev nodes.
template <std::size_t Nodes, std::size_t Out>
NodeWeights<Nodes, Out> interpolation(const std::array<double, Out>& at) {
  NodeWeights<Nodes, Out> weights;
  for (std::size_t i = 0; i < Out; ++i) weights[i] = lagrangeAt<Nodes>(at[i]);
  return weights;
}

/// Applies the weights `a`, `b` and `c` along the three axes of a cube of In³ node values. Writes
/// Out³ values to `result`, the last axis fastest.
template <std::size_t In, std::size_t Out>
void transformCube(const NodeWeights<In, Out>& a, const NodeWeights<In, Out>& b,
                   const NodeWeights<In, Out>& c, const double* nodes, double* result) {
  std::array<double, Out * In * In> first;
  std::array<double, Out * Out * In> second;
  for (std::size_t i = 0; i < Out; ++i)
    for (std::size_t mn = 0; mn < In * In; ++mn) {
      double sum = 0;
      for (std::size_t l = 0; l < In; ++l) sum += a[i][l] * nodes[l * In * In + mn];
      first[i * In * In + mn] = sum;
    }
  for (std::size_t i = 0; i < Out; ++i)
    for (std::size_t j = 0; j < Out; ++j)
      for (std::size_t n = 0; n < In; ++n) {
        double sum = 0;
        for (std::size_t m = 0; m < In; ++m) sum += b[j][m] * first[(i * In + m) * In + n];
        second[(i * Out + j) * In + n] = sum;
      }
  for (std::size_t ij = 0; ij < Out * Out; ++ij)
    for (std::size_t k = 0; k < Out; ++k) {
      double sum = 0;
      for (std::size_t n = 0; n < In; ++n) sum += c[k][n] * second[ij * In + n];
      result[ij * Out + k] = sum;
    }
}

}  // namespace levelset::rbf
