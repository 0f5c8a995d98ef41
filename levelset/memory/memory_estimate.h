#pragma once

// Includes OpenVDB, so include it from .cpp files only.

#include <optional>

#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Number and memory of the grid points that an operator computes around a surface.
struct MemoryEstimate {
  openvdb::CoordBBox surface;      ///< bounds of the surface, index space
  double area = 0;                 ///< area of the surface, voxels²
  double inside = 0, outside = 0;  ///< largest computed distances on the two sides, voxels
  /// Index box that limits the grid points; empty: no limit.
  std::optional<openvdb::CoordBBox> region = {};
  double bytesPerGridPoint = 20;
};

/// Refuses a computation that does not fit into memory, before it allocates.
/// @throws ResourceLimit when the grid points take more than `maxMemory` or the machine's memory,
///         or exceed the index range
void checkMemory(const MemoryEstimate& estimate, std::size_t maxMemory);

}  // namespace levelset::eikonal
