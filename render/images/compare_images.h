#pragma once

#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "render/images/image.h"

/// Compares two pictures of one scene, layer by layer, by percentiles and the worst pixels. A mean
/// over all pixels is not used, because it hides a leak of one pixel.
namespace render {

/// Largest difference allowed between two correct renderers.
struct LayerTolerance {
  double usual;  ///< for 99.9 % of the pixels
  double worst;  ///< for all pixels
};

struct PixelDifference {
  int x = 0, y = 0;  ///< from the upper left corner
  double value = 0;
};

struct LayerComparison {
  std::string layer;           ///< "Z", "N", "P", "curvature.mean", "id", "colour" …
  std::string measure;         ///< unit of the difference: "relative", "radians" …
  std::size_t compared = 0;    ///< pixels that both pictures hit
  double median = 0, p99 = 0;  ///< statistics of the differences of these pixels
  double p999 = 0, largest = 0;
  LayerTolerance allowed{};
  std::vector<PixelDifference>
      worst;  ///< at most five, the largest first; zero differences are left out
  /// True when the differences are within the tolerance. False for an infinite difference, which
  /// means that one picture is broken there.
  [[nodiscard]] bool agrees() const {
    return std::isfinite(largest) && p999 <= allowed.usual && largest <= allowed.worst;
  }
};

struct ImageComparison {
  std::size_t pixels = 0, bothHit = 0;
  /// Pixels that are hit in one picture only. AtOutline: beside an outline of both pictures, where
  /// rounding decides. Elsewhere: all others, including pixels with a NaN Z, and pixels of
  /// different surfaces along inner outlines.
  std::size_t unlikeAtOutline = 0, unlikeElsewhere = 0;
  std::size_t outlineAllowed = 0;  ///< limit of unlikeAtOutline; unlikeElsewhere must be 0
  std::vector<PixelDifference>
      unlike;  ///< the first five; pixels elsewhere precede those at outlines
  std::vector<LayerComparison> layers;  ///< sorted by name
  std::vector<std::string> onlyOne;     ///< layers of one picture only; not compared
  std::size_t differentBits = 0;        ///< pixels with different bits in any channel
  bool isExact = false;                 ///< agreement requires equal bits
  Image difference;                     ///< a channel for each layer, and "coverage"

  [[nodiscard]] bool coverageAgrees() const {
    return unlikeElsewhere == 0 && unlikeAtOutline <= outlineAllowed;
  }
  [[nodiscard]] bool agrees() const;
  /// First reason of a disagreement, as the end of a sentence; empty when the pictures agree.
  [[nodiscard]] std::string reason() const;
};

struct ImageComparisonOptions {
  bool exact = false;  ///< requires equal bits in all channels, and the same channels
  /// Overrides the tolerances of layers, by name.
  std::map<std::string, LayerTolerance> tolerances = {};
};

/// Compares two pictures.
///
/// A pixel is hit where Z is finite, and missed where Z is +inf; without Z, it is hit where A is
/// positive. Inner outline: each Z lies between those of the other picture within one pixel. Then
/// the pixels show two surfaces in front of each other, and no layer is compared.
///
/// Measures of difference by layer. NaN counts as an infinite difference.
/// - Z: relative to the larger of Z and the size of the scene (ls:extent of the first header).
/// - P: relative to the larger of these and the length of P.
/// - N: angle, minus the angle by which the surface turns between both positions (P times
///   curvature, if these layers exist).
/// - curvature: times the voxel size in the first header (ls:voxelSize; 1 if missing).
/// - id: 0 or 1.
/// @throws levelset::InvalidInput for pictures of different sizes, or without Z and A
/// @throws levelset::UsageError for a tolerance of a missing layer, or an invalid tolerance
[[nodiscard]] ImageComparison compareImages(const Image& first, const Image& second,
                                            const ImageComparisonOptions& options = {});

}  // namespace render
