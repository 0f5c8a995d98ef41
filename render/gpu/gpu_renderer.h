#pragma once

#include "render/gpu/device/no_opengl.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

namespace render {

/// Draws the scene with the kernel as an OpenGL 4.5 compute shader, without a display. If the
/// driver rounds as IEEE 754 requires, as Mesa's llvmpipe does, pixels have the same bits as those
/// of renderCpu().
/// @throws as renderCpu()
/// @throws NoOpenGl when OpenGL 4.5 is missing
/// @throws levelset::ResourceLimit also when the driver rejects the shader, or the tables are too
/// large for it
[[nodiscard]] Image renderGpu(const Scene& scene, const RenderOptions& options = {});

}  // namespace render
