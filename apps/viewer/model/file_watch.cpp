#include "apps/viewer/model/file_watch.h"

#include <algorithm>
#include <system_error>

namespace viewer {

FileWatch::FileWatch(std::vector<std::filesystem::path> files) : files_(std::move(files)) {
  for (const std::filesystem::path& file : files_) known_.push_back(stateOf(file));
  last_ = known_;
}

FileWatch::State FileWatch::stateOf(const std::filesystem::path& file) {
  std::error_code wrong;
  State state;
  state.time = std::filesystem::last_write_time(file, wrong);
  if (wrong) return {};
  state.size = std::filesystem::file_size(file, wrong);
  if (wrong) return {};
  state.isThere = true;
  return state;
}

bool FileWatch::hasChanged() {
  std::vector<State> now;
  for (const std::filesystem::path& file : files_) now.push_back(stateOf(file));
  const bool isStill = now == last_;
  last_ = now;
  if (!isStill || isAnyMissing() || now == known_) return false;
  known_ = now;
  return true;
}

bool FileWatch::isAnyMissing() const {
  return std::any_of(last_.begin(), last_.end(), [](const State& s) { return !s.isThere; });
}

}  // namespace viewer
