#pragma once

#include <atomic>
#include <cstddef>
#include <mutex>

#include "levelset/progress.h"

namespace levelset {

/// Lets parallel tasks report progress to one callback. Only one thread at a time calls it, with a
/// fraction that never decreases. A task skips its report while another one reports, so no task
/// waits. For code of this library only.
class ProgressGate {
 public:
  ProgressGate(const Progress& progress, std::size_t total)
      : progress_(progress), total_(static_cast<double>(total ? total : 1)) {}

  /// Adds finished items to the count and reports the fraction of `total`.
  /// @throws Cancelled
  void advance(std::size_t count) {
    done_.fetch_add(count, std::memory_order_relaxed);
    if (!progress_) return;
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return;
    const double fraction = static_cast<double>(done_.load(std::memory_order_relaxed)) / total_;
    report(progress_, fraction < 1 ? fraction : 1.0);
  }

 private:
  const Progress& progress_;
  double total_;
  std::atomic<std::size_t> done_{0};
  std::mutex mutex_;
};

}  // namespace levelset
