// Share of the shared subdivision tree in the time of a picture: the part that could be kept from
// frame to frame of an animation. CPU time of the process. Usage: bezier_reuse_bench [SIZE]
#include <fmt/core.h>

#include <cstdlib>
#include <ctime>
#include <utility>
#include <vector>

#include "render/bezier/shared_tree.h"
#include "tests/support/bezier_scenes.h"

namespace {

using bezier_scenes::V3d;

double secondsSince(std::clock_t start) {
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

}  // namespace

int main(int argc, char** argv) {
  const int size = argc > 1 ? std::atoi(argv[1]) : 512;
  const std::vector<std::pair<const char*, render::BezierVolume>> cases = {
      {"teardrop", bezier_scenes::teardrop()},
      {"cylinder", bezier_scenes::bentCylinder()},
      {"dice", bezier_scenes::dice()},
      {"cheese", bezier_scenes::cheese()}};
  fmt::print("{0}x{0}\n{1:<12} {2:>10} {3:>10} {4:>12} {5:>12}\n", size, "data", "picture s",
             "shared s", "shared %", "all splits %");
  for (const auto& [name, volume] : cases) {
    render::Camera camera;
    const Imath::Box3d box = volume.bounds();
    camera.to = box.center();
    camera.from = camera.to + V3d(1, -1.6, 0.9).normalized() * box.size().length();
    camera.up = V3d(0, 0, 1);
    camera.width = camera.height = size;
    std::clock_t start = std::clock();
    constexpr int kTimes = 5;
    for (int i = 0; i < kTimes; ++i) (void)render::SharedTree(volume, camera);
    const double shared = secondsSince(start) / kTimes;
    start = std::clock();
    (void)castBezier(volume, camera);
    const double picture = secondsSince(start);
    const render::TreeCounts counts = castBezier(volume, camera, {.measureTime = true}).counts;
    const double measured =
        counts.overlapSeconds + counts.solutionSeconds + counts.splitSeconds + counts.groupSeconds;
    fmt::print("{:<12} {:>10.3f} {:>10.4f} {:>12.1f} {:>12.1f}\n", name, picture, shared,
               100 * shared / picture, 100 * counts.splitSeconds / measured);
  }
  return 0;
}
