#include "render/images/compare_images.h"

#include <Imath/ImathVec.h>
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <set>

#include "levelset/error.h"
#include "render/filter.h"

namespace render {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr std::size_t kShown = 5;
// Largest accepted number of pixels whose hits differ at outlines, as a fraction of all pixels.
// Where a ray passes an outline within the rounding error, a hit and a miss are both right.
constexpr double kOutlineShare = 1e-5;
// Largest relative difference of Z between two pictures of the same surface point.
constexpr double kOneSurface = 1e-3;
constexpr char kMissed = 0, kHit = 1, kBroken = 2;

using Difference = std::function<double(std::size_t)>;

/// A layer, its measure and a function that returns the difference in a pixel. `allowed` is the
/// tolerance between two correct renderers, one in single and one in double precision.
/// docs/rendering.md derives the tolerances.
struct Layer {
  std::string name, measure;
  LayerTolerance allowed;
  Difference at;
  bool isOfMisses = false;  ///< compared also in pixels that no surface is hit in
};

double apart(double a, double b) {
  if (a == b) return 0;
  const double difference = std::abs(a - b);
  return std::isnan(difference) ? kInfinite : difference;
}

class Comparer {
 public:
  Comparer(const Image& first, const Image& second, const ImageComparisonOptions& options)
      : a_(first), b_(second), options_(options) {
    if (a_.width != b_.width || a_.height != b_.height)
      throw levelset::InvalidInput(fmt::format(
          "the pictures differ in size ({} × {} and {} × {} pixels); draw both with the same size",
          a_.width, a_.height, b_.width, b_.height));
    for (const auto& [name, tolerance] : options_.tolerances)
      if (!(tolerance.usual >= 0) || !(tolerance.worst >= 0))
        throw levelset::UsageError(fmt::format(
            "the tolerances of layer {} are {} and {}; give two numbers that are 0 or more", name,
            tolerance.usual, tolerance.worst));
  }

