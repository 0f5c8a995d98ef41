#pragma once

// Internal header of levelset: public headers must not include it.

#include <vector>

#include "levelset/flow/time_interval.h"
#include "levelset/mesh.h"

namespace levelset::flow {

/// A closed surface of triangles that moves with a velocity.
///
/// Vertices follow their characteristics by a Runge-Kutta method of fifth order that tells its own
/// error [Cash90]; a step in which any of them errs, moves or stretches its surroundings by too
/// much is made again, shorter. An edge that gets longer than a voxel is split; the new vertex goes
/// onto the cubic curve that the normals at the ends tell [Vlachos01]. Nothing is interpolated on a
/// grid, so the surface neither wears down nor loses what is thinner than a voxel.
class Front {
 public:
  /// @param mesh  closed and two-manifold, in voxels
  /// @throws ResourceLimit
  Front(TriMesh mesh, std::size_t maxMemory, const char* action);

  /// Moves from one time to another, later or earlier.
  /// @throws InvalidInput for a velocity that is not finite; ResourceLimit for too many steps or
  ///         triangles; Cancelled
  /// @return the number of steps
  std::size_t advance(const TimeInterval& interval);

  [[nodiscard]] const TriMesh& mesh() const { return mesh_; }

 private:
  /// Puts the vertices of a step into `moved_`.
  /// @return the share of the step that would be allowed, 1 and more: all of it
  double tryStep(const TimeInterval& interval, double from, double to);
  /// How much the edges change on the path to `moved_`, as a share of their lengths or the longest.
  [[nodiscard]] double mostStrain() const;
  /// How long the first step may be, by the speeds at the start.
  [[nodiscard]] double firstStep(const TimeInterval& interval) const;
  StepResult step(const TimeInterval& interval, double from, double longest);
  void splitLongEdges(std::size_t maxMemory, const char* action);

  TriMesh mesh_;
  std::vector<Imath::V3d> moved_;  ///< where a step would bring the vertices
  double largestArea_ = 0;         ///< that it has had, voxels²
  bool isStill_ = false;           ///< nothing moved in the last step that was tried
};

}  // namespace levelset::flow
