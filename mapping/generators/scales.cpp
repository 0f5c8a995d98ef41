#include "mapping/generators/scales.h"

#include <cmath>
#include <numbers>

#include "mapping/generators/generator_vdb.h"

namespace mapping {
namespace {

using Imath::V2d;
using Imath::V3d;
using levelset::ShapeExtent;
using levelset::ShapeOptions;

double stepOf(const Scales& scales) {
  return scales.step > 0 ? scales.step : scales.length / 2;
}

/// Thickness of a scale, world units. With the option 0 the scale is so thick that its lower face
/// is inside the plate.
double thicknessOf(const Scales& scales) {
  return scales.thickness > 0 ? scales.thickness : 1.1 * scales.length * std::tan(scales.tilt);
}

/// Gap between a scale and the scale under its tip, world units.
double rowGap(const Scales& scales) {
  return stepOf(scales) * std::sin(scales.tilt) - scales.thickness;
}

double tipOf(const Scales& scales) {
  return scales.tip > 0 ? scales.tip : scales.width / 2;
}

void requireScales(const Scales& scales, const V3d& center) {
  requirePositive(scales.length, "the length");
  requirePositive(scales.width, "the width");
  requireNonNegative(scales.thickness, "the thickness");
  requireAngle(scales.tilt, 0, std::numbers::pi / 3, "the tilt");
  requireNonNegative(scales.step, "the step");
  requireNonNegative(scales.tip, "the tip");
  requireNonNegative(scales.rounding, "the rounding");
  requireNonNegative(scales.base, "the base");
  requireTiling(scales.tiling);
  requireFinite(center, "the centre");
  const auto refuse = [](const char* what, double is, double most) {
    throw levelset::UsageError(fmt::format("{} is {:.6g}; give at most {:.6g}", what, is, most));
  };
  if (tipOf(scales) > scales.length)
    refuse("the tip (part of the length)", tipOf(scales), scales.length);
  if (tipOf(scales) < scales.width / 2) {
    throw levelset::UsageError(
        fmt::format("a tip of {:.6g} is blunter than a half circle; give at least half the "
                    "width, {:.6g}",
                    tipOf(scales), scales.width / 2));
  }
  if (stepOf(scales) > scales.length)
    refuse("the step (rows must overlap)", stepOf(scales), scales.length);
  const double roundest = std::min(thicknessOf(scales), scales.width) / 2;
  if (scales.rounding > roundest) refuse("the rounding", scales.rounding, roundest);
  if (scales.thickness > 0 && rowGap(scales) <= 0) {
    throw levelset::UsageError(
        fmt::format("with a thickness of {:.6g} the rows touch; give less than {:.6g}, or give 0 "
                    "for scales that are solid down to the plate",
                    scales.thickness, stepOf(scales) * std::sin(scales.tilt)));
  }
}

/// Neighbours in a row overlap by this share of their width, so that the notch between their tips
/// is wide enough for a grid to resolve.
constexpr double kRowOverlap = 0.06;

/// Outline of the tongues of a row, in their plane: a sheet whose border has two arcs for each
/// scale. The two arcs of a scale meet at its tip. Beside the scale they meet the arcs of its
/// neighbours in notches.
class ScaleOutline {
 public:
  explicit ScaleOutline(const Scales& scales)
      : half_(scales.width / 2), rounding_(scales.rounding), length_(scales.length - rounding_) {
    const double side = half_ * (1 + kRowOverlap), tip = tipOf(scales) + side - half_;
    middle_ = scales.length - tip;
    radius_ = (tip * tip + side * side) / (2 * side);
    aside_ = radius_ - side;
    notch_ = middle_ + std::sqrt(radius_ * radius_ - (half_ + aside_) * (half_ + aside_));
    // Point where the two arcs of a scale meet after they are moved inwards by the rounding radius.
    const double inner = radius_ - rounding_;
    length_ = middle_ + std::sqrt(std::max(0.0, inner * inner - aside_ * aside_));
  }

  /// Signed distance to the outline moved inwards by the rounding radius.
  /// @param u  distance from the root towards the tip, in the plane of the scale
  /// @param v  coordinate along x, from the middle of the nearest scale
  [[nodiscard]] double distance(double u, double v) const {
    v = std::abs(v);
    const double along = u - middle_, across = v + aside_;
    const double fromCenter = std::sqrt(along * along + across * across);
    // Beyond the ends of both arcs the tip is the nearest point. Inside the outline, where the
    // nearest arc would belong to a neighbour, the notch is nearest.
    if (fromCenter > radius_ - rounding_ && across * (radius_ - rounding_) < aside_ * fromCenter) {
      const double beyond = u - length_;
      return std::sqrt(beyond * beyond + v * v);
    }
    if (along <= 0 || (across * radius_ > (half_ + aside_) * fromCenter && fromCenter < radius_)) {
      const double before = u - notch_, beside = v - half_;
      return rounding_ - std::sqrt(before * before + beside * beside);
    }
    return fromCenter - radius_ + rounding_;
  }

