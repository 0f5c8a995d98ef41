#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "render/embree/bcc_cell_vdb.h"
#include "render/embree/cubic_root.h"
#include "render/embree/judge_blocks_vdb.h"
#include "render/embree/spline_cell_vdb.h"
#include "render/embree/tetra_cell_vdb.h"

namespace render {
namespace {

using Imath::V3d;
using openvdb::Coord;
using openvdb::FloatTree;

// === Cells that the surface crosses

/// Bit z of rows[x][y] is set when the value at the grid point (x, y, z) of a block is negative. x,
/// y and z run from 0 to 8.
using SignRows = std::array<std::array<unsigned, 9>, 9>;

SignRows signRowsOf(const SurfaceBlock& block) {
  SignRows rows;
  for (unsigned x = 0; x < 9; ++x) {
    for (unsigned y = 0; y < 9; ++y) {
      unsigned bits = 0;
      for (unsigned z = 0; z < 9; ++z) bits |= unsigned{block.value(x, y, z) < 0} << z;
      rows[x][y] = bits;
    }
  }
  return rows;
}

/// Adds the cells (x, y, z) for which bit z of `cells` is set to `crossing` and `extent` of the
/// block.
void markCells(SurfaceBlock& block, unsigned x, unsigned y, unsigned cells) {
  block.crossing[x] |= std::uint64_t{cells} << (8 * y);
  for (unsigned z = 0; z < 8; ++z) {
    if (!(cells >> z & 1)) continue;
    const unsigned at[3] = {x, y, z};
    for (std::size_t a = 0; a < 3; ++a) {
      block.extent[a] = static_cast<std::uint8_t>(std::min<unsigned>(block.extent[a], at[a]));
      block.extent[a + 3] =
          static_cast<std::uint8_t>(std::max<unsigned>(block.extent[a + 3], at[a] + 1));
    }
  }
}

/// Fills `crossing` and `extent` of the block with the cells in which the spline may cross zero.
/// Returns false when there are no such cells.
bool markSplineCells(SurfaceBlock& block, const DrawnField& field) {
  const SplineCoefficients<8> coefficients(field.tree, block.origin, field.filter);
  if (!coefficients.mayCross()) return false;
  block.crossing.fill(0);
  block.extent = {8, 8, 8, 0, 0, 0};
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      unsigned cells = 0;
      for (int z = 0; z < 8; ++z)
        cells |= unsigned{SplineCell(coefficients, x, y, z).mayCross()} << z;
      markCells(block, static_cast<unsigned>(x), static_cast<unsigned>(y), cells);
    }
  return block.extent[3] != 0;
}

/// Fills `crossing` and `extent` of the block with the cells whose corners differ in sign. Returns
/// false when there are no such cells.
bool markCrossingCells(SurfaceBlock& block) {
  const SignRows rows = signRowsOf(block);
  block.crossing.fill(0);
  block.extent = {8, 8, 8, 0, 0, 0};
  for (unsigned x = 0; x < 8; ++x) {
    for (unsigned y = 0; y < 8; ++y) {
      const unsigned some = rows[x][y] | rows[x + 1][y] | rows[x][y + 1] | rows[x + 1][y + 1];
      const unsigned all = rows[x][y] & rows[x + 1][y] & rows[x][y + 1] & rows[x + 1][y + 1];
      const unsigned cells = (some | some >> 1) & ~(all & all >> 1) & 0xffu;
      markCells(block, x, y, cells);
    }
  }
  return block.extent[3] != 0;
}

/// The same for a spline on tetrahedra.
bool markTetraCells(SurfaceBlock& block, const DrawnField& field) {
  const auto mayCross = [&](const Coord& cell) {
    return field.filter == Filter::BccQuadratic
               ? BccCell(field.tree, cell).mayCross()
               : TetraCell(field.tree, cell, field.filter).mayCross();
  };
  if (field.filter == Filter::BccQuadratic && !bccMayCross(field.tree, block.origin)) return false;
  block.crossing.fill(0);
  block.extent = {8, 8, 8, 0, 0, 0};
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      unsigned cells = 0;
      for (int z = 0; z < 8; ++z) cells |= unsigned{mayCross(block.origin.offsetBy(x, y, z))} << z;
      markCells(block, static_cast<unsigned>(x), static_cast<unsigned>(y), cells);
    }
  return block.extent[3] != 0;
}

