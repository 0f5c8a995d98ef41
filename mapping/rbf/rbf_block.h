#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "levelset/rbf/rbf_function.h"
#include "mapping/maps/patch_map.h"

namespace mapping {

/// A radial basis function restricted to a block of grid points. Particles far from the block are
/// summed into a polynomial of degree five in each axis, given by its values at Chebyshev nodes.
/// Octants inherit the polynomial, so each particle is summed once for a large neighbourhood. Near
/// particles are summed at the grid points. The polynomial's error is bounded particle by particle,
/// and the sum of the bounds stays below the tolerance.
class RbfBlock final : public BlockMap {
 public:
  RbfBlock(const levelset::rbf::RbfFunction& function, const GridBlock& block, double tolerance);

  [[nodiscard]] Imath::Box3d imageBounds() const override;
  [[nodiscard]] std::unique_ptr<BlockMap> octant(int bits) const override;
  std::size_t evaluate(std::span<Imath::V3d, 512> uvw) const override;

  /// Number of particles that are summed at the grid points.
  [[nodiscard]] std::size_t nearCount() const { return near_.size(); }

 private:
  static constexpr std::size_t kNodes = 6;  ///< Chebyshev nodes along each axis
  static constexpr std::size_t kCubeNodes = kNodes * kNodes * kNodes;
  /// Parts of u, v and w at the Chebyshev nodes, summed over the particles in the polynomial.
  using Values = std::array<std::array<double, kCubeNodes>, 3>;

  RbfBlock(const RbfBlock& parent, int bits);
  /// Adds the candidates (indices of particles) that are far enough from the block to the
  /// polynomial, and the others to `near_`.
  void chooseFar(std::span<const std::uint32_t> candidates);
  /// Returns the far candidates and adds the others to `near_`.
  template <typename Kernel>
  std::vector<std::uint32_t> split(Kernel kernel, std::span<const std::uint32_t> candidates);
  void sumFar(std::span<const std::uint32_t> far);
  template <typename Kernel>
  [[nodiscard]] Imath::Box3d boundsFor(Kernel kernel) const;

  const levelset::rbf::RbfFunction& function_;
  GridBlock block_;  ///< grid points, in the unit and relative to the origin of the function
  double tolerance_;
  double error_ = 0;  ///< error bound of the polynomial, in u, v and w
  Values far_{};
  std::vector<std::uint32_t> near_;
};

}  // namespace mapping
