#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/images/image.h"
#include "render/kernel/kernel_scene.h"
#include "render/kernel/light_lattice.h"
#include "render/optics/light_paths.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"
#include "render/shading/shading.h"
#include "render/views/picture.h"

namespace render {

/// Paints rectangles of a picture from the kernel's hits. It traces all rays of one kind (pixel
/// centres, colour samples, lights) together.
class KernelPainter {
 public:
  KernelPainter(const Scene& scene, const KernelScene& surfaces, const RenderOptions& options,
                Image& image);
  /// Paints one rectangle. Thread-safe for disjoint rectangles.
  void paint(const KernelTracer& tracer, const PixelBox& box) const;
  [[nodiscard]] const PictureLayers& layers() const { return layers_; }

 private:
  struct Pixel {
    int x, y;
  };
  /// Pixels of the box, ordered by squares of 4 × 4 pixels, so that pixels close to each other are
  /// traced together.
  [[nodiscard]] static std::vector<Pixel> pixelsOf(const PixelBox& box);
  [[nodiscard]] std::size_t numberOf(const Pixel& pixel) const;
  /// First hits of rays with the surface of a blended scene, with a segmented field, with quadrics
  /// and with terrains, and all visible ones with Bézier volumes; empty for scenes without.
  struct FirstHits {
    std::vector<Hit> onFields, onInterfaces, onQuadrics, onTerrains;
    BezierHits onBeziers;
  };
  /// KernelScene::castPixels(), with the counts of Bézier operands in the layers.
  [[nodiscard]] PixelHits castPixels(const KernelTracer& tracer, const PixelBlock& pixels) const;
  void countOperands(const OperandCrossings& operands) const;
  /// @param ofCamera  false: the rays have any origin, and only their first hits are found
  [[nodiscard]] FirstHits firstHits(const KernelTracer& tracer,
                                    const std::vector<Camera::Ray>& rays,
                                    bool ofCamera = true) const;
  /// First hit, on a solid or a mesh, of the ray with index i in `hits` and `first`.
  /// @param meshNear  mesh hits nearer than this distance are ignored, world units
  /// @param first  from firstHits()
  /// @param passed  number of hits with Bézier volumes through which the ray has passed
  [[nodiscard]] Hit hitOf(const Camera::Ray& ray, double meshNear, const PixelHits& hits,
                          const FirstHits& first, std::size_t i, std::size_t passed = 0) const;
  /// The nearest of the hits of a ray. @param onSolid  its hit on a solid, or none
  [[nodiscard]] Hit nearestOf(const Camera::Ray& ray, double meshNear, const Hit& onSolid,
                              const FirstHits& first, std::size_t i, std::size_t passed) const;
  /// @param distance  of the hit, along the ray
  [[nodiscard]] Hit hitOnSolid(const Camera::Ray& ray, double distance, const PixelHits& hits,
                               std::size_t i) const;
  /// First hits of rays of any origin with all parts.
  [[nodiscard]] std::vector<Hit> castRays(const KernelTracer& tracer,
                                          const std::vector<Camera::Ray>& rays) const;
  class AnyRays;  // rays of castRays() and KernelScene::transmittances(), for light paths
  /// Paints the layers other than the colours (depth, normal, position, id, curvature, thickness)
  /// from the rays through the pixels' centres.
  /// @return for each pixel: nonzero if a shadow ray from its centre contradicts the lattice
  std::vector<char> paintData(const KernelTracer& tracer, const std::vector<Pixel>& pixels,
                              const LightLattice& lattice) const;
  /// Traces the light of the pixels' first surfaces, for its layers. @param seen  a hit or none for
  /// each pixel
  void paintLight(const KernelTracer& tracer, const std::vector<Pixel>& pixels,
                  const std::vector<Camera::Ray>& views, const std::vector<Hit>& seen) const;
  /// Paints the mean colours of samples spread over the pixels' areas.
  /// @param contradicts  result of paintData()
  void paintColours(const KernelTracer& tracer, const std::vector<Pixel>& pixels,
                    const LightLattice& lattice, const std::vector<char>& contradicts) const;
  /// Traces the light at the lattice points of a box; empty if the light is not interpolated.
  [[nodiscard]] LightLattice latticeOf(const KernelTracer& tracer, const PixelBox& box) const;
  /// The ray of one sample of a pixel.
  struct SampleRay {
    Camera::Ray ray;
    double x, y;  ///< position in the picture, pixels
    /// Mesh hits before this distance are ignored, world units. Initially the camera's near
    /// distance, then just behind the last mesh surface that the ray hit.
    double meshNear;
    double left = 1;         ///< transmittance of all surfaces and volumes so far; 0: the ray ends
    double lit;              ///< distance up to which the light of the volume is in the sums
    std::size_t passed = 0;  ///< number of hits with transparent Bézier volumes so far
  };
  /// Light of the scene's volume on parts of rays. @pre the scene has a volume
  [[nodiscard]] std::vector<VolumeLight> lightOfVolume(
      const KernelTracer& tracer, const std::vector<VolumeSegment>& segments) const;
  /// Adds to `sums` the light of the scene's volume in front of the next hits, and dims the rays.
  /// @param hits  one for each ray; without a hit the ray leaves the scene
  void addVolume(const KernelTracer& tracer, const std::vector<Hit>& hits,
                 std::vector<SampleRay>& sampleRays, std::vector<ColourSum>& sums) const;
  /// Adds to `sums` the colours at the hits of all rays whose transmittance is not yet negligible.
  /// @return indices of the rays that continue through a transparent solid (not through a
  /// transparent mesh)
  std::vector<std::size_t> addSeen(const KernelTracer& tracer, const std::vector<Pixel>& pixels,
                                   int sample, const PixelHits& hits, const FirstHits& first,
                                   const LightLattice& lattice,
                                   const std::vector<char>& contradicts,
                                   std::vector<SampleRay>& sampleRays,
                                   std::vector<ColourSum>& sums) const;

  const Scene& scene_;
  const KernelScene& surfaces_;
  const RenderOptions& options_;
  CameraRays camera_;
  Shader shader_;
  std::optional<LightPaths> paths_;  // set for traced reflection or refraction
  PictureLayers layers_;
};

/// Paints the entire picture in parallel tiles and writes its header attributes.
/// @param tile  edge of a tile, pixels
/// @param renderer  name of the renderer for the header attribute ls:renderer
[[nodiscard]] Image paintPicture(const Scene& scene, const KernelScene& surfaces,
                                 const KernelTracer& tracer, int tile, const std::string& renderer,
                                 const RenderOptions& options);

}  // namespace render
