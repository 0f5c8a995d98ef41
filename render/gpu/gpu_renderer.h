#pragma once

#include "levelset/error.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

namespace render {

/// There is no OpenGL 4.5 without a display here.
struct NoOpenGl : levelset::ResourceLimit {
  using ResourceLimit::ResourceLimit;
};

/// Draws the scene by the kernel as an OpenGL 4.5 compute shader, without a display: the same bits
/// as renderCpu() where the driver rounds as IEEE 754 has it (Mesa's llvmpipe does).
/// @throws as renderCpu(); levelset::UsageError for scenes that are blended; NoOpenGl;
///         levelset::ResourceLimit also where the driver does not take the shader or the grids
[[nodiscard]] Image renderGpu(const Scene& scene, const RenderOptions& options = {});

}  // namespace render
