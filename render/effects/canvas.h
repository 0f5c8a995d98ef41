#pragma once

// Private to render/effects: the colours of a picture.

#include <Imath/ImathVec.h>
#include <tbb/parallel_for.h>

#include <cstddef>
#include <string>

#include "render/images/image.h"

namespace render {

/// Colours and opacity of the pixels of a picture.
class Canvas {
 public:
  /// Adds the channel A to an opaque picture.
  /// @throws levelset::InvalidInput for a picture without R, G and B
  Canvas(Image& image, const std::string& purpose);

  /// Linear colour, premultiplied.
  [[nodiscard]] Imath::V3d colour(std::size_t i) const {
    return {static_cast<double>(r_[i]), static_cast<double>(g_[i]), static_cast<double>(b_[i])};
  }
  [[nodiscard]] double alpha(std::size_t i) const { return static_cast<double>(a_[i]); }
  void set(std::size_t i, const Imath::V3d& colour) {
    r_[i] = static_cast<float>(colour.x);
    g_[i] = static_cast<float>(colour.y);
    b_[i] = static_cast<float>(colour.z);
  }
  /// Display colour of a pixel, from 0 to 1, not premultiplied.
  [[nodiscard]] Imath::V3d shown(std::size_t i) const;
  /// Sets opacity, and the colour such that it is displayed as `shown`.
  void setShown(std::size_t i, const Imath::V3d& shown, double alpha);

 private:
  float *r_, *g_, *b_, *a_;
};

/// Calls visit(x, y, number) for all pixels, in parallel.
template <typename Visit>
void forPixels(const Image& image, const Visit& visit) {
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x)
      visit(x, y,
            static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                static_cast<std::size_t>(x));
  });
}

}  // namespace render
