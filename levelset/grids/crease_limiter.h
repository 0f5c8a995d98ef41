#pragma once

// Crease limiter for tricubic interpolation of distances, for the .cpp files of this library. The
// slope of a distance jumps in the middle of a thin wall and on the bisector inside an edge of the
// solid. Samples beyond such a crease would falsify the interpolant.

#include <array>
#include <cmath>

namespace levelset {

/// Second difference, in voxels, above which a sample may lie beyond a crease.
inline constexpr double kCreaseBend = 0.3;
/// The first or last of four samples on a line counts as beyond a crease only if the second
/// difference at its end exceeds that at the other end by this factor. On a smooth curved surface
/// the factor is never reached.
inline constexpr float kCreaseOneSided = 3;

/// Limits four consecutive samples on a line. If an outer one (v0 or v3) lies beyond a crease,
/// replaces it by parabolic extrapolation of the other three.
/// @param bendLimit  kCreaseBend in the units of the samples
inline void limitAtCrease(float& v0, float v1, float v2, float& v3, float bendLimit) {
  const float before = v0 - 2 * v1 + v2, after = v1 - 2 * v2 + v3;
  if (std::abs(before) > bendLimit && std::abs(before) > kCreaseOneSided * std::abs(after))
    v0 = 3 * (v1 - v2) + v3;
  else if (std::abs(after) > bendLimit && std::abs(after) > kCreaseOneSided * std::abs(before))
    v3 = 3 * (v2 - v1) + v0;
}

/// Returns true when a second difference along the lines of a cell's 4³ samples (x slowest) exceeds
/// `bendLimit`. The loops have no branches, so that the compiler vectorises them: almost all cells
/// have no crease and need only this test.
inline bool bendsMoreThan(const std::array<float, 64>& s, float bendLimit) {
  int bent = 0;
  const auto look = [&](std::size_t i, std::size_t step) {
    bent |= static_cast<int>(std::abs(s[i] - 2 * s[i + step] + s[i + 2 * step]) > bendLimit);
  };
  for (std::size_t i = 0; i < 32; ++i) look(i, 16);
  for (std::size_t x = 0; x < 64; x += 16)
    for (std::size_t i = 0; i < 8; ++i) look(x + i, 4);
  for (std::size_t i = 0; i < 64; i += 4) look(i, 1), look(i + 1, 1);
  return bent != 0;
}

/// Replaces the samples beyond creases in a cell's 4³ samples (x slowest), line by line, as
/// essentially non-oscillatory schemes choose their stencils [Harten87]. The interpolant on the
/// face between two cells depends only on the samples in its plane. Both cells therefore agree
/// there, and the interpolant stays continuous.
/// @param bendLimit  kCreaseBend in the units of the samples
inline void limitAtCreases(std::array<float, 64>& s, float bendLimit) {
  if (!bendsMoreThan(s, bendLimit)) return;
  for (std::size_t i = 0; i < 16; ++i)
    limitAtCrease(s[i], s[i + 16], s[i + 32], s[i + 48], bendLimit);
  for (std::size_t i = 0; i < 16; ++i) {
    float* line = &s[(i / 4) * 16 + i % 4];
    limitAtCrease(line[0], line[4], line[8], line[12], bendLimit);
  }
  for (std::size_t i = 0; i < 16; ++i) {
    float* line = &s[4 * i];
    limitAtCrease(line[0], line[1], line[2], line[3], bendLimit);
  }
}

}  // namespace levelset
