#pragma once

#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

namespace render {

/// Draws the scene by the kernel compiled for this processor: the same layers as renderEmbree(), in
/// single precision. Pixels depend on the scene alone, not on threads or instruction sets.
/// @throws as renderEmbree(); levelset::ResourceLimit also for surfaces that span too much
[[nodiscard]] Image renderCpu(const Scene& scene, const RenderOptions& options = {});

}  // namespace render
