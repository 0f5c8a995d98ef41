// Compares the kernel with the judge on isosurfaces of eight volumes, with all filters, and ten
// random cameras each. A table on standard output: pixels that both hit, pixels that only one hits,
// pixels whose ray touches the surface, and quantiles of the differences in depth, in voxels. Exits
// 1 when a pixel is hit by one only, or when a difference exceeds 1e-5.
//
//   volume_agreement [WIDTH [FILTER]]    width of the pictures, default 200; the height is three
//                                        quarters

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
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

constexpr double kMostDifference = 1e-5;  // voxels
/// A ray this far beside another one, in voxels, is the same for single precision.
constexpr double kBesideRay = 1e-5;

struct Found {
  std::size_t onlyOne = 0;  // pixels that only one renderer hits
  // Pixels with a larger difference, or of which only one renderer hits anything, because the ray
  // touches the surface: a ray beside it gives the answer of the kernel.
  std::size_t touching = 0;
  std::vector<double> differences;  // of the others, voxels
};

double depthOf(const EmbreeScene& judge, const Camera& camera, const Camera::Ray& ray) {
  const Hit hit = judge.intersect(ray.origin, ray.direction, ray.near, ray.far);
  return hit.found ? (hit.position - camera.from).dot(camera.axis()) : HUGE_VAL;
}

/// True when a ray beside the given one hits the surface within 0.1 voxel of `depth`, or nothing if
/// `depth` is infinite.
bool isBeside(const EmbreeScene& judge, const Camera& camera, Camera::Ray ray, double depth,
              double voxel) {
  const V3d origin = ray.origin, axis = camera.axis();
  const V3d right = axis.cross(camera.up).normalized(), up = right.cross(axis);
  for (int n = 0; n < 8; ++n) {
    const double angle = std::numbers::pi / 4 * n;
    ray.origin = origin + (right * std::cos(angle) + up * std::sin(angle)) * (kBesideRay * voxel);
    const double found = depthOf(judge, camera, ray);
    if (found == depth || std::abs(found - depth) < 0.1 * voxel) return true;
  }
  return false;
}

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
  const auto rayOf = [&](int n) {
    return camera.ray(n % camera.width + 0.5, static_cast<double>(n / camera.width) + 0.5);
  };
  const int count = camera.width * camera.height;
  std::vector<double> depths(static_cast<std::size_t>(count));
  tbb::parallel_for(0, count, [&](int n) {
    depths[static_cast<std::size_t>(n)] = depthOf(judge, camera, rayOf(n));
  });
  for (int n = 0; n < count; ++n) {
    const auto i = static_cast<std::size_t>(n);
    const double ours = hits.solid[i] >= 0 ? hits.depth[i] : HUGE_VAL;
    const bool isHit = std::isfinite(ours), isJudged = std::isfinite(depths[i]);
    if (!isHit && !isJudged) continue;
    const double difference = isHit && isJudged ? std::abs(ours - depths[i]) / voxel : HUGE_VAL;
    if (difference > kMostDifference && isBeside(judge, camera, rayOf(n), ours, voxel)) {
      ++found.touching;
    } else if (isHit != isJudged) {
      ++found.onlyOne;
    } else {
      found.differences.push_back(difference);
    }
  }
}

}  // namespace

int main(int argc, char** argv) try {
  const int width = argc > 1 ? std::stoi(argv[1]) : 200;
  const std::string only = argc > 2 ? argv[2] : "";
  fmt::print("{:<32}{:<18}{:>8}{:>9}{:>9}{:>10}{:>10}{:>10}\n", "surface", "filter", "both",
             "one only", "touching", "median", "99.9 %", "largest");
  std::size_t both = 0, onlyOne = 0, touching = 0;
  double largest = 0;
  for (const auto& [name, surface] : support::volumeSurfaces())
    for (const Filter filter : kFilters) {
      if (!only.empty() && only != filterName(filter)) continue;
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
      fmt::print("{:<32}{:<18}{:>8}{:>9}{:>9}{:>10.2g}{:>10.2g}{:>10.2g}\n", name,
                 filterName(filter), d.size(), found.onlyOne, found.touching, at(0.5), at(0.999),
                 at(1));
      both += d.size();
      onlyOne += found.onlyOne;
      touching += found.touching;
      largest = std::max(largest, at(1));
    }
  const bool isGood = onlyOne == 0 && largest <= kMostDifference && touching <= 1 + both / 100000;
  fmt::print(
      "{} pixels hit by both, {} by one only, {} touching; largest difference {:.2g} voxel, "
      "bound {:.0e}{}\n",
      both, onlyOne, touching, largest, kMostDifference, isGood ? "" : "  missed");
  return isGood ? 0 : 1;
} catch (const levelset::Error& error) {
  fmt::print(stderr, "volume_agreement: {}\n", error.what());
  return 1;
}
