#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "levelset/csg/csg_vdb.h"
#include "levelset/grids/interpolate_vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3d;
using Leaf = openvdb::FloatTree::LeafNodeType;

/// Largest error of a foot point, the estimated closest surface point of a voxel, in voxels. A
/// voxel with a larger error counts as doubtful. The distances of doubtful voxels are computed
/// again, so a smaller value costs time, not accuracy.
constexpr double kFootMiss = 0.02;
/// Half the edge of a cell plus an overlap, voxels: the part of a plane, or of the intersection
/// line of two planes, that belongs to the cell. The planes deviate from a curved surface by a
/// quarter of its curvature, and the parts of neighbouring cells must leave no gap.
constexpr double kPatchReach = 0.5 + 0.05;
constexpr double kLineReach = 0.5 + 0.1;
/// Largest deviation of the values at the corners of a cell from the linear function fitted to
/// them, voxels. A cell with a larger deviation contains an edge. A sphere with a radius of five
/// voxels stays below.
constexpr double kBend = 0.05;

/// Reads the distances of one operand in voxels, multiplied by its sign ±1 of CsgSigns.
struct SignedField {
  FloatGrid::ConstAccessor accessor;
  double perVoxel;  ///< sign / voxel size

  SignedField(const FloatGrid& grid, float sign)
      : accessor(grid.getConstAccessor()),
        perVoxel(static_cast<double>(sign) / grid.voxelSize()[0]) {}

  double operator()(const Coord& c) const {
    return perVoxel * static_cast<double>(accessor.getValue(c));
  }
  double operator()(const Vec3d& index) const {
    return perVoxel * SampleBlock<2>(accessor, index).value();
  }
  /// Returns the direction from an inside grid point to the surface, of length about 1 where the
  /// values are distances. Along each axis, uses the neighbour that is closer to the surface.
  Vec3d towardsSurface(const Coord& c) const {
    const double here = (*this)(c);
    Vec3d direction(0, 0, 0);
    for (int axis = 0; axis < 3; ++axis) {
      Coord up = c, down = c;
      ++up[axis];
      --down[axis];
      const double rise = (*this)(up)-here, fall = (*this)(down)-here;
      if (std::max(rise, fall) > 0) direction[axis] = rise > fall ? rise : -fall;
    }
    return direction;
  }
};

/// Plane n·y + d = 0 that fits a surface in a cell, in voxels, with unit normal n and y relative to
/// the cell's centre.
struct Patch {
  bool isValid = false;
  Vec3d n;
  double d = 0;

  double above(const Vec3d& y) const { return n.dot(y) + d; }
};

/// Surface of the minimum of both operands in one cell of eight grid points, as one or two planes.
struct SurfaceCell {
  Vec3d center;
  Patch first, second;
  /// Both surfaces cross the cell. Of each plane, only the part outside the other solid counts.
  bool isSeam = false;
};

/// Values at the eight corners of a cell, in voxels.
struct CellCorners {
  std::array<double, 8> values;

  /// Computes the corner values of the minimum of both operands.
  CellCorners(const CellCorners& first, const CellCorners& second) {
    for (std::size_t i = 0; i < 8; ++i) values[i] = std::min(first.values[i], second.values[i]);
  }

  CellCorners(const SignedField& field, const Coord& c) {
    for (int i = 0; i < 8; ++i)
      values[static_cast<std::size_t>(i)] = field(c.offsetBy((i >> 2) & 1, (i >> 1) & 1, i & 1));
  }
  /// Returns true if each corner is inside this operand or the one of `other`, so that no surface
  /// of their union crosses the cell.
  bool allInsideWith(const CellCorners& other) const {
    for (std::size_t i = 0; i < 8; ++i)
      if (!(values[i] < 0) && !(other.values[i] < 0)) return false;
    return true;
  }
  bool allOutside() const {
    return std::none_of(values.begin(), values.end(), [](double v) { return v < 0; });
  }
  /// Returns true if the corner values deviate from a plane, because an edge of the solid crosses
  /// the cell.
  bool isBent() const {
    const Patch plane = patch();
    if (!plane.isValid) return true;
    const double slope = slopeLength();
    for (int i = 0; i < 8; ++i) {
      const Vec3d corner((i & 4) ? 0.5 : -0.5, (i & 2) ? 0.5 : -0.5, (i & 1) ? 0.5 : -0.5);
      if (std::abs(slope * plane.above(corner) - values[static_cast<std::size_t>(i)]) > kBend)
        return true;
    }
    return false;
  }
  Patch patch() const {
    const double length = slopeLength();
    if (length < 1e-3) return {};
    double mean = 0;
    for (const double v : values) mean += v / 8;
    return {true, slope() / length, mean / length};
  }

 private:
  Vec3d slope() const {
    Vec3d sum(0, 0, 0);
    for (int i = 0; i < 8; ++i) {
      const double v = values[static_cast<std::size_t>(i)] / 4;
      sum += Vec3d((i & 4) ? v : -v, (i & 2) ? v : -v, (i & 1) ? v : -v);
    }
    return sum;
  }
  double slopeLength() const { return slope().length(); }
};

