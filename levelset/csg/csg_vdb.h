#pragma once

// Steps of constructive solid geometry on grids. Includes OpenVDB: for .cpp files only.

#include <cstddef>
#include <string>
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

/// Resamples all solids to the grid of the finest one, and narrows all bands to the smallest half
/// width. Adds a note for each solid that changes.
void bringToOneGrid(std::vector<NarrowBand>& solids, std::size_t maxMemory,
                    std::vector<std::string>& notes);

/// Combines two bands with equal transforms and backgrounds. Corrects the distances where the
/// minimum or maximum is not a distance. The result may have no inside. Moves the leaf nodes of a
/// band that no other band shares, and copies the nodes of the other bands.
[[nodiscard]] NarrowBand mergePair(CsgOperation operation, NarrowBand a, NarrowBand b);

/// Combines two grids by minimum or maximum only, without correction. Takes the signs outside the
/// band from the operands, also where a band is cropped. OpenVDB's own CSG functions flood-fill
/// signs within a node instead.
[[nodiscard]] openvdb::FloatGrid::Ptr mergePlain(CsgOperation operation,
                                                 const openvdb::FloatGrid& a,
                                                 const openvdb::FloatGrid& b);

/// Leaf nodes of both operands at the same place. The nodes belong to the operands.
struct SharedLeaf {
  const openvdb::FloatTree::LeafNodeType *a, *b;
};
/// Returns the leaf nodes of both operands that lie at the same place, in the order of `b`.
[[nodiscard]] std::vector<SharedLeaf> sharedLeaves(const openvdb::FloatGrid& a,
                                                   const openvdb::FloatGrid& b);

/// Grid point between two touching faces.
struct Contact {
  openvdb::Coord at;
  double depth;  ///< distance of the least deep inside neighbour, voxels, negative
};
/// Places where the surfaces of both operands coincide with opposite orientation.
struct Coincidence {
  /// Grid points between faces that touch on grid points. Both distances are zero there.
  std::vector<Contact> contacts;
  /// Origins of the leaf blocks that contain coincident faces. Such faces bound no solid in the
  /// result. But the minimum of both distances is zero, or nearly zero, along these faces, and is
  /// the distance to them nearby.
  std::vector<openvdb::Coord> faces;
};
[[nodiscard]] Coincidence coincidenceOf(const openvdb::FloatGrid& a, const openvdb::FloatGrid& b,
                                        const CsgSigns& signs,
                                        const std::vector<SharedLeaf>& shared);

/// Closes cracks between faces that touch on grid points. Both distances are zero at these grid
/// points, so the minimum would leave a crack of zero width. Gives an operand the depth of the
/// inside neighbours there.
/// @param sign  sign of the operand in CsgSigns
void closeContacts(openvdb::FloatGrid& grid, const std::vector<Contact>& contacts, float sign);

/// Distances of voxels of one leaf block from the surface of the result.
struct SeamDistances {
  struct Voxel {
    openvdb::Index offset;  ///< in the leaf block
    double distance;        ///< world units, ≥ 0
  };
  openvdb::Coord origin;
  std::vector<Voxel> voxels;
};

/// Measures distances where the minimum of both operands is only a bound. Inside a union, the
/// nearest point on one solid may lie inside the other; the surface is then farther away than
/// either distance. Measures the distance to the planes that fit both surfaces in nearby cells, and
/// to their intersection lines. Leaves out voxels next to the zero set, so the surface stays.
/// Reads only the operands, so that their nodes can be moved into the result afterwards.
/// @param shared  sharedLeaves(a, b)
[[nodiscard]] std::vector<SeamDistances> seamDistances(const openvdb::FloatGrid& a,
                                                       const openvdb::FloatGrid& b,
                                                       const CsgSigns& signs,
                                                       const std::vector<SharedLeaf>& shared);

/// Raises the distances of the combined operands to those of seamDistances().
void correctSeam(openvdb::FloatGrid& result, const std::vector<SeamDistances>& distances);

}  // namespace levelset
