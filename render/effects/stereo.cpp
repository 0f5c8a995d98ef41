#include "render/effects/stereo.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "render/effects/canvas.h"
#include "render/effects/picture_view.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::InvalidInput;

// A jump of the shift by more pixels than this between two pixels is a gap between two surfaces.
constexpr double kGap = 2;

/// Nearness of each pixel, 1 / depth; 0 without a surface. The edge of a surface covers pixels in
/// part whose middle shows none. They move with the surface, or else they would leave it.
std::vector<double> nearnessOf(const PictureView& view) {
  const Image& image = view.image();
  const auto alphas = image.channels.find("A");
  std::vector<double> nearness(image.pixelCount(), 0);
  forPixels(image, [&](int x, int y, std::size_t i) {
    if (view.isHit(i)) {
      nearness[i] = 1 / view.depth(i);
      return;
    }
    if (alphas == image.channels.end() || !(alphas->second[i] > 0)) return;
    for (int dy = std::max(-1, -y); dy <= std::min(1, image.height - 1 - y); ++dy)
      for (int dx = std::max(-1, -x); dx <= std::min(1, image.width - 1 - x); ++dx) {
        const std::size_t other =
            static_cast<std::size_t>(y + dy) * static_cast<std::size_t>(image.width) +
            static_cast<std::size_t>(x + dx);
        if (view.isHit(other)) nearness[i] = std::max(nearness[i], 1 / view.depth(other));
      }
  });
  return nearness;
}

/// A row of the picture as seen by another eye: values between the moved pixels.
class MovedRow {
 public:
  /// @param nearness  from nearnessOf()
  MovedRow(const PictureView& view, const std::vector<double>& nearness, int y, double shift,
           double screenDepth)
      : width_(view.image().width),
        first_(static_cast<std::size_t>(y) * static_cast<std::size_t>(width_)) {
    for (int x = 0; x < width_; ++x) {
      const std::size_t i = first_ + static_cast<std::size_t>(x);
      nearness_.push_back(nearness[i]);
      places_.push_back(x + 0.5 - shift * (nearness[i] - 1 / screenDepth) / view.stepX());
    }
  }

  /// Calls set(x, from, share): pixel x shows the mixture of the pixels `from` and `from` + 1 of
  /// the picture, with the given share of the second.
  template <typename Set>
  void fill(const Set& set) const {
    std::vector<double> seen(static_cast<std::size_t>(width_), -1);
    const auto offer = [&](int x, double nearness, int from, double share) {
      if (x < 0 || x >= width_ || nearness <= seen[static_cast<std::size_t>(x)]) return;
      seen[static_cast<std::size_t>(x)] = nearness;
      set(x, first_ + static_cast<std::size_t>(from), share);
    };
    for (int x = 0; x < firstFrom(places_.front()); ++x) offer(x, 0, 0, 0);
    for (int n = 0; n + 1 < width_; ++n) {
      const auto i = static_cast<std::size_t>(n);
      const double from = places_[i], to = places_[i + 1];
      for (int x = firstFrom(from); x < firstFrom(to); ++x) {
        const double share = (x + 0.5 - from) / (to - from);
        if (to - from <= kGap)
          offer(x, nearness_[i] + (nearness_[i + 1] - nearness_[i]) * share, n, share);
        else
          offer(x, std::min(nearness_[i], nearness_[i + 1]), n,
                nearness_[i + 1] < nearness_[i] ? 1 : 0);
      }
    }
    for (int x = firstFrom(places_.back()); x < width_; ++x) offer(x, 0, width_ - 1, 0);
  }

 private:
  /// Number of the first pixel whose middle is at or behind a position.
  [[nodiscard]] int firstFrom(double place) const {
    return static_cast<int>(std::ceil(std::clamp(place - 0.5, -1.0, width_ + 1.0)));
  }

  int width_;
  std::size_t first_;
  std::vector<double> nearness_, places_;
};

double grey(const V3d& colour) {
  return 0.299 * colour.x + 0.587 * colour.y + 0.114 * colour.z;
}

}  // namespace

