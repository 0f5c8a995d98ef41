#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "mapping/patches/patch.h"

/// Patch files: JSON with the particles of every layer, exact to the last bit.
namespace mapping {

/// Writes patches to a file.
/// @throws InvalidInput if a number is not finite
/// @throws IoError if the file cannot be written
void writePatches(const std::filesystem::path& file, std::span<const Patch> patches);

/// Reads patches from a file. Errors name the position in the file.
/// @throws IoError if the file cannot be read
/// @throws InvalidInput if the file is not a patch file, or its counts and numbers are inconsistent
/// @throws ResourceLimit if reading the file needs more than `maxMemory` bytes
[[nodiscard]] std::vector<Patch> readPatches(const std::filesystem::path& file,
                                             std::size_t maxMemory = levelset::kNoMemoryLimit);

/// True for a file name or format that readPatches understands: .patch.
[[nodiscard]] bool isPatchFormat(const std::string& name);

}  // namespace mapping
