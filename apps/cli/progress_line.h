#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>

namespace cli {

enum class ProgressStyle { Off, Bar, Json };

/// Reports progress on standard error. The bar appears after an action has run for a second. In the
/// Json style, a line is printed at the start of each action, and then at most ten lines per
/// second.
class ProgressLine {
 public:
  /// @param actions  number of actions in the chain
  ProgressLine(ProgressStyle style, std::size_t actions) : style_(style), actions_(actions) {}
  /// Reports the progress of one action.
  /// @param index  position of the action in the chain, from 0 on
  /// @param fraction  from 0 to 1
  void update(std::size_t index, const std::string& action, double fraction);
  /// Erases the bar so that other text can be printed.
  void clear();

 private:
  ProgressStyle style_;
  std::size_t actions_;
  std::map<std::size_t, std::chrono::steady_clock::time_point>
      starts_;  // start of each action, by position in the chain
  std::chrono::steady_clock::time_point shown_;
  bool visible_ = false;
  std::mutex mutex_;
};

}  // namespace cli
