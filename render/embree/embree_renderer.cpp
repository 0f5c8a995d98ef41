#include "render/embree/embree_renderer.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "levelset/error.h"
#include "render/embree/shading.h"

namespace render {
namespace {

using Imath::V2d;
using Imath::V3d;

constexpr int kTile = 16;  // pixels
constexpr std::uint64_t kPixelArea = 0;
constexpr int kMaxSamples = 65536;

/// The picture's channels, as plain pointers for the tiles.
struct Layers {
  float *r, *g, *b, *a, *z;
  float *n[3], *p[3];
  float* curvature[4] = {};
  std::uint32_t* id;

  Layers(Image& image, bool withCurvature) {
    r = image.addChannel("R").data();
    g = image.addChannel("G").data();
    b = image.addChannel("B").data();
    a = image.addChannel("A").data();
    z = image.addChannel("Z", std::numeric_limits<float>::infinity()).data();
    const char* axes[3] = {"X", "Y", "Z"};
    for (int i = 0; i < 3; ++i) {
      n[i] = image.addChannel(fmt::format("N.{}", axes[i])).data();
      p[i] = image.addChannel(fmt::format("P.{}", axes[i])).data();
    }
    const char* kinds[4] = {"mean", "gauss", "k1", "k2"};
    for (int i = 0; withCurvature && i < 4; ++i)
      curvature[i] = image.addChannel(fmt::format("curvature.{}", kinds[i])).data();
    auto& ids = image.ids["id"];
    ids.assign(image.pixelCount(), 0);
    id = ids.data();
  }
};

struct PixelPainter {
  const Scene& scene;
  const EmbreeScene& rays;
  const EmbreeOptions& options;
  Shader shader;
  Layers layers;

  PixelPainter(const Scene& scene_, const EmbreeScene& rays_, const EmbreeOptions& options_,
               Image& image)
      : scene(scene_),
        rays(rays_),
        options(options_),
        shader(scene_, rays_, options_),
        layers(image, options_.curvature) {}

  void paint(int x, int y) const {
    const std::size_t i =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(scene.camera.width) +
        static_cast<std::size_t>(x);
    paintData(x, y, i);
    paintColour(x, y, i);
  }

  /// From the pixel's centre.
  void paintData(int x, int y, std::size_t i) const {
    const Camera::Ray ray = scene.camera.ray(x + 0.5, y + 0.5);
    const Hit hit = rays.intersect(ray.origin, ray.direction);
    if (!hit.found) return;
    layers.z[i] = static_cast<float>((hit.position - scene.camera.from).dot(scene.camera.axis()));
    for (int a = 0; a < 3; ++a) {
      layers.n[a][i] = static_cast<float>(hit.normal[a]);
      layers.p[a][i] = static_cast<float>(hit.position[a]);
    }
    layers.id[i] = hit.id;
    if (!options.curvature) return;
    const CurvatureSample c = rays.curvatureAt(hit);
    const double values[4] = {c.mean, c.gauss, c.k1, c.k2};
    for (int k = 0; k < 4; ++k) layers.curvature[k][i] = static_cast<float>(values[k]);
  }

  /// The mean over the pixel's area.
  void paintColour(int x, int y, std::size_t i) const {
    const PixelSequence area(x, y, kPixelArea);
    Imath::C3f sum(0);
    int covered = 0;
    for (int s = 0; s < options.samples; ++s) {
      const V2d at = area.at(s);
      const Camera::Ray ray = scene.camera.ray(x + at.x, y + at.y);
      const Hit hit = rays.intersect(ray.origin, ray.direction);
      if (!hit.found) continue;
      sum += shader.colour(hit, ray.direction, x, y, s);
      ++covered;
    }
    const float weight = 1.0f / static_cast<float>(options.samples);
    layers.r[i] = sum.x * weight;
    layers.g[i] = sum.y * weight;
    layers.b[i] = sum.z * weight;
    layers.a[i] = static_cast<float>(covered) * weight;
  }
};

void requireOptions(const Scene& scene, const EmbreeOptions& options) {
  validate(scene.camera);
  const auto inRange = [](int count, int low) { return count >= low && count <= kMaxSamples; };
  if (!inRange(options.samples, 1) || !inRange(options.ambientSamples, 0) ||
      !inRange(options.shadowSamples, 0)) {
    throw levelset::UsageError(fmt::format(
        "render: {} samples, {} ambient and {} shadow samples; give 1 to {} samples and 0 to {} of "
        "the others",
        options.samples, options.ambientSamples, options.shadowSamples, kMaxSamples, kMaxSamples));
  }
  const V3d& d = scene.key.direction;
  const double sum = d.x + d.y + d.z + scene.key.strength + scene.ambient;
  if (!std::isfinite(sum) || d == V3d(0) ||
      !(scene.key.softness >= 0 && scene.key.softness < 1.5) || scene.key.strength < 0 ||
      scene.ambient < 0) {
    throw levelset::UsageError(fmt::format(
        "render: a light towards {},{},{} of strength {}, softness {} and ambient {} cannot shine; "
        "give finite numbers, none negative, and a softness below 1.5 radians",
        d.x, d.y, d.z, scene.key.strength, scene.key.softness, scene.ambient));
  }
  const double pixels = static_cast<double>(scene.camera.width) * scene.camera.height;
  const double channels = options.curvature ? 16 : 12;
  levelset::requireMemory(pixels * 4 * channels, options.maxBytes, "render");
}

void describe(Image& image, const Scene& scene, const EmbreeScene& rays) {
  image.attributes = rays.provenance();
  image.attributes["software"] = "Levelsmith " LEVELSMITH_VERSION;
  image.attributes["depthType"] = "distance along the view axis";
  const auto floats = [](const Imath::M44d& m) {
    std::vector<float> values;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) values.push_back(static_cast<float>(m[i][j]));
    return values;
  };
  image.matrices["worldToCamera"] = floats(scene.camera.worldToCamera());
  image.matrices["worldToNDC"] = floats(scene.camera.worldToNdc());
}

}  // namespace

Image renderEmbree(const Scene& scene, const EmbreeOptions& options) {
  requireOptions(scene, options);
  levelset::report(options.progress, 0, "render");
  const EmbreeScene rays(scene);
  if (rays.bounds().isEmpty()) {
    throw levelset::InvalidInput(
        "render: there is no surface in the scene; give at least one solid with a zero set");
  }
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
    levelset::report(options.progress, static_cast<double>(++done) / (across * down), "render");
  });
  describe(image, scene, rays);
  return image;
}

}  // namespace render
