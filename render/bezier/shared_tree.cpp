#include "render/bezier/shared_tree.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <mutex>
#include <optional>
#include <utility>

#include "levelset/error.h"
#include "render/bezier/tree_node.h"

namespace render {
namespace {

using Imath::V2d;
using Imath::V3d;

// Roots beyond a face of a node by this share of its edge count as in the node. Two nodes may then
// both have the root; duplicates are merged.
constexpr double kFaceTolerance = 1e-9;
// Newton's method has converged when its step is below this share of the edge: the next step, of
// second order, is below rounding.
constexpr double kLastStep = 1e-8;
constexpr int kMostSteps = 24;
// Roots of one patch closer than this in its parameters are one. Newton's method gives the same
// root to 1e-12.
constexpr double kSameRoot = 1e-10;
// Roots of the deepest level are nodes that touch a singular root.
constexpr double kSameSingularRoot = 1e-5;
// Roots of neighbouring patches on their common face are one, at this share of the depth.
constexpr double kSameDepth = 1e-10;

/// CPU seconds of this thread.
double threadSeconds() {
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

/// What the nodes of a tree share.
struct TreeContext {
  BezierView view;
  const BezierVolume* volume;
  std::vector<ComponentScale> scales;  ///< of each patch, by attribute
  bool allRoots, measureTime;

  [[nodiscard]] const ComponentScale& scaleOf(const TreeNode& node) const {
    return scales[node.patch * volume->attributeCount() + node.attribute];
  }
};

/// Rays of one call, and their results.
struct RayGroup {
  std::vector<V2d> screens;
  std::vector<std::vector<BezierRoot>> roots;
  std::vector<double> nearest;  ///< depth of the nearest root so far
  std::vector<std::size_t> visits;
};

bool isBefore(const BezierRoot& a, const BezierRoot& b) {
  if (a.depth != b.depth) return a.depth < b.depth;
  if (a.patch != b.patch) return a.patch < b.patch;
  if (a.attribute != b.attribute) return a.attribute < b.attribute;
  for (int c = 0; c < 3; ++c)
    if (a.parameter[c] != b.parameter[c]) return a.parameter[c] < b.parameter[c];
  return false;
}

bool isSameRoot(const BezierRoot& a, const BezierRoot& b) {
  if (a.attribute != b.attribute) return false;
  if (a.patch != b.patch) {
    const auto isOnFace = [](const V3d& u) {
      for (int c = 0; c < 3; ++c)
        if (u[c] < kSameRoot || u[c] > 1 - kSameRoot) return true;
      return false;
    };
    return a.isEntry == b.isEntry &&
           std::abs(a.depth - b.depth) <= kSameDepth * (std::abs(a.depth) + std::abs(b.depth)) &&
           isOnFace(a.parameter) && isOnFace(b.parameter);
  }
  const double limit = a.isSingular && b.isSingular ? kSameSingularRoot : kSameRoot;
  for (int c = 0; c < 3; ++c)
    if (!(std::abs(a.parameter[c] - b.parameter[c]) <= limit)) return false;
  return true;
}

/// Sorts roots by depth and removes those that several nodes have found.
void finishRoots(std::vector<BezierRoot>& roots, bool all) {
  std::sort(roots.begin(), roots.end(), isBefore);
  if (!all) {
    if (roots.size() > 1) roots.resize(1);
    return;
  }
  std::vector<BezierRoot> kept;
  for (const BezierRoot& root : roots) {
    const bool isKnown = std::any_of(kept.rbegin(), kept.rend(), [&](const BezierRoot& other) {
      return isSameRoot(root, other);
    });
    if (!isKnown) kept.push_back(root);
  }
  roots = std::move(kept);
}

/// Walks through the nodes below some shared nodes, depth first and from front to back, with the
/// rays that each node may hold.
template <int N>
class TreeWalk {
 public:
  TreeWalk(const TreeContext& context, RayGroup& rays, TreeCounts& counts)
      : context_(context), rays_(rays), counts_(counts), levels_(ownLevels()) {
    if (levels_.empty()) levels_.resize(kDeepestLevel + 1);
  }

  void visit(const TreeNode& node, const std::vector<std::uint32_t>& asked, std::size_t depth) {
    std::vector<std::uint32_t>& rest = levels_[depth].rest;
    {
      const StageClock clock(context_.measureTime, counts_.overlapSeconds);
      overlap(node, asked, rest);
    }
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
      count = TreeNodes<N>::split(node, context_.view, context_.scaleOf(node),
                                  level.children.data(), scratch_);
      ++counts_.splits;
      counts_.nodes += 8;
    }
    std::array<const TreeNode*, 8> order{};
    for (std::size_t n = 0; n < count; ++n) order[n] = &level.children[n];
    std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count),
              [](const TreeNode* a, const TreeNode* b) {
                if (a->depthMin != b->depthMin) return a->depthMin < b->depthMin;
                return a->cell < b->cell;
              });
    for (std::size_t n = 0; n < count; ++n) visit(*order[n], rest, depth + 1);
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

