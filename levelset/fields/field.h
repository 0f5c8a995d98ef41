#pragma once

#include <Imath/ImathVec.h>

#include <functional>

namespace levelset {

/// A number at each point of space (world units), or a vector at each point and time. The source is
/// a constant, an expression or a grid. Several threads may call it at once.
using ScalarField = std::function<double(const Imath::V3d& world)>;
using VectorField = std::function<Imath::V3d(const Imath::V3d& world, double time)>;

/// An attribute of a surface: a scalar field, or a vector field taken at time 0. One of the two is
/// set.
struct Attribute {
  ScalarField scalar = {};
  VectorField vector = {};

  [[nodiscard]] explicit operator bool() const { return scalar || vector; }
};

}  // namespace levelset
