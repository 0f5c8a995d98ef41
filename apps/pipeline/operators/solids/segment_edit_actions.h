#pragma once

#include "apps/pipeline/registry/operator.h"

/// Actions that change segmentations.
namespace pipeline {

[[nodiscard]] Operator relabelOperator();

// Actions on level sets that take segmentations too. The result is then a segmentation.
[[nodiscard]] Operator unionWithSegmentations(Operator op);
[[nodiscard]] Operator differenceWithSegmentations(Operator op);
[[nodiscard]] Operator offsetWithSegmentations(Operator op);
[[nodiscard]] Operator flowWithSegmentations(Operator op);
[[nodiscard]] Operator transformWithSegmentations(Operator op);
[[nodiscard]] Operator morphWithSegmentations(Operator op);

}  // namespace pipeline
