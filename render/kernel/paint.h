#pragma once

#include <string>
#include <vector>

#include "render/images/image.h"
#include "render/kernel/kernel_scene.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"
#include "render/shading/shading.h"
#include "render/views/picture.h"

namespace render {

/// A part of a picture, pixels.
struct PixelBox {
  int left, top, right, bottom;  ///< the last two are the first outside
};

/// Paints parts of a picture from the kernel's hits, a kind of ray at a time.
class KernelPainter {
 public:
  KernelPainter(const Scene& scene, const KernelScene& surfaces, const RenderOptions& options,
                Image& image);
  /// Parts may be painted at the same time.
  void paint(const KernelTracer& tracer, const PixelBox& box) const;
  [[nodiscard]] const PictureLayers& layers() const { return layers_; }

 private:
  struct Pixel {
    int x, y;
  };
  /// Neighbours next to each other: squares of four.
  [[nodiscard]] static std::vector<Pixel> pixelsOf(const PixelBox& box);
  [[nodiscard]] std::size_t numberOf(const Pixel& pixel) const;
  /// What the ray of number i meets first, if anything. @param meshNear  from there on of meshes
  [[nodiscard]] Hit hitOf(const Camera::Ray& ray, double meshNear, const PixelHits& hits,
                          std::size_t i) const;
  [[nodiscard]] Hit hitOnSolid(const Camera::Ray& ray, const PixelHits& hits, std::size_t i) const;
  void paintData(const KernelTracer& tracer, const std::vector<Pixel>& pixels) const;
  void paintColours(const KernelTracer& tracer, const std::vector<Pixel>& pixels) const;
  /// The ray of a pixel's sample.
  struct SampleRay {
    Camera::Ray ray;
    double meshNear;  ///< behind the meshes that it met
    double left = 1;  ///< transmittance of what it met; 0: it leaves the scene
  };
  /// Adds up what rays meet that see anything yet.
  /// @return numbers of those that go on through a solid
  std::vector<std::size_t> addSeen(const KernelTracer& tracer, const std::vector<Pixel>& pixels,
                                   int sample, const PixelHits& hits,
                                   std::vector<SampleRay>& sampleRays,
                                   std::vector<ColourSum>& sums) const;

  const Scene& scene_;
  const KernelScene& surfaces_;
  const RenderOptions& options_;
  Shader shader_;
  PictureLayers layers_;
};

/// The whole picture, tile by tile in parallel, with its header.
/// @param tile      edge of a tile, pixels
/// @param renderer  for the header
[[nodiscard]] Image paintPicture(const Scene& scene, const KernelScene& surfaces,
                                 const KernelTracer& tracer, int tile, const std::string& renderer,
                                 const RenderOptions& options);

}  // namespace render