  /// Keeps the rays whose position is in the boxes of a node, and that may have a nearer root.
  void overlap(const TreeNode& node, const std::vector<std::uint32_t>& asked,
               std::vector<std::uint32_t>& rest) {
    rest.clear();
    counts_.tests += asked.size();
    for (const std::uint32_t ray : asked) {
      if (!context_.allRoots && node.depthMin > rays_.nearest[ray]) continue;
      const V2d& screen = rays_.screens[ray];
      if (node.crossesEye) {
        if (TreeNodes<N>::mayCross(node, context_.view, screen)) rest.push_back(ray);
        continue;
      }
      if (screen.x < node.left || screen.x > node.right || screen.y < node.top ||
          screen.y > node.bottom)
        continue;
      if (node.hasFrame) {
        const double x = screen.x - node.centre.x, y = screen.y - node.centre.y;
        bool isInside = true;
        for (int r = 0; r < 3; ++r) {
          const double s = node.inverse[r][0] * x + node.inverse[r][1] * y;
          isInside = isInside && s >= node.low[r] && s <= node.high[r];
        }
        if (!isInside) continue;
      }
      rest.push_back(ray);
    }
  }

  /// Constraints of a screen position at a point of a node, and their Jacobian.
  struct Constraints {
    std::array<double, 3> value;
    double slope[3][3];

