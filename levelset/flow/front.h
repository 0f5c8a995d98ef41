#pragma once

// For the .cpp files of levelset/flow only.

#include <functional>

#include "levelset/mesh.h"
#include "levelset/progress.h"

namespace levelset::flow {

/// Voxels per unit of time, at a place in voxels and a time. Safe to call from many threads.
using Velocity = std::function<Imath::V3d(const Imath::V3d& place, double time)>;

/// What is carried from when to when.
struct Journey {
  const Velocity& velocity;
  double from, to;
  const char* action;  ///< for messages
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// A closed surface of triangles that moves with a velocity.
///
/// Vertices follow their characteristics by the classical fourth-order Runge-Kutta method. An edge
/// that gets longer than a voxel is split; the new vertex goes onto the cubic curve that the
/// normals at the ends tell [Vlachos01]. Nothing is interpolated on a grid, so the surface neither
/// wears down nor loses what is thinner than a voxel.
class Front {
 public:
  /// @param mesh  closed and two-manifold, in voxels
  explicit Front(TriMesh mesh);

  /// Moves from one time to another, later or earlier.
  /// @throws InvalidInput for a velocity that is not finite; ResourceLimit for too many steps or
  ///         triangles; Cancelled
  /// @return the number of steps
  std::size_t advance(const Journey& journey);

  [[nodiscard]] const TriMesh& mesh() const { return mesh_; }

 private:
  [[nodiscard]] double longestStep(const Velocity& velocity, double time, const char* action) const;
  void move(const Velocity& velocity, double from, double to, const char* action);
  void splitLongEdges();

  TriMesh mesh_;
  double largestArea_ = 0;  ///< voxels²
};

/// Walks from journey.from to journey.to in steps that are short enough at their beginning, middle
/// and end, reporting progress.
/// @param longest  longest step at a time, positive or infinite
/// @param step     makes the step between two times
/// @return         the number of steps
/// @throws ResourceLimit when it sees more steps coming than anybody waits for
std::size_t walk(const Journey& journey, const std::function<double(double)>& longest,
                 const std::function<void(double, double)>& step);

/// @throws InvalidInput, telling place and time, unless the velocity is finite
void requireFinite(const Imath::V3d& velocity, const Imath::V3d& place, double time,
                   const char* action);

}  // namespace levelset::flow
