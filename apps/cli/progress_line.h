#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>

namespace cli {

enum class ProgressStyle { Off, Bar, Json };

/// Reports progress on standard error. The bar appears once an action has run for a second. JSON
/// lines appear at the start of each action, and then at most ten per second.
class ProgressLine {
 public:
  ProgressLine(ProgressStyle style, std::size_t actions) : style_(style), actions_(actions) {}
  void update(std::size_t index, const std::string& action, double fraction);
  /// Erases the bar so that other text can be printed.
  void clear();

 private:
  ProgressStyle style_;
  std::size_t actions_;
  std::map<std::size_t, std::chrono::steady_clock::time_point> starts_;  // by position in the chain
  std::chrono::steady_clock::time_point shown_;
  bool visible_ = false;
  std::mutex mutex_;
};

}  // namespace cli
