#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "levelset/terrain/tiles/patch_store.h"

/// Tiled terrain files (`.lst`): the patches of a pyramid, each compressed on its own.
namespace levelset {

/// Patches of one level of a file.
struct TileLevelInfo {
  std::uint64_t patches = 0;  ///< patches of the level
  std::uint64_t known = 0;    ///< those with at least one known sample
  std::uint64_t bytes = 0;    ///< compressed heights
};

/// Contents of a tiled terrain file, from its header and its index.
struct TiledGroundInfo {
  GroundLayout layout;
  /// Largest distance between a stored height and that of the ground from which the file was made;
  /// 0: the heights have the same bits.
  double tolerance = 0;
  std::uint64_t fileBytes = 0, indexBytes = 0;
  std::uint64_t hash = 0;  ///< differs between files of other contents
  std::vector<TileLevelInfo> levels;
};

/// Reads header and index.
/// @param maxMemory  limit for the pyramid and the index, bytes
/// @throws IoError when the file cannot be read
/// @throws InvalidInput for a file that is damaged, cut, of another version or of another format
/// @throws ResourceLimit
[[nodiscard]] TiledGroundInfo tiledGroundInfo(const std::filesystem::path& path,
                                              std::size_t maxMemory = kNoMemoryLimit);

/// Hash of a tiled terrain file from its header, which covers the checksums of all parts. The index
/// is read for its checksum, the heights are not.
/// @throws as tiledGroundInfo()
[[nodiscard]] std::uint64_t tiledGroundHash(const std::filesystem::path& path);

/// Opens a tiled terrain file. The file is mapped into memory: only pages in use are loaded.
/// Reading a patch compares its checksum, and throws InvalidInput if it differs.
///
/// In a file with a tolerance, ranges of patches are those of the stored heights. Errors and bounds
/// are the sum of the error against the stored ground and the tolerance, and so bound the distance
/// to the true ground. This includes level 0.
/// @throws as tiledGroundInfo()
[[nodiscard]] std::unique_ptr<PatchStore> openTiledGround(const std::filesystem::path& path,
                                                          std::size_t maxMemory = kNoMemoryLimit);

/// Returns true for a name that ends in .lst, and for "lst".
[[nodiscard]] bool isTiledGroundFormat(const std::filesystem::path& nameOrFormat);

}  // namespace levelset