 private:
  double half_, rounding_, length_, middle_ = 0, radius_ = 0, aside_ = 0, notch_ = 0;
};

/// Signed distance to the infinite pattern of scales. `origin` is the root of the first scale in
/// the middle of the first column, at the top of the plate.
class ScalesField {
 public:
  ScalesField(const Scales& scales, const V3d& origin, double reach)
      : scales_(scales),
        outline_(scales),
        thickness_(thicknessOf(scales)),
        step_(stepOf(scales)),
        origin_(origin),
        reach_(reach),
        along_(0, std::cos(scales.tilt), std::sin(scales.tilt)),
        normal_(0, -std::sin(scales.tilt), std::cos(scales.tilt)) {}

  double operator()(const V3d& world) const {
    const V3d p = world - origin_;
    double found = std::min(reach_, p.z);
    const double before = thickness_ + reach_;
    const double first = std::ceil((p.y - scales_.length - before) / step_),
                 last = std::floor((p.y + before) / step_);
    for (double row = first; row <= last; ++row) found = std::min(found, scale(p, row));
    return found;
  }

 private:
  /// Signed distance to the nearest scale of a row.
  [[nodiscard]] double scale(const V3d& p, double row) const {
    const double aside = std::remainder(row, 2.0) != 0 ? scales_.width / 2 : 0;
    const V3d q(std::remainder(p.x - aside, scales_.width), p.y - row * step_, p.z);
    const double u = q ^ along_, r = scales_.rounding, half = thickness_ / 2;
    // Ends the scale at its root, which lies inside the plate.
    const double outline = std::max(outline_.distance(u, q.x), -thickness_ + r - u);
    return convexEdge(outline, std::abs((q ^ normal_) + half) - half + r) - r;
  }

  const Scales& scales_;
  ScaleOutline outline_;
  double thickness_, step_;
  V3d origin_;
  double reach_;
  V3d along_, normal_;
};

}  // namespace

TileBox scalesBox(const Scales& scales, const V3d& center) {
  requireScales(scales, center);
  return tileBox(scales.tiling, {scales.width, stepOf(scales)}, -scales.base,
                 scales.length * std::sin(scales.tilt), center);
}

ShapeExtent scalesExtent(const Scales& scales, const V3d& center) {
  const Imath::Box3d bounds = scalesBox(scales, center).whole;
  const V3d size = bounds.size();
  // Area of both faces of all scales, and of the edges of the scales, per area of the plate.
  const double faces = 2 * scales.length / stepOf(scales) + 2 * scales.thickness *
                                                                (scales.length + scales.width) /
                                                                (stepOf(scales) * scales.width);
  return {bounds, size.x * size.y * (2 + faces) + 2 * (size.x + size.y) * size.z};
}

void checkScales(const Scales& scales, const V3d& center, double voxelSize,
                 const ShapeOptions& options) {
  const ShapeExtent extent = scalesExtent(scales, center);
  levelset::checkShape(extent, voxelSize, options);
  requireResolved(scales.width, voxelSize, "the width");
  if (scales.thickness == 0) return;
  requireResolved(scales.thickness, voxelSize, "the thickness");
  requireResolved(rowGap(scales), voxelSize, "the gap under the tips");
}

levelset::NarrowBand makeScales(const Scales& scales, const V3d& center, double voxelSize,
                                const ShapeOptions& options) {
  checkScales(scales, center, voxelSize, options);
  const TileBox box = scalesBox(scales, center);
  const V3d origin(box.tile.min.x + scales.width / 2, box.tile.min.y, box.tile.min.z + scales.base);
  // Distances to the pattern may be cut off 8 voxels beyond `exact`: a block of 8³ voxels has no
  // voxel in the band if its centre is further away than the half width plus 6.1 voxels.
  const double exact = (options.halfWidth + 0.5) * voxelSize;
  const ScalesField pattern(scales, origin, exact + 8 * voxelSize);
  // The clipping box is open at the top, so that it does not clip the tips of the scales.
  Imath::Box3d cut = box.whole;
  cut.max.z = HUGE_VAL;
  return levelset::makeShape(scalesExtent(scales, center), voxelSize, options, [&](const V3d& p) {
    return clippedDistance(pattern, p, cut, exact, voxelSize);
  });
}

}  // namespace mapping
