#include "render/bezier/shared_tree.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <mutex>
#include <optional>
#include <utility>

#include "levelset/error.h"
#include "render/bezier/shared_tree_data.h"
#include "render/bezier/tree_node.h"
#include "render/bezier/tree_walk.h"

namespace render {
namespace {

using Imath::V2d;
using Imath::V3d;

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

SharedTree::Data::Data(const BezierVolume& volume, const BezierView& view, const V2d& frame,
                       const TreeOptions& options)
    : context{view, &volume, {}, options.allRoots, options.measureTime},
      isPolynomial(view.isPerspective &&
                   std::all_of(volume.patches.begin(), volume.patches.end(),
                               [](const BezierPatch& p) { return p.weights.empty(); })) {
  if (isPolynomial)
    build<4>(volume, frame, options);
  else
    build<5>(volume, frame, options);
}

SharedTree::Roots SharedTree::Data::rootsOf(std::vector<V2d> screens, TreeCounts* sums) const {
  return isPolynomial ? find<4>(std::move(screens), sums) : find<5>(std::move(screens), sums);
}

template <int N>
void SharedTree::Data::build(const BezierVolume& volume, const V2d& frame,
                             const TreeOptions& options) {
  const StageClock clock(options.measureTime, counts.groupSeconds);
  const std::size_t attributes = volume.attributeCount(),
                    patches = volume.patches.size() * attributes;
  context.scales.resize(patches);
  const auto isSeen = [&](const TreeNode& node) {
    return node.crossesEye || (node.right >= -frame.x && node.left <= frame.x &&
                               node.bottom >= -frame.y && node.top <= frame.y);
  };
  // In blocks, since most of the patches of a large volume have no visible surface.
  constexpr std::size_t kBlock = 256;
  std::vector<std::vector<TreeNode>> roots((patches + kBlock - 1) / kBlock);
  tbb::parallel_for(std::size_t{0}, roots.size(), [&](std::size_t block) {
    for (std::size_t n = block * kBlock; n < std::min(patches, (block + 1) * kBlock); ++n) {
      TreeNode node;
      if (!TreeNodes<N>::root(volume, static_cast<std::uint32_t>(n / attributes),
                              static_cast<std::uint32_t>(n % attributes), context.view, node,
                              context.scales[n]) ||
          !isSeen(node))
        continue;
      proveNode<N>(node, context.scales[n]);
      roots[block].push_back(std::move(node));
    }
  });
  std::vector<TreeNode> open;
  for (std::vector<TreeNode>& block : roots) {
    std::move(block.begin(), block.end(), std::back_inserter(open));
    block = {};
  }
  counts.nodes += patches;
  const V2d extent = context.view.step * static_cast<double>(options.tile);
  while (!open.empty()) {
    std::vector<TreeNode> large;
    for (TreeNode& node : open)
      (isLarge(node, extent, options) ? large : nodes).push_back(std::move(node));
    if (large.empty()) break;
    if (large.size() + nodes.size() > kMostSharedNodes) {
      std::move(large.begin(), large.end(), std::back_inserter(nodes));
      break;
    }
    std::vector<std::vector<TreeNode>> children(large.size());
    tbb::parallel_for(std::size_t{0}, large.size(), [&](std::size_t n) {
      std::vector<double> scratch;
      children[n].resize(8);
      children[n].resize(TreeNodes<N>::split(large[n], context.view, context.scaleOf(large[n]),
                                             children[n].data(), scratch));
      std::erase_if(children[n], [&](const TreeNode& node) { return !isSeen(node); });
      for (TreeNode& node : children[n]) proveNode<N>(node, context.scaleOf(node));
    });
    counts.splits += large.size();
    counts.nodes += 8 * large.size();
    open.clear();
    for (std::vector<TreeNode>& list : children)
      std::move(list.begin(), list.end(), std::back_inserter(open));
    double bytes = 0;
    for (const TreeNode& node : open) bytes += static_cast<double>(bytesOf(node));
    levelset::requireMemory(bytes, options.maxBytes);
  }
  std::sort(nodes.begin(), nodes.end(), [](const TreeNode& a, const TreeNode& b) {
    if (a.depthMin != b.depthMin) return a.depthMin < b.depthMin;
    if (a.patch != b.patch) return a.patch < b.patch;
    if (a.attribute != b.attribute) return a.attribute < b.attribute;
    if (a.level != b.level) return a.level < b.level;
    return a.cell < b.cell;
  });
  for (const TreeNode& node : nodes) counts.peakBytes += bytesOf(node);
}

template <int N>
void SharedTree::Data::proveNode(TreeNode& node, const ComponentScale& scale) const {
  TreeNodes<N>::addFrame(node, context.view, scale);
  TreeNodes<N>::prove(node, context.view);
}

template <int N>
SharedTree::Roots SharedTree::Data::find(std::vector<V2d> screens, TreeCounts* sums) const {
  RayGroup rays;
  TreeCounts work;
  double left = 1e300, right = -1e300, top = 1e300, bottom = -1e300;
  for (const V2d& screen : screens) {
    left = std::min(left, screen.x);
    right = std::max(right, screen.x);
    top = std::min(top, screen.y);
    bottom = std::max(bottom, screen.y);
  }
  const std::size_t count = screens.size();
  rays.start(std::move(screens), context.allRoots);
  TreeWalk<N> walk(context, rays, work);
  std::vector<std::uint32_t> asked;
  for (const TreeNode& node : nodes) {
    if (!node.crossesEye &&
        (node.left > right || node.right < left || node.top > bottom || node.bottom < top))
      continue;
    if (asked.empty())
      for (std::uint32_t n = 0; n < count; ++n) asked.push_back(n);
    std::fill(rays.visits.begin(), rays.visits.end(), 0);
    walk.visitProven(node, context.scaleOf(node), asked);
  }
  work.peakBytes = walk.bytes();
  if (sums) sums->add(work);
  return finished(rays);
}

SharedTree::Roots SharedTree::Data::finished(RayGroup& rays) const {
  Roots result;
  result.first.push_back(0);
  for (std::size_t n = 0; n < rays.screens.size(); ++n) {
    if (context.allRoots) {
      finishRoots(rays.roots[n]);
      result.roots.insert(result.roots.end(), rays.roots[n].begin(), rays.roots[n].end());
    } else if (rays.nearest[n] < Camera::kNoDepth) {
      result.roots.push_back(rays.closest[n]);
    }
    result.first.push_back(result.roots.size());
  }
  return result;
}

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
      volume, view, V2d(view.step.x * view.reach.x, view.step.y * view.reach.y), options);
}
SharedTree::~SharedTree() = default;
SharedTree::SharedTree(SharedTree&&) noexcept = default;
SharedTree& SharedTree::operator=(SharedTree&&) noexcept = default;

