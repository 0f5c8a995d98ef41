#include "render/embree/mesh_rays.h"

#include <embree3/rtcore.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "levelset/error.h"
#include "render/shading/style.h"

namespace render {
namespace {

using Imath::Box3d;
using Imath::C3f;
using Imath::V3d;

/// Embree's floats see the meshes scaled to a diagonal of 1 around the origin, and rays that start
/// at their box: what a hit may be off, and how far beyond its end a ray looks.
constexpr double kFloatPad = 2e-6;

/// The part of a ray that is in the box; nothing when it misses.
std::optional<std::pair<double, double>> partIn(const Box3d& box, const V3d& origin,
                                                const V3d& direction, double far) {
  double near = 0;
  for (int a = 0; a < 3; ++a) {
    if (direction[a] == 0) {
      if (origin[a] < box.min[a] || origin[a] > box.max[a]) return std::nullopt;
      continue;
    }
    const double t0 = (box.min[a] - origin[a]) / direction[a],
                 t1 = (box.max[a] - origin[a]) / direction[a];
    near = std::max(near, std::min(t0, t1));
    far = std::min(far, std::max(t0, t1));
  }
  return near <= far ? std::optional(std::pair(near, far)) : std::nullopt;
}

}  // namespace

struct MeshRays::Impl {
  std::vector<MeshPart> parts;
  Box3d bounds, rayBounds;
  V3d centre;
  double scale = 1;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  explicit Impl(const Scene& source);
  ~Impl() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void check() const;
  void build();
  void add(const MeshPart& part, unsigned number);
  /// How far it is to where the ray enters the box, with Embree's ray from there; nothing: it
  /// misses.
  std::optional<double> prepare(const V3d& origin, const V3d& direction, double far,
                                RTCRay& ray) const;
  void complete(const RTCRayHit& found, const V3d& start, const V3d& direction, double moved,
                Hit& hit) const;
};

MeshRays::Impl::Impl(const Scene& source) : parts(source.meshes) {
  for (const MeshPart& part : parts)
    for (const auto& triangle : part.mesh->triangles)
      for (const std::uint32_t v : triangle) bounds.extendBy(part.mesh->positions[v]);
  if (bounds.isEmpty()) return;
  centre = bounds.center();
  const double diagonal = bounds.size().length();
  scale = diagonal > 0 ? 1 / diagonal : 1;
  const V3d pad(1e-3 / scale);
  rayBounds = {bounds.min - pad, bounds.max + pad};
  try {
    build();
  } catch (...) {  // the destructor does not run for a constructor that throws
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
    throw;
  }
}

void MeshRays::Impl::check() const {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  throw levelset::ResourceLimit(fmt::format(
      "render: Embree failed with its error {} ({}); use a coarser mesh or free memory",
      static_cast<int>(error), error == RTC_ERROR_OUT_OF_MEMORY ? "out of memory" : "other"));
}

void MeshRays::Impl::build() {
  device = rtcNewDevice(nullptr);
  check();
  scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  for (std::size_t n = 0; n < parts.size(); ++n)
    if (!parts[n].mesh->isEmpty()) add(parts[n], static_cast<unsigned>(n));
  rtcCommitScene(scene);
  check();
}

void MeshRays::Impl::add(const MeshPart& part, unsigned number) {
  const levelset::TriMesh& mesh = *part.mesh;
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               mesh.positions.size()));
  auto* indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.triangles.size()));
  if (vertices && indices) {
    for (const V3d& p : mesh.positions)
      for (int a = 0; a < 3; ++a) *vertices++ = static_cast<float>((p[a] - centre[a]) * scale);
    for (const auto& triangle : mesh.triangles)
      indices = std::copy(triangle.begin(), triangle.end(), indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, number);
  }
  rtcReleaseGeometry(geometry);
  check();
}

