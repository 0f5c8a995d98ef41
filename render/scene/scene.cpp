#include "render/scene/scene.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>

#include "levelset/error.h"

namespace render {
namespace {

/// Calls visit(position) for the nodes of all shells, world units.
template <typename Visit>
void forEachNode(const std::vector<MappedTexture>& mapped, const Visit& visit) {
  for (const MappedTexture& texture : mapped) {
    if (texture.band.isEmpty() || !texture.shells) continue;
    for (const PrismShell& shell : *texture.shells)
      for (const Imath::V3f& offset : shell.offsets) visit(shell.centre + Imath::V3d(offset));
  }
}

}  // namespace

bool Scene::isOpaque() const {
  const auto hidesAll = [](const auto& part) { return part.opacity == 1; };
  return std::all_of(solids.begin(), solids.end(), hidesAll) &&
         std::all_of(meshes.begin(), meshes.end(), hidesAll) &&
         std::all_of(beziers.begin(), beziers.end(), hidesAll);
}

Imath::Box3d Solid::bounds() const {
  if (isEmpty()) return {};
  return volume ? volume->bounds() : band.zeroSetBounds();
}

bool Scene::hasVolume() const {
  return std::any_of(solids.begin(), solids.end(),
                     [](const Solid& solid) { return solid.volume != nullptr; });
}

Imath::Box3d Scene::volumeBounds() const {
  Imath::Box3d all;
  for (const Solid& solid : solids)
    if (solid.volume) all.extendBy(solid.volume->volume().grid().bounds());
  if (volumePart) all.extendBy(volumePart->volume.bounds());
  return all;
}

namespace {

/// Box of the solids and the operands of the expression, world units.
Imath::Box3d solidBox(const Scene& scene) {
  std::vector<Imath::Box3d> boxes;
  Imath::Box3d all;
  for (const Solid& solid : scene.solids) {
    boxes.push_back(solid.bounds());
    all.extendBy(boxes.back());
  }
  for (const BezierPart& part : scene.beziers) boxes.push_back(part.caster.bounds());
  // Distance by which a smooth union may extend beyond its operands, as a multiple of the softness
  // K.
  constexpr double kMostGrowth = 0.25;
  return scene.csg.isEmpty() ? all : scene.csg.bounds(boxes, kMostGrowth * scene.softness);
}

}  // namespace

Imath::Box3d Scene::bounds() const {
  Imath::Box3d all = solidBox(*this);
  for (const MeshPart& part : meshes) all.extendBy(levelset::bounds(*part.mesh));
  forEachNode(mapped, [&](const Imath::V3d& p) { all.extendBy(p); });
  if (segmented) all.extendBy(segmented->caster.bounds());
  for (std::size_t n = 0; n < beziers.size(); ++n)
    if (!isOperand(n)) all.extendBy(beziers[n].caster.bounds());
  for (const QuadricPart& part : quadrics) all.extendBy(part.caster.bounds());
  for (const TerrainPart& part : terrains) all.extendBy(part.caster.bounds());
  return all;
}

std::vector<double> Scene::extents(const std::vector<Imath::V3d>& directions) const {
  const auto extend = [](std::vector<double>& all, const std::vector<double>& more) {
    for (std::size_t d = 0; d < all.size(); ++d) all[d] = std::max(all[d], more[d]);
  };
  std::vector<double> ofSolids(directions.size(), -std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < solids.size(); ++i)
    if (csg.isEmpty() || csg.uses(i))
      extend(ofSolids, solids[i].volume ? solids[i].volume->extents(directions)
                                        : solids[i].band.zeroSetExtents(directions));
  for (std::size_t n = 0; n < beziers.size(); ++n)
    if (isOperand(n)) extend(ofSolids, beziers[n].caster.extents(directions));
  if (!csg.isEmpty() || isBlended()) {
    // The result may be smaller than its operands, or extend beyond them. Bound it by its box.
    const Imath::Box3d box = solidBox(*this);
    for (std::size_t d = 0; d < directions.size(); ++d) {
      const double extent =
          box.isEmpty() ? -std::numeric_limits<double>::infinity() : extentOf(box, directions[d]);
      ofSolids[d] = isBlended() ? extent : std::min(ofSolids[d], extent);
    }
  }
  for (const MeshPart& part : meshes)
    for (const Imath::V3d& p : part.mesh->positions)
      for (std::size_t d = 0; d < directions.size(); ++d)
        ofSolids[d] = std::max(ofSolids[d], p.dot(directions[d]));
  forEachNode(mapped, [&](const Imath::V3d& p) {
    for (std::size_t d = 0; d < directions.size(); ++d)
      ofSolids[d] = std::max(ofSolids[d], p.dot(directions[d]));
  });
  if (segmented) extend(ofSolids, segmented->caster.extents(directions));
  for (std::size_t n = 0; n < beziers.size(); ++n)
    if (!isOperand(n)) extend(ofSolids, beziers[n].caster.extents(directions));
  for (const QuadricPart& part : quadrics) extend(ofSolids, part.caster.extents(directions));
  for (const TerrainPart& part : terrains) extend(ofSolids, part.caster.extents(directions));
  return ofSolids;
}

void requireOperands(const Scene& scene) {
  for (std::size_t n = 0; n < scene.beziers.size(); ++n) {
    if (!scene.isOperand(n)) continue;
    const BezierPart& part = scene.beziers[n];
    if (scene.isBlended())
      throw levelset::UsageError(fmt::format(
          "scene: the Bézier volume '{}' cannot be an operand of a soft expression; leave the "
          "softness out",
          part.name));
    if (const std::string& why = part.caster.refusalAsSolid(); !why.empty())
      throw levelset::InvalidInput(fmt::format(
          "scene: the Bézier volume '{}' cannot be an operand of the expression: {}, or "
          "leave its name out",
          part.name, why));
  }
}

Camera framingCamera(const Scene& scene, int width, int height, double verticalFov,
                     const Imath::V3d& up) {
  Imath::Box3d bounds = scene.bounds();
  if (bounds.isEmpty()) return framingCamera(scene.volumeBounds(), width, height, verticalFov, up);
  Imath::Box3d lit;  // grid of the volume that is drawn without an isosurface
  if (scene.volumePart && !scene.hasVolume()) lit = scene.volumePart->volume.bounds();
  bounds.extendBy(lit);
  const auto extents = [&](const std::vector<Imath::V3d>& directions) {
    std::vector<double> all = scene.extents(directions);
    for (std::size_t d = 0; d < all.size() && !lit.isEmpty(); ++d)
      all[d] = std::max(all[d], extentOf(lit, directions[d]));
    return all;
  };
  return framingCamera(bounds, extents, width, height, verticalFov, up);
}

Ground groundOf(const Scene& scene, const Imath::V3d& up) {
  const Imath::V3d normal = up.normalized();
  const Imath::Box3d bounds = scene.bounds();
  const double lowest = -scene.extents({-normal})[0];
  const Imath::V3d middle = bounds.center();
  // Low light casts long shadows: of a slope of 1 : 3 at the edge of the disc.
  constexpr double kReach = 3;
  return {middle + normal * (lowest - middle.dot(normal)), normal, kReach * bounds.size().length()};
}

}  // namespace render
