#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "levelset/progress.h"

/// Exact geometry of unions of balls: distances, areas and volumes.
namespace levelset {

struct Ball {
  Imath::V3d centre{0};
  double radius = 0;
};

/// A piece of a circle in which the spheres of two balls meet, and which lies inside no other ball.
/// Coordinates are relative to BallUnion::origin().
struct ExposedArc {
  Imath::V3d centre;  ///< centre of the circle
  /// Orthonormal axes. `u` points to the middle of the arc, `w` from `first` to `second`.
  Imath::V3d u, v, w;
  double radius = 0;                    ///< radius of the circle, world units
  double half = 0;                      ///< half of the angle, up to π
  double cosHalf = 0, sinHalf = 0;      ///< cosine and sine of `half`
  std::uint32_t first = 0, second = 0;  ///< indices of the balls

  /// Closest point of the arc.
  [[nodiscard]] Imath::V3d closest(const Imath::V3d& point) const;
  [[nodiscard]] double distance(const Imath::V3d& point) const;
};

/// The union of balls. Balls inside another ball are left out.
///
/// The closest point of the boundary to a point inside lies on the sphere of the ball in which the
/// point is deepest, unless another ball covers it. Then it lies on an exposed arc. So the distance
/// needs one sphere and the arcs nearby. An octree holds those that may matter in each cell.
///
/// The class has value semantics. Copies share the data. All methods may run concurrently.
class BallUnion {
 public:
  /// @param balls  finite centres, positive finite radii; at least one
  /// @param depth  distances inside are exact up to this depth, world units; deeper ones are lower
  ///        bounds above it. Finite, at least 0
  /// @throws InvalidInput for other balls or depths
  /// @throws ResourceLimit if the arcs or the octree exceed `maxBytes`
  BallUnion(std::vector<Ball> balls, double depth, std::size_t maxBytes = kNoMemoryLimit,
            const Progress& progress = {});

  /// Signed distance from the boundary, negative inside. Exact outside, and inside up to the depth.
  [[nodiscard]] double distance(const Imath::V3d& point) const;

  /// The closest point of the boundary.
  struct Foot {
    double distance = 0;   ///< signed, as distance()
    bool isExact = false;  ///< false: deeper than the depth; the other members are not set
    Imath::V3d point{0};   ///< world units
    bool isOnArc = false;  ///< true: `feature` is an arc; false: a ball
    std::uint32_t feature = 0;
  };
  [[nodiscard]] Foot closest(const Imath::V3d& point) const;
  /// Distance to the sphere of a ball, positive inside, if its closest point is exposed; or to an
  /// arc. Returns false if another ball covers the closest point.
  [[nodiscard]] bool footOn(const Foot& feature, const Imath::V3d& point, Foot& foot) const;

  [[nodiscard]] const Imath::V3d& origin() const;
  [[nodiscard]] Ball ball(std::size_t index) const;
  [[nodiscard]] const std::vector<ExposedArc>& arcs() const;
  /// Bounds of the union, world units.
  [[nodiscard]] Imath::Box3d bounds() const;
  struct Exposure {
    /// Area of each given ball's sphere outside all other balls, world units². Of equal balls the
    /// first one has it.
    std::vector<double> areas = {};
    double volume = 0;  ///< volume of the union, world units³
  };
  [[nodiscard]] Exposure exposure() const;
  /// Volume of each given ball within its cell of the power diagram of the balls, world units³. The
  /// cells divide the union, so the sum is its volume. Balls inside another ball have none.
  /// @throws ResourceLimit if that needs more than `maxBytes`
  [[nodiscard]] std::vector<double> volumes(std::size_t maxBytes = kNoMemoryLimit) const;
  /// A connected piece of the boundary.
  struct Boundary {
    double area = 0;  ///< world units²
    /// Volume that the piece encloses, world units³: positive for an outer boundary, negative for
    /// that of a cavity. Balls that float in a cavity have boundaries of their own.
    double volume = 0;
    std::vector<std::uint32_t> balls = {};  ///< balls whose spheres form the piece, sorted
  };
  /// Connected pieces of the boundary, in the order of their first arcs; spheres without arcs
  /// follow. The volumes add up to that of the union.
  /// @throws ResourceLimit if that needs more than `maxBytes`
  [[nodiscard]] std::vector<Boundary> boundaries(std::size_t maxBytes = kNoMemoryLimit) const;
  /// Memory, bytes.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

}  // namespace levelset