/// Clears the cells outside a box. Returns false when no cell is left.
bool keepCells(SurfaceBlock& block, const openvdb::CoordBBox& cells) {
  if (cells.isInside(openvdb::CoordBBox::createCube(block.origin, 8))) return true;
  const std::array<std::uint64_t, 8> marked = std::exchange(block.crossing, {});
  block.extent = {8, 8, 8, 0, 0, 0};
  for (unsigned n = 0; n < 512; ++n) {
    const unsigned x = n >> 6, y = n >> 3 & 7, z = n & 7;
    const Coord cell =
        block.origin.offsetBy(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z));
    if ((marked[x] >> (8 * y + z) & 1) && cells.isInside(cell)) markCells(block, x, y, 1u << z);
  }
  return block.extent[3] != 0;
}

// === Traversal of a block, cell by cell

/// Traversal of one block by a ray: the present cell and the plane through which the ray entered
/// it.
struct BlockTraversal {
  const SurfaceBlock& block;
  const IndexRay& ray;
  /// Interval of the ray's parameter inside the block and inside the range of the search [near,
  /// far], world units.
  double enter, leave;
  /// Axis of the plane through which the ray entered the present cell; -1: the ray starts inside
  /// the cell.
  int axis = -1;
  int cell[3] = {};  ///< index coordinates of the lowest corner of the present cell
  double t = 0;      ///< ray parameter at the entry into the present cell

  [[nodiscard]] bool isForward(int a) const { return ray.direction[a] > 0; }
  [[nodiscard]] double exitPlane(int a, int k) const {
    return ray.plane(a, isForward(a) ? k + 1 : k);
  }
  [[nodiscard]] double entryPlane(int a, int k) const {
    return ray.plane(a, isForward(a) ? k : k + 1);
  }

  bool clip();
  void findFirstCell();
  int exitAxis(double& exit) const;
  /// Computes the positions p[0] of the ray at `t` and p[1] at `exit` in the present cell, from 0
  /// to 1 on each axis. On a face of the cell the coordinate is exactly 0 or 1.
  void placesInCell(double exit, int outAxis, double (&p)[2][3]) const;
  [[nodiscard]] BernsteinCubic restrictToRay(double exit, int outAxis) const;
  [[nodiscard]] std::optional<double> splineRoot(const DrawnField& field, double exit,
                                                 int outAxis) const;
  /// Appends the zeros of the spline along the ray in the present cell, as fractions from 0 (`t`)
  /// to 1 (`exit`). Returns true when the ray is inside the solid at `t`.
  bool addSplineRoots(const DrawnField& field, double exit, int outAxis,
                      std::vector<double>& shares) const;
};

/// Clips the ray to the block. Returns false when the ray misses the block. When the ray meets
/// several planes of the block at the same parameter, the plane of the last axis is the entry
/// plane. findFirstCell() and exitAxis() use the same order.
bool BlockTraversal::clip() {
  for (int a = 0; a < 3; ++a) {
    const int low = block.origin[a], high = low + 8;
    if (ray.isParallel[a]) {
      if (!(ray.origin[a] >= low && ray.origin[a] < high)) return false;
      continue;
    }
    const double in = ray.plane(a, isForward(a) ? low : high);
    const double out = ray.plane(a, isForward(a) ? high : low);
    if (in >= enter) {
      enter = in;
      axis = a;
    }
    leave = std::min(leave, out);
  }
  return enter <= leave;
}

