#pragma once

#include <cstddef>

namespace levelset {

/// Returns the number of bytes that an operator may use: the smaller of `maxMemory` and the
/// physical memory of the machine.
[[nodiscard]] std::size_t memoryLimit(std::size_t maxMemory);

/// Returns the number of bytes that this process holds in memory; 0 if the system does not tell it.
[[nodiscard]] std::size_t residentBytes();

/// Returns how much of a limit is left, bytes. The command line limits the memory of the process;
/// a caller in C++ whose process is larger than the limit means the memory of an operator.
[[nodiscard]] std::size_t memoryLeft(std::size_t maxMemory);

}  // namespace levelset
