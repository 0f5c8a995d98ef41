#pragma once

#include <Imath/ImathBox.h>

#include <memory>

#include "render/hit.h"
#include "render/scene/scene.h"

namespace render {

/// The meshes of a scene for rays, of all renderers: Embree finds the triangle, double precision
/// the place on its plane. Thread-safe. Rays are unit directions.
class MeshRays {
 public:
  /// @throws levelset::ResourceLimit when Embree finds no memory
  explicit MeshRays(const Scene& scene);
  ~MeshRays();
  MeshRays(MeshRays&&) noexcept;
  MeshRays& operator=(MeshRays&&) noexcept;

  [[nodiscard]] bool isEmpty() const;
  [[nodiscard]] const Imath::Box3d& bounds() const;
  /// First triangle, of either side, in [near, far]; `solid` is the index in Scene::meshes, normals
  /// are those of the vertices where the mesh has some.
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                              double far) const;
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction,
                                double far) const;
  /// Share of light that all triangles in [0, far] let through, or less than kLeastTransmittance.
  [[nodiscard]] double transmittance(const Imath::V3d& origin, const Imath::V3d& direction,
                                     double far) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace render
