#pragma once

#include <functional>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

/// The parts of the operator `render` that concern traced reflection and refraction, and pictures
/// for two eyes.
namespace pipeline {

/// Appends the options of render::OpticsOptions and render::StereoOptions.
void addOpticsParams(std::vector<Param>& params);

/// Checks the options of this file before the operand is known. @throws UsageError
void validateOptics(const Invocation& in);

/// True if the picture is one for two eyes.
[[nodiscard]] bool isStereo(const Invocation& in);
/// True if reflection or refraction is traced.
[[nodiscard]] bool hasOptics(const Invocation& in);

[[nodiscard]] render::OpticsOptions opticsOf(Invocation& in);

/// Draws a scene from two eyes beside its camera, and combines the pictures.
/// @param draw  draws a finished picture for one eye
[[nodiscard]] render::Image drawStereo(
    Invocation& in, const render::Scene& scene,
    const std::function<render::Image(const render::Scene& eye, int number)>& draw);

}  // namespace pipeline
