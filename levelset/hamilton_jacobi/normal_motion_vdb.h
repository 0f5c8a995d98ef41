#pragma once

// Internal header of levelset: public headers must not include it.

#include <functional>

#include "levelset/hamilton_jacobi/upwind_derivative.h"
#include "levelset/vdb.h"

namespace levelset::flow {

/// F and G of φ_t + F |∇φ| = G at a grid point.
struct NormalTerms {
  double speed = 0;   ///< F, world units per unit of time
  double source = 0;  ///< G, world units per unit of time
};

/// Motion of a front along its normals: φ_t + F |∇φ| = G, where F and G depend on φ and on a second
/// field.
struct NormalMotion {
  const openvdb::FloatGrid& field;  ///< the second field, with all leaves of φ
  std::function<NormalTerms(double phi, double field)> terms;
  /// |φ| jumps to the background beyond the active grid points. Stencils that reach there are then
  /// of first order, because higher orders overshoot.
  bool endsWithJump = false;
};

/// Computes one step on the active grid points with Godunov's gradient. Other grid points keep
/// their values.
/// @param dt  step, units of time; at most voxel / (√3 |F|) for stability
[[nodiscard]] openvdb::FloatGrid::Ptr normalStep(const openvdb::FloatGrid& start,
                                                 const NormalMotion& motion,
                                                 const UpwindOrders& orders, double dt);

}  // namespace levelset::flow
