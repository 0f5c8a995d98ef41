#pragma once

#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "render/filter.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"
#include "render/views/scene_file.h"

/// The parts of the operator `render` that concern volumes.
namespace pipeline {

/// Returns true for the kinds of operands that are drawn as volumes.
[[nodiscard]] bool isVolumeKind(Kind kind);
/// Options --transfer and --no-shading.
[[nodiscard]] std::vector<Param> transferParams();
/// Checks the options of transferParams() before anything runs. @throws UsageError
void validateTransfer(const Invocation& in);
/// Volume with the transfer function of --transfer: points, or the suggestion for the histogram.
/// @param surface  any isosurface of the volume
[[nodiscard]] render::VolumePart volumePartOf(Invocation& in, const render::VolumeSurface& surface);

/// Options of `render` for volumes.
[[nodiscard]] std::vector<Param> volumePictureParams();
/// Checks the options for volumes before anything runs. @throws UsageError
void validateVolumePicture(const Invocation& in);
/// Refuses volumes without --isovalue or --transfer, and options for volumes with other operands.
/// @throws UsageError
void requireVolumeOptions(const Invocation& in);

/// Returns the filter that --filter of 'render' names.
[[nodiscard]] render::Filter filterOf(const Invocation& in);

/// Scene with the isosurface of --isovalue, and the volume with the transfer function of
/// --transfer.
[[nodiscard]] render::ViewedScene volumeScene(Invocation& in);

}  // namespace pipeline
