#include "mapping/generators/ring.h"

#include <cmath>
#include <numbers>

#include "mapping/generators/generator_vdb.h"

namespace mapping {
namespace {

using Imath::V2d;
using Imath::V3d;
using levelset::ShapeExtent;
using levelset::ShapeOptions;

constexpr int kMostRings = 1'000'000;

// Default spacing and lean of the rings of a sheet; spacings in ring radii, lean in radians. They
// maximise the least distance between the centre lines of two rings, which becomes 0.5022 radii.
// Three distances from a ring are then equal: to the next ring of its row, to the linked rings, and
// to the ring three rows away.
constexpr double kBestColumn = 2.50219, kBestRow = 0.62,
                 kBestLean = 34.7207 * 3.14159265358979323846 / 180;

V2d ringSpacing(const Ring& ring) {
  if (ring.spacing) return *ring.spacing;
  return {kBestColumn * ring.radius, kBestRow * ring.radius};
}

/// Radius of the round wire that circumscribes the wire's section, world units.
double wireReach(const Ring& ring) {
  return ring.section ? ring.section->length() / 2 : ring.tube;
}

void requireRing(const Ring& ring, const V3d& center) {
  requirePositive(ring.radius, "the radius");
  if (ring.section) {
    requirePositive(ring.section->x, "the width of the section");
    requirePositive(ring.section->y, "the height of the section");
    if (ring.section->x >= 2 * ring.radius) {
      throw levelset::UsageError(fmt::format(
          "the section is {:.6g} wide, which closes a ring of radius {:.6g}; make it narrower",
          ring.section->x, ring.radius));
    }
  } else {
    requirePositive(ring.tube, "the tube");
    if (ring.tube >= ring.radius) {
      throw levelset::UsageError(fmt::format(
          "a tube of radius {:.6g} closes a ring of radius {:.6g}; make it thinner, or use "
          "`torus` for a solid without a hole",
          ring.tube, ring.radius));
    }
  }
  if (ring.lean) requireAngle(*ring.lean, -std::numbers::pi, std::numbers::pi, "the lean");
  if (ring.columns < 1 || ring.rows < 1 || ring.columns > kMostRings ||
      ring.rows > kMostRings / ring.columns) {
    throw levelset::UsageError(
        fmt::format("the sheet has {} columns and {} rows of rings; give at least 1 of each "
                    "and at most a million rings",
                    ring.columns, ring.rows));
  }
  if (ring.spacing) {
    requirePositive(ring.spacing->x, "the spacing along a row");
    requirePositive(ring.spacing->y, "the spacing of rows");
  }
  requireNonNegative(ring.clearance, "the clearance");
  requireFinite(center, "the centre");
}

/// Centre line of a ring's wire: its centre, the two directions that span its plane, its axis and
/// its radius.
struct Circle {
  V3d center, along{1, 0, 0}, across, axis;
  double radius;

