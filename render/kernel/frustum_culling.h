#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <vector>

#include "render/scene/scene.h"
#include "render/shading/render_options.h"

namespace render {

/// The part of space that a picture is made from: what the camera may see, and what may come
/// between that and its lights.
class FrustumCulling {
 public:
  FrustumCulling() = default;  ///< all of space
  /// @param bounds  a box that holds the surfaces, world units, not empty
  /// @pre the camera is valid
  FrustumCulling(const Scene& scene, const RenderOptions& options, const Imath::Box3d& bounds);

  /// Is anything in that ball needed? Errs towards yes.
  /// @param centre, radius  world units
  [[nodiscard]] bool keeps(const Imath::V3d& centre, double radius) const;

 private:
  struct Plane {  // what is seen has normal · p >= offset
    Imath::V3d normal;
    double offset;
  };
  double margin_ = 0;          // of what is seen: rays to lights start that far off it, world units
  std::vector<Plane> planes_;  // of the frame and the bounds; none: all of space
  double occlusionDistance_ = 0;  // of rays around what is seen, world units
  bool hasShadows_ = false;
  Imath::V3d towardsKey_;
  double spread_ = 0;  // of its rays, by length
};

}  // namespace render
