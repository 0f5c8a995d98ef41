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

/// Runs `python script`. @return its exit status, or -1 where the program does not exist
int runPython(const std::string& python, const fs::path& script, const fs::path& log) {
  std::string program = python, path = script.string();
  char* arguments[] = {program.data(), path.data(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  // The output of Python goes to a log, apart from our data and messages.
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
  // The Python of the distribution comes first, since it has the packaged matplotlib.
  int status = -1;
  for (const char* python : {"/usr/bin/python3", "python3"}) {
    status = runPython(python, folder / "plots.py", log);
    if (status == 0) break;
  }
  Plots plots;
  if (status != 0) {
    plots.notes.push_back(
        status < 0 ? "no plots: python3 is missing; install python3-matplotlib and run plots.py in "
                     "the output folder"
                   : fmt::format("no plots: plots.py failed with exit status {}; read plots.log "
                                 "and check that python3-matplotlib is installed",
                                 status));
    return plots;
  }
  fs::remove(log);
  plots.names = plotNames(folder);
  return plots;
}

}  // namespace regress
