#pragma once

// Internal header of levelset: public headers must not include it.

#include <functional>
#include <vector>

#include "levelset/points/field/oriented_points.h"
#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset::points {

/// Memory of one thread, for positions near each other.
struct FieldMemory {
  std::vector<FoundItem> found = {};
  Imath::V3d at = Imath::V3d(0);  ///< position of the last winding number
  double winding = 0.5;
  bool isNear = false;  ///< the last position was near the points
};

/// Field to sample, at positions relative to a centre. Several threads may call it at once.
using SampledField = std::function<double(const Imath::V3d&, FieldMemory&)>;

/// Where a field is sampled.
struct SampleFrame {
  Imath::V3d centre;  ///< world position of the origin of the field
  Imath::Box3d box;   ///< closes a surface that reaches it; relative to the centre
  double voxelSize;   ///< world units; grid points lie at its integer multiples
};

/// Returns the origin of the block that contains a position, relative to the centre of the frame.
[[nodiscard]] openvdb::Coord blockAt(const SampleFrame& frame, const Imath::V3d& position);

/// Samples a field in blocks of 8³ grid points beside its surface. Starts at some blocks, and
/// follows the surface from block to block.
/// @return level set of half width 3 whose sign is right everywhere, and whose values need not be
///         distances
/// @throws NoSurface when the field has no zero there
/// @throws ResourceLimit, Cancelled
[[nodiscard]] openvdb::FloatGrid::Ptr sampleField(const SampledField& field,
                                                  const SampleFrame& frame,
                                                  std::vector<openvdb::Coord> blocks,
                                                  std::size_t maxMemory, const Progress& progress);

/// Gives the other sign to solids and cavities that fewer than four points lie beside. Blends of
/// extrapolated surfaces leave such parts, of about a voxel, beside edges.
/// @return number of these parts
std::size_t dropPartsWithoutPoints(openvdb::FloatGrid& grid, const OrientedPoints& points);

}  // namespace levelset::points
