#include "render/effects/picture_view.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "levelset/error.h"

namespace render {
namespace {

using Imath::M44d;
using Imath::V3d;
using levelset::InvalidInput;

M44d matrixOf(const Image& image, const char* name) {
  const auto found = image.matrices.find(name);
  if (found == image.matrices.end() || found->second.size() != 16)
    throw InvalidInput(
        fmt::format("the picture has no camera: its header has no matrix {}; draw it with 'render "
                    "FILE.exr'",
                    name));
  M44d m;
  for (int i = 0; i < 16; ++i)
    m[i / 4][i % 4] = static_cast<double>(found->second[static_cast<std::size_t>(i)]);
  return m;
}

}  // namespace

void requireChannels(const Image& image, std::initializer_list<const char*> names,
                     const std::string& purpose) {
  for (const char* name : names)
    if (!image.channels.contains(name))
      throw InvalidInput(fmt::format(
          "{} needs the channel {}, which the picture does not have; draw it with "
          "'render FILE.exr'{}",
          purpose, name, std::string(name) == "thickness" ? " and the option --thickness" : ""));
}

PictureView::PictureView(const Image& image) : image_(image) {
  requireChannels(image, {"Z"}, "an effect");
  depths_ = &image.channels.at("Z");
  readCamera();
  measure();
}

void PictureView::readCamera() {
  const M44d toCamera = matrixOf(image_, "worldToCamera"), toNdc = matrixOf(image_, "worldToNDC");
  const auto column = [&](int j) { return V3d(toCamera[0][j], toCamera[1][j], toCamera[2][j]); };
  right_ = column(0).normalized();
  up_ = column(1).normalized();
  forward_ = column(2).normalized();
  // Rows of the projection, from the products of rotations: NDC = camera * projection.
  const auto projected = [&](const V3d& axis, int j) {
    return axis.x * toNdc[0][j] + axis.y * toNdc[1][j] + axis.z * toNdc[2][j];
  };
  isPerspective_ = std::abs(projected(forward_, 3)) > 0.5;
  stepX_ = 1 / (projected(right_, 0) * image_.width);
  stepY_ = -1 / (projected(up_, 1) * image_.height);
  // The matrices are in single precision: smaller shifts of the axis are roundings.
  constexpr double kLeastShift = 1e-5;
  const double shift = isPerspective_ ? projected(forward_, 0) - 0.5 : 0;
  middleX_ = (0.5 + (std::abs(shift) < kLeastShift ? 0 : shift)) * image_.width;
  const bool isCamera = std::isfinite(middleX_) && std::isfinite(stepX_) && std::isfinite(stepY_) &&
                        stepX_ > 0 && stepY_ > 0 && std::abs(right_.dot(forward_)) < 1e-3 &&
                        std::abs(right_.dot(up_)) < 1e-3 && std::abs(up_.dot(forward_)) < 1e-3;
  if (!isCamera)
    throw InvalidInput(
        "the matrices in the header of the picture are not those of a camera; draw it again with "
        "'render FILE.exr'");
}

void PictureView::measure() {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  double near = kInfinite, far = -kInfinite, widest = 0;
  for (std::size_t i = 0; i < image_.pixelCount(); ++i) {
    if (!isHit(i)) continue;
    near = std::min(near, depth(i));
    far = std::max(far, depth(i));
  }
  if (near <= far) {
    depthRange_ = {near, far};
    const double scale = isPerspective_ ? 0.5 * (near + far) : 1;
    widest = std::hypot(stepX_ * image_.width, stepY_ * image_.height) * scale;
    diagonal_ = std::hypot(widest, far - near);
  }
  const auto extent = image_.attributes.find(kExtentAttribute);
  if (extent == image_.attributes.end()) return;
  const double stated = std::strtod(extent->second.c_str(), nullptr);
  if (std::isfinite(stated) && stated > 0) diagonal_ = stated;
}

V3d PictureView::direction(int x, int y) const {
  if (!isPerspective_) return forward_;
  const double across = (x + 0.5 - middleX_) * stepX_,
               down = (y + 0.5 - 0.5 * image_.height) * stepY_;
  return (forward_ + right_ * across - up_ * down).normalized();
}

bool PictureView::isHit(std::size_t pixel) const {
  const float z = (*depths_)[pixel];
  return std::isfinite(z) && z >= 0;
}

VectorLayer::VectorLayer(const Image& image, const std::string& layer, const std::string& purpose) {
  const char* axes[3] = {".X", ".Y", ".Z"};
  for (int i = 0; i < 3; ++i) {
    const std::string name = layer + axes[i];
    requireChannels(image, {name.c_str()}, purpose);
    channels_[i] = &image.channels.at(name);
  }
}

}  // namespace render
