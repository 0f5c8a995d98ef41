#include "apps/pipeline/tolerance/tolerance.h"

#include <fmt/core.h>
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "apps/pipeline/graph/graph_file.h"
#include "apps/pipeline/tolerance/error_model.h"
#include "apps/pipeline/tolerance/tolerance_graph.h"
#include "apps/pipeline/tolerance/tolerance_levels.h"
#include "apps/pipeline/values/units.h"
#include "apps/process_cost.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

// === Constants of the search
/// Safety factor for errors estimated from runs at several voxel sizes. On different grids, the
/// largest distance of the surfaces lies at different points. Without the factor, estimates are 1.0
/// to 2.1 times the true error over the cases of tests/bench/tolerance_bench.cpp.
constexpr double kSafety = 1.25;
/// Fraction of the tolerance that the next voxel size aims at if the error is estimated.
constexpr double kAim = 0.65;
/// Fraction of the tolerance that the next voxel size aims at if the error is measured.
constexpr double kMeasuredAim = 0.8;
/// Safety factor for errors measured against the source mesh at sample points, which miss the
/// largest distance. On the bunny, samples at half the spacing find an error up to 1.06 times as
/// large.
constexpr double kMeasuredSafety = 1.1;
/// An estimate below this fraction of the tolerance justifies a run with larger voxels. Larger
/// voxels save memory, and time in all later actions.
constexpr double kWasteful = 0.25;
/// Smallest and largest factor from one voxel size to the next. The error is predicted more
/// accurately for a nearby voxel size.
constexpr double kFinest = 1 / 3.0, kCoarsest = 4;
/// Smallest number of voxels along the longest side of the smallest object. The coarsest run for
/// comparison has a quarter of them, and a comparison with fewer is meaningless.
constexpr double kLeastVoxels = 8;
/// Largest number of voxels along the longest side of the largest object in the first run, whatever
/// the error models say. A small object may need up to kCoarsest times as many.
constexpr double kMostFirst = 64;
/// Largest voxel size, as a multiple of the tolerance, if there are creases. The error near creases
/// is about half a voxel. It is not compared with the tolerance, but should stay within a few times
/// the tolerance where memory allows.
constexpr double kCreaseVoxels = 4;
constexpr int kMostRounds = 12;  ///< largest number of voxel sizes that are tried
/// Lowest convergence order in extrapolations. At a lower observed order, the difference of two
/// runs counts as the error.
constexpr double kLeastOrder = 1;
/// --resolution of the dry run that finds the sizes of the objects: voxels along the longest side
/// of each.
constexpr int kPlanResolution = 16;

class ToleranceRun {
 public:
  ToleranceRun(const Graph& graph, const RunSettings& settings, RunReport& report)
      : graph_(graph),
        settings_(settings),
        report_(report),
        tolerance_(parseLength(graph.globals.at("tolerance"), "--tolerance")),
        parts_(withoutCacheUse(toleranceParts(graph), settings)),
        model_(graphModel(graph, surfacesOf(graph, parts_))),
        levels_(graph, parts_, settings) {
    outcome_.written = graph.globals.at("tolerance");
    for (const char* name : model_.cases) outcome_.models.emplace_back(name);
  }

  void run() {
    for (const std::string& sentence : voxelLengths(graph_, parts_)) warn(sentence);
    levels_.computeOnce(report_);
    plan();
    if (settings_.dryRun) {
      if (outcome_.modelVoxelSize > 0) levels_.planAt(outcome_.modelVoxelSize, report_);
    } else {
      base_ = apps::processStatusBytes("VmRSS:");
      search();
      finish();
    }
  }

  /// Fills the parts of the report that concern the complete graph, also after a failed run.
  void fillReport() {
    const std::vector<char> needed = neededNodes(graph_);
    report_.leftOut.clear();
    for (std::size_t i = 0; i < graph_.nodes.size(); ++i)
      if (!needed[i])
        report_.leftOut.push_back(graph_.nodes[i].op->name + (graph_.nodes[i].name.empty()
                                                                  ? ""
                                                                  : " @" + graph_.nodes[i].name));
    report_.tolerance = outcome_;
  }

