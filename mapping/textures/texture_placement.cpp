#include "mapping/textures/texture_placement.h"

#include <fmt/core.h>

#include <cmath>

#include "levelset/error.h"

namespace mapping {

using Imath::Box3d;
using Imath::V3d;
using levelset::InvalidInput;

namespace {
constexpr const char* kAction = "texture";
}

Box3d chooseTextureBox(const Box3d& own, const std::optional<Box3d>& given) {
  const Box3d box = given ? *given : own;
  const V3d size = box.isEmpty() ? V3d(0) : box.size();
  if (!(size.x > 0 && size.y > 0 && size.z > 0) || !std::isfinite(size.x * size.y * size.z)) {
    throw InvalidInput(
        fmt::format("{}: the texture box has no volume, its size is {:.6g} × {:.6g} × "
                    "{:.6g}; give a low and a high corner",
                    kAction, size.x, size.y, size.z));
  }
  if (given && !box.intersects(own)) {
    throw InvalidInput(
        fmt::format("{}: the texture box holds nothing of the texture; give one that its "
                    "surface passes through",
                    kAction));
  }
  return box;
}

std::vector<std::string> judgeFolds(const Distortion& distortion, bool areAllowed) {
  if (distortion.folded == 0) return {};
  std::string sentence = fmt::format(
      "the patch folds at {} of {} places, most at ({:.6g}, {:.6g}, {:.6g}), u, v, w = {:.3g}, "
      "{:.3g}, {:.3g}, where the map's Jacobian is {:.3g} of its mean",
      distortion.folded, distortion.samples, distortion.foldPlace.x, distortion.foldPlace.y,
      distortion.foldPlace.z, distortion.foldUvw.x, distortion.foldUvw.y, distortion.foldUvw.z,
      distortion.jacobian.least);
  if (!areAllowed) {
    throw InvalidInput(
        fmt::format("{}: {}; lower its height or choose a flatter place", kAction, sentence));
  }
  return {std::move(sentence)};
}

}  // namespace mapping
