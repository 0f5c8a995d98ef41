#pragma once

#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "render/images/image.h"

/// Compares two pictures of one scene, layer by layer, by percentiles and the worst pixels. A mean
/// over all pixels is not used, because it hides an error in a single pixel.
namespace render {

/// Largest difference of a layer between pictures of two correct renderers, in the unit of
/// LayerComparison::measure.
struct LayerTolerance {
  double usual;  ///< limit for 99.9 % of the compared pixels
  double worst;  ///< limit for all compared pixels
};

struct PixelDifference {
  int x = 0, y = 0;  ///< pixel, counted from the upper left corner
  double value = 0;
};

struct LayerComparison {
  std::string layer;           ///< "Z", "N", "P", "curvature.mean", "id", "colour" …
  std::string measure;         ///< measure of the difference: "relative", "radians" …
  std::size_t compared = 0;    ///< number of pixels in which the layer is compared
  double median = 0, p99 = 0;  ///< percentiles of the differences in these pixels, in `measure`
  double p999 = 0, largest = 0;
  LayerTolerance allowed{};
  std::vector<PixelDifference> worst;  ///< compared pixels with the largest differences above 0, at
                                       ///< most five, the largest first
  /// True when the differences are within the tolerance `allowed`. False for an infinite
  /// difference: then a picture has an invalid value (NaN) in this layer.
  [[nodiscard]] bool agrees() const {
    return std::isfinite(largest) && p999 <= allowed.usual && largest <= allowed.worst;
  }
};

struct ImageComparison {
  std::size_t pixels = 0, bothHit = 0;
  /// Numbers of pixels whose hits differ: only one picture shows a surface there, or the pictures
  /// show different surfaces. AtOutline: pixels beside an outline of both pictures, where rounding
  /// decides which surface is hit, or if any is. Elsewhere: all other pixels that only one picture
  /// hits, and pixels with an invalid Z.
  std::size_t unlikeAtOutline = 0, unlikeElsewhere = 0;
  std::size_t outlineAllowed = 0;  ///< limit of unlikeAtOutline, pixels; unlikeElsewhere must be 0
  std::vector<PixelDifference>
      unlike;  ///< at most five pixels whose hits differ, those away from outlines first
  std::vector<LayerComparison> layers;  ///< compared layers, sorted by name
  std::vector<std::string> onlyOne;     ///< channels of one picture only; not compared
  std::size_t differentBits = 0;        ///< number of pixels with different bits in any channel
  bool isExact = false;  ///< value of ImageComparisonOptions::exact: agreement requires equal bits
  Image difference;      ///< differences as a picture: a channel for each layer, and "coverage"

  [[nodiscard]] bool coverageAgrees() const {
    return unlikeElsewhere == 0 && unlikeAtOutline <= outlineAllowed;
  }
  [[nodiscard]] bool agrees() const;
  /// First reason why the pictures disagree, as a clause after "the pictures differ:". Empty when
  /// they agree.
  [[nodiscard]] std::string reason() const;
};

struct ImageComparisonOptions {
  bool exact = false;  ///< requires that both pictures have the same channels with equal bits
  /// Overrides the tolerances of layers, by name.
  std::map<std::string, LayerTolerance> tolerances = {};
};

/// Compares two pictures.
///
/// A pixel is hit where Z is finite, and missed where Z is +inf; without Z, it is hit where A is
/// positive. At an inner outline one picture shows the front and the other the back of two surfaces
/// behind each other. There Z differs, but each Z lies in the range of the other picture's Z within
/// one pixel. Layers are not compared in such pixels.
///
/// Measures of difference by layer. NaN counts as an infinite difference.
/// - Z: difference relative to the larger of Z and the scene's diagonal (the larger ls:extent of
/// both headers).
/// - P: difference relative to the largest of Z, that diagonal and the length of P.
/// - N: angle, minus the angle by which the surface turns between the positions P of both pictures
/// (their distance times the curvature, if these layers exist).
/// - curvature: difference times the voxel size in the first header (ls:voxelSize; 1 if missing).
/// For curvature.gauss, times its square.
/// - thickness: as Z.
/// - volume, of the layers volume.R, .G, .B and .A: largest difference, relative to the largest
/// number in them or to 1. It is compared also in pixels that both pictures miss.
/// - id: 0 for equal numbers, 1 for different ones.
/// - colour: largest difference of R, G and B. Any other channel: difference of the values.
/// @throws levelset::InvalidInput for pictures of different sizes, or without Z and A
/// @throws levelset::UsageError for a tolerance of a missing layer, or an invalid tolerance
[[nodiscard]] ImageComparison compareImages(const Image& first, const Image& second,
                                            const ImageComparisonOptions& options = {});

}  // namespace render