  ImageComparison run() {
    result_.isExact = options_.exact;
    result_.pixels = a_.pixelCount();
    result_.difference = Image(a_.width, a_.height);
    findHits();
    compareCoverage();
    const std::vector<Layer> all = layers();
    for (const auto& [name, tolerance] : options_.tolerances)
      if (std::none_of(all.begin(), all.end(),
                       [&name = name](const Layer& l) { return l.name == name; }))
        throw levelset::UsageError(
            fmt::format("the pictures have no common layer '{}'; their common layers are {}", name,
                        namesOf(all)));
    for (const Layer& layer : all) compare(layer);
    compareBits();
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool has(const std::string& name) const {
    return a_.channels.count(name) && b_.channels.count(name);
  }
  [[nodiscard]] static double value(const Image& image, const std::string& name, std::size_t i) {
    return static_cast<double>(image.channels.at(name)[i]);
  }
  static std::string namesOf(const std::vector<Layer>& layers) {
    std::string names;
    for (const Layer& layer : layers) names += (names.empty() ? "" : ", ") + layer.name;
    return names.empty() ? "none" : names;
  }

  void findHits() {
    const bool byDepth = has("Z");
    if (!byDepth && !has("A"))
      throw levelset::InvalidInput(
          "the pictures have neither Z nor A in common, so their hits cannot be "
          "found; draw them with 'render FILE.exr'");
    const auto hits = [&](const Image& image) {
      const std::vector<float>& channel = image.channels.at(byDepth ? "Z" : "A");
      std::vector<char> hit(channel.size());
      for (std::size_t i = 0; i < hit.size(); ++i) {
        const float z = channel[i];
        const bool isMiss = byDepth ? z == std::numeric_limits<float>::infinity() : z <= 0;
        hit[i] = std::isnan(z) || (byDepth && std::isinf(z) && !isMiss) ? kBroken
                 : isMiss                                               ? kMissed
                                                                        : kHit;
      }
      return hit;
    };
    hitA_ = hits(a_);
    hitB_ = hits(b_);
    isCompared_.assign(result_.pixels, 0);
    areMissed_.assign(result_.pixels, 0);
  }

  /// Calls visit(index) for a pixel and its up to eight neighbours.
  template <typename Visit>
  void forEachWithinOne(int x, int y, const Visit& visit) const {
    for (int v = std::max(0, y - 1); v <= std::min(a_.height - 1, y + 1); ++v)
      for (int u = std::max(0, x - 1); u <= std::min(a_.width - 1, x + 1); ++u) visit(index(u, v));
  }

  /// True when the pixel and its neighbours include both a hit and a miss.
  [[nodiscard]] bool isOutline(const std::vector<char>& hit, int x, int y) const {
    bool any = false, all = true;
    forEachWithinOne(x, y, [&](std::size_t i) {
      any = any || hit[i] == kHit;
      all = all && hit[i] == kHit;
    });
    return any && !all;
  }

  /// True when one picture shows the front and the other the back of two surfaces behind each
  /// other. Then Z differs by more than kOneSurface, and each Z lies in the range of the other
  /// picture's Z in the pixel and its neighbours.
  [[nodiscard]] bool isInnerOutline(int x, int y) const {
    if (!has("Z")) return false;
    const std::size_t i = index(x, y);
    const double a = value(a_, "Z", i), b = value(b_, "Z", i);
    if (!(std::abs(a - b) > kOneSurface * std::max(std::abs(a), std::abs(b)))) return false;
    const auto holds = [&](const Image& image, const std::vector<char>& hit, double z) {
      double low = kInfinite, high = -kInfinite;
      forEachWithinOne(x, y, [&](std::size_t n) {
        if (hit[n] != kHit) return;
        low = std::min(low, value(image, "Z", n));
        high = std::max(high, value(image, "Z", n));
      });
      const double slack = kOneSurface * std::abs(z);
      return z >= low - slack && z <= high + slack;
    };
    return holds(a_, hitA_, b) && holds(b_, hitB_, a);
  }
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(a_.width) +
           static_cast<std::size_t>(x);
  }
  [[nodiscard]] PixelDifference pixel(std::size_t i, double value) const {
    const auto width = static_cast<std::size_t>(a_.width);
    return {static_cast<int>(i % width), static_cast<int>(i / width), value};
  }

  void compareCoverage() {
    result_.outlineAllowed =
        static_cast<std::size_t>(std::ceil(kOutlineShare * static_cast<double>(result_.pixels)));
    std::vector<PixelDifference> atOutline;
    std::vector<float>& shown = result_.difference.addChannel("coverage");
    for (int y = 0; y < a_.height; ++y)
      for (int x = 0; x < a_.width; ++x) {
        const std::size_t i = index(x, y);
        const bool isBroken = hitA_[i] == kBroken || hitB_[i] == kBroken;
        const bool areHit = hitA_[i] == kHit && hitB_[i] == kHit;
        const bool isInner = areHit && isInnerOutline(x, y);
        result_.bothHit += areHit && !isInner;
        isCompared_[i] = areHit && !isInner;
        areMissed_[i] = hitA_[i] == kMissed && hitB_[i] == kMissed;
        if (hitA_[i] == hitB_[i] && !isBroken && !isInner) continue;
        shown[i] = hitB_[i] == kHit && !isInner ? -1 : 1;
        // Require the outline in both pictures: a hole that only one picture has is surrounded by
        // an outline in that picture alone.
        const bool excused =
            isInner || (!isBroken && isOutline(hitA_, x, y) && isOutline(hitB_, x, y));
        ++(excused ? result_.unlikeAtOutline : result_.unlikeElsewhere);
        std::vector<PixelDifference>& list = excused ? atOutline : result_.unlike;
        if (list.size() < kShown) list.push_back({x, y, 1});
      }
    result_.unlike.insert(result_.unlike.end(), atOutline.begin(), atOutline.end());
    if (result_.unlike.size() > kShown) result_.unlike.resize(kShown);
  }

