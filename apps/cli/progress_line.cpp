#include "apps/cli/progress_line.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdio>

namespace cli {

void ProgressLine::update(std::size_t index, const std::string& action, double fraction) {
  using namespace std::chrono_literals;
  if (style_ == ProgressStyle::Off) return;
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  const auto [step, isNew] = starts_.try_emplace(index, now);
  if (now - shown_ < 100ms && !isNew) return;
  if (style_ == ProgressStyle::Json) {
    fmt::print(stderr,
               "{{\"step\": {}, \"steps\": {}, \"action\": \"{}\", \"fraction\": {:.3f}}}\n",
               index + 1, actions_, action, fraction);
    shown_ = now;
    return;
  }
  if (now - step->second < 1s) return;
  constexpr int kWidth = 30;
  const int full = static_cast<int>(std::clamp(fraction, 0.0, 1.0) * kWidth);
  fmt::print(stderr, "\r[{}/{}] {:<14} [{}{}] {:3.0f} %", index + 1, actions_, action,
             std::string(static_cast<std::size_t>(full), '#'),
             std::string(static_cast<std::size_t>(kWidth - full), '.'), 100 * fraction);
  std::fflush(stderr);
  shown_ = now;
  visible_ = true;
}

void ProgressLine::clear() {
  const std::lock_guard lock(mutex_);
  if (visible_) fmt::print(stderr, "\r\033[K");
  visible_ = false;
}

}  // namespace cli
