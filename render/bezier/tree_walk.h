#pragma once

// Private to the ray casting of Bézier volumes: finds the roots of rays in the nodes of a tree.

#include <Imath/ImathVec.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <optional>
#include <vector>

#include "render/bezier/shared_tree.h"
#include "render/bezier/tree_node.h"
#include "render/bezier/tree_root.h"

namespace render {

// Roots beyond a face of a node by this share of its edge count as in the node. Two nodes may then
// both have the root; duplicates are merged.
inline constexpr double kFaceTolerance = 1e-9;
// Newton's method has converged when its step is below this share of the edge: the next step, of
// second order, is below rounding.
inline constexpr double kLastStep = 1e-8;
inline constexpr int kMostNewtonSteps = 24;
/// CPU seconds of this thread.
inline double threadSeconds() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Adds the CPU time of its life to a sum.
class StageClock {
 public:
  StageClock(bool isOn, double& sum)
      : sum_(isOn ? &sum : nullptr), start_(isOn ? threadSeconds() : 0) {}
  ~StageClock() {
    if (sum_) *sum_ += threadSeconds() - start_;
  }
  StageClock(const StageClock&) = delete;
  StageClock& operator=(const StageClock&) = delete;

 private:
  double* sum_;
  double start_;
};

/// Walks through the nodes below some shared nodes, depth first and from front to back, with the
/// rays that each node may hold.
template <int N>
class TreeWalk {
 public:
  TreeWalk(const TreeContext& context, RayGroup& rays, TreeCounts& counts)
      : context_(context), rays_(rays), counts_(counts), levels_(ownLevels()) {
    if (levels_.empty()) levels_.resize(kDeepestLevel + 1);
  }

  /// Starts in a node. @param scale  of the patch of the node
  void visit(TreeNode& node, const ComponentScale& scale, const std::vector<std::uint32_t>& asked,
             std::size_t depth) {
    std::vector<std::uint32_t>& rest = levels_[depth].rest;
    {
      const StageClock clock(context_.measureTime, counts_.overlapSeconds);
      overlap(node, asked, rest);
    }
    if (rest.empty()) return;
    {  // most nodes end before they need this
      const StageClock clock(context_.measureTime, counts_.splitSeconds);
      TreeNodes<N>::addFrame(node, context_.view, scale);
    }
    {
      const StageClock clock(context_.measureTime, counts_.overlapSeconds);
      overlapFrame(node, rest);
    }
    if (rest.empty()) return;
    {
      const StageClock clock(context_.measureTime, counts_.splitSeconds);
      TreeNodes<N>::prove(node, context_.view);
    }
    decide(node, scale, rest, depth);
  }

  /// Starts in a node that has its frame, and is proven if it can be.
  void visitProven(const TreeNode& node, const ComponentScale& scale,
                   const std::vector<std::uint32_t>& asked) {
    std::vector<std::uint32_t>& rest = levels_[0].rest;
    {
      const StageClock clock(context_.measureTime, counts_.overlapSeconds);
      overlap(node, asked, rest);
      overlapFrame(node, rest);
    }
    decide(node, scale, rest, 0);
  }

  /// Memory of the nodes, bytes.
  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = sizeof(double) * scratch_.capacity();
    for (const Level& level : levels_) {
      sum += sizeof(std::uint32_t) * level.rest.capacity();
      for (const TreeNode& node : level.children)
        sum += sizeof(TreeNode) + sizeof(double) * node.points.capacity();
    }
    return sum;
  }

 private:
  struct Level {
    std::array<TreeNode, 8> children;
    std::vector<std::uint32_t> rest;  ///< rays that the node at this depth has not decided
  };
  /// Memory that the walks of a thread use one after the other.
  static std::vector<Level>& ownLevels() {
    thread_local std::vector<Level> levels;
    return levels;
  }

