#include "render/meshes/mesh_rays.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "render/meshes/embree_space.h"
#include "render/shading/style.h"

namespace render {
using Imath::Box3d;
using Imath::C3f;
using Imath::V3d;

struct MeshRays::Impl {
  std::vector<MeshPart> parts;
  bool isOpaque;
  Box3d bounds;
  EmbreeSpace view;
  EmbreeTree tree;

  explicit Impl(const Scene& source);

  void build();
  void add(const MeshPart& part, unsigned number);
  /// Computes Embree's ray, which starts where the ray enters the box of the meshes. Returns the
  /// distance from `origin` to that start, at least `near`; nothing when the ray misses the box of
  /// the meshes.
  std::optional<double> prepare(const V3d& origin, const V3d& direction, double near, double far,
                                RTCRay& ray) const;
  void complete(const RTCRayHit& found, const V3d& start, const V3d& direction, double moved,
                Hit& hit) const;
};

MeshRays::Impl::Impl(const Scene& source) : parts(source.meshes) {
  isOpaque = std::all_of(parts.begin(), parts.end(),
                         [](const MeshPart& part) { return part.opacity == 1; });
  for (const MeshPart& part : parts)
    for (const auto& triangle : part.mesh->triangles)
      for (const std::uint32_t v : triangle) bounds.extendBy(part.mesh->positions[v]);
  if (bounds.isEmpty()) return;
  view = EmbreeSpace(bounds);
  build();
}

void MeshRays::Impl::build() {
  tree.open();
  for (std::size_t n = 0; n < parts.size(); ++n)
    if (!parts[n].mesh->isEmpty()) add(parts[n], static_cast<unsigned>(n));
  tree.build();
}

void MeshRays::Impl::add(const MeshPart& part, unsigned number) {
  const levelset::TriMesh& mesh = *part.mesh;
  const RTCGeometry geometry = rtcNewGeometry(tree.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               mesh.positions.size()));
  auto* indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.triangles.size()));
  if (vertices && indices) {
    for (const V3d& p : mesh.positions)
      for (int a = 0; a < 3; ++a)
        *vertices++ = static_cast<float>((p[a] - view.centre[a]) * view.scale);
    for (const auto& triangle : mesh.triangles)
      indices = std::copy(triangle.begin(), triangle.end(), indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(tree.scene, geometry, number);
  }
  rtcReleaseGeometry(geometry);
  requireEmbree(tree.device);
}

std::optional<double> MeshRays::Impl::prepare(const V3d& origin, const V3d& direction, double near,
                                              double far, RTCRay& ray) const {
  if (!tree.scene) return std::nullopt;
  const auto moved = view.entryOf(origin, direction, near, far);
  if (moved) ray = view.rayFrom(origin + direction * *moved, direction, far - *moved);
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
  const double rough = static_cast<double>(found.ray.tfar) / view.scale;
  const double exact = across.dot(a - start) / across.dot(direction);
  // Use the exact intersection with the triangle's plane, unless the ray runs almost parallel to
  // it.
  const double t = std::abs(exact - rough) * view.scale < 1e-3 ? exact : rough;
  hit.found = true;
  hit.distance = moved + t;
  hit.position = start + direction * t;
  hit.facetNormal = across.length() > 0 ? across.normalized() : -direction;
  hit.normal = hit.facetNormal;
  hit.surfaceError = EmbreeSpace::kPad / view.scale;
  hit.id = part.id;
  hit.solid = found.hit.geomID;
  hit.isOnMesh = true;
  hit.colour = part.colour;
  hit.opacity = part.opacity;
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
  return impl_->tree.scene == nullptr;
}
const Box3d& MeshRays::bounds() const {
  return impl_->bounds;
}

Hit MeshRays::intersect(const V3d& origin, const V3d& direction, double near, double far) const {
  Hit hit;
  RTCRayHit found;
  const auto moved = impl_->prepare(origin, direction, near, far, found.ray);
  if (!moved) return hit;
  found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  found.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(impl_->tree.scene, &context, &found);
  if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  impl_->complete(found, origin + direction * *moved, direction, *moved, hit);
  if (hit.distance > far) hit.found = false;
  return hit;
}

bool MeshRays::isOccluded(const V3d& origin, const V3d& direction, double far) const {
  RTCRay ray;
  if (!impl_->prepare(origin, direction, 0, far, ray)) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(impl_->tree.scene, &context, &ray);
  return ray.tfar < 0;
}

double MeshRays::transmittance(const V3d& origin, const V3d& direction, double far) const {
  if (impl_->isOpaque) return isOccluded(origin, direction, far) ? 0 : 1;
  double share = 1, near = 0;
  while (share >= kLeastTransmittance) {
    const Hit hit = intersect(origin, direction, near, far);
    if (!hit.found) break;
    share *= 1 - hit.opacity;
    near = hit.beyond();
  }
  return share;
}

}  // namespace render
