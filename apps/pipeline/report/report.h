#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/pipeline/run/runner.h"

namespace pipeline {

/// Writes the report as JSON. The object contains `version`, `versions` of all libraries, `graph`,
/// `steps`, `tolerance` (only with --tolerance), `left_out`, `warnings`, `exit_code` and `error`.
/// `graph`, saved to a file, is a valid input of the action `run`.
[[nodiscard]] std::string reportJson(const RunReport& report);
/// Formats one line for each voxel size that --tolerance tried. Then adds one line for each result
/// of the run, with its requested and achieved error. Without results, adds one line about the
/// voxel size that the error models choose.
[[nodiscard]] std::vector<std::string> toleranceLines(const ToleranceReport& tolerance);
/// Checks the files of --report and --save-graph before the run.
/// @throws levelset::IoError if a file cannot be written
/// @throws levelset::UsageError if an action writes the same file, or the extension is unknown
void checkRunTargets(const Graph& graph);
/// Decides by extension if a report is an HTML page.
[[nodiscard]] bool isPage(const std::filesystem::path& path);
/// Writes a report as .json or .html, by extension; "-" writes JSON to standard output. Writes a
/// temporary file and renames it.
/// @throws levelset::IoError if the file cannot be written
void writeReport(const std::filesystem::path& path, const RunReport& report);

/// Formats one line about a step: its result, time, memory and estimated error.
[[nodiscard]] std::string stepLine(const StepReport& step, bool dryRun);

}  // namespace pipeline
