#pragma once

#include "levelset/adaptive/adaptive_field.h"
#include "levelset/inspect/compare.h"
#include "levelset/mesh.h"

namespace levelset {

/// Measures the difference of two solids. Distances are exact between the meshes of the zero sets,
/// from the vertices and the middles of parts of their triangles. Parts have sides of at most the
/// larger tolerance, or a 500th of the diagonal. The volume of the symmetric difference follows
/// from the volumes of both solids and of their intersection. Its error is about the tolerance
/// times the area.
/// @throws InvalidInput if a solid has no surface
/// @throws ResourceLimit, Cancelled
[[nodiscard]] Comparison compare(const AdaptiveField& a, const AdaptiveField& b,
                                 const CompareOptions& options = {});

}  // namespace levelset
