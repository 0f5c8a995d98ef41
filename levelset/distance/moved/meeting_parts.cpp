#include "levelset/distance/moved/meeting_parts.h"

#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "levelset/distance/moved/crease_distances.h"
#include "levelset/distance/moved/flat_edge_distances.h"
#include "levelset/distance/moved/leaf_distances.h"
#include "levelset/distance/nearest/point_distance.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::MaskTree;
using openvdb::Vec3d;
using LeafNode = openvdb::FloatTree::LeafNodeType;
using Block = NearestPoints::Block;

// A value is kept if its foot point lies within a tolerance of the zero set. The tolerance is above
// the error of tricubic interpolation: kPerBend times the sum of the squares of the second
// differences, between kFlat and kRound, voxels.
constexpr double kPerBend = 10, kFlat = 1e-4, kRound = 5e-3;
// Number of times the normal is computed again at the foot point.
constexpr int kNormals = 3;

/// First and second differences of the field along one axis, world units.
struct AxisSlope {
  double first = 0, second = 0;
};

/// Differences at a grid point along one axis. The first one is central, or one-sided of second
/// order at the end of the band; NAN if there are too few values. The second one is the least of
/// those in the five nearest grid points: a crease beside the grid point does not count.
AxisSlope slopeAt(const DenseBlock& block, const Coord& c, int axis, float background) {
  std::array<float, 5> v;
  std::array<bool, 5> isDistance;
  for (int i = 0; i < 5; ++i) {
    Coord p = c;
    p[axis] += i - 2;
    const auto k = static_cast<std::size_t>(i);
    v[k] = block.at(p.x(), p.y(), p.z());
    isDistance[k] = std::abs(v[k]) < background;
  }
  AxisSlope slope{NAN, INFINITY};
  for (std::size_t i = 1; i < 4; ++i)
    if (isDistance[i - 1] && isDistance[i] && isDistance[i + 1])
      slope.second =
          std::min(slope.second, static_cast<double>(std::abs(v[i - 1] - 2 * v[i] + v[i + 1])));
  if (isDistance[1] && isDistance[3])
    slope.first = static_cast<double>(v[3] - v[1]) / 2;
  else if (isDistance[3] && isDistance[4])
    slope.first = static_cast<double>(4 * v[3] - 3 * v[2] - v[4]) / 2;
  else if (isDistance[1] && isDistance[0])
    slope.first = static_cast<double>(3 * v[2] - 4 * v[1] + v[0]) / 2;
  return slope;
}

/// Returns true if the foot point of a grid point, by its value and the gradient, lies on the zero
/// set. Takes the gradient at the grid point first, then at the foot point.
bool hasFootOnSurface(const DenseBlock& block, const Coord& c, double voxelSize, float background) {
  const double value = static_cast<double>(block.at(c.x(), c.y(), c.z())) / voxelSize;
  Vec3d normal;
  double bend = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const AxisSlope slope = slopeAt(block, c, axis, background);
    normal[axis] = slope.first;
    bend += slope.second * slope.second / (voxelSize * voxelSize);
  }
  const double tolerance = std::clamp(kPerBend * bend, kFlat, kRound);
  for (int i = 0; i < kNormals; ++i) {
    if (!normal.normalize() || !std::isfinite(normal.lengthSqr())) return false;
    const Vec3d foot = c.asVec3d() - normal * value;
    if (!DenseBlock::contains(foot)) return false;
    Jet jet;
    block.slope(foot, jet);
    if (std::abs(jet.value) < tolerance * voxelSize) return true;
    normal = jet.gradient;
  }
  return false;
}

/// Returns the grid points of some blocks on the near side whose value is not the distance to the
/// zero set.
/// @param isInside  the near side is inside
std::vector<WrongPoints> wrongPoints(const FloatGrid& field,
                                     const std::vector<const Block*>& blocks, bool isInside) {
  std::vector<WrongPoints> found(blocks.size());
  const double voxelSize = field.voxelSize()[0];
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 8), [&](const auto& range) {
    const FloatGrid::ConstAccessor accessor(field.tree());
    const auto block = std::make_unique<DenseBlock>();
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      found[i].block = blocks[i];
      const LeafNode* leaf = accessor.probeConstLeaf(blocks[i]->origin);
      if (!leaf) continue;
      bool isLoaded = false;
      for (auto it = leaf->cbeginValueOn(); it; ++it) {
        if ((*it < 0) != isInside) continue;
        if (!isLoaded) block->load(accessor, leaf->origin());
        isLoaded = true;
        if (!hasFootOnSurface(*block, LeafNode::offsetToLocalCoord(it.pos()), voxelSize,
                              field.background()))
          found[i].mask.setOn(it.pos());
      }
    }
  });
  std::erase_if(found, [](const WrongPoints& wrong) { return wrong.mask.isOff(); });
  return found;
}

/// Computes the signed distances of some grid points to the zero set of `field`, and sets them. The
/// cost depends on their number.
/// @param near  grid points around them; contains the part of the zero set that is nearest to them
void measureFromField(FloatGrid& field, const CreaseDistances::Missing& missing, double halfWidth) {
  const auto& [points, near, nearEdges] = missing;
  const BlockSelection blocks{{}, &near, &near}, edgeBlocks{{}, &nearEdges, nullptr, &nearEdges};
  const ZeroSet surface = readZeroSet(field, blocks, nearEdges.empty() ? nullptr : &edgeBlocks, {});
  NearestPoints nearest(field.tree(), surface.points, {halfWidth, halfWidth, {}, &near});
  nearest.seed(surface.gridPoints, 0);
  nearest.seedFeatures(surface.gridPoints.size());
  nearest.run({});

  const auto masks = leavesOf(points);
  std::vector<LeafDistances> found(masks.size());
  const double voxelSize = field.voxelSize()[0];
  DistanceRequest request;
  request.halfWidth = halfWidth;
  Polishers(surface).forEach(masks.size(), [&](std::size_t i, Polisher& polisher) {
    const Block* block = nearest.find(masks[i]->origin());
    const LeafNode* values = field.tree().probeConstLeaf(masks[i]->origin());
    for (auto it = masks[i]->cbeginValueOn(); it; ++it) {
      const openvdb::Index n = it.pos();
      const double old = static_cast<double>(values->getValue(n)) / voxelSize;
      double value = old < 0 ? -1e30 : 1e30;
      if (block && block->nearest[n] != NearestPoints::kNone)
        value = keptOr(distanceAt(*block, n, polisher, request).value, old, polisher,
                       block->nearest[n]);
      found[i].emplace_back(n, value);
    }
  });
  for (std::size_t i = 0; i < masks.size(); ++i)
    setAll(field, masks[i]->origin(), found[i], halfWidth);
}

}  // namespace

void MeetingParts::search(int slab, const std::vector<const Block*>& blocks) {
  const std::vector<WrongPoints> wrong = wrongPoints(field_, blocks, request_.shift > 0);
  for (const WrongPoints& one : wrong) wrong_.touchLeaf(one.block->origin)->setValueMask(one.mask);
  distances_.search(slab, wrong);
}

void MeetingParts::finish() {
  const auto missing = distances_.finish(field_);
  if (!missing.points.empty()) measureFromField(field_, missing, request_.halfWidth);
  distances_.improveMeasured(field_);
  measureFlatEdges(field_, wrong_, request_.halfWidth);
  openvdb::tools::pruneTiles(field_.tree());
}

}  // namespace levelset::eikonal
