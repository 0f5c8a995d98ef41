#pragma once

#include <cstddef>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/convert/surface_band.h"
#include "levelset/mesh.h"
#include "levelset/terrain/height_field.h"

/// Meshes and level sets of a ground.
namespace levelset {

struct GroundMeshOptions {
  /// Accept samples without data: the ground has holes there, and a solid has vertical walls.
  bool allowMissing = false;
  std::size_t maxMemory = kNoMemoryLimit;
};

/// Makes the triangles of a ground, which face upwards. Parts that meet only in a sample have
/// separate vertices there.
/// @throws InvalidInput for missing samples without allowMissing, for a field without a triangle or
///         in degrees, and for one that requireHeights() refuses
/// @throws ResourceLimit
[[nodiscard]] TriMesh groundMesh(const HeightField& field, const GroundMeshOptions& options = {});

/// Makes a closed mesh of the earth between the ground and the plane z = base, with vertical walls
/// below the border of the ground. Every edge has two triangles.
/// @throws InvalidInput for a base that is not finite or not below the lowest sample, and as
///         groundMesh
/// @throws ResourceLimit
[[nodiscard]] TriMesh groundSolidMesh(const HeightField& field, double base,
                                      const GroundMeshOptions& options = {});

/// Lowers the samples at the border of the grid. A solid of such a ground lies below the ground
/// itself in the outermost cells, so the ground hides the edges of the solid's walls there.
/// @param depth  >= 0, world units
/// @throws UsageError for a negative depth or one that is not finite
[[nodiscard]] HeightField loweredEdges(HeightField field, double depth);

struct SolidifyOptions {
  double halfWidth = 3;  ///< half width of the band, voxels
  bool allowMissing = false;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Makes a solid of the mesh of groundSolidMesh(), with exact distances and a sign certificate.
/// @throws as groundSolidMesh and meshToBand
[[nodiscard]] MeshToBandResult solidify(const HeightField& field, double base, double voxelSize,
                                        const SolidifyOptions& options = {});

struct GroundBandOptions {
  double halfWidth = 5;  ///< half width of the band, voxels, at least kMinSurfaceHalfWidth
  /// Box of the band; the ground around it is read as far as the band needs it.
  Imath::Box3d box = kEverywhere;
  bool allowMissing = false;  ///< accept missing samples: the band ends at the holes
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Computes the band of a ground, negative below it. Distances are those of surfaceBand(). In the
/// box they are those of the complete ground, up to rounding. Blocks of 8³ grid points that meet
/// the box are complete.
/// @throws InvalidInput when the box has no ground, and as groundMesh and surfaceBand
[[nodiscard]] SurfaceBandResult groundBand(const HeightField& field, double voxelSize,
                                           const GroundBandOptions& options = {});

}  // namespace levelset
