#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <optional>
#include <span>

namespace levelset {

/// Signed distance to an interface near a point, as a quadratic polynomial. Index coordinates.
struct InterfaceFit {
  static constexpr std::size_t kTerms = 10;

  Imath::V3d about = Imath::V3d(0);
  std::array<double, kTerms> c{};

  [[nodiscard]] double value(const Imath::V3d& p) const;
  [[nodiscard]] Imath::V3d gradient(const Imath::V3d& p) const;
};

/// Distance of a grid point from an interface, voxels, negative on one side.
struct InterfaceSample {
  Imath::V3d position;
  double distance;
};

/// Fewest samples of a fit.
inline constexpr std::size_t kFewestSamples = 5;

/// Fits a polynomial to distances near a point. Samples that disagree with most of the others count
/// little: they may be closest to the end of the interface, or lie beyond a crease.
/// @return empty for fewer than kFewestSamples, or when most of them disagree
[[nodiscard]] std::optional<InterfaceFit> fitInterface(const Imath::V3d& about,
                                                       std::span<const InterfaceSample> samples);

/// Limits of a point in which interfaces meet, voxels.
struct MeetingLimits {
  double farthest = 1.5;  ///< from where the interfaces were fitted
  double miss = 0.1;      ///< from each interface
};

/// Finds the point on all of the interfaces that is closest to `start`.
/// @return empty when two or more interfaces are nearly parallel or do not meet, or the point
///         exceeds the limits
[[nodiscard]] std::optional<Imath::V3d> meetingPoint(std::span<const InterfaceFit> interfaces,
                                                     const Imath::V3d& start,
                                                     const MeetingLimits& limits = {});

}  // namespace levelset
