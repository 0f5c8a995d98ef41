#include "levelset/molecules/ball_union.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/molecules/ball_arcs.h"
#include "levelset/progress_gate.h"

namespace levelset {

/// BallCell of the octree. The candidates of a leaf are all balls and arcs that may be the closest
/// ones to a point of the cell.
struct BallCell {
  std::uint32_t child = 0;  ///< index of the first of eight children; 0: a leaf
  std::uint32_t balls = 0, ballCount = 0, arcs = 0, arcCount = 0;  ///< ranges of a leaf
  bool isDeep = false;  ///< all points of the cell are deeper than the depth of the union
  bool isFar = false;   ///< all points of the cell are farther outside than that depth
};

struct BallOctree {
  std::vector<BallCell> cells;
  std::vector<std::uint32_t> balls, arcs;

  [[nodiscard]] std::size_t bytes() const {
    return sizeof(BallCell) * cells.capacity() +
           sizeof(std::uint32_t) * (balls.capacity() + arcs.capacity());
  }
};

/// Node of a tree of balls, for points far from the union.
struct BallGroup {
  Imath::Box3d centres;
  double radius = 0;         ///< largest radius
  std::uint32_t first = 0;   ///< first ball of a leaf, in the order of the tree
  std::uint32_t count = 0;   ///< number of balls of a leaf; 0: an inner node
  std::uint32_t second = 0;  ///< index of the second child; the first one follows its parent
};

namespace {

using Imath::Box3d;
using Imath::V3d;

constexpr double kSqrt3 = 1.7320508075688772;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A cell with fewer candidates is not split.
constexpr std::size_t kFewBallsOutside = 48;
constexpr std::size_t kFewBalls = 6, kFewArcs = 6;
constexpr int kMostLevels = 40;
// The cells of this level are built as independent tasks.
constexpr int kTaskLevel = 2;

double depthIn(const Ball& ball, const V3d& point) {
  return ball.radius - (point - ball.centre).length();
}

V3d childCentre(const V3d& centre, double half, int child) {
  return centre +
         V3d(child & 1 ? half : -half, child & 2 ? half : -half, child & 4 ? half : -half) / 2;
}

}  // namespace

V3d ExposedArc::closest(const V3d& point) const {
  const V3d from = point - centre;
  double x = from.dot(u), y = from.dot(v);
  const double length = std::sqrt(x * x + y * y);
  if (length > 0 ? x >= cosHalf * length : true) {
    if (length > 0) {
      x /= length;
      y /= length;
    } else {  // on the axis all points are equally close
      x = 1;
    }
  } else {
    x = cosHalf;
    y = std::copysign(sinHalf, y);
  }
  return centre + (u * x + v * y) * radius;
}

double ExposedArc::distance(const V3d& point) const {
  const V3d from = point - centre;
  const double x = from.dot(u), y = from.dot(v), z = from.dot(w);
  const double length = std::sqrt(x * x + y * y);
  if (x >= cosHalf * length) return std::sqrt((length - radius) * (length - radius) + z * z);
  const double dx = x - radius * cosHalf, dy = std::abs(y) - radius * sinHalf;
  return std::sqrt(dx * dx + dy * dy + z * z);
}

struct BallUnion::Data {
  V3d origin{0};
  std::vector<Ball> balls;  ///< relative to the origin
  std::vector<char> isHidden;
  BallLists overlaps;
  std::vector<ExposedArc> arcs;
  Box3d bounds;  ///< relative to the origin
  double depth = 0;
  V3d centre{0};  ///< centre of the octree
  double half = 0;
  double leaf = 0;  ///< edge of the smallest cells
  BallOctree tree;
  std::vector<BallGroup> groups;
  std::vector<std::uint32_t> grouped;  ///< balls in the order of the groups

  /// Work of the tasks that build the octree.
  struct Build {
    ProgressGate gate;
    std::size_t maxBytes;
    std::atomic<std::size_t> bytes = 0;
    /// @throws ResourceLimit, Cancelled
    void add(std::size_t more) {
      requireMemory(2.0 * static_cast<double>(bytes += more), maxBytes);
      gate.advance(0);
    }
  };
  void build(std::size_t maxBytes, const Progress& progress);
  void group(std::uint32_t begin, std::uint32_t end);
  /// Ball whose sphere is the closest one to a point outside all balls.
  [[nodiscard]] std::uint32_t closestBall(const V3d& point) const;
  /// Closest point of the boundary to a point outside.
  [[nodiscard]] Foot footFrom(const V3d& point) const {
    Foot foot;
    foot.feature = closestBall(point);
    const Ball& ball = balls[foot.feature];
    foot.distance = -depthIn(ball, point);
    foot.isExact = true;
    foot.point = ball.centre + (point - ball.centre).normalized() * ball.radius;
    return foot;
  }
  /// Builds the cells below a cell.
  void descend(BallOctree& out, std::uint32_t cell, const V3d& at, double cellHalf, int level,
               const std::vector<std::uint32_t>& ballsOf, const std::vector<std::uint32_t>& arcsOf,
               Build& work) const;

