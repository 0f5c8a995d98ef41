#include "render/kernel/paint.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>

#include "render/shading/surface_shape.h"

namespace render {
namespace {

using Imath::V2d;
using Imath::V3d;

constexpr int kSquare = 4;  // edge of the squares that order the pixels for tracing, pixels
// Number of collected light rays above which they are traced.
constexpr std::size_t kMostLightRays = 1u << 18;
// Bound on the rounding error of the kernel's hit depths, voxels. It is added to the surface error,
// so that light rays start farther from the surface.
constexpr double kCastError = 2e-3;

}  // namespace

KernelPainter::KernelPainter(const Scene& scene, const KernelScene& surfaces,
                             const RenderOptions& options, Image& image)
    : scene_(scene),
      surfaces_(surfaces),
      options_(options),
      shader_(scene, surfaces.bounds().size().length(), options),
      layers_(image, options) {}

void KernelPainter::paint(const KernelTracer& tracer, const PixelBox& box) const {
  const std::vector<Pixel> pixels = pixelsOf(box);
  paintData(tracer, pixels);
  paintColours(tracer, pixels);
}

std::vector<KernelPainter::Pixel> KernelPainter::pixelsOf(const PixelBox& box) {
  std::vector<Pixel> pixels;
  for (int top = box.top; top < box.bottom; top += kSquare)
    for (int left = box.left; left < box.right; left += kSquare)
      for (int y = top; y < std::min(top + kSquare, box.bottom); ++y)
        for (int x = left; x < std::min(left + kSquare, box.right); ++x) pixels.push_back({x, y});
  return pixels;
}

std::size_t KernelPainter::numberOf(const Pixel& pixel) const {
  return static_cast<std::size_t>(pixel.y) * static_cast<std::size_t>(scene_.camera.width) +
         static_cast<std::size_t>(pixel.x);
}

Hit KernelPainter::hitOf(const Camera::Ray& ray, double meshNear, const PixelHits& hits,
                         std::size_t i) const {
  const FieldTraversal* fields = surfaces_.fields();
  Hit onSolid;
  if (fields)
    onSolid = fields->intersect(ray.origin, ray.direction, ray.near, ray.far);
  else if (hits.solid[i] >= 0)
    onSolid = hitOnSolid(ray, hits, i);
  if (surfaces_.meshes().isEmpty()) return onSolid;
  const double far = onSolid.found ? onSolid.distance : ray.far;
  const Hit onMesh = surfaces_.meshes().intersect(ray.origin, ray.direction, meshNear, far);
  return onMesh.found ? onMesh : onSolid;
}

Hit KernelPainter::hitOnSolid(const Camera::Ray& ray, const PixelHits& hits, std::size_t i) const {
  const KernelSolid& solid = surfaces_.solids()[static_cast<std::size_t>(hits.solid[i])];
  Hit hit;
  hit.found = true;
  hit.distance = hits.depth[i] / ray.direction.dot(scene_.camera.axis());
  hit.position = ray.origin + ray.direction * hit.distance;
  hit.id = solid.id;
  hit.solid = solid.index;
  hit.colour = scene_.solids[solid.index].colour;
  hit.opacity = solid.opacity;
  hit.isFlipped = hits.flipped[i] != 0;
  addShape(hit, hits.shapes.at(i), solid.tableToWorld, ray.direction);
  hit.surfaceError += kCastError * solid.voxelSize;
  return hit;
}

// Paints the layers other than the colours (depth, normal, position, id, curvature, thickness) from
// the rays through the pixels' centres.
void KernelPainter::paintData(const KernelTracer& tracer, const std::vector<Pixel>& pixels) const {
  const double middleX = 0.5 * scene_.camera.width, middleY = 0.5 * scene_.camera.height;
  PixelBlock at(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    at.x[i] = static_cast<float>(pixels[i].x + 0.5 - middleX);
    at.y[i] = static_cast<float>(pixels[i].y + 0.5 - middleY);
  }
  if (options_.thickness) {
    const std::vector<double> depths = surfaces_.thickness(tracer, at);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Camera::Ray ray = scene_.camera.ray(pixels[i].x + 0.5, pixels[i].y + 0.5);
      layers_.thickness[numberOf(pixels[i])] = static_cast<float>(
          surfaces_.fields()
              ? surfaces_.fields()->thickness(ray.origin, ray.direction, ray.near, ray.far)
              : depths[i] / ray.direction.dot(scene_.camera.axis()));
    }
  }
  const PixelHits hits = surfaces_.castPixels(tracer, at);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::size_t number = numberOf(pixels[i]);
    const Camera::Ray ray = scene_.camera.ray(pixels[i].x + 0.5, pixels[i].y + 0.5);
    const Hit hit = hitOf(ray, ray.near, hits, i);
    if (!hit.found) continue;
    layers_.setHit(number, scene_.camera, hit);
    if (options_.curvature) layers_.setCurvature(number, hit.curvature);
  }
}

