#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "render/images/image.h"

namespace support {

/// Differences of the depths of two pictures of one view, world units.
struct DepthAgreement {
  std::size_t hits = 0;                      ///< pixels that show a surface in both pictures
  std::size_t compared = 0;                  ///< pixels that are not at a silhouette
  std::size_t unlike = 0;                    ///< pixels that show a surface in one picture only
  double median = 0, p999 = 0, largest = 0;  ///< of the compared pixels
  double p99OfAll = 0;                       ///< of all pixels that show a surface in both
  std::size_t worstX = 0, worstY = 0;        ///< pixel of the largest difference
};

/// Compares the layers Z of two pictures. A pixel is at a silhouette if, in one of the pictures,
/// the 3 × 3 pixels around it do not all show a surface, or if their depths differ by more than
/// `step`. There two surfaces that differ by less than a pixel may have any difference of depth.
/// @param step  world units
inline DepthAgreement compareDepths(const render::Image& a, const render::Image& b, double step) {
  DepthAgreement found;
  const std::vector<float>&za = a.channels.at("Z"), &zb = b.channels.at("Z");
  const auto width = static_cast<std::size_t>(a.width), height = static_cast<std::size_t>(a.height);
  const auto isSmooth = [&](const std::vector<float>& z, std::size_t x, std::size_t y) {
    if (x == 0 || y == 0 || x + 1 == width || y + 1 == height) return false;
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (std::size_t j = y - 1; j <= y + 1; ++j)
      for (std::size_t i = x - 1; i <= x + 1; ++i) {
        least = std::min(least, static_cast<double>(z[j * width + i]));
        most = std::max(most, static_cast<double>(z[j * width + i]));
      }
    return most - least <= step;  // false if one of them is infinite
  };
  std::vector<double> differences, all;
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x) {
      const double u = static_cast<double>(za[y * width + x]),
                   v = static_cast<double>(zb[y * width + x]);
      if (std::isfinite(u) != std::isfinite(v)) ++found.unlike;
      if (!std::isfinite(u) || !std::isfinite(v)) continue;
      all.push_back(std::abs(u - v));
      if (!isSmooth(za, x, y) || !isSmooth(zb, x, y)) continue;
      if (all.back() > found.largest) {
        found.largest = all.back();
        found.worstX = x;
        found.worstY = y;
      }
      differences.push_back(all.back());
    }
  const auto quantile = [](std::vector<double>& values, double share) {
    if (values.empty()) return HUGE_VAL;
    const auto at = values.begin() +
                    static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  found.hits = all.size();
  found.compared = differences.size();
  found.median = quantile(differences, 0.5);
  found.p999 = quantile(differences, 0.999);
  found.p99OfAll = quantile(all, 0.99);
  return found;
}

}  // namespace support
