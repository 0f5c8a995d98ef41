#include "render/kernel/hit_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace render {
namespace {

using Imath::V3d;
using Imath::V3i;

// NOLINTBEGIN(bugprone-macro-parentheses): names of parameters
#define VAR Real
#define IN(Type) const Type&
#define INOUT(Type) Type&
#define IN_ARRAY(Type, name, size) const Type(&name)[size]
#define INOUT_ARRAY(Type, name, size) Type(&name)[size]
#define CONST_INT static constexpr int
#define CONST_FLOAT static constexpr double
#define NUMBER(x) (x)
#define AND(a, b) ((a) && (b))
#define OR(a, b) ((a) || (b))
#define NOT(a) (!(a))
// NOLINTEND(bugprone-macro-parentheses)

/// The kernel's functions for one ray in double precision, with the tables of a pool.
struct ExactKernel {
  using Real = double;
  using Int = int;
  using Bool = bool;

  static constexpr int kBrickEdge = BrickPool::kEdge, kBrickValues = BrickPool::kValues;
  static constexpr int kCubeEdge = BrickPool::kCubeEdge, kCubeValues = BrickPool::kCubeValues;
  static constexpr int kSites = BrickPool::kSites;
  static constexpr int kPageShift = 6;
  static_assert(1 << kPageShift == BrickPool::kPage);
  static constexpr int kFirstOfEntry = BrickPool::kFirstOfEntry,
                       kStridesOfEntry = BrickPool::kStridesOfEntry,
                       kStrideShift = BrickPool::kStrideShift;

  const BrickPool& pool;
  const bool isTricubic;
  const int tetraDegree;
  const int pagesY, pagesZ;

  explicit ExactKernel(const BrickPool& pool_)
      : pool(pool_),
        isTricubic(pool_.filter == Filter::Tricubic),
        tetraDegree(tetrahedralDegree(pool_.filter)),
        pagesY(pool_.pages[1]),
        pagesZ(pool_.pages[2]) {}

  static Real quotient(Real a, Real b) { return a / b; }
  static Real real(float v) { return static_cast<Real>(v); }
  static Int integer(int v) { return v; }
  static Bool no() { return false; }
  static Real toReal(Int v) { return v; }
  static Int toInt(Real v) { return static_cast<int>(v); }
  template <typename T>
  static T select(Bool c, T a, T b) {
    return c ? a : b;
  }
  static Real smaller(Real a, Real b) { return b < a ? b : a; }
  static Int smaller(Int a, Int b) { return b < a ? b : a; }
  static Real larger(Real a, Real b) { return a < b ? b : a; }
  static Int larger(Int a, Int b) { return a < b ? b : a; }
  static Int bit(Bool c, int n) { return c ? n : 0; }
  static Bool differ(Bool a, Bool b) { return a != b; }
  static Bool any(Bool c) { return c; }
  [[nodiscard]] Real loadValue(Int i) const { return pool.valueAt(static_cast<std::size_t>(i)); }
  void loadThree(Int first, Real& a, Real& b, Real& c) const {
    a = loadValue(first);
    b = loadValue(first + 1);
    c = loadValue(first + 2);
  }
  void loadFour(Int first, Real& a, Real& b, Real& c, Real& d) const {
    loadThree(first, a, b, c);
    d = loadValue(first + 3);
  }
  [[nodiscard]] Int loadPage(Int i) const { return pool.page[static_cast<std::size_t>(i)]; }
  [[nodiscard]] Int loadEntry(Int i) const { return pool.entry[static_cast<std::size_t>(i)]; }
  [[nodiscard]] Int loadMask(Int i) const {
    return static_cast<Int>(pool.mask[static_cast<std::size_t>(i)]);
  }

#include "render/shaders/roots.glsl"
//
#include "render/shaders/bricks.glsl"
//
#include "render/shaders/window.glsl"
//
#include "render/shaders/spline.glsl"
//
#include "render/shaders/tetra.glsl"
//
#include "render/shaders/bcc.glsl"

  /// Value of the grid point (x, y, z) of table space.
  [[nodiscard]] Real pointAt(Int x, Int y, Int z) {
    Int strides = 0;
    const Int first = blockOf(true, x, y, z, strides);
    return loadValue(first + (x & 7) * (strides >> kStrideShift) +
                     (y & 7) * (strides & ((1 << kStrideShift) - 1)) + (z & 7));
  }
};

#undef VAR
#undef IN
#undef INOUT
#undef IN_ARRAY
#undef INOUT_ARRAY
#undef CONST_INT
#undef CONST_FLOAT
#undef NUMBER
#undef AND
#undef OR
#undef NOT

/// The field of a pool near a cell, in double precision.
class FieldNearCell {
 public:
  FieldNearCell(const BrickPool& pool, const V3i& cell) : kernel_(pool), cell_(cell) {
    brick_ = kernel_.spotAt(true, cell.x, cell.y, cell.z).brick;
    if (kernel_.tetraDegree > 0) {
      cube_ = kernel_.cubeData(true, brick_, cell.x, cell.y, cell.z);
      return;
    }
    if (!isTricubicInCells(pool.filter)) return;
    std::size_t n = 0;
    for (int x = -1; x <= 2; ++x)
      for (int y = -1; y <= 2; ++y)
        for (int z = -1; z <= 2; ++z)
          net_[n++] = kernel_.pointAt(cell.x + x, cell.y + y, cell.z + z);
  }

