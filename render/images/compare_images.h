#pragma once

#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "render/images/image.h"

/// How far two pictures of one scene differ, layer by layer: shares of the pixels and the worst
/// ones, never one mean over all, in which a leak of one pixel drowns.
namespace render {

/// What may lie between two correct renderers.
struct LayerTolerance {
  double usual;  ///< for 999 pixels of 1000
  double worst;  ///< for all
};

struct PixelDifference {
  int x = 0, y = 0;  ///< from the upper left corner
  double value = 0;
};

struct LayerComparison {
  std::string layer;           ///< "Z", "N", "P", "curvature.mean", "id", "colour" …
  std::string measure;         ///< of the difference: "relative", "radians" …
  std::size_t compared = 0;    ///< pixels that both pictures hit
  double median = 0, p99 = 0;  ///< of the differences there
  double p999 = 0, largest = 0;
  LayerTolerance allowed{};
  std::vector<PixelDifference> worst;  ///< the largest first, at most five; none of 0
  /// Never where a difference is infinite: one of the pictures is broken there.
  [[nodiscard]] bool agrees() const {
    return std::isfinite(largest) && p999 <= allowed.usual && largest <= allowed.worst;
  }
};

struct ImageComparison {
  std::size_t pixels = 0, bothHit = 0;
  /// Hit by one only: beside an outline of both pictures, where rounding decides, and elsewhere;
  /// there those of a Z that is none, too, and along inner outlines those of unlike surfaces.
  std::size_t unlikeAtOutline = 0, unlikeElsewhere = 0;
  std::size_t outlineAllowed = 0;       ///< of the first kind; of the others none
  std::vector<PixelDifference> unlike;  ///< the first five, those elsewhere before the others
  std::vector<LayerComparison> layers;  ///< in the order of their names
  std::vector<std::string> onlyOne;     ///< layers of one picture; nobody compares them
  std::size_t differentBits = 0;        ///< pixels in which any channel has other bits
  bool isExact = false;                 ///< agreement asks for the same bits
  Image difference;                     ///< a channel for each layer, and "coverage"

  [[nodiscard]] bool coverageAgrees() const {
    return unlikeElsewhere == 0 && unlikeAtOutline <= outlineAllowed;
  }
  [[nodiscard]] bool agrees() const;
  /// The first reason why not, as the end of a sentence; empty when they agree.
  [[nodiscard]] std::string reason() const;
};

struct ImageComparisonOptions {
  bool exact = false;  ///< the same bits in all channels, and the same channels
  /// In the place of the layers' own.
  std::map<std::string, LayerTolerance> tolerances = {};
};

/// A pixel is hit where Z is finite, missed where it is +inf; without Z, hit where A is positive.
/// Where each Z lies between those that the other picture has within a pixel, they belong to two
/// surfaces in front of each other: an inner outline, and no layer is compared. Differences of Z
/// are relative to Z or to the size of what is drawn (ls:extent of the first header) if that is
/// larger, those of P to these or to P's length, those of N angles, less the one that the surface
/// turns by between the places of both (P times curvature, where there are such layers), those of
/// curvatures by the
/// voxel size that the first picture's header names (ls:voxelSize; 1 without), those of id 0 or 1.
/// NaN differs infinitely.
/// @throws levelset::InvalidInput for pictures of different sizes, or without Z and A
/// @throws levelset::UsageError for a tolerance of a layer that they do not have, or that is none
[[nodiscard]] ImageComparison compareImages(const Image& first, const Image& second,
                                            const ImageComparisonOptions& options = {});

}  // namespace render
