#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/hit.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

/// The judge: finds the first zero of a band's interpolating function along each ray, in double
/// precision on OpenVDB's own tree. Embree only finds the leaf blocks and mesh triangles that a ray
/// meets. Correctness has priority over speed.
namespace render {

/// Draws the scene. Pixels depend on the scene alone, not on the number of threads.
/// @return layers R G B A (linear, premultiplied, mean of the samples), and, from the ray through
/// the pixel's centre: Z (distance along the view axis, +inf for a miss), N.X N.Y N.Z, P.X P.Y P.Z,
/// curvature.* and id (0: none). Lengths are world units. Header attributes record scene and
/// options.
/// @throws levelset::UsageError for an invalid camera, sample counts out of range, or a scene with
///         mapped textures
/// @throws levelset::InvalidInput when there is no surface in the scene
/// @throws levelset::ResourceLimit for an image that is too large
/// @throws levelset::Cancelled when progress asks to stop
[[nodiscard]] Image renderEmbree(const Scene& scene, const RenderOptions& options = {});

/// A scene prepared for the judge. Thread-safe; results do not depend on the order of calls. Ray
/// directions have unit length. When two solids are hit at the same distance, the solid with the
/// smaller voxels counts; for equal voxels, the solid with the lower id.
class EmbreeScene {
 public:
  /// @throws levelset::ResourceLimit when Embree cannot allocate memory
  explicit EmbreeScene(const Scene& scene, Filter filter = Filter::Trilinear);
  ~EmbreeScene();
  EmbreeScene(EmbreeScene&&) noexcept;
  /// First hit on a solid or mesh in [near, far], distances along the ray in world units. A ray
  /// that starts inside a solid hits where it leaves the solid.
  /// @throws levelset::UsageError when origin or direction is not finite or the direction is zero
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction,
                              double near = 0, double far = Camera::kNoDepth) const;
  /// Visible hits on solids and meshes in [near, far], in order along the ray. The list ends at an
  /// opaque hit, or when the transmittance falls below kLeastTransmittance.
  /// @throws as intersect()
  [[nodiscard]] std::vector<Hit> intersectVisible(const Imath::V3d& origin,
                                                  const Imath::V3d& direction, double near,
                                                  double far) const;
  /// Share of light that passes all surfaces at distances in [0, far] along the ray. Surfaces are
  /// ignored once the share is below kLeastTransmittance.
  /// @throws as intersect()
  [[nodiscard]] double transmittance(const Imath::V3d& origin, const Imath::V3d& direction,
                                     double far) const;
  /// Length of the ray inside the drawn solids (the result of the expression, if there is one)
  /// within [near, far], world units.
  /// @throws as intersect()
  [[nodiscard]] double thickness(const Imath::V3d& origin, const Imath::V3d& direction,
                                 double near = 0, double far = Camera::kNoDepth) const;
  /// True when there is a hit in [near, far].
  /// @throws as intersect()
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                double far) const;
  /// World-space box of the meshes and of the grid cells that the solids' surfaces cross; empty
  /// when there are none. For a blended scene: Scene::bounds().
  [[nodiscard]] const Imath::Box3d& bounds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace render
