#include "render/shading/curvature_lines.h"

#include <Imath/ImathVec.h>
#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace render {
namespace {

using Imath::V2d;
using Imath::V3d;

// Half the length of a streak, in widths of a streak.
constexpr double kHalfLength = 15;
// Steps of the walk are one pixel, so that the pixel after a step is a neighbour of the pixel
// before.
constexpr double kStep = 1;
// Change of the colour, as a share of it, by noise of one standard deviation, and the number of
// standard deviations at which the change ends.
constexpr double kContrast = 0.3, kMostDeviation = 2.5;
// Length of the mean line direction, from 0 to 1, below which a walk ends: the directions around it
// differ too much.
constexpr double kLeastAgreement = 0.3;
// Sine of the angle between a step and the tangent planes of both its ends from which on the ends
// are not neighbours on the surface. Beyond an outline the next surface is about a pixel aside and
// far behind.
constexpr double kLeastCrease = 0.5;

std::uint64_t mixedBits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Noise of a pixel, which may lie outside the picture: uniformly distributed, with mean 0 and
/// variance 1.
double noiseAt(int x, int y) {
  const auto ux = static_cast<std::uint32_t>(x), uy = static_cast<std::uint32_t>(y);
  const std::uint64_t bits = mixedBits(mixedBits(ux) ^ uy);
  return (static_cast<double>(bits >> 11) * 0x1p-53 - 0.5) * std::sqrt(12.0);
}

/// Standard deviation of the Gaussian that smooths the noise, pixels.
double smoothingOf(double width) {
  return 0.5 * width;
}

/// Smooth noise with mean 0 and variance 1 for each pixel.
std::vector<float> smoothNoise(int width, int height, double sigma) {
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  std::vector<double> weight;
  double squares = 0;
  for (int d = -radius; d <= radius; ++d) {
    weight.push_back(sigma > 0 ? std::exp(-0.5 * d * d / (sigma * sigma)) : 1);
    squares += weight.back() * weight.back();
  }
  for (double& w : weight) w /= std::sqrt(squares);
  const std::size_t across = static_cast<std::size_t>(width);
  std::vector<float> alongX(across * static_cast<std::size_t>(height + 2 * radius)),
      result(across * static_cast<std::size_t>(height));
  tbb::parallel_for(0, height + 2 * radius, [&](int row) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int d = -radius; d <= radius; ++d)
        sum += weight[static_cast<std::size_t>(d + radius)] * noiseAt(x + d, row - radius);
      alongX[static_cast<std::size_t>(row) * across + static_cast<std::size_t>(x)] =
          static_cast<float>(sum);
    }
  });
  tbb::parallel_for(0, height, [&](int y) {
    for (std::size_t x = 0; x < across; ++x) {
      double sum = 0;
      for (int d = 0; d <= 2 * radius; ++d)
        sum += weight[static_cast<std::size_t>(d)] *
               static_cast<double>(alongX[static_cast<std::size_t>(y + d) * across + x]);
      result[static_cast<std::size_t>(y) * across + x] = static_cast<float>(sum);
    }
  });
  return result;
}

/// Weights of the noise along a curve, and the standard deviation of the weighted sum.
class StreakKernel {
 public:
  explicit StreakKernel(double width)
      : half_(static_cast<int>(std::ceil(kHalfLength * std::max(1.0, width)))) {
    const std::size_t n = static_cast<std::size_t>(half_) + 1;
    for (std::size_t i = 0; i < n; ++i)
      weight_.push_back(
          0.5 + 0.5 * std::cos(std::numbers::pi * static_cast<double>(i) / static_cast<double>(n)));
    deviation_.resize(n * n);
    // Covariance of the smooth noise at a distance. That of a straight line serves for all curves.
    const double sigma = smoothingOf(width);
    const int reach = static_cast<int>(std::ceil(8 * sigma));
    const auto covariance = [&](int d) {
      if (d == 0) return 1.0;
      return sigma > 0 ? std::exp(-0.25 * d * d * kStep * kStep / (sigma * sigma)) : 0.0;
    };
    // Variance that step `end` adds to the sum over the steps `start` … end − 1.
    const auto added = [&](int start, int end) {
      double sum = weight(end) * weight(end);
      for (int i = std::max(start, end - reach); i < end; ++i)
        sum += 2 * weight(end) * weight(i) * covariance(end - i);
      return sum;
    };
    for (int back = 0; back <= half_; ++back) {
      double variance = 0;
      for (int i = -back; i <= half_; ++i) {
        variance += added(-back, i);
        if (i >= 0) deviation_[place(back, i)] = std::sqrt(variance);
      }
    }
  }
  /// Largest number of steps to each side.
  [[nodiscard]] int half() const { return half_; }
  [[nodiscard]] double weight(int step) const {
    return weight_[static_cast<std::size_t>(std::abs(step))];
  }
  /// Standard deviation of the sum over `back` steps to one side and `ahead` to the other.
  [[nodiscard]] double deviation(int back, int ahead) const {
    return deviation_[place(back, ahead)];
  }

