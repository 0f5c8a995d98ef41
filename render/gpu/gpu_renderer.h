#pragma once

#include "render/image.h"
#include "render/render_options.h"
#include "render/scene.h"

namespace render {

/// Draws the scene by the kernel as an OpenGL 4.5 compute shader, without a display: the same bits
/// as renderCpu() where the driver rounds as IEEE 754 has it (Mesa's llvmpipe does).
/// @throws as renderCpu(); levelset::ResourceLimit also where there is no EGL, no OpenGL 4.5 or the
///         driver does not take the shader or the grids
[[nodiscard]] Image renderGpu(const Scene& scene, const RenderOptions& options = {});

}  // namespace render
