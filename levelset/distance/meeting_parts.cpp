#include "levelset/distance/meeting_parts.h"

#include <openvdb/tools/Prune.h>

#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <unordered_map>

#include "levelset/distance/moved_surface.h"
#include "levelset/distance/point_distance.h"
#include "levelset/grids/box_mask_vdb.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using openvdb::MaskTree;
using openvdb::Vec3d;
using LeafNode = openvdb::FloatTree::LeafNodeType;
using Block = NearestPoints::Block;

// A value is kept if its foot point lies within a tolerance of the zero set. The tolerance is about
// the error of tricubic interpolation: kPerBend times the sum of the squares of the second
// differences, between kFlat and kRound, voxels.
constexpr double kPerBend = 3, kFlat = 1e-4, kRound = 5e-3;
// Number of times the normal is computed again at the foot point.
constexpr int kNormals = 3;
// Number of rounds in which grid points take crease points from their neighbours, and least
// decrease of a distance, voxels.
constexpr int kRounds = 4;
constexpr double kLeastGain = 1e-3;
// Distances measured from the field are trusted to about this, voxels, beside creases.
constexpr double kMeasured = 0.1;
// Distance beyond the half width, voxels, from which a surface point may be the nearest, or an edge
// may affect it.
constexpr double kMargin = 1.5;

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

/// Returns the grid points on the near side whose value is not the distance to the zero set.
/// @param isInside  the near side is inside
MaskTree wrongPoints(const FloatGrid& field, bool isInside) {
  std::vector<const LeafNode*> leaves;
  for (auto leaf = field.tree().cbeginLeaf(); leaf; ++leaf) leaves.push_back(leaf.getLeaf());
  std::vector<NearestPoints::Mask> found(leaves.size());
  const double voxelSize = field.voxelSize()[0];
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16), [&](const auto& range) {
    const FloatGrid::ConstAccessor accessor(field.tree());
    const auto block = std::make_unique<DenseBlock>();
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      bool isLoaded = false;
      for (auto it = leaves[i]->cbeginValueOn(); it; ++it) {
        if ((*it < 0) != isInside) continue;
        if (!isLoaded) block->load(accessor, leaves[i]->origin());
        isLoaded = true;
        if (!hasFootOnSurface(*block, LeafNode::offsetToLocalCoord(it.pos()), voxelSize,
                              field.background()))
          found[i].setOn(it.pos());
      }
    }
  });
  MaskTree points;
  for (std::size_t i = 0; i < leaves.size(); ++i)
    if (!found[i].isOff()) points.touchLeaf(leaves[i]->origin())->setValueMask(found[i]);
  return points;
}

std::vector<const MaskTree::LeafNodeType*> leavesOf(const MaskTree& tree) {
  std::vector<const MaskTree::LeafNodeType*> leaves;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) leaves.push_back(leaf.getLeaf());
  return leaves;
}

/// Returns the grid points within `reach` voxels of one of `points` along each axis.
MaskTree boxesAround(const MaskTree& points, double reach) {
  MaskTree around;
  for (auto leaf = points.cbeginLeaf(); leaf; ++leaf)
    for (auto it = leaf->cbeginValueOn(); it; ++it) {
      CoordBBox box(it.getCoord(), it.getCoord());
      box.expand(static_cast<int>(std::ceil(reach)));
      addBox(around, box);
    }
  return around;
}

/// Signed distances of grid points of one leaf, voxels.
using LeafDistances = std::vector<std::pair<openvdb::Index, double>>;

void setAll(FloatGrid& field, const Coord& origin, const LeafDistances& values, double halfWidth) {
  if (values.empty()) return;
  LeafNode* leaf = field.tree().touchLeaf(origin);
  for (const auto& [n, value] : values)
    setDistance(*leaf, n, value, halfWidth, field.voxelSize()[0], field.background());
}

