#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace render {

/// Rational Bézier curve in the plane of the parameters of a surface. Two points are a segment.
struct TrimCurve {
  std::vector<Imath::V2d> points = {};  ///< control points, 2 to 21
  std::vector<double> weights = {};     ///< positive; empty: all are 1

  friend bool operator==(const TrimCurve&, const TrimCurve&) = default;
};
/// Closed curve: each curve ends where the next one begins, and the last one where the first one
/// begins.
using TrimLoop = std::vector<TrimCurve>;
/// Loop of segments between points. The last one leads to the first point.
[[nodiscard]] TrimLoop polylineLoop(const std::vector<Imath::V2d>& points);

/// Part of the plane of parameters that loops enclose. A point belongs to it if a ray from the
/// point crosses the loops an odd number of times (even-odd rule), so directions of loops do not
/// matter.
///
/// Curves are divided into pieces along which v rises or falls. A ray along u crosses a piece if
/// its ends lie on different sides of the ray. The ends of adjacent pieces have the same bits, so
/// no ray passes between two pieces. For segments the side of a point is exact.
class TrimRegion {
 public:
  /// @throws levelset::InvalidInput for an empty loop, a loop that is not closed, a wrong number of
  ///         points or weights, numbers that are not finite or above 1e6, and weights outside
  ///         [1e-6, 1e6]
  explicit TrimRegion(std::vector<TrimLoop> loops);

  [[nodiscard]] const std::vector<TrimLoop>& loops() const { return loops_; }
  [[nodiscard]] bool contains(const Imath::V2d& point) const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  /// Part of a curve along which v rises or falls.
  struct Piece {
    Imath::V2d from, to;                    ///< ends
    double uMin = 0, uMax = 0;              ///< range of the control points
    std::vector<Imath::V3d> controls = {};  ///< homogeneous: (w u, w v, w); empty: a segment
  };
  void addCurve(const TrimCurve& curve, const Imath::V2d& end);
  void addMonotone(std::vector<Imath::V3d> controls, const Imath::V2d& from, const Imath::V2d& to,
                   int level);
  void makeRows();
  [[nodiscard]] std::size_t rowOf(double v) const;

  std::vector<TrimLoop> loops_;
  std::vector<Piece> pieces_;
  double vMin_ = 0, vMax_ = 0;
  /// Numbers of the pieces in rows of equal height between vMin_ and vMax_.
  std::vector<std::vector<std::uint32_t>> rows_;
};

/// Independent test, to check TrimRegion: the winding numbers of the loops, by the angles under
/// which a point sees parts of the curves. A part whose control points lie on one side of the point
/// is seen under the angle of its ends; others are halved. @return true if the sum of the winding
/// numbers is odd
[[nodiscard]] bool judgedContains(const std::vector<TrimLoop>& loops, const Imath::V2d& point);

}  // namespace render