    Constraints(const NodeJet<N>& jet, const V2d& screen, std::size_t w) {
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
      const V3d r0(slope[0][0], slope[0][1], slope[0][2]),
          r1(slope[1][0], slope[1][1], slope[1][2]), r2(slope[2][0], slope[2][1], slope[2][2]);
      const V3d c0 = r1.cross(r2), c1 = r2.cross(r0), c2 = r0.cross(r1);
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
    const V2d& screen = rays_.screens[ray];
    const std::size_t w = weightIndex();
    const double x = screen.x - node.centre.x, y = screen.y - node.centre.y;
    std::array<double, 3> u{}, change{};
    for (std::size_t r = 0; r < 3; ++r) {
      const double s = node.inverse[r][0] * x + node.inverse[r][1] * y;
      // Roots lie in the cube, so a start in it is nearer than one beyond.
      u[r] = std::clamp(0.5 - node.middle[r] + s * node.weight, 0.0, 1.0);
    }
    for (int step = 0; step < kMostSteps; ++step) {
      ++counts_.steps;
      const NodeJet<N> jet = TreeNodes<N>::jet(node, u);
      if (!Constraints(jet, screen, w).step(change)) return false;
      double length = 0, outside = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        u[c] += change[c];
        length = std::max(length, std::abs(change[c]));
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
  bool isExcluded(const TreeNode& node, const V2d& screen, const std::array<double, 3>& beyond) {
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
    const BezierView& view = context_.view;
    const auto corrected = [&](std::size_t component) {
      return jet.value[component] + jet.slope[0][component] * change[0] +
             jet.slope[1][component] * change[1] + jet.slope[2][component] * change[2];
    };
    BezierRoot root;
    root.depth = N == 5 ? corrected(kDepth) / corrected(N - 1) : corrected(kDepth);
    if (root.depth < view.near || root.depth > view.far) return;
    if (view.isPerspective && !(root.depth > 0)) return;
    const V2d& screen = rays_.screens[ray];
    const V3d along = view.along(screen);
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
    // Derivatives of position and attribute, up to the positive factor of the weight.
    V3d tangent[3];
    double slope[3];
    for (std::size_t j = 0; j < 3; ++j) {
      double d[4];
      const double other = N == 5 ? jet.slope[j][N - 1] / jet.value[N - 1] : 0;
      for (std::size_t c = 0; c < 4; ++c) d[c] = jet.slope[j][c] - other * jet.value[c];
      tangent[j] = view.right * d[kAcross] + view.down * d[kDown] + view.axis * d[kDepth];
      slope[j] = jet.slope[j][kValue] - other * jet.value[kValue];
    }
    const V3d c0 = tangent[1].cross(tangent[2]), c1 = tangent[2].cross(tangent[0]),
              c2 = tangent[0].cross(tangent[1]);
    const double determinant = tangent[0].dot(c0);
    V3d normal = c0 * slope[0] + c1 * slope[1] + c2 * slope[2];
    if (determinant < 0) normal = -normal;
    const double length = normal.length();
    root.normal = length > 0 ? normal / length : -along.normalized();
    if (isSingular && determinant == 0 && root.normal.dot(along) > 0) root.normal = -root.normal;
    if (!context_.volume->expression.empty()) {
      const SurfaceSide side = sideOf(root);
      if (side == SurfaceSide::None) return;
      if (side == SurfaceSide::Flipped) root.normal = -root.normal;
    }
    root.isEntry = root.normal.dot(along) < 0;
    if (isSingular) ++counts_.singular;
    if (!context_.allRoots) {
      if (!rays_.roots[ray].empty() && !isBefore(root, rays_.roots[ray].front())) return;
      rays_.roots[ray].assign(1, root);
      rays_.nearest[ray] = root.depth;
    } else {
      rays_.roots[ray].push_back(root);
    }
  }

  /// Evaluates the expression at the parameter of a root.
  [[nodiscard]] SurfaceSide sideOf(const BezierRoot& root) const {
    const BezierVolume& volume = *context_.volume;
    return render::sideOf(volume.expression, root.attribute,
                          insideAt(volume.patches[root.patch], volume.isovalue, root.parameter));
  }

  const TreeContext& context_;
  RayGroup& rays_;
  TreeCounts& counts_;
  std::vector<Level>& levels_;
  std::vector<double> scratch_;
};

/// Number of nodes that are split in advance at most.
constexpr std::size_t kMostSharedNodes = 200'000;

std::size_t bytesOf(const TreeNode& node) {
  return sizeof(TreeNode) + sizeof(double) * node.points.capacity();
}

/// True for a node that must be split before it is given to tiles.
bool isLarge(const TreeNode& node, const V2d& extent, const TreeOptions& options) {
  if (node.level < options.uniformLevels) return true;
  if (node.level >= options.sharedLevels || node.isUnique) return false;
  return node.crossesEye || node.right - node.left > extent.x || node.bottom - node.top > extent.y;
}

}  // namespace

class SharedTree::Data {
 public:
  Data(const BezierVolume& volume, const BezierView& view, const V2d& frame,
       const TreeOptions& options)
      : context_{view, &volume, {}, options.allRoots, options.measureTime},
        isPolynomial_(view.isPerspective &&
                      std::all_of(volume.patches.begin(), volume.patches.end(),
                                  [](const BezierPatch& p) { return p.weights.empty(); })) {
    if (isPolynomial_)
      build<4>(volume, frame, options);
    else
      build<5>(volume, frame, options);
  }

  [[nodiscard]] Roots rootsAt(const std::vector<V2d>& positions, TreeCounts* counts) const {
    return isPolynomial_ ? find<4>(positions, counts) : find<5>(positions, counts);
  }
  [[nodiscard]] const TreeCounts& counts() const { return counts_; }

