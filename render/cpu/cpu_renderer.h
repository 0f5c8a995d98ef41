#pragma once

#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

namespace render {

/// Draws the scene with the kernel compiled for this processor. Layers are those of renderEmbree(),
/// in single precision. Pixels depend on the scene alone, not on the number of threads or the
/// instruction set.
/// @throws as renderEmbree()
/// @throws levelset::ResourceLimit also for surfaces that span more voxels than the brick tables
/// support
[[nodiscard]] Image renderCpu(const Scene& scene, const RenderOptions& options = {});

}  // namespace render
