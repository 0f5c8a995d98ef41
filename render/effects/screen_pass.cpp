#include "render/effects/screen_pass.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/effects/picture_view.h"
#include "render/effects/screen_kernel.h"
#include "render/shading/sampling.h"
#include "render/shading/shading.h"

namespace render {
namespace {

using Imath::V2d;
using Imath::V3d;

constexpr int kSets = ScreenKernel::kSetEdge * ScreenKernel::kSetEdge;
constexpr int kOcclusionRays = 16, kShadowRays = 64;  // in a set
// Growth of the steps along a ray, for each pixel from its start.
constexpr double kGrowth = 0.05;
// Difference of normals that no two normals have, for outlines without creases.
constexpr double kNoCrease = 1e30;

/// Numbers of the kernel, without sets of rays.
std::vector<double> numbersOf(const PictureView& view) {
  std::vector<double> numbers(ScreenKernel::kFirstRay, 0);
  numbers[ScreenKernel::kStepX] = view.stepX();
  numbers[ScreenKernel::kStepY] = view.stepY();
  numbers[ScreenKernel::kRayGrowth] = kGrowth;
  numbers[ScreenKernel::kMiddleX] = view.middleX();
  return numbers;
}

ScreenTables tablesOf(const PictureView& view) {
  const Image& image = view.image();
  const VectorLayer normals(image, "N", "an effect");
  ScreenTables tables{image.width, image.height, view.isPerspective(), {}, numbersOf(view)};
  tables.pixels.assign(4 * image.pixelCount(), 0);
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                            static_cast<std::size_t>(x);
      float* pixel = tables.pixels.data() + 4 * i;
      pixel[0] = -1;
      if (!view.isHit(i)) continue;
      V3d n = normals.at(i);
      if (!(n.length2() > 0) || !std::isfinite(n.length2())) n = -view.direction(x, y);
      n.normalize();
      if (n.dot(view.direction(x, y)) > 0) n = -n;
      pixel[0] = static_cast<float>(view.depth(i));
      pixel[1] = static_cast<float>(n.dot(view.right()));
      pixel[2] = static_cast<float>(-n.dot(view.up()));
      pixel[3] = static_cast<float>(n.dot(view.forward()));
    }
  });
  return tables;
}

/// Appends the sets of rays to the numbers of the kernel. All sets together sample the directions
/// evenly, and so does each set. @param rayOf  direction for a random point in [0, 1)²
template <typename RayOf>
void addRaySets(ScreenTables& tables, int count, const RayOf& rayOf) {
  tables.numbers[ScreenKernel::kRayCount] = count;
  const PixelSequence sequence(0, 0, 3);
  for (int set = 0; set < kSets; ++set) {
    for (int ray = 0; ray < count; ++ray) {
      const V3d d = rayOf(sequence.at(set * count + ray));
      tables.numbers.insert(tables.numbers.end(), {d.x, d.y, d.z});
    }
  }
}

}  // namespace

std::vector<float> CpuScreenRunner::run(const ScreenTables& tables, ScreenPass pass,
                                        const std::vector<float>& earlier) const {
  std::vector<float> result(static_cast<std::size_t>(tables.width) *
                            static_cast<std::size_t>(tables.height));
  tbb::parallel_for(0, tables.height, [&](int y) {
    ScreenKernel kernel(tables, earlier);
    for (int x = 0; x < tables.width; ++x) {
      double value = 0;
      switch (pass) {
        case ScreenPass::OutlineStrength:
          value = kernel.outlineStrength(x, y);
          break;
        case ScreenPass::Outline:
          value = kernel.outlineAt(x, y);
          break;
        case ScreenPass::OpenShare:
          value = kernel.openShare(x, y);
          break;
        case ScreenPass::KeyShare:
          value = kernel.keyShare(x, y);
          break;
        case ScreenPass::Smooth:
          value = kernel.smoothed(x, y);
          break;
      }
      result[kernel.numberOf(x, y)] = static_cast<float>(value);
    }
  });
  return result;
}

std::vector<float> outlineLayer(const PictureView& view, const OutlineNumbers& of,
                                const ScreenRunner& runner) {
  ScreenTables tables = tablesOf(view);
  tables.numbers[ScreenKernel::kOutlineHalf] = 0.5 * of.width;
  tables.numbers[ScreenKernel::kOutlineSpacing] = of.spacing;
  tables.numbers[ScreenKernel::kOutlineStep] = of.step;
  tables.numbers[ScreenKernel::kOutlineCrease] =
      of.crease >= std::numbers::pi ? kNoCrease : 2 * std::sin(0.5 * of.crease);
  return runner.run(tables, ScreenPass::Outline,
                    runner.run(tables, ScreenPass::OutlineStrength, {}));
}

std::vector<float> occlusionLayer(const PictureView& view, const OcclusionNumbers& of,
                                  const ScreenRunner& runner) {
  ScreenTables tables = tablesOf(view);
  tables.numbers[ScreenKernel::kRayLength] = of.radius;
  tables.numbers[ScreenKernel::kOccluderDepth] = of.occluderDepth;
  addRaySets(tables, kOcclusionRays, [](const V2d& u) { return cosineDirection(V3d(0, 0, 1), u); });
  return runner.run(tables, ScreenPass::Smooth, runner.run(tables, ScreenPass::OpenShare, {}));
}

std::vector<float> shadowLayer(const PictureView& view, const ShadowNumbers& of,
                               const ScreenRunner& runner) {
  ScreenTables tables = tablesOf(view);
  tables.numbers[ScreenKernel::kRayLength] = of.length;
  tables.numbers[ScreenKernel::kOccluderDepth] = of.occluderDepth;
  const V3d axis = V3d(of.toLight.x, -of.toLight.y, -of.toLight.z).normalized();
  addRaySets(tables, kShadowRays,
             [&](const V2d& u) { return coneDirection(axis, of.softness, u); });
  return runner.run(tables, ScreenPass::Smooth, runner.run(tables, ScreenPass::KeyShare, {}));
}

}  // namespace render
