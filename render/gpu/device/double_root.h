#pragma once

// Private to the GPU renderer: square roots of doubles in shaders.

#include <string>

#include "render/kernel/trace_glsl.h"

namespace render {

/// GLSL of rootOf(). @pre the text before it defines VAR
inline std::string doubleRootText() {
  constexpr const char* kNeighbours = R"GLSL(
// The next larger and the next smaller number of a positive one.
double nextAbove(double a) {
  uvec2 bits = unpackDouble2x32(a);
  bits.x += 1u;
  bits.y += bits.x == 0u ? 1u : 0u;
  return packDouble2x32(bits);
}
double nextBelow(double a) {
  uvec2 bits = unpackDouble2x32(a);
  bits.y -= bits.x == 0u ? 1u : 0u;
  bits.x -= 1u;
  return packDouble2x32(bits);
}
)GLSL";
  constexpr const char* kRoot = R"GLSL(
// Square root, rounded as IEEE 754 requires. NVIDIA's driver 580 rounds a third of the roots of
// doubles to a neighbour. Where products would overflow or underflow, the driver's root stays.
double rootOf(double a) {
  VAR root = sqrt(a);
  return a > 1e-250lf && a < 1e250lf ? roundedRoot(a, root) : root;
}
)GLSL";
  return std::string(kNeighbours) + kRoundedRootKernel + kRoot;
}

}  // namespace render
