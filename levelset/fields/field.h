#pragma once

#include <Imath/ImathVec.h>

#include <functional>
#include <utility>

namespace levelset {

/// A number at each point of space (world units), or a vector at each point and time. The source is
/// a constant, an expression or a grid. Several threads may call it at once.
using ScalarField = std::function<double(const Imath::V3d& world)>;
using VectorField = std::function<Imath::V3d(const Imath::V3d& world, double time)>;

/// A point of a moving surface, or of a level set beside it.
struct SurfacePoint {
  Imath::V3d position = Imath::V3d(0);  ///< world units
  double time = 0;
  Imath::V3d normal = Imath::V3d(0);  ///< outward unit normal; zero where it is not defined
  double curvature = 0;  ///< k1 + k2, 1/world units; positive on a ball, where it is 2 / radius
};

/// Speed of a surface along its outward normal, world units per unit of time. Several threads may
/// call it at once. A flag that is false states that the speed does not depend on that argument, so
/// that the caller need not compute it.
struct NormalSpeed {
  std::function<double(const SurfacePoint&)> value = {};
  bool usesTime = true, usesNormal = true, usesCurvature = true;

  [[nodiscard]] explicit operator bool() const { return static_cast<bool>(value); }
};

/// Speed that depends only on the position.
[[nodiscard]] inline NormalSpeed speedOf(ScalarField field) {
  return {.value = [field = std::move(field)](const SurfacePoint& p) { return field(p.position); },
          .usesTime = false,
          .usesNormal = false,
          .usesCurvature = false};
}

/// An attribute of a surface: a scalar field, or a vector field taken at time 0. One of the two is
/// set.
struct Attribute {
  ScalarField scalar = {};
  VectorField vector = {};

  [[nodiscard]] explicit operator bool() const { return scalar || vector; }
};

}  // namespace levelset
