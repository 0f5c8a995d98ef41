#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/camera.h"
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
  double behind = 0;  ///< sum of LightRay::light of shadow rays that the drawn facet itself blocks
};

/// Light that reaches a surface point, as shares in [0, 1].
struct PointLight {
  double sky = 1;  ///< share of the sky's light that nothing blocks
  double key = 1;  ///< share of the key light that nothing blocks
};

/// Kinds of light for which rays are traced.
enum class LightKind { Sky, Key, Both };

/// Shades a surface: key light with soft shadows, sky light with ambient occlusion, a cool fill
/// light and a thin rim light. The styles tone, ink, matcap and reflection-lines use no light
/// rays (shadow and occlusion rays).
class Shader {
 public:
  /// @param diagonal  diagonal of the bounding box of the surfaces, world units
  Shader(const Scene& scene, double diagonal, const RenderOptions& options);

  /// Appends to `rays` the light rays of a hit on a view ray with the given direction. The pixel
  /// (x, y) and the number of the sample determine the random directions of the light rays.
  /// @param sample  number of the sample within the pixel
  [[nodiscard]] LightRays addRays(const Hit& hit, const Imath::V3d& direction, int x, int y,
                                  int sample, std::vector<LightRay>& rays,
                                  LightKind kind = LightKind::Both) const;
  /// Appends up to `count` shadow rays of a hit: those towards which the surface faces.
  /// @return their range in `rays`
  [[nodiscard]] LightRays addShadowRays(const Hit& hit, const Imath::V3d& direction, int x, int y,
                                        int count, std::vector<LightRay>& rays) const;

  /// Appends the light rays of a hit for all samples of a pixel, for the layers of light. Traces
  /// light for styles without lights, too.
  [[nodiscard]] LightRays addPixelRays(const Hit& hit, const Imath::V3d& direction, int x, int y,
                                       std::vector<LightRay>& rays) const;

  /// Computes the light that reaches a hit. @param range  light rays of the hit, from addRays()
  /// @param transmittances  for each of `rays`: share of its light that reaches the hit
  [[nodiscard]] static PointLight lightOf(const LightRays& range, const std::vector<LightRay>& rays,
                                          const std::vector<double>& transmittances);

  /// Computes the linear colour of a hit.
  [[nodiscard]] Imath::C3f colour(const Hit& hit, const Imath::V3d& direction,
                                  const PointLight& light) const;
  /// Hit of a view ray with the ground of the scene, for rays that hit no surface. Not found
  /// without a ground, for styles without light rays, from below, and beyond the radius of the
  /// ground.
  [[nodiscard]] Hit groundHit(const Camera::Ray& ray) const;
  /// Opacity of the shadow at a hit on the ground: share of the light that is blocked, [0, 1].
  [[nodiscard]] double shadowOpacity(const Hit& hit, const PointLight& light) const;

 private:
  struct Frame {
    /// Start of the light rays. Unit normals of the smooth surface and of the drawn facet: `facet`
    /// faces the eye, `normal` lies on the same side of the surface.
    Imath::V3d start, normal, facet;
  };
  [[nodiscard]] Frame frameOf(const Hit& hit, const Imath::V3d& direction) const;
  void addSkyRays(const Frame& frame, int x, int y, int sample, std::vector<LightRay>& rays) const;
  /// Appends the shadow rays number `first` to first + count − 1 of the pixel.
  /// @return LightRays::behind
  [[nodiscard]] double addKeyRays(const Frame& frame, int x, int y, int first, int count,
                                  std::vector<LightRay>& rays) const;
  /// @param u  random point in [0, 1)², which selects the direction within the light's cone
  /// @return LightRays::behind of this ray
  [[nodiscard]] double addKeyRay(const Frame& frame, const Imath::V2d& u,
                                 std::vector<LightRay>& rays) const;

  [[nodiscard]] Imath::C3f albedoOf(const Hit& hit) const;
  [[nodiscard]] Imath::C3f litColour(const Hit& hit, const Frame& frame,
                                     const Imath::V3d& direction, const PointLight& light) const;
  /// Mean cosine between the normal and the directions of the key light, 0 for directions below the
  /// surface. @param cosine  of the angle between the normal and the middle of the key light
  [[nodiscard]] double keyCosine(double cosine) const;
  [[nodiscard]] Imath::C3f toneColour(const Hit& hit, const Frame& frame,
                                      const Imath::V3d& direction) const;
  [[nodiscard]] Imath::C3f inkColour(const Hit& hit, const Frame& frame,
                                     const Imath::V3d& direction) const;
  [[nodiscard]] Imath::C3f matcapColour(const Frame& frame) const;
  [[nodiscard]] Imath::C3f reflectionColour(const Frame& frame, const Imath::V3d& direction) const;
  /// Weight of the silhouette line at the hit: 1 on the line, 0 beside it.
  [[nodiscard]] double lineAt(const Hit& hit, const Frame& frame,
                              const Imath::V3d& direction) const;

  const Scene& scene_;
  const RenderOptions& options_;
  Imath::V3d key_, fill_, up_, right_;
  double diagonal_, curvatureRange_;
  std::vector<double> keyCosines_;  ///< of keyCosine(), for equidistant arguments from −1 to 1
};

}  // namespace render
