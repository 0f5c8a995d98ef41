#pragma once

#include <string>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

/// The parts of the operator `render` that concern presets, lights, and effects of the picture.
namespace pipeline {

/// Appends --preset, --colour, --light, --light-radius, --light-layers, the numbers of rays,
/// --reduce, and the options of render::LookOptions.
void addLookParams(std::vector<Param>& params);

/// Sets the options of --preset that are not given, see Invocation::assume().
void assumePreset(Invocation& in);

/// Checks the options of this file before the operand is known. @throws UsageError
void validateLook(const Invocation& in);
/// True if the picture is drawn with effects.
[[nodiscard]] bool hasLook(const Invocation& in);

/// Sets colours and light of a scene, and enlarges its picture for --reduce.
void applyLookTo(Invocation& in, render::Scene& scene);
/// Sets the layers and the numbers of rays that the options ask for.
void applyLookTo(const Invocation& in, render::RenderOptions& options);
/// Applies the effects to a picture, and reduces it.
[[nodiscard]] render::Image finishLook(Invocation& in, render::Image image);

/// Documentation of the presets: the options that each sets, as on the command line.
[[nodiscard]] std::string presetText();

}  // namespace pipeline
