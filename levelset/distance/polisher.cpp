#include "levelset/distance/polisher.h"

#include <algorithm>
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
  const auto prefetch = [](const auto* object) {  // an object may extend over two cache lines
    __builtin_prefetch(object);
    __builtin_prefetch(reinterpret_cast<const char*>(object + 1) - 1);
  };
  // Reads the surface points of the block and of its border first and starts to fetch their
  // positions from memory, before any position is used.
  std::array<std::uint32_t, 512 + 6 * 64> points;
  std::array<std::uint16_t, 512 + 6 * 64> slots;
  std::size_t count = 0;
  const auto list = [&](const Coord& c, std::uint32_t point) {
    slots[count] = static_cast<std::uint16_t>(slot(c.x(), c.y(), c.z()));
    points[count++] = point;
    if (point != NearestPoints::kNone) prefetch(&points_.positions[point]);
  };
  for (openvdb::Index n = 0; n < 512; ++n) {
    list(LeafNode::offsetToLocalCoord(n), block.nearest[n]);
    if (block.nearest[n] != NearestPoints::kNone) prefetch(&points_.jets[block.nearest[n]]);
  }
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 8})
      for (int i = 0; i < 64; ++i) {
        Coord c;
        c[axis] = side;
        c[(axis + 1) % 3] = i >> 3;
        c[(axis + 2) % 3] = i & 7;
        list(c, NearestPoints::nearestAt(block, block.origin + c));
      }
  const Vec3d origin = block.origin.asVec3d();
  for (std::size_t i = 0; i < count; ++i) {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    const openvdb::Vec3f position = points[i] == NearestPoints::kNone
                                        ? openvdb::Vec3f(kNone)
                                        : openvdb::Vec3f(points_.positions[points[i]] - origin);
    for (int axis = 0; axis < 3; ++axis)
      nearest_[static_cast<std::size_t>(axis)][slots[i]] = position[axis];
  }

  // For each pair of neighbours, compares their surface points. Comparisons with NaN are false. The
  // limit is below kOtherPart by more than the rounding errors.
  constexpr auto kLimit = static_cast<float>(kOtherPart * kOtherPart * 0.99);
  std::array<unsigned char, std::size_t{kSide} * kSide * kSide> meets{};
  constexpr std::size_t kSteps[] = {std::size_t{kSide} * kSide, kSide, 1};
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t step = kSteps[axis];
    for (int x = axis == 0 ? -1 : 0; x < 8; ++x)
      for (int y = axis == 1 ? -1 : 0; y < 8; ++y) {
        const std::size_t first = slot(x, y, axis == 2 ? -1 : 0), end = slot(x, y, 8);
        std::array<unsigned char, kSide> isFar{};
        for (std::size_t i = first; i < end; ++i) {
          float squared = 0;
          for (const auto& along : nearest_)
            squared += (along[i + step] - along[i]) * (along[i + step] - along[i]);
          isFar[i - first] = squared >= kLimit;
        }
        for (std::size_t i = first; i < end; ++i) {
          meets[i] |= isFar[i - first];
          meets[i + step] |= isFar[i - first];
        }
      }
  }
  meetsOther_.setOff();
  for (openvdb::Index n = 0; n < 512; ++n) {
    const Coord c = LeafNode::offsetToLocalCoord(n);
    if (meets[slot(c.x(), c.y(), c.z())]) meetsOther_.setOn(n);
  }
}

void Polisher::prepare(const NearestPoints::Block& block, const NearestPoints::Mask& gridPoints) {
  if (loaded_ != &block) load(block);
  preparedBlock_ = &block;
  prepared_.setOff();
  searches_.clear();
  for (auto it = gridPoints.beginOn(); it; ++it) {
    const openvdb::Index n = it.pos();
    const std::uint32_t point = block.nearest[n];
    if (point == NearestPoints::kNone || block.own.isOn(n) || points_.sharp[point]) continue;
    prepared_.setOn(n);
    entry_[n] = static_cast<std::uint16_t>(searches_.size());
    searches_.push_back({(block.origin + LeafNode::offsetToLocalCoord(n)).asVec3d(),
                         points_.positions[point], &points_.jets[point]});
  }
  closestPointsByTwoSteps(cache_, searches_, feet_);
}

Closest Polisher::closest(const NearestPoints::Block& block, openvdb::Index n) {
  if (loaded_ != &block) load(block);
  const Coord c = block.origin + LeafNode::offsetToLocalCoord(n);
  const Vec3d x = c.asVec3d();
  const std::uint32_t first = block.nearest[n];
  const Vec3d nearest = points_.positions[first];
  Closest best{nearest, (x - nearest).length()};
  const double start = best.distance;
  if (!block.own.isOn(n))
    best.takeIfNearer(preparedBlock_ == &block && prepared_.isOn(n)
                          ? polishFrom(feet_[entry_[n]], x, first)
                          : polish(x, first));
  if (!meetsOther_.isOn(n)) return best;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = -1; side <= 1; side += 2) {
      Coord beside = c;
      beside[axis] += side;
      const std::uint32_t other = NearestPoints::nearestAt(block, beside);
      if (other == NearestPoints::kNone || other == first) continue;
      const Vec3d point = points_.positions[other];
      if ((point - nearest).lengthSqr() < kOtherPart * kOtherPart) continue;
      if ((x - point).length() < start + kPolishGain) best.takeIfNearer(polish(x, other));
    }
  return best;
}

Closest Polisher::polish(const Vec3d& x, std::uint32_t point) {
  const Vec3d start = points_.positions[point];
  if (!points_.sharp[point]) {
    searches_.assign(1, {x, start, &points_.jets[point]});
    std::vector<Foot> feet;
    closestPointsByTwoSteps(cache_, searches_, feet);
    return polishFrom(feet[0], x, point);
  }
  const TriangleTree::Hit hit = patches_.nearest(x, (x - start).length());
  if (!hit.found) return {start, (x - start).length()};
  if (patches_.covers(Coord::floor(hit.point))) return {hit.point, hit.distance};
  return polishOnInterpolant(x, hit.point);
}

Closest Polisher::polishFrom(const Foot& foot, const Vec3d& x, std::uint32_t point) {
  if (foot.converged && !patches_.covers(Coord::floor(foot.point)) && isOnSurface(foot.point))
    return {foot.point, foot.distance};
  return polishOnInterpolant(x, points_.positions[point]);
}

Closest Polisher::polishOnInterpolant(const Vec3d& x, Vec3d start) {
  const Closest first{start, (x - start).length()};
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const DenseBlock& block = cache_.around(start);
    const Vec3d origin = block.origin().asVec3d();
    const Foot foot = closestPoint(block, x - origin, start - origin);
    if (foot.converged) {
      if (!changesSignAround(block, foot.point)) break;
      const Closest smooth{foot.point + origin, foot.distance};
      if (!patches_.covers(Coord::floor(smooth.point))) return smooth;
      const TriangleTree::Hit hit = patches_.nearest(x, foot.distance + kPolishGain);
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