Image seenFromBeside(const Image& image, double shift, double screenDepth) {
  const PictureView view(image);
  if (!view.isPerspective())
    throw InvalidInput(
        "a stereo picture needs a view in perspective, but the picture is orthographic; draw it "
        "without --ortho");
  requireChannels(image, {"R", "G", "B"}, "a stereo picture");
  Image moved(image.width, image.height);
  for (const char* name : {"R", "G", "B", "A"}) moved.addChannel(name, name[0] == 'A' ? 1 : 0);
  std::vector<std::pair<const float*, float*>> layers;  // from, to
  for (auto& [name, values] : moved.channels)
    if (const auto source = image.channels.find(name); source != image.channels.end())
      layers.emplace_back(source->second.data(), values.data());
  const std::vector<double> nearness = nearnessOf(view);
  tbb::parallel_for(0, image.height, [&](int y) {
    const MovedRow row(view, nearness, y, shift, screenDepth);
    row.fill([&](int x, std::size_t from, double share) {
      const std::size_t target =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
          static_cast<std::size_t>(x);
      const std::size_t next = share > 0 ? from + 1 : from;
      for (const auto& [source, values] : layers) {
        const double a = static_cast<double>(source[from]), b = static_cast<double>(source[next]);
        values[target] = static_cast<float>(a + (b - a) * share);
      }
    });
  });
  return moved;
}

Image stereoPicture(const Image& left, const Image& right, Stereo kind) {
  if (left.width != right.width || left.height != right.height)
    throw InvalidInput(fmt::format(
        "the pictures of both eyes differ in size ({}x{} and {}x{} pixels); draw them with the "
        "same size",
        left.width, left.height, right.width, right.height));
  const bool isAnaglyph = kind == Stereo::Anaglyph;
  Image eyes[2] = {left, right};
  Image result(isAnaglyph ? left.width : 2 * left.width, left.height);
  for (const char* name : {"R", "G", "B", "A"}) result.addChannel(name);
  const Canvas first(eyes[0], "a stereo picture"), second(eyes[1], "a stereo picture");
  Canvas canvas(result, "a stereo picture");
  float* alphas = result.channels["A"].data();
  forPixels(result, [&](int x, int y, std::size_t i) {
    const auto width = static_cast<std::size_t>(left.width);
    const std::size_t source =
        static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x) % width;
    if (isAnaglyph) {
      // The red of the left eye is its brightness, so that reddish and bluish colours do not differ
      // between the eyes.
      const V3d cyan = second.shown(source);
      canvas.setShown(i, V3d(grey(first.shown(source)), cyan.y, cyan.z),
                      std::max(first.alpha(source), second.alpha(source)));
      return;
    }
    const bool isSecond = (x >= left.width) == (kind == Stereo::SideBySide);
    const Canvas& eye = isSecond ? second : first;
    canvas.set(i, eye.colour(source));
    alphas[i] = static_cast<float>(eye.alpha(source));
  });
  result.attributes = left.attributes;
  result.attributes.insert(right.attributes.begin(), right.attributes.end());
  return result;
}

Image stereoOf(const Image& image, Stereo kind, double eyeDistance, double screenDepth,
               int reduce) {
  const PictureView view(image);
  const Imath::V2d range = view.depthRange();
  if (!(range.y > 0))
    throw InvalidInput(
        "a stereo picture needs a surface, but the picture shows none; draw one with a surface in "
        "its frame");
  const double eyes = eyeDistance > 0 ? eyeDistance : defaultEyeDistance(range);
  const double screen = screenDepth > 0 ? screenDepth : defaultScreenDepth(range);
  const auto eye = [&](double shift) {
    Image seen = seenFromBeside(image, shift, screen);
    return reduce > 1 ? reducedPicture(std::move(seen), reduce) : seen;
  };
  return stereoPicture(eye(-0.5 * eyes), eye(0.5 * eyes), kind);
}

}  // namespace render
