#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/rbf/sums/chebyshev.h"
#include "levelset/rbf/sums/cluster_tree.h"
#include "levelset/rbf/sums/rbf_sum.h"

namespace levelset::rbf {

/// Computes the RBF sum of n particles at each of these particles in about n log n operations, for
/// any kernel [Fong09]. The particles of a box are replaced by weights at its Chebyshev nodes.
/// Their sum in a distant box is evaluated at the nodes of that box and interpolated. The error has
/// no proven bound; addRbfSums() gives the exact value.
class RbfClusterSum {
 public:
  /// @param points  particles in the order of a ClusterTree, so that the tree's order() is 0, 1, 2,
  ///         …; must outlive this object
  /// @param nodes   nodes of that tree; must outlive this object
  RbfClusterSum(RbfKernel kernel, std::span<const Imath::V3d> points,
                std::span<const ClusterTree::Node> nodes);

  /// Computes Σ ω_i φ(|p_j − p_i|) for each particle j.
  [[nodiscard]] std::vector<Imath::V3d> operator()(std::span<const Imath::V3d> weights) const;

 private:
  static constexpr std::size_t kNodes = 7;  ///< number of Chebyshev nodes along each axis
  static constexpr std::size_t kCubeNodes = kNodes * kNodes * kNodes;
  using Cube = std::array<double, kCubeNodes>;
  using Cubes = std::array<Cube, 3>;  ///< values of u, v and w at the nodes of a box
  using Shift = std::array<NodeWeights<kNodes, kNodes>, 3>;

  /// Position and size of the cube of Chebyshev nodes of a box.
  struct Frame {
    Imath::V3d center, half;  ///< centre, and half edge lengths of the box; 1 in place of 0
    double radius = 0;
  };
  struct Pass;  ///< working data of one sum

  [[nodiscard]] Imath::V3d nodeOf(const Frame& frame, std::size_t node) const;
  /// Interpolation from the nodes of a box to the nodes of its child, along each axis.
  [[nodiscard]] Shift shiftTo(std::size_t parent, std::size_t child) const;
  void gather(Pass& pass) const;
  void gatherLeaf(std::size_t node, Pass& pass) const;
  void descend(std::size_t node, std::span<const std::uint32_t> candidates, const Cubes& inherited,
               Pass& pass) const;
  /// True for a leaf, and for a box with no more particles than Chebyshev nodes, which dividing
  /// would not make cheaper.
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
  std::span<const ClusterTree::Node> nodes_;
  std::vector<Frame> frames_;
};

}  // namespace levelset::rbf
