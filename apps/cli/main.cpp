#include <fmt/core.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "apps/cli/progress_line.h"
#include "apps/cli/watch.h"
#include "apps/pipeline/grammar/chain.h"
#include "apps/pipeline/graph/graph_file.h"
#include "apps/pipeline/help/help.h"
#include "apps/pipeline/report/report.h"
#include "apps/pipeline/run/planner.h"
#include "apps/pipeline/run/runner.h"
#include "apps/pipeline/tolerance/tolerance.h"
#include "apps/pipeline/values/refusal.h"
#include "apps/pipeline/values/units.h"
#include "levelset/error.h"
#include "levelset/file_target.h"

namespace {

using levelset::ExitCode;

void printAll(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw levelset::IoError(
        fmt::format("standard output cannot be written: {}", std::strerror(errno)));
}

/// Largest value of --threads. More threads bring no gain, and some systems do not allow more.
constexpr long kMostThreads = 1024;

/// Prints a sentence on standard error. Puts the name of the program in front of it, unless the
/// sentence starts with that name.
void printMessage(const std::string& sentence) {
  fmt::print(stderr, "{}{}\n",
             sentence.starts_with("levelsmith: ") ? "" : "levelsmith: ", sentence);
}

/// Prints the message of an error. @return the exit code of the program
int printFailure(const std::exception_ptr& failure) {
  try {
    if (failure) std::rethrow_exception(failure);
  } catch (const levelset::Error& error) {
    printMessage(error.what());
    return static_cast<int>(error.exitCode());
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "levelsmith: memory ran out; use larger voxels or a narrower band\n");
    return static_cast<int>(ExitCode::Resource);
  } catch (const std::exception& error) {
    if (pipeline::isThreadLimitError(error)) {
      fmt::print(stderr, "levelsmith{}\n", pipeline::kThreadLimitMessage);
      return static_cast<int>(ExitCode::Resource);
    }
    fmt::print(
        stderr,
        "levelsmith: unexpected failure: {}; please report it with the command that caused it\n",
        error.what());
    return static_cast<int>(ExitCode::Input);
  } catch (...) {
  }
  fmt::print(stderr,
             "levelsmith: unexpected failure; please report it with the command that caused it\n");
  return static_cast<int>(ExitCode::Input);
}

/// Terminate handler, for exceptions that cannot be caught. An example is TBB's failure to start a
/// thread that the system refuses. Removes temporary files and ends the process.
[[noreturn]] void endUnexpectedly() {
  levelset::removeTemporaryFiles();
  _exit(printFailure(std::current_exception()));
}

bool claimsStandardOutput(const pipeline::Graph& graph) {
  const auto report = graph.globals.find("report");
  if (report != graph.globals.end() && levelset::isStandardOutput(report->second)) return true;
  for (const pipeline::Node& node : graph.nodes) {
    const auto& claims = node.op->usesStandardOutput;
    if (claims && !node.options.contains("json") &&
        claims(pipeline::Invocation(*node.op, node.options)))
      return true;
  }
  return false;
}

bool claimsJson(const pipeline::Graph& graph) {
  for (const pipeline::Node& node : graph.nodes)
    if (node.options.contains("json")) return true;
  return false;
}

cli::ProgressStyle progressStyle(const pipeline::Graph& graph) {
  const auto it = graph.globals.find("progress");
  const std::string choice = it == graph.globals.end() ? "auto" : it->second;
  if (choice == "json") return cli::ProgressStyle::Json;
  if (choice == "off" || graph.globals.contains("quiet") || !isatty(STDERR_FILENO))
    return cli::ProgressStyle::Off;
  return cli::ProgressStyle::Bar;
}