/// Computes the signed distances of some grid points to the zero set of `field`, and sets them. The
/// cost depends on their number.
void measureFromField(FloatGrid& field, const MaskTree& points, double halfWidth) {
  const MaskTree near = boxesAround(points, halfWidth + kMargin);
  const BlockSelection blocks{{}, &near}, edgeBlocks{{}, &near, &near};
  const ZeroSet surface = readZeroSet(field, blocks, &edgeBlocks, {});
  NearestPoints nearest(field.tree(), surface.points, {halfWidth, halfWidth, {}, &near});
  nearest.run({});

  const auto masks = leavesOf(points);
  std::vector<LeafDistances> found(masks.size());
  const double voxelSize = field.voxelSize()[0];
  DistanceRequest request;
  request.halfWidth = halfWidth;
  forEachWithPolisher(masks.size(), surface, {}, [&](std::size_t i, Polisher& polisher) {
    const Block* block = nearest.find(masks[i]->origin());
    const LeafNode* values = field.tree().probeConstLeaf(masks[i]->origin());
    for (auto it = masks[i]->cbeginValueOn(); it; ++it) {
      const openvdb::Index n = it.pos();
      const double old = static_cast<double>(values->getValue(n)) / voxelSize;
      double value = std::copysign(1e30, old);
      if (block && block->nearest[n] != NearestPoints::kNone)
        value = keptOr(distanceAt(*block, n, polisher, request).value, old, polisher,
                       block->nearest[n]);
      found[i].emplace_back(n, value);
    }
  });
  for (std::size_t i = 0; i < masks.size(); ++i)
    setAll(field, masks[i]->origin(), found[i], halfWidth);
}

/// Distances of the grid points whose value is not the distance to the moved surface.
class CreaseDistances {
 public:
  CreaseDistances(const MaskTree& wrong, const ZeroSet& surface, const NearestPoints& nearest,
                  const DistanceRequest& request)
      : leaves_(leavesOf(wrong)),
        surface_(surface),
        nearest_(nearest),
        request_(request),
        points_(leaves_.size()),
        searches_([&surface, &request] { return MovedSurface(surface, request.shift); }) {}

  /// Finds the distance of each grid point by itself.
  void search(const Progress& progress) {
    forEachWithPolisher(leaves_.size(), surface_, progress, [&](std::size_t i, Polisher& polisher) {
      const Block& block = *nearest_.find(leaves_[i]->origin());
      for (auto it = leaves_[i]->cbeginValueOn(); it; ++it) {
        Point point;
        point.n = it.pos();
        const auto [value, closest] = distanceAt(block, point.n, polisher, request_);
        point.sign = value < 0 ? -1 : 1;
        point.plain = std::abs(value);
        if (closest) point.found = searches_.local().distance(block, point.n, *closest);
        point.hasFailed = !point.found;
        points_[i].push_back(std::move(point));
      }
    });
  }

  /// Starts the search again from the crease points of the neighbours, where these are nearer. So
  /// the nearest of several creases is found.
  void adoptFromNeighbours() {
    for (int round = 0; round < kRounds; ++round) {
      std::unordered_map<Coord, const MovedSurface::CreasePoint*, std::hash<Coord>> creases;
      for (std::size_t i = 0; i < points_.size(); ++i)
        for (const Point& point : points_[i])
          if (point.found && point.found->crease)
            creases.emplace(gridPoint(i, point), &*point.found->crease);
      std::vector<std::vector<std::optional<MovedSurface::Result>>> better(points_.size());
      std::atomic<bool> hasChanged = false;
      tbb::parallel_for(std::size_t{0}, points_.size(), [&](std::size_t i) {
        const Block& block = *nearest_.find(leaves_[i]->origin());
        better[i].resize(points_[i].size());
        for (std::size_t k = 0; k < points_[i].size(); ++k) {
          const Point& point = points_[i][k];
          if (point.found && !point.found->crease) continue;
          const Coord c = gridPoint(i, point);
          const MovedSurface::CreasePoint* start = nullptr;
          double least = point.found ? point.found->distance - kLeastGain : INFINITY;
          for (int step = 0; step < 27; ++step) {
            const auto there =
                creases.find(c.offsetBy(step / 9 - 1, step / 3 % 3 - 1, step % 3 - 1));
            if (step == 13 || there == creases.end()) continue;
            const double distance = (there->second->point - c.asVec3d()).length();
            if (distance >= least) continue;
            least = distance;
            start = there->second;
          }
          if (!start) continue;
          auto found = searches_.local().distanceFrom(block, point.n, *start);
          if (!found || found->distance < point.plain - kLeastGain ||
              (point.found && found->distance > point.found->distance - kLeastGain))
            continue;
          better[i][k] = std::move(found);
          hasChanged = true;
        }
      });
      if (!hasChanged) return;
      for (std::size_t i = 0; i < points_.size(); ++i)
        for (std::size_t k = 0; k < points_[i].size(); ++k)
          if (better[i][k]) points_[i][k].found = std::move(better[i][k]);
    }
  }

