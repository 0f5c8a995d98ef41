#pragma once

#include <cstddef>
#include <filesystem>

// Private to render: checks of an EXR file that OpenEXR does not make. OpenEXR allocates memory for
// any size that a file claims. Header::setMaxImageSize and setMaxTileSize of OpenEXR 3.1 do not
// replace these checks: they limit width and height separately, and for the entire process, which
// may use OpenEXR for other files too. They do not check the number of pixels, the memory of a
// chunk, or the sizes of attributes and tables. Besides, OpenEXR has already read the header when
// it applies these limits.

namespace render {

/// Checks the headers of an EXR file before OpenEXR reads it. Every attribute must lie within the
/// file. The chunk tables and pixels that the headers announce must be possible for the size of the
/// file.
/// @param maxMemory  limit on OpenEXR's memory for one chunk, bytes
/// @throws levelset::InvalidInput when the file is not an EXR or is damaged
/// @throws levelset::ResourceLimit for more than kMaxPixels pixels, or a chunk that needs more than
/// maxMemory
void checkExrHeader(const std::filesystem::path& path, std::size_t maxMemory);

}  // namespace render