// Paints the mean colours of samples spread over the pixels' areas.
void KernelPainter::paintColours(const KernelTracer& tracer,
                                 const std::vector<Pixel>& pixels) const {
  const double middleX = 0.5 * scene_.camera.width, middleY = 0.5 * scene_.camera.height;
  std::vector<ColourSum> sums(pixels.size());
  PixelBlock at(pixels.size());
  for (int s = 0; s < options_.samples; ++s) {
    std::vector<SampleRay> sampleRays;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const V2d shift = PixelSequence::overArea(pixels[i].x, pixels[i].y).at(s);
      // Build the ray from the rounded position: the kernel reads pixel positions in single
      // precision.
      at.x[i] = static_cast<float>(pixels[i].x + shift.x - middleX);
      at.y[i] = static_cast<float>(pixels[i].y + shift.y - middleY);
      const Camera::Ray ray = scene_.camera.ray(static_cast<double>(at.x[i]) + middleX,
                                                static_cast<double>(at.y[i]) + middleY);
      sampleRays.push_back({ray, ray.near});
    }
    if (scene_.isOpaque()) {
      addSeen(tracer, pixels, s, surfaces_.castPixels(tracer, at), sampleRays, sums);
      continue;
    }
    PixelTraversal walk = surfaces_.startTraversal(at);
    for (bool seesMore = true; seesMore;) {
      const PixelHits hits = surfaces_.castNext(tracer, walk);
      for (const std::size_t i : addSeen(tracer, pixels, s, hits, sampleRays, sums))
        walk.solids.resume(i);
      seesMore = std::any_of(sampleRays.begin(), sampleRays.end(), [](const SampleRay& sampleRay) {
        return sampleRay.left >= kLeastTransmittance;
      });
    }
  }
  for (std::size_t i = 0; i < pixels.size(); ++i)
    layers_.setColour(numberOf(pixels[i]), sums[i], options_.samples);
}

std::vector<std::size_t> KernelPainter::addSeen(const KernelTracer& tracer,
                                                const std::vector<Pixel>& pixels, int sample,
                                                const PixelHits& hits,
                                                std::vector<SampleRay>& sampleRays,
                                                std::vector<ColourSum>& sums) const {
  struct Lit {
    std::size_t pixel;
    Hit hit;
    V3d direction;
    double share;
    LightRays range;
  };
  std::vector<std::size_t> throughSolids;
  std::vector<LightRay> rays;
  std::vector<Lit> points;
  const auto addColours = [&] {
    const std::vector<double> light = surfaces_.transmittances(tracer, rays);
    for (const Lit& point : points)
      sums[point.pixel].add(shader_.colour(point.hit, point.direction, point.range, rays, light),
                            point.share);
    rays.clear();
    points.clear();
  };
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    auto& [ray, meshNear, left] = sampleRays[i];
    if (left < kLeastTransmittance) continue;
    if (rays.size() > kMostLightRays) addColours();
    const Hit hit = hitOf(ray, meshNear, hits, i);
    if (!hit.found) {
      left = 0;
      continue;
    }
    points.push_back({i, hit, ray.direction, left * hit.opacity,
                      shader_.addRays(hit, ray.direction, pixels[i].x, pixels[i].y, sample, rays)});
    left *= 1 - hit.opacity;
    if (hit.isOnMesh)
      meshNear = hit.beyond();
    else if (left >= kLeastTransmittance)
      throughSolids.push_back(i);
  }
  addColours();
  return throughSolids;
}

Image paintPicture(const Scene& scene, const KernelScene& surfaces, const KernelTracer& tracer,
                   int tile, const std::string& renderer, const RenderOptions& options) {
  const Camera& camera = scene.camera;
  Image image(camera.width, camera.height);
  const KernelPainter painter(scene, surfaces, options, image);
  const int across = (camera.width + tile - 1) / tile, down = (camera.height + tile - 1) / tile;
  std::mutex reporting;
  int done = 0;
  tbb::parallel_for(0, across * down, [&](int number) {
    const int left = number % across * tile, top = number / across * tile;
    painter.paint(tracer, {left, top, std::min(left + tile, camera.width),
                           std::min(top + tile, camera.height)});
    const std::scoped_lock lock(reporting);
    levelset::report(options.progress, static_cast<double>(++done) / (across * down));
  });
  image.attributes = sceneAttributes(scene, options);
  image.attributes["ls:renderer"] = renderer;
  image.attributes["ls:mode"] = "exact";
  if (surfaces.fields()) {
    image.attributes["ls:read"] =
        fmt::format("{} blocks of 8x8x8 cells where a field is not constant, {:.1f} MB",
                    surfaces.fields()->blockCount(), static_cast<double>(surfaces.bytes()) * 1e-6);
  } else {
    const KernelScene::Counts& counts = surfaces.counts();
    image.attributes["ls:read"] = fmt::format(
        "{} blocks of 8x8x8 cells that the surface crosses and {} neighbouring blocks for its "
        "curvature, "
        "{:.1f} MB; {} other blocks are not stored, and {} crossed blocks are outside the view",
        counts.crossed, counts.halo, static_cast<double>(surfaces.bytes()) * 1e-6, counts.omitted,
        counts.culled);
  }
  addViewAttributes(image, scene, surfaces.tableBounds().size().length());
  painter.layers().addWarnings(image, scene);
  return image;
}

}  // namespace render
