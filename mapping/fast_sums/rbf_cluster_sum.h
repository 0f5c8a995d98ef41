#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mapping/fast_sums/chebyshev.h"
#include "mapping/fast_sums/cluster_tree.h"
#include "mapping/fast_sums/rbf_sum.h"

namespace mapping {

/// Sums over all particles at all particles in about n log n operations, to some digits: what is
/// far from a box of the tree stands as weights at its Chebyshev nodes and is felt as values at
/// those of another box [Fong09], for any kernel. The error is not bounded; compare with
/// addRbfSums.
class RbfClusterSum {
 public:
  /// @param points  in the order of their tree, whose order() is 0, 1, 2, …; both are referred to
  RbfClusterSum(RbfKernel kernel, std::span<const Imath::V3d> points,
                std::span<const PointTree::Node> nodes);

  /// Σ ω_i φ(|p_j − p_i|) for each particle j.
  [[nodiscard]] std::vector<Imath::V3d> operator()(std::span<const Imath::V3d> weights) const;

 private:
  static constexpr std::size_t kNodes = 7;  ///< along an axis
  static constexpr std::size_t kCubeNodes = kNodes * kNodes * kNodes;
  using Cube = std::array<double, kCubeNodes>;
  using Cubes = std::array<Cube, 3>;  ///< of u, v and w
  using Shift = std::array<NodeWeights<kNodes, kNodes>, 3>;

  /// Where a box has its nodes.
  struct Frame {
    Imath::V3d center, half;  ///< edges of no length have half of 1
    double radius = 0;
  };
  struct Pass;  ///< what one sum works on

  [[nodiscard]] Imath::V3d nodeOf(const Frame& frame, std::size_t node) const;
  /// From the nodes of a box to those of its child, in each axis.
  [[nodiscard]] Shift shiftTo(std::size_t parent, std::size_t child) const;
  void gather(Pass& pass) const;
  void gatherLeaf(std::size_t node, Pass& pass) const;
  void descend(std::size_t node, std::span<const std::uint32_t> candidates, const Cubes& inherited,
               Pass& pass) const;
  /// Has a box no more particles than nodes, so that it is not worth dividing?
  [[nodiscard]] bool isBottom(std::size_t node) const {
    return nodes_[node].isLeaf() || nodes_[node].count() <= kCubeNodes;
  }
  [[nodiscard]] bool isFar(std::size_t a, std::size_t b) const;
  void chooseSources(std::size_t node, std::span<const std::uint32_t> candidates,
                     std::vector<std::uint32_t>& sources, std::vector<std::uint32_t>& rest) const;
  void addSources(std::size_t node, std::vector<std::uint32_t>& sources) const;
  void sumLeaf(std::size_t node, std::span<const std::uint32_t> sources, const Cubes& inherited,
               Pass& pass) const;

  RbfKernel kernel_;
  std::span<const Imath::V3d> points_;
  std::span<const PointTree::Node> nodes_;
  std::vector<Frame> frames_;
};

}  // namespace mapping
