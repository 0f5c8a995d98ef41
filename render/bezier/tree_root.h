#pragma once

// Private to the ray casting of Bézier volumes: roots of rays, their order, and duplicates.

#include <Imath/ImathVec.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "render/bezier/shared_tree.h"
#include "render/bezier/tree_node.h"

namespace render {

// Roots of one patch closer than this in its parameters are one. Newton's method gives the same
// root to 1e-12.
inline constexpr double kSameRoot = 1e-10;
// Singular roots are nodes of the deepest level that touch one root, or a line of parameters that
// collapses to one point. They are one at this share of the depth.
inline constexpr double kSameSingularRoot = 1e-6;
// Roots of neighbouring patches on their common face are one, at this share of the depth.
inline constexpr double kSameDepth = 1e-10;

/// Data that all nodes of a tree share.
struct TreeContext {
  BezierView view;
  const BezierVolume* volume;
  std::vector<ComponentScale> scales = {};  ///< for each patch, by attribute
  bool allRoots, measureTime;

  [[nodiscard]] const ComponentScale& scaleOf(const TreeNode& node) const {
    return scales[node.patch * volume->attributeCount() + node.attribute];
  }
};

/// Order of the roots of a ray. It is total, so that the order in which they were found is of no
/// matter.
inline bool isBefore(const BezierRoot& a, const BezierRoot& b) {
  if (a.depth != b.depth) return a.depth < b.depth;
  if (a.patch != b.patch) return a.patch < b.patch;
  if (a.attribute != b.attribute) return a.attribute < b.attribute;
  for (int c = 0; c < 3; ++c)
    if (a.parameter[c] != b.parameter[c]) return a.parameter[c] < b.parameter[c];
  for (int c = 0; c < 3; ++c)
    if (a.normal[c] != b.normal[c]) return a.normal[c] < b.normal[c];
  return a.isSingular < b.isSingular;
}

/// Rays of one call, and their results.
struct RayGroup {
  std::vector<Imath::V2d> screens;
  std::vector<std::vector<BezierRoot>> roots;
  std::vector<double> nearest;      ///< depth of the nearest root so far
  std::vector<BezierRoot> closest;  ///< that root, if only the nearest one is asked for
  std::vector<std::size_t> visits;

  /// Starts with rays that have no roots.
  void start(std::vector<Imath::V2d> positions, bool allRoots) {
    const std::size_t count = positions.size();
    screens = std::move(positions);
    if (allRoots)
      roots.resize(count);
    else
      closest.resize(count);
    nearest.assign(count, Camera::kNoDepth);
    visits.assign(count, 0);
  }
  void add(std::uint32_t ray, const BezierRoot& root, bool allRoots) {
    if (allRoots) {
      roots[ray].push_back(root);
    } else if (!(nearest[ray] < Camera::kNoDepth) || isBefore(root, closest[ray])) {
      closest[ray] = root;
      nearest[ray] = root.depth;
    }
  }
};

inline bool isSameRoot(const BezierRoot& a, const BezierRoot& b) {
  if (a.attribute != b.attribute) return false;
  const double apart = std::abs(a.depth - b.depth), size = std::abs(a.depth) + std::abs(b.depth);
  if (a.isSingular && b.isSingular) return apart <= kSameSingularRoot * size;
  if (a.patch != b.patch) {
    const auto isOnFace = [](const Imath::V3d& u) {
      for (int c = 0; c < 3; ++c)
        if (u[c] < kSameRoot || u[c] > 1 - kSameRoot) return true;
      return false;
    };
    return a.isEntry == b.isEntry && apart <= kSameDepth * size && isOnFace(a.parameter) &&
           isOnFace(b.parameter);
  }
  for (int c = 0; c < 3; ++c)
    if (!(std::abs(a.parameter[c] - b.parameter[c]) <= kSameRoot)) return false;
  return true;
}

/// Sorts roots by depth and removes those that several nodes have found.
inline void finishRoots(std::vector<BezierRoot>& roots) {
  std::sort(roots.begin(), roots.end(), isBefore);
  std::vector<BezierRoot> kept;
  for (const BezierRoot& root : roots) {
    const bool isKnown = std::any_of(kept.rbegin(), kept.rend(), [&](const BezierRoot& other) {
      return isSameRoot(root, other);
    });
    if (!isKnown) kept.push_back(root);
  }
  roots = std::move(kept);
}

/// Root of a ray in a node, unless it is outside the visible depths or not on the surface of the
/// expression.
/// @param u  parameters in the cube of the node
/// @param jet  at u − change
/// @param change  last step of Newton's method
template <int N>
std::optional<BezierRoot> rootOf(const TreeContext& context, const NodePlace& node,
                                 const Imath::V2d& screen, const std::array<double, 3>& u,
                                 const NodeJet<N>& jet, const std::array<double, 3>& change,
                                 bool isSingular) {
  const BezierView& view = context.view;
  const BezierVolume& volume = *context.volume;
  const auto corrected = [&](std::size_t component) {
    return jet.value[component] + jet.slope[0][component] * change[0] +
           jet.slope[1][component] * change[1] + jet.slope[2][component] * change[2];
  };
  BezierRoot root;
  root.depth = N == 5 ? corrected(kDepth) / corrected(N - 1) : corrected(kDepth);
  if (root.depth < view.near || root.depth > view.far) return {};
  if (view.isPerspective && !(root.depth > 0)) return {};
  const Imath::V3d along = view.along(screen);
  root.distance = root.depth * along.length();
  root.patch = node.patch;
  root.attribute = node.attribute;
  root.isSingular = isSingular;
  const double edge = node.edge();
  for (int c = 0; c < 3; ++c) {
    const auto axis = static_cast<std::size_t>(c);
    root.parameter[c] =
        std::clamp((static_cast<double>(node.cell[axis]) + u[axis]) * edge, 0.0, 1.0);
  }
  const BezierPatch& patch = volume.patches[root.patch];
  if (patch.trim && !patch.trim->keeps(root.parameter)) return {};
  // Derivatives of position and attribute, up to the positive factor of the weight.
  Imath::V3d tangent[3];
  double slope[3];
  for (std::size_t j = 0; j < 3; ++j) {
    double d[4];
    const double other = N == 5 ? jet.slope[j][N - 1] / jet.value[N - 1] : 0;
    for (std::size_t c = 0; c < 4; ++c) d[c] = jet.slope[j][c] - other * jet.value[c];
    tangent[j] = view.right * d[kAcross] + view.down * d[kDown] + view.axis * d[kDepth];
    slope[j] = jet.slope[j][kValue] - other * jet.value[kValue];
  }
  const Imath::V3d c0 = tangent[1].cross(tangent[2]), c1 = tangent[2].cross(tangent[0]),
                   c2 = tangent[0].cross(tangent[1]);
  const double determinant = tangent[0].dot(c0);
  Imath::V3d normal = c0 * slope[0] + c1 * slope[1] + c2 * slope[2];
  if (determinant < 0) normal = -normal;
  const double length = normal.length();
  root.normal = length > 0 ? normal / length : -along.normalized();
  if (isSingular && determinant == 0 && root.normal.dot(along) > 0) root.normal = -root.normal;
  if (!volume.expression.empty()) {
    const SurfaceSide side =
        sideOf(volume.expression, root.attribute, insideAt(patch, volume.isovalue, root.parameter));
    if (side == SurfaceSide::None) return {};
    if (side == SurfaceSide::Flipped) root.normal = -root.normal;
  }
  root.isEntry = root.normal.dot(along) < 0;
  return root;
}

}  // namespace render
