#pragma once

#include <Imath/ImathVec.h>

#include <vector>

#include "mapping/surface/surface_field.h"

namespace mapping {

/// Ways from a to b over grid points beside φ = height, so that none jumps through the solid to
/// another side: the shortest, and others that pass its middle elsewhere. Ways over a grid are up
/// to 13 % too long; the true shortest comes out of one of these once they are straightened.
/// @param a, b  on φ = height
class GeodesicSearch {
 public:
  GeodesicSearch(const SurfaceField& field, double height, const Imath::V3d& a, const Imath::V3d& b)
      : field_(field), height_(height), a_(a), b_(b) {}

  /// The shortest over the grid, by A*; empty when the surface does not join a and b.
  [[nodiscard]] std::vector<Imath::V3d> shortest() const;

  /// Ways that may come out no longer than `longest` once they are straightened, the shortest over
  /// the grid first: Dijkstra's algorithm from both ends, and the places where the two meet.
  /// @param longest  of a way that is known, world units
  [[nodiscard]] std::vector<std::vector<Imath::V3d>> alternatives(double longest) const;

 private:
  const SurfaceField& field_;
  double height_;
  Imath::V3d a_, b_;
};

}  // namespace mapping
