#pragma once

// Private to the ray casting of quadrics: render/shaders/exact/quadrics.glsl as a C++ class.

#include <cmath>

namespace render {

#define VAR double
#define CONST_INT static constexpr int

struct QuadricKernel {
  static constexpr double kNoRoot = 1e300;
  [[nodiscard]] static double rootOf(double a) { return std::sqrt(a); }

#include "render/shaders/exact/quadrics.glsl"
};

#undef VAR
#undef CONST_INT

}  // namespace render
