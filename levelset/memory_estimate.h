#pragma once

// For the .cpp files of levelset/eikonal only.

#include <optional>

#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Extent of the grid points that an operator computes around a surface, in voxels.
struct MemoryEstimate {
  openvdb::CoordBBox surface;
  double area = 0;
  double inside = 0, outside = 0;  ///< distances from the surface, voxels
  std::optional<openvdb::CoordBBox> region = {};
  double bytesPerGridPoint = 20;
};

/// Refuses a computation that does not fit into memory, before it allocates.
/// @throws ResourceLimit when the grid points take more than `maxMemory` or the machine's memory,
///         or exceed the index range
void checkMemory(const MemoryEstimate& estimate, std::size_t maxMemory);

}  // namespace levelset::eikonal
