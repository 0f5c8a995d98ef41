#include "render/embree/parts/judged_parts.h"

#include <algorithm>

namespace render {
namespace {

/// Hits of two Bézier patches on their common face are one, at this share of the diagonal.
constexpr double kSameBezierHit = 1e-9;

}  // namespace

JudgedParts::JudgedParts(const Scene& scene)
    : segmented_(scene.segmented),
      beziers_(scene.beziers),
      quadrics_(scene.quadrics),
      terrains_(scene.terrains),
      firstSolid_(scene.solids.size() + scene.mapped.size()) {
  if (segmented_) {
    interfaces_.emplace(segmented_->caster);
    bounds_.extendBy(segmented_->caster.bounds());
  }
  firstBezier_ = firstSolid_ + (segmented_ ? 1 : 0);
  firstQuadric_ = firstBezier_ + beziers_.size();
  for (std::size_t n = 0; n < beziers_.size(); ++n)
    if (scene.isOperand(n)) operands_.push_back(n);
  for (const BezierPart& part : beziers_) bounds_.extendBy(part.caster.bounds());
  for (const QuadricPart& part : quadrics_) {
    quadricJudges_.emplace_back(part.caster.model());
    bounds_.extendBy(part.caster.bounds());
  }
  firstTerrain_ = firstQuadric_ + quadrics_.size();
  for (const TerrainPart& part : terrains_) {
    terrainJudges_.emplace_back(part.caster);
    bounds_.extendBy(part.caster.bounds());
  }
}

Hit JudgedParts::firstHit(const Camera::Ray& ray, bool onlyOpaque) const {
  Hit nearest;
  Camera::Ray rest = ray;  // up to the nearest hit
  const auto take = [&](const Hit& hit) {
    nearest = hit;
    rest.far = hit.distance;
  };
  if (interfaces_) {
    const InterfaceRay asked{ray.origin, ray.direction, ray.near, ray.far};
    const Hit hit = segmented_->hitOf(asked, interfaces_->firstHit(asked), firstSolid_);
    if (hit.found) take(hit);
  }
  for (std::size_t n = 0; n < beziers_.size(); ++n) {
    if (isOperand(n) || (onlyOpaque && beziers_[n].opacity < 1)) continue;
    std::vector<Hit> hits = bezierHits(n, rest);
    if (hits.empty()) continue;
    hits[0].isSingular = false;
    take(hits[0]);
  }
  for (std::size_t n = 0; n < quadrics_.size(); ++n) {
    const JudgedQuadric found = quadricJudges_[n].firstHit(rest);
    // The first of two parts with the same surface is seen, as in the kernel.
    const bool isFirst =
        !nearest.found || nearest.solid < firstQuadric_ || found.distance < nearest.distance;
    if (found.found && isFirst)
      take(quadrics_[n].hitOf(ray, found.distance, found.normal, found.colour, firstQuadric_ + n));
  }
  for (std::size_t n = 0; n < terrains_.size(); ++n) {
    const JudgedGround found = terrainJudges_[n].firstHit(rest);
    const bool isFirst =
        !nearest.found || nearest.solid < firstTerrain_ || found.distance < nearest.distance;
    if (!found.found || !isFirst) continue;
    const TerrainHit hit{.found = true,
                         .distance = found.distance,
                         .normal = found.normal,
                         .facetNormal = found.facetNormal,
                         .height = found.height};
    take(terrains_[n].hitOf(ray, hit, firstTerrain_ + n));
  }
  return nearest;
}

std::vector<Hit> JudgedParts::bezierHits(std::size_t n, const Camera::Ray& ray) const {
  std::vector<BezierJudge>& judges = bezierJudges_.local();
  if (judges.empty())
    for (const BezierPart& part : beziers_) judges.emplace_back(part.caster.volume());
  const double same = kSameBezierHit * beziers_[n].caster.bounds().size().length();
  std::vector<Hit> hits;
  const JudgedRoot* last = nullptr;
  const std::vector<JudgedRoot> roots = judges[n].roots(ray);
  for (const JudgedRoot& root : roots) {
    // Both sides of a common face of two patches have its roots.
    const bool isKnown = last && last->patch != root.patch && last->attribute == root.attribute &&
                         root.distance - last->distance < same;
    last = &root;
    if (isKnown) continue;
    hits.push_back(beziers_[n].hitOf(ray, root.distance, root.normal, firstBezier_ + n));
    hits.back().isSingular = root.isUndecided;
  }
  return hits;
}

std::vector<JudgedParts::Crossing> JudgedParts::operandCrossings(std::size_t number,
                                                                 const Camera::Ray& ray) const {
  const std::vector<Hit> hits =
      bezierHits(operands_[number], {ray.origin, ray.direction, ray.near});
  const auto isEntry = [&](const Hit& hit) { return hit.normal.dot(ray.direction) < 0; };
  // Layers of the solid at the begin of the ray: the least number with which none is left twice.
  // Undecided hits count only if the others leave the ray inside.
  int layers = 0, least = 0, left = 0;
  for (const Hit& hit : hits) {
    if (hit.isSingular) continue;
    left += isEntry(hit) ? 1 : -1;
    least = std::min(least, left);
  }
  layers = -least;
  const bool needsUndecided = left + layers != 0;
  std::vector<Crossing> crossings;
  for (const Hit& hit : hits) {
    if (hit.isSingular && !needsUndecided) continue;
    const bool was = layers > 0;
    layers += isEntry(hit) ? 1 : -1;
    if (was != (layers > 0)) crossings.push_back({hit, layers > 0});
  }
  return crossings;
}

std::vector<Hit> JudgedParts::transparentHits(const Camera::Ray& ray) const {
  std::vector<Hit> all;
  for (std::size_t n = 0; n < beziers_.size(); ++n) {
    if (isOperand(n) || beziers_[n].opacity == 1) continue;
    const std::vector<Hit> hits = bezierHits(n, ray);
    all.insert(all.end(), hits.begin(), hits.end());
  }
  for (Hit& hit : all) hit.isSingular = false;
  std::stable_sort(all.begin(), all.end(),
                   [](const Hit& a, const Hit& b) { return a.distance < b.distance; });
  return all;
}

}  // namespace render
