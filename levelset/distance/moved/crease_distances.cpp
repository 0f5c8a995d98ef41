#include "levelset/distance/moved/crease_distances.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "levelset/distance/moved/leaf_distances.h"
#include "levelset/distance/nearest/point_distance.h"
#include "levelset/grids/box_mask_vdb.h"
#include "levelset/grids/padded_leaf_vdb.h"

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

/// Values of a leaf block of a field and of the grid points around it, to find flat faces.
class FlatFaces {
 public:
  FlatFaces(const FloatGrid::ConstAccessor& field, const Coord& origin) : origin_(origin) {
    std::array<float, LeafNode::SIZE> values;
    values_.fill([&](const Coord& step) {
      const LeafNode* leaf =
          field.probeConstLeaf(origin.offsetBy(8 * step.x(), 8 * step.y(), 8 * step.z()));
      if (!leaf) return BlockValues{nullptr, kNone};
      for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n)
        values[n] = leaf->isValueOn(n) ? leaf->getValue(n) : kNone;
      return BlockValues{values.data(), 0};
    });
  }

  /// Returns true if the field around a grid point of the block has values of flat faces. Looks at
  /// every second grid point.
  [[nodiscard]] bool isBeside(const Coord& at, double voxelSize) const {
    const auto limit = static_cast<float>(kFlatBend * voxelSize);
    const Coord c = at - origin_;
    int flat = 0;
    for (int x = -kFlatReach; x <= kFlatReach; x += 2)
      for (int y = -kFlatReach; y <= kFlatReach; y += 2)
        for (int z = -kFlatReach; z <= kFlatReach; z += 2)
          if (isFlat(values_.at(c.x() + x, c.y() + y, c.z() + z), limit) && ++flat == kLeastFlat)
            return true;
    return false;
  }

 private:
  using Values = PaddedLeaf<kFlatReach + 1>;
  static constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

  /// Returns true if a value and its neighbours are distances with small second differences.
  /// Comparisons with NaN are false.
  [[nodiscard]] static bool isFlat(const float* value, float limit) {
    for (const int step : {Values::kStepX, Values::kStepY, 1})
      if (!(std::abs(value[-step] + value[step] - 2 * *value) <= limit)) return false;
    return true;
  }

  Coord origin_;
  Values values_;  ///< NaN at inactive grid points
};

/// Zero crossings of a field on the grid edges within kCrossings voxels of a leaf block.
class CrossingsAround {
 public:
  CrossingsAround(const FloatGrid::ConstAccessor& field, const Coord& origin) {
    // A grid edge leads to the next grid point.
    constexpr int kBefore = kCrossings, kAfter = kCrossings + 1, kSide = 8 + kBefore + kAfter;
    std::array<float, std::size_t{kSide} * kSide * kSide> values;
    copyPaddedLeaf(field, origin, kBefore, kAfter, values.data());
    constexpr std::array<std::size_t, 3> kSteps = {std::size_t{kSide} * kSide, kSide, 1};
    for (int x = 0; x < kSide - 1; ++x)
      for (int y = 0; y < kSide - 1; ++y)
        for (int z = 0; z < kSide - 1; ++z) {
          const float* at = &values[static_cast<std::size_t>((x * kSide + y) * kSide + z)];
          for (int axis = 0; axis < 3; ++axis) {
            const float next = at[kSteps[static_cast<std::size_t>(axis)]];
            if ((*at < 0) == (next < 0)) continue;
            const double here = *at, there = next;
            const Coord c = origin.offsetBy(x - kBefore, y - kBefore, z - kBefore);
            Vec3d position = c.asVec3d();
            position[axis] += here / (here - there);
            crossings_.push_back({c, position});
          }
        }
  }

