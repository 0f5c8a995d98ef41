#include "levelset/fields/mask.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"

namespace levelset {

double Mask::weight(const Imath::V3d& world) const {
  const double value = field(world);
  double t = 0;
  if (max > min)
    t = std::clamp((value - min) / (max - min), 0.0, 1.0);
  else if (value >= max)
    t = 1;
  if (std::isnan(t)) t = 0;
  const double weight = t * t * (3 - 2 * t);
  return invert ? 1 - weight : weight;
}

void checkMask(const Mask& mask) {
  if (!mask.field) throw UsageError("the mask has no field; give one");
  if (!(mask.min <= mask.max) || !std::isfinite(mask.min) || !std::isfinite(mask.max)) {
    throw UsageError(
        fmt::format("the mask ranges from {} to {}; give finite values, the "
                    "smaller first",
                    mask.min, mask.max));
  }
}

}  // namespace levelset
