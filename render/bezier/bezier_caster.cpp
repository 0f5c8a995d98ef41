#include "render/bezier/bezier_caster.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <mutex>
#include <numeric>
#include <utility>

#include "render/bezier/solid_crossings.h"
#include "render/bezier/tree_node.h"
#include "render/bezier/tree_walk.h"

namespace render {

/// Node of a binary tree of boxes.
struct BezierBoxNode {
  Imath::Box3d box;
  std::uint32_t first = 0;  ///< first part of a leaf; index of the second child of an inner node
  std::uint32_t count = 0;  ///< number of parts; 0: inner node, whose first child follows it
};

namespace {

using Imath::Box3d;
using Imath::V3d;

constexpr int kMostPartLevels = 6;
constexpr double kPartSize = 1.0 / 12;  // of the diagonal of the volume
constexpr std::size_t kMostParts = 200'000;

Box3d boxOf(const TreeNode& part) {
  return {V3d(part.left, part.top, part.depthMin), V3d(part.right, part.bottom, part.depthMax)};
}

/// Distances at which a ray enters and leaves a box, grown by rounding errors. @return false if it
/// misses
bool meets(const Box3d& box, const Camera::Ray& ray, const V3d& inverse, double margin,
           double& entry) {
  double near = ray.near, far = ray.far;
  for (int c = 0; c < 3; ++c) {
    const double low = box.min[c] - margin - ray.origin[c],
                 high = box.max[c] + margin - ray.origin[c];
    if (ray.direction[c] == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    const double a = low * inverse[c], b = high * inverse[c];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  entry = near;
  return near <= far;
}

}  // namespace

struct BezierCaster::Data {
  BezierVolume volume;
  std::vector<ComponentScale> scales;  ///< for each patch, by attribute
  std::vector<TreeNode> parts;         ///< in world space
  std::vector<BezierBoxNode> boxes;
  Box3d bounds;
  double margin = 0;                ///< rounding errors of distances to boxes
  mutable std::once_flag isJudged;  ///< for `refusal`
  mutable std::string refusal;      ///< BezierCaster::refusalAsSolid()

  explicit Data(BezierVolume given, std::size_t maxBytes) : volume(std::move(given)) {
    requireBezierVolume(volume);
    split(maxBytes);
    if (parts.empty()) return;
    std::vector<std::uint32_t> order(parts.size());
    std::iota(order.begin(), order.end(), 0U);
    build(order, 0, order.size());
    std::vector<TreeNode> sorted;
    sorted.reserve(parts.size());
    for (const std::uint32_t n : order) sorted.push_back(std::move(parts[n]));
    parts = std::move(sorted);
    bounds = boxes.front().box;
    margin = 1e-14 * (bounds.min.length() + bounds.max.length());
  }

 private:
  void split(std::size_t maxBytes) {
    const BezierView world;
    const std::size_t attributes = volume.attributeCount();
    const double most = kPartSize * volume.bounds().size().length();
    scales.resize(volume.patches.size() * attributes);
    std::vector<TreeNode> open;
    for (std::size_t n = 0; n < scales.size(); ++n) {
      TreeNode node;
      if (TreeNodes<5>::root(volume, static_cast<std::uint32_t>(n / attributes),
                             static_cast<std::uint32_t>(n % attributes), world, node, scales[n]))
        open.push_back(std::move(node));
    }
    while (!open.empty()) {
      std::vector<TreeNode> large;
      for (TreeNode& node : open) {
        const bool isSmall = node.level >= kMostPartLevels || boxOf(node).size().length() <= most;
        (isSmall ? parts : large).push_back(std::move(node));
      }
      if (large.size() + parts.size() > kMostParts) {
        std::move(large.begin(), large.end(), std::back_inserter(parts));
        break;
      }
      std::vector<std::vector<TreeNode>> children(large.size());
      tbb::parallel_for(std::size_t{0}, large.size(), [&](std::size_t n) {
        std::vector<double> scratch;
        const TreeNode& node = large[n];
        children[n].resize(8);
        children[n].resize(TreeNodes<5>::split(node, world,
                                               scales[node.patch * attributes + node.attribute],
                                               children[n].data(), scratch));
      });
      open.clear();
      double bytes = 0;
      for (std::vector<TreeNode>& list : children)
        for (TreeNode& node : list) {
          bytes += static_cast<double>(sizeof(TreeNode) + sizeof(double) * node.points.size());
          open.push_back(std::move(node));
        }
      levelset::requireMemory(bytes, maxBytes);
    }
  }

  /// Builds the tree of order[begin … end), halved at the median along the longest axis.
  void build(std::vector<std::uint32_t>& order, std::size_t begin, std::size_t end) {
    const std::size_t number = boxes.size();
    boxes.emplace_back();
    Box3d box, centres;
    for (std::size_t n = begin; n < end; ++n) {
      const Box3d of = boxOf(parts[order[n]]);
      box.extendBy(of);
      centres.extendBy(of.center());
    }
    boxes[number].box = box;
    if (end - begin <= 2) {
      boxes[number].first = static_cast<std::uint32_t>(begin);
      boxes[number].count = static_cast<std::uint32_t>(end - begin);
      return;
    }
    const V3d size = centres.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = (begin + end) / 2;
    const auto at = [&](std::size_t n) { return order.begin() + static_cast<std::ptrdiff_t>(n); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
      const double x = boxOf(parts[a]).center()[axis], y = boxOf(parts[b]).center()[axis];
      return x != y ? x < y : a < b;
    });
    build(order, begin, middle);
    boxes[number].first = static_cast<std::uint32_t>(boxes.size());
    build(order, middle, end);
  }
};

BezierCaster::BezierCaster(BezierVolume volume, std::size_t maxBytes)
    : data_(std::make_shared<const Data>(std::move(volume), maxBytes)) {}

const BezierVolume& BezierCaster::volume() const {
  return data_->volume;
}
const std::string& BezierCaster::refusalAsSolid() const {
  std::call_once(data_->isJudged, [&data = *data_] {
    const std::size_t count = data.volume.patches.size();
    if (const std::size_t open = findOpenPatch(data.volume); open < count)
      data.refusal = fmt::format(
          "its surface is open at patch {}; give a volume that is closed, or leave it out of --csg",
          open + 1);
    else if (const std::size_t folded = findFoldedPatch(data.volume); folded < count)
      data.refusal = fmt::format(
          "its map folds in patch {}, and a ray does not show where the layers end; give a map "
          "without folds inside the surface",
          folded + 1);
  });
  return data_->refusal;
}
const Box3d& BezierCaster::bounds() const {
  return data_->bounds;
}
std::size_t BezierCaster::partCount() const {
  return data_->parts.size();
}

std::vector<double> BezierCaster::extents(const std::vector<V3d>& directions) const {
  std::vector<double> result(directions.size(), -std::numeric_limits<double>::infinity());
  for (const TreeNode& part : data_->parts)
    for (std::size_t n = 0; n < part.points.size(); n += 5) {
      const double* c = part.points.data() + n;
      const V3d point = V3d(c[0], c[1], c[2]) / c[kWeight];
      for (std::size_t d = 0; d < directions.size(); ++d)
        result[d] = std::max(result[d], point.dot(directions[d]));
    }
  return result;
}

std::size_t BezierCaster::bytes() const {
  std::size_t sum = data_->volume.bytes() + data_->boxes.size() * sizeof(BezierBoxNode);
  for (const TreeNode& part : data_->parts)
    sum += sizeof(TreeNode) + sizeof(double) * part.points.capacity();
  return sum;
}

std::optional<BezierRoot> BezierCaster::firstHit(const Camera::Ray& ray) const {
  return nearest(ray, Wanted::Nearest);
}

bool BezierCaster::isOccluded(const Camera::Ray& ray) const {
  return nearest(ray, Wanted::Any).has_value();
}

std::vector<BezierRoot> BezierCaster::roots(const Camera::Ray& ray) const {
  thread_local RayGroup group;
  group.start({Imath::V2d(0)}, true);
  cast(ray, Wanted::All, group);
  std::vector<BezierRoot> roots = std::move(group.roots[0]);
  group.roots[0].clear();
  finishRoots(roots);
  return roots;
}

std::optional<BezierRoot> BezierCaster::nearest(const Camera::Ray& ray, Wanted wanted) const {
  thread_local RayGroup group;
  group.screens.assign(1, Imath::V2d(0));
  group.closest.resize(1);
  group.nearest.assign(1, Camera::kNoDepth);
  group.visits.resize(1);
  cast(ray, wanted, group);
  if (!(group.nearest[0] < Camera::kNoDepth)) return {};
  return group.closest[0];
}

void BezierCaster::cast(const Camera::Ray& ray, Wanted wanted, RayGroup& group) const {
  const Data& data = *data_;
  if (data.boxes.empty()) return;
  const V3d inverse(1 / ray.direction.x, 1 / ray.direction.y, 1 / ray.direction.z);
  const double margin = data.margin + 1e-14 * ray.origin.length();
  // Parts that the ray meets, from front to back.
  thread_local std::vector<std::pair<double, std::uint32_t>> met;
  met.clear();
  thread_local std::vector<std::uint32_t> stack;
  stack.assign(1, 0);
  double entry = 0;
  while (!stack.empty()) {
    const std::uint32_t number = stack.back();
    stack.pop_back();
    const BezierBoxNode& node = data.boxes[number];
    if (!meets(node.box, ray, inverse, margin, entry)) continue;
    if (node.count == 0) {
      stack.push_back(node.first);
      stack.push_back(number + 1);
      continue;
    }
    for (std::uint32_t n = node.first; n < node.first + node.count; ++n)
      if (meets(boxOf(data.parts[n]), ray, inverse, margin, entry)) met.emplace_back(entry, n);
  }
  if (met.empty()) return;
  std::sort(met.begin(), met.end());

  thread_local TreeNode node;
  const TreeContext context{BezierView(ray), &data.volume, {}, wanted == Wanted::All, false};
  const std::vector<std::uint32_t> asked{0};
  TreeCounts counts;
  for (const auto& [distance, number] : met) {
    if (wanted != Wanted::All && distance > group.nearest[0] + margin) break;
    const TreeNode& part = data.parts[number];
    ComponentScale scale;
    if (!TreeNodes<5>::turned(
            part, data.scales[part.patch * data.volume.attributeCount() + part.attribute],
            context.view, node, scale))
      continue;
    group.visits[0] = 0;
    TreeWalk<5> walk(context, group, counts);
    walk.visit(node, scale, asked, 0);
    if (wanted == Wanted::Any && group.nearest[0] < Camera::kNoDepth) break;
  }
}

}  // namespace render
