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

/// Options and callbacks of a run.
struct RunSettings {
  bool dryRun = false;
  bool measureErrors = false;  ///< estimate each result's error; costs a pass over the result
  /// Measures the peak memory of each step by itself. This resets the peak of the process, which
  /// tools such as `time` read.
  bool measurePeaks = false;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  bool fullValues = false;  ///< ignore regions of interest (--no-roi)
  /// Box of the requested results that the caller reads, world units. Other parts of them may be
  /// missing. In a smaller box than kEverywhere, a node without surface fails with NoSurface.
  Imath::Box3d part = levelset::kEverywhere;
  std::size_t thumbnails =
      0;  ///< number of nodes, from the first, that get a thumbnail in the report; none in dry runs
  std::filesystem::path cache = {};  ///< folder of cached results; empty: no cache
  // Branches run concurrently, so several threads call these functions. Calls never overlap, except
  // those of `progress` and `shouldContinue`.
  /// Receives the name of each action before it runs.
  std::function<void(const std::string&)> begin = {};
  /// Receives the node's index, the name of its action and the completed fraction, 0 to 1.
  std::function<void(std::size_t, const std::string&, double)> progress = {};
  /// Polled while an action runs; false ends the action with levelset::Cancelled.
  std::function<bool()> shouldContinue = {};
  /// Receives the value of each node that ran and has one; in a dry run, its plan.
  std::function<void(std::size_t, const Value&)> onValue = {};
  /// Receives the text that an action prints for the user.
  std::function<void(const std::string&)> print = {};
  /// Receive one sentence about a result: a warning, or a note.
  std::function<void(const std::string&)> warn = {}, note = {};
};

/// Inputs, result and cost of one action that ran.
struct StepReport {
  std::string action;
  bool isCached = false;                          ///< the result comes from an earlier run
  std::map<std::string, std::string> parameters;  ///< options as the user wrote them, by name
  std::map<std::string, std::string>
      defaults;  ///< default values of the options that the user left out, by name
  StepNotes notes;
  double wallSeconds = 0, cpuSeconds = 0;
  /// Peak resident memory of the process, bytes: during the step with RunSettings::measurePeaks,
  /// else since the start of the process.
  double peakBytes = 0;
  std::string resultName, resultKind;
  std::string location;  ///< position in the script, "FILE, line 4"; empty: none
  /// Number of active voxels, voxel size in world units, and half width in voxels, of a band.
  double activeVoxels = 0, voxelSize = 0, halfWidth = 0;
  /// Region of interest: part of the result that other nodes read.
  levelset::RegionOfInterest roi = {};
  std::size_t triangles = 0;
  Thumbnail thumbnail = {};  ///< picture of the result, if requested
};

/// Report of a complete run.
struct RunReport {
  std::string graphJson;  ///< the complete graph as JSON
  std::vector<StepReport> steps;
  std::vector<std::string> warnings;  ///< warnings about the graph, not about one step
  std::vector<std::string> leftOut;   ///< actions that no requested result depends on
  std::string error;                  ///< message of the error that ended the run; empty: none
  int exitCode = 0;
  bool dryRun = false;
  std::optional<ToleranceReport> tolerance;  ///< only of a run with --tolerance
};

/// Runs the needed nodes of a graph. The results equal those of a run in graph order. Releases each
/// value after its last consumer. Branches run concurrently within the limits of threads and
/// memory. A node that writes or prints waits for all nodes before it. With a cache, nodes with
/// cached results do not run, nor do nodes that only they depend on.
/// @throws levelset::Error if a node fails; the report contains the message
void run(const Graph& graph, const RunSettings& settings, RunReport& report);

}  // namespace pipeline
