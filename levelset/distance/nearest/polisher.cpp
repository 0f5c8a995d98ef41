#include "levelset/distance/nearest/polisher.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "levelset/distance/surface/closest_point.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::Vec3d;
using LeafNode = openvdb::FloatTree::LeafNodeType;

// If the nearest surface points of two neighbouring grid points are farther apart than this, in
// voxels, these points belong to different parts of the surface.
constexpr double kOtherPart = 2;
// The error of distances by tricubic interpolation, voxels, is about kTricubicError times the
// square of the curvature. Its lower limit is kRounding.
constexpr double kTricubicError = 0.03, kRounding = 1e-6;
// Number of searches for a foot point. Each starts where the search before it left its dense block,
// the stored values around a leaf.
constexpr int kAttempts = 4;

}  // namespace

double Polisher::interpolationError(std::uint32_t point) const {
  const Jet jet = points_.jets[point].jet();
  const double bend = jet.xx * jet.xx + jet.yy * jet.yy + jet.zz * jet.zz +
                      2 * (jet.xy * jet.xy + jet.xz * jet.xz + jet.yz * jet.yz);
  const double slope = jet.gradient.lengthSqr();
  return std::max(kRounding, slope > 0 ? kTricubicError * bend / slope : 0);
}

void Polisher::load(const NearestPoints::Block& block) {
  loaded_ = &block;
  // Surface points of the block and of its border. Starts to fetch their positions from memory
  // before any position is used.
  std::array<std::uint32_t, kSlots> points;
  points.fill(NearestPoints::kNone);
  const auto copyRow = [&](const NearestPoints::Block* from, int x, int y) {
    if (from)
      std::memcpy(&points[slot(x, y, 0)],
                  &from->nearest[LeafNode::coordToOffset(Coord(x & 7, y & 7, 0))],
                  8 * sizeof(std::uint32_t));
  };
  const auto& beside = block.neighbours;
  for (int i = 0; i < 8; ++i) {
    for (int y = 0; y < 8; ++y) copyRow(&block, i, y);
    copyRow(beside[4], -1, i);
    copyRow(beside[22], 8, i);
    copyRow(beside[10], i, -1);
    copyRow(beside[16], i, 8);
    for (int y = 0; y < 8; ++y) {
      const openvdb::Index row = LeafNode::coordToOffset(Coord(i, y, 0));
      if (beside[12]) points[slot(i, y, -1)] = beside[12]->nearest[row + 7];
      if (beside[14]) points[slot(i, y, 8)] = beside[14]->nearest[row];
    }
  }
  const auto prefetch = [](const auto* object) {  // an object may extend over two cache lines
    __builtin_prefetch(object);
    __builtin_prefetch(reinterpret_cast<const char*>(object + 1) - 1);
  };
  for (const std::uint32_t point : points)
    if (point != NearestPoints::kNone) {
      prefetch(&points_.positions[point]);
      prefetch(&points_.jets[point]);
    }
  const Vec3d origin = block.origin.asVec3d();
  for (std::size_t i = 0; i < kSlots; ++i) {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    const openvdb::Vec3f position = points[i] == NearestPoints::kNone
                                        ? openvdb::Vec3f(kNone)
                                        : openvdb::Vec3f(points_.positions[points[i]] - origin);
    for (int axis = 0; axis < 3; ++axis)
      nearest_[static_cast<std::size_t>(axis)][i] = position[axis];
  }

  // For each grid point, compares its surface point with those of its neighbours, four grid points
  // at once. Comparisons with NaN are false. The limit is below kOtherPart by more than the
  // rounding errors.
  constexpr auto kLimit = static_cast<float>(kOtherPart * kOtherPart * 0.99);
  constexpr std::size_t kSteps[] = {std::size_t{kSide} * kRow, kRow, 1};
  const auto four = [&](std::size_t axis, std::size_t first) {
    FloatLanes values;
    std::memcpy(&values, &nearest_[axis][first], sizeof(values));
    return values;
  };
  meetsOther_.setOff();
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; z += kLanes) {
        const std::size_t first = slot(x, y, z);
        IntLanes isFar = {0, 0, 0, 0};
        for (const std::size_t step : kSteps)
          for (const std::size_t other : {first - step, first + step}) {
            const FloatLanes dx = four(0, other) - four(0, first),
                             dy = four(1, other) - four(1, first),
                             dz = four(2, other) - four(2, first);
            isFar |= dx * dx + dy * dy + dz * dz >= kLimit;
          }
        std::uint64_t any[2];
        std::memcpy(any, &isFar, sizeof(any));
        if (!(any[0] | any[1])) continue;
        for (int lane = 0; lane < kLanes; ++lane)
          if (isFar[lane]) meetsOther_.setOn(LeafNode::coordToOffset(Coord(x, y, z + lane)));
      }
}

