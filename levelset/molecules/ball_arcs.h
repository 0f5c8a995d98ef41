#pragma once

// Private to unions of balls: overlaps of balls, and the exposed arcs of their spheres.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/molecules/ball_union.h"

namespace levelset {

/// Lists of indices, one for each ball.
struct BallLists {
  std::vector<std::size_t> first;  ///< list n: from items[first[n]] to before items[first[n + 1]]
  std::vector<std::uint32_t> items;

  [[nodiscard]] const std::uint32_t* begin(std::size_t ball) const {
    return items.data() + first[ball];
  }
  [[nodiscard]] const std::uint32_t* end(std::size_t ball) const {
    return items.data() + first[ball + 1];
  }
};

/// Finds the balls whose spheres a ball's sphere meets, those that cover most of it first. Balls
/// inside another ball have an empty list and are in no other one. Balls that touch do not meet.
/// @param isHidden  receives 1 for balls inside another ball
/// @throws ResourceLimit if the lists exceed `maxBytes`
[[nodiscard]] BallLists overlapsOf(const std::vector<Ball>& balls, std::vector<char>& isHidden,
                                   std::size_t maxBytes, const Progress& progress);

/// Finds the arcs of the circles in which two spheres meet that lie inside no other ball.
/// @param overlaps  from overlapsOf()
/// @throws ResourceLimit if the arcs exceed `maxBytes`
[[nodiscard]] std::vector<ExposedArc> exposedArcs(const std::vector<Ball>& balls,
                                                  const BallLists& overlaps, std::size_t maxBytes,
                                                  const Progress& progress);

/// Returns true if a point of the sphere of a ball lies inside another ball. Points within rounding
/// errors of the other sphere do not.
[[nodiscard]] bool isCovered(const std::vector<Ball>& balls, const BallLists& overlaps,
                             std::uint32_t ball, const Imath::V3d& point);

/// Integrals over the exposed part of the sphere of a ball.
struct ExposedPart {
  double area = 0;       ///< world units²
  Imath::V3d normal{0};  ///< integral of the outward unit normal, world units²
};
/// @param arcs  all arcs of the ball's sphere
[[nodiscard]] ExposedPart exposedPart(const std::vector<Ball>& balls, const BallLists& overlaps,
                                      std::uint32_t ball,
                                      const std::vector<const ExposedArc*>& arcs);

/// Adds the integrals along an arc that give the exposed part of the sphere of a ball.
/// @param pole  unit vector. −pole, seen from the centre, is outside the part
void addArc(const Ball& own, std::uint32_t ball, const ExposedArc& arc, const Imath::V3d& pole,
            double& sum, Imath::V3d& normal);

/// Volume of each ball within its cell of the power diagram, world units³. The cells divide the
/// union.
[[nodiscard]] std::vector<double> powerVolumes(const std::vector<Ball>& balls,
                                               const BallLists& overlaps,
                                               const std::vector<double>& areas);

/// Finds the connected pieces of the boundary of a union.
[[nodiscard]] std::vector<BallUnion::Boundary> boundariesOf(const std::vector<Ball>& balls,
                                                            const std::vector<char>& isHidden,
                                                            const BallLists& overlaps,
                                                            const std::vector<ExposedArc>& arcs);

}  // namespace levelset
