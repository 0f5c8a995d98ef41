#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>
#include <memory>

#include "render/hit.h"
#include "render/scene/scene.h"

namespace render {

/// Intersects rays with the mapped textures of a scene. Embree finds the shells whose boxes a ray
/// meets. In a shell the ray walks from tetrahedron to tetrahedron. In each it is straight in the
/// space of the texture, where the code of the judge finds the first zero of the trilinear
/// interpolant in double precision. Thread-safe; hits do not depend on the order of calls. Ray
/// directions have unit length.
class MappedRays {
 public:
  /// @throws levelset::InvalidInput for a shell that is not valid, see ShellWalker
  /// @throws levelset::ResourceLimit when Embree cannot allocate memory
  explicit MappedRays(const Scene& scene);
  ~MappedRays();
  MappedRays(MappedRays&&) noexcept;
  MappedRays& operator=(MappedRays&&) noexcept;

  [[nodiscard]] bool isEmpty() const;
  /// World-space box of all shells.
  [[nodiscard]] const Imath::Box3d& bounds() const;
  /// First hit with a mapped texture in [near, far], distances along the ray in world units. A ray
  /// that starts inside a texture hits where it leaves the texture. `solid` of the hit is the
  /// number of solids in the scene plus the index in Scene::mapped. Normals and curvatures are
  /// those of the B-spline of the texture, transformed by the map of the tetrahedron.
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                              double far) const;
  /// True if the ray hits a mapped texture at a distance in [0, far].
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction,
                                double far) const;
  /// Memory of the tables that this object holds beside the scene's textures and shells, without
  /// Embree's tree; bytes.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace render