std::optional<double> MeshRays::Impl::prepare(const V3d& origin, const V3d& direction, double far,
                                              RTCRay& ray) const {
  if (!scene) return std::nullopt;
  const auto part = partIn(rayBounds, origin, direction, far);
  if (!part) return std::nullopt;
  const double moved = part->first;
  const V3d start = (origin + direction * moved - centre) * scale;
  ray = {};
  ray.org_x = static_cast<float>(start.x);
  ray.org_y = static_cast<float>(start.y);
  ray.org_z = static_cast<float>(start.z);
  ray.dir_x = static_cast<float>(direction.x);
  ray.dir_y = static_cast<float>(direction.y);
  ray.dir_z = static_cast<float>(direction.z);
  ray.tfar = static_cast<float>(std::min(2.0, (far - moved) * scale + kFloatPad));
  ray.mask = ~0u;
  return moved;
}

void MeshRays::Impl::complete(const RTCRayHit& found, const V3d& start, const V3d& direction,
                              double moved, Hit& hit) const {
  const MeshPart& part = parts[found.hit.geomID];
  const levelset::TriMesh& mesh = *part.mesh;
  const auto& triangle = mesh.triangles[found.hit.primID];
  const V3d &a = mesh.positions[triangle[0]], &b = mesh.positions[triangle[1]],
            &c = mesh.positions[triangle[2]];
  const V3d across = (b - a).cross(c - a);
  const double rough = static_cast<double>(found.ray.tfar) / scale;
  const double exact = across.dot(a - start) / across.dot(direction);
  // On its plane, unless the ray runs along it.
  const double t = std::abs(exact - rough) * scale < 1e-3 ? exact : rough;
  hit.found = true;
  hit.distance = moved + t;
  hit.position = start + direction * t;
  hit.facetNormal = across.length() > 0 ? across.normalized() : -direction;
  hit.normal = hit.facetNormal;
  hit.surfaceError = kFloatPad / scale;
  hit.id = part.id;
  hit.solid = found.hit.geomID;
  hit.colour = part.colour;
  const double u = static_cast<double>(found.hit.u), v = static_cast<double>(found.hit.v);
  const double share[3] = {1 - u - v, u, v};
  if (!mesh.attributes.normals.empty()) {
    V3d normal(0);
    for (std::size_t k = 0; k < 3; ++k) normal += mesh.attributes.normals[triangle[k]] * share[k];
    if (normal.length() > 0) hit.normal = normal.normalized();
  }
  if (!mesh.attributes.colors.empty()) {
    Imath::V4f colour(0);
    for (std::size_t k = 0; k < 3; ++k)
      colour += mesh.attributes.colors[triangle[k]] * static_cast<float>(share[k]);
    hit.colour = C3f(linearFromSrgb(colour.x), linearFromSrgb(colour.y), linearFromSrgb(colour.z));
  }
}

MeshRays::MeshRays(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}
MeshRays::~MeshRays() = default;
MeshRays::MeshRays(MeshRays&&) noexcept = default;
MeshRays& MeshRays::operator=(MeshRays&&) noexcept = default;

bool MeshRays::isEmpty() const {
  return impl_->scene == nullptr;
}
const Box3d& MeshRays::bounds() const {
  return impl_->bounds;
}

Hit MeshRays::intersect(const V3d& origin, const V3d& direction, double far) const {
  Hit hit;
  RTCRayHit found;
  const auto moved = impl_->prepare(origin, direction, far, found.ray);
  if (!moved) return hit;
  found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  found.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(impl_->scene, &context, &found);
  if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  impl_->complete(found, origin + direction * *moved, direction, *moved, hit);
  if (hit.distance > far) hit.found = false;
  return hit;
}

bool MeshRays::isOccluded(const V3d& origin, const V3d& direction, double far) const {
  RTCRay ray;
  if (!impl_->prepare(origin, direction, far, ray)) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(impl_->scene, &context, &ray);
  return ray.tfar < 0;
}

}  // namespace render
