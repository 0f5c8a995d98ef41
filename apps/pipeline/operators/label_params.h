#pragma once

// Labels of the regions of segmentations in options.

#include <string>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "levelset/segmented/segmented_field.h"

namespace pipeline {

/// Treatment of the label 0, which the word `void` names.
enum class VoidLabel { Counts, IsNone };

/// @throws UsageError for a text that is no label
[[nodiscard]] levelset::RegionLabel regionLabel(const std::string& text, VoidLabel voidLabel,
                                                const Invocation& in, const char* param);
/// Words of an option, separated by commas or blanks.
/// @throws UsageError for none
[[nodiscard]] std::vector<std::string> labelWords(const Invocation& in, const char* param);
/// Labels of an option, in their order.
/// @throws UsageError for none, or a word that is no label
[[nodiscard]] std::vector<levelset::RegionLabel> regionLabels(const Invocation& in,
                                                              const char* param,
                                                              VoidLabel voidLabel);

}  // namespace pipeline