 private:
  /// Transforms the patches and splits large ones. @param frame  half extents of the picture on
  /// the screen; 0 for a single ray
  template <int N>
  void build(const BezierVolume& volume, const V2d& frame, const TreeOptions& options) {
    const StageClock clock(options.measureTime, counts_.groupSeconds);
    const std::size_t attributes = volume.attributeCount(),
                      patches = volume.patches.size() * attributes;
    context_.scales.resize(patches);
    std::vector<TreeNode> roots(patches);
    std::vector<char> isKept(patches);
    const auto isSeen = [&](const TreeNode& node) {
      return node.crossesEye || (node.right >= -frame.x && node.left <= frame.x &&
                                 node.bottom >= -frame.y && node.top <= frame.y);
    };
    tbb::parallel_for(std::size_t{0}, patches, [&](std::size_t n) {
      isKept[n] = TreeNodes<N>::root(volume, static_cast<std::uint32_t>(n / attributes),
                                     static_cast<std::uint32_t>(n % attributes), context_.view,
                                     roots[n], context_.scales[n]) &&
                  isSeen(roots[n]);
      if (!isKept[n]) roots[n] = {};
    });
    std::vector<TreeNode> open;
    for (std::size_t n = 0; n < patches; ++n)
      if (isKept[n]) open.push_back(std::move(roots[n]));
    counts_.nodes += patches;
    const V2d extent = context_.view.step * static_cast<double>(options.tile);
    while (!open.empty()) {
      std::vector<TreeNode> large;
      for (TreeNode& node : open)
        (frame.x > 0 && isLarge(node, extent, options) ? large : nodes_).push_back(std::move(node));
      if (large.empty()) break;
      if (large.size() + nodes_.size() > kMostSharedNodes) {
        std::move(large.begin(), large.end(), std::back_inserter(nodes_));
        break;
      }
      std::vector<std::vector<TreeNode>> children(large.size());
      tbb::parallel_for(std::size_t{0}, large.size(), [&](std::size_t n) {
        std::vector<double> scratch;
        children[n].resize(8);
        children[n].resize(TreeNodes<N>::split(large[n], context_.view, context_.scaleOf(large[n]),
                                               children[n].data(), scratch));
        std::erase_if(children[n], [&](const TreeNode& node) { return !isSeen(node); });
      });
      counts_.splits += large.size();
      counts_.nodes += 8 * large.size();
      open.clear();
      for (std::vector<TreeNode>& list : children)
        std::move(list.begin(), list.end(), std::back_inserter(open));
      double bytes = 0;
      for (const TreeNode& node : open) bytes += static_cast<double>(bytesOf(node));
      levelset::requireMemory(bytes, options.maxBytes);
    }
    std::sort(nodes_.begin(), nodes_.end(), [](const TreeNode& a, const TreeNode& b) {
      if (a.depthMin != b.depthMin) return a.depthMin < b.depthMin;
      if (a.patch != b.patch) return a.patch < b.patch;
      if (a.attribute != b.attribute) return a.attribute < b.attribute;
      if (a.level != b.level) return a.level < b.level;
      return a.cell < b.cell;
    });
    for (const TreeNode& node : nodes_) counts_.peakBytes += bytesOf(node);
  }

  template <int N>
  [[nodiscard]] Roots find(const std::vector<V2d>& positions, TreeCounts* sums) const {
    RayGroup rays;
    TreeCounts counts;
    double left = 1e300, right = -1e300, top = 1e300, bottom = -1e300;
    for (const V2d& position : positions) {
      const V2d screen = context_.view.at(position.x, position.y);
      rays.screens.push_back(screen);
      left = std::min(left, screen.x);
      right = std::max(right, screen.x);
      top = std::min(top, screen.y);
      bottom = std::max(bottom, screen.y);
    }
    rays.roots.resize(positions.size());
    rays.nearest.assign(positions.size(), Camera::kNoDepth);
    rays.visits.assign(positions.size(), 0);
    TreeWalk<N> walk(context_, rays, counts);
    std::vector<std::uint32_t> asked;
    for (const TreeNode& node : nodes_) {
      if (!node.crossesEye &&
          (node.left > right || node.right < left || node.top > bottom || node.bottom < top))
        continue;
      if (asked.empty())
        for (std::uint32_t n = 0; n < positions.size(); ++n) asked.push_back(n);
      walk.visit(node, asked, 0);
    }
    Roots result;
    result.first.push_back(0);
    for (std::vector<BezierRoot>& roots : rays.roots) {
      finishRoots(roots, context_.allRoots);
      result.roots.insert(result.roots.end(), roots.begin(), roots.end());
      result.first.push_back(result.roots.size());
    }
    counts.peakBytes = walk.bytes();
    if (sums) sums->add(counts);
    return result;
  }

