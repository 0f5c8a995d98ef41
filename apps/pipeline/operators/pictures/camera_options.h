#pragma once

// The camera of pictures and scenes.

#include <Imath/ImathBox.h>

#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "render/camera.h"

namespace pipeline {

/// Appends --size, --from, --to, --up, --fov, --ortho, --near and --far.
void addCameraParams(std::vector<Param>& params);

[[nodiscard]] bool givesCamera(const Invocation& in);

/// @param known  view that given options change; null: a three-quarter view that frames `bounds`,
///               unless --from is given
[[nodiscard]] render::Camera cameraOf(Invocation& in, const Imath::Box3d& bounds,
                                      const render::Camera* known = nullptr);

/// Checks the options that need no operand.
void validateCamera(const Invocation& in);

}  // namespace pipeline