std::vector<V2d> SharedTree::screensOf(const std::vector<Camera::Ray>& rays) const {
  const BezierView& view = data_->context.view;
  std::vector<V2d> screens;
  screens.reserve(rays.size());
  for (const Camera::Ray& ray : rays) {
    if (view.isPerspective) {
      const double depth = ray.direction.dot(view.axis);
      screens.emplace_back(ray.direction.dot(view.right) / depth,
                           ray.direction.dot(view.down) / depth);
    } else {
      const Imath::V3d offset = ray.origin - view.eye;
      screens.emplace_back(offset.dot(view.right), offset.dot(view.down));
    }
  }
  return screens;
}

SharedTree::Roots SharedTree::rootsOf(const std::vector<Camera::Ray>& rays,
                                      TreeCounts* counts) const {
  return data_->rootsOf(screensOf(rays), counts);
}

SharedTree::Roots SharedTree::rootsOn(std::vector<V2d> screens, TreeCounts* counts) const {
  return data_->rootsOf(std::move(screens), counts);
}

SharedTree::Roots SharedTree::rootsAt(const std::vector<V2d>& positions, TreeCounts* counts) const {
  std::vector<V2d> screens;
  screens.reserve(positions.size());
  for (const V2d& position : positions)
    screens.push_back(data_->context.view.at(position.x, position.y));
  return data_->rootsOf(std::move(screens), counts);
}
const TreeCounts& SharedTree::counts() const {
  return data_->counts;
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
