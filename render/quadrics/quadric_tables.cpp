#include "render/quadrics/quadric_tables.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress.h"
#include "render/quadrics/quadric_tree.h"

namespace render {
namespace {

using Imath::Box3d;
using Imath::V3d;

constexpr std::size_t kBoxGrain = 1u << 14;

Box3d boxAround(const Ball& ball) {
  const V3d radius(static_cast<double>(ball.radius));
  return {ball.centre - radius, ball.centre + radius};
}

Box3d boxAround(const Stick& stick) {
  const V3d along = (stick.b - stick.a).normalized();
  V3d radius;
  for (int c = 0; c < 3; ++c)
    radius[c] =
        static_cast<double>(stick.radius) * std::sqrt(std::max(0.0, 1 - along[c] * along[c]));
  Box3d box(stick.a - radius, stick.a + radius);
  box.extendBy(Box3d(stick.b - radius, stick.b + radius));
  return box;
}

Box3d boxAround(const Quadric& quadric) {
  return boundsOf(quadric);
}

template <typename Primitive>
Box3d boxAroundAll(const std::vector<Primitive>& list) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, list.size(), kBoxGrain), Box3d(),
      [&](const auto& part, Box3d box) {
        for (std::size_t n = part.begin(); n < part.end(); ++n) box.extendBy(boxAround(list[n]));
        return box;
      },
      [](Box3d a, const Box3d& b) {
        a.extendBy(b);
        return a;
      });
}

/// Builds the tree of a list. @return numbers of the primitives by place
template <typename Primitive>
std::vector<std::uint32_t> treeOf(const std::vector<Primitive>& list, const QuadricTables& tables,
                                  std::size_t width, std::vector<QuadricNode>& nodes) {
  if (list.empty()) return {};
  std::vector<PrimitiveBox> boxes(list.size());
  const double pad = tables.pad();
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, list.size(), kBoxGrain),
                    [&](const auto& part) {
                      for (std::size_t n = part.begin(); n < part.end(); ++n) {
                        const Box3d box = boxAround(list[n]);
                        PrimitiveBox& to = boxes[n];
                        for (int c = 0; c < 3; ++c) {
                          to.low[c] = static_cast<float>(box.min[c] - tables.origin[c] - pad);
                          to.high[c] = static_cast<float>(box.max[c] - tables.origin[c] + pad);
                        }
                        to.number = static_cast<std::uint32_t>(n);
                        to.unused = 0;
                      }
                    });
  BuiltTree built = buildQuadricTree(boxes, width);
  nodes = std::move(built.nodes);
  nodes.shrink_to_fit();
  return std::move(built.order);
}

/// Calls store(slot, number) for all places of a list, in parallel.
template <typename Store>
void storeAll(const std::vector<std::uint32_t>& order, const Store& store) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, order.size(), kBoxGrain),
                    [&](const auto& part) {
                      for (std::size_t n = part.begin(); n < part.end(); ++n) store(n, order[n]);
                    });
}

StoredQuadric storedOf(const Quadric& quadric, const V3d& origin) {
  StoredQuadric result;
  result.kind = static_cast<std::uint8_t>(quadric.kind);
  result.isCapped = quadric.isCapped ? 1 : 0;
  result.low = static_cast<float>(quadric.range.low);
  result.high = static_cast<float>(quadric.range.high);
  V3d axes[3];
  for (int n = 0; n < 3; ++n)
    for (int c = 0; c < 3; ++c) {
      const auto value = static_cast<float>(quadric.axes[static_cast<std::size_t>(n)][c]);
      result.axes[3 * n + c] = value;
      axes[n][c] = static_cast<double>(value);
    }
  for (int c = 0; c < 3; ++c)
    result.position[c] = static_cast<float>(quadric.position[c] - origin[c]);
  const double volume = axes[0].dot(axes[1].cross(axes[2]));
  for (int n = 0; n < 3; ++n) {
    const V3d row = axes[(n + 1) % 3].cross(axes[(n + 2) % 3]) / volume;
    for (int c = 0; c < 3; ++c) result.inverse[3 * n + c] = row[c];
  }
  return result;
}

template <typename Block>
std::vector<Block> emptyBlocks(std::size_t count) {
  std::vector<Block> blocks(count);
  for (Block& block : blocks)
    std::fill_n(reinterpret_cast<float*>(&block), sizeof(Block) / sizeof(float),
                std::numeric_limits<float>::quiet_NaN());
  return blocks;
}

V3d vectorOf(const float (&array)[3][kQuadricLanes], std::size_t lane) {
  return {static_cast<double>(array[0][lane]), static_cast<double>(array[1][lane]),
          static_cast<double>(array[2][lane])};
}

V3d vectorOf(const float* three) {
  return {static_cast<double>(three[0]), static_cast<double>(three[1]),
          static_cast<double>(three[2])};
}

