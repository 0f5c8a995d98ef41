#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/hit.h"
#include "render/scene/scene.h"
#include "render/shading/render_options.h"

namespace render {

/// A low-discrepancy sequence of points in [0, 1)² for a pixel, the same in every run: the additive
/// R2 sequence, with a start derived from the pixel's coordinates and a number for its purpose
/// (pixel area, occlusion or shadow).
class PixelSequence {
 public:
  PixelSequence(int x, int y, std::uint64_t purpose);
  /// Sequence of sample positions within pixel (x, y).
  [[nodiscard]] static PixelSequence overArea(int x, int y) { return {x, y, 0}; }
  [[nodiscard]] Imath::V2d at(int index) const;

 private:
  Imath::V2d start_;
};

/// Unit vector towards the key light, in world space.
[[nodiscard]] Imath::V3d keyDirection(const Scene& scene);
/// Length of ambient occlusion rays, world units.
/// @param diagonal  diagonal of the bounding box of the surfaces, world units
[[nodiscard]] double occlusionDistance(double diagonal);

/// A ray from a surface point towards a light.
struct LightRay {
  Imath::V3d origin, direction;  ///< direction of unit length
  double maxDistance = 0;        ///< length of the ray, world units
  /// Weight of the ray if nothing blocks it: 1 for a ray to the sky; cosine of the angle to the
  /// normal for a ray to the key light.
  double light = 0;
};

/// Light rays of one surface point, as a range of a list of LightRay: `sky` occlusion rays towards
/// the sky from index `first` on, then `key` shadow rays towards the key light.
struct LightRays {
  std::size_t first = 0, sky = 0, key = 0;
};

/// Shades a surface: key light with soft shadows, sky light with ambient occlusion, a cool fill
/// light and a thin rim light. The styles tone, ink and matcap use no light rays (shadow and
/// occlusion rays).
class Shader {
 public:
  /// @param diagonal  diagonal of the bounding box of the surfaces, world units
  Shader(const Scene& scene, double diagonal, const RenderOptions& options);

  /// Appends to `rays` the light rays of a hit on a view ray with the given direction. The pixel
  /// (x, y) and the number of the sample determine the random directions of the light rays.
  /// @param sample  number of the sample within the pixel
  [[nodiscard]] LightRays addRays(const Hit& hit, const Imath::V3d& direction, int x, int y,
                                  int sample, std::vector<LightRay>& rays) const;

  /// Computes the linear colour of a hit. @param range  light rays of the hit, from addRays()
  /// @param transmittances  for each of `rays`: share of its light that reaches the hit
  [[nodiscard]] Imath::C3f colour(const Hit& hit, const Imath::V3d& direction,
                                  const LightRays& range, const std::vector<LightRay>& rays,
                                  const std::vector<double>& transmittances) const;

 private:
  struct Frame {
    /// Start of the light rays. Unit normals of the smooth surface and of the drawn facet: `facet`
    /// faces the eye, `normal` lies on the same side of the surface.
    Imath::V3d start, normal, facet;
  };
  [[nodiscard]] Frame frameOf(const Hit& hit, const Imath::V3d& direction) const;
  void addSkyRays(const Frame& frame, int x, int y, int sample, std::vector<LightRay>& rays) const;
  void addKeyRays(const Frame& frame, int x, int y, int sample, std::vector<LightRay>& rays) const;

  [[nodiscard]] Imath::C3f albedoOf(const Hit& hit) const;
  /// @param open, lit  fractions of the sky light and of the key light that reach the hit, [0, 1]
  [[nodiscard]] Imath::C3f litColour(const Hit& hit, const Frame& frame,
                                     const Imath::V3d& direction, double open, double lit) const;
  [[nodiscard]] Imath::C3f toneColour(const Hit& hit, const Frame& frame,
                                      const Imath::V3d& direction) const;
  [[nodiscard]] Imath::C3f inkColour(const Hit& hit, const Frame& frame,
                                     const Imath::V3d& direction) const;
  [[nodiscard]] Imath::C3f matcapColour(const Frame& frame) const;
  /// Weight of the silhouette line at the hit: 1 on the line, 0 beside it.
  [[nodiscard]] double lineAt(const Hit& hit, const Frame& frame,
                              const Imath::V3d& direction) const;

  const Scene& scene_;
  const RenderOptions& options_;
  Imath::V3d key_, fill_, up_, right_;
  double diagonal_, curvatureRange_;
};

}  // namespace render
