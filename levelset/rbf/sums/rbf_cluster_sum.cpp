#include "levelset/rbf/sums/rbf_cluster_sum.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace levelset::rbf {

using Imath::V3d;

namespace {

// Two boxes are far from each other if their gap exceeds this multiple of the larger half diagonal.
constexpr double kFarGap = 1;
constexpr std::size_t kSequential = 2000;  // children of nodes with fewer points run in one task

}  // namespace

struct RbfClusterSum::Pass {
  /// The particles, then kCubeNodes Chebyshev nodes for each box.
  std::vector<RbfParticle> sources;
  std::vector<V3d> sums;
};

RbfClusterSum::RbfClusterSum(RbfKernel kernel, std::span<const V3d> points,
                             std::span<const ClusterTree::Node> nodes)
    : kernel_(kernel), points_(points), nodes_(nodes) {
  for (const ClusterTree::Node& node : nodes) {
    Frame frame{node.box.center(), node.box.size() / 2};
    frame.radius = frame.half.length();
    for (int axis = 0; axis < 3; ++axis)
      if (!(frame.half[axis] > 0)) frame.half[axis] = 1;
    frames_.push_back(frame);
  }
}

V3d RbfClusterSum::nodeOf(const Frame& frame, std::size_t node) const {
  const auto& at = chebyshevNodes<kNodes>();
  return frame.center + frame.half * V3d(at[node / (kNodes * kNodes)], at[node / kNodes % kNodes],
                                         at[node % kNodes]);
}

RbfClusterSum::Shift RbfClusterSum::shiftTo(std::size_t parent, std::size_t child) const {
  const Frame &from = frames_[parent], &to = frames_[child];
  Shift shift;
  for (int axis = 0; axis < 3; ++axis) {
    std::array<double, kNodes> at = chebyshevNodes<kNodes>();
    for (double& t : at)
      t = (to.center[axis] + t * to.half[axis] - from.center[axis]) / from.half[axis];
    shift[static_cast<std::size_t>(axis)] = interpolation<kNodes>(at);
  }
  return shift;
}

void RbfClusterSum::gatherLeaf(std::size_t at, Pass& pass) const {
  const Frame& frame = frames_[at];
  RbfParticle* cube = &pass.sources[points_.size() + at * kCubeNodes];
  for (std::uint32_t i = nodes_[at].begin; i < nodes_[at].end; ++i) {
    const V3d t = (points_[i] - frame.center) / frame.half;
    const auto a = lagrangeAt<kNodes>(t.x), b = lagrangeAt<kNodes>(t.y),
               c = lagrangeAt<kNodes>(t.z);
    for (std::size_t n = 0; n < kCubeNodes; ++n)
      cube[n].weight += pass.sources[i].weight *
                        (a[n / (kNodes * kNodes)] * b[n / kNodes % kNodes] * c[n % kNodes]);
  }
}

void RbfClusterSum::gather(Pass& pass) const {
  tbb::parallel_for(std::size_t{0}, nodes_.size(), [&](std::size_t at) {
    RbfParticle* cube = &pass.sources[points_.size() + at * kCubeNodes];
    for (std::size_t n = 0; n < kCubeNodes; ++n) cube[n] = {nodeOf(frames_[at], n), V3d(0)};
    if (isBottom(at)) gatherLeaf(at, pass);
  });
  for (std::size_t at = nodes_.size(); at-- > 0;) {
    if (isBottom(at)) continue;
    RbfParticle* cube = &pass.sources[points_.size() + at * kCubeNodes];
    for (const std::size_t half : {0u, 1u}) {
      const std::size_t child = static_cast<std::size_t>(nodes_[at].child) + half;
      const RbfParticle* from = &pass.sources[points_.size() + child * kCubeNodes];
      Shift shift = shiftTo(at, child), back = shift;  // `back` becomes the transpose
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t i = 0; i < kNodes; ++i)
          for (std::size_t j = 0; j < kNodes; ++j) back[axis][i][j] = shift[axis][j][i];
      for (int k = 0; k < 3; ++k) {
        Cube in, out;
        for (std::size_t n = 0; n < kCubeNodes; ++n) in[n] = from[n].weight[k];
        transformCube(back[0], back[1], back[2], in.data(), out.data());
        for (std::size_t n = 0; n < kCubeNodes; ++n) cube[n].weight[k] += out[n];
      }
    }
  }
}

bool RbfClusterSum::isFar(std::size_t a, std::size_t b) const {
  const double gap = kFarGap * std::max(frames_[a].radius, frames_[b].radius);
  return squaredGap(nodes_[a].box, nodes_[b].box) > gap * gap;
}

void RbfClusterSum::addSources(std::size_t at, std::vector<std::uint32_t>& sources) const {
  if (nodes_[at].count() <= kCubeNodes) {
    for (std::uint32_t i = nodes_[at].begin; i < nodes_[at].end; ++i) sources.push_back(i);
    return;
  }
  const std::size_t first = points_.size() + at * kCubeNodes;
  for (std::size_t n = 0; n < kCubeNodes; ++n)
    sources.push_back(static_cast<std::uint32_t>(first + n));
}

