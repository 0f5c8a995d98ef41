#pragma once

#include <cstddef>
#include <filesystem>

// Private to render: OpenEXR takes memory for whatever sizes a file claims.

namespace render {

/// Looks at the headers of an EXR file before OpenEXR does: every attribute must lie within the
/// file, and what tables and pixels they promise must be such as a file of its size can hold.
/// @throws levelset::InvalidInput for a file that is none or damaged
/// @param maxMemory  bytes that OpenEXR may take for a chunk
/// @throws levelset::ResourceLimit for more than kMaxPixels, or a chunk that is larger
void checkExrHeader(const std::filesystem::path& path, std::size_t maxMemory);

}  // namespace render