  /// Writes the distances into the field. Returns the grid points whose own search has failed.
  [[nodiscard]] MaskTree write(FloatGrid& field) const {
    MaskTree failed;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      LeafDistances values;
      for (const Point& point : points_[i])
        if (point.hasFailed)
          failed.setValueOn(gridPoint(i, point));
        else
          values.emplace_back(point.n, point.sign * point.found->distance);
      setAll(field, leaves_[i]->origin(), values, request_.halfWidth);
    }
    return failed;
  }

  /// Where a search has failed, writes the distance to a neighbour's crease, unless the field has a
  /// much smaller one.
  void writeAdopted(FloatGrid& field) const {
    const FloatGrid::ConstAccessor accessor(field.tree());
    const double voxelSize = field.voxelSize()[0];
    for (std::size_t i = 0; i < points_.size(); ++i) {
      LeafDistances values;
      for (const Point& point : points_[i]) {
        if (!point.hasFailed || !point.found) continue;
        const auto measured = static_cast<double>(accessor.getValue(gridPoint(i, point)));
        if (point.found->distance < std::abs(measured) / voxelSize + kMeasured)
          values.emplace_back(point.n, point.sign * point.found->distance);
      }
      setAll(field, leaves_[i]->origin(), values, request_.halfWidth);
    }
  }

 private:
  struct Point {
    openvdb::Index n = 0;
    double sign = 1;
    bool hasFailed = false;  ///< the search by itself found no distance
    double plain = 0;        ///< lower bound of the distance, voxels: the distance minus the shift
    std::optional<MovedSurface::Result> found = {};
  };
  [[nodiscard]] Coord gridPoint(std::size_t leaf, const Point& point) const {
    return leaves_[leaf]->origin() + LeafNode::offsetToLocalCoord(point.n);
  }

  std::vector<const MaskTree::LeafNodeType*> leaves_;
  const ZeroSet& surface_;
  const NearestPoints& nearest_;
  const DistanceRequest& request_;
  std::vector<std::vector<Point>> points_;  ///< by leaf
  tbb::enumerable_thread_specific<MovedSurface> searches_;
};

}  // namespace

void correctMeetingParts(FloatGrid& field, const ZeroSet& surface, const NearestPoints& nearest,
                         const DistanceRequest& request, const Progress& progress) {
  if (!hasZeroCrossing(field.tree())) return;
  const MaskTree wrong = wrongPoints(field, request.shift > 0);
  CreaseDistances distances(wrong, surface, nearest, request);
  report(progress, 0.2);
  distances.search(subProgress(progress, 0.2, 0.7));
  distances.adoptFromNeighbours();
  const MaskTree failed = distances.write(field);
  report(progress, 0.8);
  if (!failed.empty()) measureFromField(field, failed, request.halfWidth);
  distances.writeAdopted(field);
  openvdb::tools::pruneTiles(field.tree());
}

}  // namespace levelset::eikonal
