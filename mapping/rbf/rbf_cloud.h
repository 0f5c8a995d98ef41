#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace mapping {

struct RbfMapOptions;

/// What was found out about the particles of an RBF map, and what was done about it.
struct RbfSolveReport {
  std::size_t merged = 0;    ///< particles that shared the place and target of another
  std::size_t averaged = 0;  ///< that shared the place of another with a target of its own
  int directions = 3;        ///< in which the particles spread: 3, 2 in a plane, 1 on a line
  /// 1-norm condition of the system orthogonal to the polynomials, estimated; of the preconditioned
  /// system, 2-norm and on the space searched, if that was solved by iteration. 0: nothing solved.
  double condition = 0;
  bool isRegularized = false;  ///< was something added to the diagonal beside λ?
  bool isIterative = false;
  std::size_t iterations = 0;      ///< of the Krylov method
  double solveResidual = 0;        ///< of the linear system, u, v, w; not what λ stands off
  std::vector<std::string> notes;  ///< what somebody who maps should know, sentences
};

/// The particles of an RBF map as they are solved for: each place once, in mean particle spacings
/// about their centre.
struct RbfCloud {
  std::vector<Imath::V3d> points, targets;
  std::vector<double> lambda;
  Imath::V3d origin{0};
  double spacing = 1;  ///< mean distance of a particle to its nearest neighbour, world; 1 for one
  double extent = 0;   ///< of the points, largest |coordinate|
  /// Orthonormal; along the first `directions` of them the points spread.
  std::array<Imath::V3d, 3> axes{Imath::V3d(1, 0, 0), Imath::V3d(0, 1, 0), Imath::V3d(0, 0, 1)};
  int directions = 0;
};

/// Particles nearer to each other than 1e-9 of the cloud's size are one, at the mean of their
/// targets. A direction across which the cloud is thinner than 1e-6 of its size counts as missing.
/// @throws UsageError for λ that is negative or not finite; InvalidInput for no points, numbers
///         that are not finite, and points in one place whose targets are further apart than those
///         of neighbours
[[nodiscard]] RbfCloud makeRbfCloud(std::span<const Imath::V3d> points,
                                    std::span<const Imath::V3d> targets, std::span<const char> near,
                                    const RbfMapOptions& options, RbfSolveReport& report);

}  // namespace mapping
