#pragma once

#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/operator.h"

/// Actions on segmentations: partitions of space into regions with labels.
namespace pipeline {

[[nodiscard]] Operator segmentOperator();
[[nodiscard]] Operator extractOperator();

/// Figures of a segmentation for `measure`: the materials, their interfaces and junctions.
[[nodiscard]] Json measuresOf(const levelset::SegmentedField& field, const Invocation& in);
/// Makes the mesh of all interfaces, or with --label of one region.
[[nodiscard]] Value meshOfSegmentation(Invocation& in);

}  // namespace pipeline
