#pragma once

// Private to the ray casting of height fields: render/shaders/exact/height_rays.glsl as a C++
// class.

#include <bit>
#include <cmath>
#include <cstddef>

namespace render {

#define VAR double
#define RAY const HeightRay&
#define RAY_OUT HeightRay&
#define WALK HeightWalk&

/// Names a height field and its pyramid, whose data must outlive it.
struct HeightKernel {
  static constexpr double kNoRoot = 1e300;
  static constexpr double kMissing = 1e300;
  static constexpr double kSplitter = 134217729;
  static constexpr double kLeastSlope = 1e-200, kMostInverse = 1e200;
  static constexpr int kMostLevels = 32;

  const float* heights = nullptr;           ///< rows of samples; NaN: missing
  std::size_t columns = 0;                  ///< samples of a row
  const float* ranges = nullptr;            ///< lowest and highest height of each node
  std::size_t firstNode[kMostLevels] = {};  ///< first node of each level from 1 on
  int cellsU = 0, cellsV = 0, topLevel = 0;
  /// Cells that are left out; none if the last one is before the first one.
  int firstLeftOutU = 0, lastLeftOutU = -1, firstLeftOutV = 0, lastLeftOutV = -1;

  [[nodiscard]] double heightAt(int column, int row) {
    const float height =
        heights[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)];
    return std::isnan(height) ? kMissing : static_cast<double>(height);
  }
  [[nodiscard]] std::size_t nodeAt(int level, int i, int j) {
    return firstNode[level] +
           static_cast<std::size_t>(j) * static_cast<std::size_t>(nodesAlong(cellsU, level)) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] double lowestIn(int level, int i, int j) {
    return static_cast<double>(ranges[2 * nodeAt(level, i, j)]);
  }
  [[nodiscard]] double highestIn(int level, int i, int j) {
    return static_cast<double>(ranges[2 * nodeAt(level, i, j) + 1]);
  }
  [[nodiscard]] static int trailingOnes(int bits) {
    return std::countr_one(static_cast<unsigned>(bits));
  }

#include "render/shaders/exact/height_rays.glsl"
};

#undef VAR
#undef RAY
#undef RAY_OUT
#undef WALK

}  // namespace render
