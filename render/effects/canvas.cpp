#include "render/effects/canvas.h"

#include <algorithm>
#include <cmath>

#include "render/effects/picture_view.h"

namespace render {

using Imath::V3d;

Canvas::Canvas(Image& image, const std::string& purpose) {
  requireChannels(image, {"R", "G", "B"}, purpose);
  if (!image.channels.contains("A")) image.addChannel("A", 1);
  r_ = image.channels["R"].data();
  g_ = image.channels["G"].data();
  b_ = image.channels["B"].data();
  a_ = image.channels["A"].data();
}

V3d Canvas::shown(std::size_t i) const {
  const double a = alpha(i);
  if (!(a > 0)) return V3d(0);
  const V3d linear = colour(i) / a;
  return {displayOfLinear(linear.x), displayOfLinear(linear.y), displayOfLinear(linear.z)};
}

void Canvas::setShown(std::size_t i, const V3d& shown, double alpha) {
  a_[i] = static_cast<float>(alpha);
  set(i, V3d(linearOfDisplay(shown.x), linearOfDisplay(shown.y), linearOfDisplay(shown.z)) *
             static_cast<double>(a_[i]));
}

}  // namespace render
