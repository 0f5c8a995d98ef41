#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <functional>
#include <vector>

#include "levelset/points/field/cell_points.h"
#include "levelset/points/field/oriented_points.h"
#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset::points {

/// Memory of one thread, for positions near each other.
struct FieldMemory {
  std::vector<FoundItem> found = {}, candidates = {};
  CellPoints cell = {};
  Imath::V3d at = Imath::V3d(0);  ///< position of the last winding number
  double winding = 0.5;
  double sameSide = 0;  ///< where it holds, see SignedField
};

/// Grid points of a cube of 4³, in the order of a Z curve: each eight of them are a cube of 2³.
using CubePositions = std::array<Imath::V3d, 64>;
using CubeValues = std::array<double, 64>;

/// Field to sample, at positions relative to a centre. The last argument bounds the values that are
/// needed: a value beyond it may be replaced by another one of its sign beyond it. Several threads
/// may call the field at once.
using SampledField =
    std::function<void(const CubePositions&, CubeValues&, FieldMemory&, double bound)>;

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
