#pragma once

// The camera of pictures and scenes.

#include <Imath/ImathBox.h>

#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "render/camera.h"

namespace pipeline {

/// --size, --from, --to, --up, --fov, --ortho, --near, --far.
void addCameraParams(std::vector<Param>& params);

[[nodiscard]] bool givesCamera(const Invocation& in);

/// @param known  what is changed by the options that are given; null: a three-quarter view that
///               frames `bounds`, unless they say from where
[[nodiscard]] render::Camera cameraOf(Invocation& in, const Imath::Box3d& bounds,
                                      const render::Camera* known = nullptr);

/// Refuses what can be told from the options alone.
void validateCamera(const Invocation& in);

}  // namespace pipeline
