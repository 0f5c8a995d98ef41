#include "render/scene.h"

namespace render {

Imath::Box3d Scene::bounds() const {
  std::vector<Imath::Box3d> boxes;
  Imath::Box3d all;
  for (const Solid& solid : solids) {
    boxes.push_back(solid.band.isEmpty() ? Imath::Box3d() : solid.band.zeroSetBounds());
    all.extendBy(boxes.back());
  }
  constexpr double kMostGrowth = 0.25;  // of a smooth minimum, in K
  if (!csg.isEmpty()) all = csg.bounds(boxes, kMostGrowth * softness);
  for (const MeshPart& part : meshes) all.extendBy(levelset::bounds(*part.mesh));
  return all;
}

}  // namespace render