 private:
  [[nodiscard]] std::size_t place(int back, int ahead) const {
    return static_cast<std::size_t>(back) * weight_.size() + static_cast<std::size_t>(ahead);
  }
  int half_;
  std::vector<double> weight_, deviation_;
};

/// Projected directions of the surface at the pixels of a picture.
class LineField {
 public:
  LineField(const Image& image, const Camera& camera, const StyleOptions& options, double range)
      : width_(image.width),
        height_(image.height),
        tensor_(image.pixelCount(), V2d(0)),
        weight_(image.pixelCount(), 0),
        neighbours_(image.pixelCount(), 0) {
    const Camera::PixelSteps steps = camera.pixelSteps();
    const V3d axis = camera.axis(), right = steps.right / steps.right.length2(),
              down = steps.down / steps.down.length2();
    const std::array<const std::vector<float>*, 3> line =
        vectorLayer(image, fmt::format("direction{}", options.direction));
    const std::array<const std::vector<float>*, 3> position = vectorLayer(image, "P"),
                                                   normal = vectorLayer(image, "N");
    const std::vector<float>&depth = image.channels.at("Z"),
          &k1 = image.channels.at("curvature.k1"), &k2 = image.channels.at("curvature.k2");
    const std::vector<std::uint32_t>& id = image.ids.at("id");
    tbb::parallel_for(0, height_, [&](int y) {
      for (int x = 0; x < width_; ++x) {
        const std::size_t i = at(x, y);
        if (!std::isfinite(depth[i])) continue;
        const V3d p = vectorAt(position, i);
        for (int n = 0; n < 9; ++n) {
          const int dx = n % 3 - 1, dy = n / 3 - 1;
          if (n == 4 || !isInside(x + dx, y + dy)) continue;
          const std::size_t j = at(x + dx, y + dy);
          if (!std::isfinite(depth[j]) || id[i] != id[j]) continue;
          const V3d step = vectorAt(position, j) - p;
          const double rise = std::max(std::abs(step.dot(vectorAt(normal, i))),
                                       std::abs(step.dot(vectorAt(normal, j))));
          if (rise <= kLeastCrease * step.length())
            neighbours_[i] = static_cast<std::uint16_t>(neighbours_[i] | 1 << n);
        }
        // Derivative of the pixel's position along the direction.
        const V3d d = vectorAt(line, i);
        V2d v(d.dot(right), d.dot(down));
        if (!camera.orthoHeight) {
          const V3d fromEye = p - camera.from;
          v -= V2d(fromEye.dot(right), fromEye.dot(down)) * (d.dot(axis) / fromEye.dot(axis));
        }
        const double squared = v.length2();
        const double weight =
            directionWeight(static_cast<double>(k1[i]), static_cast<double>(k2[i]), range);
        if (!(squared > 0) || !std::isfinite(squared) || !(weight > 0)) continue;
        weight_[i] = static_cast<float>(weight);
        tensor_[i] = V2d(v.x * v.x - v.y * v.y, 2 * v.x * v.y) / squared;
      }
    });
  }

