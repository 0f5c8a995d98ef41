#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "apps/regress/case.h"
#include "levelset/progress.h"

namespace regress {

struct SuiteOptions {
  std::vector<std::string> names = {};  ///< names of cases; empty: all
  Budget budget = Budget::Quick;
  levelset::Progress progress = {};
  std::function<void(const CaseResult&)> finished = {};  ///< called after each case
};

struct SuiteResult {
  Budget budget = Budget::Quick;
  std::vector<CaseResult> cases;
  double cpuSeconds = 0;
};

/// @throws UsageError for a name that no case has
void checkNames(const std::vector<std::string>& names);

/// @throws UsageError as checkNames(); Cancelled
[[nodiscard]] SuiteResult runSuite(const SuiteOptions& options);

/// Returns a sentence for each missed bound and for each outcome that does not hold.
[[nodiscard]] std::vector<std::string> failures(const CaseResult& result);
[[nodiscard]] std::vector<std::string> failures(const SuiteResult& result);

/// Creates the folder for results if it is missing.
/// @throws IoError if it cannot be created
void makeFolder(const std::filesystem::path& folder);

/// Writes results.json, results.csv and index.html. With `withPlots` it also writes plots.py and,
/// if Python has matplotlib, the plots as PNG and SVG.
/// @return reasons why plots are missing; empty: none is missing
/// @throws IoError if a file cannot be written
std::vector<std::string> writeResults(const SuiteResult& result,
                                      const std::filesystem::path& folder, bool withPlots);

}  // namespace regress
