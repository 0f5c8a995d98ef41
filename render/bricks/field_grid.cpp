#include "render/bricks/field_grid.h"

#include <Imath/ImathBoxAlgo.h>
#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "levelset/grids/padded_leaf_vdb.h"
#include "levelset/vdb.h"

namespace render {
namespace {

using Imath::M44d;
using Imath::V3d;
using openvdb::Coord;

// Largest extent of a band along an axis, voxels. At this extent the table of blocks has 2^24
// pages.
constexpr double kWidestField = 1 << 14;
constexpr int kPageCells = 64;

/// Origins of the blocks with cells in which the field may vary. A cell belongs to the block of its
/// lowest corner, so values of a leaf also affect the seven blocks before it along the axes.
std::vector<Coord> blockOrigins(const openvdb::FloatTree& tree) {
  std::vector<Coord> origins;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
    for (int n = 0; n < 8; ++n)
      origins.push_back(leaf->origin() - Coord(8 * (n >> 2), 8 * (n >> 1 & 1), 8 * (n & 1)));
  std::sort(origins.begin(), origins.end());
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  return origins;
}

/// Copies the values of the 9³ points of a block, which lie in up to eight leaves, to `to`.
void readBlock(const openvdb::FloatTree& tree, const Coord& origin, float* to) {
  static_assert(FieldGrid::kPoints == 8 + 1);
  openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> accessor(tree);
  levelset::copyPaddedLeaf(accessor, origin, 0, 1, to);
}

/// Weights along one axis of the six points around a cell, starting two points before its lowest
/// corner. They evaluate a spline at the fraction a in [0, 1] of the cell. `own` gives the uniform
/// cubic B-spline with the function values as coefficients, `bent` the one with their second
/// differences as coefficients. Row d holds the weights of the derivative of order d.
struct SplineTaps {
  double own[3][6] = {}, bent[3][6] = {};

