#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "mapping/patches/patch.h"

/// Patches in files: JSON with the particles of every layer, to the last bit.
namespace mapping {

/// @throws InvalidInput when a number is not finite; IoError when the file cannot be made
void writePatches(const std::filesystem::path& file, std::span<const Patch> patches);

/// @throws IoError when the file cannot be read; InvalidInput, telling what and where, when it is
///         not one of patches or its counts and numbers make none; ResourceLimit
[[nodiscard]] std::vector<Patch> readPatches(const std::filesystem::path& file,
                                             std::size_t maxMemory = levelset::kNoMemoryLimit);

/// True for a name, or a format, that readPatches understands: .patch.
[[nodiscard]] bool isPatchFormat(const std::string& name);

}  // namespace mapping
