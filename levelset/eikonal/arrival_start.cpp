#include "levelset/eikonal/arrival_start.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "levelset/distance/distance_transform.h"
#include "levelset/memory/memory_limit.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;

// Largest radius around a point source, voxels, in which start times are integrated along straight
// segments. So close to the source, the front is too curved for upwind differences.
constexpr double kStartBall = 8;
// Limits of the speed within the start ball of a point source, as fractions of the speed at the
// source: deviation from a linear function (kLeastLinear), and change of that linear function
// (kMostChange). Within these limits, straight segments are the fastest paths to within 0.03
// voxels.
constexpr double kLeastLinear = 0.02, kMostChange = 0.35;
// Distance between samples of the slowness on a segment, voxels.
constexpr double kSpacing = 0.5;
// A straight segment on which the slowness varies by more than the factor kMostRatio is rejected:
// another path may be faster. Segments shorter than kShortRay voxels are exempt, because the solver
// has no grid point beside them for another path.
constexpr double kMostRatio = 2, kShortRay = 1;
constexpr std::size_t kPointsPerBatch = 64;
constexpr double kBytesPerLeaf = 2300;
// Maximum number of samples for the typical slowness.
constexpr std::size_t kProbes = 1000;

/// Integrates the slowness along a straight segment with Simpson's rule. Positions are in index
/// space; `spacing` is the largest distance of samples, voxels. Returns kFar when the front cannot
/// pass on the segment, or when the segment may not be the fastest path.
float straightTime(const Vec3d& from, const Vec3d& to, const Slowness& slowness, double spacing) {
  const double length = (to - from).length();
  const int pieces = 2 * std::max(1, static_cast<int>(std::ceil(length / (2 * spacing))));
  double least = static_cast<double>(kFar), most = 0, sum = 0;
  for (int k = 0; k <= pieces; ++k) {
    const double here = slowness(from + (to - from) * (static_cast<double>(k) / pieces));
    if (!(here < static_cast<double>(kFar))) return kFar;
    least = std::min(least, here);
    most = std::max(most, here);
    sum += here * (k == 0 || k == pieces ? 1 : k % 2 ? 4 : 2);
  }
  if (length > kShortRay && most > kMostRatio * least) return kFar;
  return static_cast<float>(length * sum / (3 * pieces));
}

/// Returns the offsets, in voxels, of points with half-voxel spacing, shortest first. They cover
/// the start ball of a point source and half a voxel diagonal around it, and include the grid
/// points.
const std::vector<Vec3d>& halfVoxelOffsets() {
  static const std::vector<Vec3d> offsets = [] {
    std::vector<Vec3d> made;
    const double far = kStartBall + 0.9;
    const int reach = static_cast<int>(far / kSpacing);
    for (int x = -reach; x <= reach; ++x)
      for (int y = -reach; y <= reach; ++y)
        for (int z = -reach; z <= reach; ++z)
          if (const Vec3d p = Vec3d(x, y, z) * kSpacing; p.length() <= far) made.push_back(p);
    std::stable_sort(made.begin(), made.end(),
                     [](const Vec3d& a, const Vec3d& b) { return a.lengthSqr() < b.lengthSqr(); });
    return made;
  }();
  return offsets;
}

/// Returns the radius, voxels, of the ball around a source point in which the speed is nearly
/// linear, at most kStartBall. No path that leaves the ball is faster than a straight one within
/// it. 0 where the front cannot pass at the point.
double linearRadius(const Vec3d& point, const Slowness& slowness) {
  const auto speed = [&](const Vec3d& p) {
    const double here = slowness(p);
    return here < static_cast<double>(kFar) ? 1 / here : 0;
  };
  const double own = speed(point);
  if (!(own > 0)) return 0;
  Vec3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d step(0);
    step[axis] = 1;
    slope[axis] = (speed(point + step) - speed(point - step)) / 2;
  }
  double radius = std::min(kStartBall, kMostChange * own / slope.length());
  const Vec3d centre = Coord::round(point).asVec3d();
  for (const Vec3d& sample : halfVoxelOffsets()) {
    if (sample.length() > radius + 0.9) break;
    const Vec3d offset = centre + sample - point;
    const double distance = offset.length();
    if (distance > radius) continue;
    const double change = speed(point + offset) - own;
    if (std::abs(change - slope.dot(offset)) > kLeastLinear * own) radius = distance * (1 - 1e-9);
  }
  return radius;
}

