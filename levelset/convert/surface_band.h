#pragma once

#include <cstddef>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

/// Band of a surface that has a border: a base for patches, not a solid.
namespace levelset {

/// Minimum half width, voxels: tricubic interpolation at the surface reads grid points up to 3.5
/// voxels from it.
inline constexpr double kMinSurfaceHalfWidth = 4;

struct SurfaceBandOptions {
  double halfWidth = 5;  ///< half width of the band, voxels, at least kMinSurfaceHalfWidth
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct SurfaceBandResult {
  NarrowBand band;                   ///< band with isOpenSurface() true
  std::size_t borderEdges = 0;       ///< edges with one face
  std::size_t droppedTriangles = 0;  ///< triangles without area and exact duplicates
  /// Number of voxels removed half way between the front of one part of the surface and the back of
  /// another, where the sign would change without a surface.
  std::size_t removedVoxels = 0;
};

/// Computes signed distances to an open, consistently oriented mesh, positive on the side that the
/// triangles face. The sign is that of the closest face; at edges and vertices, that of the
/// angle-weighted pseudonormal [Baerentzen05].
///
/// Beyond the border the band extends the surface straight for 3.5 voxels. Interpolation is thus
/// valid up to the border in any orientation. The band ends at the end of this extension. The
/// extensions of both sides of a slit overlap, so the band also stores how far the closest point of
/// each voxel lies beyond the border (BandSampler::beyondBorder). Where the front of one part of
/// the surface faces the back of another part, the band ends half way between the two.
/// @param mesh  vertices at equal positions are merged
/// @param voxelSize  world units, positive and finite; grid points lie at its integer multiples
/// @throws UsageError for a voxel size or half width out of range
/// @throws InvalidInput for a mesh that meshToBand refuses or a mesh without a border. Also throws
///         for an edge with three faces or with two faces of opposite orientations. Any Möbius
///         strip has such an edge.
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SurfaceBandResult surfaceBand(const TriMesh& mesh, double voxelSize,
                                            const SurfaceBandOptions& options = {});

/// The operator `surface-band`.
struct SurfaceBandOperator {
  static const OperatorText text;
  static constexpr bool makesSurface = true;

  struct Options {
    VoxelSize voxel;
    double halfWidth = 16;  ///< half width of the band, voxels

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("voxel", &Options::voxel, {});
      visit("half-width", &Options::halfWidth,
            {.help = "half width of the band, in voxels, at least 4; 16 suffices for patches up to "
                     "ten voxels high",
             .range = OptionRange::Positive});
    }
  };

  static void check(const Options& options, const GivenOptions& given);
  static double longestSide(const Options& options, Plans operands);
  static NarrowBand run(const TriMesh& mesh, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
};

}  // namespace levelset
