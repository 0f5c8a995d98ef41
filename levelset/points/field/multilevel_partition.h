#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/points/field/point_field.h"
#include "levelset/progress.h"

namespace levelset::points {

/// Multi-level partition of unity [Ohtake03]: an octree whose cells hold one height function each,
/// or two or three that meet in an edge or a corner. A cell is split until its functions lie within
/// a tolerance of its points. The field blends the functions of the cells near a position.
/// @param points      must outlive the field
/// @param neighbours  least number of points of a height function
/// @param tolerance   largest distance of a point from the surface, world units; cells with few
///                    points may exceed it
/// @throws ResourceLimit, Cancelled
[[nodiscard]] PointField multilevelPartition(const OrientedPoints& points, std::size_t neighbours,
                                             double tolerance, std::size_t maxMemory,
                                             const Progress& progress);

}  // namespace levelset::points
