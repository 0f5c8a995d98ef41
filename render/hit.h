#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace render {

/// Renderers end a ray when the transmittance of the surfaces and volumes along it falls below this
/// value, as if the last one were opaque.
inline constexpr double kLeastTransmittance = 1.0 / 512;

/// Curvatures of a surface at a point.
struct CurvatureSample {
  /// Mean curvature, Gauss curvature, and principal curvatures k1 ≥ k2; per world unit (gauss: per
  /// world unit squared). mean, k1 and k2 are positive on a solid ball.
  double mean = 0, gauss = 0, k1 = 0, k2 = 0;
  /// First principal direction: unit tangent vector along which the normal curvature is k1, with a
  /// sign from asLine(). Any tangent vector where k1 = k2. 0 on meshes, where the gradient
  /// vanishes, and, on level sets, in pictures that show no directions. The second principal
  /// direction is normal × direction1, with a sign from asLine().
  Imath::V3d direction1{0};
};

/// Returns the one of v and −v whose component of largest magnitude is positive; the first one, of
/// components that differ by rounding. A direction of a line has no sign. This choice gives equal
/// lines equal vectors.
[[nodiscard]] inline Imath::V3d asLine(const Imath::V3d& v) {
  constexpr double kRounding = 1e-6;
  int most = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (std::abs(v[axis]) > (1 + kRounding) * std::abs(v[most])) most = axis;
  return v[most] < 0 ? -v : v;
}

/// Intersection of a ray with a surface; world units.
struct Hit {
  bool found = false;
  double distance = 0;  ///< from the ray's origin
  /// Position; outward unit normal, from a tricubic B-spline of φ or a mesh's vertex normals.
  Imath::V3d position{0}, normal{0};
  /// Outward unit normal of the surface as drawn: of the trilinear interpolant (with a spline
  /// filter, of the spline), or of the mesh triangle.
  Imath::V3d facetNormal{0};
  CurvatureSample curvature;  ///< from the B-spline; 0 on meshes
  double viewCurvature = 0;   ///< normal curvature in the ray's direction, per world unit
  /// Bound on the distance of the drawn surface from the smooth surface that the grid samples. On
  /// meshes: bound on the rounding error of the hit.
  double surfaceError = 0;
  Imath::C3f colour{0};  ///< surface colour, linear
  double opacity = 1;    ///< surface opacity, (0, 1]
  std::uint32_t id = 0;  ///< Solid::id, MeshPart::id or MappedTexture::id
  /// Index in Scene::solids, or in Scene::meshes if isOnMesh. On a mapped texture: number of solids
  /// plus the index in Scene::mapped.
  std::size_t solid = 0;
  std::uint32_t primitive = 0;  ///< QuadricHit::slot; 0 on other surfaces
  bool isOnMesh = false;
  bool isOnGround = false;  ///< the hit is on Scene::ground, which shows only shadows
  bool isFlipped = false;   ///< the drawn shape is on the outside of the hit solid, as for a
                            ///< subtracted solid; normals and curvatures describe the drawn shape
  /// The field of a solid contributes to this hit on a blended surface, but the solid's band does
  /// not extend to this point.
  bool isBeyondBand = false;
  /// A double root of a Bézier volume, or a point where its map is singular:
  /// BezierRoot::isSingular.
  bool isSingular = false;
  /// Distance along the ray, world units, at which it continues behind a mesh surface: far enough
  /// not to hit the same triangle again.
  [[nodiscard]] double beyond() const { return distance + 2 * surfaceError; }
};

/// Hit on a surface that is given exactly, as a Bézier volume or a terrain. It is opaque. The facet
/// has the surface's normal. @param diagonal  of the box of the surface, world units
[[nodiscard]] inline Hit exactHit(const Imath::V3d& position, double distance,
                                  const Imath::V3d& normal, double diagonal,
                                  const Imath::C3f& colour, std::uint32_t id, std::size_t solid) {
  constexpr double kHitError = 1e-10;  // of a root that is not singular, as a share of the diagonal
  Hit hit;
  hit.found = true;
  hit.distance = distance;
  hit.position = position;
  hit.normal = hit.facetNormal = normal;
  hit.surfaceError = kHitError * diagonal;
  hit.colour = colour;
  hit.id = id;
  hit.solid = solid;
  return hit;
}

}  // namespace render
