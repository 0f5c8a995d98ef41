#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "levelset/progress.h"
#include "levelset/vdb.h"

// Private to levelset/files: writes grids to .vdb files.

namespace levelset {

/// Sets transform, name, class and creator of a grid that will be written.
void nameGrid(openvdb::GridBase& grid, const openvdb::math::Transform& transform,
              const std::string& name, openvdb::GridClass gridClass);

/// Writes a grid as a .vdb file. The content hash replaces OpenVDB's random identifier, so equal
/// grids give equal bytes.
/// @param hash  returns the content hash; called after the grid has been written
/// @throws std::ios_base::failure when the file cannot be written
void writeVdb(const std::filesystem::path& path, const openvdb::GridBase::ConstPtr& grid,
              const std::function<std::uint64_t()>& hash, const Progress& progress);

/// Writes a file by way of a temporary file, which replaces the target when it is complete.
/// @param write  writes the temporary file, whose path it receives
/// @throws IoError
void writeTarget(const std::filesystem::path& path,
                 const std::function<void(const std::filesystem::path&)>& write);

}  // namespace levelset
