#pragma once

// Steps of constructive solid geometry on grids. Includes OpenVDB: for .cpp files only.

#include <optional>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/grids/grid_queries_vdb.h"
#include "levelset/vdb.h"

namespace levelset {

/// Signs that reduce every operation to a minimum: result × min(first × a, second × b), each ±1. A
/// rule for the inside of a union then applies to the outside of an intersection.
struct CsgSigns {
  float first, second, result;
};
[[nodiscard]] CsgSigns csgSigns(CsgOperation operation);

/// Combines two grids with equal transforms and backgrounds. Corrects the distances where the
/// minimum or maximum is not a distance. The result may have no inside.
[[nodiscard]] openvdb::FloatGrid::Ptr mergePair(CsgOperation operation, const openvdb::FloatGrid& a,
                                                const openvdb::FloatGrid& b);

/// Combines two grids by minimum or maximum only, without correction. Takes signs from the operands
/// even where a band is cropped, unlike OpenVDB's own operation, which floods them within a node.
[[nodiscard]] openvdb::FloatGrid::Ptr mergePlain(CsgOperation operation,
                                                 const openvdb::FloatGrid& a,
                                                 const openvdb::FloatGrid& b);

struct ClosedPair {
  openvdb::FloatGrid::Ptr a, b;
};
/// Closes cracks between faces that touch on grid points. Both distances are zero there, so their
/// minimum would leave a crack of zero width. Gives both operands the depth of their neighbours at
/// these points.
/// @return empty if there are no such points
[[nodiscard]] std::optional<ClosedPair> closeContacts(const openvdb::FloatGrid& a,
                                                      const openvdb::FloatGrid& b,
                                                      const CsgSigns& signs);

/// Finds the leaf blocks in which the surfaces coincide with opposite orientation. The minimum is
/// then zero, or nearly zero, along faces that bound no solid, and nearby distances refer to these
/// faces.
[[nodiscard]] std::vector<openvdb::Coord> coincidentFaces(const openvdb::FloatGrid& a,
                                                          const openvdb::FloatGrid& b,
                                                          const CsgSigns& signs);

/// Corrects the minimum of two distances where it is only a bound. Inside a union, the nearest
/// point on one solid may lie inside the other; the surface is then farther away than either
/// distance. The correction measures the distance to the planes that fit both surfaces in nearby
/// cells, and to their intersection lines. Voxels next to the zero set keep their values, so the
/// surface stays.
/// @param result  result × min(first × a, second × b), same transform and background as both
void correctSeam(openvdb::FloatGrid& result, const openvdb::FloatGrid& a,
                 const openvdb::FloatGrid& b, const CsgSigns& signs);

}  // namespace levelset
