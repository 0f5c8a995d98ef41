#include "apps/regress/output/plots.h"

#include <fmt/core.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <string>

#include "apps/regress/output/write_text.h"
#include "apps/regress/plots_py.h"

extern char** environ;

namespace regress {
namespace {

namespace fs = std::filesystem;

/// The exit status of `python script`, or -1 when there is no such program.
int runPython(const std::string& python, const fs::path& script, const fs::path& log) {
  std::string program = python, path = script.string();
  char* arguments[] = {program.data(), path.data(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  // Its own words belong neither to our data nor to our messages.
  posix_spawn_file_actions_addopen(&actions, 1, log.c_str(), 02000 | 0101, 0644);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed) return -1;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

std::vector<std::string> plotNames(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path& file = entry.path();
    if (file.extension() == ".svg" && file.stem().string().starts_with("plot-"))
      names.push_back(file.stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

Plots makePlots(const fs::path& folder) {
  for (const std::string& name : plotNames(folder)) {
    fs::remove(folder / (name + ".svg"));
    fs::remove(folder / (name + ".png"));
  }
  writeText(folder / "plots.py", kPlotsScript);
  const fs::path log = folder / "plots.log";
  // Distributions' own Python first: it is the one with the packaged matplotlib.
  int status = -1;
  for (const char* python : {"/usr/bin/python3", "python3"}) {
    status = runPython(python, folder / "plots.py", log);
    if (status == 0) break;
  }
  Plots plots;
  if (status != 0) {
    plots.notes.push_back(
        status < 0 ? "no plots: there is no python3; install it with python3-matplotlib and run "
                     "plots.py in the output folder"
                   : fmt::format("no plots: plots.py ended with {}, see plots.log; is "
                                 "python3-matplotlib installed?",
                                 status));
    return plots;
  }
  fs::remove(log);
  plots.names = plotNames(folder);
  return plots;
}

}  // namespace regress