 private:
  /// With a cache, moves the nodes of `once` to `again`. Every run then contains them and reads
  /// their values from the cache, in place of values that computeOnce() passes to it.
  static ToleranceParts withoutCacheUse(ToleranceParts parts, const RunSettings& settings) {
    if (settings.cache.empty() || settings.dryRun) return parts;
    parts.again.insert(parts.again.end(), parts.once.begin(), parts.once.end());
    std::sort(parts.again.begin(), parts.again.end());
    parts.once.clear();
    return parts;
  }
  static std::vector<std::size_t> surfacesOf(const Graph& graph, const ToleranceParts& parts) {
    std::vector<std::size_t> nodes;
    for (const std::size_t i : parts.again)
      if (graph.nodes[i].kind == Kind::Band ||
          (graph.nodes[i].kind == Kind::Mesh && graph.nodes[i].op->name != "read"))
        nodes.push_back(i);
    return nodes;
  }

  void warn(const std::string& sentence) {
    report_.warnings.push_back(sentence);
    settings_.warn(sentence);
  }

  [[nodiscard]] double requestedAt(double diagonal) const {
    return tolerance_.unit == Unit::Percent ? tolerance_.number / 100 * diagonal
                                            : tolerance_.number;
  }

  // === The first voxel size
  /// Chooses the voxel size of the first run from the error models and from the sizes of the
  /// objects.
  void plan() {
    RunReport planned;
    const std::map<std::size_t, Value> plans = levels_.planAll(kPlanResolution, planned);
    for (const std::size_t i : parts_.chosen) {
      const double side = kPlanResolution * plans.at(i).plan().voxelSize;
      longestSide_ = std::max(longestSide_, side);
      shortestSide_ = std::min(shortestSide_, side);
    }
    double requested = std::numeric_limits<double>::max();
    for (const std::size_t i : parts_.outputs) {
      const auto it = plans.find(i);
      const double diagonal = it == plans.end() ? 0 : it->second.diagonal();
      if (tolerance_.unit == Unit::Percent && !(diagonal > 0)) return;
      requested = std::min(requested, requestedAt(diagonal));
    }
    double voxel = std::numeric_limits<double>::max();
    for (const std::size_t i : parts_.chosen)
      if (const double modelled = modelVoxelSize(graph_.nodes[i], kAim * requested); modelled > 0)
        voxel = std::min(voxel, modelled);
    if (model_.makesCreases) voxel = std::min(voxel, kCreaseVoxels * requested);
    if (voxel < std::numeric_limits<double>::max())
      outcome_.modelVoxelSize = rounded(std::min(voxel, coarsest()));
  }

  [[nodiscard]] double coarsest() const { return shortestSide_ / kLeastVoxels; }

  /// Rounds a voxel size down to three digits, for readability.
  static double rounded(double voxel) {
    const double unit = std::pow(10, std::floor(std::log10(voxel)) - 2);
    const double steps = std::floor(voxel / unit * (1 + 1e-12));
    return parseNumber(fmt::format("{:.3g}", steps * unit), "--tolerance");
  }

  // === Runs
  /// Result and error estimate at one voxel size.
  struct Trial {
    Level level;
    std::vector<ToleranceOutput> outputs = {};
    double ratio = 0;  ///< largest ratio of an error to its tolerance
    double order = 1;  ///< convergence order of the output with that ratio
    double aim = 1;    ///< fraction of the tolerance that the next run aims at
    bool hasCreases = false;
    double finest = 0;  ///< smallest tolerance of an output, world units
  };

