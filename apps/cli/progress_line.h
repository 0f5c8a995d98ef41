#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>

namespace cli {

enum class ProgressStyle { Off, Bar, Json };

/// Progress on standard error: a bar once an action has taken a second, or lines of JSON, one as
/// each action begins, and beside those ten a second at most.
class ProgressLine {
 public:
  ProgressLine(ProgressStyle style, std::size_t actions) : style_(style), actions_(actions) {}
  void update(std::size_t index, const std::string& action, double fraction);
  /// Wipes the bar so that other text can be printed.
  void clear();

 private:
  ProgressStyle style_;
  std::size_t actions_;
  std::map<std::size_t, std::chrono::steady_clock::time_point> starts_;  // by place in the chain
  std::chrono::steady_clock::time_point shown_;
  bool visible_ = false;
  std::mutex mutex_;
};

}  // namespace cli
