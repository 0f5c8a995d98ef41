#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "apps/viewer/model/surface_discs.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

namespace viewer {

/// True for scenes that can be drawn as discs: opaque level sets without an expression, a morph or
/// meshes.
[[nodiscard]] bool canSplat(const render::Scene& scene);

/// Draws the solids of a scene as discs at their surface points, each with its normal, without
/// shadows [Brodersen07 §6.4]. Discs that face away are left out. The picture has the layers of a
/// ray-cast picture; curvatures are 0. The nearest disc wins, and among equals the first, so the
/// bits do not depend on the number of threads.
/// @param discs  discs of each solid of the scene
/// @param diagonal  diagonal of the box of the surfaces, world units
/// @param isStale  set to true from another thread: stops the drawing
/// @return null when stopped. @pre canSplat(scene)
[[nodiscard]] std::shared_ptr<render::Image> drawSplats(const std::vector<SurfaceDiscs>& discs,
                                                        const render::Scene& scene, double diagonal,
                                                        const render::RenderOptions& options,
                                                        const std::atomic<bool>& isStale);

}  // namespace viewer
