#pragma once

#include <memory>

#include "render/effects/screen_pass.h"
#include "render/gpu/device/no_opengl.h"

namespace render {

/// Opens an OpenGL 4.5 context that runs the passes of effects as compute shaders. If the driver
/// rounds sums, products and quotients of doubles as IEEE 754 requires, the results have the bits
/// of CpuScreenRunner.
/// @throws NoOpenGl when OpenGL 4.5 is missing
[[nodiscard]] std::unique_ptr<ScreenRunner> makeGpuScreenRunner();

}  // namespace render