  /// Returns up to kStarts crossings on the edges around a grid point of the block in the order of
  /// their distances from it, at least kApart from each other.
  [[nodiscard]] std::vector<Vec3d> nearest(const Coord& from) const {
    // Squared distance and number; of equal distances the first comes first.
    std::vector<std::pair<double, std::size_t>> near;
    const CoordBBox around(from.offsetBy(-kCrossings), from.offsetBy(kCrossings));
    for (std::size_t i = 0; i < crossings_.size(); ++i)
      if (around.isInside(crossings_[i].gridPoint))
        near.emplace_back((crossings_[i].position - from.asVec3d()).lengthSqr(), i);
    std::make_heap(near.begin(), near.end(), std::greater<>());
    std::vector<Vec3d> starts;
    for (auto end = near.end(); end != near.begin() && starts.size() < kStarts; --end) {
      const Vec3d& crossing = crossings_[near.front().second].position;
      const bool isKnown = std::any_of(starts.begin(), starts.end(), [&](const Vec3d& other) {
        return (other - crossing).lengthSqr() < kApart * kApart;
      });
      if (!isKnown) starts.push_back(crossing);
      std::pop_heap(near.begin(), end, std::greater<>());
    }
    return starts;
  }

 private:
  struct Crossing {
    Coord gridPoint;
    Vec3d position;
  };
  std::vector<Crossing> crossings_;
};

}  // namespace

CreaseDistances::CreaseDistances(const ZeroSet& surface, Polishers& polishers,
                                 const DistanceRequest& request)
    : request_(request), polishers_(polishers), searches_([&surface, &polishers, &request] {
        return MovedSurface(surface, polishers.local().cache(), request.shift, request.halfWidth);
      }) {}

void CreaseDistances::search(int slab, const std::vector<WrongPoints>& wrong) {
  Leaves& leaves = searched_[slab];
  leaves.resize(wrong.size());
  polishers_.forEach(wrong.size(), [&](std::size_t i, Polisher& polisher) {
    const auto& [owner, mask] = wrong[i];
    const Block& block = *owner;
    leaves[i].block = owner;
    polisher.prepare(block, mask);
    for (auto it = mask.beginOn(); it; ++it) {
      Point point;
      point.n = it.pos();
      const auto [value, closest] = nearDistanceAt(block, point.n, polisher, request_);
      point.sign = value < 0 ? -1 : 1;
      point.plain = std::abs(value);
      auto found = searches_.local().distance(block, point.n, *closest);
      point.found = std::move(found.result);
      point.isBesideCrease = found.isBesideCrease;
      point.meetsPatches = found.meetsPatches;
      // The plain distance stands in the field already.
      if (point.found && !point.found->crease) continue;
      point.hasFailed = !point.found;
      leaves[i].points.push_back(std::move(point));
    }
    leaves[i].points.shrink_to_fit();
  });
  std::erase_if(leaves, [](const Leaf& leaf) { return leaf.points.empty(); });
}

void CreaseDistances::resolve(int first, int last, FloatGrid& field) {
  Leaves leaves = takeAround(last);
  adoptFromNeighbours(leaves);
  searchAgain(leaves, first, last, field);
  writeTrusted(first - 1, field);
  keep(leaves, first, last);
  writeTrusted(last - 1, field);
}

/// Returns the searched points of the slabs up to `last` and those within kCreaseReach voxels.
/// Keeps those that are within that distance of the next slab.
CreaseDistances::Leaves CreaseDistances::takeAround(int last) {
  // Copies the points of a leaf between two positions along x.
  const auto copyBetween = [](const Leaf& leaf, int low, int high, Leaves& copies) {
    Leaf copy{leaf.block, {}};
    for (const Point& point : leaf.points)
      if (const int x = leaf.gridPoint(point).x(); x >= low && x <= high)
        copy.points.push_back(point);
    if (!copy.points.empty()) copies.push_back(std::move(copy));
  };
  constexpr int kAll = std::numeric_limits<int>::max();
  const int end = 8 * last + 8;
  Leaves leaves;
  std::map<int, Leaves> kept;
  auto slab = searched_.begin();
  for (; slab != searched_.end() && slab->first <= last; ++slab) {
    for (Leaf& leaf : slab->second) {
      copyBetween(leaf, end - kCreaseReach, kAll, kept[slab->first]);
      leaves.push_back(std::move(leaf));
    }
  }
  searched_.erase(searched_.begin(), slab);
  for (slab = searched_.begin(); slab != searched_.upper_bound(last + kSlabsAround); ++slab)
    for (const Leaf& leaf : slab->second) copyBetween(leaf, -kAll, end + kCreaseReach - 1, leaves);
  std::erase_if(kept, [](const auto& some) { return some.second.empty(); });
  searched_.merge(kept);
  return leaves;
}

