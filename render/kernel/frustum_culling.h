#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <vector>

#include "render/scene/scene.h"
#include "render/shading/render_options.h"

namespace render {

/// Culls space that cannot affect a picture. It keeps the view frustum, and the points that can
/// cast a shadow or ambient occlusion onto visible surfaces.
class FrustumCulling {
 public:
  FrustumCulling() = default;  ///< culls nothing
  /// @param bounds  box of all surfaces, world units, not empty
  /// @pre the camera is valid
  FrustumCulling(const Scene& scene, const RenderOptions& options, const Imath::Box3d& bounds);

  /// Returns true when a ball may affect the picture. The test is conservative: it may also keep
  /// other balls.
  /// @param centre, radius  world units
  [[nodiscard]] bool keeps(const Imath::V3d& centre, double radius) const;

 private:
  struct Plane {  // the visible side has normal · p >= offset
    Imath::V3d normal;
    double offset;
  };
  double margin_ =
      0;  // largest distance between a surface and the start of its light rays, world units
  std::vector<Plane> planes_;     // planes of the frustum and of the bounds; empty: cull nothing
  double occlusionDistance_ = 0;  // length of ambient occlusion rays, world units
  bool hasShadows_ = false;
  Imath::V3d towardsKey_;  // unit vector towards the key light
  double spread_ =
      0;  // growth of a shadow cone's radius per unit of length; tangent of the light's half angle
};

}  // namespace render
