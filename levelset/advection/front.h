#pragma once

// Internal header of levelset: public headers must not include it.

#include <vector>

#include "levelset/advection/time_interval.h"
#include "levelset/mesh.h"

namespace levelset::flow {

/// Closed triangle surface in index space that moves with a velocity. Its vertices follow
/// characteristics, by a fifth-order Runge-Kutta method with error estimate [Cash90]. A step is
/// repeated with a shorter length when the error or the displacement of a vertex, or the strain of
/// an edge, exceeds its limit. An edge longer than a voxel is split; the new vertex lies on the
/// cubic curve that the end points and their normals define [Vlachos01]. Nothing is interpolated on
/// a grid, so the surface does not erode and keeps parts thinner than a voxel.
class Front {
 public:
  /// @param mesh  closed and two-manifold, in voxels
  /// @throws ResourceLimit when the split triangles do not fit into memory
  Front(TriMesh mesh, std::size_t maxMemory);

  /// Moves the surface over the time interval, forwards or backwards.
  /// @throws InvalidInput for a velocity that is not finite
  /// @throws ResourceLimit for too many steps or triangles
  /// @throws Cancelled
  /// @return the number of steps
  std::size_t advance(const TimeInterval& interval);

  [[nodiscard]] const TriMesh& mesh() const { return mesh_; }

 private:
  /// Computes the vertices after a step into `moved_`.
  /// @return ratio of the allowed step length to the tried one; clearly below 1: retry with a
  ///         shorter step
  double tryStep(const TimeInterval& interval, double from, double to);
  /// Returns the largest strain: change of an edge vector from `mesh_` to `moved_`, divided by the
  /// length of the edge or by kLongestEdge, whichever is longer.
  [[nodiscard]] double mostStrain() const;
  /// Returns the longest allowed first step, units of time, from the speeds of the vertices at the
  /// start.
  [[nodiscard]] double firstStep(const TimeInterval& interval) const;
  StepResult step(const TimeInterval& interval, double from, double longest);
  void splitLongEdges(std::size_t maxMemory);

  TriMesh mesh_;
  std::vector<Imath::V3d> moved_;  ///< positions of the vertices after the last tried step
  double largestArea_ = 0;         ///< largest area of the surface so far, voxels²
  bool isStill_ = false;           ///< all velocities sampled in the last tried step were zero
};

}  // namespace levelset::flow
