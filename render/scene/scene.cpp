#include "render/scene/scene.h"

#include <algorithm>

namespace render {

bool Scene::isOpaque() const {
  const auto hidesAll = [](const auto& part) { return part.opacity == 1; };
  return std::all_of(solids.begin(), solids.end(), hidesAll) &&
         std::all_of(meshes.begin(), meshes.end(), hidesAll);
}

Imath::Box3d Scene::bounds() const {
  std::vector<Imath::Box3d> boxes;
  Imath::Box3d all;
  for (const Solid& solid : solids) {
    boxes.push_back(solid.band.isEmpty() ? Imath::Box3d() : solid.band.zeroSetBounds());
    all.extendBy(boxes.back());
  }
  // Distance by which a smooth union may extend beyond its operands, as a multiple of the softness
  // K.
  constexpr double kMostGrowth = 0.25;
  if (!csg.isEmpty()) all = csg.bounds(boxes, kMostGrowth * softness);
  for (const MeshPart& part : meshes) all.extendBy(levelset::bounds(*part.mesh));
  return all;
}

}  // namespace render
