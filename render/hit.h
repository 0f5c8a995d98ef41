#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>

namespace render {

struct CurvatureSample {
  double mean = 0, gauss = 0, k1 = 0,
         k2 = 0;  ///< per world unit (gauss: squared); spheres positive
};

/// Where a ray meets a surface; world units.
struct Hit {
  bool found = false;
  double distance = 0;          ///< along the unit direction
  Imath::V3d position, normal;  ///< normal outwards, of unit length, from a tricubic B-spline
  Imath::V3d facetNormal;       ///< outwards, of the trilinear interpolant itself
  CurvatureSample curvature;    ///< from the B-spline; 0 on meshes
  double viewCurvature = 0;     ///< of the normal section along the ray, per world unit
  double surfaceError = 0;      ///< bound on the interpolant's distance from a smooth surface
  Imath::C3f colour{0};         ///< of the surface, linear
  double opacity = 1;           ///< of the surface, (0, 1]
  std::uint32_t id = 0;         ///< Solid::id or MeshPart::id
  std::size_t solid = 0;        ///< index in Scene::solids, or Scene::meshes
  bool isOnMesh = false;
  bool isFlipped = false;     ///< is that solid's outside inside what is drawn? Normals and
                              ///< curvatures tell of what is drawn
  bool isBeyondBand = false;  ///< has a field a part in it where its band knows no distance?
  /// Where the ray goes on behind a mesh's surface, off the rounding of the hit.
  [[nodiscard]] double beyond() const { return distance + 2 * surfaceError; }
};

}  // namespace render
