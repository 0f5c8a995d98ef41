#include "levelset/distance/moved/crease_distances.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "levelset/distance/moved/leaf_distances.h"
#include "levelset/distance/nearest/point_distance.h"
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

// Number of rounds in which grid points take crease points from their neighbours, and least
// decrease of a distance, voxels.
constexpr int kRounds = 4;
constexpr double kLeastGain = 1e-3;
// Distance along each axis, voxels, to the grid points from whose crease points a failed search
// starts again. Edge of the cells that hold these grid points.
constexpr int kAround = 6;
constexpr int kCell = 4;
// Number of crease points from which a search starts again, and least distance between them,
// voxels.
constexpr std::size_t kStarts = 6;
constexpr double kApart = 0.5;
static_assert(kRounds + kAround == kCreaseReach);
// Distance along each axis, voxels, in which zero crossings are searched. If the search from a grid
// point failed, a distance to a crease is trusted up to kTrusted, voxels, above its lower bound.
// Distances measured from the field are trusted to about kMeasured, voxels, beside creases.
constexpr int kCrossings = 4;
constexpr double kTrusted = 1e-3, kMeasured = 0.1;
// A failed search may be beside an edge if at least kLeastFlat grid points within kFlatReach voxels
// have second differences of at most kFlatBend voxels along each axis.
constexpr int kFlatReach = 4, kLeastFlat = 6;
constexpr double kFlatBend = 3e-4;
// Distance beyond the largest distance to measure, voxels, from which a surface point may be the
// nearest, or an edge may affect it.
constexpr double kMargin = 2;

/// Returns true if the field around a grid point has values of flat faces. Looks at every second
/// grid point.
bool isBesideFlatFace(const FloatGrid::ConstAccessor& field, const Coord& at, double voxelSize) {
  const auto limit = static_cast<float>(kFlatBend * voxelSize);
  const auto isFlat = [&](const Coord& c) {
    float value = 0;
    if (!field.probeValue(c, value)) return false;
    for (int axis = 0; axis < 3; ++axis) {
      Coord before = c, after = c;
      --before[axis];
      ++after[axis];
      float low = 0, high = 0;
      if (!field.probeValue(before, low) || !field.probeValue(after, high) ||
          std::abs(low + high - 2 * value) > limit)
        return false;
    }
    return true;
  };
  int flat = 0;
  for (int x = -kFlatReach; x <= kFlatReach; x += 2)
    for (int y = -kFlatReach; y <= kFlatReach; y += 2)
      for (int z = -kFlatReach; z <= kFlatReach; z += 2)
        if (isFlat(at.offsetBy(x, y, z)) && ++flat == kLeastFlat) return true;
  return false;
}

}  // namespace

CreaseDistances::CreaseDistances(const MaskTree& wrong, const ZeroSet& surface,
                                 const NearestPoints& nearest, const DistanceRequest& request)
    : leaves_(leavesOf(wrong)),
      surface_(surface),
      nearest_(nearest),
      request_(request),
      points_(leaves_.size()),
      searches_([&surface, &request] { return MovedSurface(surface, request.shift); }) {}

void CreaseDistances::search(const Progress& progress) {
  forEachWithPolisher(leaves_.size(), surface_, progress, [&](std::size_t i, Polisher& polisher) {
    const Block& block = *nearest_.find(leaves_[i]->origin());
    NearestPoints::Mask known = leaves_[i]->getValueMask();
    for (auto it = leaves_[i]->cbeginValueOn(); it; ++it)
      known.set(it.pos(), block.nearest[it.pos()] != NearestPoints::kNone);
    polisher.prepare(block, known);
    for (auto it = leaves_[i]->cbeginValueOn(); it; ++it) {
      Point point;
      point.n = it.pos();
      const auto [value, closest] = distanceAt(block, point.n, polisher, request_);
      point.sign = value < 0 ? -1 : 1;
      point.plain = std::abs(value);
      if (closest) {
        auto found = searches_.local().distance(block, point.n, *closest);
        point.found = std::move(found.result);
        point.isBesideCrease = found.isBesideCrease;
        point.meetsPatches = found.meetsPatches;
      }
      // The plain distance stands in the field already.
      if (point.found && !point.found->crease) continue;
      point.hasFailed = !point.found;
      points_[i].push_back(std::move(point));
    }
  });
}

