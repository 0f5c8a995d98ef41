#pragma once

// Internal header of levelset: public headers must not include it.

#include <optional>
#include <vector>

#include "levelset/geometry/search/point_search.h"
#include "levelset/points/creases/crease_samples.h"

namespace levelset::points {

/// Follows the curves between two pieces.
class CreaseTracer {
 public:
  CreaseTracer(const PointSurface& divided, const std::vector<CreaseCorner>& corners,
               const PairSamples& pair);

  /// Appends the curves of the pair.
  /// @return false if more than single samples lie near no curve and no corner
  bool trace(std::vector<CreaseCurve>& curves);
  /// Returns true if the normals of one of the pieces point inwards.
  [[nodiscard]] bool isOpposed() const { return isOpposed_; }

 private:
  struct Place {
    Imath::V3d position;
    std::array<Imath::V3d, 2> normals;
    Imath::V3d tangent;
  };
  enum class End { Lost, Corner, Closed };
  struct Walk {
    std::vector<Place> places;
    End end = End::Lost;
    std::uint32_t corner = PointSurface::kNone;
  };

  [[nodiscard]] double spacingAt(const Imath::V3d& position) const;
  [[nodiscard]] std::optional<Place> next(const Place& from, double spacing) const;
  [[nodiscard]] std::uint32_t cornerBetween(const Imath::V3d& from, const Imath::V3d& to,
                                            double spacing) const;
  [[nodiscard]] Walk walk(const Place& seed) const;
  [[nodiscard]] std::optional<CreaseCurve> curveFrom(std::uint32_t sample) const;
  void endAt(std::uint32_t corner, std::vector<Place>& places) const;
  enum class Sides { Unclear, Agreed, Opposed };
  [[nodiscard]] Sides orient(CreaseCurve& curve) const;
  void cover(const CreaseCurve& curve);
  [[nodiscard]] double cornerDistance(const Imath::V3d& position) const;

  const PointSurface& surface_;
  const std::vector<CreaseCorner>& corners_;
  const PairSamples& pair_;
  std::vector<std::uint32_t> ends_;  ///< corners of the pair
  PointSearch search_;               ///< finds samples
  std::vector<bool> isCovered_;
  bool isOpposed_ = false;
};

}  // namespace levelset::points
