// Light rays of KernelScene: the share of light that passes all surfaces.

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "render/kernel/kernel_scene.h"
#include "render/kernel/rays/packed_rays.h"

namespace render {
namespace {

using Imath::V3d;

constexpr std::size_t kRaysAtOnce = 1u << 18;

/// Orders rays by groups of similar directions. The rays of a vector then pass similar numbers of
/// cells, so that fewer lanes are idle. The order within a group does not change.
/// @param order  indices in `rays`
void sortByDirection(const std::vector<LightRay>& rays, std::vector<std::size_t>& order) {
  constexpr int kEdge = 4;  // groups along an edge of a face of the cube of directions
  constexpr std::size_t kGroups = 6 * kEdge * kEdge;
  const auto groupOf = [](const V3d& d) {
    int axis = 0;
    for (int a = 1; a < 3; ++a)
      if (std::abs(d[a]) > std::abs(d[axis])) axis = a;
    const double scale = 0.5 * kEdge / std::abs(d[axis]);
    const auto part = [&](double along) {
      return std::clamp(static_cast<int>(along * scale + 0.5 * kEdge), 0, kEdge - 1);
    };
    const int face = 2 * axis + (d[axis] < 0 ? 1 : 0);
    return static_cast<std::size_t>((face * kEdge + part(d[(axis + 1) % 3])) * kEdge +
                                    part(d[(axis + 2) % 3]));
  };
  std::vector<unsigned char> group(order.size());
  std::array<std::size_t, kGroups + 1> start{};
  for (std::size_t n = 0; n < order.size(); ++n) {
    group[n] = static_cast<unsigned char>(groupOf(rays[order[n]].direction));
    ++start[group[n] + 1];
  }
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<std::size_t> sorted(order.size());
  for (std::size_t n = 0; n < order.size(); ++n) sorted[start[group[n]]++] = order[n];
  order = std::move(sorted);
}

}  // namespace

std::vector<double> KernelScene::transmittances(const KernelTracer& tracer,
                                                const std::vector<LightRay>& rays) const {
  std::vector<double> light(rays.size(), 1);
  if (fields_) {
    std::vector<FieldRay> asked;
    asked.reserve(rays.size());
    for (const LightRay& ray : rays)
      asked.push_back({ray.origin, ray.direction, 0, ray.maxDistance});
    const std::vector<char> occluded = fields_->areOccluded(tracer, asked);
    for (std::size_t i = 0; i < rays.size(); ++i)
      if (occluded[i]) light[i] = 0;
  }
  for (std::size_t first = 0; first < rays.size() && !fields_; first += kRaysAtOnce) {
    const std::size_t last = std::min(rays.size(), first + kRaysAtOnce);
    if (csg_.isEmpty())
      dimBySolids(tracer, rays, first, last, light);
    else
      dimByCsg(tracer, rays, first, last, light);
  }
  for (std::size_t i = 0; i < rays.size() && !meshes_.isEmpty(); ++i)
    if (light[i] >= kLeastTransmittance)
      light[i] *= meshes_.transmittance(rays[i].origin, rays[i].direction, rays[i].maxDistance);
  for (std::size_t i = 0; i < rays.size() && !mapped_.isEmpty(); ++i)
    if (light[i] >= kLeastTransmittance &&
        mapped_.isOccluded(rays[i].origin, rays[i].direction, rays[i].maxDistance))
      light[i] = 0;
  if (segmented_) {
    std::vector<InterfaceRay> asked;
    std::vector<std::size_t> numbers;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (light[i] < kLeastTransmittance) continue;
      asked.push_back({rays[i].origin, rays[i].direction, 0, rays[i].maxDistance});
      numbers.push_back(i);
    }
    const std::vector<InterfaceHit> hits = tracer.interfaceHits(segmented_->caster, asked, false);
    for (std::size_t n = 0; n < numbers.size(); ++n)
      if (hits[n].found) light[numbers[n]] = 0;
  }
  for (std::size_t n = 0; n < beziers_.size(); ++n) {
    if (isOperand(n)) continue;
    const BezierPart& part = beziers_[n];
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (light[i] < kLeastTransmittance) continue;
      const Camera::Ray ray{rays[i].origin, rays[i].direction, 0, rays[i].maxDistance};
      if (part.opacity < 1)
        light[i] *= std::pow(1 - part.opacity, static_cast<double>(part.caster.roots(ray).size()));
      else if (part.caster.isOccluded(ray))
        light[i] = 0;
    }
  }
  const auto dimBy = [&](const auto& parts) {
    for (const auto& part : parts)
      for (std::size_t i = 0; i < rays.size(); ++i)
        if (light[i] >= kLeastTransmittance &&
            part.caster.isOccluded({rays[i].origin, rays[i].direction, 0, rays[i].maxDistance}))
          light[i] = 0;
  };
  dimBy(quadrics_);
  dimBy(terrains_);
  return light;
}

