#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <cstdint>

#include "render/embree/embree_renderer.h"

namespace render {

/// Numbers in [0, 1)² that fill the square evenly, different for each pixel, always the same: the
/// additive R2 sequence with a start drawn from the pixel's coordinates.
class PixelSequence {
 public:
  PixelSequence(int x, int y, std::uint64_t purpose);
  [[nodiscard]] Imath::V2d at(int index) const;

 private:
  Imath::V2d start_;
};

/// Lights the surface: a soft key with shadows, a sky dimmed by occlusion, a cool fill, a thin rim.
class Shader {
 public:
  Shader(const Scene& scene, const EmbreeScene& rays, const EmbreeOptions& options);
  /// Linear colour of the surface at a hit, seen along `direction`. `sample` counts within the
  /// pixel.
  [[nodiscard]] Imath::C3f colour(const Hit& hit, const Imath::V3d& direction, int x, int y,
                                  int sample) const;

 private:
  struct Frame {
    Imath::V3d start, normal, facet;  ///< of the surface as seen: towards the eye
  };
  [[nodiscard]] double openSky(const Frame& frame, int x, int y, int sample) const;
  [[nodiscard]] double keyLight(const Frame& frame, int x, int y, int sample) const;

  const Scene& scene_;
  const EmbreeScene& rays_;
  const EmbreeOptions& options_;
  Imath::V3d key_, fill_, up_;
  double diagonal_;
};

}  // namespace render
