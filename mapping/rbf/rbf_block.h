#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "mapping/maps/patch_map.h"
#include "mapping/rbf/rbf_map.h"

namespace mapping {

/// An RbfMap on a block: particles far from it are summed as a polynomial of degree five in each
/// axis at Chebyshev nodes, which the octants inherit, so that each particle is summed once for a
/// whole neighbourhood; the near ones are left to the grid points themselves. The polynomial's
/// error is bounded, particle by particle, and the sum of the bounds stays below the tolerance.
class RbfBlock final : public BlockMap {
 public:
  RbfBlock(const RbfMap& map, const GridBlock& block, double tolerance);

  [[nodiscard]] Imath::Box3d imageBounds() const override;
  [[nodiscard]] std::unique_ptr<BlockMap> octant(int bits) const override;
  std::size_t evaluate(std::span<Imath::V3d, 512> uvw) const override;

  /// How many particles are left to the grid points.
  [[nodiscard]] std::size_t nearCount() const { return near_.size(); }

 private:
  static constexpr std::size_t kNodes = 6;  ///< along an axis
  static constexpr std::size_t kCubeNodes = kNodes * kNodes * kNodes;
  using Values = std::array<std::array<double, kCubeNodes>, 3>;  ///< of u, v and w at the nodes

  RbfBlock(const RbfBlock& parent, int bits);
  /// Moves particles that are far enough from `near_` into the polynomial.
  void chooseFar(std::span<const std::uint32_t> candidates);
  /// The far ones of the candidates; the others go to `near_`.
  template <typename Kernel>
  std::vector<std::uint32_t> split(Kernel kernel, std::span<const std::uint32_t> candidates);
  void sumFar(std::span<const std::uint32_t> far);
  template <typename Kernel>
  [[nodiscard]] Imath::Box3d boundsFor(Kernel kernel) const;

  const RbfMap& map_;
  GridBlock block_;  ///< in mean particle spacings about the map's origin
  double tolerance_;
  double error_ = 0;  ///< of the polynomial, so far
  Values far_{};
  std::vector<std::uint32_t> near_;
};

}  // namespace mapping