int runGraph(const pipeline::Graph& graph) {
  const auto& globals = graph.globals;
  const std::size_t maxMemory = globals.contains("max-memory")
                                    ? pipeline::parseBytes(globals.at("max-memory"), "--max-memory")
                                    : cli::defaultMemoryLimit();
  cli::startWatch(maxMemory);
  std::unique_ptr<tbb::global_control> limit;
  tbb::task_arena arena;
  if (globals.contains("threads")) {
    const auto threads = pipeline::parseInteger(globals.at("threads"), "--threads");
    if (threads > kMostThreads)
      throw levelset::UsageError(
          fmt::format("--threads: {} exceeds the limit of {}; give about the number of cores",
                      threads, kMostThreads));
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(threads));
    arena.initialize(static_cast<int>(
        threads));  // `threads` may exceed the number of cores, the default size of an arena
  }
  if (globals.contains("no-clobber")) levelset::setClobberDefault(false);
  pipeline::checkRunTargets(graph);
  if (globals.contains("save-graph")) pipeline::writeGraph(globals.at("save-graph"), graph);
  const bool quiet = globals.contains("quiet"), verbose = globals.contains("verbose"),
             dryRun = globals.contains("dry-run");
  const bool dataOnly = claimsStandardOutput(graph), json = claimsJson(graph);

  if (globals.contains("explain")) {
    for (const char* option : {"tolerance", "report"})
      if (globals.contains(option))
        throw levelset::UsageError(fmt::format(
            "--explain: nothing runs, so --{} has no effect; leave one of them out", option));
    pipeline::explain(graph, maxMemory, globals.contains("no-roi") || globals.contains("cache"),
                      printAll);
    return static_cast<int>(ExitCode::Done);
  }

  cli::ProgressLine line(progressStyle(graph), graph.nodes.size());
  pipeline::RunSettings settings;
  settings.dryRun = dryRun;
  settings.maxMemory = maxMemory;
  settings.fullValues = globals.contains("no-roi");
  if (globals.contains("cache")) settings.cache = globals.at("cache");
  settings.measureErrors = settings.measurePeaks = verbose || globals.contains("report");
  if (globals.contains("report") && pipeline::isPage(globals.at("report")))
    settings.thumbnails = pipeline::kMostThumbnails;
  settings.begin = [](const std::string& action) { cli::tellAction(action); };
  settings.progress = [&](std::size_t index, const std::string& action, double fraction) {
    line.update(index, action, fraction);
  };
  settings.print = [&](const std::string& text) {
    line.clear();
    // Keep standard output clean for data: texts for people go to standard error when an action
    // writes data or JSON to standard output.
    if (dataOnly || (json && !text.starts_with("{")))
      fmt::print(stderr, "{}", text);
    else
      printAll(text);
  };
  settings.warn = [&](const std::string& sentence) {
    line.clear();
    if (!quiet) printMessage("warning: " + sentence);
  };
  settings.note = [&](const std::string& sentence) {
    line.clear();
    if (!quiet) printMessage(sentence);
  };
  pipeline::RunReport report;
  const auto finish = [&] {
    line.clear();
    if (verbose || dryRun)
      for (const pipeline::StepReport& step : report.steps)
        fmt::print(stderr, "{}\n", pipeline::stepLine(step, dryRun));
    if (report.tolerance && (verbose || dryRun))
      for (const std::string& text : pipeline::toleranceLines(*report.tolerance))
        fmt::print(stderr, "{}\n", text);
    if (globals.contains("report")) pipeline::writeReport(globals.at("report"), report);
  };
  try {
    arena.execute([&] {
      if (globals.contains("tolerance"))
        pipeline::runToTolerance(graph, settings, report);
      else
        pipeline::run(graph, settings, report);
    });
  } catch (const std::exception&) {
    // The error of the run takes precedence over an error in finish(), which is only printed.
    try {
      finish();
    } catch (const levelset::Error& error) {
      printMessage(error.what());
    }
    throw;
  }
  finish();
  return static_cast<int>(ExitCode::Done);
}

int levelsmith(const std::vector<std::string>& words) {
  if (words.empty() || words[0] == "--help" || words[0] == "-h") {
    printAll(pipeline::helpOverview());
    return words.empty() ? static_cast<int>(ExitCode::Usage) : 0;
  }
  if (words[0] == "--version") {
    printAll("levelsmith " LEVELSMITH_VERSION "\n");
    return 0;
  }
  if (words[0] != "help") {
    if (const std::optional<std::string> action = pipeline::helpRequest(words)) {
      printAll(action->empty() ? pipeline::helpOverview() : pipeline::help({*action}));
      return 0;
    }
  }
  if (words[0] == "help") {
    printAll(pipeline::help({words.begin() + 1, words.end()}));
    return 0;
  }
  const pipeline::Graph graph = pipeline::parseChain(words);
  if (!graph.globals.contains("quiet"))
    for (const std::string& sentence : graph.renamed) printMessage(sentence);
  return runGraph(graph);
}

}  // namespace

int main(int argc, char** argv) {
  std::set_terminate(endUnexpectedly);
  int code = 0;
  try {
    code = levelsmith({argv + 1, argv + argc});
  } catch (...) {
    code = printFailure(std::current_exception());
  }
  std::fflush(stderr);
  levelset::removeTemporaryFiles();
  // Skip destructors, because the thread of startWatch() still runs.
  if (std::fflush(stdout) != 0 && code == 0) code = static_cast<int>(ExitCode::File);
  _exit(code);
}
