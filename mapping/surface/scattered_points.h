#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "levelset/fields/field.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// Points distributed evenly over a surface.
namespace mapping {

/// A number at each point of a surface with its outward unit normal. Several threads may call it at
/// once.
using SurfaceShare =
    std::function<double(const Imath::V3d& position, const Imath::V3d& outwardNormal)>;

struct ScatterDensity {
  std::size_t count = 0;  ///< number of points; 0: as many as `distance` allows
  double distance = 0;    ///< least distance of two points, world units; 0: chosen for `count`
  levelset::ScalarField scale = {};  ///< position-dependent factor of distances, positive; empty: 1
  levelset::ScalarField weight = {};  ///< probability of accepting a point, 0 to 1; empty: 1
  SurfaceShare share = {};            ///< factor of weight that may depend on the normal; empty: 1
  std::uint64_t seed = 1;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

struct SurfacePoint {
  Imath::V3d position, normal;  ///< position on the zero set; unit normal, outwards
  double scale = 1;
};

struct ScatteredPoints {
  /// Points in order of priority: the points of the result, then spare points. Spare points fill
  /// the gaps that appear when points of the result are rejected.
  std::vector<SurfacePoint> points;
  /// Number of points at the front that are the result; the others are spare points.
  std::size_t wanted = 0;
  /// Least distance between two points of the result, divided by their mean scale, world units;
  /// infinite for one point.
  double distance = 0;
};

/// Poisson-disc sampling of the zero set. Candidates are distributed by area. With a distance, they
/// are accepted in random order unless an accepted point is too near. With a count, the most
/// crowded candidates are removed until that many remain [Yuksel15]. Distances are measured along a
/// surface that bends evenly from the normal of one point to that of the other [Bowers10]. Points
/// on opposite sides of a part thinner than a quarter of the least distance ignore each other. The
/// same seed gives the same points.
/// @throws UsageError unless exactly one of count and distance is positive, or for a scale that is
///         not positive and finite, or a share that is not a number, with its position
/// @throws InvalidInput for a base without a surface, or a weight or share that leaves no position
/// @throws ResourceLimit for more than a million points
[[nodiscard]] ScatteredPoints scatterPoints(const levelset::NarrowBand& base,
                                            const ScatterDensity& density);

/// Distance of two points along a surface that bends evenly from normal to normal, world units. It
/// is infinite if the points are less than `thin` (world units) apart and their normals differ by
/// more than 120°. They then lie on opposite sides of a thin part.
[[nodiscard]] double surfaceDistance(const SurfacePoint& a, const SurfacePoint& b, double thin);

/// Least distance of any two points, divided by their mean scale, world units. Infinite if no pair
/// is examined.
/// @param reach  distance up to which all pairs are examined, divided by the points' largest scale,
///         world units, positive
/// @param kept   least distance that the points should have, divided by their mean scale, world
///         units; points on opposite sides of a part thinner than a quarter of it ignore each other
[[nodiscard]] double leastDistance(std::span<const SurfacePoint> points, double reach, double kept);

}  // namespace mapping
