#pragma once

#include <openvdb/openvdb.h>

#include <filesystem>

// Private to levelset/files: NanoVDB's headers, four seconds of compile time, stay behind this
// one.

namespace levelset {

/// Writes a grid as a .nvdb file, uncompressed so that it can be mapped into memory.
void writeNanoGrid(const std::filesystem::path& path, const openvdb::FloatGrid& grid);

}  // namespace levelset
