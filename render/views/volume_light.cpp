#include "render/views/volume_light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "levelset/error.h"
#include "levelset/progress_gate.h"
#include "render/embree/volume_integral.h"
#include "render/shading/shading.h"

namespace render {

using Imath::V3d;

void addVolumeLight(Image& image, const Scene& scene, const DirectVolume& volume,
                    const VolumeLightOptions& options) {
  if (!scene.isOpaque())
    throw levelset::UsageError(
        "a volume in light of its own cannot be drawn with transparent solids or meshes; make "
        "them opaque");
  VolumeShading shading;
  shading.toLight = keyDirection(scene);
  const VolumeShading* shadingOrNone = options.isShaded ? &shading : nullptr;
  std::vector<float>&r = image.channels.at("R"), &g = image.channels.at("G"),
  &b = image.channels.at("B"), &a = image.channels.at("A");
  const std::vector<float>& depths = image.channels.at("Z");
  const V3d axis = scene.camera.axis();

  const auto paintPixel = [&](int x, int y) {
    const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                          static_cast<std::size_t>(x);
    const auto depth = static_cast<double>(depths[i]);
    const PixelSequence area = PixelSequence::overArea(x, y);
    VolumeLight sum;
    sum.transmittance = 0;
    for (int sample = 0; sample < options.samples; ++sample) {
      const Imath::V2d at = options.samples == 1 ? Imath::V2d(0.5) : area.at(sample);
      const Camera::Ray ray = scene.camera.ray(x + at.x, y + at.y);
      const double far = std::min(ray.far, depth / ray.direction.dot(axis));
      const VolumeLight light =
          options.isJudged
              ? judgedLight(volume, ray.origin, ray.direction, ray.near, far, shadingOrNone)
              : volume.light(ray.origin, ray.direction, ray.near, far, shadingOrNone);
      sum.colour += light.colour / options.samples;
      sum.transmittance += light.transmittance / options.samples;
    }
    float* const channels[3] = {&r[i], &g[i], &b[i]};
    for (int c = 0; c < 3; ++c)
      *channels[c] =
          static_cast<float>(sum.colour[c] + sum.transmittance * static_cast<double>(*channels[c]));
    a[i] = static_cast<float>(1 - sum.transmittance * (1 - static_cast<double>(a[i])));
  };
  levelset::ProgressGate gate(options.progress, static_cast<std::size_t>(image.height));
  tbb::parallel_for(0, image.height, [&](int y) {
    if (options.isStopped && options.isStopped()) return;
    for (int x = 0; x < image.width; ++x) paintPixel(x, y);
    gate.advance(1);
  });
}

}  // namespace render
