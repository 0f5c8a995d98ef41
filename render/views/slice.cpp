#include "render/views/slice.h"

#include <Imath/ImathColor.h>
#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/memory/memory_limit.h"
#include "render/camera.h"

namespace render {
namespace {

using Imath::C3f;
using Imath::V3d;

constexpr double kMargin = 1.08;     // size of the picture relative to the bounds of the zero set
constexpr double kLine = 1.2;        // width of a contour line, pixels
constexpr double kZeroLine = 2.4;    // width of the zero contour, pixels
constexpr double kFaintLine = 0.45;  // opacity of the black contour lines other than φ = 0
constexpr int kAcross = 4;           // colour samples along a pixel's side

/// World positions of the pixels.
struct Frame {
  V3d centre, right, down;  ///< centre of the picture, and the steps to the next pixel to the right
                            ///< and down, world units
  [[nodiscard]] V3d at(double x, double y) const { return centre + right * x + down * y; }
};

Frame frameOf(const Imath::Box3d& bounds, const SliceOptions& options) {
  const V3d normal = options.normal.normalized();
  const bool isAlongZ = std::abs(normal.z) > 0.999;
  const V3d right = (isAlongZ ? V3d(0, 1, 0) : V3d(0, 0, 1)).cross(normal).normalized();
  const V3d up = normal.cross(right);
  const V3d middle = bounds.center();
  Frame frame;
  frame.centre = middle - normal * (middle - options.point).dot(normal);
  const V3d half = bounds.size() * 0.5;
  const auto reach = [&](const V3d& axis) {
    return std::abs(axis.x) * half.x + std::abs(axis.y) * half.y + std::abs(axis.z) * half.z;
  };
  const double pixel =
      2 * kMargin * std::max(reach(right) / options.width, reach(up) / options.height);
  frame.right = right * pixel;
  frame.down = -up * pixel;
  return frame;
}

C3f mixedColour(const C3f& a, const C3f& b, double share) {
  return a + (b - a) * static_cast<float>(std::clamp(share, 0.0, 1.0));
}

class SlicePainter {
 public:
  SlicePainter(const levelset::NarrowBand& band, const SliceOptions& options, const Frame& frame)
      : phi_(band),
        background_(band.halfWidth() * band.voxelSize()),
        step_(options.step > 0 ? options.step : band.voxelSize()),
        frame_(frame) {}

  [[nodiscard]] double phi(const V3d& p) const { return phi_.value(p); }

  [[nodiscard]] C3f colour(const V3d& p) const {
    const double phi = phi_.value(p);
    const bool isFar = std::abs(phi) >= background_ * (1 - 1e-6);
    const double depth = std::abs(phi) / background_;
    C3f result = phi < 0 ? mixedColour(C3f(0.55f, 0.72f, 0.88f), C3f(0.10f, 0.25f, 0.52f), depth)
                         : mixedColour(C3f(0.94f, 0.82f, 0.62f), C3f(0.62f, 0.40f, 0.18f), depth);
    if (isFar) return phi < 0 ? C3f(0.16f, 0.20f, 0.28f) : C3f(0.80f, 0.80f, 0.80f);
    // Change of φ per pixel: it converts the line width in pixels to a range of φ.
    const V3d gradient = phi_.gradient(p);
    const double perPixel = std::hypot(gradient.dot(frame_.right), gradient.dot(frame_.down));
    const double toLine = std::abs(phi - std::round(phi / step_) * step_);
    const bool isEnd =
        std::abs(phi) >
        background_ - 0.25 * step_;  // close to the end of the band, where no contour is drawn
    if (!isEnd && toLine < 0.5 * kLine * perPixel && 4 * kLine * perPixel < step_)
      result = mixedColour(result, C3f(0), kFaintLine);
    if (std::abs(phi) < 0.5 * kZeroLine * perPixel) result = C3f(0.01f);
    return result;
  }

 private:
  levelset::BandSampler phi_;
  double background_, step_;
  const Frame& frame_;
};

void requireSlice(const levelset::NarrowBand& band, const SliceOptions& options) {
  const V3d sum = options.point + options.normal;
  if (!std::isfinite(sum.x + sum.y + sum.z) || !(options.normal.length() > 0))
    throw levelset::UsageError(
        "the plane's point or normal is not finite, or the normal is zero; give a finite "
        "point and a nonzero normal");
  if (options.width < 1 || options.height < 1 || !(options.step >= 0) ||
      !std::isfinite(options.step))
    throw levelset::UsageError(
        fmt::format("a picture of {}x{} pixels with contours every {} world units is out of range; "
                    "give a positive size, and a step of 0 or more",
                    options.width, options.height, options.step));
  if (static_cast<double>(options.width) * options.height > kMaxPixels)
    throw levelset::ResourceLimit(fmt::format(
        "a picture of {}x{} pixels exceeds the limit of {:.0f} pixels; choose a smaller size",
        options.width, options.height, kMaxPixels));
  constexpr double kBytesOfPixel = 8 * 4;
  levelset::requireMemory(kBytesOfPixel * options.width * options.height, options.maxBytes);
  if (band.isEmpty() || band.zeroSetBounds().isEmpty())
    throw levelset::InvalidInput("the solid has no surface; give a solid with a zero set");
}

}  // namespace

Image drawSlice(const levelset::NarrowBand& band, const SliceOptions& options) {
  requireSlice(band, options);
  Image image(options.width, options.height);
  float* colours[3] = {image.addChannel("R").data(), image.addChannel("G").data(),
                       image.addChannel("B").data()};
  image.addChannel("A", 1);
  float* phi = image.addChannel("phi").data();
  float* places[3] = {image.addChannel("P.X").data(), image.addChannel("P.Y").data(),
                      image.addChannel("P.Z").data()};
  const Frame frame = frameOf(band.zeroSetBounds(), options);
  std::mutex reporting;
  int done = 0;
  tbb::parallel_for(0, options.height, [&](int y) {
    const SlicePainter painter(band, options, frame);
    for (int x = 0; x < options.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(options.width) +
                            static_cast<std::size_t>(x);
      const double left = x - 0.5 * options.width, top = y - 0.5 * options.height;
      C3f sum(0);
      for (int row = 0; row < kAcross; ++row)
        for (int column = 0; column < kAcross; ++column)
          sum += painter.colour(
              frame.at(left + (column + 0.5) / kAcross, top + (row + 0.5) / kAcross));
      const V3d middle = frame.at(left + 0.5, top + 0.5);
      for (int c = 0; c < 3; ++c) {
        colours[c][i] = sum[c] / (kAcross * kAcross);
        places[c][i] = static_cast<float>(middle[c]);
      }
      phi[i] = static_cast<float>(painter.phi(middle));
    }
    const std::scoped_lock lock(reporting);
    levelset::report(options.progress, static_cast<double>(++done) / options.height);
  });
  return image;
}

}  // namespace render