void Polisher::prepare(const NearestPoints::Block& block, const NearestPoints::Mask& gridPoints) {
  if (loaded_ != &block) load(block);
  preparedBlock_ = &block;
  prepared_ = gridPoints;
  candidates_.clear();
  searches_.clear();
  for (auto it = gridPoints.beginOn(); it; ++it) addCandidates(block, it.pos());
  polishCandidates();
  for (std::size_t i = 0; i < candidates_.size(); ++i)
    closest_[candidates_[i].n].takeIfNearer(polished_[i]);
}

const Closest& Polisher::closest(const NearestPoints::Block& block, openvdb::Index n) {
  if (preparedBlock_ != &block || !prepared_.isOn(n)) {
    NearestPoints::Mask only;
    only.setOn(n);
    prepare(block, only);
  }
  return closest_[n];
}

void Polisher::addCandidates(const NearestPoints::Block& block, openvdb::Index n) {
  const Coord c = block.origin + LeafNode::offsetToLocalCoord(n);
  const Vec3d x = c.asVec3d();
  const std::uint32_t first = block.nearest[n];
  const Vec3d nearest = points_.positions[first];
  const double start = (x - nearest).length();
  const auto add = [&](std::uint32_t point) {
    candidates_.push_back({n, point});
    searches_.push_back({x, points_.positions[point], &points_.jets[point]});
  };
  closest_[n] = Closest{nearest, start};
  if (!block.own.isOn(n)) add(first);
  if (!meetsOther_.isOn(n)) return;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = -1; side <= 1; side += 2) {
      Coord beside = c;
      beside[axis] += side;
      const std::uint32_t other = NearestPoints::nearestAt(block, beside);
      if (other == NearestPoints::kNone || other == first) continue;
      const Vec3d point = points_.positions[other];
      if ((point - nearest).lengthSqr() < kOtherPart * kOtherPart) continue;
      if ((x - point).length() < start + kPolishGain) add(other);
    }
}

void Polisher::polishCandidates() {
  closestPointsByTwoSteps(cache_, searches_, feet_);
  polished_.resize(candidates_.size());
  slow_.clear();
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    const Foot& foot = feet_[i];
    if (points_.sharp[candidates_[i].point])
      polished_[i] = polishOnPatches(searches_[i].from, candidates_[i].point);
    else if (foot.converged && !patches_.covers(Coord::floor(foot.point)) &&
             isOnSurface(foot.point))
      polished_[i] = {foot.point, foot.distance};
    else
      slow_.push_back(i);
  }
  polishOnInterpolant(slow_);
}

Closest Polisher::polishOnPatches(const Vec3d& x, std::uint32_t point) {
  const Vec3d start = points_.positions[point];
  const SharpPatches::Hit hit = patches_.nearest(x, (x - start).length());
  if (!hit.found) return {start, (x - start).length()};
  if (patches_.covers(Coord::floor(hit.point))) return {hit.point, hit.distance};
  return polishOnInterpolant(x, hit.point);
}

void Polisher::polishOnInterpolant(std::vector<std::size_t>& candidates) {
  while (!candidates.empty()) {
    // Takes the candidates that start in the same block as the first one.
    const Coord origin = leafOrigin(searches_[candidates.front()].start);
    const Vec3d corner = origin.asVec3d();
    group_.clear();
    slowSearches_.clear();
    std::erase_if(candidates, [&](std::size_t i) {
      const JetSearch& search = searches_[i];
      if (leafOrigin(search.start) != origin) return false;
      group_.push_back(i);
      slowSearches_.push_back({search.from - corner, search.start - corner});
      return true;
    });
    closestPoints(cache_.at(origin), slowSearches_, feet_);
    for (std::size_t i = 0; i < group_.size(); ++i) {
      const JetSearch& search = searches_[group_[i]];
      polished_[group_[i]] = polishOnInterpolant(search.from, search.start, &feet_[i]);
    }
  }
}

Closest Polisher::polishOnInterpolant(const Vec3d& x, Vec3d start, const Foot* known) {
  const Closest first{start, (x - start).length()};
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const DenseBlock& block = cache_.around(start);
    const Vec3d origin = block.origin().asVec3d();
    const Foot foot = known ? *known : closestPoint(block, x - origin, start - origin);
    known = nullptr;
    if (foot.converged) {
      if (!changesSignAround(block, foot.point)) break;
      const Closest smooth{foot.point + origin, foot.distance};
      if (!patches_.covers(Coord::floor(smooth.point))) return smooth;
      const SharpPatches::Hit hit = patches_.nearest(x, foot.distance + kPolishGain);
      return hit.found ? Closest{hit.point, hit.distance} : smooth;
    }
    if (!foot.left) break;
    start = foot.point + origin;
  }
  return first;
}

bool Polisher::isOnSurface(const Vec3d& point) {
  const DenseBlock& block = cache_.around(point);
  return changesSignAround(block, point - block.origin().asVec3d());
}

}  // namespace levelset::eikonal
