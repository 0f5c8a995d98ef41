#pragma once

// Internal header of levelset: public headers must not include it.

#include <vector>

#include "levelset/advection/time_interval.h"
#include "levelset/mesh.h"

namespace levelset::flow {

/// Closed triangle surface that moves with a velocity.
/// Vertices follow their characteristics with a fifth-order Runge-Kutta method with error estimate
/// [Cash90]. A step is repeated with a shorter length when a vertex exceeds the limits of error or
/// move, or when an edge exceeds the limit of strain. An edge longer than a voxel is split; the new
/// vertex goes onto the cubic curve defined by the normals at the ends [Vlachos01]. Nothing is
/// interpolated on a grid, so the surface does not erode and keeps parts thinner than a voxel.
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
  /// @return allowed share of the step; 1 or more accepts the step
  double tryStep(const TimeInterval& interval, double from, double to);
  /// Returns the largest change of an edge from the mesh to `moved_`, as a share of its length or
  /// of kLongestEdge.
  [[nodiscard]] double mostStrain() const;
  /// Returns the longest first step, from the speeds at the start.
  [[nodiscard]] double firstStep(const TimeInterval& interval) const;
  StepResult step(const TimeInterval& interval, double from, double longest);
  void splitLongEdges(std::size_t maxMemory);

  TriMesh mesh_;
  std::vector<Imath::V3d> moved_;  ///< vertices after the step that was tried last
  double largestArea_ = 0;         ///< largest area so far, voxels²
  bool isStill_ = false;           ///< nothing moved in the step that was tried last
};

}  // namespace levelset::flow