  Circle(const Ring& ring, int column, int row)
      : center(ringCenter(ring, column, row)), radius(ring.radius) {
    const double lean = ringLean(ring, row);
    across = V3d(0, std::cos(lean), std::sin(lean));
    axis = V3d(0, -std::sin(lean), std::cos(lean));
  }
  [[nodiscard]] V3d at(double angle) const {
    return center + (along * std::cos(angle) + across * std::sin(angle)) * radius;
  }
  /// Coordinates of a point in the half plane through the point and the axis: distance outwards
  /// from the circle, and distance from the circle's plane along the axis.
  [[nodiscard]] V2d profile(const V3d& p) const {
    const V3d d = p - center;
    const double u = d ^ along, v = d ^ across;
    return {std::sqrt(u * u + v * v) - radius, d ^ axis};
  }
};

/// Least distance of two circles. The nearest of many sample points of one circle is refined
/// between its neighbours by golden-section search.
double distanceOfCircles(const Circle& a, const Circle& b) {
  const auto distance = [&](double angle) { return b.profile(a.at(angle)).length(); };
  constexpr int kSamples = 360;
  constexpr double kStep = 2 * std::numbers::pi / kSamples;
  int nearest = 0;
  for (int i = 1; i < kSamples; ++i)
    if (distance(i * kStep) < distance(nearest * kStep)) nearest = i;
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double low = (nearest - 1) * kStep, high = (nearest + 1) * kStep;
  for (int i = 0; i < 60; ++i) {
    const double x = high - golden * (high - low), y = low + golden * (high - low);
    (distance(x) < distance(y) ? high : low) = distance(x) < distance(y) ? y : x;
  }
  return distance((low + high) / 2);
}

/// True if one circle passes exactly once through the disc of the other.
bool holdsRing(const Circle& a, const Circle& b) {
  // Finds the angles t on circle b at which b meets the plane of a: s + c cos t + d sin t = 0.
  const double s = (b.center - a.center) ^ a.axis, c = b.radius * (b.along ^ a.axis),
               d = b.radius * (b.across ^ a.axis), size = std::sqrt(c * c + d * d);
  if (!(std::abs(s) < size)) return false;
  const double middle = std::atan2(d, c), turn = std::acos(-s / size);
  const bool first = a.profile(b.at(middle + turn)).x < 0,
             second = a.profile(b.at(middle - turn)).x < 0;
  return first != second;
}

void requireMail(const Ring& ring) {
  if (!ring.isSheet()) return;
  const double clearance = ringClearance(ring);
  if (!(clearance > ring.clearance) && !(clearance == ring.clearance && clearance > 0)) {
    throw levelset::UsageError(fmt::format(
        "the clearance between wires is {:.6g}, but --clearance requires {:.6g}; make the wire "
        "thinner (a tube under {:.6g} radii, at the best spacing) or change --spacing and --lean",
        clearance, ring.clearance, 0.25));
  }
  if (ring.rows > 1 && !holdsRing(Circle(ring, 0, 0), Circle(ring, 0, 1))) {
    throw levelset::UsageError(
        "the rings do not hold each other: no ring passes through its neighbours in the next "
        "row; move the rows closer, or leave --spacing and --lean out");
  }
}

/// Half size of a ring's bounding box, world units.
V3d ringHalfSize(const Ring& ring) {
  const double lean = ringLean(ring, 0), c = std::abs(std::cos(lean)), s = std::abs(std::sin(lean));
  if (!ring.section) return V3d(ring.radius, ring.radius * c, ring.radius * s) + V3d(ring.tube);
  const double outer = ring.radius + ring.section->x / 2, half = ring.section->y / 2;
  return {outer, outer * c + half * s, outer * s + half * c};
}

/// Centre of the bounding box of all rings, relative to the centre of ring (0, 0), world units.
V3d sheetMiddle(const Ring& ring) {
  const V2d spacing = ringSpacing(ring);
  const double aside = ring.rows > 1 ? 0.5 : 0;
  return {(ring.columns - 1 + aside) * spacing.x / 2, (ring.rows - 1) * spacing.y / 2, 0};
}

/// Signed distance to the union of all rings, clipped by `bounds`; exact up to `reach`, world
/// units, and cut off there.
class RingField {
 public:
  RingField(const Ring& ring, const V3d& origin, const Imath::Box3d& bounds, double reach)
      : ring_(ring),
        origin_(origin),
        bounds_(bounds),
        spacing_(ringSpacing(ring)),
        half_(ringHalfSize(ring)),
        reach_(reach) {}

  double operator()(const V3d& world) const {
    const V3d p = world - origin_;
    double found = reach_;
    const double y = half_.y + reach_, x = half_.x + reach_;
    const int low = nth((p.y - y) / spacing_.y, ring_.rows, true),
              high = nth((p.y + y) / spacing_.y, ring_.rows, false);
    for (int row = low; row <= high; ++row) {
      const double aside = (row & 1) * spacing_.x / 2;
      const int left = nth((p.x - aside - x) / spacing_.x, ring_.columns, true),
                right = nth((p.x - aside + x) / spacing_.x, ring_.columns, false);
      for (int column = left; column <= right; ++column)
        found = std::min(found, wire(Circle(ring_, column, row).profile(p)));
    }
    return std::max(found, boxDistance(world, bounds_));
  }

 private:
  /// Returns the first integer of 0 … count − 1 that is not below `place`, or `count` if there is
  /// none. If not `isFirst`: the last integer not above `place`, or −1.
  static int nth(double place, int count, bool isFirst) {
    return static_cast<int>(isFirst ? std::clamp(std::ceil(place), 0.0, double(count))
                                    : std::clamp(std::floor(place), -1.0, double(count - 1)));
  }

