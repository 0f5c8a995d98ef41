#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>

namespace render {

/// Curvatures of a surface at a point.
struct CurvatureSample {
  double mean = 0, gauss = 0, k1 = 0,
         k2 = 0;  ///< per world unit (gauss: squared); spheres are positive
};

/// Intersection of a ray with a surface; world units.
struct Hit {
  bool found = false;
  double distance = 0;          ///< along the unit direction
  Imath::V3d position, normal;  ///< outward unit normal, from a tricubic B-spline
  Imath::V3d facetNormal;       ///< outward normal of the trilinear interpolant itself
  CurvatureSample curvature;    ///< from the B-spline; 0 on meshes
  double viewCurvature = 0;     ///< normal curvature along the ray, per world unit
  double surfaceError = 0;      ///< bound on the interpolant's distance from a smooth surface
  Imath::C3f colour{0};         ///< surface colour, linear
  double opacity = 1;           ///< surface opacity, (0, 1]
  std::uint32_t id = 0;         ///< Solid::id or MeshPart::id
  std::size_t solid = 0;        ///< index in Scene::solids, or Scene::meshes
  bool isOnMesh = false;
  bool isFlipped = false;  ///< the outside of that solid is inside the drawn shape; normals and
                           ///< curvatures describe the drawn shape
  bool isBeyondBand =
      false;  ///< a blended field contributes here although its band ends before this point
  /// Distance at which the ray continues behind a mesh surface, clear of the hit's rounding error.
  [[nodiscard]] double beyond() const { return distance + 2 * surfaceError; }
};

}  // namespace render
