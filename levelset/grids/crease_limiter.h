#pragma once

// For our own .cpp files: tricubic interpolation of distances, whose slope jumps at the middle of a
// thin wall and inside an edge.

#include <array>
#include <cmath>

namespace levelset {

/// Second difference, voxels, from which on a sample may lie beyond a kink …
inline constexpr double kCreaseBend = 0.3;
/// … which it does if there is so much less of it on the other side: never on a curved surface.
inline constexpr float kCreaseOneSided = 3;

/// Replaces the outer one of four samples that lies beyond a kink by what the others go on to.
inline void limitAtCrease(float& v0, float v1, float v2, float& v3, float kink) {
  const float before = v0 - 2 * v1 + v2, after = v1 - 2 * v2 + v3;
  if (std::abs(before) > kink && std::abs(before) > kCreaseOneSided * std::abs(after))
    v0 = 3 * (v1 - v2) + v3;
  else if (std::abs(after) > kink && std::abs(after) > kCreaseOneSided * std::abs(before))
    v3 = 3 * (v2 - v1) + v0;
}

/// Is any second difference along the lines of a cell's 4³ (x slowest) larger than that? Without
/// branches, so that it is made for several at once: almost all cells have none.
inline bool bendsMoreThan(const std::array<float, 64>& s, float kink) {
  int bent = 0;
  const auto look = [&](std::size_t i, std::size_t step) {
    bent |= static_cast<int>(std::abs(s[i] - 2 * s[i + step] + s[i + 2 * step]) > kink);
  };
  for (std::size_t i = 0; i < 32; ++i) look(i, 16);
  for (std::size_t x = 0; x < 64; x += 16)
    for (std::size_t i = 0; i < 8; ++i) look(x + i, 4);
  for (std::size_t i = 0; i < 64; i += 4) look(i, 1), look(i + 1, 1);
  return bent != 0;
}

/// Leaves the samples beyond kinks out of a cell's 4³ (x slowest), line by line, as essentially
/// non-oscillatory schemes choose their stencils [Harten87]. What the face between two cells is
/// interpolated from depends on the samples in its plane alone, so that both agree there: the whole
/// stays continuous.
/// @param kink  kCreaseBend in the units of the samples
inline void limitAtCreases(std::array<float, 64>& s, float kink) {
  if (!bendsMoreThan(s, kink)) return;
  for (std::size_t i = 0; i < 16; ++i) limitAtCrease(s[i], s[i + 16], s[i + 32], s[i + 48], kink);
  for (std::size_t i = 0; i < 16; ++i) {
    float* line = &s[(i / 4) * 16 + i % 4];
    limitAtCrease(line[0], line[4], line[8], line[12], kink);
  }
  for (std::size_t i = 0; i < 16; ++i) {
    float* line = &s[4 * i];
    limitAtCrease(line[0], line[1], line[2], line[3], kink);
  }
}

}  // namespace levelset
