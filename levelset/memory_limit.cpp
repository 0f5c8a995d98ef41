#include "levelset/memory_limit.h"

#include <unistd.h>

#include <algorithm>

namespace levelset {

std::size_t memoryLimit(std::size_t maxMemory) {
  const long pages = ::sysconf(_SC_PHYS_PAGES), size = ::sysconf(_SC_PAGESIZE);
  if (pages <= 0 || size <= 0) return maxMemory;
  const std::size_t physical = static_cast<std::size_t>(pages) * static_cast<std::size_t>(size);
  return std::max<std::size_t>(std::min(maxMemory, physical), 1);
}

}  // namespace levelset