  /// Value at a position of table space at most one cell away. Beyond the cell, splines are those
  /// of the cell, and trilinear interpolation is that of the neighbour.
  [[nodiscard]] double valueAt(const V3d& place) {
    if (kernel_.tetraDegree > 0) return ofTetrahedra(place - V3d(cell_) - V3d(0.5));
    if (isTricubicInCells(kernel_.pool.filter)) return ofSpline(place - V3d(cell_));
    if (kernel_.pool.filter == Filter::BccQuadratic)
      return ofOctahedra(place - V3d(cell_) - V3d(0.5));
    V3i cell;
    for (int a = 0; a < 3; ++a)
      cell[a] = std::clamp(static_cast<int>(std::floor(place[a])), cell_[a] - 1, cell_[a] + 1);
    const V3d p = place - V3d(cell);
    double sum = 0;
    for (int n = 0; n < 8; ++n) {
      const int i = n >> 2, j = n >> 1 & 1, k = n & 1;
      sum += (i ? p.x : 1 - p.x) * (j ? p.y : 1 - p.y) * (k ? p.z : 1 - p.z) *
             kernel_.pointAt(cell.x + i, cell.y + j, cell.z + k);
    }
    return sum;
  }

 private:
  [[nodiscard]] double ofTetrahedra(const V3d& p) {
    const ExactKernel::Turn turn = kernel_.turnAt(p.x, p.y, p.z);
    const ExactKernel::Weights w = kernel_.weightsAt(p.x, p.y, p.z, turn);
    const ExactKernel::Cube c = kernel_.turned(cube_, turn);
    const ExactKernel::QuadraticForm q = kernel_.tetraDegree == 2
                                             ? kernel_.quadraticForm(c)
                                             : kernel_.fixedAt(kernel_.cubicForm(c), w);
    return kernel_.weighted(w, kernel_.fixedAt(q, w));
  }
  [[nodiscard]] double ofOctahedra(const V3d& p) {
    const ExactKernel::BccTet t = kernel_.bccTetAt(cell_.x, cell_.y, cell_.z, p.x, p.y, p.z);
    const ExactKernel::Weights w = kernel_.bccWeights(t.kind, kernel_.fromSite(t, p.x, p.y, p.z));
    const ExactKernel::QuadraticForm q =
        kernel_.bccForm(true, brick_, cell_.x, cell_.y, cell_.z, t);
    return kernel_.weighted(w, kernel_.fixedAt(q, w));
  }
  [[nodiscard]] double ofSpline(const V3d& p) {
    const ExactKernel::Blend x = kernel_.blendOf(p.x, p.x, p.x), y = kernel_.blendOf(p.y, p.y, p.y),
                             z = kernel_.blendOf(p.z, p.z, p.z);
    std::array<double, 4> planes;
    for (std::size_t i = 0; i < 4; ++i) {
      std::array<double, 4> rows;
      for (std::size_t j = 0; j < 4; ++j) {
        const double* f = net_.data() + 16 * i + 4 * j;
        rows[j] = kernel_.blended(z, f[0], f[1], f[2], f[3]);
      }
      planes[i] = kernel_.blended(y, rows[0], rows[1], rows[2], rows[3]);
    }
    return kernel_.blended(x, planes[0], planes[1], planes[2], planes[3]);
  }

  ExactKernel kernel_;
  V3i cell_;
  int brick_;
  ExactKernel::Cube cube_{};
  std::array<double, 64> net_{};
};

/// Parameter at which a ray crosses the surface near a hit.
/// @param origin, direction  the exact ray, table space
/// @param place, gradient  position and gradient of the drawn surface that the kernel found
/// @param found  parameter that the kernel found
double crossingNear(const KernelSolid& solid, const V3i& cell, const V3d& origin,
                    const V3d& direction, const V3d& place, const V3d& gradient, double found) {
  constexpr double kMostMove = 0.05;  // voxels; larger moves lead to another surface
  constexpr double kGrazing = 0.1;    // sine of the angle between the ray and the surface
  constexpr int kMostSecants = 8;
  constexpr double kConverged = 1e-9;
  const double slope = gradient.dot(direction);
  double t = gradient.dot(place - origin) / slope;
  const auto isNear = [&] { return std::abs(t - found) < kMostMove; };
  const double steep = kGrazing * kGrazing * gradient.length2() * direction.length2();
  if (slope * slope >= steep) return isNear() ? t : found;
  FieldNearCell field(solid.pool, cell);
  const double planeT = isNear() ? t : found;
  double before = planeT, valueBefore = field.valueAt(origin + direction * before);
  t = before - valueBefore / slope;
  for (int i = 0; i < kMostSecants && isNear(); ++i) {
    const double value = field.valueAt(origin + direction * t);
    const double step = value * (t - before) / (value - valueBefore);
    if (!(std::abs(t - before) > kConverged) || value == 0) return t;
    before = t;
    valueBefore = value;
    t -= step;
  }
  return planeT;
}

}  // namespace

double refineHit(const KernelSolid& solid, const std::pair<V3d, V3d>& ray, std::size_t n,
                 const HitBlock& hits, ShapeBlock& shapes) {
  shapes.flush(n);
  const V3i cell(hits.x[n], hits.y[n], hits.z[n]);
  const V3d place = V3d(cell) + shapes.placeInCell(n);
  const auto& [origin, direction] = ray;
  const double t = crossingNear(solid, cell, origin, direction, place, shapes.drawnGradient(n),
                                static_cast<double>(hits.t[n]));
  shapes.move(n, origin + direction * t - place, solid.pool.filter != Filter::Trilinear);
  return t;
}

}  // namespace render
