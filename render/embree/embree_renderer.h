#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/hit.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

/// The judge: first zero of the filter's function along each ray, solved in double precision on
/// OpenVDB's own tree; Embree only finds the leaf blocks,
/// and the triangles of meshes. It may be slow, it may not be wrong.
namespace render {

/// Draws the scene. Pixels depend on the scene alone, not on the number of threads.
/// @return layers R G B A (linear, premultiplied, mean of the samples), and from the pixel centre Z
///         (distance along the view axis, +inf for a miss), N.X N.Y N.Z, P.X P.Y P.Z, curvature.*
///         and id (0: none), all world units; header attributes say how they were made
/// @throws levelset::UsageError for a camera that cannot see, or sample counts out of range
/// @throws levelset::InvalidInput when there is no surface in the scene
/// @throws levelset::ResourceLimit for an image too large; levelset::Cancelled
[[nodiscard]] Image renderEmbree(const Scene& scene, const RenderOptions& options = {});

/// The scene made ready for rays: thread-safe, results do not depend on the order of anything.
/// Rays are unit directions; of two solids hit at the same distance the one of the smaller voxels
/// counts, of two such the lower id.
class EmbreeScene {
 public:
  /// @throws levelset::ResourceLimit when Embree finds no memory
  explicit EmbreeScene(const Scene& scene, Filter filter = Filter::Trilinear);
  ~EmbreeScene();
  EmbreeScene(EmbreeScene&&) noexcept;
  /// First hit beyond `near`. A ray that starts inside hits where it leaves.
  /// @throws levelset::UsageError when origin or direction are not finite or the direction is zero
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction,
                              double near = 0, double far = Camera::kNoDepth) const;
  /// Those in [near, far] that are seen: in their order, up to an opaque one or to where less than
  /// kLeastTransmittance is left. @throws as intersect()
  [[nodiscard]] std::vector<Hit> intersectVisible(const Imath::V3d& origin,
                                                  const Imath::V3d& direction, double near,
                                                  double far) const;
  /// Share of light that comes through all that is in [0, far], or less than kLeastTransmittance.
  /// @throws as intersect()
  [[nodiscard]] double transmittance(const Imath::V3d& origin, const Imath::V3d& direction,
                                     double far) const;
  /// How far the ray is within what is drawn of the solids in [near, far], world units. @throws as
  /// intersect()
  [[nodiscard]] double thickness(const Imath::V3d& origin, const Imath::V3d& direction,
                                 double near = 0, double far = Camera::kNoDepth) const;
  /// True when there is a hit in [near, far]. @throws as intersect()
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                double far) const;
  /// World-space box of the cells that hold surface; empty when there are none.
  [[nodiscard]] const Imath::Box3d& bounds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace render
