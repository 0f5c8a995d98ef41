#include "render/meshes/embree_space.h"

#include <fmt/core.h>

#include <algorithm>

#include "levelset/error.h"

namespace render {

using Imath::Box3d;
using Imath::V3d;

EmbreeSpace::EmbreeSpace(const Box3d& bounds) : centre(bounds.center()) {
  const double diagonal = bounds.size().length();
  scale = diagonal > 0 ? 1 / diagonal : 1;
  const V3d pad(1e-3 / scale);
  box = {bounds.min - pad, bounds.max + pad};
}

std::optional<double> EmbreeSpace::entryOf(const V3d& origin, const V3d& direction, double near,
                                           double far) const {
  for (int a = 0; a < 3; ++a) {
    if (direction[a] == 0) {
      if (origin[a] < box.min[a] || origin[a] > box.max[a]) return std::nullopt;
      continue;
    }
    const double t0 = (box.min[a] - origin[a]) / direction[a];
    const double t1 = (box.max[a] - origin[a]) / direction[a];
    near = std::max(near, std::min(t0, t1));
    far = std::min(far, std::max(t0, t1));
  }
  return near <= far ? std::optional(near) : std::nullopt;
}

RTCRay EmbreeSpace::rayFrom(const V3d& start, const V3d& direction, double maxDistance) const {
  const V3d from = (start - centre) * scale;
  RTCRay ray = {};
  ray.org_x = static_cast<float>(from.x);
  ray.org_y = static_cast<float>(from.y);
  ray.org_z = static_cast<float>(from.z);
  ray.dir_x = static_cast<float>(direction.x);
  ray.dir_y = static_cast<float>(direction.y);
  ray.dir_z = static_cast<float>(direction.z);
  // The box of the scaled scene has a diagonal of 1 and rays start at that box, so no surface is
  // farther than 2.
  ray.tfar = static_cast<float>(std::min(2.0, maxDistance * scale + kPad));
  ray.mask = ~0u;
  return ray;
}

RTCBounds EmbreeSpace::boundsOf(const Box3d& world) const {
  const V3d low = (world.min - centre) * scale - V3d(kPad);
  const V3d high = (world.max - centre) * scale + V3d(kPad);
  RTCBounds bounds = {};
  bounds.lower_x = static_cast<float>(low.x);
  bounds.lower_y = static_cast<float>(low.y);
  bounds.lower_z = static_cast<float>(low.z);
  bounds.upper_x = static_cast<float>(high.x);
  bounds.upper_y = static_cast<float>(high.y);
  bounds.upper_z = static_cast<float>(high.z);
  return bounds;
}

EmbreeTree::~EmbreeTree() {
  if (scene) rtcReleaseScene(scene);
  if (device) rtcReleaseDevice(device);
}

void EmbreeTree::open() {
  device = rtcNewDevice(nullptr);
  requireEmbree(device);
  scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
}

void EmbreeTree::addPrimitives(std::size_t count, void* data, RTCBoundsFunction bounds,
                               RTCIntersectFunctionN intersect, RTCOccludedFunctionN occluded) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(count));
  rtcSetGeometryUserData(geometry, data);
  rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, intersect);
  rtcSetGeometryOccludedFunction(geometry, occluded);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
}

void EmbreeTree::build() {
  rtcCommitScene(scene);
  requireEmbree(device);
}

void requireEmbree(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  throw levelset::ResourceLimit(fmt::format(
      "Embree failed with error code {} ({}); use larger voxels, a coarser mesh, or free "
      "memory",
      static_cast<int>(error), error == RTC_ERROR_OUT_OF_MEMORY ? "out of memory" : "other"));
}

}  // namespace render
