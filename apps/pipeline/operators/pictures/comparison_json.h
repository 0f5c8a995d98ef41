#pragma once

#include "apps/pipeline/operators/json_output.h"
#include "render/images/compare_images.h"

namespace pipeline {

/// Returns the result of a comparison of pictures as JSON: its verdict, counts, and layers.
[[nodiscard]] Json comparisonJson(const render::ImageComparison& found);

}  // namespace pipeline
