#pragma once

// Steps of constructive solid geometry on grids. Includes OpenVDB: for .cpp files only.

#include <optional>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/grids/grid_queries_vdb.h"
#include "levelset/vdb.h"

namespace levelset {

/// Signs, each ±1, that reduce every operation to a minimum: result × min(first × a, second × b).
/// An algorithm for the inside of a union then serves for the outside of an intersection.
struct CsgSigns {
  float first, second, result;
};
[[nodiscard]] CsgSigns csgSigns(CsgOperation operation);

/// Combines two grids with equal transforms and backgrounds. Corrects the distances where the
/// minimum or maximum is not a distance. The result may have no inside.
[[nodiscard]] openvdb::FloatGrid::Ptr mergePair(CsgOperation operation, const openvdb::FloatGrid& a,
                                                const openvdb::FloatGrid& b);

/// Combines two grids by minimum or maximum only, without correction. Takes the signs outside the
/// band from the operands, also where a band is cropped. OpenVDB's own CSG functions flood-fill
/// signs within a node instead.
[[nodiscard]] openvdb::FloatGrid::Ptr mergePlain(CsgOperation operation,
                                                 const openvdb::FloatGrid& a,
                                                 const openvdb::FloatGrid& b);

/// Copies of two operands, changed by closeContacts().
struct ClosedPair {
  openvdb::FloatGrid::Ptr a, b;
};
/// Closes cracks between faces of the two operands that touch on grid points. Both distances are
/// zero at these grid points, so the minimum would leave a crack of zero width. Gives both operands
/// the depth of the inside neighbours at these grid points.
/// @return empty if there are no such points
[[nodiscard]] std::optional<ClosedPair> closeContacts(const openvdb::FloatGrid& a,
                                                      const openvdb::FloatGrid& b,
                                                      const CsgSigns& signs);

/// Returns the origins of the leaf blocks in which the surfaces of both operands coincide with
/// opposite orientation. Such faces bound no solid in the result. But the minimum of both distances
/// is zero, or nearly zero, along these faces, and is the distance to them nearby.
[[nodiscard]] std::vector<openvdb::Coord> coincidentFaces(const openvdb::FloatGrid& a,
                                                          const openvdb::FloatGrid& b,
                                                          const CsgSigns& signs);

/// Corrects the minimum of two distances where it is only a bound. Inside a union, the nearest
/// point on one solid may lie inside the other; the surface is then farther away than either
/// distance. The correction measures the distance to the planes that fit both surfaces in nearby
/// cells, and to their intersection lines. Voxels next to the zero set keep their values, so the
/// surface stays.
/// @param result  uncorrected combination signs.result × min(signs.first × a, signs.second × b),
///                with the transform and background of `a` and `b`
void correctSeam(openvdb::FloatGrid& result, const openvdb::FloatGrid& a,
                 const openvdb::FloatGrid& b, const CsgSigns& signs);

}  // namespace levelset