  /// Closest point among candidates.
  template <class Balls, class Arcs>
  [[nodiscard]] Foot closestAmong(const V3d& point, const Balls& ballsOf,
                                  const Arcs& arcsOf) const {
    Foot foot;
    double most = -kInfinity;
    for (const std::uint32_t n : ballsOf) {
      const double deep = depthIn(balls[n], point);
      if (deep > most) {
        most = deep;
        foot.feature = n;
      }
    }
    const Ball& ball = balls[foot.feature];
    const V3d from = point - ball.centre;
    const double length = from.length();
    foot.point =
        ball.centre + (length > 0 ? from * (ball.radius / length) : V3d(0, 0, ball.radius));
    foot.distance = -most;
    foot.isExact = true;
    if (most <= 0 || !isCovered(balls, overlaps, foot.feature, foot.point)) return foot;
    double least = kInfinity;
    for (const std::uint32_t n : arcsOf) {
      const double distance = arcs[n].distance(point);
      if (distance < least) {
        least = distance;
        foot.feature = n;
      }
    }
    foot.isOnArc = true;
    foot.isExact = least <= depth;
    foot.distance = foot.isExact ? -least : -std::max(depth, most);
    if (foot.isExact) foot.point = arcs[foot.feature].closest(point);
    return foot;
  }
};

namespace {

/// Range of indices.
struct Range {
  const std::uint32_t *first, *last;
  [[nodiscard]] const std::uint32_t* begin() const { return first; }
  [[nodiscard]] const std::uint32_t* end() const { return last; }
};

}  // namespace

void BallUnion::Data::build(std::size_t maxBytes, const Progress& progress) {
  const V3d size = bounds.size();
  std::vector<double> radii;
  for (std::size_t n = 0; n < balls.size(); ++n)
    if (!isHidden[n]) radii.push_back(balls[n].radius);
  std::nth_element(radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2),
                   radii.end());
  leaf = 0.35 * radii[radii.size() / 2];
  centre = bounds.center();
  half = std::max({size.x, size.y, size.z}) / 2 + depth;
  std::vector<std::uint32_t> allBalls, allArcs(arcs.size());
  for (std::uint32_t n = 0; n < balls.size(); ++n)
    if (!isHidden[n]) allBalls.push_back(n);
  for (std::uint32_t n = 0; n < arcs.size(); ++n) allArcs[n] = n;
  grouped = allBalls;
  group(0, static_cast<std::uint32_t>(grouped.size()));

  // The cells of two levels are split one after the other, and those below them in parallel.
  struct Task {
    std::uint32_t cell;
    V3d at;
    double half;
    int level;
    BallOctree tree;
  };
  std::vector<Task> open, tasks;
  tree.cells.resize(1);
  open.push_back({0, centre, half, 0, {}});
  while (!open.empty()) {
    Task task = std::move(open.back());
    open.pop_back();
    if (task.level == kTaskLevel) {
      tasks.push_back(std::move(task));
      continue;
    }
    const auto child = static_cast<std::uint32_t>(tree.cells.size());
    tree.cells[task.cell].child = child;
    tree.cells.resize(tree.cells.size() + 8);
    for (int n = 0; n < 8; ++n)
      open.push_back({child + static_cast<std::uint32_t>(n),
                      childCentre(task.at, task.half, n),
                      task.half / 2,
                      task.level + 1,
                      {}});
  }
  Build work{ProgressGate(progress, tasks.size()), maxBytes};
  tbb::parallel_for(std::size_t{0}, tasks.size(), [&](std::size_t n) {
    Task& task = tasks[n];
    task.tree.cells.resize(1);
    descend(task.tree, 0, task.at, task.half, task.level, allBalls, allArcs, work);
    work.gate.advance(1);
  });
  std::size_t cells = tree.cells.size(), ballCount = 0, arcCount = 0;
  for (const Task& task : tasks) {
    cells += task.tree.cells.size() - 1;
    ballCount += task.tree.balls.size();
    arcCount += task.tree.arcs.size();
  }
  tree.cells.reserve(cells);
  tree.balls.reserve(ballCount);
  tree.arcs.reserve(arcCount);
  for (Task& task : tasks) {
    // BallCell 0 of the task is the cell in the tree. Its other cells follow at the end.
    const auto cellsBefore = static_cast<std::uint32_t>(tree.cells.size()) - 1;
    const auto ballsBefore = static_cast<std::uint32_t>(tree.balls.size()),
               arcsBefore = static_cast<std::uint32_t>(tree.arcs.size());
    for (std::size_t n = 0; n < task.tree.cells.size(); ++n) {
      BallCell cell = task.tree.cells[n];
      if (cell.child) cell.child += cellsBefore;
      cell.balls += ballsBefore;
      cell.arcs += arcsBefore;
      if (n == 0)
        tree.cells[task.cell] = cell;
      else
        tree.cells.push_back(cell);
    }
    tree.balls.insert(tree.balls.end(), task.tree.balls.begin(), task.tree.balls.end());
    tree.arcs.insert(tree.arcs.end(), task.tree.arcs.begin(), task.tree.arcs.end());
    task.tree = {};
  }
}