std::vector<StartTime> startAround(const Vec3d& point, const Slowness& slowness) {
  const double linear = slowness ? linearRadius(point, slowness) : kStartBall;
  const double radius = std::max(linear, kStartWidth);
  const int reach = static_cast<int>(std::ceil(radius)) + 1;
  const Coord centre = Coord::round(point);
  std::vector<StartTime> start;
  for (int x = -reach; x <= reach; ++x)
    for (int y = -reach; y <= reach; ++y)
      for (int z = -reach; z <= reach; ++z) {
        const Coord c = centre.offsetBy(x, y, z);
        const double distance = (c.asVec3d() - point).length();
        if (distance > radius) continue;
        const float time = slowness ? straightTime(point, c.asVec3d(), slowness,
                                                   distance <= linear ? kStartBall : kSpacing)
                                    : static_cast<float>(distance);
        if (time < kFar) start.push_back({c, time});
      }
  return start;
}

std::vector<StartTime> activeTimes(const FloatTree& times) {
  std::vector<StartTime> start;
  for (auto it = times.cbeginValueOn(); it; ++it)
    if (*it < kFar) start.push_back({it.getCoord(), *it});
  return start;
}

double medianSlowness(const std::vector<Vec3d>& positions, const Slowness& slowness) {
  std::vector<double> found;
  const std::size_t stride = 1 + positions.size() / kProbes;
  for (std::size_t i = 0; i < positions.size(); i += stride)
    if (const double here = slowness(positions[i]); here < static_cast<double>(kFar))
      found.push_back(here);
  if (found.empty()) return 1;
  const auto middle = found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2);
  std::nth_element(found.begin(), middle, found.end());
  return *middle;
}

}  // namespace

std::vector<StartTime> startAtSurface(const FloatGrid& field, const ArrivalStart& start) {
  DistanceRequest near;
  near.halfWidth = kStartWidth;
  near.maxMemory = start.maxMemory;
  near.progress = start.progress;
  if (!start.slowness) {
    const double inverse = 1 / field.voxelSize()[0];
    const FloatGrid::Ptr distance = distanceTransform(field, near);
    std::vector<StartTime> times;
    for (auto it = distance->cbeginValueOn(); it; ++it)
      times.push_back({it.getCoord(), static_cast<float>(std::abs(*it) * inverse)});
    return times;
  }
  FloatTree times(kFar);
  std::mutex mutex;
  near.visitPoints = [&](const LeafNode& leaf, const ClosestPointLeaf& points) {
    auto part = std::make_unique<LeafNode>(leaf.origin(), kFar, false);
    for (auto it = leaf.cbeginValueOn(); it; ++it)
      part->setValueOn(it.pos(), straightTime(points[it.pos()], it.getCoord().asVec3d(),
                                              start.slowness, kSpacing));
    const std::lock_guard lock(mutex);
    times.addLeaf(part.release());
  };
  (void)distanceTransform(field, near);
  return activeTimes(times);
}

std::vector<StartTime> startAtPoints(std::span<const Vec3d> points, const ArrivalStart& start) {
  // The start balls of neighbouring points overlap. The tree keeps one time for each grid point, so
  // its memory grows with the covered volume, not with the number of points.
  FloatTree times(kFar);
  std::vector<std::vector<StartTime>> parts(kPointsPerBatch);
  for (std::size_t begin = 0; begin < points.size(); begin += kPointsPerBatch) {
    const std::size_t count = std::min(kPointsPerBatch, points.size() - begin);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      parts[i] = startAround(points[begin + i], start.slowness);
    });
    FloatGrid::Accessor accessor(times);
    for (std::size_t i = 0; i < count; ++i)
      for (const StartTime& s : parts[i])
        if (s.time < accessor.getValue(s.gridPoint)) accessor.setValue(s.gridPoint, s.time);
    requireMemory(times.leafCount() * kBytesPerLeaf +
                      static_cast<double>(times.activeVoxelCount() * sizeof(StartTime)),
                  memoryLimit(start.maxMemory));
    report(start.progress, static_cast<double>(begin + count) / static_cast<double>(points.size()));
  }
  return activeTimes(times);
}

double typicalSlowness(const FloatGrid& field, const Slowness& slowness) {
  std::vector<Vec3d> positions;
  const auto near = static_cast<float>(field.voxelSize()[0]);
  for (auto leaf = field.tree().cbeginLeaf(); leaf; ++leaf)
    for (auto it = leaf->cbeginValueOn(); it; ++it) {
      if (std::abs(*it) > near) continue;
      positions.push_back(it.getCoord().asVec3d());
      break;  // one sample per leaf is enough
    }
  return medianSlowness(positions, slowness);
}

double typicalSlowness(std::span<const Vec3d> points, const Slowness& slowness) {
  return medianSlowness({points.begin(), points.end()}, slowness);
}

}  // namespace levelset::eikonal
