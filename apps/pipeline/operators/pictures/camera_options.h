#pragma once

// Options of the camera, which the actions `render` and `scene` share.

#include <Imath/ImathBox.h>

#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "render/camera.h"
#include "render/scene/scene.h"

namespace pipeline {

/// Appends --size, --from, --to, --up, --fov, --ortho, --near and --far.
void addCameraParams(std::vector<Param>& params);

[[nodiscard]] bool givesCamera(const Invocation& in);

/// Returns the camera that the options describe.
/// @param bounds  box of the drawn surfaces, world units
/// @param known  camera that the given options change. If null, the camera is at --from; without
///         --from it is a three-quarter view that frames the surfaces.
/// @param drawn  scene with the surfaces; null: only their box is known, and is framed
[[nodiscard]] render::Camera cameraOf(Invocation& in, const Imath::Box3d& bounds,
                                      const render::Camera* known = nullptr,
                                      const render::Scene* drawn = nullptr);

/// Checks the camera options before the operand is known.
/// @throws levelset::UsageError for --to without --from, and for too wide a --fov
void validateCamera(const Invocation& in);

}  // namespace pipeline
