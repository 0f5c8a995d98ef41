#pragma once

// For the .cpp files of levelset/eikonal only.

#include <optional>

#include "levelset/vdb.h"

namespace levelset::eikonal {

/// What is asked for around a surface, in voxels.
struct MemoryEstimate {
  openvdb::CoordBBox surface;
  double area = 0;
  double inside = 0, outside = 0;  ///< distances
  std::optional<openvdb::CoordBBox> region = {};
  double bytesPerGridPoint = 20;
};

/// Refuses what cannot fit before anything is allocated.
/// @throws ResourceLimit when the grid points reached take more than `maxMemory` or than there is,
///         or pass the range of indices
void checkMemory(const MemoryEstimate& room, std::size_t maxMemory, const char* action);

}  // namespace levelset::eikonal
