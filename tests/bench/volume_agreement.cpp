// Compares the kernel with the judge on isosurfaces of eight volumes, with all filters, and ten
// random cameras each. A table on standard output: pixels that both hit, pixels that only one hits,
// and quantiles of the differences in depth, in voxels.
//
//   volume_agreement [WIDTH]    width of the pictures, default 200; the height is three quarters

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "render/cpu/cpu_tracer.h"
#include "render/embree/embree_renderer.h"
#include "render/kernel/kernel_scene.h"
#include "tests/support/volume_scenes.h"

namespace {

using namespace render;
using Imath::V3d;

struct Found {
  std::size_t onlyOne = 0;
  std::vector<double> differences;  // voxels
};

/// @param camera  a camera of the scene
void compare(const Scene& scene, const KernelScene& kernel, const EmbreeScene& judge,
             Found& found) {
  const Camera& camera = scene.camera;
  const double voxel = scene.solids[0].voxelSize();
  PixelBlock pixels(static_cast<std::size_t>(camera.width) *
                    static_cast<std::size_t>(camera.height));
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const auto n = static_cast<std::size_t>(y * camera.width + x);
      pixels.x[n] = static_cast<float>(x + 0.5 - 0.5 * camera.width);
      pixels.y[n] = static_cast<float>(y + 0.5 - 0.5 * camera.height);
    }
  const PixelHits hits = kernel.castPixels(CpuTracer(), pixels);
  std::vector<double> depths(pixels.size(), HUGE_VAL);
  tbb::parallel_for(0, camera.width * camera.height, [&](int n) {
    const Camera::Ray ray =
        camera.ray(n % camera.width + 0.5, static_cast<double>(n / camera.width) + 0.5);
    const Hit hit = judge.intersect(ray.origin, ray.direction, ray.near, ray.far);
    if (hit.found)
      depths[static_cast<std::size_t>(n)] = (hit.position - camera.from).dot(camera.axis());
  });
  for (std::size_t n = 0; n < static_cast<std::size_t>(camera.width * camera.height); ++n) {
    const bool isHit = hits.solid[n] >= 0, isJudged = std::isfinite(depths[n]);
    found.onlyOne += isHit != isJudged;
    if (isHit && isJudged) found.differences.push_back(std::abs(hits.depth[n] - depths[n]) / voxel);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  const int width = argc > 1 ? std::stoi(argv[1]) : 200;
  fmt::print("{:<36}{:<18}{:>9}{:>9}{:>10}{:>10}{:>10}\n", "surface", "filter", "both", "one only",
             "median", "99.9 %", "largest");
  for (const auto& [name, surface] : support::volumeSurfaces())
    for (const Filter filter : kFilters) {
      Scene scene;
      scene.solids.push_back(
          {.band = {}, .volume = std::make_shared<const VolumeSurface>(surface)});
      const Imath::Box3d box = surface.volume().grid().bounds();
      scene.camera.width = width;
      scene.camera.height = width * 3 / 4;
      scene.camera.from = box.max + V3d(1);
      KernelScene kernel(scene, levelset::kNoMemoryLimit, filter);
      const EmbreeScene judge(scene, filter);
      std::mt19937 random(1);
      std::normal_distribution<double> normal;
      Found found;
      for (int n = 0; n < 10; ++n) {
        const V3d side = V3d(normal(random), normal(random), normal(random)).normalized();
        scene.camera.to = box.center();
        scene.camera.from = box.center() + side * box.size().length();
        scene.camera.up = std::abs(side.y) < 0.9 ? V3d(0, 1, 0) : V3d(0, 0, 1);
        kernel.updateView(scene);
        compare(scene, kernel, judge, found);
      }
      std::vector<double>& d = found.differences;
      std::sort(d.begin(), d.end());
      const auto at = [&](double share) {
        return d.empty() ? 0
                         : d[static_cast<std::size_t>(share * static_cast<double>(d.size() - 1))];
      };
      fmt::print("{:<36}{:<18}{:>9}{:>9}{:>10.2g}{:>10.2g}{:>10.2g}\n", name, filterName(filter),
                 d.size(), found.onlyOne, at(0.5), at(0.999), at(1));
    }
  return 0;
} catch (const levelset::Error& error) {
  fmt::print(stderr, "volume_agreement: {}\n", error.what());
  return 1;
}
