#include "render/gpu/bezier/bezier_programs.h"

#include <fmt/core.h>

#include <string>

#include "render/gpu/device/double_root.h"
#include "render/gpu/device/gl_objects.h"
#include "render/kernel/trace_glsl.h"

namespace render {
namespace {

constexpr const char* kBezierBlocks = R"GLSL(
#define VAR precise double
uniform int first, count, order0, order1, order2, nodeCount, rayCount, originCount;
uniform int childCount, firstPair, mostJets, mostVisits, axis;
uniform bool isResumed;
layout(std430, binding = 0) buffer Points { double points[]; };
layout(std430, binding = 1) buffer Heads { double heads[]; };
)GLSL";

// Bindings: 2 marks or roots, 3 pairs or parents, 4 pairs or numbers of parents, 5 rays, visits or
// the view, 6 lists, 7 slots or states. OpenGL allows eight blocks.
constexpr const char* kMarks = R"GLSL(
#define USES_MARKS
layout(std430, binding = 2) buffer Marks { uint marks[]; };
)GLSL";
constexpr const char* kPairs = R"GLSL(
#define USES_PAIRS
layout(std430, binding = 3) readonly buffer PairsIn { uint pairsIn[]; };
layout(std430, binding = 4) writeonly buffer PairsOut { uint pairsOut[]; };
)GLSL";
constexpr const char* kRaysText = R"GLSL(
layout(std430, binding = 5) readonly buffer Rays { double rays[]; };
)GLSL";
constexpr const char* kLists = R"GLSL(
layout(std430, binding = 6) buffer Lists { uint lists[]; };
)GLSL";

std::string blocksOf(BezierKernel kernel) {
  switch (kernel) {
    case BezierKernel::Halve:
      return R"GLSL(#define KERNEL_HALVE
layout(std430, binding = 3) readonly buffer ParentPoints { double parentPoints[]; };
layout(std430, binding = 4) readonly buffer Parents { int parents[]; };
)GLSL";
    case BezierKernel::Bound:
      return std::string(kMarks) + R"GLSL(#define KERNEL_BOUND
layout(std430, binding = 3) readonly buffer ParentHeads { double parentHeads[]; };
layout(std430, binding = 4) readonly buffer Parents { int parents[]; };
layout(std430, binding = 5) readonly buffer View { double view[]; };
)GLSL";
    case BezierKernel::Box:
      return std::string(kMarks) + kPairs + kRaysText + kLists + R"GLSL(#define KERNEL_BOX
layout(std430, binding = 7) readonly buffer Slots { int slots[]; };
)GLSL";
    case BezierKernel::Frame:
      return std::string(kLists) + "#define KERNEL_FRAME\n";
    case BezierKernel::InFrame:
      return std::string(kMarks) + kPairs + kRaysText + kLists + "#define KERNEL_IN_FRAME\n";
    case BezierKernel::Prove:
      return std::string(kLists) + "#define KERNEL_PROVE\n";
    case BezierKernel::Solve:
      return std::string(kPairs) + kRaysText + kLists + R"GLSL(#define KERNEL_SOLVE
layout(std430, binding = 2) writeonly buffer Roots { double roots[]; };
layout(std430, binding = 7) buffer States { double states[]; };
)GLSL";
    case BezierKernel::Keep:
      return std::string(kMarks) + kPairs + kLists + R"GLSL(#define KERNEL_KEEP
layout(std430, binding = 5) buffer Visits { uint visits[]; };
)GLSL";
  }
  return {};
}

std::string programText(BezierKernel kernel, const BezierVariant& variant) {
  return fmt::format(
             "#version 450 core\nlayout(local_size_x = {}) in;\n"
             "const int N = {}, kWeight = {}, kMostOrder = {}, kRootNumbers = {};\n"
             "const bool isPerspective = {};\n",
             kBezierGroup, variant.components, variant.weight, variant.mostOrder,
             bezierRootNumbers(variant.components), variant.isPerspective) +
         kBezierBlocks + blocksOf(kernel) + doubleRootText() + kBezierKernel + kBezierTreeKernel;
}

}  // namespace

void BezierPrograms::release() {
  for (const auto& [key, program] : programs_) context_.gl().DeleteProgram(program);
  programs_.clear();
}

GLuint BezierPrograms::program(BezierKernel kernel, const BezierVariant& variant) {
  GLuint& program = programs_[{kernel, variant}];
  if (program == 0) program = compileCompute(context_, programText(kernel, variant));
  return program;
}

}  // namespace render