  [[nodiscard]] bool isInside(int x, int y) const {
    return x >= 0 && y >= 0 && x < width_ && y < height_;
  }
  [[nodiscard]] std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }
  /// Weight of the direction at a pixel, from 0 to 1.
  [[nodiscard]] double weight(std::size_t i) const { return static_cast<double>(weight_[i]); }

  /// True when a pixel (x, y) and the neighbour (toX, toY), or itself, show one smooth surface.
  [[nodiscard]] bool connects(int x, int y, int toX, int toY) const {
    if (x == toX && y == toY) return true;
    const int n = 3 * (toY - y + 1) + toX - x + 1;
    return (neighbours_[at(x, y)] >> n & 1) != 0;
  }

  /// Unit vector along the line at a place, on the side of a heading. The directions of the four
  /// nearest pixels are interpolated as tensors, which have no sign.
  /// @return nothing where the place is not on the same smooth surface as pixel (x, y) beside it,
  /// or the direction is undefined
  [[nodiscard]] std::optional<V2d> directionAt(const V2d& place, int x, int y,
                                               const V2d& heading) const {
    const int column = static_cast<int>(std::floor(place.x)),
              row = static_cast<int>(std::floor(place.y));
    if (!isInside(column, row) || std::abs(column - x) > 1 || std::abs(row - y) > 1 ||
        !connects(x, y, column, row))
      return std::nullopt;
    const double fx = place.x - 0.5, fy = place.y - 0.5;
    const int left = static_cast<int>(std::floor(fx)), top = static_cast<int>(std::floor(fy));
    const double ax = fx - left, ay = fy - top;
    V2d sum(0);
    double weights = 0;
    for (int n = 0; n < 4; ++n) {
      const int u = left + (n & 1), v = top + (n >> 1);
      if (!isInside(u, v) || !connects(column, row, u, v)) continue;
      const double w = (n & 1 ? ax : 1 - ax) * (n >> 1 ? ay : 1 - ay);
      sum += tensor_[at(u, v)] * w;
      weights += w;
    }
    const double length = sum.length();
    if (!(length > kLeastAgreement * weights)) return std::nullopt;
    // Half of the tensor's angle, by the formula without cancellation.
    const double c = sum.x / length, s = sum.y / length;
    V2d line = c >= 0 ? V2d(1 + c, s) : V2d(s, 1 - c);
    line /= line.length();
    return line.dot(heading) < 0 ? -line : line;
  }

  /// Direction of a pixel without its neighbours.
  [[nodiscard]] V2d directionOf(std::size_t i) const {
    const V2d& t = tensor_[i];
    return (t.x >= 0 ? V2d(1 + t.x, t.y) : V2d(t.y, 1 - t.x)).normalized();
  }

 private:
  static std::array<const std::vector<float>*, 3> vectorLayer(const Image& image,
                                                              const std::string& name) {
    return {&image.channels.at(name + ".X"), &image.channels.at(name + ".Y"),
            &image.channels.at(name + ".Z")};
  }
  static V3d vectorAt(const std::array<const std::vector<float>*, 3>& layer, std::size_t i) {
    return {static_cast<double>((*layer[0])[i]), static_cast<double>((*layer[1])[i]),
            static_cast<double>((*layer[2])[i])};
  }

  int width_, height_;
  std::vector<V2d> tensor_;  // (cos 2α, sin 2α) of the direction's angle α; 0: no direction
  std::vector<float> weight_;
  std::vector<std::uint16_t> neighbours_;  // bit 3 (dy + 1) + dx + 1: see connects()
};

/// Sum of the noise on one side of a pixel.
struct Walk {
  int steps = 0;
  double sum = 0;
};

Walk walked(const LineField& field, const std::vector<float>& noise, const StreakKernel& kernel,
            int x, int y, V2d heading) {
  Walk walk;
  V2d place(x + 0.5, y + 0.5);
  while (walk.steps < kernel.half()) {
    const std::optional<V2d> here = field.directionAt(place, x, y, heading);
    if (!here) break;
    const std::optional<V2d> middle = field.directionAt(place + *here * (kStep / 2), x, y, *here);
    if (!middle) break;
    const V2d next = place + *middle * kStep;
    const int nextX = static_cast<int>(std::floor(next.x)),
              nextY = static_cast<int>(std::floor(next.y));
    if (!field.isInside(nextX, nextY) || !field.connects(x, y, nextX, nextY)) break;
    place = next;
    x = nextX;
    y = nextY;
    heading = *middle;
    ++walk.steps;
    walk.sum += kernel.weight(walk.steps) * static_cast<double>(noise[field.at(x, y)]);
  }
  return walk;
}

bool hasLayers(const Image& image, int direction) {
  std::vector<std::string> names = {"R", "G", "B", "Z", "curvature.k1", "curvature.k2"};
  for (const std::string& name :
       {std::string("N"), std::string("P"), fmt::format("direction{}", direction)})
    for (const char* axis : {".X", ".Y", ".Z"}) names.push_back(name + axis);
  return image.ids.count("id") != 0 &&
         std::all_of(names.begin(), names.end(),
                     [&](const std::string& name) { return image.channels.count(name) != 0; });
}

}  // namespace

void drawCurvatureLines(Image& image, const Camera& camera, const StyleOptions& options,
                        double range) {
  if (!hasLayers(image, options.direction)) return;
  const LineField field(image, camera, options, range);
  const std::vector<float> noise =
      smoothNoise(image.width, image.height, smoothingOf(options.lineWidth));
  const StreakKernel kernel(options.lineWidth);
  std::array<float*, 3> colour{};
  const char* const names[3] = {"R", "G", "B"};
  for (std::size_t c = 0; c < 3; ++c) colour[c] = image.channels.at(names[c]).data();
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const std::size_t i = field.at(x, y);
      const double weight = field.weight(i);
      if (!(weight > 0)) continue;
      const V2d direction = field.directionOf(i);
      const Walk back = walked(field, noise, kernel, x, y, -direction),
                 ahead = walked(field, noise, kernel, x, y, direction);
      const double sum = kernel.weight(0) * static_cast<double>(noise[i]) + (back.sum + ahead.sum);
      const double streak = std::clamp(sum / kernel.deviation(back.steps, ahead.steps),
                                       -kMostDeviation, kMostDeviation);
      const auto factor = static_cast<float>(1 + kContrast * weight * streak);
      for (float* channel : colour) channel[i] *= factor;
    }
  });
}

}  // namespace render
