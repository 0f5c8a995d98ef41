#include "render/optics/light_paths.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "render/optics/fresnel.h"

namespace render {
namespace {

using Imath::C3f;
using Imath::V3d;

// Paths, and light rays of their points, that are traced together. They bound the memory.
constexpr std::size_t kMostPathsAtOnce = 1u << 14, kMostLightRays = 1u << 18;

}  // namespace

LightPaths::LightPaths(const Shader& shader, double diagonal, const OpticsOptions& options,
                       std::size_t maxMemory)
    : shader_(shader),
      diagonal_(diagonal),
      options_(options),
      surroundings_(options.environment, maxMemory) {}

LightPaths::Split LightPaths::splitAt(const Hit& hit, const V3d& direction, int inside) const {
  const bool enters = hit.facetNormal.dot(direction) < 0;
  Split split;
  split.facet = enters ? hit.facetNormal : -hit.facetNormal;
  // A ray of the camera may start in a solid.
  split.inside = enters ? inside : std::max(inside, 1);
  split.insideBehind = enters ? inside + 1 : split.inside - 1;
  V3d normal = hit.normal.dot(split.facet) < 0 ? -hit.normal : hit.normal;
  // At grazing angles, the smooth normal may mirror a ray into the drawn surface.
  if (!(normal.dot(direction) < 0) || !(mirrored(direction, normal).dot(split.facet) > 0))
    normal = split.facet;
  const double cosine = std::clamp(-normal.dot(direction), 0.0, 1.0);
  const double coat = options_.reflect > 0 ? schlickShare(options_.reflect, cosine) : 0;
  const double glass = (1 - coat) * options_.refract;
  split.own = (1 - coat) * (1 - options_.refract);
  split.mirror = coat;
  split.mirrored = mirrored(direction, normal);
  split.clear = 0;
  if (!(glass > 0)) return split;
  const auto indexIn = [&](int solids) { return solids > 0 ? options_.index : 1; };
  const double ratio = indexIn(split.insideBehind) / indexIn(split.inside);
  const std::optional<V3d> behind = refracted(direction, normal, ratio);
  const double share = behind ? fresnelShare(cosine, ratio) : 1;
  split.mirror += glass * share;
  split.clear = behind ? glass * (1 - share) : 0;
  if (!behind) return split;
  split.refracted = *behind;
  if (!(behind->dot(split.facet) < 0))
    split.refracted = refracted(direction, split.facet, ratio).value_or(direction);
  return split;
}

Camera::Ray LightPaths::rayFrom(const Hit& hit, const V3d& facet, const V3d& direction) const {
  // Skip the ripples of the trilinear interpolant and the rounding error of the hit, as light rays
  // do. The ray is not displaced, so that it leaves plates at the exact place.
  constexpr double kGrazing = 0.05;
  const double clear = 2 * hit.surfaceError + 1e-9 * diagonal_;
  return {hit.position, direction, clear / std::max(kGrazing, std::abs(facet.dot(direction))),
          Camera::kNoDepth};
}

void LightPaths::add(const Path& path, std::vector<Path>& paths, Sums& sums) const {
  if (!(path.share > 0)) return;
  if (path.bounces > options_.bounces || path.share < kLeastTransmittance)
    sums[path.point] += surroundings_.light(path.ray.direction) * path.share;
  else
    paths.push_back(path);
}

void LightPaths::branch(const Hit& hit, const Split& split, const Path& parent,
                        std::vector<Path>& paths, Sums& sums) const {
  Path next = parent;
  ++next.bounces;
  next.share = parent.share * split.mirror;
  next.inside = split.inside;
  next.ray = rayFrom(hit, split.facet, split.mirrored);
  add(next, paths, sums);
  if (!(split.clear > 0)) return;
  next.share = parent.share * split.clear;
  next.inside = split.insideBehind;
  next.ray = rayFrom(hit, split.facet, split.refracted);
  add(next, paths, sums);
}

std::vector<C3f> LightPaths::colours(const SceneRays& rays,
                                     const std::vector<SeenPoint>& points) const {
  Sums sums;
  std::vector<Path> open;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const SeenPoint& point = points[i];
    const Split split = splitAt(point.hit, point.direction, 0);
    sums.push_back(V3d(point.own) * split.own);
    branch(point.hit, split, {{}, i, 1, 0, 0}, open, sums);
  }
  while (!open.empty()) {
    // The last ones first, so that few are open at a time.
    const auto first =
        open.end() - static_cast<std::ptrdiff_t>(std::min(open.size(), kMostPathsAtOnce));
    const std::vector<Path> some(first, open.end());
    open.erase(first, open.end());
    const std::vector<Path> next = follow(rays, points, some, sums);
    open.insert(open.end(), next.begin(), next.end());
  }
  std::vector<C3f> colours;
  for (const V3d& sum : sums) colours.emplace_back(sum);
  return colours;
}

std::vector<LightPaths::Path> LightPaths::follow(const SceneRays& rays,
                                                 const std::vector<SeenPoint>& points,
                                                 const std::vector<Path>& paths, Sums& sums) const {
  std::vector<Camera::Ray> asked;
  for (const Path& path : paths) asked.push_back(path.ray);
  std::vector<Hit> hits = rays.firstHits(asked);
  struct Lit {
    std::size_t path;
    double share;
    LightRays range;
  };
  std::vector<Lit> lit;
  std::vector<LightRay> lights;
  std::vector<Path> next;
  const auto shade = [&] {
    const std::vector<double> arriving = rays.transmittances(lights);
    for (const Lit& at : lit) {
      const Path& path = paths[at.path];
      const Hit& hit = hits[at.path];
      const PointLight light = Shader::lightOf(at.range, lights, arriving);
      // The ground shows only its shadow, in front of the environment.
      const V3d colour = hit.isOnGround ? surroundings_.light(path.ray.direction) *
                                              (1 - shader_.shadowOpacity(hit, light))
                                        : V3d(shader_.colour(hit, path.ray.direction, light));
      sums[path.point] += colour * at.share;
    }
    lit.clear();
    lights.clear();
  };
  for (std::size_t n = 0; n < paths.size(); ++n) {
    const Path& path = paths[n];
    const SeenPoint& from = points[path.point];
    const V3d& direction = path.ray.direction;
    Hit& hit = hits[n];
    if (!hit.found) hit = shader_.groundHit(path.ray);
    if (!hit.found) {
      sums[path.point] += surroundings_.light(direction) * path.share;
      continue;
    }
    double own = path.share;
    if (!hit.isOnGround) {
      const Split split = splitAt(hit, direction, path.inside);
      Path parent = path;
      parent.share *= hit.opacity;
      own = parent.share * split.own;
      branch(hit, split, parent, next, sums);
      if (hit.opacity < 1) {
        Path through = path;
        ++through.bounces;
        through.share *= 1 - hit.opacity;
        through.inside = split.insideBehind;
        through.ray = rayFrom(hit, split.facet, direction);
        add(through, next, sums);
      }
    }
    if (own > 0)
      lit.push_back({n, own, shader_.addRays(hit, direction, from.x, from.y, from.sample, lights)});
    if (lights.size() > kMostLightRays) shade();
  }
  shade();
  return next;
}

}  // namespace render