  explicit SplineTaps(double a) {
    const double b = 1 - a, sixth = 1.0 / 6;
    const double weights[3][4] = {{sixth * b * b * b, 2.0 / 3 - a * a * (1 - 0.5 * a),
                                   2.0 / 3 - b * b * (1 - 0.5 * b), sixth * a * a * a},
                                  {-0.5 * b * b, a * (1.5 * a - 2), b * (2 - 1.5 * b), 0.5 * a * a},
                                  {b, 3 * a - 2, 3 * b - 2, a}};
    for (int d = 0; d < 3; ++d)
      for (int i = 0; i < 4; ++i) {
        own[d][i + 1] = weights[d][i];
        bent[d][i] += weights[d][i];
        bent[d][i + 1] -= 2 * weights[d][i];
        bent[d][i + 2] += weights[d][i];
      }
  }
};

double applied(const double (&taps)[6], const double* to, int stride) {
  double sum = 0;
  for (int i = 0; i < 6; ++i) sum += taps[i] * to[i * stride];
  return sum;
}

using FieldWindow = FieldGrid::FieldWindow;

/// Computes the derivatives sum[p][q][r] of order p, q, r along x, y, z of the spline Σ (f − ∇²f/6)
/// B, one axis at a time. `own` holds the spline over the axes processed so far. `bent` holds the
/// sum, over these axes, of the spline with second differences along one of them.
void splineDerivatives(const FieldWindow& f, const V3d& a, double (&sum)[3][3][3]) {
  const SplineTaps tx(a.x), ty(a.y), tz(a.z);
  double own[6][6][3], bent[6][6][3];  // indexed by x, y and order along z
  for (int x = 0; x < 6; ++x)
    for (int y = 0; y < 6; ++y)
      for (int r = 0; r < 3; ++r) {
        own[x][y][r] = applied(tz.own[r], f[x][y], 1);
        bent[x][y][r] = applied(tz.bent[r], f[x][y], 1);
      }
  for (int q = 0; q < 3; ++q)
    for (int r = 0; q + r < 3; ++r) {
      double ownX[6], bentX[6];
      for (int x = 0; x < 6; ++x) {
        ownX[x] = applied(ty.own[q], &own[x][0][r], 3);
        bentX[x] = applied(ty.bent[q], &own[x][0][r], 3) + applied(ty.own[q], &bent[x][0][r], 3);
      }
      for (int p = 0; p + q + r < 3; ++p)
        sum[p][q][r] = applied(tx.own[p], ownX, 1) -
                       (applied(tx.bent[p], ownX, 1) + applied(tx.own[p], bentX, 1)) / 6;
    }
}

/// Bound on the difference, in the middle cell of the window, between the trilinear interpolant and
/// a smooth function with the same grid values. It follows from the second differences at the
/// cell's corners.
double interpolationErrorOf(const FieldWindow& f) {
  double error = 0;
  for (int x = 2; x < 4; ++x)
    for (int y = 2; y < 4; ++y)
      for (int z = 2; z < 4; ++z) {
        const double twice = 2 * f[x][y][z];
        error = std::max(error, std::abs(f[x + 1][y][z] + f[x - 1][y][z] - twice) +
                                    std::abs(f[x][y + 1][z] + f[x][y - 1][z] - twice) +
                                    std::abs(f[x][y][z + 1] + f[x][y][z - 1] - twice));
      }
  return error / 8;
}

/// Value and gradient, per voxel, of the trilinear interpolant in the middle cell of the window.
/// @param a  position in the cell, each coordinate in [0, 1]
double interpolate(const FieldWindow& f, const V3d& a, V3d& gradient) {
  const auto mix = [](double u, double v, double share) { return u + (v - u) * share; };
  double face[2], alongZ[2], alongY[2];
  for (int i = 0; i < 2; ++i) {
    const auto& g = f[2 + i];
    const double low = mix(g[2][2], g[2][3], a.z), high = mix(g[3][2], g[3][3], a.z);
    face[i] = mix(low, high, a.y);
    alongY[i] = high - low;
    alongZ[i] = mix(g[2][3] - g[2][2], g[3][3] - g[3][2], a.y);
  }
  gradient = {face[1] - face[0], mix(alongY[0], alongY[1], a.x), mix(alongZ[0], alongZ[1], a.x)};
  return mix(face[0], face[1], a.x);
}

}  // namespace

double FieldGrid::bytesOf(const levelset::NarrowBand& band) {
  if (band.isEmpty()) return 0;
  return static_cast<double>(blockOrigins(levelset::vdb(band).tree()).size()) *
         (4 * kValues + sizeof(Range) + sizeof(Coord));
}

FieldGrid::FieldGrid(const levelset::NarrowBand& band) {
  const openvdb::FloatTree& tree = levelset::vdb(band).tree();
  background_ = static_cast<double>(tree.background());
  const std::vector<Coord> origins = blockOrigins(tree);
  openvdb::CoordBBox box;
  for (const Coord& origin : origins) box.expand(origin);
  for (int a = 0; a < 3; ++a) {
    const double span = static_cast<double>(box.max()[a]) - box.min()[a];
    if (span > kWidestField)
      throw levelset::ResourceLimit(
          fmt::format("a band spans {:.0f} voxels along an axis, but at most {:.0f} are "
                      "supported; use larger voxels",
                      span, kWidestField));
    const auto i = static_cast<std::size_t>(a);
    size_[i] = static_cast<int>(span) / kEdge + 1;
    pages_[i] = (size_[i] + 7) / 8;
  }
  corner_ = V3d(box.min()[0], box.min()[1], box.min()[2]);
  updateTransform(band);

  std::vector<Range> found(origins.size());
  tbb::parallel_for(std::size_t{0}, origins.size(), [&](std::size_t n) {
    std::array<float, kValues> values;
    readBlock(tree, origins[n], values.data());
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    found[n] = {static_cast<double>(*low), static_cast<double>(*high)};
  });
  std::vector<std::size_t> varied;
  openvdb::tree::ValueAccessor<const openvdb::FloatTree> accessor(tree);
  const auto constantAt = [&](int x, int y, int z) {
    return accessor.getValue(box.min().offsetBy(x, y, z)) < 0 ? kInside : kOutside;
  };
  for (int x = 0; x < pages_[0]; ++x)
    for (int y = 0; y < pages_[1]; ++y)
      for (int z = 0; z < pages_[2]; ++z)
        page_.push_back(constantAt(kPageCells * x, kPageCells * y, kPageCells * z));
  for (std::size_t n = 0; n < origins.size(); ++n) {
    const Coord at = origins[n] - box.min();
    const int x = at[0] >> 3, y = at[1] >> 3, z = at[2] >> 3;
    std::int32_t& entries =
        page_[static_cast<std::size_t>(((x >> 3) * pages_[1] + (y >> 3)) * pages_[2] + (z >> 3))];
    if (entries < 0) {
      entries = static_cast<std::int32_t>(entry_.size());
      for (int i = 0; i < 512; ++i)
        entry_.push_back(constantAt(((x & ~7) + (i >> 6)) * kEdge,
                                    ((y & ~7) + (i >> 3 & 7)) * kEdge,
                                    ((z & ~7) + (i & 7)) * kEdge));
    }
    std::int32_t& entry =
        entry_[static_cast<std::size_t>(entries + ((x & 7) << 6 | (y & 7) << 3 | (z & 7)))];
    if (found[n].low == found[n].high && std::abs(found[n].low) == background_) {
      entry = found[n].low < 0 ? kInside : kOutside;
      continue;
    }
    entry = static_cast<std::int32_t>(ranges_.size());
    ranges_.push_back(found[n]);
    varied.push_back(n);
  }
  values_.resize(varied.size() * kValues);
  tbb::parallel_for(std::size_t{0}, varied.size(), [&](std::size_t n) {
    readBlock(tree, origins[varied[n]], values_.data() + n * kValues);
  });
}

bool FieldGrid::updateTransform(const levelset::NarrowBand& band) {
  const M44d before = indexToWorld_;
  indexToWorld_ = M44d().setTranslation(corner_) * band.indexToWorld();
  worldToIndex_ = indexToWorld_.inverse();
  return indexToWorld_ != before;
}

std::size_t FieldGrid::bytes() const {
  return (page_.size() + entry_.size()) * 4 + ranges_.size() * sizeof(Range) + values_.size() * 4;
}

Imath::Box3d FieldGrid::worldBox() const {
  return Imath::transform(Imath::Box3d(V3d(0), V3d(size_[0], size_[1], size_[2]) * kEdge),
                          indexToWorld_);
}

void FieldGrid::read(const std::array<int, 3>& low, FieldWindow& window) const {
  constexpr int kWindow = 6;
  // Read block by block: the window of six points overlaps at most two blocks along an axis.
  for (int n = 0; n < 8; ++n) {
    int at[3], from[3], end[3];
    bool isEmpty = false, isBeyond = false;
    for (std::size_t a = 0; a < 3; ++a) {
      at[a] = (low[a] >> 3) + (n >> a & 1);
      from[a] = std::max(low[a], at[a] * kEdge);
      end[a] = std::min(low[a] + kWindow, at[a] * kEdge + kEdge);
      isEmpty = isEmpty || from[a] >= end[a];
      isBeyond = isBeyond || at[a] < 0 || at[a] >= size_[a];
    }
    if (isEmpty) continue;
    const int number = isBeyond ? kOutside : block(at[0], at[1], at[2]);
    for (int x = from[0]; x < end[0]; ++x)
      for (int y = from[1]; y < end[1]; ++y)
        for (int z = from[2]; z < end[2]; ++z)
          window[x - low[0]][y - low[1]][z - low[2]] =
              number < 0 ? constant(number)
                         : static_cast<double>(
                               values(number)[((x & 7) * kPoints + (y & 7)) * kPoints + (z & 7)]);
  }
}

FieldShape FieldGrid::shapeAt(const V3d& world) const {
  V3d place;
  worldToIndex_.multVecMatrix(world, place);
  const V3d base(std::floor(place.x), std::floor(place.y), std::floor(place.z));
  const V3d a = place - base;
  FieldWindow f;
  read({static_cast<int>(base.x) - 2, static_cast<int>(base.y) - 2, static_cast<int>(base.z) - 2},
       f);
  double sum[3][3][3];
  splineDerivatives(f, a, sum);
  SurfaceShape shape;
  shape.gradient = {sum[1][0][0], sum[0][1][0], sum[0][0][1]};
  shape.hessian = Imath::M33d(sum[2][0][0], sum[1][1][0], sum[1][0][1],  //
                              sum[1][1][0], sum[0][2][0], sum[0][1][1],  //
                              sum[1][0][1], sum[0][1][1], sum[0][0][2]);
  shape.interpolationError = interpolationErrorOf(f);
  const double value = interpolate(f, a, shape.trilinearGradient);
  return fieldShape(value, shape, indexToWorld_);
}

}  // namespace render
