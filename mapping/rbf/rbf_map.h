#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <memory>
#include <span>

#include "levelset/rbf/rbf_function.h"
#include "mapping/maps/patch_map.h"

/// Smooth maps from world positions to texture coordinates, through scattered particles.
namespace mapping {

using levelset::rbf::RbfKernel;
using levelset::rbf::RbfSolveReport;
/// Relaxation, kernel and solver of a map. The values of the particles are their texture
/// coordinates.
using RbfMapOptions = levelset::rbf::RbfOptions;

/// The map of a radial basis function, see levelset::rbf::RbfFunction. It does not depend on the
/// unit of length, nor on the position and orientation of the patch.
class RbfMap final : public PatchMap {
 public:
  /// Builds the map.
  /// @param points, targets  n positions in world units, and their n texture coordinates
  /// @param near  n values; true for particles with lambdaNear
  /// @throws UsageError, InvalidInput, ResourceLimit, NumericalError as RbfFunction does
  RbfMap(std::span<const Imath::V3d> points, std::span<const Imath::V3d> targets,
         std::span<const char> near, const RbfMapOptions& options = {});

  [[nodiscard]] Imath::V3d operator()(const Imath::V3d& x) const override;
  /// Jacobian of the map. At a particle the particle's own term adds nothing; for φ(r) = r it has
  /// no derivative there.
  [[nodiscard]] Imath::M33d jacobian(const Imath::V3d& x) const override;
  [[nodiscard]] std::unique_ptr<BlockMap> restrictTo(const GridBlock& block,
                                                     double tolerance) const override;
  [[nodiscard]] const levelset::rbf::RbfFunction& function() const { return function_; }
  /// Largest |Φ(p_i) − uvw_i| over the particles.
  [[nodiscard]] double maxResidual() const { return function_.maxResidual(); }
  /// Largest residual over the particles, for u, v and w separately.
  [[nodiscard]] const Imath::V3d& axisResidual() const { return function_.axisResidual(); }
  /// Mean distance of a particle to its nearest neighbour, world units; 1 for a single particle.
  [[nodiscard]] double meanSpacing() const { return function_.meanSpacing(); }
  /// Number of particles; coincident ones count once.
  [[nodiscard]] std::size_t size() const { return function_.particles().size(); }
  [[nodiscard]] const RbfSolveReport& solveReport() const { return function_.solveReport(); }
  [[nodiscard]] RbfKernel kernel() const { return function_.kernel(); }

 private:
  levelset::rbf::RbfFunction function_;
};

}  // namespace mapping
