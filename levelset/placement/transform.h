#pragma once

#include <Imath/ImathMatrix.h>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

/// Moves a solid exactly, by changing the transform of its grid; a uniform scale scales the
/// distances.
/// @param matrix  rotation, uniform scale, translation; `world' = world * matrix` (Imath's row
/// vectors)
/// @throws InvalidInput for a matrix that shears, mirrors or scales unevenly: bake it
[[nodiscard]] NarrowBand transform(NarrowBand solid, const Imath::M44d& matrix);

struct BakeOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Moves a solid by any invertible affine matrix and resamples it on the axis-aligned grid of
/// `voxelSize`, re-distanced.
[[nodiscard]] NarrowBand bake(const NarrowBand& solid, const Imath::M44d& matrix, double voxelSize,
                              const BakeOptions& options = {});

/// Moves the vertices; a mirroring matrix also turns the triangles. Normals follow by the inverse
/// transpose, at unit length. The mesh keeps in mind how
/// finely its coordinates were known, and is written in double precision from then on.
/// @throws UsageError for a matrix that is not affine and invertible; InvalidInput for attributes
///         that do not fit the vertices, and for places beyond what numbers hold
[[nodiscard]] TriMesh transform(TriMesh mesh, const Imath::M44d& matrix);

}  // namespace levelset
