#pragma once

#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>

namespace cli {

enum class ProgressStyle { Off, Bar, Json };

/// Progress on standard error: a bar once an action has taken a second, or a line of JSON at most
/// ten times a second.
class ProgressLine {
 public:
  ProgressLine(ProgressStyle style, std::size_t actions) : style_(style), actions_(actions) {}
  void update(std::size_t index, const std::string& action, double fraction);
  /// Wipes the bar so that other text can be printed.
  void clear();

 private:
  ProgressStyle style_;
  std::size_t actions_;
  std::size_t current_ = static_cast<std::size_t>(-1);
  std::chrono::steady_clock::time_point start_, shown_;
  bool visible_ = false;
  std::mutex mutex_;
};

}  // namespace cli
