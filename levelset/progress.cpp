#include "levelset/progress.h"

#include <fmt/core.h>

#include <algorithm>

#include "levelset/error.h"

namespace levelset {

void report(const Progress& progress, double fraction) {
  if (progress && !progress(fraction)) throw Cancelled("cancelled");
}

Progress subProgress(const Progress& whole, double from, double to) {
  if (!whole) return {};
  return [=](double fraction) { return whole(from + (to - from) * fraction); };
}

Progress monotonicProgress(const Progress& progress) {
  if (!progress) return {};
  return [progress, high = 0.0](double fraction) mutable {
    high = std::max(high, fraction);
    return progress(high);
  };
}

void requireMemory(double estimatedBytes, std::size_t maxBytes) {
  if (estimatedBytes <= static_cast<double>(maxBytes)) return;
  throw ResourceLimit(
      fmt::format("needs about {:.3g} GB of memory, which exceeds the limit of {:.3g} GB; use "
                  "larger voxels, fewer points or a part of the input, or raise --max-memory",
                  estimatedBytes * 1e-9, static_cast<double>(maxBytes) * 1e-9));
}

}  // namespace levelset