/// @throws InvalidInput for a cylinder whose ends are equal after rounding to single precision
void requireStoredSticks(const std::vector<Stick>& sticks, const V3d& origin, double reach) {
  for (std::size_t n = 0; n < sticks.size(); ++n) {
    bool isPoint = true;
    for (int c = 0; c < 3; ++c)
      isPoint = isPoint && static_cast<float>(sticks[n].a[c] - origin[c]) ==
                               static_cast<float>(sticks[n].b[c] - origin[c]);
    if (isPoint)
      throw levelset::InvalidInput(
          fmt::format("cylinder {} has a length of {:.3g}, which single precision rounds to 0 in a "
                      "part with the half diagonal {:.3g}; put it into a smaller part",
                      n + 1, (sticks[n].b - sticks[n].a).length(), reach));
  }
}

V3d centreOf(const BallBlock& block, std::size_t lane) {
  return {static_cast<double>(block.x[lane]), static_cast<double>(block.y[lane]),
          static_cast<double>(block.z[lane])};
}

/// Mean length of the edges of the boxes around the blocks of trees.
double meanBlockSize(const std::array<std::vector<QuadricNode>, 3>& trees) {
  double sum = 0;
  std::size_t count = 0;
  for (const std::vector<QuadricNode>& tree : trees)
    for (const QuadricNode& node : tree)
      for (std::size_t n = 0; n < kQuadricLanes; ++n) {
        if ((node.child[n] & QuadricNode::kLeaf) == 0) continue;
        for (std::size_t c = 0; c < 3; ++c)
          sum +=
              static_cast<double>(node.planes[c + 3][n]) - static_cast<double>(node.planes[c][n]);
        count += 3;
      }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

}  // namespace

QuadricKernel::QuadricShape shapeOf(const StoredQuadric& quadric) {
  QuadricKernel::QuadricShape s{};
  s.kind = quadric.kind;
  s.isCapped = quadric.isCapped;
  s.x = static_cast<double>(quadric.position[0]);
  s.y = static_cast<double>(quadric.position[1]);
  s.z = static_cast<double>(quadric.position[2]);
  const double* m = quadric.inverse;
  s.xx = m[0], s.xy = m[1], s.xz = m[2];
  s.yx = m[3], s.yy = m[4], s.yz = m[5];
  s.zx = m[6], s.zy = m[7], s.zz = m[8];
  s.low = static_cast<double>(quadric.low);
  s.high = static_cast<double>(quadric.high);
  return s;
}

std::size_t QuadricTables::bytes() const {
  std::size_t sum = balls.capacity() * sizeof(BallBlock) + sticks.capacity() * sizeof(StickBlock) +
                    quadrics.capacity() * sizeof(StoredQuadric) +
                    colours.capacity() * sizeof(std::uint32_t);
  for (const std::vector<QuadricNode>& tree : trees) sum += tree.capacity() * sizeof(QuadricNode);
  return sum;
}

QuadricKernel::QuadricRoot QuadricTables::rootIn(std::size_t slot,
                                                 const QuadricKernel::QuadricRay& ray) const {
  if (slot < firstStick()) return rootOf<0>(slot, ray);
  return slot < firstQuadric() ? rootOf<1>(slot, ray) : rootOf<2>(slot, ray);
}

V3d QuadricTables::normalAt(std::size_t slot, int face, const V3d& at) const {
  const std::size_t lane = slot % kQuadricLanes;
  if (slot < firstStick()) return (at - centreOf(balls[slot / kQuadricLanes], lane)).normalized();
  if (slot < firstQuadric()) {
    const StickBlock& block = sticks[(slot - firstStick()) / kQuadricLanes];
    const V3d a = vectorOf(block.a, lane), along = (vectorOf(block.b, lane) - a).normalized();
    if (face != QuadricKernel::kSide) return face == QuadricKernel::kLowCap ? -along : along;
    const V3d from = at - a;
    return (from - along * from.dot(along)).normalized();
  }
  const StoredQuadric& stored = quadrics[slot - firstQuadric()];
  const V3d rows[3] = {V3d(stored.inverse[0], stored.inverse[1], stored.inverse[2]),
                       V3d(stored.inverse[3], stored.inverse[4], stored.inverse[5]),
                       V3d(stored.inverse[6], stored.inverse[7], stored.inverse[8])};
  if (face != QuadricKernel::kSide)
    return (face == QuadricKernel::kLowCap ? -rows[2] : rows[2]).normalized();
  const V3d from = at - vectorOf(stored.position);
  const V3d p(rows[0].dot(from), rows[1].dot(from), rows[2].dot(from));
  const auto kind = static_cast<QuadricKind>(stored.kind);
  const double up = kind == QuadricKind::Ellipsoid    ? p.z
                    : kind == QuadricKind::Cylinder   ? 0
                    : kind == QuadricKind::Paraboloid ? -0.5
                                                      : -p.z;
  const V3d gradient = rows[0] * p.x + rows[1] * p.y + rows[2] * up;
  // The apex of a cone has no normal.
  return gradient.length() > 0 ? gradient.normalized() : rows[2].normalized();
}

