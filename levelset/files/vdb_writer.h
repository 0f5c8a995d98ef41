#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>

#include "levelset/progress.h"
#include "levelset/vdb.h"

// Private to levelset/files and point_files: writes grids to .vdb files.

namespace levelset {

/// Sets transform, name, class and creator of a grid that will be written.
void nameGrid(openvdb::GridBase& grid, const openvdb::math::Transform& transform,
              const std::string& name, openvdb::GridClass gridClass);

/// Writes a .vdb file of one grid with OpenVDB's writer.
void writeGrid(std::ostream& out, const openvdb::GridBase::ConstPtr& grid);

/// Writes a .vdb file of one grid as writeGrid() does, but leaves the statistics in the metadata to
/// the caller. OpenVDB's writer computes them from the values, which need not be in memory.
void writeGridWithItsMetadata(std::ostream& out, const openvdb::GridBase& grid);

/// Writes a .vdb file of several grids with different names. `make` returns the grid of a number,
/// which is released before the next one is made.
void writeGridsInTurn(std::ostream& out, std::int32_t count,
                      const std::function<openvdb::GridBase::Ptr(std::int32_t)>& make);

/// Compression of the leaves in the files of writeGrid().
[[nodiscard]] std::uint32_t vdbCompression();

/// Writes a .vdb file. The content hash replaces OpenVDB's random identifier, so equal
/// grids give equal bytes.
/// @param bytes  number of bytes without compression, for the progress
/// @param write  calls writeGrid() or writeGridWithItsMetadata()
/// @param hash   returns the content hash; called after the grid has been written
/// @throws std::ios_base::failure when the file cannot be written
void writeVdb(const std::filesystem::path& path, double bytes,
              const std::function<void(std::ostream&)>& write,
              const std::function<std::uint64_t()>& hash, const Progress& progress);

/// Writes a file by way of a temporary file, which replaces the target when it is complete.
/// @param write  writes the temporary file, whose path it receives
/// @throws IoError
void writeTarget(const std::filesystem::path& path,
                 const std::function<void(const std::filesystem::path&)>& write);

}  // namespace levelset
