// Shared subdivision trees beside the basic scheme, in the published workloads [Liu14]. CPU time of
// the process, so other load of the machine matters little. Usage: bezier_bench [SIZE [NAME]];
// with NAME, only that row of the first two tables; with the name growth, only the growth with the
// resolution; with the name gpu, only the wall time of the processor and of the compute shaders.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "render/gpu/bezier/gpu_beziers.h"
#include "render/gpu/device/gl_context.h"
#include "tests/bench/bezier_workloads.h"

namespace {

using namespace bezier_workloads;

bool isSame(const BezierPicture& a, const BezierPicture& b) {
  if (a.first != b.first) return false;
  for (std::size_t n = 0; n < a.roots.size(); ++n)
    if (!(std::abs(a.roots[n].depth - b.roots[n].depth) <= 1e-9 * std::abs(a.roots[n].depth)))
      return false;
  return true;
}

void table(int width, int height, const std::string& only) {
  struct Case {
    const char* name;
    BezierVolume volume;
    double share, published;
  };
  std::vector<Case> cases = {{"teardrop", bezier_scenes::teardrop(), 0.389, 41.6},
                             {"cylinder", bezier_scenes::bentCylinder(), 0.681, 11.4},
                             {"dice", bezier_scenes::dice(), 0.325, 11.03},
                             {"cheese", bezier_scenes::cheese(), 0.325, 9.56}};
  if (BezierVolume surfaces = teapot(); !surfaces.patches.empty())
    cases.push_back({"teapot", std::move(surfaces), 0.682, 12.9});
  fmt::print("{}x{}\n{:<12} {:>7} {:>10} {:>10} {:>7} {:>10} {:>9}\n", width, height, "data",
             "cover %", "shared s", "basic s", "ratio", "published", "peak MB");
  for (const Case& c : cases) {
    if (!only.empty() && c.name != only) continue;
    const Camera camera = fittedCamera(c.volume, width, height, c.share);
    const Timed shared = timed(c.volume, camera, kShared), basic = timed(c.volume, camera, kBasic);
    fmt::print("{:<12} {:>7.1f} {:>10.3f} {:>10.3f} {:>7.1f} {:>10.1f} {:>9.2f}{}\n", c.name,
               coverOf(shared.picture), shared.seconds, basic.seconds,
               basic.seconds / shared.seconds, c.published,
               static_cast<double>(shared.picture.counts.peakBytes) / 1e6,
               isSame(shared.picture, basic.picture) ? "" : "  the pictures differ");
  }
}

/// Wall seconds of a call, the least of three.
template <typename Call>
double wallSeconds(const Call& call) {
  double least = 1e300;
  for (int run = 0; run < 3; ++run) {
    const auto start = std::chrono::steady_clock::now();
    call();
    least = std::min(
        least, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return least;
}

/// Roots of all pixels by all threads of the processor, and by the compute shaders.
void onGpu(int size) {
  const render::GlContext context;
  render::GpuBeziers beziers(context);
  fmt::print("{}, {}x{}\n{:<12} {:>12} {:>12} {:>7} {:>10}\n", context.description(), size, size,
             "data", "processor s", "shaders s", "ratio", "peak MB");
  for (const auto& [name, volume] :
       {std::pair<const char*, BezierVolume>{"teardrop", bezier_scenes::teardrop()},
        {"cylinder", bezier_scenes::bentCylinder()},
        {"dice", bezier_scenes::dice()},
        {"teapot", bezier_scenes::teapot()}}) {
    if (volume.patches.empty()) continue;
    const Camera camera = cameraOf(volume, size, size, 1.2);
    std::vector<Camera::Ray> rays;  // in squares, as in pictures
    constexpr int kSquare = 16;
    for (int top = 0; top < size; top += kSquare)
      for (int left = 0; left < size; left += kSquare)
        for (int y = top; y < std::min(top + kSquare, size); ++y)
          for (int x = left; x < std::min(left + kSquare, size); ++x)
            rays.push_back(camera.ray(x + 0.5, y + 0.5));
    const double processor = wallSeconds([&] { (void)castBezier(volume, camera, kShared); });
    const double shaders = wallSeconds([&] {
      const render::SharedTree tree(volume, camera, kShared);
      (void)beziers.rootsOn(tree, tree.screensOf(rays));
    });
    fmt::print("{:<12} {:>12.3f} {:>12.3f} {:>7.1f} {:>10.1f}\n", name, processor, shaders,
               shaders / processor, static_cast<double>(beziers.counts().peakBytes) / 1e6);
  }
  context.run([&] { beziers.release(); });
}

void degrees(int size) {
  fmt::print("\nsphere, {}x{}\n{:<8} {:>10} {:>10} {:>7}\n", size, size, "degree", "shared s",
             "basic s", "ratio");
  for (int degree = 2; degree <= 5; ++degree) {
    const BezierVolume volume = bezier_scenes::sphere(degree);
    const Camera camera = fittedCamera(volume, size, size, 0.4);
    const double shared = timed(volume, camera, kShared).seconds,
                 basic = timed(volume, camera, kBasic).seconds;
    fmt::print("{:<8} {:>10.3f} {:>10.3f} {:>7.1f}\n", degree, shared, basic, basic / shared);
  }
}

void resolutions(int most) {
  fmt::print("\n{:<12} {:>6} {:>10} {:>9} {:>9} {:>9}\n", "data", "size", "shared s", "growth",
             "nodes MB", "growth");
  for (const auto& [name, volume] :
       {std::pair<const char*, BezierVolume>{"teardrop", bezier_scenes::teardrop()},
        {"cylinder", bezier_scenes::bentCylinder()},
        {"dice", bezier_scenes::dice()}}) {
    double seconds = 0, bytes = 0;
    for (int size = most / 8; size <= most; size *= 2) {
      const Timed run = timed(volume, cameraOf(volume, size, size, 1.2), kShared);
      const auto memory = static_cast<double>(run.picture.counts.peakBytes);
      fmt::print("{:<12} {:>6} {:>10.3f} {:>9.2f} {:>9.2f} {:>9.2f}\n", name, size, run.seconds,
                 seconds > 0 ? run.seconds / seconds : 0, memory / 1e6,
                 bytes > 0 ? memory / bytes : 0);
      seconds = run.seconds;
      bytes = memory;
    }
  }
}

void preSubdivision(int size) {
  fmt::print("\nbasic scheme after uniform splits, {}x{}\n{:<12} {:>7} {:>10} {:>16}\n", size, size,
             "data", "levels", "basic s", "time / shared");
  for (const auto& [name, volume] :
       {std::pair<const char*, BezierVolume>{"teardrop", bezier_scenes::teardrop()},
        {"cylinder", bezier_scenes::bentCylinder()}}) {
    const Camera camera = cameraOf(volume, size, size, 1.2);
    const double shared = timed(volume, camera, kShared).seconds;
    for (int levels = 0; levels <= 4; ++levels) {
      TreeOptions options = kBasic;
      options.uniformLevels = levels;
      const double seconds = timed(volume, camera, options).seconds;
      fmt::print("{:<12} {:>7} {:>10.3f} {:>16.1f}\n", name, levels, seconds, seconds / shared);
    }
  }
}

void stages(int size) {
  fmt::print("\nshares of the stages, {}x{}\n{:<12} {:>9} {:>9} {:>9} {:>9}\n", size, size, "data",
             "overlap %", "split %", "newton %", "group %");
  fmt::print("{:<12} {:>9} {:>9} {:>9} {:>9}\n", "published", 50.7, 31.4, 10.0, "7.9 (*)");
  for (const auto& [name, volume] :
       {std::pair<const char*, BezierVolume>{"teardrop", bezier_scenes::teardrop()},
        {"cylinder", bezier_scenes::bentCylinder()},
        {"dice", bezier_scenes::dice()}}) {
    TreeOptions options = kShared;
    options.measureTime = true;
    const render::TreeCounts c =
        timed(volume, cameraOf(volume, size, size, 1.2), options).picture.counts;
    const double all =
        (c.overlapSeconds + c.splitSeconds + c.solutionSeconds + c.groupSeconds) / 100;
    fmt::print("{:<12} {:>9.1f} {:>9.1f} {:>9.1f} {:>9.1f}\n", name, c.overlapSeconds / all,
               c.splitSeconds / all, c.solutionSeconds / all, c.groupSeconds / all);
  }
  fmt::print("(*) published: compaction, which this implementation does with the overlap test\n");
}

}  // namespace

int main(int argc, char** argv) {
  const int size = argc > 1 ? std::atoi(argv[1]) : 512;
  const std::string only = argc > 2 ? argv[2] : "";
  if (only == "growth") {
    resolutions(4 * size);
    return 0;
  }
  if (only == "gpu") {
    onGpu(size);
    return 0;
  }
  table(size, size, only);
  table(2 * size, 3 * size / 2, only);
  if (!only.empty()) return 0;
  degrees(size);
  resolutions(4 * size);
  preSubdivision(size / 2);
  stages(size);
}