QuadricTables makeQuadricTables(const QuadricModel& model, std::size_t maxBytes) {
  constexpr double kBytesWhileBuilding = 70, kMoreBytesOfQuadric = 150;
  levelset::requireMemory(kBytesWhileBuilding * static_cast<double>(model.size()) +
                              kMoreBytesOfQuadric * static_cast<double>(model.quadrics.size()),
                          maxBytes);
  QuadricTables tables;
  tables.count = model.size();
  Box3d box = boxAroundAll(model.balls);
  box.extendBy(boxAroundAll(model.sticks));
  box.extendBy(boxAroundAll(model.quadrics));
  tables.origin = box.center();
  tables.reach = 0.5 * box.size().length();
  requireStoredSticks(model.sticks, tables.origin, tables.reach);
  std::vector<std::uint32_t> order = treeOf(model.balls, tables, kQuadricLanes, tables.trees[0]);
  tables.balls = emptyBlocks<BallBlock>(order.size() / kQuadricLanes);
  tables.colours.resize(order.size());
  storeAll(order, [&](std::size_t slot, std::uint32_t number) {
    if (number == kEmptyPlace) return;
    const Ball& ball = model.balls[number];
    BallBlock& block = tables.balls[slot / kQuadricLanes];
    const std::size_t lane = slot % kQuadricLanes;
    block.x[lane] = static_cast<float>(ball.centre.x - tables.origin.x);
    block.y[lane] = static_cast<float>(ball.centre.y - tables.origin.y);
    block.z[lane] = static_cast<float>(ball.centre.z - tables.origin.z);
    block.radius[lane] = ball.radius;
    tables.colours[slot] = ball.colour;
  });
  order = treeOf(model.sticks, tables, kQuadricLanes, tables.trees[1]);
  tables.sticks = emptyBlocks<StickBlock>(order.size() / kQuadricLanes);
  tables.colours.resize(tables.firstQuadric());
  storeAll(order, [&](std::size_t place, std::uint32_t number) {
    if (number == kEmptyPlace) return;
    const Stick& stick = model.sticks[number];
    StickBlock& block = tables.sticks[place / kQuadricLanes];
    const std::size_t lane = place % kQuadricLanes;
    for (int c = 0; c < 3; ++c) {
      block.a[c][lane] = static_cast<float>(stick.a[c] - tables.origin[c]);
      block.b[c][lane] = static_cast<float>(stick.b[c] - tables.origin[c]);
    }
    block.radius[lane] = stick.radius;
    tables.colours[tables.firstStick() + place] = stick.colour;
  });
  order = treeOf(model.quadrics, tables, 1, tables.trees[2]);
  const std::size_t first = tables.firstQuadric();
  tables.quadrics.resize(order.size());
  tables.colours.resize(tables.slotCount());
  storeAll(order, [&](std::size_t place, std::uint32_t number) {
    tables.quadrics[place] = storedOf(model.quadrics[number], tables.origin);
    tables.colours[first + place] = packedColour(model.quadrics[number].colour);
  });
  tables.blockSize = meanBlockSize(tables.trees);
  return tables;
}

Ball ballIn(const QuadricTables& tables, std::size_t slot) {
  const BallBlock& block = tables.balls[slot / kQuadricLanes];
  const std::size_t lane = slot % kQuadricLanes;
  return {tables.origin + centreOf(block, lane), block.radius[lane], tables.colours[slot]};
}

Stick stickIn(const QuadricTables& tables, std::size_t slot) {
  const StickBlock& block = tables.sticks[(slot - tables.firstStick()) / kQuadricLanes];
  const std::size_t lane = slot % kQuadricLanes;
  return {tables.origin + vectorOf(block.a, lane), tables.origin + vectorOf(block.b, lane),
          block.radius[lane], tables.colours[slot]};
}

Quadric quadricIn(const QuadricTables& tables, std::size_t slot) {
  const StoredQuadric& stored = tables.quadrics[slot - tables.firstQuadric()];
  Quadric quadric;
  quadric.kind = static_cast<QuadricKind>(stored.kind);
  quadric.position = tables.origin + vectorOf(stored.position);
  for (std::size_t axis = 0; axis < 3; ++axis)
    quadric.axes[axis] = vectorOf(stored.axes + 3 * axis);
  quadric.range = {static_cast<double>(stored.low), static_cast<double>(stored.high)};
  quadric.isCapped = stored.isCapped != 0;
  quadric.colour = unpackedColour(tables.colours[slot]);
  return quadric;
}

}  // namespace render
