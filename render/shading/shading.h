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

/// Numbers in [0, 1)² that fill the square evenly, different for each pixel, always the same: the
/// additive R2 sequence with a start drawn from the pixel's coordinates.
class PixelSequence {
 public:
  PixelSequence(int x, int y, std::uint64_t purpose);
  /// Places within the pixel.
  [[nodiscard]] static PixelSequence overArea(int x, int y) { return {x, y, 0}; }
  [[nodiscard]] Imath::V2d at(int index) const;

 private:
  Imath::V2d start_;
};

/// Unit vector towards the key light, in world space.
[[nodiscard]] Imath::V3d keyDirection(const Scene& scene);
/// How far rays go that tell how open a point is, world units.
/// @param diagonal  of the box of the surfaces, world units
[[nodiscard]] double occlusionDistance(double diagonal);

/// Is there anything between a point and a light?
struct LightRay {
  Imath::V3d origin, direction;  ///< direction of unit length
  double maxDistance = 0;        ///< world units
  double light = 0;              ///< what comes along it if nothing is
};

/// The rays of one point of a surface, in a list that many points share: `sky` of them from `first`
/// on, then `key`.
struct LightRays {
  std::size_t first = 0, sky = 0, key = 0;
};

/// Lights the surface: a soft key with shadows, a sky dimmed by occlusion, a cool fill, a thin rim;
/// or draws it in a style that needs no light.
class Shader {
 public:
  /// @param diagonal  of the box of the surfaces, world units
  Shader(const Scene& scene, double diagonal, const RenderOptions& options);

  /// Appends the rays that tell how much light reaches a hit seen along `direction`.
  /// @param sample  counts within the pixel
  [[nodiscard]] LightRays addRays(const Hit& hit, const Imath::V3d& direction, int x, int y,
                                  int sample, std::vector<LightRay>& rays) const;

  /// Linear colour of the hit, once it is known how much of the light of all `rays` comes through.
  [[nodiscard]] Imath::C3f colour(const Hit& hit, const Imath::V3d& direction,
                                  const LightRays& range, const std::vector<LightRay>& rays,
                                  const std::vector<double>& transmittances) const;

 private:
  struct Frame {
    Imath::V3d start, normal, facet;  ///< of the surface as seen: towards the eye
  };
  [[nodiscard]] Frame frameOf(const Hit& hit, const Imath::V3d& direction) const;
  void addSkyRays(const Frame& frame, int x, int y, int sample, std::vector<LightRay>& rays) const;
  void addKeyRays(const Frame& frame, int x, int y, int sample, std::vector<LightRay>& rays) const;

  [[nodiscard]] Imath::C3f albedoOf(const Hit& hit) const;
  /// @param open, lit  how much of the sky and of the key light reaches the point
  [[nodiscard]] Imath::C3f litColour(const Hit& hit, const Frame& frame,
                                     const Imath::V3d& direction, double open, double lit) const;
  [[nodiscard]] Imath::C3f toneColour(const Hit& hit, const Frame& frame,
                                      const Imath::V3d& direction) const;
  [[nodiscard]] Imath::C3f inkColour(const Hit& hit, const Frame& frame,
                                     const Imath::V3d& direction) const;
  [[nodiscard]] Imath::C3f matcapColour(const Frame& frame) const;
  /// Of a silhouette's line, from 0 to 1.
  [[nodiscard]] double lineAt(const Hit& hit, const Frame& frame,
                              const Imath::V3d& direction) const;

  const Scene& scene_;
  const RenderOptions& options_;
  Imath::V3d key_, fill_, up_, right_;
  double diagonal_, curvatureRange_;
};

}  // namespace render
