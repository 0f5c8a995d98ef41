#pragma once

#include <openvdb/openvdb.h>

#include <filesystem>

// Private to levelset/files. Isolates NanoVDB's headers, which take four seconds to compile.

namespace levelset {

/// Writes a grid as a .nvdb file, uncompressed, so that the file can be mapped into memory.
void writeNanoGrid(const std::filesystem::path& path, const openvdb::FloatGrid& grid);

}  // namespace levelset
