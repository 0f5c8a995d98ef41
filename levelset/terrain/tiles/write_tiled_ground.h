#pragma once

#include <filesystem>

#include "levelset/terrain/files/height_rows.h"
#include "levelset/terrain/height_field.h"

/// Writes tiled terrain files (`.lst`).
namespace levelset {

struct WriteTilesOptions {
  int cells = 64;  ///< cells along a side of a patch: a power of two from 2 to 128
  /// Largest distance between a stored height and the true one; 0: the heights keep their bits.
  double tolerance = 0;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Writes the ground of a source of rows. The memory is that of about four rows of patches, and 110
/// bytes for each patch: the ground may be larger than the memory. The ranges, errors and bounds
/// of all patches have the bits of heightPyramid() of the stored ground; the tolerance is added to
/// errors and bounds. Equal grounds in the same order of rows give equal files, for any number of
/// threads. The number that marks missing samples is not stored.
/// @throws UsageError for a number of cells out of range, or a tolerance that is negative or not
///         finite
/// @throws InvalidInput for a ground of less than 2x2 samples, and for errors of the source
/// @throws IoError, ResourceLimit, Cancelled; the target keeps its former contents then
void writeTiledGround(const std::filesystem::path& path, HeightRows& rows,
                      const WriteTilesOptions& options = {});
void writeTiledGround(const std::filesystem::path& path, const HeightField& field,
                      const WriteTilesOptions& options = {});

}  // namespace levelset
