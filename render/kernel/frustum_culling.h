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
  // Largest distance between a surface point and the start of its shadow and occlusion rays, world
  // units.
  double margin_ = 0;
  // Planes of the view frustum and of the box of all surfaces. Empty: nothing is culled.
  std::vector<Plane> planes_;
  double occlusionDistance_ = 0;  // length of ambient occlusion rays, world units
  bool hasShadows_ = false;
  Imath::V3d towardsKey_;  // unit vector towards the key light
  // Growth of the radius of a ball's shadow cone per unit of length: tangent of the key light's
  // half angle.
  double spread_ = 0;
};

}  // namespace render
