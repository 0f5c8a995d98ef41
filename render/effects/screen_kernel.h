#pragma once

// Private to render/effects: render/shaders/effects/screen.glsl as a C++ class.

#include <cmath>
#include <cstddef>
#include <vector>

#include "render/effects/screen_pass.h"

namespace render {

#define VAR double
#define CONST_INT static constexpr int

/// Kernel of effects.
struct ScreenKernel {
  const ScreenTables& tables;
  const std::vector<float>& earlier;
  int width, height;
  bool isPerspective;

  ScreenKernel(const ScreenTables& tables_, const std::vector<float>& earlier_)
      : tables(tables_),
        earlier(earlier_),
        width(tables_.width),
        height(tables_.height),
        isPerspective(tables_.isPerspective) {}

  [[nodiscard]] std::size_t numberOf(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
  [[nodiscard]] double pixelDepth(int x, int y) const {
    return static_cast<double>(tables.pixels[4 * numberOf(x, y)]);
  }
  [[nodiscard]] double pixelNormal(int x, int y, int axis) const {
    return static_cast<double>(
        tables.pixels[4 * numberOf(x, y) + 1 + static_cast<std::size_t>(axis)]);
  }
  [[nodiscard]] double earlierAt(int x, int y) const {
    return static_cast<double>(earlier[numberOf(x, y)]);
  }
  [[nodiscard]] double number(int n) const { return tables.numbers[static_cast<std::size_t>(n)]; }
  [[nodiscard]] static double rootOf(double a) { return std::sqrt(a); }

#include "render/shaders/effects/screen.glsl"
};

#undef VAR
#undef CONST_INT

}  // namespace render