  /// Value of a header attribute that is a length, or `fallback` if it is missing or not positive.
  [[nodiscard]] static double lengthNamed(const Image& image, const char* name, double fallback) {
    const auto found = image.attributes.find(name);
    if (found == image.attributes.end()) return fallback;
    const double size = std::atof(found->second.c_str());
    return size > 0 && std::isfinite(size * size) ? size : fallback;
  }
  /// Voxel size of the first solid of the first picture; 1 if unknown.
  [[nodiscard]] double voxelSize() const { return lengthNamed(a_, "ls:voxelSize", 1); }

  /// True when both pictures show normals of the quadratic super spline. Its gradient jumps on some
  /// planes, where both answers are correct.
  [[nodiscard]] bool jumps() const {
    const auto isJumping = [](const Image& image) {
      const auto found = image.attributes.find("ls:normal");
      return found != image.attributes.end() && found->second == filterName(Filter::SuperQuadratic);
    };
    return isJumping(a_) && isJumping(b_);
  }

  /// Tolerance that quantized values add to the curvatures, per voxel. It is the change of the
  /// curvature over 1e-3 voxels, the tolerance of positions. In a band of half width 3, a
  /// quantization step is 6 · 2^-bits voxels. Rounding changes third differences of the values by
  /// up to eight steps.
  [[nodiscard]] double curvatureStep() const {
    const double bits = lengthNamed(a_, "ls:valueBits", 32);
    return bits < 32 ? 1e-3 * 8 * 6 * std::exp2(-bits) : 0;
  }

  [[nodiscard]] double vectorDifference(const std::string& name, std::size_t i) const {
    double squares = 0;
    for (const char* axis : {".X", ".Y", ".Z"}) {
      const double d = apart(value(a_, name + axis, i), value(b_, name + axis, i));
      squares += d * d;
    }
    return std::sqrt(squares);
  }
  /// Angle in radians by which the surface turns between the positions P of both pictures; 0
  /// without the layers P and curvature.
  [[nodiscard]] double turnBetweenPlaces(std::size_t i) const {
    if (!has("P.X") || !has("P.Y") || !has("P.Z")) return 0;
    constexpr double kMostTurn = 1.7e-3;  // limit of the angle: the tolerance `worst` of N
    double curvature[2] = {};
    for (const char* name : {"curvature.k1", "curvature.k2"}) {
      if (!has(name)) continue;
      curvature[0] = std::max(curvature[0], std::abs(value(a_, name, i)));
      curvature[1] = std::max(curvature[1], std::abs(value(b_, name, i)));
    }
    const double turn = vectorDifference("P", i) * std::min(curvature[0], curvature[1]);
    return std::isfinite(turn) ? std::min(turn, kMostTurn) : 0;
  }
  /// Angle in radians between the lines along two direction vectors, times the difference of the
  /// principal curvatures per voxel: the change of the shape operator that turns them so far.
  /// Curvatures above one per voxel count relatively. At umbilics any two directions are equal.
  [[nodiscard]] double lineDifference(const std::string& name, std::size_t i, double voxel,
                                      double bend) const {
    const Imath::V3d a = vectorOf(a_, name, i), b = vectorOf(b_, name, i);
    const auto spread = [&](const Image& image) {
      return std::abs(value(image, "curvature.k1", i) - value(image, "curvature.k2", i));
    };
    const double weight = voxel * std::min(spread(a_), spread(b_)) / bend;
    if (a == b || weight == 0) return 0;
    if (a == Imath::V3d(0) || b == Imath::V3d(0)) return kInfinite;
    const double angle = std::atan2(a.cross(b).length(), std::abs(a.dot(b)));
    const double result = angle * weight;
    return std::isfinite(result) ? result : kInfinite;
  }
  [[nodiscard]] static Imath::V3d vectorOf(const Image& image, const std::string& name,
                                           std::size_t i) {
    return {value(image, name + ".X", i), value(image, name + ".Y", i),
            value(image, name + ".Z", i)};
  }
  /// Distance of the position P from the origin, world units. It determines the precision of P.
  [[nodiscard]] double distance(std::size_t i) const {
    const double d = std::hypot(value(a_, "P.X", i), value(a_, "P.Y", i), value(a_, "P.Z", i));
    return std::isfinite(d) ? d : 0;
  }
  [[nodiscard]] double depth(std::size_t i) const {
    return std::max(std::abs(value(a_, "Z", i)), std::abs(value(b_, "Z", i)));
  }

