#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/points/field/signed_field.h"
#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset::points {

/// Samples a field in blocks of 8³ grid points beside its surface. Starts at the blocks that
/// contain points, and follows the surface from block to block. A box about the cloud closes a
/// surface that reaches it.
/// @param voxelSize  world units; grid points lie at its integer multiples
/// @param box        relative to OrientedPoints::centre
/// @return level set of half width 3 whose sign is right everywhere, and whose values need not be
///         distances
/// @throws NoSurface when the field has no zero there
/// @throws ResourceLimit, Cancelled
[[nodiscard]] openvdb::FloatGrid::Ptr sampleField(const SignedField& field, const Imath::Box3d& box,
                                                  double voxelSize, std::size_t maxMemory,
                                                  const Progress& progress);

/// Gives the other sign to solids and cavities that fewer than four points lie beside. Blends of
/// extrapolated surfaces leave such parts, of about a voxel, beside edges.
/// @return number of these parts
std::size_t dropPartsWithoutPoints(openvdb::FloatGrid& grid, const OrientedPoints& points);

}  // namespace levelset::points
