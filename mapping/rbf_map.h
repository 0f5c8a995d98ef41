#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <span>
#include <vector>

#include "levelset/progress.h"

/// Smooth maps from patch space to texture space through scattered particles.
namespace mapping {

struct RbfMapOptions {
  /// Relaxation of the interpolation, in mean particle spacings (kernel φ(r) = r is homogeneous of
  /// degree one): at the surface, and everywhere else. ≥ 0.
  double lambdaNear = 0.005, lambdaFar = 0.25;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

/// Φ(x) = A x + b + Σ ω_i |x − p_i|: the biharmonic spline through particles (p_i, uvw_i), smoothed
/// by φ − λ on the diagonal [Brodersen07 §8.3, with the sign of Carr01: |x| is conditionally
/// negative]. Affine maps are reproduced exactly whatever λ. Setting up takes n² doubles and n³/3
/// operations.
class RbfMap {
 public:
  /// @param points, targets  n each; @param near  n, true where lambdaNear applies
  /// @throws UsageError for λ that is negative or not finite; InvalidInput for fewer than 5 points,
  ///         points in one plane, two points in one place, numbers that are not finite, or a solve
  ///         that fails; ResourceLimit before the matrix is allocated
  RbfMap(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets,
         std::span<const char> near, const RbfMapOptions& options = {});

  [[nodiscard]] Imath::V3d operator()(const Imath::V3d& x) const;
  /// Rows are the gradients of u, v and w. At a particle, its own kink counts nothing.
  [[nodiscard]] Imath::M33d jacobian(const Imath::V3d& x) const;
  /// A number L with |Φ(x) − Φ(y)| ≤ L |x − y| for all x, y in the ball about `center`.
  [[nodiscard]] double lipschitz(const Imath::V3d& center, double radius) const;
  /// A box that holds Φ of the whole parallelepiped center ± rows of `halfAxes`.
  [[nodiscard]] Imath::Box3d imageBounds(const Imath::V3d& center,
                                         const Imath::M33d& halfAxes) const;
  /// Φ at origin + i·rows[0] + j·rows[1] + k·rows[2] for i, j, k in 0 … 7, at index 64 i + 8 j + k.
  /// Particles far from the block are summed through a polynomial of degree three in each axis
  /// whose error in u, v and w is bounded by `tolerance`; the near ones directly.
  void evaluateBlock(const Imath::V3d& origin, const Imath::M33d& rows, double tolerance,
                     std::span<Imath::V3d, 512> result) const;
  /// Largest |Φ(p_i) − uvw_i| over the particles.
  [[nodiscard]] double maxResidual() const { return maxResidual_; }
  /// Largest residual in u, v and w apart.
  [[nodiscard]] const Imath::V3d& axisResidual() const { return axisResidual_; }
  /// Mean distance of a particle to its nearest neighbour, world units.
  [[nodiscard]] double meanSpacing() const { return meanSpacing_; }
  [[nodiscard]] std::size_t size() const { return count_; }

 private:
  /// Coordinates relative to origin_, in world units, one array for each component; padded with
  /// particles of no weight to a multiple of the lane count.
  struct Particles {
    std::vector<double> x, y, z, u, v, w;
    void push(const Imath::V3d& position, const Imath::V3d& weight);
    void clear();
  };
  void solve(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets,
             std::span<const double> lambda);
  void measureResidual(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets);
  [[nodiscard]] Imath::V3d affine(const Imath::V3d& local) const;

  std::size_t count_ = 0;
  Particles particles_;
  std::vector<double> weightNorm_;  ///< |ω_i|, per particle
  Imath::V3d origin_{0};            ///< positions are taken relative to this
  Imath::M33d linear_;              ///< rows: gradients of the affine part
  Imath::V3d constant_{0};
  double maxResidual_ = 0, meanSpacing_ = 0;
  Imath::V3d axisResidual_{0};
};

}  // namespace mapping