  TreeContext context_;
  bool isPolynomial_;
  std::vector<TreeNode> nodes_;  ///< from front to back
  TreeCounts counts_;
};

void TreeCounts::add(const TreeCounts& other) {
  nodes += other.nodes;
  splits += other.splits;
  tests += other.tests;
  solutions += other.solutions;
  steps += other.steps;
  singular += other.singular;
  overruns += other.overruns;
  peakBytes = std::max(peakBytes, other.peakBytes);
  overlapSeconds += other.overlapSeconds;
  solutionSeconds += other.solutionSeconds;
  splitSeconds += other.splitSeconds;
  groupSeconds += other.groupSeconds;
}

SharedTree::SharedTree(const BezierVolume& volume, const Camera& camera,
                       const TreeOptions& options) {
  const BezierView view(camera);
  data_ = std::make_unique<const Data>(
      volume, view, V2d(view.step.x * view.middle.x, view.step.y * view.middle.y), options);
}
SharedTree::SharedTree(const BezierVolume& volume, const Camera::Ray& ray,
                       const TreeOptions& options)
    : data_(std::make_unique<const Data>(volume, BezierView(ray), V2d(0), options)) {}
SharedTree::~SharedTree() = default;
SharedTree::SharedTree(SharedTree&&) noexcept = default;
SharedTree& SharedTree::operator=(SharedTree&&) noexcept = default;

SharedTree::Roots SharedTree::rootsAt(const std::vector<V2d>& positions, TreeCounts* counts) const {
  return data_->rootsAt(positions, counts);
}
const TreeCounts& SharedTree::counts() const {
  return data_->counts();
}

BezierPicture castBezier(const BezierVolume& volume, const Camera& camera,
                         const TreeOptions& options) {
  requireBezierVolume(volume);
  validate(camera);
  levelset::report(options.progress, 0);
  const SharedTree tree(volume, camera, options);
  BezierPicture picture;
  picture.width = camera.width;
  picture.height = camera.height;
  const int edge = options.tile;
  const int across = (camera.width + edge - 1) / edge, down = (camera.height + edge - 1) / edge;
  const auto tiles = static_cast<std::size_t>(across) * static_cast<std::size_t>(down);
  std::vector<SharedTree::Roots> found(tiles);
  std::vector<TreeCounts> counts(tiles);
  std::mutex reporting;
  std::size_t done = 0;
  const auto cornerOf = [&](std::size_t tile) {
    return Imath::V2i(static_cast<int>(tile % static_cast<std::size_t>(across)) * edge,
                      static_cast<int>(tile / static_cast<std::size_t>(across)) * edge);
  };
  tbb::parallel_for(std::size_t{0}, tiles, [&](std::size_t tile) {
    const Imath::V2i corner = cornerOf(tile);
    std::vector<V2d> positions;
    for (int y = corner.y; y < std::min(corner.y + edge, camera.height); ++y)
      for (int x = corner.x; x < std::min(corner.x + edge, camera.width); ++x)
        positions.emplace_back(x + 0.5, y + 0.5);
    found[tile] = tree.rootsAt(positions, &counts[tile]);
    const std::scoped_lock lock(reporting);
    levelset::report(options.progress, static_cast<double>(++done) / static_cast<double>(tiles));
  });
  // Row by row. The first pass counts, the second one copies.
  const std::size_t pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  picture.first.assign(pixels + 1, 0);
  const auto forEachPixel = [&](const auto& use) {
    for (std::size_t tile = 0; tile < tiles; ++tile) {
      const Imath::V2i corner = cornerOf(tile);
      std::size_t n = 0;
      for (int y = corner.y; y < std::min(corner.y + edge, camera.height); ++y)
        for (int x = corner.x; x < std::min(corner.x + edge, camera.width); ++x)
          use(static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                  static_cast<std::size_t>(x),
              found[tile], n++);
    }
  };
  forEachPixel([&](std::size_t pixel, const SharedTree::Roots& roots, std::size_t n) {
    picture.first[pixel + 1] = roots.first[n + 1] - roots.first[n];
  });
  for (std::size_t pixel = 0; pixel < pixels; ++pixel)
    picture.first[pixel + 1] += picture.first[pixel];
  picture.roots.resize(picture.first.back());
  forEachPixel([&](std::size_t pixel, const SharedTree::Roots& roots, std::size_t n) {
    std::copy(roots.roots.begin() + static_cast<std::ptrdiff_t>(roots.first[n]),
              roots.roots.begin() + static_cast<std::ptrdiff_t>(roots.first[n + 1]),
              picture.roots.begin() + static_cast<std::ptrdiff_t>(picture.first[pixel]));
  });
  TreeCounts sums;
  for (const TreeCounts& of : counts) sums.add(of);
  const std::size_t shared = tree.counts().peakBytes;
  const std::size_t largest = sums.peakBytes;
  sums.add(tree.counts());
  picture.counts = sums;
  picture.counts.peakBytes = shared + largest;
  return picture;
}

}  // namespace render
