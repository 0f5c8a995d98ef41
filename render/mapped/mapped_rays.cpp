#include "render/mapped/mapped_rays.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "render/mapped/shell_walk.h"
#include "render/mapped/texture_rays_vdb.h"
#include "render/meshes/embree_space.h"
#include "render/shading/principal_direction.h"
#include "render/shading/surface_shape.h"

namespace render {

using Imath::Box3d;
using Imath::M33d;
using Imath::V3d;

struct MappedRays::Impl {
  /// A mapped texture, prepared.
  struct Texture {
    std::shared_ptr<const std::vector<PrismShell>> shells;  // the walkers refer to them
    std::vector<ShellWalker> walkers;
    TextureRays rays;
    Imath::C3f colour;
    std::uint32_t id;
    std::size_t index;        // Hit::solid
    std::size_t number;       // index in Impl::textures
    const EmbreeSpace* view;  // scaled space of Embree's rays

    Texture(const MappedTexture& source, std::size_t index_, std::size_t number_)
        : shells(source.shells),
          rays(source.band),
          colour(source.colour),
          id(source.id),
          index(index_),
          number(number_),
          view(nullptr) {
      walkers.reserve(shells->size());
      for (const PrismShell& shell : *shells) walkers.emplace_back(shell);
    }
  };

  /// A hit in a shell.
  struct ShellHit {
    double t = 0;  // distance along the ray, world units
    const Texture* texture = nullptr;
    std::size_t shell = 0;
    ShellTetrahedron tetrahedron;
    V3d index;  // position in the index space of the texture
  };

  /// State for Embree's callbacks in addition to its single-precision ray.
  struct Query {
    RTCIntersectContext embree;  // first member: Embree returns its address
    V3d origin, direction;
    double near, limit;  // range of the search, distances from `origin`, world units
    double nearest;      // distance of the best hit, or `limit`
    double scale;
    ShellHit hit;
  };

  std::vector<std::unique_ptr<Texture>> textures;
  Box3d bounds;
  EmbreeSpace view;
  EmbreeTree tree;

  explicit Impl(const Scene& source);

