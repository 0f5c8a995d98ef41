#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/fields/field.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// Points spread evenly over a surface.
namespace mapping {

struct ScatterDensity {
  std::size_t count = 0;  ///< how many points; 0: as many as `distance` leaves room for
  double distance = 0;    ///< least distance of two points, world units; 0: as `count` allows
  levelset::ScalarField scale = {};   ///< multiplies distances at a place, positive; empty: 1
  levelset::ScalarField weight = {};  ///< 0 where no point may lie, 1 where any; empty: 1
  std::uint64_t seed = 1;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

struct SurfacePoint {
  Imath::V3d position, normal;  ///< on the zero set; unit, outwards
  double scale = 1;
};

struct ScatteredPoints {
  /// Best first: where more than `count` are asked for, those behind fill gaps that appear when
  /// some in front are given up.
  std::vector<SurfacePoint> points;
  std::size_t wanted = 0;  ///< the first so many are the answer
  double distance = 0;     ///< no two of them, in scales, are nearer to each other; world units
};

/// Poisson-disc sampling of the zero set. Candidates are spread by area; with a distance they are
/// taken in random order unless one that was taken is too near, with a count the most crowded are
/// given up until so many are left [Yuksel15]. Distances are those along a surface that turns
/// evenly between two points and their normals [Bowers10]; the two sides of what is thinner than a
/// quarter of the distance that is kept do not see each other. The same seed gives the
/// same points.
/// @throws UsageError unless exactly one of count and distance is positive, or for a scale that is
///         not positive and finite, telling where; InvalidInput for a base without a surface or a
///         weight that leaves no place; ResourceLimit for more than a million points
[[nodiscard]] ScatteredPoints scatterPoints(const levelset::NarrowBand& base,
                                            const ScatterDensity& density);

/// How far it is from one point to another along a surface that turns evenly from normal to normal;
/// infinite where it turns by more than 120° within `thin`, world units: on the other side.
[[nodiscard]] double surfaceDistance(const SurfacePoint& a, const SurfacePoint& b, double thin);

/// The least of any two in units of their mean scale; infinite where none see each other.
/// @param reach  what is further apart does not count, in scales, positive
/// @param kept   the two sides of what is thinner than a quarter of it do not see each other
[[nodiscard]] double leastDistance(std::span<const SurfacePoint> points, double reach, double kept);

}  // namespace mapping
