#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "levelset/progress.h"
#include "levelset/rbf/sums/rbf_kernel.h"

namespace levelset::rbf {

/// Options of a radial basis function.
struct RbfOptions {
  RbfKernel kernel = RbfKernel::Biharmonic;
  /// Relaxation λ ≥ 0 of the particles at the surface (lambdaNear) and of all others (lambdaFar).
  /// It is added to the diagonal of the matrix of ±φ(r), with φ the kernel and r the distance of
  /// two particles in mean particle spacings. For φ(r) = r, λ is a length in mean particle
  /// spacings; decaying kernels have φ(0) = 1.
  double lambdaNear = 0.005, lambdaFar = 0.25;
  /// Support radius of a compact kernel, mean particle spacings, > 1. A larger radius reduces the
  /// error and increases the time, in proportion to its cube.
  double support = 4;
  /// Largest number of particles for a direct solution. Above it, or if the matrix factors exceed
  /// maxMemory, the system is solved iteratively. Systems of at most 500 particles are always
  /// solved directly.
  std::size_t denseLimit = 10000;
  /// Tolerance of the iterative solver: largest residual of a component, as a share of the extent
  /// of the particles' values.
  double solveTolerance = 1e-6;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Properties of the particles of a radial basis function, and how the linear system of its
/// weights was solved.
struct RbfSolveReport {
  std::size_t merged = 0;    ///< particles with the position and target of another
  std::size_t averaged = 0;  ///< particles with the position of another but a different target
  int directions = 3;        ///< dimension of the particles' span: 3, 2 in a plane, 1 on a line
  /// Estimated condition number of the system, restricted to weights orthogonal to the linear
  /// polynomials, in the 1-norm. For an iterative solution: of the preconditioned system, in the
  /// 2-norm on the Krylov space. 0: nothing was solved.
  double condition = 0;
  bool isRegularized = false;  ///< true: the diagonal of the matrix was increased beyond λ
  bool isIterative = false;
  std::size_t iterations = 0;  ///< iterations of the Krylov method
  /// Largest residual of the linear system in u, v, w; excludes the deviation due to λ.
  double solveResidual = 0;
  std::vector<std::string> notes;  ///< messages for the user, one sentence each
};

/// Particles of a radial basis function as the solver uses them: one for each position, in units
/// of `unit` relative to their centre. Targets are their values, and `lambda` their relaxation λ.
struct RbfCloud {
  std::vector<Imath::V3d> points, targets;
  std::vector<double> lambda;
  Imath::V3d origin{0};
  /// Mean distance to the nearest neighbour, world units; 1 for a single particle.
  double spacing = 1;
  /// Unit of the points, world units: the mean spacing, or the support radius of a compact
  /// kernel.
  double unit = 1;
  double extent = 0;  ///< largest |coordinate| of the points
  /// Orthonormal axes; the points span the first `directions` of them.
  std::array<Imath::V3d, 3> axes{Imath::V3d(1, 0, 0), Imath::V3d(0, 1, 0), Imath::V3d(0, 0, 1)};
  int directions = 0;
};

/// Merges and normalises the particles. Particles closer than 1e-9 of the cloud's size are merged
/// into one, which gets the mean of their targets. A direction in which the cloud is thinner than
/// 1e-6 of its size is not counted in `directions`.
/// @throws UsageError for λ that is negative or not finite, and a support radius of a compact
/// kernel
///         that is not finite or does not exceed one mean particle spacing
/// @throws InvalidInput for no points, numbers that are not finite, and coincident points whose
///         targets differ by more than those of nearest neighbours do on average
[[nodiscard]] RbfCloud makeRbfCloud(std::span<const Imath::V3d> points,
                                    std::span<const Imath::V3d> targets, std::span<const char> near,
                                    const RbfOptions& options, RbfSolveReport& report);

}  // namespace levelset::rbf
