#pragma once

// Internal header of levelset: public headers must not include it.

#include <vector>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"

namespace levelset {

/// Limits of edge lengths, world units and radians.
struct EdgeLimits {
  double shortest = 0, longest = 0;
  double angle = 0;  ///< between the normals at the ends of an edge
};

/// Figures at the vertices of a mesh.
struct EdgeLengths {
  std::vector<double> lengths;
  std::vector<double> curvatures;  ///< largest absolute curvatures
};

/// Returns the edge length at each vertex of a mesh of the zero set: the chord of the angle on a
/// circle of the largest curvature, within the limits. Lengths change by at most kGradation per
/// unit of length along the edges of the mesh.
[[nodiscard]] EdgeLengths edgeLengths(const NarrowBand& band, const TriMesh& surface,
                                      const EdgeLimits& limits);

/// Largest change of edge lengths per unit of length.
inline constexpr double kGradation = 0.25;

}  // namespace levelset
