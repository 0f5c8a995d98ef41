#pragma once

#include <Imath/ImathBox.h>

#include <optional>

#include "levelset/terrain/height_field.h"
#include "levelset/terrain/tiles/patch_store.h"

namespace levelset {

struct ReadGroundOptions {
  /// Box of positions, borders included; its z does not count. Empty: the complete ground.
  std::optional<Imath::Box3d> box = {};
  int level = 0;  ///< level of the pyramid: every 2^level-th sample
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Reads a part of a ground at a level of its pyramid. The spacing is 2^level times that of the
/// ground, so the last samples are left out where they are not a whole number of spacings from the
/// first ones. The heights have the bits of the patches, for any number of threads.
/// @throws UsageError for a level that the pyramid does not have
/// @throws InvalidInput when the box has no sample, and as PatchStore::readPatch()
/// @throws ResourceLimit, Cancelled
[[nodiscard]] HeightField readGround(const PatchStore& store,
                                     const ReadGroundOptions& options = {});

/// Place and size of the result of readGround(), without heights.
/// @throws UsageError, InvalidInput as readGround()
[[nodiscard]] HeightField groundGrid(const GroundLayout& layout,
                                     const ReadGroundOptions& options = {});

/// Checks that the heights of a result of groundGrid() fit into memory.
/// @throws ResourceLimit, with the options that read less
void requireGroundMemory(const HeightField& grid, std::size_t maxMemory);

}  // namespace levelset
