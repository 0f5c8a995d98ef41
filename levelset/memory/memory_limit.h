#pragma once

#include <cstddef>

namespace levelset {

/// Returns the number of bytes that an operator may use: the smaller of `maxMemory` and the
/// physical memory of the machine.
[[nodiscard]] std::size_t memoryLimit(std::size_t maxMemory);

/// Returns the number of bytes that this process holds in memory; 0 if the system does not tell it.
[[nodiscard]] std::size_t residentBytes();

/// Returns how much of a limit is left beside the memory of this process, bytes. Returns the whole
/// limit if the process is larger than that: then the limit can only be one of an operator.
[[nodiscard]] std::size_t memoryLeft(std::size_t maxMemory);

}  // namespace levelset
