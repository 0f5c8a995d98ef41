#include "render/kernel/frustum_culling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "render/shading/shading.h"

namespace render {

using Imath::V3d;

FrustumCulling::FrustumCulling(const Scene& scene, const RenderOptions& options,
                               const Imath::Box3d& bounds) {
  const Camera& camera = scene.camera;
  const bool isLit = options.lightLayers || usesLights(options.style.style);
  // With a CSG expression, the kernel follows occlusion rays through all solids, however far, to
  // know where the rays start inside. So nothing can be culled.
  if (isLit && options.ambientSamples > 0 && !scene.csg.isEmpty()) return;

  const V3d axis = camera.axis();
  const auto add = [&](const V3d& through, const V3d& normal) {
    const V3d n = normal.normalized();
    planes_.push_back({n, n.dot(through)});
  };
  // The ground extends beyond the box of the surfaces.
  for (int a = 0; a < 3 && !scene.ground; ++a) {
    V3d along(0);
    along[a] = 1;
    add(bounds.min, along);
    add(bounds.max, -along);
  }
  add(camera.from, axis);
  const Camera::PixelSteps step = camera.pixelSteps();
  // Vectors from the view axis to the edges of the picture, at unit depth.
  const V3d edges[4] = {step.right * -camera.middleX(),
                        step.right * (camera.width - camera.middleX()),
                        step.down * (-0.5 * camera.height), step.down * (0.5 * camera.height)};
  for (int n = 0; n < 4; ++n) {
    const V3d outwards = (n < 2 ? step.right : step.down) * (n % 2 == 0 ? -1.0 : 1.0);
    if (camera.orthoHeight)
      add(camera.from + edges[n], -outwards);
    else
      add(camera.from,
          axis * (edges[n].dot(outwards) / outwards.length()) - outwards / outwards.length());
  }
  if (!isLit) return;
  // The Shader starts light rays at a distance of twice the surface error from the hit. The error
  // is at most an eighth of the sum of the second differences of φ along the three axes. Each of
  // these is at most 4 half widths, so the distance is at most 3 half widths.
  // The error of a volume's surface is at most one voxel.
  for (const Solid& solid : scene.solids)
    if (solid.volume)
      margin_ = std::max(margin_, 2.1 * solid.voxelSize());
    else if (!solid.band.isEmpty())
      margin_ = std::max(margin_, (3.1 * solid.band.halfWidth() + 0.1) * solid.band.voxelSize());
  // This term covers the surface error of meshes, which is single-precision rounding relative to
  // their size, and the rounding of keeps().
  margin_ += 1e-5 * bounds.size().length();
  if (options.ambientSamples > 0) occlusionDistance_ = occlusionDistance(bounds.size().length());
  hasShadows_ = options.shadowSamples > 0;
  towardsKey_ = keyDirection(scene);
  spread_ = scene.key.softness < std::numbers::pi / 2 ? std::tan(scene.key.softness)
                                                      : std::numeric_limits<double>::infinity();
}

bool FrustumCulling::keeps(const V3d& centre, double radius) const {
  const auto isSeen = [&](double around) {
    return std::all_of(planes_.begin(), planes_.end(), [&](const Plane& plane) {
      return plane.normal.dot(centre) - plane.offset >= -around;
    });
  };
  if (isSeen(radius + margin_ + occlusionDistance_)) return true;
  if (!hasShadows_) return false;
  // The shadow of the ball is a cone that opens away from the key light. Test if it intersects the
  // frustum: on the cone's axis, the points that are in front of a plane form an interval.
  double from = 0, to = std::numeric_limits<double>::infinity();
  for (const Plane& plane : planes_) {
    const double room = plane.normal.dot(centre) - plane.offset + radius + margin_;
    // Change of `room` per world unit along the cone's axis, away from the light.
    const double slope = spread_ - plane.normal.dot(towardsKey_);
    if (slope > 0)
      from = std::max(from, -room / slope);
    else if (slope < 0)
      to = std::min(to, -room / slope);
    else if (room < 0)
      return false;
  }
  return from <= to;
}

}  // namespace render
