#pragma once

#include <Imath/ImathVec.h>

#include <vector>

#include "mapping/surface/surface_field.h"

namespace mapping {

/// Finds paths from a to b over grid points beside φ = height, so that no path jumps through the
/// solid to another side. It finds the shortest path, and other paths whose middle points are away
/// from it. Paths over a grid are up to 13 % too long; the true shortest path results from
/// straightening one of them.
/// @param a, b  ends of the paths, on φ = height
class GeodesicSearch {
 public:
  GeodesicSearch(const SurfaceField& field, double height, const Imath::V3d& a, const Imath::V3d& b)
      : field_(field), height_(height), a_(a), b_(b) {}

  /// Shortest path over the grid, by A*; empty if the surface does not connect a and b.
  [[nodiscard]] std::vector<Imath::V3d> shortest() const;

  /// Paths that may become no longer than `longest` when they are straightened, the shortest grid
  /// path first. Runs Dijkstra's algorithm from both ends and joins the halves where they meet.
  /// @param longest  length of the shortest path found so far, world units
  [[nodiscard]] std::vector<std::vector<Imath::V3d>> alternatives(double longest) const;

 private:
  const SurfaceField& field_;
  double height_;
  Imath::V3d a_, b_;
};

}  // namespace mapping
