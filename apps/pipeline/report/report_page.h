#pragma once

#include <string>

#include "apps/pipeline/run/runner.h"

namespace pipeline {

/// The report as one page of HTML, pictures included: it loads nothing and runs nothing. The same
/// run gives the same bytes, but for what it cost.
[[nodiscard]] std::string reportPage(const RunReport& report);

}  // namespace pipeline