/// Finds the cell in which a traversal of the entire grid would enter this block. The estimate by
/// floor() may be off by rounding. It is corrected by comparing `t` with the parameters of the
/// cell's planes.
void BlockTraversal::findFirstCell() {
  t = enter;
  for (int a = 0; a < 3; ++a) {
    const int low = block.origin[a], high = low + 7;
    const int forward = isForward(a) ? 1 : -1;
    if (a == axis) {
      cell[a] = forward > 0 ? low : high;
      continue;
    }
    cell[a] = static_cast<int>(
        std::clamp(std::floor(ray.at(a, t)), static_cast<double>(low), static_cast<double>(high)));
    if (ray.isParallel[a]) continue;
    // If the ray meets planes of several axes at the same parameter, it crosses them in the order
    // x, y, z.
    const bool isEarlier = axis >= 0 && a < axis, isLater = axis >= 0 && a > axis;
    const int last = forward > 0 ? high : low, first = forward > 0 ? low : high;
    while (cell[a] != last &&
           (exitPlane(a, cell[a]) < t || (isEarlier && exitPlane(a, cell[a]) == t)))
      cell[a] += forward;
    while (cell[a] != first &&
           (entryPlane(a, cell[a]) > t || (isLater && entryPlane(a, cell[a]) == t)))
      cell[a] -= forward;
  }
}

int BlockTraversal::exitAxis(double& exit) const {
  int result = -1;
  exit = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    if (ray.isParallel[a]) continue;
    const double out = exitPlane(a, cell[a]);
    if (out < exit) {
      exit = out;
      result = a;
    }
  }
  return result;
}

/// Interpolates linearly. Returns exactly a at 0 and b at 1, so a value on a face is the same from
/// both sides.
double mix(double a, double b, double f) {
  return a * (1 - f) + b * f;
}

void BlockTraversal::placesInCell(double exit, int outAxis, double (&p)[2][3]) const {
  for (int a = 0; a < 3; ++a) {
    const double base = cell[a];
    p[0][a] = std::clamp(ray.at(a, t) - base, 0.0, 1.0);
    p[1][a] = std::clamp(ray.at(a, exit) - base, 0.0, 1.0);
  }
  if (axis >= 0) p[0][axis] = isForward(axis) ? 0 : 1;
  if (outAxis >= 0) p[1][outAxis] = isForward(outAxis) ? 1 : 0;
}

std::optional<double> BlockTraversal::splineRoot(const DrawnField& field, double exit,
                                                 int outAxis) const {
  double p[2][3];
  placesInCell(exit, outAxis, p);
  const Coord at(cell[0], cell[1], cell[2]);
  if (field.filter == Filter::BccQuadratic)
    return BccCell(field.tree, at)
        .firstSignChange(V3d(p[0][0], p[0][1], p[0][2]), V3d(p[1][0], p[1][1], p[1][2]));
  if (tetrahedralDegree(field.filter) > 0)
    return TetraCell(field.tree, at, field.filter)
        .firstSignChange(V3d(p[0][0], p[0][1], p[0][2]), V3d(p[1][0], p[1][1], p[1][2]));
  const SplineCell spline(SplineCoefficients<1>(field.tree, at, field.filter));
  return spline.firstSignChange(V3d(p[0][0], p[0][1], p[0][2]), V3d(p[1][0], p[1][1], p[1][2]));
}

bool BlockTraversal::addSplineRoots(const DrawnField& field, double exit, int outAxis,
                                    std::vector<double>& shares) const {
  double p[2][3];
  placesInCell(exit, outAxis, p);
  const V3d start(p[0][0], p[0][1], p[0][2]);
  const V3d end(p[1][0], p[1][1], p[1][2]);
  const Coord at(cell[0], cell[1], cell[2]);
  if (field.filter == Filter::BccQuadratic) {
    const BccCell spline(field.tree, at);
    spline.addSignChanges(start, end, shares);
    return spline.value(start) < 0;
  }
  if (tetrahedralDegree(field.filter) > 0) {
    const TetraCell spline(field.tree, at, field.filter);
    spline.addSignChanges(start, end, shares);
    return spline.value(start) < 0;
  }
  const SplineCell spline(SplineCoefficients<1>(field.tree, at, field.filter));
  spline.addSignChanges(start, end, shares);
  return spline.value(start) < 0;
}

