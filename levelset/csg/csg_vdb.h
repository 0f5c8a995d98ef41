#pragma once

// Steps of constructive solid geometry on grids, for our own .cpp files.

#include <optional>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/grids/grid_queries_vdb.h"
#include "levelset/vdb.h"

namespace levelset {

/// Every operation is result × min(first × a, second × b) for signs of ± 1, so that what holds of a
/// union's inside holds of an intersection's outside.
struct CsgSigns {
  float first, second, result;
};
[[nodiscard]] CsgSigns csgSigns(CsgOperation operation);

/// a op b of two grids with one transform and background, re-distanced where min and max are none.
/// The result may have no inside.
[[nodiscard]] openvdb::FloatGrid::Ptr mergePair(CsgOperation operation, const openvdb::FloatGrid& a,
                                                const openvdb::FloatGrid& b);

/// a op b by minimum and maximum alone, whatever they are off the surface. Signs are those of the
/// operands also where a band is cut: openvdb's own floods them from where a node begins.
[[nodiscard]] openvdb::FloatGrid::Ptr mergePlain(CsgOperation operation,
                                                 const openvdb::FloatGrid& a,
                                                 const openvdb::FloatGrid& b);

struct ClosedPair {
  openvdb::FloatGrid::Ptr a, b;
};
/// Where two faces touch on grid points, both distances are zero there and their minimum would
/// leave a crack without width. Gives both operands the depth of their neighbours at such points;
/// empty when there are none.
[[nodiscard]] std::optional<ClosedPair> closeContacts(const openvdb::FloatGrid& a,
                                                      const openvdb::FloatGrid& b,
                                                      const CsgSigns& signs);

/// The leaf blocks where the surfaces run through each other face to face, the inside of one where
/// the outside of the other is. Their minimum is then zero, or nearly, along faces that bound
/// nothing, and all distances about them are to these.
[[nodiscard]] std::vector<openvdb::Coord> coincidentFaces(const openvdb::FloatGrid& a,
                                                          const openvdb::FloatGrid& b,
                                                          const CsgSigns& signs);

/// Corrects the minimum of two distances where it is a bound only. Inside a union, a point whose
/// nearest point on one solid lies within the other is further from the surface than either
/// distance says: it takes the distance to the planes that both surfaces have in the cells about
/// it, and to the line where these meet. Voxels beside the zero set keep their values, so that it
/// stays.
/// @param result  result × min(first × a, second × b), same transform and background as both
void correctSeam(openvdb::FloatGrid& result, const openvdb::FloatGrid& a,
                 const openvdb::FloatGrid& b, const CsgSigns& signs);

}  // namespace levelset
