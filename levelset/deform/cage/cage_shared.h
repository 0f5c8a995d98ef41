#pragma once

#include <vector>

#include "levelset/deform/cage/cage.h"
#include "levelset/deform/cage/cage_kernels.h"

/// The numbers of a cage. Internal.
namespace levelset {

struct CageDeformation::Shared {
  CageCoordinates kind = CageCoordinates::MeanValue;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Imath::V3d> rest, moved;
  std::vector<cage::CageTriangle> parts;  ///< at rest
  /// Moved minus rest: of the vertices, and of the stretched normals.
  std::vector<Imath::V3d> moves, normalMoves;
  double size = 0;  ///< diagonal of the cage at rest

  void setMoved(std::vector<Imath::V3d> positions);
};

namespace cage {

/// Normal of a moved triangle, times its stretch [Lipman08, equation 10].
[[nodiscard]] Imath::V3d stretchedNormal(const CageTriangle& rest,
                                         const std::array<Imath::V3d, 3>& moved);

/// A point on the surface of a cage.
struct CageFoot {
  bool isOnSurface = false, isOnEdge = false;  ///< within rounding errors; an edge or a vertex
  std::size_t triangle = 0;
  Imath::V3d shares{0};  ///< barycentric coordinates
  Imath::V3d inwards{0};
};

}  // namespace cage
}  // namespace levelset