  void build();
  static std::optional<ShellHit> findHit(const Texture& texture, std::size_t shell,
                                         const Query& query);
  static void boundShell(const RTCBoundsFunctionArguments* args);
  static void intersectShell(const RTCIntersectFunctionNArguments* args);
  static void occludeShell(const RTCOccludedFunctionNArguments* args);
  /// Computes the query of a ray, and Embree's ray. Returns the distance from `origin` to the
  /// query's origin; nothing when the ray misses the box of the shells.
  std::optional<double> prepare(const V3d& origin, const V3d& direction, double near, double far,
                                Query& query, RTCRay& ray) const;
};

MappedRays::Impl::Impl(const Scene& source) {
  for (std::size_t i = 0; i < source.mapped.size(); ++i) {
    const MappedTexture& mapped = source.mapped[i];
    if (mapped.band.isEmpty() || !mapped.shells || mapped.shells->empty()) continue;
    auto texture = std::make_unique<Texture>(mapped, source.solids.size() + i, textures.size());
    if (texture->rays.isEmpty()) continue;
    for (const ShellWalker& walker : texture->walkers) bounds.extendBy(walker.bounds());
    textures.push_back(std::move(texture));
  }
  if (textures.empty()) return;
  view = EmbreeSpace(bounds);
  build();
}

void MappedRays::Impl::build() {
  tree.open();
  for (const auto& texture : textures) {
    texture->view = &view;
    tree.addPrimitives(texture->walkers.size(), texture.get(), boundShell, intersectShell,
                       occludeShell);
  }
  tree.build();
}

std::optional<MappedRays::Impl::ShellHit> MappedRays::Impl::findHit(const Texture& texture,
                                                                    std::size_t shell,
                                                                    const Query& query) {
  const TextureRays::Reader reader = texture.rays.reader();
  std::optional<ShellHit> best;
  double far = query.nearest;
  bool wasInside = false;
  texture.walkers[shell].walk(
      query.origin, query.direction, query.near, far,
      [&](const ShellSegment& segment, bool isFirst) {
        if (segment.enter > far) return false;
        const V3d from = texture.rays.toIndex(segment.from), to = texture.rays.toIndex(segment.to);
        const double length = segment.leave - segment.enter;
        const double start =
            segment.enter < query.near && length > 0 ? (query.near - segment.enter) / length : 0;
        // The sides of the surface at the ends of all segments show a crossing at a face of a
        // tetrahedron, where rounding may hide it from both segments.
        if (isFirst) wasInside = TextureRays::isInside(reader, from + (to - from) * start);
        const bool isInside = TextureRays::isInside(reader, to);
        std::optional<double> share = texture.rays.firstCrossing(from, to, start);
        if (!share && isInside != wasInside) share = 1;
        wasInside = isInside;
        if (!share) return true;
        const double t = segment.enter + *share * length;
        if (t < query.near || t > far) return t <= far;
        best = ShellHit{t, &texture, shell, segment.tetrahedron, from + (to - from) * *share};
        far = t;
        return false;
      });
  return best;
}

void MappedRays::Impl::boundShell(const RTCBoundsFunctionArguments* args) {
  const auto& texture = *static_cast<const Texture*>(args->geometryUserPtr);
  *args->bounds_o = texture.view->boundsOf(texture.walkers[args->primID].bounds());
}

void MappedRays::Impl::intersectShell(const RTCIntersectFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto& query = *reinterpret_cast<Query*>(args->context);
  const auto& texture = *static_cast<const Texture*>(args->geometryUserPtr);
  const auto hit = findHit(texture, args->primID, query);
  if (!hit) return;
  // At equal distances the first shell of the first texture counts, in any order of the calls.
  const ShellHit& best = query.hit;
  if (best.texture && hit->t == best.t &&
      std::pair(texture.number, hit->shell) > std::pair(best.texture->number, best.shell))
    return;
  query.hit = *hit;
  query.nearest = hit->t;
  // The padding keeps shells with a hit at the same distance within the range of Embree's ray.
  RTCRayN* ray = RTCRayHitN_RayN(args->rayhit, args->N);
  RTCRayN_tfar(ray, args->N, 0) = std::min(
      RTCRayN_tfar(ray, args->N, 0), static_cast<float>(hit->t * query.scale + EmbreeSpace::kPad));
  RTCHitN* found = RTCRayHitN_HitN(args->rayhit, args->N);
  RTCHitN_geomID(found, args->N, 0) = args->geomID;
  RTCHitN_primID(found, args->N, 0) = args->primID;
}

void MappedRays::Impl::occludeShell(const RTCOccludedFunctionNArguments* args) {
  if (!args->valid[0]) return;
  const auto& query = *reinterpret_cast<const Query*>(args->context);
  const auto& texture = *static_cast<const Texture*>(args->geometryUserPtr);
  if (findHit(texture, args->primID, query))
    RTCRayN_tfar(args->ray, args->N, 0) = -std::numeric_limits<float>::infinity();
}

std::optional<double> MappedRays::Impl::prepare(const V3d& origin, const V3d& direction,
                                                double near, double far, Query& query,
                                                RTCRay& ray) const {
  if (!tree.scene) return std::nullopt;
  const auto moved = view.entryOf(origin, direction, near, far);
  if (!moved) return std::nullopt;
  rtcInitIntersectContext(&query.embree);
  query.origin = origin + direction * *moved;
  query.direction = direction;
  query.near = 0;
  query.limit = query.nearest = far - *moved;
  query.scale = view.scale;
  ray = view.rayFrom(query.origin, direction, query.limit);
  return moved;
}

MappedRays::MappedRays(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}
MappedRays::~MappedRays() = default;
MappedRays::MappedRays(MappedRays&&) noexcept = default;
MappedRays& MappedRays::operator=(MappedRays&&) noexcept = default;

bool MappedRays::isEmpty() const {
  return impl_->tree.scene == nullptr;
}
const Box3d& MappedRays::bounds() const {
  return impl_->bounds;
}

std::size_t MappedRays::bytes() const {
  std::size_t sum = 0;
  for (const auto& texture : impl_->textures) {
    sum += texture->rays.bytes() + texture->walkers.size() * sizeof(ShellWalker);
    for (const ShellWalker& walker : texture->walkers) sum += walker.bytes();
  }
  return sum;
}

Hit MappedRays::intersect(const V3d& origin, const V3d& direction, double near, double far) const {
  Hit hit;
  Impl::Query query;
  RTCRayHit found;
  const auto moved = impl_->prepare(origin, direction, near, far, query, found.ray);
  if (!moved) return hit;
  found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  found.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->tree.scene, &query.embree, &found);
  if (!query.hit.texture) return hit;
  const Impl::ShellHit& best = query.hit;
  const Impl::Texture& texture = *best.texture;
  hit.found = true;
  hit.distance = *moved + best.t;
  hit.position = query.origin + direction * best.t;
  hit.id = texture.id;
  hit.solid = texture.index;
  hit.colour = texture.colour;
  // Derivatives with respect to the drawn space, by the chain rule with the slopes of the map.
  SurfaceShape shape = texture.rays.shapeAt(best.index);
  const M33d slopes =
      texture.walkers[best.shell].slopes(best.tetrahedron) * texture.rays.indexSlopes();
  const M33d transposed = slopes.transposed();
  shape.gradient = shape.gradient * transposed;
  shape.trilinearGradient = shape.trilinearGradient * transposed;
  shape.hessian = slopes * shape.hessian * transposed;
  const double steepness = shape.trilinearGradient.length();
  shape.interpolationError = steepness > 0 ? shape.interpolationError / steepness : 0;
  addShape(hit, shape, Imath::M44d(), direction);
  addDirection(hit, shape, Imath::M44d());
  return hit;
}

bool MappedRays::isOccluded(const V3d& origin, const V3d& direction, double far) const {
  Impl::Query query;
  RTCRay ray;
  if (!impl_->prepare(origin, direction, 0, far, query, ray)) return false;
  rtcOccluded1(impl_->tree.scene, &query.embree, &ray);
  return ray.tfar < 0;
}

}  // namespace render
