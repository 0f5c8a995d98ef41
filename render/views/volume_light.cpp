#include "render/views/volume_light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "levelset/progress_gate.h"
#include "render/direct/judged_light.h"
#include "render/shading/shading.h"

namespace render {

using Imath::V3d;

std::vector<VolumeLight> volumeLight(const Image& image, const Scene& scene,
                                     const DirectVolume& volume,
                                     const VolumeLightOptions& options) {
  if (!scene.isOpaque())
    throw levelset::UsageError(
        "direct volume rendering does not support transparent solids or meshes; make them opaque");
  levelset::requireMemory(static_cast<double>(image.pixelCount()) * sizeof(VolumeLight),
                          options.maxBytes);
  VolumeShading shading;
  shading.toLight = keyDirection(scene);
  const VolumeShading* shadingOrNone = options.isShaded ? &shading : nullptr;
  const std::vector<float>& depths = image.channels.at("Z");
  const V3d axis = scene.camera.axis();
  std::vector<VolumeLight> all(image.pixelCount());

  const auto lightOfPixel = [&](int x, int y, double depth) {
    const PixelSequence area = PixelSequence::overArea(x, y);
    VolumeLight sum{V3d(0), 0};
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
    return sum;
  };
  levelset::ProgressGate gate(options.progress, static_cast<std::size_t>(image.height));
  tbb::parallel_for(0, image.height, [&](int y) {
    if (options.isStopped && options.isStopped()) return;
    for (int x = 0; x < image.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                            static_cast<std::size_t>(x);
      all[i] = lightOfPixel(x, y, static_cast<double>(depths[i]));
    }
    gate.advance(1);
  });
  return all;
}

void addVolumeLight(Image& image, const std::vector<VolumeLight>& light) {
  std::vector<float>* const colours[3] = {&image.channels.at("R"), &image.channels.at("G"),
                                          &image.channels.at("B")};
  std::vector<float>& alpha = image.channels.at("A");
  for (std::size_t i = 0; i < light.size(); ++i) {
    const double passed = light[i].transmittance;
    for (int c = 0; c < 3; ++c) {
      float& colour = (*colours[c])[i];
      colour = static_cast<float>(light[i].colour[c] + passed * static_cast<double>(colour));
    }
    alpha[i] = static_cast<float>(1 - passed * (1 - static_cast<double>(alpha[i])));
  }
}

}  // namespace render