void CreaseDistances::adoptFromNeighbours() {
  std::unordered_map<Coord, const MovedSurface::CreasePoint*, std::hash<Coord>> creases;
  for (std::size_t i = 0; i < points_.size(); ++i)
    for (const Point& point : points_[i])
      if (point.found) creases.emplace(gridPoint(i, point), &*point.found->crease);
  std::unique_ptr<MaskTree> beside;  // grid points beside those that changed in the round before
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::vector<std::pair<std::size_t, MovedSurface::Result>>> better(points_.size());
    tbb::parallel_for(std::size_t{0}, points_.size(), [&](std::size_t i) {
      if (beside && !beside->probeConstLeaf(leaves_[i]->origin())) return;
      const Block& block = *nearest_.find(leaves_[i]->origin());
      for (std::size_t k = 0; k < points_[i].size(); ++k) {
        const Point& point = points_[i][k];
        const Coord c = gridPoint(i, point);
        if (beside && !beside->isValueOn(c)) continue;
        const MovedSurface::CreasePoint* start = nullptr;
        double least = point.found ? point.found->distance - kLeastGain : INFINITY;
        for (int step = 0; step < 27; ++step) {
          const auto there = creases.find(c.offsetBy(step / 9 - 1, step / 3 % 3 - 1, step % 3 - 1));
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
        better[i].emplace_back(k, std::move(*found));
      }
    });
    MaskTree changed;
    for (std::size_t i = 0; i < points_.size(); ++i)
      for (auto& [k, found] : better[i]) {
        Point& point = points_[i][k];
        point.found = std::move(found);
        creases[gridPoint(i, point)] = &*point.found->crease;
        changed.setValueOn(gridPoint(i, point));
      }
    if (changed.empty()) return;
    beside = std::make_unique<MaskTree>(boxesAround(changed, 1));
  }
}

void CreaseDistances::searchAgain(const FloatGrid& field) {
  const Cells cells = creasesByCell(boxesAround(failedPoints(), kAround));
  tbb::parallel_for(std::size_t{0}, points_.size(), [&](std::size_t i) {
    const Block& block = *nearest_.find(leaves_[i]->origin());
    const FloatGrid::ConstAccessor accessor(field.tree());
    for (Point& point : points_[i]) {
      if (!point.hasFailed) continue;
      MovedSurface& search = searches_.local();
      const Coord c = gridPoint(i, point);
      const auto take = [&](std::optional<MovedSurface::Result> found) {
        if (found && (!point.found || found->distance < point.found->distance))
          point.found = std::move(found);
      };
      for (const MovedSurface::CreasePoint* start : nearestCreases(cells, c)) {
        take(search.distanceFrom(block, point.n, *start));
        point.bound = std::min(point.bound, (start->point - c.asVec3d()).length());
      }
      for (const Vec3d& crossing : nearestCrossings(accessor, c))
        take(search.distanceNear(block, point.n, crossing));
    }
  });
}

CreaseDistances::Missing CreaseDistances::write(FloatGrid& field) const {
  Missing missing;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    LeafDistances values;
    for (const Point& point : points_[i])
      if (isTrusted(point))
        values.emplace_back(point.n, point.sign * std::max(point.found->distance, point.plain));
    setAll(field, leaves_[i]->origin(), values, request_.halfWidth);
  }
  const FloatGrid::ConstAccessor accessor(field.tree());
  for (std::size_t i = 0; i < points_.size(); ++i)
    for (const Point& point : points_[i]) {
      if (isTrusted(point)) continue;
      const Coord c = gridPoint(i, point);
      const bool mayHaveEdge =
          point.meetsPatches || isBesideFlatFace(accessor, c, field.voxelSize()[0]);
      add(c, point, mayHaveEdge, missing);
    }
  return missing;
}

void CreaseDistances::improveMeasured(FloatGrid& field) const {
  const FloatGrid::ConstAccessor accessor(field.tree());
  const double voxelSize = field.voxelSize()[0];
  for (std::size_t i = 0; i < points_.size(); ++i) {
    LeafDistances values;
    for (const Point& point : points_[i]) {
      if (isTrusted(point)) continue;
      double distance =
          std::abs(static_cast<double>(accessor.getValue(gridPoint(i, point)))) / voxelSize;
      const double found = point.found ? point.found->distance : INFINITY;
      if (found < distance || (point.isBesideCrease && found < distance + kMeasured))
        distance = found;
      distance = std::min(distance, point.bound);
      values.emplace_back(point.n, point.sign * std::max(distance, point.plain));
    }
    setAll(field, leaves_[i]->origin(), values, request_.halfWidth);
  }
}

