#pragma once

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "render/views/scene_file.h"

/// The parts of the operator `render` that concern segmentations.
namespace pipeline {

/// Option --hide of `render`.
[[nodiscard]] Param hideParam();
/// Refuses --hide with other operands than a segmentation, and what is no list of labels.
/// @throws UsageError
void validateHide(const Invocation& in);
/// Scene with the interfaces of a segmentation, without the regions of --hide.
/// @throws InvalidInput when the segmentation lacks one of them, or no region is left
[[nodiscard]] render::ViewedScene segmentedScene(Invocation& in);

}  // namespace pipeline
