#pragma once

#include <cstddef>

namespace levelset {

/// `maxMemory`, or what the machine has if that is less: bytes that an operator may plan to use.
[[nodiscard]] std::size_t memoryLimit(std::size_t maxMemory);

}  // namespace levelset
