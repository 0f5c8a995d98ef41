#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>

namespace render {

/// Curvatures of a surface at a point.
struct CurvatureSample {
  double mean = 0, gauss = 0, k1 = 0,
         k2 = 0;  ///< per world unit (gauss: per world unit squared); mean, k1 and k2 are positive
                  ///< on a solid ball
};

/// Intersection of a ray with a surface; world units.
struct Hit {
  bool found = false;
  double distance = 0;  ///< from the ray's origin
  Imath::V3d position,
      normal;  ///< outward unit normal, from a tricubic B-spline or a mesh's vertex normals
  Imath::V3d facetNormal;  ///< outward unit normal of the trilinear interpolant, or of the triangle
  CurvatureSample curvature;  ///< from the B-spline; 0 on meshes
  double viewCurvature = 0;   ///< normal curvature in the ray's direction, per world unit
  double surfaceError = 0;    ///< bound on the distance of the drawn surface from a smooth one
  Imath::C3f colour{0};       ///< surface colour, linear
  double opacity = 1;         ///< surface opacity, (0, 1]
  std::uint32_t id = 0;       ///< Solid::id or MeshPart::id
  std::size_t solid = 0;      ///< index in Scene::solids, or Scene::meshes
  bool isOnMesh = false;
  bool isFlipped = false;     ///< the drawn shape is on the outside of the hit solid, as for a
                              ///< subtracted solid; normals and curvatures describe the drawn shape
  bool isBeyondBand = false;  ///< a blended field contributes to this hit, but its band does not
                              ///< extend to this point
  /// Distance at which the ray continues behind a mesh surface, clear of the hit's rounding error.
  [[nodiscard]] double beyond() const { return distance + 2 * surfaceError; }
};

}  // namespace render