  /// Largest finite number in channels of both pictures, and at least 1.
  [[nodiscard]] double largestOf(const std::vector<std::string>& channels) const {
    double most = 1;
    for (const std::string& channel : channels)
      for (std::size_t i = 0; has(channel) && i < result_.pixels; ++i)
        for (const Image* image : {&a_, &b_})
          if (const double v = value(*image, channel, i); std::isfinite(v))
            most = std::max(most, v);
    return most;
  }

  std::vector<Layer> layers() {
    std::vector<Layer> all;
    std::set<std::string> compared;  // channels that one of the layers in `all` compares
    const auto add = [&](const std::vector<std::string>& channels, Layer layer) {
      if (!std::all_of(channels.begin(), channels.end(), [&](const auto& c) { return has(c); }))
        return;
      compared.insert(channels.begin(), channels.end());
      all.push_back(std::move(layer));
    };
    const bool hasDepth = has("Z");
    add({"R", "G", "B"}, {"colour", "absolute", {kInfinite, kInfinite}, [this](std::size_t i) {
                            double most = 0;
                            for (const char* c : {"R", "G", "B"})
                              most = std::max(most, apart(value(a_, c, i), value(b_, c, i)));
                            return most;
                          }});
    const double h = voxelSize();
    const double rough = curvatureStep();
    // Curvatures above one per voxel, which surfaces of volumes have, are compared relatively.
    const auto bend = [this, h](std::size_t i) {
      double most = 1;
      for (const Image* image : {&a_, &b_})
        for (const char* name : {"curvature.k1", "curvature.k2"}) {
          if (!has(name)) continue;
          const double k = h * std::abs(value(*image, name, i));
          if (std::isfinite(k)) most = std::max(most, k);
        }
      return most;
    };
    for (const auto& [name, usual] : {std::pair{"mean", 1e-4}, {"k1", 1e-3}, {"k2", 1e-3}}) {
      const std::string channel = std::string("curvature.") + name;
      add({channel}, {channel,
                      "per voxel",
                      {usual + rough, kInfinite},
                      [this, channel, h, bend](std::size_t i) {
                        return h * apart(value(a_, channel, i), value(b_, channel, i)) / bend(i);
                      }});
    }
    add({"curvature.gauss"},
        {"curvature.gauss",
         "per voxel²",
         {1e-4 + rough, kInfinite},
         [this, h, bend](std::size_t i) {
           return h * h * apart(value(a_, "curvature.gauss", i), value(b_, "curvature.gauss", i)) /
                  (bend(i) * bend(i));
         }});
    for (const std::string name : {"direction1", "direction2"}) {
      if (!has("curvature.k1") || !has("curvature.k2")) continue;
      add({name + ".X", name + ".Y", name + ".Z"},
          {name,
           "radians times k1 − k2 per voxel",
           {1e-4 + rough, kInfinite},
           [this, name, h, bend](std::size_t i) { return lineDifference(name, i, h, bend(i)); }});
    }
    // If the camera is close to the solid, the error of positions is relative to the size of the
    // solid.
    const double extent =
        std::max(lengthNamed(a_, kExtentAttribute, 0), lengthNamed(b_, kExtentAttribute, 0));
    add({"Z"}, {"Z", "relative", {2e-6, kOneSurface}, [this, extent](std::size_t i) {
                  const double d = apart(value(a_, "Z", i), value(b_, "Z", i));
                  return d > 0 ? d / std::max(depth(i), extent) : 0;
                }});
    add({"P.X", "P.Y", "P.Z"},
        {"P",
         hasDepth ? "relative to Z" : "absolute",
         {hasDepth ? 2e-6 : kInfinite, hasDepth ? 1e-3 : kInfinite},
         [this, hasDepth, extent](std::size_t i) {
           const double d = vectorDifference("P", i);
           return d > 0 && hasDepth ? d / std::max({depth(i), distance(i), extent}) : d;
         }});
    // The length of a grazing ray inside a surface is proportional to the square root of its depth
    // of penetration.
    add({"thickness"}, {"thickness", "relative", {1e-5, 1e-2}, [this, extent](std::size_t i) {
                          const double d =
                              apart(value(a_, "thickness", i), value(b_, "thickness", i));
                          return d > 0 ? d / std::max(depth(i), extent) : 0;
                        }});
    // Angle between unit vectors, by a formula that is precise for small angles. For grazing rays
    // the positions differ, and the normals differ by that distance times the curvature.
    constexpr double kMostJump = 0.1;  // 0.04 at a pixel of a scanned head
    const double mostTurn = jumps() ? kMostJump : 1.7e-3;
    add({"N.X", "N.Y", "N.Z"}, {"N", "radians", {2e-4, mostTurn}, [this](std::size_t i) {
                                  const double d = vectorDifference("N", i);
                                  const double angle = d <= 2 ? 2 * std::asin(d / 2) : kInfinite;
                                  return std::max(0.0, angle - turnBetweenPlaces(i));
                                }});
    // Both renderers have errors of about 1e-3 of the brightest light, and the kernel ends a ray
    // when less than 1/512 of the light passes.
    constexpr double kLightError = 1.0 / 128;
    const std::vector<std::string> light = {"volume.R", "volume.G", "volume.B", "volume.A"};
    add(light, {"volume",
                "relative to the brightest",
                {kLightError, kLightError},
                [this, light, brightest = largestOf(light)](std::size_t i) {
                  double most = 0;
                  for (const std::string& c : light)
                    most = std::max(most, apart(value(a_, c, i), value(b_, c, i)));
                  return most / brightest;
                },
                true});
    for (const auto& [name, channel] : a_.channels) {
      if (compared.count(name) || name == "A" || !has(name)) continue;
      add({name}, {name, "absolute", {kInfinite, kInfinite}, [this, name = name](std::size_t i) {
                     return apart(value(a_, name, i), value(b_, name, i));
                   }});
    }
    for (const auto& [name, channel] : a_.ids) {
      if (!b_.ids.count(name)) continue;
      all.push_back({name, "unlike", {0, 0}, [this, name = name](std::size_t i) {
                       return a_.ids.at(name)[i] == b_.ids.at(name)[i] ? 0.0 : 1.0;
                     }});
    }
    for (Layer& layer : all) {
      const auto given = options_.tolerances.find(layer.name);
      if (given != options_.tolerances.end()) layer.allowed = given->second;
    }
    std::sort(all.begin(), all.end(),
              [](const Layer& l, const Layer& m) { return l.name < m.name; });
    return all;
  }

