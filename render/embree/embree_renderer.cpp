#include "render/embree/embree_renderer.h"

#include <embree3/rtcore_config.h>
#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>
#include <optional>

#include "levelset/error.h"
#include "render/direct/judged_light.h"
#include "render/optics/light_paths.h"
#include "render/shading/shading.h"
#include "render/views/picture.h"

namespace render {
namespace {

using Imath::V2d;
using Imath::V3d;

constexpr int kTile = 16;  // edge of a tile, pixels

/// Rays of the judge, for light paths.
class JudgedRays : public SceneRays {
 public:
  explicit JudgedRays(const EmbreeScene& scene) : scene_(scene) {}
  [[nodiscard]] std::vector<Hit> firstHits(const std::vector<Camera::Ray>& rays) const override {
    std::vector<Hit> hits;
    hits.reserve(rays.size());
    for (const Camera::Ray& ray : rays)
      hits.push_back(scene_.intersect(ray.origin, ray.direction, ray.near, ray.far));
    return hits;
  }
  [[nodiscard]] std::vector<double> transmittances(
      const std::vector<LightRay>& rays) const override {
    std::vector<double> shares;
    shares.reserve(rays.size());
    for (const LightRay& ray : rays)
      shares.push_back(scene_.transmittance(ray.origin, ray.direction, ray.maxDistance));
    return shares;
  }

 private:
  const EmbreeScene& scene_;
};

struct PixelPainter {
  const Scene& scene;
  const EmbreeScene& rays;
  const RenderOptions& options;
  Shader shader;
  std::optional<LightPaths> paths;  // set for traced reflection or refraction
  PictureLayers layers;
  VolumeShading shading;

  PixelPainter(const Scene& scene_, const EmbreeScene& rays_, const RenderOptions& options_,
               Image& image)
      : scene(scene_),
        rays(rays_),
        options(options_),
        shader(scene_, rays_.bounds().size().length(), options_),
        layers(image, scene_, options_) {
    shading.toLight = keyDirection(scene_);
    if (options.optics.isActive())
      paths.emplace(shader, rays.bounds().size().length(), options.optics, options.maxBytes);
  }

  void paint(int x, int y) const {
    const std::size_t i =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(scene.camera.width) +
        static_cast<std::size_t>(x);
    paintData(x, y, i);
    paintColour(x, y, i);
  }

  /// Paints the layers other than the colours (depth, normal, position, id, curvature, thickness)
  /// from the ray through the pixel's centre.
  void paintData(int x, int y, std::size_t i) const {
    const Camera::Ray ray = scene.camera.ray(x + 0.5, y + 0.5);
    if (options.thickness)
      layers.thickness[i] =
          static_cast<float>(rays.thickness(ray.origin, ray.direction, ray.near, ray.far));
    const Hit hit = rays.intersect(ray.origin, ray.direction, ray.near, ray.far);
    if (layers.volume[0])
      layers.setVolume(i, volumeLight(ray, ray.near, hit.found ? hit.distance : ray.far));
    if (!hit.found) return;
    layers.setHit(i, scene.camera, hit);
    layers.setCurvature(i, hit);
    if (!layers.light[0]) return;
    std::vector<LightRay> lights;
    const PointLight found = traced(shader.addPixelRays(hit, ray.direction, x, y, lights), lights);
    layers.setLight(i, found.sky, found.key);
  }

  /// Traces light rays. @param range  all of `lights`
  [[nodiscard]] PointLight traced(const LightRays& range,
                                  const std::vector<LightRay>& lights) const {
    return Shader::lightOf(range, lights, JudgedRays(rays).transmittances(lights));
  }

  /// Light of the scene's volume on a part of a ray.
  [[nodiscard]] VolumeLight volumeLight(const Camera::Ray& ray, double near, double far) const {
    return judgedLight(scene.volumePart->volume, ray.origin, ray.direction, near, far,
                       scene.volumePart->isShaded ? &shading : nullptr);
  }

  /// Paints the mean colour of the pixel's samples.
  void paintColour(int x, int y, std::size_t i) const {
    const PixelSequence area = PixelSequence::overArea(x, y);
    std::vector<LightRay> lights;
    ColourSum sum;
    const auto lightAt = [&](const Hit& hit, const V3d& direction, int s) {
      lights.clear();
      return traced(shader.addRays(hit, direction, x, y, s, lights), lights);
    };
    for (int s = 0; s < options.samples; ++s) {
      const V2d at = area.at(s);
      const Camera::Ray ray = scene.camera.ray(x + at.x, y + at.y);
      double seen = 1, lit = ray.near;
      const auto addVolume = [&](double far) {
        if (!scene.volumePart || !(lit < far)) return;
        const VolumeLight light = volumeLight(ray, lit, far);
        sum.add(light, seen);
        seen *= light.transmittance;
        lit = far;
      };
      for (const Hit& hit : rays.intersectVisible(ray.origin, ray.direction, ray.near, ray.far)) {
        addVolume(hit.distance);
        Imath::C3f colour = shader.colour(hit, ray.direction, lightAt(hit, ray.direction, s));
        if (paths)
          colour = paths->colours(JudgedRays(rays), {{hit, ray.direction, colour, x, y, s}})[0];
        sum.add(colour, seen * hit.opacity);
        seen *= 1 - hit.opacity;
      }
      if (seen < kLeastTransmittance) continue;
      addVolume(ray.far);
      if (const Hit hit = shader.groundHit(ray); hit.found)
        sum.add(Imath::C3f(0), seen * shader.shadowOpacity(hit, lightAt(hit, ray.direction, s)));
    }
    layers.setColour(i, sum, options.samples);
  }
};

}  // namespace

Image renderEmbree(const Scene& scene, const RenderOptions& options) {
  requirePicture(scene, options);
  if (!scene.mapped.empty())
    throw levelset::UsageError(
        "the Embree renderer does not draw mapped textures; give --renderer cpu or gpu");
  double points = 0;  // of volumes, whose values are copied
  for (const Solid& solid : scene.solids)
    if (solid.volume) points += static_cast<double>(solid.volume->volume().grid().pointCount());
  constexpr double kBytesOfPoint = 5;
  levelset::requireMemory(points * kBytesOfPoint, options.maxBytes);
  levelset::report(options.progress, 0);
  const EmbreeScene rays(scene, options.filter);
  if (rays.bounds().isEmpty()) refuseEmptyScene();
  const Camera& camera = scene.camera;
  Image image(camera.width, camera.height);
  const PixelPainter painter(scene, rays, options, image);

  const int across = (camera.width + kTile - 1) / kTile, down = (camera.height + kTile - 1) / kTile;
  std::mutex reporting;
  int done = 0;
  tbb::parallel_for(0, across * down, [&](int tile) {
    const int left = tile % across * kTile, top = tile / across * kTile;
    for (int y = top; y < std::min(top + kTile, camera.height); ++y)
      for (int x = left; x < std::min(left + kTile, camera.width); ++x) painter.paint(x, y);
    const std::scoped_lock lock(reporting);
    levelset::report(options.progress, static_cast<double>(++done) / (across * down));
  });
  finishColours(image, scene, options, rays.bounds().size().length());
  image.attributes = sceneAttributes(scene, options);
  image.attributes["ls:renderer"] = fmt::format("embree {}", RTC_VERSION_STRING);
  image.attributes["ls:mode"] = "exact";
  addViewAttributes(image, scene, rays.bounds().size().length());
  painter.layers.addWarnings(image, scene);
  return image;
}

}  // namespace render
