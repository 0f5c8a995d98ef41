#include "apps/viewer/interaction/point_splats.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "render/camera.h"
#include "render/shading/shading.h"
#include "render/views/picture.h"

namespace viewer {
namespace {

using Imath::V3d;

constexpr std::uint64_t kNothing = std::numeric_limits<std::uint64_t>::max();

/// Maps a number to an integer with the same order.
std::uint32_t orderedBits(float number) {
  const auto bits = std::bit_cast<std::uint32_t>(number);
  return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

void keepLeast(std::atomic<std::uint64_t>& least, std::uint64_t key) {
  std::uint64_t known = least.load(std::memory_order_relaxed);
  while (key < known && !least.compare_exchange_weak(known, key, std::memory_order_relaxed)) {
  }
}

/// Geometry of the discs in the picture of a camera. Depths are along the view axis.
class DiscCamera {
 public:
  explicit DiscCamera(const render::Camera& camera)
      : camera_(camera),
        steps_(camera.pixelSteps()),
        axis_(camera.axis()),
        isOrtho_(camera.orthoHeight.has_value()),
        perRight_(1 / steps_.right.length2()),
        perDown_(1 / steps_.down.length2()) {}

  /// Pixels that a disc may cover: first and last column, first and last row.
  struct Extent {
    int left, right, top, bottom;
  };
  [[nodiscard]] std::optional<Extent> extentOf(const V3d& at, const V3d& normal,
                                               double radius) const {
    const V3d fromEye = at - camera_.from;
    const double depth = fromEye.dot(axis_);
    const double scale = isOrtho_ ? 1 : 1 / depth;
    if (!(depth > std::max(camera_.near, isOrtho_ ? -HUGE_VAL : 1e-12)) ||
        depth > camera_.farthest() || !(normal.dot(isOrtho_ ? axis_ : fromEye) < 0))
      return std::nullopt;
    const double x = 0.5 * camera_.width + fromEye.dot(steps_.right) * perRight_ * scale,
                 y = 0.5 * camera_.height + fromEye.dot(steps_.down) * perDown_ * scale;
    // In perspective the near half of a disc reaches further than the radius at its middle.
    const double nearest = isOrtho_ ? 1 : 1 / std::max(depth - radius, 0.1 * depth);
    const double reach = radius * std::sqrt(std::max(perRight_, perDown_)) * nearest;
    if (!(x + reach > 0 && y + reach > 0 && x - reach < camera_.width &&
          y - reach < camera_.height))
      return std::nullopt;
    const auto pixel = [](double place, int size) {
      return static_cast<int>(std::clamp(std::floor(place), 0.0, size - 1.0));
    };
    return Extent{pixel(x - reach, camera_.width), pixel(x + reach, camera_.width),
                  pixel(y - reach, camera_.height), pixel(y + reach, camera_.height)};
  }

  /// Depth at which the ray through the middle of a pixel meets the disc; empty beside the disc.
  [[nodiscard]] std::optional<double> depthAt(int x, int y, const V3d& at, const V3d& normal,
                                              double radius) const {
    const V3d aside = steps_.right * (x + 0.5 - 0.5 * camera_.width) +
                      steps_.down * (y + 0.5 - 0.5 * camera_.height);
    const V3d start = isOrtho_ ? camera_.from + aside : camera_.from,
              along = isOrtho_ ? axis_ : axis_ + aside;
    const double depth = (at - start).dot(normal) / along.dot(normal);
    const double away2 = (start + along * depth - at).length2();
    return away2 <= radius * radius ? std::optional(depth) : std::nullopt;
  }

 private:
  const render::Camera& camera_;
  render::Camera::PixelSteps steps_;
  V3d axis_;
  bool isOrtho_;
  double perRight_, perDown_;
};

}  // namespace

bool canSplat(const render::Scene& scene) {
  return !scene.solids.empty() && scene.meshes.empty() && scene.terrains.empty() &&
         scene.csg.isEmpty() && !scene.isBlended() && scene.isOpaque() && !scene.volumePart &&
         std::none_of(scene.solids.begin(), scene.solids.end(),
                      [](const render::Solid& solid) { return solid.band.isOpenSurface(); });
}

std::shared_ptr<render::Image> drawSplats(const std::vector<SurfaceDiscs>& discs,
                                          const render::Scene& scene, double diagonal,
                                          const render::RenderOptions& options,
                                          const std::atomic<bool>& isStale) {
  const render::Camera& camera = scene.camera;
  const DiscCamera view(camera);
  auto image = std::make_shared<render::Image>(camera.width, camera.height);
  const render::PictureLayers layers(*image, scene, options);
  const render::Shader shader(scene, diagonal, options);
  // The nearest disc of each pixel, for one solid after another: its depth in the upper half, its
  // number in the lower half.
  std::vector<std::atomic<std::uint64_t>> nearest(image->pixelCount());
  std::vector<float> depths(image->pixelCount(), std::numeric_limits<float>::infinity());
  for (std::size_t s = 0; s < discs.size(); ++s) {
    const SurfaceDiscs& part = discs[s];
    const auto radius = static_cast<double>(part.radius);
    for (auto& key : nearest) key.store(kNothing, std::memory_order_relaxed);
    constexpr std::size_t kGrain = 4096;
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, part.positions.size(), kGrain), [&](const auto& range) {
          if (isStale) return;
          for (std::size_t i = range.begin(); i < range.end(); ++i) {
            const V3d at(part.positions[i]), normal(part.normals[i]);
            const auto extent = view.extentOf(at, normal, radius);
            if (!extent) continue;
            for (int y = extent->top; y <= extent->bottom; ++y)
              for (int x = extent->left; x <= extent->right; ++x)
                if (const auto depth = view.depthAt(x, y, at, normal, radius))
                  keepLeast(
                      nearest[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                              static_cast<std::size_t>(x)],
                      std::uint64_t{orderedBits(static_cast<float>(*depth))} << 32 |
                          static_cast<std::uint32_t>(i));
          }
        });
    if (isStale) return nullptr;
    tbb::parallel_for(0, camera.height, [&](int y) {
      for (int x = 0; x < camera.width; ++x) {
        const std::size_t pixel =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
            static_cast<std::size_t>(x);
        const std::uint64_t key = nearest[pixel].load(std::memory_order_relaxed);
        if (key == kNothing) continue;
        const std::size_t i = key & 0xffffffffu;
        const V3d at(part.positions[i]), normal(part.normals[i]);
        const double depth = *view.depthAt(x, y, at, normal, radius);
        if (static_cast<float>(depth) >= depths[pixel]) continue;
        depths[pixel] = static_cast<float>(depth);
        const render::Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
        render::Hit hit;
        hit.found = true;
        hit.distance = depth / ray.direction.dot(camera.axis());
        hit.position = ray.origin + ray.direction * hit.distance;
        hit.normal = hit.facetNormal = normal;
        hit.colour = scene.solids[s].colour;
        hit.id = scene.solids[s].id;
        hit.solid = s;
        layers.setHit(pixel, camera, hit);
        render::ColourSum sum;
        sum.add(shader.colour(hit, ray.direction, {}), 1);
        layers.setColour(pixel, sum, 1);
      }
    });
  }
  return image;
}

}  // namespace viewer
