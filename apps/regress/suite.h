#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "apps/regress/case.h"
#include "levelset/progress.h"

namespace regress {

struct SuiteOptions {
  std::vector<std::string> names = {};  ///< of cases; empty: all
  Budget budget = Budget::Quick;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
  std::function<void(const CaseResult&)> finished = {};  ///< called after each case
};

struct SuiteResult {
  Budget budget = Budget::Quick;
  std::vector<CaseResult> cases;
  double cpuSeconds = 0;
};

/// @throws UsageError for a name that no case has; Cancelled
[[nodiscard]] SuiteResult runSuite(const SuiteOptions& options);

/// A sentence for each bound that was missed and each statement that does not hold.
[[nodiscard]] std::vector<std::string> failures(const CaseResult& result);
[[nodiscard]] std::vector<std::string> failures(const SuiteResult& result);

/// Writes results.json, results.csv, index.html and, where Python has matplotlib, the plots (PNG
/// and SVG) with the script that made them. The folder is made if it is missing.
/// @return notes: what was left out, and why
/// @throws IoError
std::vector<std::string> writeResults(const SuiteResult& result,
                                      const std::filesystem::path& folder);

}  // namespace regress