void CreaseDistances::add(const Coord& c, const Point& point, bool mayHaveEdge,
                          Missing& missing) const {
  missing.points.setValueOn(c);
  double farthest = std::min(request_.halfWidth, point.bound);
  if (point.found) farthest = std::min(farthest, point.found->distance);
  addBall(missing.near, c, farthest + kMargin);
  if (mayHaveEdge) addBall(missing.nearEdges, c, farthest + kMargin);
}

bool CreaseDistances::isTrusted(const Point& point) {
  if (!point.found) return false;
  return !point.hasFailed || point.found->distance < point.plain + kTrusted;
}

Coord CreaseDistances::cellOf(const Coord& c) {
  return Coord::floor(c.asVec3d() / double{kCell});
}

MaskTree CreaseDistances::failedPoints() const {
  MaskTree failed;
  for (std::size_t i = 0; i < points_.size(); ++i)
    for (const Point& point : points_[i])
      if (point.hasFailed) failed.setValueOn(gridPoint(i, point));
  return failed;
}

CreaseDistances::Cells CreaseDistances::creasesByCell(const MaskTree& within) const {
  Cells cells;
  for (std::size_t i = 0; i < points_.size(); ++i)
    for (const Point& point : points_[i])
      if (const Coord c = gridPoint(i, point); !point.hasFailed && within.isValueOn(c))
        cells[cellOf(c)].push_back({c, &*point.found->crease});
  return cells;
}

/// Returns up to kStarts crease points of the grid points around x in the order of their distances
/// from x, at least kApart from each other.
std::vector<const MovedSurface::CreasePoint*> CreaseDistances::nearestCreases(const Cells& cells,
                                                                              const Coord& x) {
  std::vector<std::pair<double, const MovedSurface::CreasePoint*>> near;
  const CoordBBox around(x.offsetBy(-kAround), x.offsetBy(kAround));
  for (const Coord& cell : CoordBBox(cellOf(around.min()), cellOf(around.max())))
    if (const auto found = cells.find(cell); found != cells.end())
      for (const auto& [c, crease] : found->second)
        if (around.isInside(c))
          near.emplace_back((crease->point - x.asVec3d()).lengthSqr(), crease);
  std::stable_sort(near.begin(), near.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<const MovedSurface::CreasePoint*> starts;
  for (const auto& one : near) {
    const MovedSurface::CreasePoint* crease = one.second;
    const bool isKnown = std::any_of(starts.begin(), starts.end(), [&](const auto* other) {
      return (other->point - crease->point).lengthSqr() < kApart * kApart;
    });
    if (!isKnown) starts.push_back(crease);
    if (starts.size() == kStarts) break;
  }
  return starts;
}

/// Returns up to kStarts zero crossings of the field on grid edges in the order of their
/// distances from a grid point, at least kApart from each other.
std::vector<Vec3d> CreaseDistances::nearestCrossings(const FloatGrid::ConstAccessor& field,
                                                     const Coord& from) {
  std::vector<std::pair<double, Vec3d>> near;
  for (const Coord& c : CoordBBox(from.offsetBy(-kCrossings), from.offsetBy(kCrossings))) {
    const auto here = static_cast<double>(field.getValue(c));
    for (int axis = 0; axis < 3; ++axis) {
      Coord next = c;
      ++next[axis];
      const auto there = static_cast<double>(field.getValue(next));
      if ((here < 0) == (there < 0)) continue;
      Vec3d crossing = c.asVec3d();
      crossing[axis] += here / (here - there);
      near.emplace_back((crossing - from.asVec3d()).lengthSqr(), crossing);
    }
  }
  std::stable_sort(near.begin(), near.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Vec3d> starts;
  for (const auto& one : near) {
    const Vec3d& crossing = one.second;
    const bool isKnown = std::any_of(starts.begin(), starts.end(), [&](const Vec3d& other) {
      return (other - crossing).lengthSqr() < kApart * kApart;
    });
    if (!isKnown) starts.push_back(crossing);
    if (starts.size() == kStarts) break;
  }
  return starts;
}

Coord CreaseDistances::gridPoint(std::size_t leaf, const Point& point) const {
  return leaves_[leaf]->origin() + LeafNode::offsetToLocalCoord(point.n);
}

}  // namespace levelset::eikonal
