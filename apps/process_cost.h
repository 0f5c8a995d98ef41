#pragma once

#include <malloc.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <limits>
#include <string>

/// Measures CPU time and memory of this process (Linux). Used by the runner and the regression
/// suite.
namespace apps {

/// CPU time of all threads of the process so far, seconds.
[[nodiscard]] inline double processCpuSeconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Reads a line of /proc/self/status whose value is given in kilobytes, such as "VmRSS:". Returns
/// bytes; NaN if the line is missing.
[[nodiscard]] inline double processStatusBytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(key)) return 1024 * std::atof(line.c_str() + key.size());
  return std::numeric_limits<double>::quiet_NaN();
}

/// Peak of the resident set since the last resetPeakResident(), bytes.
[[nodiscard]] inline double peakResidentBytes() {
  return processStatusBytes("VmHWM:");
}
inline void resetPeakResident() {
  std::ofstream("/proc/self/clear_refs") << "5";
}

struct Cost {
  double cpuSeconds = 0;
  double peakBytes = 0;  ///< largest growth of the resident set during the measured work, bytes
};

/// Runs `work` and measures its cost. Freed memory is first returned to the system. Memory that
/// `work` allocates then counts as growth of the resident set, even if the process had used it
/// before.
[[nodiscard]] inline Cost costOf(const std::function<void()>& work) {
  malloc_trim(0);
  resetPeakResident();
  const double before = processStatusBytes("VmRSS:");
  const double start = processCpuSeconds();
  work();
  const double seconds = processCpuSeconds() - start;
  return {seconds, std::max(0.0, peakResidentBytes() - before)};
}

}  // namespace apps
