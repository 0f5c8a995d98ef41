#pragma once

#include <cstddef>

namespace levelset {

/// Bytes that an operator may plan to use: the smaller of `maxMemory` and the machine's memory.
[[nodiscard]] std::size_t memoryLimit(std::size_t maxMemory);

}  // namespace levelset
