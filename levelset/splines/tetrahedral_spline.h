#pragma once

#include <array>
#include <concepts>
#include <type_traits>

#include "levelset/splines/bernstein_tetrahedron.h"

/// Splines on tetrahedra whose coefficients are weighted sums of the data of a grid. Positions are
/// in grid units: the datum (i, j, k) is at the position (i, j, k), and derivatives are per grid
/// spacing. Positions must stay within ±2²⁴.
namespace levelset {

/// Data of a grid at all whole numbers: sample(i, j, k). A function that has data on a box only is
/// extended by ExtendedGrid (grid_extension.h).
template <class Sample>
concept GridSample = std::invocable<const Sample&, int, int, int>;

/// Arithmetic of a spline: the type of its data.
template <GridSample Sample>
using SampleScalar = std::remove_cvref_t<std::invoke_result_t<const Sample&, int, int, int>>;

/// A tetrahedron of a periodic partition: its cell, and its number in the cell.
struct PartitionTetrahedron {
  std::array<int, 3> cell{};
  int index = 0;

  friend bool operator==(const PartitionTetrahedron&, const PartitionTetrahedron&) = default;
};

/// Partition of space into equal cells of tetrahedra. `vertices` and `barycentric` are in grid
/// units. `neighbour` returns the tetrahedron across the face opposite a vertex.
template <class Partition>
concept TetrahedralPartition = requires(const Partition& p, PartitionTetrahedron t,
                                        std::array<double, 3> x) {
  { Partition::kTetrahedra } -> std::convertible_to<int>;
  { p.locate(x) } -> std::same_as<PartitionTetrahedron>;
  { p.template vertices<double>(t) } -> std::same_as<std::array<std::array<double, 3>, 4>>;
  { p.template barycentric<double>(t) } -> std::same_as<BarycentricMap<4, double>>;
  { p.neighbour(t, 0) } -> std::same_as<PartitionTetrahedron>;
};

/// A partition, and the Bernstein coefficients of each tetrahedron as sums of the data around it.
template <class Spline>
concept TetrahedralSpline = TetrahedralPartition<Spline> &&
    requires(const Spline& s, PartitionTetrahedron t, double (*sample)(int, int, int)) {
  { s.coefficients(sample, t) } -> std::same_as<BernsteinTetrahedron<Spline::kDegree, double>>;
};

/// Value, gradient and second derivatives at a point, per grid spacing.
template <class Scalar>
struct PointDerivatives {
  Scalar value{};
  std::array<Scalar, 3> gradient{};
  std::array<std::array<Scalar, 3>, 3> hessian{};
};

/// Returns the value of a spline at a position in grid units.
template <class Spline, GridSample Sample>
SampleScalar<Sample> splineValue(const Spline& spline, const Sample& sample,
                                 const std::array<SampleScalar<Sample>, 3>& position) {
  using Scalar = SampleScalar<Sample>;
  const PartitionTetrahedron t = spline.locate(position);
  return spline.coefficients(sample, t).value(
      spline.template barycentric<Scalar>(t).coordinates(position));
}

/// Returns the value and its derivatives at a position in grid units. A derivative that jumps
/// between tetrahedra is that of the tetrahedron that locate() returns.
template <class Spline, GridSample Sample>
PointDerivatives<SampleScalar<Sample>> splineDerivatives(
    const Spline& spline, const Sample& sample,
    const std::array<SampleScalar<Sample>, 3>& position) {
  using Scalar = SampleScalar<Sample>;
  const PartitionTetrahedron t = spline.locate(position);
  const auto form = spline.coefficients(sample, t);
  const BarycentricMap<4, Scalar> map = spline.template barycentric<Scalar>(t);
  const auto weights = map.coordinates(position);
  return {form.value(weights), gradientAt(form, map, weights), hessianAt(form, map, weights)};
}

/// Returns the largest whole number that is not above x.
template <class Scalar>
int floorOf(const Scalar& x) {
  int n = static_cast<int>(x);
  while (x < Scalar(n)) --n;
  while (!(x < Scalar(n + 1))) ++n;
  return n;
}

}  // namespace levelset
