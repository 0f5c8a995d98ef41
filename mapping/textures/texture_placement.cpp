#include "mapping/textures/texture_placement.h"

#include <fmt/core.h>

#include <cmath>

#include "levelset/error.h"

namespace mapping {

using Imath::Box3d;
using Imath::V3d;
using levelset::InvalidInput;

Box3d chooseTextureBox(const Box3d& own, const std::optional<Box3d>& given) {
  const Box3d box = given ? *given : own;
  const V3d size = box.isEmpty() ? V3d(0) : box.size();
  if (!(size.x > 0 && size.y > 0 && size.z > 0) || !std::isfinite(size.x * size.y * size.z)) {
    throw InvalidInput(
        fmt::format("the texture box has no volume: its size is {:.6g} × {:.6g} × "
                    "{:.6g}; give a low and a high corner",
                    size.x, size.y, size.z));
  }
  if (given && !box.intersects(own)) {
    throw InvalidInput(
        "the texture box contains nothing of the texture; give a box that meets its surface");
  }
  return box;
}

namespace {

std::string foldSentence(const Distortion& distortion, const FoldCertificate& certificate) {
  const auto describe = [](const V3d& position, const V3d& uvw, double jacobian) {
    return fmt::format(
        "the worst at ({:.6g}, {:.6g}, {:.6g}), u, v, w = {:.3g}, {:.3g}, {:.3g}, where the map's "
        "Jacobian is {:.3g} of its median",
        position.x, position.y, position.z, uvw.x, uvw.y, uvw.z, jacobian);
  };
  if (distortion.folded > 0)
    return fmt::format(
        "the patch folds at {} of {} sample points, {}", distortion.folded, distortion.samples,
        describe(distortion.foldPoint, distortion.foldUvw, distortion.jacobian.least));
  const FoldPoint& fold = certificate.worst.front();
  return fmt::format("the patch folds between the {} sample points, {}", distortion.samples,
                     describe(fold.position, fold.uvw, fold.jacobian));
}

}  // namespace

bool isBeyond(const Box3d& own, const Box3d& box, double voxelSize) {
  const V3d slack(0.05 * voxelSize);
  const Box3d wide(box.min - slack, box.max + slack);
  return !own.isEmpty() && !(wide.intersects(own.min) && wide.intersects(own.max));
}

std::vector<std::string> checkFolds(const Distortion& distortion,
                                    const FoldCertificate& certificate, bool areAllowed) {
  if (distortion.folded == 0 && certificate.verdict() == FoldVerdict::Certified) return {};
  if (distortion.folded == 0 && certificate.verdict() == FoldVerdict::Undecided)
    return {fmt::format("no fold of the map was found, but {:.2g} of its volume is not certified",
                        certificate.undecidedShare)};
  std::string sentence = foldSentence(distortion, certificate);
  if (!areAllowed) {
    throw InvalidInput(
        fmt::format("{}; give --untangle, a lower height or a flatter position", sentence));
  }
  return {std::move(sentence)};
}

}  // namespace mapping