void BallUnion::Data::descend(BallOctree& out, std::uint32_t cell, const V3d& at, double cellHalf,
                              int level, const std::vector<std::uint32_t>& ballsOf,
                              const std::vector<std::uint32_t>& arcsOf, Build& work) const {
  // Distances change by at most `reach` between the centre and a point of the cell.
  const double reach = cellHalf * kSqrt3 * (1 + 1e-12) + 1e-12 * half;
  const Foot foot = closestAmong(at, ballsOf, arcsOf);
  double most = -kInfinity;
  for (const std::uint32_t n : ballsOf) most = std::max(most, depthIn(balls[n], at));
  std::vector<std::uint32_t> nearBalls, nearArcs;
  const bool isDeep = -foot.distance - reach > depth, isFar = most + reach < -depth;
  if (!isDeep && !isFar) {
    for (const std::uint32_t n : ballsOf)
      if (depthIn(balls[n], at) >= most - 2 * reach) nearBalls.push_back(n);
    if (most + reach > 0) {
      const double boundary = foot.isExact ? std::abs(foot.distance) : depth + 2 * reach;
      const double limit = std::min(depth, boundary + reach) + reach;
      for (const std::uint32_t n : arcsOf)
        if (arcs[n].distance(at) <= limit) nearArcs.push_back(n);
    }
  }
  // Cells outside all balls need no arcs, and fill most of the space.
  const std::size_t few = most + reach < 0 ? kFewBallsOutside : kFewBalls;
  const bool isFine = 2 * cellHalf <= leaf || level >= kMostLevels ||
                      (nearBalls.size() <= few && nearArcs.size() <= kFewArcs);
  if (isDeep || isFar || isFine) {
    BallCell& leafCell = out.cells[cell];
    leafCell.isDeep = isDeep;
    leafCell.isFar = isFar;
    leafCell.balls = static_cast<std::uint32_t>(out.balls.size());
    leafCell.ballCount = static_cast<std::uint32_t>(nearBalls.size());
    leafCell.arcs = static_cast<std::uint32_t>(out.arcs.size());
    leafCell.arcCount = static_cast<std::uint32_t>(nearArcs.size());
    out.balls.insert(out.balls.end(), nearBalls.begin(), nearBalls.end());
    out.arcs.insert(out.arcs.end(), nearArcs.begin(), nearArcs.end());
    work.add(sizeof(std::uint32_t) * (nearBalls.size() + nearArcs.size()));
    return;
  }
  const auto child = static_cast<std::uint32_t>(out.cells.size());
  out.cells[cell].child = child;
  out.cells.resize(out.cells.size() + 8);
  work.add(8 * sizeof(BallCell) + 4 * (nearBalls.size() + nearArcs.size()));
  for (int n = 0; n < 8; ++n)
    descend(out, child + static_cast<std::uint32_t>(n), childCentre(at, cellHalf, n), cellHalf / 2,
            level + 1, nearBalls, nearArcs, work);
}

void BallUnion::Data::group(std::uint32_t begin, std::uint32_t end) {
  const std::size_t number = groups.size();
  groups.emplace_back();
  BallGroup group;
  for (std::uint32_t n = begin; n < end; ++n) {
    group.centres.extendBy(balls[grouped[n]].centre);
    group.radius = std::max(group.radius, balls[grouped[n]].radius);
  }
  if (end - begin <= kFewBalls) {
    group.first = begin;
    group.count = end - begin;
    groups[number] = group;
    return;
  }
  const V3d size = group.centres.size();
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(grouped.begin() + begin, grouped.begin() + middle, grouped.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     const double x = balls[a].centre[axis], y = balls[b].centre[axis];
                     return x != y ? x < y : a < b;
                   });
  this->group(begin, middle);
  group.second = static_cast<std::uint32_t>(groups.size());
  groups[number] = group;
  this->group(middle, end);
}