  void compare(const Layer& layer) {
    LayerComparison found;
    found.layer = layer.name;
    found.measure = layer.measure;
    found.allowed = layer.allowed;
    std::vector<float>& shown = result_.difference.addChannel(layer.name);
    std::vector<double> sorted;
    sorted.reserve(result_.bothHit);
    const auto larger = [](const PixelDifference& p, const PixelDifference& q) {
      return p.value > q.value;
    };
    for (std::size_t i = 0; i < result_.pixels; ++i) {
      if (!isCompared_[i] && !(layer.isOfMisses && areMissed_[i])) continue;
      const double difference = layer.at(i);
      shown[i] = static_cast<float>(difference);
      sorted.push_back(difference);
      if (!(difference > 0)) continue;
      if (found.worst.size() == kShown && !(difference > found.worst.back().value)) continue;
      const PixelDifference here = pixel(i, difference);
      found.worst.insert(std::upper_bound(found.worst.begin(), found.worst.end(), here, larger),
                         here);
      if (found.worst.size() > kShown) found.worst.pop_back();
    }
    found.compared = sorted.size();
    if (!sorted.empty()) {
      std::sort(sorted.begin(), sorted.end());
      const auto share = [&](double part) {
        return sorted[static_cast<std::size_t>(
            std::ceil(part * static_cast<double>(sorted.size())) - 1)];
      };
      found.median = share(0.5);
      found.p99 = share(0.99);
      // With fewer than a thousand pixels the 99.9 % percentile is the maximum. Exclude the worst
      // pixel from that percentile, if there are at least 100 pixels.
      const std::size_t beyond = std::min<std::size_t>(1, sorted.size() / 100);
      found.p999 = std::min(share(0.999), sorted[sorted.size() - 1 - beyond]);
      found.largest = sorted.back();
    }
    result_.layers.push_back(std::move(found));
  }

