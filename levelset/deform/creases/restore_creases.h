#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

/// Finds the edges of a mesh of a band where its surface turns by more than an angle. Triangles
/// find candidates. Since small triangles of smooth surfaces turn by any angle, the gradients of
/// the distances 1.25 voxels beside the edge decide.
/// @return pairs of vertices, in ascending order
[[nodiscard]] std::vector<std::array<std::uint32_t, 2>> creaseEdges(const NarrowBand& band,
                                                                    const TriMesh& mesh,
                                                                    double angleDegrees);

struct RestoreCreasesOptions {
  /// Distance from a crease, along the surface, within which distances are replaced, voxels.
  double widthVoxels = 2.5;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Replaces the distances of a band whose closest points lie near creases by the exact distances of
/// a mesh of the same surface, whose edges are sharp. All other distances stay.
/// @param creases  pairs of vertices of the mesh
/// @throws InvalidInput if inside and outside of the mesh are ambiguous
/// @throws ResourceLimit, Cancelled
[[nodiscard]] NarrowBand restoreCreases(const NarrowBand& band, const TriMesh& mesh,
                                        const std::vector<std::array<std::uint32_t, 2>>& creases,
                                        const RestoreCreasesOptions& options = {});

}  // namespace levelset