void KernelScene::dimBySolids(const KernelTracer& tracer, const std::vector<LightRay>& rays,
                              std::size_t first, std::size_t last,
                              std::vector<double>& light) const {
  for (const KernelSolid& solid : solids_) {
    std::vector<std::size_t> open;
    for (std::size_t i = first; i < last; ++i)
      if (light[i] >= kLeastTransmittance) open.push_back(i);
    sortByDirection(rays, open);
    for (std::int32_t passing = 0; !open.empty(); ++passing) {
      PackedRays packed(solid, rays, open, true);
      std::fill(packed.block.passing.begin(), packed.block.passing.end(), passing);
      HitBlock hits(packed.block.size);
      tracer.trace(solid, packed.block, hits);
      open.clear();
      for (std::size_t n = 0; n < packed.number.size(); ++n) {
        if (!hits.found[n]) continue;
        double& left = light[packed.number[n]];
        left *= 1 - solid.opacity;
        if (left >= kLeastTransmittance) open.push_back(packed.number[n]);
      }
    }
  }
}

void KernelScene::dimByCsg(const KernelTracer& tracer, const std::vector<LightRay>& rays,
                           std::size_t first, std::size_t last, std::vector<double>& light) const {
  std::vector<double> maxDistance;
  for (std::size_t i = first; i < last; ++i) maxDistance.push_back(rays[i].maxDistance);
  CsgTraversal walk(csg_, operandCount(), std::move(maxDistance));
  const OperandCrossings beziers = crossOperandsOf(rays, first, last);
  bool asks;
  do {
    for (std::size_t s = 0; s < solids_.size(); ++s) {
      const KernelSolid& solid = solids_[s];
      const std::vector<CsgTraversal::Query> queries = walk.queriesFor(s);
      std::vector<std::size_t> asked;
      for (const CsgTraversal::Query& query : queries) asked.push_back(first + query.ray);
      // Trace the rays beyond their maxDistance: if a ray lies entirely inside a solid, only a
      // crossing behind its end shows that.
      PackedRays packed(solid, rays, asked, false);
      std::size_t n = 0;
      for (const CsgTraversal::Query& query : queries) {
        if (n < packed.number.size() && packed.number[n] == first + query.ray)
          packed.block.passing[n++] = query.passing;
      }
      HitBlock hits(packed.block.size);
      if (!packed.number.empty()) tracer.trace(solid, packed.block, hits);
      n = 0;
      for (const CsgTraversal::Query& query : queries) {
        const bool isNear = n < packed.number.size() && packed.number[n] == first + query.ray;
        if (isNear && hits.found[n])
          walk.answer(s, query,
                      (packed.enter(n) + static_cast<double>(hits.t[n])) * solid.voxelSize,
                      hits.found[n] == HitBlock::kEnters);
        else
          walk.answerNone(s, query);
        if (isNear) ++n;
      }
    }
    for (std::size_t n = 0; n < operands_.size(); ++n)
      answerOperand(walk, solids_.size() + n, beziers.roots[n], nullptr,
                    [](const BezierRoot& root) { return root.distance; });
    asks = walk.advance();
    // Rays with a hit continue only when no ray has open queries, so that all rays continue in one
    // batch.
    if (asks) continue;
    for (std::size_t i = first; i < last; ++i) {
      const std::int32_t met = walk.solidMet(i - first);
      if (met < 0 || light[i] < kLeastTransmittance) continue;
      light[i] *= 1 - opacityOf(static_cast<std::size_t>(met));
      if (light[i] < kLeastTransmittance) continue;
      walk.resume(i - first);
      asks = true;
    }
  } while (asks);
}

}  // namespace render
