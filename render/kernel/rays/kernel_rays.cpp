// First hits of rays of any origin with the parts of KernelScene that need its tables.

#include <limits>
#include <numeric>
#include <utility>

#include "render/kernel/hit_refinement.h"
#include "render/kernel/kernel_scene.h"
#include "render/kernel/rays/packed_rays.h"

namespace render {
namespace {

/// Rays as the input of PackedRays: they start at the `near` of the ray.
std::vector<LightRay> startedAtNear(const std::vector<Camera::Ray>& rays) {
  std::vector<LightRay> started;
  started.reserve(rays.size());
  for (const Camera::Ray& ray : rays)
    started.push_back(
        {ray.origin + ray.direction * ray.near, ray.direction, ray.far - ray.near, 0});
  return started;
}

/// Distance of hit n from the start of its ray after its refinement, world units.
double refinedDistance(const KernelSolid& solid, const PackedRays& packed, std::size_t n,
                       const HitBlock& hits, ShapeBlock& shapes) {
  const double t = refineHit(solid, {packed.start(n), packed.direction(n)}, n, hits, shapes);
  return (packed.enter(n) + t) * solid.voxelSize;
}

}  // namespace

PixelHits KernelScene::castRays(const KernelTracer& tracer,
                                const std::vector<Camera::Ray>& rays) const {
  const std::vector<LightRay> started = startedAtNear(rays);
  PixelHits result(rays.size());
  if (csg_.isEmpty())
    castFirstOf(tracer, started, result);
  else
    castCsgOf(tracer, started, result);
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (result.solid[i] >= 0) result.depth[i] += rays[i].near;
  for (std::size_t i = 0; i < result.roots.size(); ++i) result.roots[i].distance += rays[i].near;
  return result;
}

void KernelScene::castFirstOf(const KernelTracer& tracer, const std::vector<LightRay>& rays,
                              PixelHits& result) const {
  std::vector<std::size_t> all(rays.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  for (std::size_t s = 0; s < solids_.size(); ++s) {
    const KernelSolid& solid = solids_[s];
    const PackedRays packed(solid, rays, all, true);
    HitBlock hits(packed.block.size);
    ShapeBlock shapes(packed.block.size);
    if (!packed.number.empty()) tracer.trace(solid, packed.block, hits, shapes);
    for (std::size_t n = 0; n < packed.number.size(); ++n) {
      if (!hits.found[n]) continue;
      const std::size_t i = packed.number[n];
      const double distance = refinedDistance(solid, packed, n, hits, shapes);
      if (result.solid[i] >= 0 && result.depth[i] <= distance) continue;
      result.depth[i] = distance;
      result.solid[i] = static_cast<std::int32_t>(s);
      result.shapes.take(i, shapes, n);
    }
  }
}

void KernelScene::castCsgOf(const KernelTracer& tracer, const std::vector<LightRay>& rays,
                            PixelHits& result) const {
  std::vector<double> maxDistances;
  for (const LightRay& ray : rays) maxDistances.push_back(ray.maxDistance);
  CsgTraversal walk(csg_, operandCount(), std::move(maxDistances));
  std::vector<PixelTraversal::Crossings> next = emptyCrossings(rays.size());
  const OperandCrossings beziers = crossOperandsOf(rays, 0, rays.size());
  do {
    for (std::size_t s = 0; s < solids_.size(); ++s) {
      const KernelSolid& solid = solids_[s];
      const std::vector<CsgTraversal::Query> queries = walk.queriesFor(s);
      if (queries.empty()) continue;
      std::vector<std::size_t> asked;
      for (const CsgTraversal::Query& query : queries) asked.push_back(query.ray);
      PackedRays packed(solid, rays, asked, false);
      // Rays that miss the box of the solid are not packed.
      std::vector<std::ptrdiff_t> places(queries.size(), -1);
      for (std::size_t q = 0, n = 0; q < queries.size() && n < packed.number.size(); ++q) {
        if (packed.number[n] != queries[q].ray) continue;
        packed.block.passing[n] = queries[q].passing;
        places[q] = static_cast<std::ptrdiff_t>(n++);
      }
      HitBlock hits(packed.block.size);
      ShapeBlock shapes(packed.block.size);
      if (!packed.number.empty()) tracer.trace(solid, packed.block, hits, shapes);
      for (std::size_t q = 0; q < queries.size(); ++q) {
        const auto n = static_cast<std::size_t>(places[q]);
        if (places[q] < 0 || !hits.found[n]) {
          walk.answerNone(s, queries[q]);
          continue;
        }
        // The order of the crossings is that of the kernel's parameters.
        const double place = (packed.enter(n) + static_cast<double>(hits.t[n])) * solid.voxelSize;
        next[s].depth[queries[q].ray] = refinedDistance(solid, packed, n, hits, shapes);
        next[s].shapes.take(queries[q].ray, shapes, n);
        walk.answer(s, queries[q], place, hits.found[n] == HitBlock::kEnters);
      }
    }
    for (std::size_t n = 0; n < operands_.size(); ++n)
      answerOperand(walk, solids_.size() + n, beziers.roots[n], &next[solids_.size() + n],
                    [](const BezierRoot& root) { return root.distance; });
  } while (walk.advance());
  PixelTraversal::takeMet(walk, next, result);
}

BezierHits KernelScene::castBeziersOf(const std::vector<Camera::Ray>& rays) const {
  BezierHits result;
  if (operands_.size() == beziers_.size()) return result;
  result.first.push_back(0);
  for (const Camera::Ray& ray : rays) {
    Hit nearest;
    for (std::size_t part = 0; part < beziers_.size(); ++part) {
      if (isOperand(part)) continue;
      const std::optional<BezierRoot> root = beziers_[part].caster.firstHit(ray);
      if (!root || (nearest.found && nearest.distance <= root->distance)) continue;
      nearest = beziers_[part].hitOf(ray, root->distance, root->normal, bezierSolid_ + part);
    }
    if (nearest.found) result.hits.push_back(nearest);
    result.first.push_back(result.hits.size());
  }
  return result;
}

}  // namespace render
