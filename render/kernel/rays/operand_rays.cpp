// Rays of KernelScene through Bézier volumes that are operands of the expression.

#include <utility>

#include "render/kernel/kernel_scene.h"

namespace render {
namespace {

/// Adds the crossings of one ray.
void addOperandCrossings(std::span<const BezierRoot> roots, bool startsOutside,
                         std::vector<BezierRoot>& to, OperandCrossings& all) {
  SolidCrossings found = solidCrossings(roots, startsOutside);
  if (found.isOpen) ++all.open;
  to = std::move(found.roots);
}

}  // namespace

OperandCrossings KernelScene::crossOperands(const KernelTracer& tracer,
                                            const std::vector<Camera::Ray>& rays) const {
  OperandCrossings result;
  TreeCounts counts;
  for (const std::size_t part : operands_) {
    const SharedTree::Roots found = tracer.bezierRoots(*trees_[part], rays, &counts);
    const Imath::Box3d& box = beziers_[part].caster.bounds();
    auto& crossings = result.roots.emplace_back(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Imath::V3d start = rays[i].origin + rays[i].direction * rays[i].near;
      addOperandCrossings(
          std::span(found.roots).subspan(found.first[i], found.first[i + 1] - found.first[i]),
          !box.intersects(start), crossings[i], result);
    }
  }
  result.overruns = counts.overruns;
  return result;
}

OperandCrossings KernelScene::crossOperandsOf(const std::vector<LightRay>& rays, std::size_t first,
                                              std::size_t last) const {
  OperandCrossings result;
  for (const std::size_t part : operands_) {
    const BezierCaster& caster = beziers_[part].caster;
    auto& crossings = result.roots.emplace_back(last - first);
    for (std::size_t i = first; i < last; ++i)
      addOperandCrossings(caster.roots({rays[i].origin, rays[i].direction}),
                          !caster.bounds().intersects(rays[i].origin), crossings[i - first],
                          result);
  }
  return result;
}

Hit KernelScene::hitOnOperand(const Camera::Ray& ray, const PixelHits& hits, std::size_t i) const {
  const std::size_t part = operands_[static_cast<std::size_t>(hits.solid[i]) - solids_.size()];
  const BezierRoot& root = hits.roots[i];
  Hit hit = beziers_[part].hitOf(ray, root.distance, root.normal, bezierSolid_ + part);
  hit.isSingular = root.isSingular;
  hit.isFlipped = hits.flipped[i] != 0;
  if (hit.isFlipped) hit.normal = hit.facetNormal = -hit.normal;
  return hit;
}

}  // namespace render
