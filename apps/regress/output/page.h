#pragma once

#include <string>
#include <vector>

#include "apps/regress/suite.h"

namespace regress {

/// Builds index.html: failures, plots, and for each case its definition, bounds, outcomes and
/// figures.
[[nodiscard]] std::string pageText(const SuiteResult& result,
                                   const std::vector<std::string>& plots);

}  // namespace regress