/// Bernstein coefficients of the trilinear interpolant along the ray between `t` and `exit`. They
/// are values of the blossom of the interpolant at the two ends, because the interpolant is affine
/// in each coordinate. On a face of the cell the coordinate is exactly 0 or 1.
/// @param outAxis  axis of the face at `exit`; -1 when the ray ends within the cell
BernsteinCubic BlockTraversal::restrictToRay(double exit, int outAxis) const {
  double p[2][3];
  placesInCell(exit, outAxis, p);
  unsigned c[3];
  for (int a = 0; a < 3; ++a) c[a] = static_cast<unsigned>(cell[a] - block.origin[a]);
  // Grid values interpolated along x only, and along x, y and z. Indices of interpolated axes: 0
  // for the ray at `t`, 1 at `exit`; other indices: 0 for the lower, 1 for the upper grid point.
  double alongX[2][2][2], value[2][2][2];
  for (unsigned y = 0; y < 2; ++y) {
    for (unsigned z = 0; z < 2; ++z) {
      const double v0 = block.value(c[0], c[1] + y, c[2] + z);
      const double v1 = block.value(c[0] + 1, c[1] + y, c[2] + z);
      for (int i = 0; i < 2; ++i) alongX[i][y][z] = mix(v0, v1, p[i][0]);
    }
  }
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      const double w0 = mix(alongX[i][0][0], alongX[i][1][0], p[j][1]);
      const double w1 = mix(alongX[i][0][1], alongX[i][1][1], p[j][1]);
      for (int k = 0; k < 2; ++k) value[i][j][k] = mix(w0, w1, p[k][2]);
    }
  }
  return {value[0][0][0], (value[0][0][1] + value[0][1][0] + value[1][0][0]) / 3,
          (value[0][1][1] + value[1][0][1] + value[1][1][0]) / 3, value[1][1][1]};
}

}  // namespace

IndexRay::IndexRay(const V3d& origin_, const V3d& direction_)
    : origin(origin_), direction(direction_) {
  for (int a = 0; a < 3; ++a) {
    inverse[a] = 1 / direction[a];
    isParallel[a] = !std::isfinite(inverse[a]);
  }
}

Imath::Box3d SurfaceBlock::bounds() const {
  const V3d base(origin.x(), origin.y(), origin.z());
  return {base + V3d(extent[0], extent[1], extent[2]), base + V3d(extent[3], extent[4], extent[5])};
}

std::vector<SurfaceBlock> surfaceBlocks(const DrawnField& field) {
  const FloatTree& tree = field.tree;
  using Leaf = FloatTree::LeafNodeType;
  // A cell belongs to the block of its lowest corner. So points of a leaf are also corners of cells
  // in the seven blocks before it along the axes, which may have no leaves of their own.
  std::vector<Coord> origins;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
    for (int n = 0; n < 8; ++n)
      origins.push_back(leaf->origin() - Coord(8 * (n >> 2), 8 * (n >> 1 & 1), 8 * (n & 1)));
  std::sort(origins.begin(), origins.end());
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());

  std::vector<std::optional<SurfaceBlock>> found(origins.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, origins.size(), 64), [&](const auto& range) {
    openvdb::tree::ValueAccessor<const FloatTree, false> accessor(tree);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      SurfaceBlock block;
      block.origin = origins[i];
      for (unsigned n = 0; n < 8; ++n) {
        const Coord at =
            origins[i] + Coord(static_cast<int>(8 * (n >> 2)), static_cast<int>(8 * (n >> 1 & 1)),
                               static_cast<int>(8 * (n & 1)));
        const Leaf* leaf = accessor.probeConstLeaf(at);
        block.leaves[n] = leaf ? leaf->buffer().data() : nullptr;
        block.tiles[n] = leaf ? 0 : accessor.getValue(at);
      }
      const bool isOnTetrahedra =
          tetrahedralDegree(field.filter) > 0 || field.filter == Filter::BccQuadratic;
      const bool crosses = isOnTetrahedra                      ? markTetraCells(block, field)
                           : field.filter == Filter::Trilinear ? markCrossingCells(block)
                                                               : markSplineCells(block, field);
      if (crosses && keepCells(block, field.cells)) found[i] = block;
    }
  });
  std::vector<SurfaceBlock> blocks;
  for (const auto& block : found)
    if (block) blocks.push_back(*block);
  return blocks;
}

