#pragma once

// Private to the ray casting of Bézier volumes: nodes of the shared subdivision tree.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/bezier/bezier_view.h"
#include "render/bezier/bezier_volume.h"

namespace render {

/// Homogeneous components of a control point in the frame of a view. A weight w multiplies each of
/// them: w (p − eye)·right, w (p − eye)·down, w depth, w (attribute − isovalue), w. In perspective
/// the depth is the weight of the projected point, so the projected attribute keeps its zero set.
/// Polynomial patches in perspective need no fifth component.
enum NodeComponent : int { kAcross = 0, kDown = 1, kDepth = 2, kValue = 3, kWeight = 4 };

/// Value and derivatives of the components by the parameters u, v and w.
template <int N>
struct NodeJet {
  std::array<double, N> value, slope[3];
};

/// Position of a node.
struct NodePlace {
  std::uint32_t patch = 0, attribute = 0;
  int level = 0;                           ///< number of halvings
  std::array<std::uint32_t, 3> cell = {};  ///< position in the patch, in edges of this level

  [[nodiscard]] double edge() const;  ///< edge length in the parameters of the patch
};

/// A part of a patch, as the map of a unit cube of local parameters.
struct TreeNode : NodePlace {
  std::array<int, 3> degree{};
  std::vector<double> points = {};  ///< N components for each control point

  double depthMin = 0, depthMax = 0;  ///< range of depths
  /// Lower bound of the depths of roots that Newton's method finds in the node and below it. It is
  /// less than depthMin by rounding errors and by the tolerance of faces. So the nearest root does
  /// not depend on the order in which nodes are visited.
  double leastDepth = 0;
  /// True if the hull of the control points crosses the plane of the eye, where projections have
  /// no bounds. Then only the members above are set.
  bool crossesEye = false;
  double left = 0, right = 0, top = 0, bottom = 0;  ///< box of screen positions

  /// Box along the axes of the inverse Jacobian at the centre. With the constraints
  /// F = (X − x W, Y − y W, A) of a screen position (x, y), G = inverse · F is close to the
  /// identity. At position `centre` + δ, G_r = g_r − s_r W with s_r = inverse_r · (δ, 0), and the
  /// quotients of the control points of g_r and W lie between `low` and `high`.
  bool hasFrame = false;
  Imath::V2d centre{0, 0};
  double inverse[3][3] = {};
  double low[3] = {}, high[3] = {};
  double middle[3] = {};  ///< g at the centre of the cube
  double weight = 1;      ///< W at the centre of the cube
  /// True if each screen position has at most one root: the rows of ∂G/∂u are diagonally dominant
  /// everywhere in the cube, for all positions whose slabs overlap.
  bool isUnique = false;
  double least[3] = {};      ///< lower bounds of ∂G_r/∂u_r
  double across[3][3] = {};  ///< bounds of |∂G_r/∂u_c|, r ≠ c
};

/// Largest magnitudes of the components of a whole patch. Rounding errors of nodes are relative to
/// them.
struct ComponentScale {
  std::array<double, 5> most{};
};

/// Deepest level of a tree. Edges are then 6e-8 of those of the patch, and the errors of oriented
/// boxes, of second order, reach the rounding errors.
inline constexpr int kDeepestLevel = 24;

/// Operations on nodes with N components: 4 for polynomial patches in perspective, 5 otherwise.
template <int N>
struct TreeNodes {
  /// Transforms a patch, with one attribute, to a view.
  /// @return false if no visible part of the surface can be in the patch
  static bool root(const BezierVolume& volume, std::uint32_t patch, std::uint32_t attribute,
                   const BezierView& view, TreeNode& node, ComponentScale& scale);
  /// Views a node of world space, from a BezierView(), along a ray. @param worldScale  of that node
  /// @return as root()
  static bool turned(const TreeNode& world, const ComponentScale& worldScale,
                     const BezierView& view, TreeNode& node,
                     ComponentScale& scale) requires(N == 5);
  /// Sets the ranges of depths and screen positions.
  /// @return false if no visible part of the surface can be in the node
  static bool bound(TreeNode& node, const BezierView& view, const ComponentScale& scale);
  /// Sets the oriented box. @pre bound() has returned true
  static void addFrame(TreeNode& node, const BezierView& view, const ComponentScale& scale);
  /// Sets TreeNode::isUnique and the bounds of the derivatives. @pre addFrame()
  static void prove(TreeNode& node, const BezierView& view);
  /// Splits a node into eight, and bounds those that may have a part of the surface.
  /// @param children  at least eight nodes, whose memory is used again
  /// @return number of children
  static std::size_t split(const TreeNode& node, const BezierView& view,
                           const ComponentScale& scale, TreeNode* children,
                           std::vector<double>& scratch);
  static NodeJet<N> jet(const TreeNode& node, const std::array<double, 3>& u);
  /// Returns false if no root of the screen position can be in a node that crosses the plane of
  /// the eye.
  static bool mayCross(const TreeNode& node, const BezierView& view, const Imath::V2d& screen);
};

extern template struct TreeNodes<4>;
extern template struct TreeNodes<5>;

}  // namespace render