std::uint32_t BallUnion::Data::closestBall(const V3d& point) const {
  // No sphere of a group is nearer than its box less the largest radius.
  const auto bound = [&](std::uint32_t number) {
    const BallGroup& of = groups[number];
    double squared = 0;
    for (int c = 0; c < 3; ++c) {
      const double out =
          std::max({of.centres.min[c] - point[c], point[c] - of.centres.max[c], 0.0});
      squared += out * out;
    }
    return std::sqrt(squared) - of.radius;
  };
  double least = kInfinity;
  std::uint32_t closest = 0;
  std::array<std::pair<double, std::uint32_t>, 80> stack;  // the tree has at most 32 levels
  std::size_t open = 0;
  stack[open++] = {bound(0), 0};
  while (open > 0) {
    const auto [nearest, number] = stack[--open];
    if (nearest > least) continue;
    const BallGroup& of = groups[number];
    for (std::uint32_t n = of.first; n < of.first + of.count; ++n) {
      const double distance = -depthIn(balls[grouped[n]], point);
      if (distance < least || (distance == least && grouped[n] < closest)) {
        least = distance;
        closest = grouped[n];
      }
    }
    if (of.count > 0) continue;
    std::pair<double, std::uint32_t> near{bound(number + 1), number + 1},
        far{bound(of.second), of.second};
    if (far.first < near.first) std::swap(near, far);
    stack[open++] = far;
    stack[open++] = near;
  }
  return closest;
}

BallUnion::BallUnion(std::vector<Ball> balls, double depth, std::size_t maxBytes,
                     const Progress& progress) {
  if (balls.empty()) throw InvalidInput("there is no ball; give at least one");
  if (!(depth >= 0) || !std::isfinite(depth))
    throw InvalidInput(fmt::format("the depth is {}; give a finite length of at least 0", depth));
  if (balls.size() >= (std::size_t{1} << 31)) throw InvalidInput("there are 2^31 balls or more");
  auto data = std::make_shared<Data>();
  Box3d bounds;
  for (std::size_t n = 0; n < balls.size(); ++n) {
    const Ball& ball = balls[n];
    const V3d& c = ball.centre;
    if (!std::isfinite(c.x) || !std::isfinite(c.y) || !std::isfinite(c.z) || !(ball.radius > 0) ||
        !std::isfinite(ball.radius))
      throw InvalidInput(fmt::format(
          "ball {} has the centre {},{},{} and the radius {}; give finite numbers and a "
          "positive radius",
          n, c.x, c.y, c.z, ball.radius));
    bounds.extendBy(c - V3d(ball.radius));
    bounds.extendBy(c + V3d(ball.radius));
  }
  // Far from the origin, differences of coordinates keep their precision.
  data->origin = bounds.center();
  data->bounds = Box3d(bounds.min - data->origin, bounds.max - data->origin);
  for (Ball& ball : balls) ball.centre -= data->origin;
  data->balls = std::move(balls);
  data->depth = depth;
  maxBytes = memoryLimit(maxBytes);
  data->overlaps = overlapsOf(data->balls, data->isHidden, maxBytes, subProgress(progress, 0, 0.1));
  data->arcs = exposedArcs(data->balls, data->overlaps, maxBytes, subProgress(progress, 0.1, 0.5));
  data->build(maxBytes, subProgress(progress, 0.5, 1));
  data_ = std::move(data);
}

BallUnion::Foot BallUnion::closest(const V3d& point) const {
  const Data& data = *data_;
  const V3d from = point - data.origin;
  V3d at = data.centre;
  double half = data.half;
  Foot foot;
  const V3d away = from - at;
  if (std::max({std::abs(away.x), std::abs(away.y), std::abs(away.z)}) > half) {
    foot = data.footFrom(from);  // outside the octree, and so outside the union
  } else {
    const BallCell* cell = data.tree.cells.data();
    while (cell->child) {
      const int n = (from.x > at.x ? 1 : 0) | (from.y > at.y ? 2 : 0) | (from.z > at.z ? 4 : 0);
      at = childCentre(at, half, n);
      half /= 2;
      cell = &data.tree.cells[cell->child + static_cast<std::uint32_t>(n)];
    }
    if (cell->isDeep) {
      foot.distance = -data.depth;
      return foot;
    }
    if (cell->isFar) {
      foot = data.footFrom(from);
      foot.point += data.origin;
      return foot;
    }
    const std::uint32_t *balls = data.tree.balls.data() + cell->balls,
                        *arcs = data.tree.arcs.data() + cell->arcs;
    foot = data.closestAmong(from, Range{balls, balls + cell->ballCount},
                             Range{arcs, arcs + cell->arcCount});
  }
  foot.point += data.origin;
  return foot;
}

