#include <cstdio>

#include "levelset/shapes/shapes.h"
#include "mapping/patches/patch.h"
#include "render/embree/embree_renderer.h"

int main() {
  render::Scene scene;
  scene.solids.push_back({.band = levelset::makeSphere(1, Imath::V3d(0), 0.1)});
  const render::Hit hit = render::EmbreeScene(scene).intersect({0, 0, 5}, {0, 0, -1});
  std::printf("%.4f\n", hit.distance);
  return hit.found && mapping::Patch{}.particleCount() == 0 ? 0 : 1;
}