  /// Solves or splits a node for the rays that may meet it.
  void decide(const TreeNode& node, const ComponentScale& scale, std::vector<std::uint32_t>& rest,
              std::size_t depth) {
    if (rest.empty()) return;
    if (node.isUnique) {
      const StageClock clock(context_.measureTime, counts_.solutionSeconds);
      std::erase_if(rest, [&](std::uint32_t ray) { return solve(node, ray); });
    }
    if (rest.empty()) return;
    if (node.level >= kDeepestLevel) {
      for (const std::uint32_t ray : rest) addCentre(node, ray);
      return;
    }
    std::erase_if(rest, [&](std::uint32_t ray) {
      const std::size_t visits = ++rays_.visits[ray];
      if (visits == kMostVisits) ++counts_.overruns;
      return visits >= kMostVisits;
    });
    if (rest.empty()) return;
    Level& level = levels_[depth];
    std::size_t count = 0;
    {
      const StageClock clock(context_.measureTime, counts_.splitSeconds);
      count = TreeNodes<N>::split(node, context_.view, scale, level.children.data(), scratch_);
      ++counts_.splits;
      counts_.nodes += 8;
    }
    std::array<TreeNode*, 8> order{};
    for (std::size_t n = 0; n < count; ++n) order[n] = &level.children[n];
    std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count),
              [](const TreeNode* a, const TreeNode* b) {
                if (a->depthMin != b->depthMin) return a->depthMin < b->depthMin;
                return a->cell < b->cell;
              });
    for (std::size_t n = 0; n < count; ++n) visit(*order[n], scale, rest, depth + 1);
  }

  /// Keeps the rays whose position is in the box of a node on the screen, and that may have a
  /// nearer root.
  void overlap(const TreeNode& node, const std::vector<std::uint32_t>& asked,
               std::vector<std::uint32_t>& rest) {
    rest.clear();
    counts_.tests += asked.size();
    for (const std::uint32_t ray : asked) {
      if (!context_.allRoots && node.leastDepth > rays_.nearest[ray]) continue;
      const Imath::V2d& screen = rays_.screens[ray];
      if (node.crossesEye) {
        if (TreeNodes<N>::mayCross(node, context_.view, screen)) rest.push_back(ray);
        continue;
      }
      if (screen.x < node.left || screen.x > node.right || screen.y < node.top ||
          screen.y > node.bottom)
        continue;
      rest.push_back(ray);
    }
  }

  /// Removes the rays outside the oriented box of a node.
  void overlapFrame(const TreeNode& node, std::vector<std::uint32_t>& rest) const {
    if (!node.hasFrame) return;
    std::erase_if(rest, [&](std::uint32_t ray) {
      const double x = rays_.screens[ray].x - node.centre.x,
                   y = rays_.screens[ray].y - node.centre.y;
      bool isInside = true;
      for (int r = 0; r < 3; ++r) {
        const double s = node.inverse[r][0] * x + node.inverse[r][1] * y;
        isInside = isInside && s >= node.low[r] && s <= node.high[r];
      }
      return !isInside;
    });
  }

  /// Constraints of a screen position at a point of a node, and their Jacobian.
  struct Constraints {
    std::array<double, 3> value;
    double slope[3][3];

    Constraints(const NodeJet<N>& jet, const Imath::V2d& screen, std::size_t w) {
      value = {jet.value[kAcross] - screen.x * jet.value[w],
               jet.value[kDown] - screen.y * jet.value[w], jet.value[kValue]};
      for (int j = 0; j < 3; ++j) {
        slope[0][j] = jet.slope[j][kAcross] - screen.x * jet.slope[j][w];
        slope[1][j] = jet.slope[j][kDown] - screen.y * jet.slope[j][w];
        slope[2][j] = jet.slope[j][kValue];
      }
    }
    /// Step of Newton's method. @return false where the Jacobian is singular
    bool step(std::array<double, 3>& change) const {
      const Imath::V3d r0(slope[0][0], slope[0][1], slope[0][2]),
          r1(slope[1][0], slope[1][1], slope[1][2]), r2(slope[2][0], slope[2][1], slope[2][2]);
      const Imath::V3d c0 = r1.cross(r2), c1 = r2.cross(r0), c2 = r0.cross(r1);
      const double determinant = r0.dot(c0);
      if (determinant == 0 || !std::isfinite(determinant)) return false;
      for (int j = 0; j < 3; ++j)
        change[static_cast<std::size_t>(j)] =
            -(c0[j] * value[0] + c1[j] * value[1] + c2[j] * value[2]) / determinant;
      return true;
    }
  };

  [[nodiscard]] std::size_t weightIndex() const {
    return static_cast<std::size_t>(context_.view.isPerspective ? kDepth + 0 : N - 1);
  }

  /// Decides a ray in a node with at most one root. @return false if the node must be split
  bool solve(const TreeNode& node, std::uint32_t ray) {
    ++counts_.solutions;
    const Imath::V2d& screen = rays_.screens[ray];
    const std::size_t w = weightIndex();
    const double x = screen.x - node.centre.x, y = screen.y - node.centre.y;
    std::array<double, 3> u{}, change{};
    for (std::size_t r = 0; r < 3; ++r) {
      const double s = node.inverse[r][0] * x + node.inverse[r][1] * y;
      // Roots lie in the cube, so a start in it is nearer than one beyond.
      u[r] = std::clamp(0.5 - node.middle[r] + s * node.weight, 0.0, 1.0);
    }
    for (int step = 0; step < kMostNewtonSteps; ++step) {
      ++counts_.steps;
      const NodeJet<N> jet = TreeNodes<N>::jet(node, u);
      if (!Constraints(jet, screen, w).step(change)) return false;
      double length = 0, outside = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        u[c] += change[c];
        length = std::isfinite(change[c]) ? std::max(length, std::abs(change[c])) : INFINITY;
        outside = std::max(outside, std::abs(u[c] - 0.5) - 0.5);
      }
      if (!(length < 1e3) || outside > 1) return isExcluded(node, screen, u);
      if (length > kLastStep) continue;
      if (outside > kFaceTolerance) return isExcluded(node, screen, u);
      addRoot(node, ray, u, jet, change, false);
      return true;
    }
    return false;
  }

  /// Proves by the mean value theorem that a node with bounds of the derivatives has no root, from
  /// a point on its faces nearest to a root of its polynomials outside.
  bool isExcluded(const TreeNode& node, const Imath::V2d& screen,
                  const std::array<double, 3>& beyond) {
    std::array<double, 3> on{};
    for (std::size_t c = 0; c < 3; ++c) on[c] = std::clamp(beyond[c], 0.0, 1.0);
    const NodeJet<N> jet = TreeNodes<N>::jet(node, on);
    const Constraints constraints(jet, screen, weightIndex());
    for (std::size_t r = 0; r < 3; ++r) {
      if (beyond[r] == on[r]) continue;
      const double* m = node.inverse[r];
      const double g =
          m[0] * constraints.value[0] + m[1] * constraints.value[1] + m[2] * constraints.value[2];
      double most = kFaceTolerance;
      for (std::size_t c = 0; c < 3; ++c)
        if (c != r) most += node.across[r][c] * std::max(on[c], 1 - on[c]);
      if (beyond[r] > 1 ? g < -most : g > most) return true;
    }
    return false;
  }

  /// Takes the centre of a node of the deepest level as a root.
  void addCentre(const TreeNode& node, std::uint32_t ray) {
    if (node.crossesEye) return;  // within rounding errors of the eye
    const std::array<double, 3> middle{0.5, 0.5, 0.5};
    addRoot(node, ray, middle, TreeNodes<N>::jet(node, middle), {0, 0, 0}, true);
  }

  /// Adds a root. @param jet  at u − change
  void addRoot(const TreeNode& node, std::uint32_t ray, const std::array<double, 3>& u,
               const NodeJet<N>& jet, const std::array<double, 3>& change, bool isSingular) {
    const std::optional<BezierRoot> root =
        rootOf<N>(context_, node, rays_.screens[ray], u, jet, change, isSingular);
    if (!root) return;
    if (isSingular) ++counts_.singular;
    rays_.add(ray, *root, context_.allRoots);
  }

  const TreeContext& context_;
  RayGroup& rays_;
  TreeCounts& counts_;
  std::vector<Level>& levels_;
  std::vector<double> scratch_;
};

}  // namespace render