Vec3d clamped(const Vec3d& y, double reach) {
  return {std::clamp(y[0], -reach, reach), std::clamp(y[1], -reach, reach),
          std::clamp(y[2], -reach, reach)};
}

/// Returns the distance from r to the part of a plane in the cell, or `best` if that is smaller. If
/// `isSeam`, only the part outside the other solid counts. The position r is relative to the centre
/// of the cell, voxels.
double patchDistance(const Patch& patch, const Patch& other, bool isSeam, const Vec3d& r,
                     double best) {
  if (!patch.isValid || std::abs(patch.above(r)) >= best) return best;
  Vec3d y = r;
  for (int i = 0; i < 3; ++i) y = clamped(y - patch.above(y) * patch.n, kPatchReach);
  y -= patch.above(y) * patch.n;
  if (isSeam && other.isValid && other.above(y) < 0) return best;
  return std::min(best, (r - y).length());
}

/// Returns the distance from r to the intersection line of both planes within the cell, or `best`
/// if that is smaller. The position r is relative to the centre of the cell, voxels.
double lineDistance(const SurfaceCell& cell, const Vec3d& r, double best) {
  const Patch &p = cell.first, &q = cell.second;
  if (!p.isValid || !q.isValid) return best;
  const Vec3d along = p.n.cross(q.n);
  const double squaredSine = along.lengthSqr();
  if (squaredSine < 1e-4) return best;  // nearly parallel
  const double cosine = p.n.dot(q.n);
  const Vec3d origin =
      ((cosine * q.d - p.d) / squaredSine) * p.n + ((cosine * p.d - q.d) / squaredSine) * q.n;
  double from = -4, to = 4;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(along[axis]) < 1e-9) {
      if (std::abs(origin[axis]) > kLineReach) return best;
      continue;
    }
    const double a = (-kLineReach - origin[axis]) / along[axis];
    const double b = (kLineReach - origin[axis]) / along[axis];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  if (from > to) return best;
  const double t = std::clamp((r - origin).dot(along) / squaredSine, from, to);
  return std::min(best, (r - origin - t * along).length());
}

class SeamCorrector {
 public:
  SeamCorrector(FloatGrid& result, const FloatGrid& a, const FloatGrid& b, const CsgSigns& signs)
      : result_(result),
        a_(a),
        b_(b),
        signs_(signs),
        reach_(static_cast<double>(result.background()) / result.voxelSize()[0]) {}

  void run() {
    findDoubtful();
    if (doubtful_.empty()) return;
    collectCells();
    tbb::parallel_for(std::size_t{0}, doubtful_.size(),
                      [&](std::size_t i) { correct(doubtful_[i]); });
  }

 private:
  struct DoubtfulLeaf {
    Coord origin;
    std::vector<openvdb::Index> voxels;
  };

