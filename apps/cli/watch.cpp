#include "apps/cli/watch.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>

#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/memory/memory_limit.h"

namespace cli {
namespace {

std::mutex actionMutex;
std::string currentAction = "levelsmith";

std::string memorySentence() {
  const std::lock_guard lock(actionMutex);
  return "\nlevelsmith: " + currentAction +
         ": the memory in use exceeds --max-memory; use larger voxels or a narrower band, or raise "
         "the limit\n";
}

[[noreturn]] void endNow(const char* sentence, int code) {
  levelset::removeTemporaryFiles();
  (void)!write(STDERR_FILENO, sentence, std::strlen(sentence));
  _exit(code);
}

void watch(sigset_t signals, std::size_t maxBytes) {
  constexpr timespec kInterval{0, 50'000'000};
  for (;;) {
    const int signal = sigtimedwait(&signals, nullptr, &kInterval);
    if (signal == SIGINT)
      endNow("\nlevelsmith: interrupted; unfinished files are removed\n",
             static_cast<int>(levelset::ExitCode::Interrupted));
    if (signal > 0)
      endNow("\nlevelsmith: ended by a signal; unfinished files are removed\n", 128 + signal);
    if (levelset::residentBytes() > maxBytes)
      endNow(memorySentence().c_str(), static_cast<int>(levelset::ExitCode::Resource));
  }
}

}  // namespace

void startWatch(std::size_t maxBytes) {
  std::signal(SIGPIPE, SIG_IGN);
  // Restore the default: a shell starts background jobs with SIGINT ignored, and an ignored signal
  // never reaches the thread of watch().
  std::signal(SIGINT, SIG_DFL);
  sigset_t signals;
  sigemptyset(&signals);
  for (int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::thread(watch, signals, maxBytes).detach();
}

void tellAction(const std::string& action) {
  const std::lock_guard lock(actionMutex);
  currentAction = action;
}

std::size_t defaultMemoryLimit() {
  std::ifstream meminfo("/proc/meminfo");
  for (std::string line; std::getline(meminfo, line);) {
    if (line.starts_with("MemAvailable:"))
      return static_cast<std::size_t>(0.8 * 1024 *
                                      static_cast<double>(std::atoll(line.c_str() + 13)));
  }
  return static_cast<std::size_t>(-1);
}

}  // namespace cli
