#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <unordered_map>
#include <vector>

#include "levelset/csg/csg_vdb.h"
#include "levelset/grids/interpolate_vdb.h"
#include "levelset/grids/padded_leaf_vdb.h"

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
/// Largest distance that matters beyond the half width, voxels.
constexpr double kBeyond = 1e-3;
/// Distance from the centre of a cell within which its planes and lines are searched, beyond the
/// distance already found, voxels.
constexpr double kCellRadius = 0.9;
/// Largest deviation of the values at the corners of a cell from the linear function fitted to
/// them, voxels. A cell with a larger deviation contains an edge. A sphere with a radius of five
/// voxels stays below.
constexpr double kBend = 0.05;

/// Reads the distances of one operand in voxels, multiplied by its sign ±1 of CsgSigns.
struct SignedField {
  FloatGrid::ConstAccessor accessor;
  float sign;
  double perVoxel;  ///< sign / voxel size

  SignedField(const FloatGrid& grid, float sign_)
      : accessor(grid.getConstAccessor()),
        sign(sign_),
        perVoxel(static_cast<double>(sign_) / grid.voxelSize()[0]) {}

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

  CellCorners() = default;
  /// Computes the corner values of the minimum of both operands.
  CellCorners(const CellCorners& first, const CellCorners& second) {
    for (std::size_t i = 0; i < 8; ++i) values[i] = std::min(first.values[i], second.values[i]);
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

/// Finds the active voxels at which the sum of both signed distances is at most kFootMiss and one
/// of them is negative. All other voxels keep the minimum. Tests in single precision, with a
/// margin, so that some voxels pass that are not doubtful.
void findCandidates(const SharedLeaf& shared, const CsgSigns& signs, double voxelSize,
                    openvdb::util::NodeMask<3>& voxels) {
  constexpr double kMargin = 1e-3;  // voxels, far above the rounding error of the sum
  const float *a = shared.a->buffer().data(), *b = shared.b->buffer().data();
  const auto limit = static_cast<float>((kFootMiss + kMargin) * voxelSize);
  std::array<unsigned char, Leaf::SIZE> isCandidate;
  for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
    const float u = signs.first * a[n], v = signs.second * b[n];
    isCandidate[n] = static_cast<unsigned char>((u + v <= limit) & (std::min(u, v) < 0));
  }
  voxels = shared.a->valueMask();
  voxels &= shared.b->valueMask();
  for (auto it = voxels.beginOn(); it; ++it)
    if (!isCandidate[it.pos()]) voxels.setOff(it.pos());
}

/// Grid points of a leaf block that share a cell face with a grid point outside both operands.
class BesideSurface {
 public:
  BesideSurface(const SignedField& u, const SignedField& v, const Coord& origin) {
    PaddedLeaf<1> first, second;
    fill(u, origin, first);
    fill(v, origin, second);
    std::array<std::array<std::uint32_t, 10>, 10> outside;  // bit z + 1: φ ≥ 0 for both
    for (int x = 0; x < 10; ++x)
      for (int y = 0; y < 10; ++y) {
        const float *a = first.at(x - 1, y - 1, -1), *b = second.at(x - 1, y - 1, -1);
        std::uint32_t bits = 0;
        for (int z = 0; z < 10; ++z)
          bits |= static_cast<std::uint32_t>(!(u.sign * a[z] < 0) & !(v.sign * b[z] < 0)) << z;
        outside[at(x)][at(y)] = bits;
      }
    const auto along = [](std::uint32_t bits) { return bits | bits << 1 | bits >> 1; };
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y) {
        const auto row = [&](int dx, int dy) { return outside[at(x + 1 + dx)][at(y + 1 + dy)]; };
        const std::uint32_t bits =
            along(row(0, 0) | row(-1, 0) | row(1, 0) | row(0, -1) | row(0, 1)) | row(-1, -1) |
            row(-1, 1) | row(1, -1) | row(1, 1);
        rows_[at(x * 8 + y)] = static_cast<std::uint8_t>(bits >> 1);
      }
  }
  [[nodiscard]] bool holds(openvdb::Index n) const { return rows_[n >> 3] >> (n & 7) & 1; }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static void fill(const SignedField& field, const Coord& origin, PaddedLeaf<1>& values) {
    values.fill([&](const Coord& step) {
      return blockValues(field.accessor, origin.offsetBy(8 * step.x(), 8 * step.y(), 8 * step.z()));
    });
  }