  void findDoubtful() {
    std::vector<const Leaf*> shared;
    for (auto leaf = b_.tree().cbeginLeaf(); leaf; ++leaf)
      if (a_.tree().probeConstLeaf(leaf->origin())) shared.push_back(leaf.getLeaf());
    std::vector<DoubtfulLeaf> found(shared.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, shared.size(), 16),
                      [&](const auto& range) {
                        const SignedField u(a_, signs_.first), v(b_, signs_.second);
                        for (std::size_t i = range.begin(); i != range.end(); ++i) {
                          found[i].origin = shared[i]->origin();
                          for (auto it = shared[i]->cbeginValueOn(); it; ++it) {
                            const Coord c = it.getCoord();
                            if (u.accessor.isValueOn(c) && isDoubtful(u, v, c))
                              found[i].voxels.push_back(it.pos());
                          }
                        }
                      });
    for (DoubtfulLeaf& leaf : found)
      if (!leaf.voxels.empty()) doubtful_.push_back(std::move(leaf));
  }

  static bool isDoubtful(const SignedField& u, const SignedField& v, const Coord& c) {
    const double atU = u(c), atV = v(c);
    if (!(std::min(atU, atV) < 0) || (atU == atV && isOneSurface(u, v, c))) return false;
    const SignedField& winner = atU < atV ? u : v;
    const SignedField& loser = atU < atV ? v : u;
    const double depth = -std::min(atU, atV);
    // The winner is the operand with the smaller value. The ball about c with radius `depth` lies
    // inside it. If the loser is farther from c than `depth`, it does not contain the closest
    // surface point and cannot change the distance.
    if (std::max(atU, atV) > depth + kFootMiss) return false;
    if (isBesideSurface(u, v, c)) return false;
    const Vec3d direction = winner.towardsSurface(c);
    const double length = direction.length();
    if (!(length > 0.9 && length < 1.1)) return true;
    const Vec3d foot = c.asVec3d() + (depth / length) * direction;
    return std::abs(winner(foot)) > kFootMiss || loser(foot) < kFootMiss;
  }

  /// Returns true if both operands have equal values at all six neighbours, so that their surfaces
  /// coincide. Equal values at one grid point alone also occur midway between two surfaces.
  static bool isOneSurface(const SignedField& u, const SignedField& v, const Coord& c) {
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        Coord near = c;
        near[axis] += step;
        if (u(near) != v(near)) return false;
      }
    return true;
  }

  /// Returns true if a grid point shares a cell face with a grid point outside both operands. The
  /// value of such a grid point affects the position of the surface and must not change.
  static bool isBesideSurface(const SignedField& u, const SignedField& v, const Coord& c) {
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          if (x != 0 && y != 0 && z != 0) continue;
          const Coord near = c.offsetBy(x, y, z);
          if (!(u(near) < 0) && !(v(near) < 0)) return true;
        }
    return false;
  }

  /// Collects the surface cells of all leaves within the half width of doubtful voxels.
  void collectCells() {
    const int leaves = static_cast<int>(std::ceil((reach_ + 2) / 8)) * 8;
    for (const DoubtfulLeaf& leaf : doubtful_)
      for (int x = -leaves; x <= leaves; x += 8)
        for (int y = -leaves; y <= leaves; y += 8)
          for (int z = -leaves; z <= leaves; z += 8) cells_[leaf.origin.offsetBy(x, y, z)];
    std::vector<std::pair<const Coord, std::vector<SurfaceCell>>*> slots;
    for (auto& slot : cells_) slots.push_back(&slot);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, slots.size(), 16), [&](const auto& range) {
      const SignedField u(a_, signs_.first), v(b_, signs_.second);
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        const Coord origin = slots[i]->first;
        if (!u.accessor.probeConstLeaf(origin) && !v.accessor.probeConstLeaf(origin)) continue;
        for (const Coord& c : openvdb::CoordBBox::createCube(origin, 8))
          addCell(u, v, c, slots[i]->second);
      }
    });
  }

  static void addCell(const SignedField& u, const SignedField& v, const Coord& c,
                      std::vector<SurfaceCell>& cells) {
    const CellCorners first(u, c), second(v, c);
    if (first.allInsideWith(second)) return;
    const bool crossesFirst = !first.allOutside(), crossesSecond = !second.allOutside();
    if (!crossesFirst && !crossesSecond) return;
    SurfaceCell cell;
    cell.center = c.asVec3d() + Vec3d(0.5);
    cell.isSeam = crossesFirst && crossesSecond;
    if (cell.isSeam && (first.isBent() || second.isBent())) {
      // More than two faces meet in the cell: fit one plane to the minimum.
      cell.isSeam = false;
      cell.first = CellCorners(first, second).patch();
    } else {
      if (crossesFirst) cell.first = first.patch();
      if (crossesSecond) cell.second = second.patch();
    }
    cells.push_back(cell);
  }

  void correct(const DoubtfulLeaf& doubtful) {
    Leaf* leaf = result_.tree().probeLeaf(doubtful.origin);
    if (!leaf) return;
    const float background = result_.background();
    const double voxelSize = result_.voxelSize()[0];
    for (const openvdb::Index n : doubtful.voxels) {
      const float old = leaf->getValue(n);
      const double distance = voxelSize * surfaceDistance(leaf->offsetToGlobalCoord(n));
      const auto value = static_cast<float>(std::max(distance, std::abs(static_cast<double>(old))));
      if (value < background)
        leaf->setValueOnly(n, std::copysign(value, old));
      else
        leaf->setValueOff(n, std::copysign(background, old));
    }
  }

  /// Returns the distance of a grid point from the planes and lines in `cells_`, voxels. Returns
  /// slightly more than the half width if all are farther away.
  double surfaceDistance(const Coord& c) const {
    const int steps = static_cast<int>(std::ceil((reach_ + 2) / 8));
    const Coord home = c & ~7;
    const Vec3d p = c.asVec3d();
    double best = reach_ + 1e-3;
    for (int x = -steps; x <= steps; ++x)
      for (int y = -steps; y <= steps; ++y)
        for (int z = -steps; z <= steps; ++z) {
          const auto slot = cells_.find(home.offsetBy(8 * x, 8 * y, 8 * z));
          if (slot == cells_.end()) continue;
          for (const SurfaceCell& cell : slot->second) {
            const Vec3d r = p - cell.center;
            const double bound = best + 0.9;
            if (r.lengthSqr() >= bound * bound) continue;
            best = patchDistance(cell.first, cell.second, cell.isSeam, r, best);
            best = patchDistance(cell.second, cell.first, cell.isSeam, r, best);
            if (cell.isSeam) best = lineDistance(cell, r, best);
          }
        }
    return best;
  }

  FloatGrid& result_;
  const FloatGrid &a_, &b_;
  CsgSigns signs_;
  double reach_;  ///< half width of the band, voxels
  std::vector<DoubtfulLeaf> doubtful_;
  std::map<Coord, std::vector<SurfaceCell>> cells_;  ///< surface cells by leaf origin
};

}  // namespace

void correctSeam(FloatGrid& result, const FloatGrid& a, const FloatGrid& b, const CsgSigns& signs) {
  SeamCorrector(result, a, b, signs).run();
}

}  // namespace levelset
