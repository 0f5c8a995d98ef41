#include "levelset/memory/memory_limit.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace levelset {

std::size_t memoryLimit(std::size_t maxMemory) {
  const long pages = ::sysconf(_SC_PHYS_PAGES), size = ::sysconf(_SC_PAGESIZE);
  if (pages <= 0 || size <= 0) return maxMemory;
  const std::size_t physical = static_cast<std::size_t>(pages) * static_cast<std::size_t>(size);
  return std::max<std::size_t>(std::min(maxMemory, physical), 1);
}

std::size_t residentBytes() {
  std::ifstream statm("/proc/self/statm");
  std::size_t pages = 0, resident = 0;
  statm >> pages >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

std::size_t memoryLeft(std::size_t maxMemory) {
  const std::size_t resident = residentBytes();
  return resident < maxMemory ? maxMemory - resident : maxMemory;
}

}  // namespace levelset