  std::array<std::uint8_t, 64> rows_;  ///< one row along z for each x and y
};

/// Values of one operand at the corners of all cells of a leaf block, and their signs.
class CellBlock {
 public:
  void load(const SignedField& field, const Coord& origin) {
    perVoxel_ = field.perVoxel;
    copyPaddedLeaf(field.accessor, origin, 0, 1, values_.data());
    for (std::size_t row = 0; row < kSide * kSide; ++row) {
      std::uint32_t bits = 0;
      for (std::size_t z = 0; z < kSide; ++z)
        bits |= static_cast<std::uint32_t>(field.sign * values_[row * kSide + z] < 0) << z;
      inside_[row] = bits;
    }
  }
  /// Returns the signs of a row of nine grid points along z: bit z is set inside.
  [[nodiscard]] std::uint32_t inside(int x, int y) const { return inside_[rowOf(x, y)]; }
  [[nodiscard]] CellCorners corners(int x, int y, int z) const {
    CellCorners result;
    for (int i = 0; i < 8; ++i) {
      const std::size_t slot =
          rowOf(x + (i >> 2 & 1), y + (i >> 1 & 1)) * kSide + static_cast<std::size_t>(z + (i & 1));
      result.values[static_cast<std::size_t>(i)] = perVoxel_ * static_cast<double>(values_[slot]);
    }
    return result;
  }

 private:
  static constexpr std::size_t kSide = 9;
  static std::size_t rowOf(int x, int y) {
    return static_cast<std::size_t>(x) * kSide + static_cast<std::size_t>(y);
  }

  double perVoxel_ = 0;
  std::array<float, kSide * kSide * kSide> values_;
  std::array<std::uint32_t, kSide * kSide> inside_;
};

/// Surface cells of one leaf block.
struct CellList {
  Coord origin;
  openvdb::CoordBBox needed;  ///< index bounds of the cells that a doubtful voxel may read
  std::vector<SurfaceCell> cells;
};

/// Cells that may be nearest to a doubtful voxel of one leaf block. Positions are relative to the
/// first grid point of the block, in voxels; they are multiples of 1/2, so floats hold them
/// exactly.
struct NearCells {
  std::vector<const SurfaceCell*> cells;
  std::vector<float> x, y, z, squared;

  void clear() {
    cells.clear();
    for (std::vector<float>* list : {&x, &y, &z}) list->clear();
  }
  void add(const SurfaceCell& cell, const Coord& origin) {
    const Vec3d center = cell.center - origin.asVec3d();
    cells.push_back(&cell);
    x.push_back(static_cast<float>(center.x()));
    y.push_back(static_cast<float>(center.y()));
    z.push_back(static_cast<float>(center.z()));
  }
  /// Computes `squared`, the squared distances of all cell centres from a grid point of the block.
  void measureFrom(const Coord& local) {
    squared.resize(cells.size());
    const auto px = static_cast<float>(local.x()), py = static_cast<float>(local.y()),
               pz = static_cast<float>(local.z());
    for (std::size_t i = 0; i < squared.size(); ++i)
      squared[i] =
          (x[i] - px) * (x[i] - px) + (y[i] - py) * (y[i] - py) + (z[i] - pz) * (z[i] - pz);
  }
};

class SeamSurvey {
 public:
  SeamSurvey(const FloatGrid& a, const FloatGrid& b, const CsgSigns& signs)
      : a_(a),
        b_(b),
        signs_(signs),
        reach_(static_cast<double>(a.background()) / a.voxelSize()[0]) {}

