#pragma once

// Private to the GPU renderer: compute shaders of the ray casting of Bézier volumes.

#include <array>
#include <cstddef>
#include <map>
#include <utility>

#include "render/gpu/device/gl_context.h"

namespace render {

/// Kernels of render/shaders/bezier_tree.glsl, in the order of their calls.
enum class BezierKernel { Halve, Bound, Box, Frame, InFrame, Prove, Solve, Keep };

/// Bindings of storage blocks that all kernels share; kPrivateBlock and above differ.
inline constexpr GLuint kPointBlock = 0, kHeadBlock = 1, kListBlock = 6;

/// Properties of nodes that select a shader.
struct BezierVariant {
  int components = 4;  ///< number in a control point
  int weight = 2;      ///< number of the component that is the weight of projected points
  bool isPerspective = true;
  int mostOrder = 6;  ///< largest degree + 1 of arrays
  auto operator<=>(const BezierVariant&) const = default;
};

/// Numbers of a root in the answers of BezierKernel::Solve.
constexpr std::size_t bezierRootNumbers(int components) {
  return 14 + 4 * static_cast<std::size_t>(components);
}
inline constexpr std::size_t kBezierHead = 50;   ///< numbers of the head of a node
inline constexpr std::size_t kBezierStates = 5;  ///< numbers of a pair that is being solved
inline constexpr int kBezierGroup = 64;          ///< invocations of a work group

/// Compiled kernels. All functions run in jobs of GlContext::run().
class BezierPrograms {
 public:
  explicit BezierPrograms(const GlContext& context) : context_(context) {}
  void release();

  /// @throws levelset::ResourceLimit as compileCompute()
  [[nodiscard]] GLuint program(BezierKernel kernel, const BezierVariant& variant);

 private:
  const GlContext& context_;
  std::map<std::pair<BezierKernel, BezierVariant>, GLuint> programs_;
};

}  // namespace render