  /// Compares the bits of all channels that both pictures have, in all pixels. Lists the channels
  /// that only one picture has.
  void compareBits() {
    std::vector<char> differs(result_.pixels, 0);
    const auto pass = [&](const auto& mine, const auto& others, const auto& differ) {
      for (const auto& [name, values] : mine) {
        const auto found = others.find(name);
        if (found == others.end()) {
          result_.onlyOne.push_back(name);
          continue;
        }
        for (std::size_t i = 0; i < differs.size(); ++i)
          if (differ(values[i], found->second[i])) differs[i] = 1;
      }
    };
    const auto floats = [](float x, float y) {
      return std::bit_cast<std::uint32_t>(x) != std::bit_cast<std::uint32_t>(y);
    };
    pass(a_.channels, b_.channels, floats);
    pass(a_.ids, b_.ids, std::not_equal_to<>());
    for (const auto& [name, values] : b_.channels)
      if (!a_.channels.count(name)) result_.onlyOne.push_back(name);
    for (const auto& [name, values] : b_.ids)
      if (!a_.ids.count(name)) result_.onlyOne.push_back(name);
    std::sort(result_.onlyOne.begin(), result_.onlyOne.end());
    result_.differentBits = static_cast<std::size_t>(std::count(differs.begin(), differs.end(), 1));
  }

  const Image &a_, &b_;
  const ImageComparisonOptions& options_;
  std::vector<char> hitA_, hitB_;
  std::vector<char> isCompared_;  // 1: both pictures hit the same surface in the pixel, so layers
                                  // are compared there
  std::vector<char> areMissed_;   // 1: no picture hits a surface in the pixel
  ImageComparison result_;
};

}  // namespace

bool ImageComparison::agrees() const {
  return reason().empty();
}

std::string ImageComparison::reason() const {
  if (isExact) {
    if (!onlyOne.empty()) return fmt::format("only one picture has the channel {}", onlyOne[0]);
    return differentBits > 0 ? fmt::format("{} pixels have different bits", differentBits) : "";
  }
  if (!coverageAgrees()) {
    return fmt::format(
        "hits differ in {} pixels away from outlines (0 allowed) and in {} pixels at outlines ({} "
        "allowed), the first at pixel {},{}",
        unlikeElsewhere, unlikeAtOutline, outlineAllowed, unlike[0].x, unlike[0].y);
  }
  for (const LayerComparison& layer : layers) {
    if (layer.agrees()) continue;
    return fmt::format(
        "layer {} differs by {:.3g} ({}) at the 99.9 % percentile ({:.3g} allowed) and by up to "
        "{:.3g} ({:.3g} allowed), the worst at pixel {},{}",
        layer.layer, layer.p999, layer.measure, layer.allowed.usual, layer.largest,
        layer.allowed.worst, layer.worst[0].x, layer.worst[0].y);
  }
  return "";
}

ImageComparison compareImages(const Image& first, const Image& second,
                              const ImageComparisonOptions& options) {
  return Comparer(first, second, options).run();
}

}  // namespace render