  std::vector<SeamDistances> run(const std::vector<SharedLeaf>& shared) {
    findDoubtful(shared);
    if (doubtful_.empty()) return {};
    collectCells();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, doubtful_.size(), 4),
                      [&](const auto& range) {
                        NearCells near;
                        for (std::size_t i = range.begin(); i != range.end(); ++i)
                          measure(doubtful_[i], near);
                      });
    return std::move(doubtful_);
  }

 private:
  void findDoubtful(const std::vector<SharedLeaf>& shared) {
    std::vector<SeamDistances> found(shared.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, shared.size(), 16),
                      [&](const auto& range) {
                        const SignedField u(a_, signs_.first), v(b_, signs_.second);
                        openvdb::util::NodeMask<3> candidates;
                        for (std::size_t i = range.begin(); i != range.end(); ++i) {
                          findCandidates(shared[i], signs_, a_.voxelSize()[0], candidates);
                          if (candidates.isOff()) continue;
                          found[i].origin = shared[i].a->origin();
                          const BesideSurface beside(u, v, found[i].origin);
                          for (auto it = candidates.beginOn(); it; ++it)
                            if (!beside.holds(it.pos()) &&
                                isDoubtful(u, v, shared[i].a->offsetToGlobalCoord(it.pos())))
                              found[i].voxels.push_back({it.pos(), 0});
                        }
                      });
    for (SeamDistances& leaf : found)
      if (!leaf.voxels.empty()) doubtful_.push_back(std::move(leaf));
  }

  /// Decides if the distance of a voxel must be computed again.
  /// @pre the voxel is not beside the surface: there the value affects the position of the surface
  ///      and must not change
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

  /// Largest distance of a cell's centre from a voxel whose distance it can change, voxels.
  [[nodiscard]] double cellReach() const { return reach_ + kBeyond + kCellRadius; }

  /// Returns the index bounds of the cells whose centre may lie within cellReach() of a doubtful
  /// voxel of a leaf.
  [[nodiscard]] openvdb::CoordBBox cellsNear(const SeamDistances& leaf) const {
    openvdb::CoordBBox box;
    for (const auto& voxel : leaf.voxels)
      box.expand(leaf.origin + Leaf::offsetToLocalCoord(voxel.offset));
    const int reach = static_cast<int>(std::ceil(cellReach()));
    return {box.min().offsetBy(-reach - 1), box.max().offsetBy(reach)};
  }

  /// Collects the surface cells within the half width of doubtful voxels.
  void collectCells() {
    for (const SeamDistances& leaf : doubtful_) {
      const openvdb::CoordBBox near = cellsNear(leaf);
      forEachBlockAround(leaf.origin, [&](const Coord& origin) {
        openvdb::CoordBBox box = openvdb::CoordBBox::createCube(origin, Leaf::DIM);
        box.intersect(near);
        if (box.empty()) return;
        const auto [slot, isNew] = listAt_.emplace(origin, lists_.size());
        if (isNew) lists_.push_back({origin, {}, {}});
        lists_[slot->second].needed.expand(box);
      });
    }
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, lists_.size(), 16), [&](const auto& range) {
          const SignedField u(a_, signs_.first), v(b_, signs_.second);
          const auto first = std::make_unique<CellBlock>(), second = std::make_unique<CellBlock>();
          for (std::size_t i = range.begin(); i != range.end(); ++i) {
            const Coord& origin = lists_[i].origin;
            if (!u.accessor.probeConstLeaf(origin) && !v.accessor.probeConstLeaf(origin)) continue;
            first->load(u, origin);
            second->load(v, origin);
            addCells(*first, *second, lists_[i]);
          }
        });
  }

  /// Calls work(origin) for all leaf blocks that may hold a cell within reach of a block's voxels.
  template <typename Work>
  void forEachBlockAround(const Coord& origin, const Work& work) const {
    const int steps = static_cast<int>(std::ceil((reach_ + 2) / 8));
    for (int x = -steps; x <= steps; ++x)
      for (int y = -steps; y <= steps; ++y)
        for (int z = -steps; z <= steps; ++z) work(origin.offsetBy(8 * x, 8 * y, 8 * z));
  }

  /// Adds the cells of a leaf block that the surface of the union crosses.
  static void addCells(const CellBlock& u, const CellBlock& v, CellList& list) {
    const Coord low = list.needed.min() - list.origin, high = list.needed.max() - list.origin;
    const std::uint32_t wanted = (2u << high.z()) - (1u << low.z());
    for (int x = low.x(); x <= high.x(); ++x)
      for (int y = low.y(); y <= high.y(); ++y) {
        std::uint32_t both = ~0u, anyU = 0, anyV = 0;
        for (int i = 0; i < 4; ++i) {
          const std::uint32_t inU = u.inside(x + (i >> 1), y + (i & 1)),
                              inV = v.inside(x + (i >> 1), y + (i & 1));
          both &= inU | inV;
          anyU |= inU;
          anyV |= inV;
        }
        const std::uint32_t allInside = both & both >> 1;
        anyU |= anyU >> 1;
        anyV |= anyV >> 1;
        for (std::uint32_t bits = wanted & ~allInside & (anyU | anyV); bits; bits &= bits - 1) {
          const int z = __builtin_ctz(bits);
          list.cells.push_back(surfaceCell(u.corners(x, y, z), v.corners(x, y, z),
                                           list.origin.offsetBy(x, y, z), anyU >> z & 1,
                                           anyV >> z & 1));
        }
      }
  }

  static SurfaceCell surfaceCell(const CellCorners& first, const CellCorners& second,
                                 const Coord& c, bool crossesFirst, bool crossesSecond) {
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
    return cell;
  }

  void measure(SeamDistances& leaf, NearCells& near) const {
    near.clear();
    const openvdb::CoordBBox box = cellsNear(leaf);
    forEachBlockAround(leaf.origin, [&](const Coord& origin) {
      const auto slot = listAt_.find(origin);
      if (slot == listAt_.end()) return;
      for (const SurfaceCell& cell : lists_[slot->second].cells)
        if (box.isInside(Coord::floor(cell.center))) near.add(cell, leaf.origin);
    });
    const double voxelSize = a_.voxelSize()[0];
    for (auto& voxel : leaf.voxels)
      voxel.distance =
          voxelSize * surfaceDistance(Leaf::offsetToLocalCoord(voxel.offset), leaf.origin, near);
  }

  /// Returns the distance of a grid point from the planes and lines of the cells, voxels. Returns
  /// slightly more than the half width if all are farther away.
  double surfaceDistance(const Coord& local, const Coord& origin, NearCells& near) const {
    near.measureFrom(local);
    const auto farthest = static_cast<float>(cellReach() * cellReach() * 1.001);
    const Vec3d p = (origin + local).asVec3d();
    double best = reach_ + kBeyond;
    for (std::size_t i = 0; i < near.cells.size(); ++i) {
      if (near.squared[i] > farthest) continue;
      const SurfaceCell& cell = *near.cells[i];
      const Vec3d r = p - cell.center;
      const double bound = best + kCellRadius;
      if (r.lengthSqr() >= bound * bound) continue;
      best = patchDistance(cell.first, cell.second, cell.isSeam, r, best);
      best = patchDistance(cell.second, cell.first, cell.isSeam, r, best);
      if (cell.isSeam) best = lineDistance(cell, r, best);
    }
    return best;
  }

  const FloatGrid &a_, &b_;
  CsgSigns signs_;
  double reach_;  ///< half width of the band, voxels
  std::vector<SeamDistances> doubtful_;
  std::vector<CellList> lists_;
  std::unordered_map<Coord, std::size_t, std::hash<Coord>> listAt_;  ///< by leaf origin
};

}  // namespace

std::vector<SeamDistances> seamDistances(const FloatGrid& a, const FloatGrid& b,
                                         const CsgSigns& signs,
                                         const std::vector<SharedLeaf>& shared) {
  return SeamSurvey(a, b, signs).run(shared);
}

void correctSeam(FloatGrid& result, const std::vector<SeamDistances>& distances) {
  const float background = result.background();
  tbb::parallel_for(std::size_t{0}, distances.size(), [&](std::size_t i) {
    Leaf* leaf = result.tree().probeLeaf(distances[i].origin);
    if (!leaf) return;
    for (const auto& [n, distance] : distances[i].voxels) {
      const float old = leaf->getValue(n);
      const auto value = static_cast<float>(std::max(distance, std::abs(static_cast<double>(old))));
      if (value < background)
        leaf->setValueOnly(n, old < 0 ? -value : value);  // -0 is outside
      else
        leaf->setValueOff(n, old < 0 ? -background : background);
    }
  });
}

}  // namespace levelset