  Trial tryVoxel(double voxel) {
    coarsePeak_ = base_;
    Trial trial{.level = levels_.runAt(voxel, 1)};
    trial.outputs.resize(parts_.outputs.size());
    // Outputs whose error must be estimated from runs with larger voxels.
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < parts_.outputs.size(); ++i) {
      ToleranceOutput& output = trial.outputs[i];
      output.name = nameOf(graph_.nodes[parts_.outputs[i]]);
      output.requested = requestedAt(trial.level.surfaces[i].diagonal);
      output.order = kLeastOrder;
      output.achieved = std::numeric_limits<double>::max();
      if (const std::optional<double> known = levels_.knownError(trial.level, i)) {
        output.isMeasured = true;
        output.achieved = kMeasuredSafety * *known;
      }
      const bool canFall = output.isMeasured && measuredFalls(voxel, output.achieved, i);
      if (!output.isReached() && !canFall) open.push_back(i);
    }
    if (!open.empty()) extrapolate(voxel, open, trial);
    trial.finest = std::numeric_limits<double>::max();
    for (const ToleranceOutput& output : trial.outputs) {
      const double ratio = output.achieved / output.requested;
      if (ratio >= trial.ratio) {
        trial.ratio = ratio;
        trial.order = output.order;
        trial.aim = output.isMeasured ? kMeasuredAim : kAim;
      }
      trial.hasCreases = trial.hasCreases || output.creaseShare > 0;
      trial.finest = std::min(trial.finest, output.requested);
    }
    trial.level.peakBytes = std::max(trial.level.peakBytes, apps::peakResidentBytes());
    trial.level.surfaces.clear();  // the surfaces are needed only for the error
    return trial;
  }

  /// Decides if the measured error of an output falls with the voxel size. It does not fall if the
  /// source mesh has parts inside the solid, or creases finer than the tolerance. The error is then
  /// estimated instead.
  bool measuredFalls(double voxel, double error, std::size_t output) {
    const auto last = measured_.find(output);
    if (last != measured_.end() && voxel < last->second.voxel) {
      const double slowest = std::sqrt(voxel / last->second.voxel);
      if (error > slowest * last->second.error) believesMeasured_ = false;
    }
    measured_[output] = {voxel, error};
    return believesMeasured_;
  }

  /// Switches from measured to estimated errors if a measured one is too large. Sets `voxel` to the
  /// best voxel size so far, which is then tried again.
  /// @return false if no measured error is too large, or estimates are already in use
  bool turnToEstimates(double& voxel) {
    const auto& outputs = best_->outputs;
    const bool rests = std::any_of(outputs.begin(), outputs.end(), [](const ToleranceOutput& o) {
      return o.isMeasured && !o.isReached();
    });
    if (!rests || !std::exchange(believesMeasured_, false)) return false;
    voxel = best_->level.voxelSize;
    return true;
  }

  /// Estimates errors by Richardson extrapolation from voxels twice and four times as large.
  void extrapolate(double voxel, const std::vector<std::size_t>& outputs, Trial& trial) {
    std::optional<Level> coarser;
    try {
      coarser = levels_.runAt(voxel, 4);
      coarser->values.clear();
    } catch (const levelset::InvalidInput&) {
      // An object vanishes at four times the voxel size: the convergence order stays kLeastOrder.
    }
    Level coarse = levels_.runAt(voxel, 2);
    coarse.values.clear();
    coarsePeak_ = coarse.peakBytes;
    for (const std::size_t i : outputs) {
      const LevelDifference near = levels_.difference(trial.level, coarse, i);
      const LevelDifference far =
          coarser ? levels_.difference(coarse, *coarser, i) : LevelDifference{};
      ToleranceOutput& output = trial.outputs[i];
      const bool isObserved = near.smooth > 0 && far.smooth > 0;
      const double order =
          std::clamp(isObserved ? std::log2(far.smooth / near.smooth) : kLeastOrder, kLeastOrder,
                     std::max(kLeastOrder, model_.order));
      // The surfaces at this voxel size and at twice the size may agree by chance. So the
      // difference that the order predicts from the two coarser runs is used if it is larger.
      const double expected = far.smooth / std::exp2(order);
      const double error = kSafety * std::max(near.smooth, expected) / (std::exp2(order) - 1);
      output.creaseShare = near.creaseShare;
      output.crease = kSafety * std::max(near.crease, far.crease / 2);
      if (output.isMeasured && output.achieved <= error) continue;
      output.isMeasured = false;
      output.achieved = error;
      output.order = order;
    }
  }

  /// Smallest voxel size, world units, that the memory limit allows, predicted from a trial. 0: no
  /// limit; the largest double: no size fits.
  [[nodiscard]] double leastVoxel(const Trial& trial) const {
    if (settings_.maxMemory == levelset::kNoMemoryLimit) return 0;
    // The working memory of operators and of comparisons is proportional to the surface area.
    constexpr double kVoxelBytes = 24, kTriangleBytes = 200, kUsable = 0.85;
    const double h = trial.level.voxelSize, peak = trial.level.peakBytes;
    const double least = kVoxelBytes * trial.level.voxels +
                         kTriangleBytes * static_cast<double>(trial.level.triangles);
    const double grown = std::max((peak - coarsePeak_) * 4 / 3, least);
    const double fixed = std::max(base_, peak - grown);
    const double room = kUsable * static_cast<double>(settings_.maxMemory) - fixed;
    return room > 0 ? h * std::sqrt(grown / room) : std::numeric_limits<double>::max();
  }

  // === The search
  /// Voxel size to try after a trial; empty: the search ends.
  std::optional<double> nextVoxel(const Trial& trial) {
    const double h = trial.level.voxelSize;
    const double step = std::clamp(
        std::pow(trial.aim / std::max(trial.ratio, 1e-9), 1 / trial.order), kFinest, kCoarsest);
    double next = h * step;
    if (trial.ratio > 1) {
      failing_ = std::min(failing_.value_or(h), h);
      next = std::min(next, 0.85 * h);
      if (reaching_ && next < 1.05 * *reaching_) return {};
    } else {
      reaching_ = std::max(reaching_.value_or(h), h);
      double most = coarsest();
      if (trial.hasCreases) most = std::min(most, kCreaseVoxels * trial.finest);
      if (trial.ratio >= kWasteful && h <= 1.2 * most) return {};
      next = std::min(next, most);
      if (failing_ && next > h && next > 0.95 * *failing_) next = std::sqrt(h * *failing_);
      if (next > h / 1.2 && next < 1.2 * h) return {};
      next = std::max(next, kFinest * h);
    }
    return rounded(next);
  }

  void search() {
    double voxel =
        std::max(longestSide_ / kMostFirst / kCoarsest,
                 std::min(outcome_.modelVoxelSize > 0
                              ? std::max(outcome_.modelVoxelSize, longestSide_ / kMostFirst)
                              : longestSide_ / kMostFirst,
                          coarsest()));
    voxel = rounded(voxel);
    int failures = 0;
    double before = 0, beforeRatio = 0;
    for (int round = 0; round < kMostRounds; ++round) {
      std::optional<Trial> trial = tryVoxelSize(voxel);
      if (!trial) {
        if (!best_) {
          // The voxels may be too large for an object. Try smaller voxels twice, then report the
          // error.
          if (++failures > 2) std::rethrow_exception(failure_);
          voxel = rounded(voxel / 4);
          continue;
        }
        outcome_.limit = outcome_.rounds.back().failure;
        if (turnToEstimates(voxel)) continue;
        if (best_->ratio <= 1 || ++failures > 2) return;
        voxel = rounded(std::sqrt(voxel * best_->level.voxelSize));
        if (voxel > 0.9 * best_->level.voxelSize) return;
        continue;
      }
      if (trial->ratio <= 1 && failures > 0) outcome_.limit.clear();
      const bool stalls =
          before > 1.4 * voxel && trial->ratio > 1 && trial->ratio > 0.85 * beforeRatio;
      before = voxel;
      beforeRatio = trial->ratio;
      const std::optional<double> next = nextVoxel(*trial);
      const double least = leastVoxel(*trial);
      const double order = trial->order, ratio = trial->ratio;
      keepBest(std::move(*trial));
      if (!next || failures > 2) return;
      // One voxel size at which the error does not fall may be chance. The search ends at the
      // second one, or at once if nodes have fixed voxel sizes.
      if (stalls && (++stalled_ > 1 || !parts_.fixed.empty())) {
        outcome_.limit = stallSentence();
        return;
      }
      double wanted = *next;
      if (wanted < least) {
        if (ratio <= 1) return;
        // Use the smallest voxels that memory allows, if they are clearly smaller than the current
        // ones.
        if (least > 0.85 * voxel) {
          if (turnToEstimates(voxel)) continue;
          outcome_.limit = memorySentence(voxel * std::pow(kAim / ratio, 1 / order));
          return;
        }
        wanted = rounded(1.02 * least);
      }
      voxel = wanted;
    }
    if (best_->ratio > 1 && outcome_.limit.empty())
      outcome_.limit = fmt::format("the limit of {} tried voxel sizes was reached", kMostRounds);
  }

  [[nodiscard]] std::string memorySentence(double voxel) const {
    return fmt::format("voxels of about {:.2g} would need more than --max-memory, {:.0f} MB", voxel,
                       static_cast<double>(settings_.maxMemory) * 1e-6);
  }
  [[nodiscard]] std::string stallSentence() const {
    for (const std::size_t i : parts_.fixed) {
      const std::map<std::string, std::string>& options = graph_.nodes[i].options;
      const char* option = options.contains("voxel") ? "voxel" : "resolution";
      return fmt::format("the error no longer falls with the voxel size; '{}' has a fixed --{} {}",
                         nameOf(graph_.nodes[i]), option, options.at(option));
    }
    return "the error no longer falls with the voxel size";
  }

  /// Runs the graph at a voxel size and records the outcome in the report.
  /// @return empty if the run failed
  std::optional<Trial> tryVoxelSize(double voxel) {
    malloc_trim(0);
    ToleranceRound& round = outcome_.rounds.emplace_back();
    round.voxelSize = voxel;
    const auto start = std::chrono::steady_clock::now();
    std::optional<Trial> trial;
    try {
      trial = tryVoxel(voxel);
      round.outputs = trial->outputs;
    } catch (const levelset::InvalidInput& error) {
      failure_ = std::current_exception();
      round.failure = error.what();
    } catch (const levelset::ResourceLimit& error) {
      if (!best_) throw;
      round.failure = error.what();
    }
    round.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return trial;
  }

  /// Keeps the better of two trials. Among trials within the tolerance, the coarser one is better,
  /// or with creases the later one. Among trials beyond the tolerance, the one with the smaller
  /// ratio of error to tolerance is better.
  void keepBest(Trial trial) {
    const bool isBetter =
        !best_ || (trial.ratio <= 1 ? best_->ratio > 1 || trial.hasCreases ||
                                          trial.level.voxelSize > best_->level.voxelSize
                                    : trial.ratio < best_->ratio);
    if (isBetter) best_ = std::move(trial);
  }

  // === The end
  void finish() {
    Trial& best = *best_;
    outcome_.voxelSize = best.level.voxelSize;
    outcome_.outputs = best.outputs;
    for (StepReport& step : best.level.report.steps) report_.steps.push_back(std::move(step));
    for (const std::string& sentence : best.level.report.warnings)
      report_.warnings.push_back(sentence);
    for (const Message& text : best.level.messages) {
      if (text.kind == Message::Kind::Warn)
        settings_.warn(text.text);
      else if (text.kind == Message::Kind::Note)
        settings_.note(text.text);
      else if (settings_.print)
        settings_.print(text.text);
    }
    std::exception_ptr failure;
    try {
      levels_.runEnds(best.level, report_);
    } catch (const levelset::NumericalError&) {
      failure = std::current_exception();
    }
    for (const ToleranceOutput& output : outcome_.outputs) settings_.note(sentenceOf(output));
    if (!outcome_.isReached()) throw levelset::NumericalError(missSentence());
    if (!best.level.failure.empty()) throw levelset::NumericalError(best.level.failure);
    if (failure) std::rethrow_exception(failure);
  }

  [[nodiscard]] std::string sentenceOf(const ToleranceOutput& output) const {
    std::string text =
        fmt::format("{}: error about {:.2g} with voxels of {:.3g}, {:.4g} requested", output.name,
                    output.achieved, outcome_.voxelSize, output.requested);
    if (output.crease > output.requested)
      text +=
          fmt::format("; near creases, which the field cannot represent, {:.2g}", output.crease);
    return text;
  }

  [[nodiscard]] std::string missSentence() const {
    const auto worst =
        std::max_element(outcome_.outputs.begin(), outcome_.outputs.end(),
                         [](const ToleranceOutput& a, const ToleranceOutput& b) {
                           return a.achieved / a.requested < b.achieved / b.requested;
                         });
    return fmt::format(
        "--tolerance: {:.4g} was requested, but '{}' has an error of {:.2g} with voxels of {:.3g}; "
        "{}; "
        "the best result was written: use a larger tolerance, or more memory",
        worst->requested, worst->name, worst->achieved, outcome_.voxelSize, outcome_.limit);
  }

  const Graph& graph_;
  const RunSettings& settings_;
  RunReport& report_;
  Length tolerance_;
  ToleranceParts parts_;
  GraphModel model_;
  LevelRunner levels_;
  ToleranceReport outcome_;
  /// Longest side of the largest and of the smallest object, world units.
  double longestSide_ = 0, shortestSide_ = std::numeric_limits<double>::max();
  /// Resident memory before the search, and peak memory of the run with twice as large voxels,
  /// bytes.
  double base_ = 0, coarsePeak_ = 0;
  std::optional<Trial> best_;
  std::optional<double>
      reaching_;  ///< largest voxel size at which the error was within the tolerance
  std::optional<double>
      failing_;  ///< smallest voxel size at which the error exceeded the tolerance
  std::exception_ptr failure_;
  int stalled_ = 0;  ///< number of voxel sizes at which the error did not fall
  struct Measured {
    double voxel = 0, error = 0;
  };
  std::map<std::size_t, Measured> measured_;  ///< last measured error, by index of the output
  bool believesMeasured_ = true;  ///< false: all errors are estimated from runs with larger voxels
};

}  // namespace

void runToTolerance(const Graph& graph, const RunSettings& settings, RunReport& report) {
  std::optional<ToleranceRun> run;
  const auto fillReport = [&](const std::string& error, int code) {
    report.dryRun = settings.dryRun;
    report.graphJson = graphJson(graph);
    report.error = error;
    report.exitCode = code;
    if (run) run->fillReport();
  };
  try {
    run.emplace(graph, settings, report).run();
    fillReport("", 0);
  } catch (const levelset::Error& error) {
    fillReport(error.what(), static_cast<int>(error.exitCode()));
    throw;
  } catch (const std::exception& error) {
    fillReport(error.what(), static_cast<int>(levelset::ExitCode::Input));
    throw;
  }
}

}  // namespace pipeline
