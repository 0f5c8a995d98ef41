#pragma once

#include <cstddef>

#include "levelset/adaptive/adaptive_field.h"
#include "levelset/mesh.h"
#include "levelset/progress.h"

namespace levelset {

struct AdaptiveToMeshOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Converts the zero set of an adaptive field to a mesh without cracks. Each leaf is cut along the
/// curves in which the zero set crosses its faces. A face beside smaller leaves is divided like
/// theirs, so both sides have the same curves [Ho05]. The mesh is closed, two triangles share each
/// edge, and each vertex has one fan of triangles, unless the zero set leaves the root. The mesh of
/// a tricubic field is that of a trilinear one with half of its tolerance.
/// @return triangles that face outwards; vertices in world units
/// @throws ResourceLimit, Cancelled
[[nodiscard]] TriMesh adaptiveToMesh(const AdaptiveField& field,
                                     const AdaptiveToMeshOptions& options = {});

}  // namespace levelset
