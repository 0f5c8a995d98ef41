#pragma once

#include <cstddef>

namespace levelset {

/// Returns the number of bytes that an operator may use: the smaller of `maxMemory` and the
/// physical memory of the machine.
[[nodiscard]] std::size_t memoryLimit(std::size_t maxMemory);

}  // namespace levelset