/// Divides the candidate nodes of the tree. `sources` gets the indices in Pass::sources of the
/// particles and Chebyshev nodes that are summed at the node `at`. `rest` gets the tree nodes that
/// are too near and are left to the children of `at`.
void RbfClusterSum::chooseSources(std::size_t at, std::span<const std::uint32_t> candidates,
                                  std::vector<std::uint32_t>& sources,
                                  std::vector<std::uint32_t>& rest) const {
  const bool isLast = isBottom(at);
  std::vector<std::uint32_t> open(candidates.rbegin(), candidates.rend());
  while (!open.empty()) {
    const std::uint32_t other = open.back();
    open.pop_back();
    const ClusterTree::Node& from = nodes_[other];
    if (isFar(at, other)) {
      addSources(other, sources);
    } else if (!isBottom(other) && (isLast || frames_[other].radius >= frames_[at].radius)) {
      open.push_back(static_cast<std::uint32_t>(from.child) + 1);
      open.push_back(static_cast<std::uint32_t>(from.child));
    } else if (isLast) {
      for (std::uint32_t i = from.begin; i < from.end; ++i) sources.push_back(i);
    } else {
      rest.push_back(other);
    }
  }
}

void RbfClusterSum::sumLeaf(std::size_t at, std::span<const std::uint32_t> sources,
                            const Cubes& inherited, Pass& pass) const {
  const ClusterTree::Node& node = nodes_[at];
  const Frame& frame = frames_[at];
  RbfPoints points(node.count());
  for (std::size_t n = 0; n < points.size(); ++n) {
    const V3d& p = points_[node.begin + n];
    points.x[n] = p.x, points.y[n] = p.y, points.z[n] = p.z;
    const V3d t = (p - frame.center) / frame.half;
    const auto a = lagrangeAt<kNodes>(t.x), b = lagrangeAt<kNodes>(t.y),
               c = lagrangeAt<kNodes>(t.z);
    V3d sum(0);
    for (std::size_t m = 0; m < kCubeNodes; ++m)
      sum += V3d(inherited[0][m], inherited[1][m], inherited[2][m]) *
             (a[m / (kNodes * kNodes)] * b[m / kNodes % kNodes] * c[m % kNodes]);
    points.u[n] = sum.x, points.v[n] = sum.y, points.w[n] = sum.z;
  }
  addRbfSums(kernel_, pass.sources, sources, points);
  for (std::size_t n = 0; n < points.size(); ++n)
    pass.sums[node.begin + n] = V3d(points.u[n], points.v[n], points.w[n]);
}

void RbfClusterSum::descend(std::size_t at, std::span<const std::uint32_t> candidates,
                            const Cubes& inherited, Pass& pass) const {
  std::vector<std::uint32_t> sources, rest;
  chooseSources(at, candidates, sources, rest);
  const ClusterTree::Node& node = nodes_[at];
  if (isBottom(at)) {
    sumLeaf(at, sources, inherited, pass);
    return;
  }
  RbfPoints values(kCubeNodes);
  for (std::size_t n = 0; n < kCubeNodes; ++n) {
    const V3d p = nodeOf(frames_[at], n);
    values.x[n] = p.x, values.y[n] = p.y, values.z[n] = p.z;
    values.u[n] = inherited[0][n], values.v[n] = inherited[1][n], values.w[n] = inherited[2][n];
  }
  addRbfSums(kernel_, pass.sources, sources, values);
  const auto toChild = [&](std::size_t half) {
    const std::size_t child = static_cast<std::size_t>(node.child) + half;
    const Shift shift = shiftTo(at, child);
    Cubes cubes;
    transformCube(shift[0], shift[1], shift[2], values.u.data(), cubes[0].data());
    transformCube(shift[0], shift[1], shift[2], values.v.data(), cubes[1].data());
    transformCube(shift[0], shift[1], shift[2], values.w.data(), cubes[2].data());
    descend(child, rest, cubes, pass);
  };
  if (node.count() > kSequential) {
    tbb::parallel_for(std::size_t{0}, std::size_t{2}, toChild);
  } else {
    toChild(0);
    toChild(1);
  }
}

std::vector<V3d> RbfClusterSum::operator()(std::span<const V3d> weights) const {
  Pass pass{std::vector<RbfParticle>(points_.size() + nodes_.size() * kCubeNodes),
            std::vector<V3d>(points_.size())};
  for (std::size_t i = 0; i < points_.size(); ++i) pass.sources[i] = {points_[i], weights[i]};
  gather(pass);
  const std::array<std::uint32_t, 1> root = {0};
  descend(0, root, {}, pass);
  return std::move(pass.sums);
}

}  // namespace levelset::rbf
