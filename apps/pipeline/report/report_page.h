#pragma once

#include <string>

#include "apps/pipeline/run/runner.h"

namespace pipeline {

/// Formats the report as one HTML page with embedded pictures. The page loads no other file and
/// contains no script. Two equal runs give equal bytes, except for times and memory.
[[nodiscard]] std::string reportPage(const RunReport& report);

}  // namespace pipeline