namespace {

/// Visits the cells of a block that are marked in `crossing`, in their order along the ray.
/// @param far  parameter at the end of the ray
/// @param visit  called with the parameter and the axis of the ray's exit from the cell (axis -1:
/// the ray ends in the cell); returns true to continue
template <typename Visit>
void traverseCells(BlockTraversal& walk, double far, const Visit& visit) {
  if (!walk.clip()) return;
  walk.findFirstCell();
  for (;;) {
    double exit;
    int exitAxis = walk.exitAxis(exit);
    const int stepAxis = exitAxis;
    if (!(exit < far)) {
      exit = far;
      exitAxis = -1;
    }
    const int x = walk.cell[0] - walk.block.origin[0];
    const int bit = (walk.cell[1] - walk.block.origin[1]) * 8 + walk.cell[2] - walk.block.origin[2];
    const bool isMarked = walk.block.crossing[static_cast<std::size_t>(x)] >> bit & 1;
    if (isMarked && !visit(exit, exitAxis)) return;
    if (exitAxis < 0) return;
    walk.cell[stepAxis] += walk.isForward(stepAxis) ? 1 : -1;
    const int local = walk.cell[stepAxis] - walk.block.origin[stepAxis];
    if (local < 0 || local > 7) return;
    walk.axis = stepAxis;
    walk.t = exit;
  }
}

}  // namespace

std::optional<double> findCrossing(const DrawnField& field, const SurfaceBlock& block,
                                   const IndexRay& ray, double near, double far, Search search) {
  BlockTraversal walk{block, ray, near, far};
  std::optional<double> found;
  traverseCells(walk, far, [&](double exit, int exitAxis) {
    if (field.filter != Filter::Trilinear) {
      if (const auto s = walk.splineRoot(field, exit, exitAxis))
        found = walk.t + *s * (exit - walk.t);
      return !found;
    }
    const BernsteinCubic cubic = walk.restrictToRay(exit, exitAxis);
    if (search == Search::AnyCrossing) {
      if (hasSignChange(cubic)) found = walk.t;
    } else if (const double s = firstSignChange(cubic); s >= 0) {
      found = walk.t + s * (exit - walk.t);
    }
    return !found;
  });
  return found;
}

void addCrossings(const DrawnField& field, const SurfaceBlock& block, const IndexRay& ray,
                  double near, std::vector<SideChange>& found) {
  BlockTraversal walk{block, ray, near, std::numeric_limits<double>::infinity()};
  std::vector<double> shares;
  traverseCells(walk, std::numeric_limits<double>::infinity(), [&](double exit, int exitAxis) {
    shares.clear();
    bool inside;
    if (field.filter == Filter::Trilinear) {
      const BernsteinCubic cubic = walk.restrictToRay(exit, exitAxis);
      inside = cubic[0] < 0;
      addSignChanges(cubic, shares);
    } else {
      inside = walk.addSplineRoots(field, exit, exitAxis, shares);
    }
    for (const double share : shares) {
      found.push_back({walk.t + share * (exit - walk.t), !inside});
      inside = !inside;
    }
    return true;
  });
}

}  // namespace render