double BallUnion::distance(const V3d& point) const {
  return closest(point).distance;
}

bool BallUnion::footOn(const Foot& feature, const V3d& point, Foot& foot) const {
  const Data& data = *data_;
  const V3d at = point - data.origin;
  foot = feature;
  foot.isExact = true;
  if (feature.isOnArc) {
    const ExposedArc& arc = data.arcs[feature.feature];
    foot.point = arc.closest(at) + data.origin;
    foot.distance = -arc.distance(at);
    return true;
  }
  const Ball& ball = data.balls[feature.feature];
  const V3d from = at - ball.centre;
  const double length = from.length();
  if (!(length > 0)) return false;
  const V3d on = ball.centre + from * (ball.radius / length);
  foot.point = on + data.origin;
  foot.distance = length - ball.radius;
  return !isCovered(data.balls, data.overlaps, feature.feature, on);
}

const V3d& BallUnion::origin() const {
  return data_->origin;
}
Ball BallUnion::ball(std::size_t index) const {
  const Ball& ball = data_->balls[index];
  return {ball.centre + data_->origin, ball.radius};
}
const std::vector<ExposedArc>& BallUnion::arcs() const {
  return data_->arcs;
}
Box3d BallUnion::bounds() const {
  return {data_->bounds.min + data_->origin, data_->bounds.max + data_->origin};
}

namespace {

/// The exposed parts of all balls.
std::vector<ExposedPart> exposedParts(const std::vector<Ball>& balls,
                                      const std::vector<char>& isHidden, const BallLists& overlaps,
                                      const std::vector<ExposedArc>& arcs) {
  std::vector<std::vector<const ExposedArc*>> arcsOf(balls.size());
  for (const ExposedArc& arc : arcs) {
    arcsOf[arc.first].push_back(&arc);
    arcsOf[arc.second].push_back(&arc);
  }
  std::vector<ExposedPart> parts(balls.size());
  tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t n) {
    if (!isHidden[n])
      parts[n] = exposedPart(balls, overlaps, static_cast<std::uint32_t>(n), arcsOf[n]);
  });
  return parts;
}

}  // namespace

BallUnion::Exposure BallUnion::exposure() const {
  const std::vector<ExposedPart> parts =
      exposedParts(data_->balls, data_->isHidden, data_->overlaps, data_->arcs);
  Exposure exposure;
  double sum = 0;
  for (std::size_t n = 0; n < parts.size(); ++n) {
    exposure.areas.push_back(parts[n].area);
    sum += data_->balls[n].radius * parts[n].area + data_->balls[n].centre.dot(parts[n].normal);
  }
  exposure.volume = sum / 3;
  return exposure;
}

std::vector<double> BallUnion::volumes(std::size_t maxBytes) const {
  // Lists of arcs, and a face for each pair of balls that meet.
  constexpr double kBytesOfBall = 150, kBytesOfArc = 16, kBytesOfPair = 24;
  requireMemory(kBytesOfBall * static_cast<double>(data_->balls.size()) +
                    kBytesOfArc * static_cast<double>(data_->arcs.size()) +
                    kBytesOfPair * 0.5 * static_cast<double>(data_->overlaps.items.size()),
                maxBytes);
  return powerVolumes(data_->balls, data_->overlaps, exposure().areas);
}

std::vector<BallUnion::Boundary> BallUnion::boundaries(std::size_t maxBytes) const {
  // Lists of arcs, and at most a piece of the boundary for each arc.
  constexpr double kBytesOfBall = 100, kBytesOfArc = 150;
  requireMemory(kBytesOfBall * static_cast<double>(data_->balls.size()) +
                    kBytesOfArc * static_cast<double>(data_->arcs.size()),
                maxBytes);
  return boundariesOf(data_->balls, data_->isHidden, data_->overlaps, data_->arcs);
}

std::size_t BallUnion::bytes() const {
  return data_->tree.bytes() + sizeof(BallGroup) * data_->groups.capacity() +
         sizeof(ExposedArc) * data_->arcs.capacity() + sizeof(Ball) * data_->balls.capacity() +
         sizeof(std::uint32_t) * data_->overlaps.items.capacity();
}

}  // namespace levelset
