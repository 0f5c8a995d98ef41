#pragma once

#include <Imath/ImathMatrix.h>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

/// Transforms a solid exactly, by its grid transform. A uniform scale also scales the distances.
/// @param matrix  rotation, uniform scale, translation; world' = world * matrix, with Imath's row
///                vectors
/// @throws UsageError if the matrix is not affine and invertible
/// @throws InvalidInput if the matrix shears, mirrors or scales unevenly (use bake()), or the solid
/// is
///         empty or too far from the origin for its voxels
[[nodiscard]] NarrowBand transform(NarrowBand solid, const Imath::M44d& matrix);

struct BakeOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Transforms a solid by any invertible affine matrix. Resamples it on the axis-aligned grid of
/// `voxelSize` and re-distances it.
/// @throws UsageError if the matrix is not affine and invertible; further errors as resample()
[[nodiscard]] NarrowBand bake(const NarrowBand& solid, const Imath::M44d& matrix, double voxelSize,
                              const BakeOptions& options = {});

/// Transforms the vertices of a mesh. A mirroring matrix also reverses the triangles. Normals
/// transform by the inverse transpose and stay unit vectors. The mesh remembers the precision of
/// its original coordinates, and is written in double precision from then on.
/// @throws UsageError if the matrix is not affine and invertible
/// @throws InvalidInput if attributes do not fit the vertices, or a coordinate exceeds 1e100
[[nodiscard]] TriMesh transform(TriMesh mesh, const Imath::M44d& matrix);

}  // namespace levelset
