#pragma once

#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"
#include "render/views/scene_file.h"

/// The parts of the operator `render` that concern volumes.
namespace pipeline {

/// Returns true for the kinds of operands that are drawn as volumes.
[[nodiscard]] bool isVolumeKind(Kind kind);
/// Options of `render` for volumes.
[[nodiscard]] std::vector<Param> volumePictureParams();
/// Checks the options for volumes before anything runs. @throws UsageError
void validateVolumePicture(const Invocation& in);
/// Refuses volumes without --isovalue or --transfer, and options for volumes with other operands.
/// @throws UsageError
void requireVolumeOptions(const Invocation& in);

/// Scene with the isosurface of a volume. Without --isovalue the isosurface is empty.
[[nodiscard]] render::ViewedScene volumeScene(Invocation& in);
/// Adds the light of --transfer to a picture of volumeScene().
/// @param judged  receives the picture with the light of the judge; null: it is not computed
void addLight(Invocation& in, const render::Scene& scene, const render::RenderOptions& options,
              render::Image& image, render::Image* judged);
/// Compares the colours of a volume by the kernel and by the judge.
/// @throws NumericalError when they differ
void requireSameLight(const render::Image& image, const render::Image& judged);

}  // namespace pipeline