void CreaseDistances::adoptFromNeighbours(Leaves& leaves) {
  std::unordered_map<Coord, const MovedSurface::CreasePoint*, std::hash<Coord>> creases;
  for (const Leaf& leaf : leaves)
    for (const Point& point : leaf.points)
      if (point.found) creases.emplace(leaf.gridPoint(point), &*point.found->crease);
  std::unique_ptr<MaskTree> beside;  // grid points beside those that changed in the round before
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::vector<std::pair<std::size_t, MovedSurface::Result>>> better(leaves.size());
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
      const Block& block = *leaves[i].block;
      if (beside && !beside->probeConstLeaf(block.origin)) return;
      for (std::size_t k = 0; k < leaves[i].points.size(); ++k) {
        const Point& point = leaves[i].points[k];
        const Coord c = leaves[i].gridPoint(point);
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
    for (std::size_t i = 0; i < leaves.size(); ++i)
      for (auto& [k, found] : better[i]) {
        Point& point = leaves[i].points[k];
        const Coord c = leaves[i].gridPoint(point);
        point.found = std::move(found);
        creases[c] = &*point.found->crease;
        changed.setValueOn(c);
      }
    if (changed.empty()) return;
    beside = std::make_unique<MaskTree>(boxesAround(changed, 1));
  }
}

void CreaseDistances::searchAgain(Leaves& leaves, int first, int last, const FloatGrid& field) {
  const auto isOwn = [&](const Leaf& leaf) {
    const int slab = NearestPoints::slabOf(leaf.block->origin);
    return slab >= first && slab <= last;
  };
  MaskTree failed;
  for (const Leaf& leaf : leaves)
    if (isOwn(leaf))
      for (const Point& point : leaf.points)
        if (point.hasFailed) failed.setValueOn(leaf.gridPoint(point));
  if (failed.empty()) return;
  const Cells cells = creasesByCell(leaves, boxesAround(failed, kAround));
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    if (!isOwn(leaves[i])) return;
    const Block& block = *leaves[i].block;
    std::optional<CrossingsAround> crossings;
    for (Point& point : leaves[i].points) {
      if (!point.hasFailed) continue;
      if (!crossings) crossings.emplace(FloatGrid::ConstAccessor(field.tree()), block.origin);
      MovedSurface& search = searches_.local();
      const Coord c = leaves[i].gridPoint(point);
      const auto take = [&](std::optional<MovedSurface::Result> found) {
        if (found && (!point.found || found->distance < point.found->distance))
          point.found = std::move(found);
      };
      for (const MovedSurface::CreasePoint* start : nearestCreases(cells, c)) {
        take(search.distanceFrom(block, point.n, *start));
        point.bound = std::min(point.bound, (start->point - c.asVec3d()).length());
      }
      for (const Vec3d& crossing : crossings->nearest(c))
        take(search.distanceNear(block, point.n, crossing));
    }
  });
}

