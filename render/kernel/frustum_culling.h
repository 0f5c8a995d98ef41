#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <vector>

#include "render/scene/scene.h"
#include "render/shading/render_options.h"

namespace render {

/// Culls space that cannot affect a picture. Kept are the view frustum and the points that can cast
/// shadow or ambient occlusion onto visible surfaces.
class FrustumCulling {
 public:
  FrustumCulling() = default;  ///< keeps all of space
  /// @param bounds  a box that holds the surfaces, world units, not empty
  /// @pre the camera is valid
  FrustumCulling(const Scene& scene, const RenderOptions& options, const Imath::Box3d& bounds);

  /// True when a ball may affect the picture. May return true for a ball that does not.
  /// @param centre, radius  world units
  [[nodiscard]] bool keeps(const Imath::V3d& centre, double radius) const;

 private:
  struct Plane {  // the visible side has normal · p >= offset
    Imath::V3d normal;
    double offset;
  };
  double margin_ = 0;  // distance from the surface at which rays to lights start, world units
  std::vector<Plane> planes_;  // planes of the frustum and of the bounds; none: keep all of space
  double occlusionDistance_ = 0;  // length of ambient occlusion rays, world units
  bool hasShadows_ = false;
  Imath::V3d towardsKey_;
  double spread_ = 0;  // widening of the key light's cone per unit of length
};

}  // namespace render
