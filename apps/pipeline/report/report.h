#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/pipeline/run/runner.h"

namespace pipeline {

/// The report as JSON: an object with `version`, `versions` of all libraries, `graph` (which `run`
/// takes, as a file of its own), `steps`, `tolerance` where one was asked for, `left_out`,
/// `warnings`, `exit_code`, `error`.
[[nodiscard]] std::string reportJson(const RunReport& report);
/// What was asked for and reached, and the voxel sizes that were tried, a line each.
[[nodiscard]] std::vector<std::string> toleranceLines(const ToleranceReport& tolerance);
/// Refuses a --report or --save-graph that cannot be written before time is spent on what it should
/// tell of.
/// @throws levelset::IoError; UsageError when an action writes the same file
void checkRunTargets(const Graph& graph);
/// Is a report of this name a page? By its extension.
[[nodiscard]] bool isPage(const std::filesystem::path& path);
/// By extension: .json or .html; "-" is JSON on standard output. Written beside the target and
/// renamed.
void writeReport(const std::filesystem::path& path, const RunReport& report);

/// One line for people: what the step made, how long it took, how far off it may be.
[[nodiscard]] std::string stepLine(const StepReport& step, bool dryRun);

}  // namespace pipeline
