#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "levelset/terrain/height_field.h"
#include "levelset/terrain/sample_range.h"

/// Changed heights of a terrain, which are kept in a file beside its data.
namespace levelset {

/// Samples along a side of a tile of edits. Tile (i, j) begins at sample (i, j) × kEditTile.
inline constexpr int kEditTile = 64;

struct GroundEdits {
  struct Tile {
    std::uint32_t column = 0, row = 0;  ///< place of the tile
    std::vector<float> heights;         ///< its samples in the field, row by row from the south
  };
  std::uint64_t baseHash = 0;  ///< HeightField::contentHash() of the unchanged terrain
  int columns = 0, rows = 0;   ///< samples of the terrain
  std::vector<Tile> tiles;     ///< by row and column, each at most once
};

/// Notes which tiles of a terrain have changed.
class GroundChanges {
 public:
  /// @param base  the unchanged terrain
  explicit GroundChanges(const HeightField& base);

  void add(const SampleRange& changed);
  /// Adds the tiles of earlier edits of the same terrain.
  void add(const GroundEdits& edits);
  /// Heights of all tiles that were added. @param field  the changed terrain
  /// @throws ResourceLimit
  [[nodiscard]] GroundEdits edits(const HeightField& field,
                                  std::size_t maxMemory = kNoMemoryLimit) const;

 private:
  std::uint64_t baseHash_;
  std::size_t tileColumns_;
  std::vector<bool> hasChanged_;  // by row and column of tiles
};

/// Gives a terrain the heights of the edits.
/// @throws InvalidInput for edits of another terrain; the field is unchanged then
void applyEdits(HeightField& field, const GroundEdits& edits);

/// Writes edits to a file (`.edits`): 8 bytes "LSEDITS1", numbers of little endian with the base's
/// hash (u64), columns, rows and number of tiles (u32 each), then each tile with its column and row
/// (u32) and its heights (f32), and a hash of all bytes before (u64). The file is complete or keeps
/// its old content.
/// @throws IoError
void writeGroundEdits(const std::filesystem::path& path, const GroundEdits& edits);

/// @throws IoError when the file cannot be opened
/// @throws InvalidInput for a file that is damaged or no file of edits
/// @throws ResourceLimit
[[nodiscard]] GroundEdits readGroundEdits(const std::filesystem::path& path,
                                          std::size_t maxMemory = kNoMemoryLimit);

}  // namespace levelset
