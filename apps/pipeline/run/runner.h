#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/run/thumbnail.h"
#include "apps/pipeline/run/tolerance_report.h"
#include "levelset/region_of_interest.h"

namespace pipeline {

struct RunSettings {
  bool dryRun = false;
  bool measureErrors = false;  ///< estimate each result's error: costs a pass over it
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  bool wholeValues = false;          ///< make all of each value, also where a part of it would do
  std::size_t thumbnails = 0;        ///< of so many steps, but in dry runs
  std::filesystem::path cache = {};  ///< folder of earlier results; empty: none are kept
  // Branches run side by side: these are called from several threads, but for progress and goesOn
  // never at the same time.
  /// Called with the name of each action before it runs.
  std::function<void(const std::string&)> begin = {};
  /// Called with the action's place in the chain, its name and the fraction done, from any thread.
  std::function<void(std::size_t, const std::string&, double)> progress = {};
  /// Asked while an action runs, from any thread; false ends it with levelset::Cancelled.
  std::function<bool()> goesOn = {};
  /// Called with the value of each node that ran and makes one; in a dry run with its plan.
  std::function<void(std::size_t, const Value&)> made = {};
  /// Text for people that an action prints.
  std::function<void(const std::string&)> print = {};
  /// One sentence beside the result.
  std::function<void(const std::string&)> warn = {}, note = {};
};

struct StepReport {
  std::string action;
  bool isKnown = false;                           ///< the result is of an earlier run
  std::map<std::string, std::string> parameters;  ///< as written
  std::map<std::string, std::string> defaults;    ///< of those that were not
  StepNotes notes;
  double wallSeconds = 0, cpuSeconds = 0;
  double peakBytes = 0;
  std::string resultName, resultKind;
  std::string place;  ///< in a script
  double activeVoxels = 0, voxelSize = 0, halfWidth = 0;
  levelset::RegionOfInterest needed = {};  ///< of the result, by others; empty: all of it
  std::size_t triangles = 0;
  Thumbnail thumbnail = {};  ///< of the result, where asked for
};

struct RunReport {
  std::string graphJson;  ///< of all that was asked for
  std::vector<StepReport> steps;
  std::vector<std::string> warnings;  ///< about the graph as a whole
  std::vector<std::string> leftOut;   ///< actions that nothing needed
  std::string error;                  ///< the sentence that ended it, if one did
  int exitCode = 0;
  bool dryRun = false;
  std::optional<ToleranceReport> tolerance;  ///< of a run with --tolerance
};

/// Runs those nodes that are needed, as if one after another, and lets values go once the last that
/// takes them has run. Branches run side by side as far as there are threads and memory; what
/// writes or prints waits for all before it. With a cache neither those run whose results are
/// known, nor what only they take. A refusal is recorded in the report and then thrown on.
void run(const Graph& graph, const RunSettings& settings, RunReport& report);

}  // namespace pipeline