  [[nodiscard]] double wire(const V2d& profile) const {
    if (!ring_.section) return profile.length() - ring_.tube;
    return convexEdge(std::abs(profile.x) - ring_.section->x / 2,
                      std::abs(profile.y) - ring_.section->y / 2);
  }

  const Ring& ring_;
  V3d origin_;
  Imath::Box3d bounds_;
  V2d spacing_;
  V3d half_;
  double reach_;
};

}  // namespace

V3d ringCenter(const Ring& ring, int column, int row) {
  const V2d spacing = ringSpacing(ring);
  return {(column + 0.5 * (row & 1)) * spacing.x, row * spacing.y, 0};
}

double ringLean(const Ring& ring, int row) {
  const double lean = ring.lean ? *ring.lean : ring.isSheet() ? kBestLean : 0;
  return row & 1 ? -lean : lean;
}

double ringClearance(const Ring& ring) {
  const V2d spacing = ringSpacing(ring);
  const double reach = 2 * (ring.radius + wireReach(ring));
  double least = HUGE_VAL;
  // The arrangement of the rings repeats after two rows. So it suffices to pair the rings of the
  // first two rows with the rings around these.
  const double ranges = std::min<double>(ring.rows, reach / spacing.y + 1) *
                        std::min<double>(ring.columns, 2 * reach / spacing.x + 3);
  if (ranges > kMostRings) return -2 * wireReach(ring);
  for (int first = 0; first < std::min(ring.rows, 2); ++first) {
    for (int row = first; row < ring.rows && (row - first) * spacing.y <= reach; ++row) {
      const int columns = std::min(ring.columns - 1, static_cast<int>(reach / spacing.x) + 1);
      for (int column = -columns; column <= columns; ++column) {
        if (row == first && column <= 0) continue;
        const int from = std::max(0, -column);
        least = std::min(
            least, distanceOfCircles(Circle(ring, from, first), Circle(ring, from + column, row)));
      }
    }
  }
  return least - 2 * wireReach(ring);
}

TileBox ringBox(const Ring& ring, const V3d& center) {
  requireRing(ring, center);
  const V3d half = sheetMiddle(ring) + ringHalfSize(ring);
  TileBox box{{center - half, center + half}, {center - half, center + half}};
  if (!ring.isSheet()) return box;
  const V2d spacing = ringSpacing(ring);
  const V3d tile(ring.columns * spacing.x / 2, ring.rows * spacing.y / 2, half.z);
  box.tile = {center - tile, center + tile};
  return box;
}

ShapeExtent ringExtent(const Ring& ring, const V3d& center) {
  const Imath::Box3d bounds = ringBox(ring, center).whole;
  const double around =
      ring.section ? 2 * (ring.section->x + ring.section->y) : 2 * std::numbers::pi * ring.tube;
  return {bounds, 2 * std::numbers::pi * ring.radius * around * ring.columns * ring.rows};
}

void checkRing(const Ring& ring, const V3d& center, double voxelSize, const ShapeOptions& options) {
  const ShapeExtent extent = ringExtent(ring, center);
  levelset::checkShape(extent, voxelSize, options);
  requireMail(ring);
  if (ring.section) {
    requireResolved(ring.section->x, voxelSize, "the width of the section");
    requireResolved(ring.section->y, voxelSize, "the height of the section");
  } else {
    requireResolved(2 * ring.tube, voxelSize, "the wire");
  }
  if (ring.isSheet())
    requireResolved(ringClearance(ring), voxelSize, "the clearance between wires");
}

levelset::NarrowBand makeRing(const Ring& ring, const V3d& center, double voxelSize,
                              const ShapeOptions& options) {
  checkRing(ring, center, voxelSize, options);
  const ShapeExtent extent = ringExtent(ring, center);
  // Distances may be cut off at `reach`: a block of 8³ voxels has no voxel in the band if its
  // centre is further away than the half width plus 6.1 voxels.
  const double reach = (options.halfWidth + 8) * voxelSize;
  return levelset::makeShape(extent, voxelSize, options,
                             RingField(ring, center - sheetMiddle(ring), extent.bounds, reach));
}

}  // namespace mapping
