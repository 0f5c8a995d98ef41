#pragma once

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <cstddef>

namespace support {

/// Calls `run` on exactly `threads` threads, whatever the number of cores. A limit alone gives at
/// most one thread per core.
template <typename F>
auto onThreads(std::size_t count, const F& run) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, count);
  tbb::task_arena arena(static_cast<int>(count));
  return arena.execute(run);
}

}  // namespace support
