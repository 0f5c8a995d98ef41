#pragma once

#include <Imath/ImathBox.h>

#include <memory>

#include "render/hit.h"
#include "render/scene/scene.h"

namespace render {

/// Intersects rays with the meshes of a scene, for all renderers. Embree finds the triangle in
/// single precision. The position on its plane is computed in double precision. Thread-safe. Ray
/// directions have unit length.
class MeshRays {
 public:
  /// @throws levelset::ResourceLimit when Embree cannot allocate memory
  explicit MeshRays(const Scene& scene);
  ~MeshRays();
  MeshRays(MeshRays&&) noexcept;
  MeshRays& operator=(MeshRays&&) noexcept;

  [[nodiscard]] bool isEmpty() const;
  [[nodiscard]] const Imath::Box3d& bounds() const;
  /// First hit with a triangle, from either side, at a distance in [near, far], world units.
  /// `solid` of the hit is the index in Scene::meshes. Normals are interpolated from the vertices
  /// where the mesh has vertex normals.
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                              double far) const;
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction,
                                double far) const;
  /// Share of light that passes all triangles at distances in [0, far] along the ray, world units.
  /// Triangles are ignored once the share is below kLeastTransmittance.
  [[nodiscard]] double transmittance(const Imath::V3d& origin, const Imath::V3d& direction,
                                     double far) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace render