/// Keeps of each point of some slabs what remains to be used.
void CreaseDistances::keep(const Leaves& leaves, int first, int last) {
  for (const Leaf& leaf : leaves) {
    const int slab = NearestPoints::slabOf(leaf.block->origin);
    if (slab < first || slab > last) continue;
    ResolvedLeaf resolved{leaf.block->origin, {}, {}};
    for (const Point& point : leaf.points) {
      if (isTrusted(point)) {
        resolved.trusted.emplace_back(point.n,
                                      point.sign * std::max(point.found->distance, point.plain));
        continue;
      }
      Resolved& other = resolved.others.emplace_back();
      other.n = static_cast<std::uint16_t>(point.n);
      other.isInside = point.sign < 0;
      other.isBesideCrease = point.isBesideCrease;
      other.meetsPatches = point.meetsPatches;
      other.plain = point.plain;
      other.bound = point.bound;
      if (point.found) other.found = point.found->distance;
    }
    resolved_[slab].push_back(std::move(resolved));
  }
}

/// Writes the trusted distances of the slabs up to `last`. The search beside a slab reads the field
/// as it was before.
void CreaseDistances::writeTrusted(int last, FloatGrid& field) {
  for (; !resolved_.empty() && resolved_.begin()->first <= last; resolved_.erase(resolved_.begin()))
    for (ResolvedLeaf& leaf : resolved_.begin()->second) {
      setAll(field, leaf.origin, leaf.trusted, request_.halfWidth);
      if (!leaf.others.empty()) missing_.push_back({leaf.origin, {}, std::move(leaf.others)});
    }
}

CreaseDistances::Missing CreaseDistances::finish(FloatGrid& field) {
  writeTrusted(std::numeric_limits<int>::max(), field);
  std::vector<std::vector<char>> mayHaveEdge(missing_.size());
  tbb::parallel_for(std::size_t{0}, missing_.size(), [&](std::size_t i) {
    const ResolvedLeaf& leaf = missing_[i];
    std::optional<FlatFaces> faces;
    for (const Resolved& point : leaf.others) {
      const auto isBesideFlatFace = [&] {
        if (!faces) faces.emplace(FloatGrid::ConstAccessor(field.tree()), leaf.origin);
        return faces->isBeside(leaf.gridPoint(point), field.voxelSize()[0]);
      };
      mayHaveEdge[i].push_back(point.meetsPatches || isBesideFlatFace());
    }
  });
  Missing missing;
  for (std::size_t i = 0; i < missing_.size(); ++i)
    for (std::size_t k = 0; k < missing_[i].others.size(); ++k) {
      const Resolved& point = missing_[i].others[k];
      add(missing_[i].gridPoint(point), point, mayHaveEdge[i][k], missing);
    }
  return missing;
}

void CreaseDistances::improveMeasured(FloatGrid& field) const {
  const FloatGrid::ConstAccessor accessor(field.tree());
  const double voxelSize = field.voxelSize()[0];
  for (const ResolvedLeaf& leaf : missing_) {
    LeafDistances values;
    for (const Resolved& point : leaf.others) {
      const Coord c = leaf.gridPoint(point);
      double distance = std::abs(static_cast<double>(accessor.getValue(c))) / voxelSize;
      if (point.found < distance || (point.isBesideCrease && point.found < distance + kMeasured))
        distance = point.found;
      distance = std::min(distance, point.bound);
      values.emplace_back(point.n, (point.isInside ? -1 : 1) * std::max(distance, point.plain));
    }
    setAll(field, leaf.origin, values, request_.halfWidth);
  }
}

void CreaseDistances::add(const Coord& c, const Resolved& point, bool mayHaveEdge,
                          Missing& missing) const {
  missing.points.setValueOn(c);
  const double farthest = std::min({request_.halfWidth, point.bound, point.found});
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

CreaseDistances::Cells CreaseDistances::creasesByCell(const Leaves& leaves,
                                                      const MaskTree& within) {
  Cells cells;
  for (const Leaf& leaf : leaves)
    for (const Point& point : leaf.points)
      if (const Coord c = leaf.gridPoint(point); !point.hasFailed && within.isValueOn(c))
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

}  // namespace levelset::eikonal
