#include "render/embree/bcc_cell_vdb.h"

#include <algorithm>
#include <cmath>

#include "levelset/splines/bcc_quadratic_spline.h"
#include "render/embree/cubic_root.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::PartitionTetrahedron;
using openvdb::Coord;
using BccSpline = levelset::BccQuadraticSpline<2>;

/// Negative weights of a Bernstein coefficient have a sum of at most 1/8.
bool isOpenRange(double low, double high) {
  const double room = (high - low) / 8;
  return low - room < 0 && high + room >= 0;
}

}  // namespace

BccCell::BccCell(const openvdb::FloatTree& tree, const Coord& cell) : cell_(cell) {
  openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> accessor(tree);
  std::size_t n = 0;
  for (int x = 0; x < kPoints; ++x)
    for (int y = 0; y < kPoints; ++y)
      for (int z = 0; z < kPoints; ++z)
        data_[n++] = static_cast<double>(accessor.getValue(cell.offsetBy(x - 2, y - 2, z - 2)));
}

/// Value at a grid point. A point beyond the window is moved to its nearest point: only tetrahedra
/// that a position beside the cell by rounding lies in read such points.
double BccCell::at(int i, int j, int k) const {
  const auto place = [](int n, int base) { return std::clamp(n - base + 2, 0, kPoints - 1); };
  return data_[static_cast<std::size_t>(
      (place(i, cell_.x()) * kPoints + place(j, cell_.y())) * kPoints + place(k, cell_.z()))];
}

std::array<double, 3> BccCell::inGrid(const V3d& p) const {
  return {cell_.x() + p.x, cell_.y() + p.y, cell_.z() + p.z};
}

bool BccCell::mayCross() const {
  const auto [low, high] = std::minmax_element(data_.begin(), data_.end());
  return isOpenRange(*low, *high);
}

double BccCell::value(const V3d& p) const {
  return levelset::splineValue(
      BccSpline{}, [this](int i, int j, int k) { return at(i, j, k); }, inGrid(p));
}

template <typename Visit>
void BccCell::overPieces(const V3d& p, const V3d& q, const Visit& visit) const {
  const auto sample = [this](int i, int j, int k) { return at(i, j, k); };
  const std::array<double, 3> a = inGrid(p), b = inGrid(q);
  PartitionTetrahedron t = BccSpline::locate(a);
  double from = 0;
  std::optional<double> before;
  for (int n = 0; n < 200 && from < 1; ++n) {
    const auto map = BccSpline::barycentric<double>(t);
    const auto wa = map.coordinates(a), wb = map.coordinates(b);
    double to = 1;
    int face = -1;
    for (int v = 0; v < 4; ++v) {
      const auto i = static_cast<std::size_t>(v);
      if (!(wb[i] < wa[i])) continue;
      const double share = std::max(wa[i] / (wa[i] - wb[i]), from);
      if (share < to) {
        to = share;
        face = v;
      }
    }
    if (to > from) {
      const auto form = BccSpline::coefficients(sample, t);
      std::array<double, 4> f;
      for (std::size_t i = 0; i < 4; ++i) {
        const double share = from + static_cast<double>(i) / 3 * (to - from);
        std::array<double, 4> w;
        for (std::size_t v = 0; v < 4; ++v) w[v] = wa[v] * (1 - share) + wb[v] * share;
        f[i] = form.value(w);
      }
      if (before) f[0] = *before;
      before = f[3];
      // The cubic through four values.
      const BernsteinCubic cubic = {f[0], (-5 * f[0] + 18 * f[1] - 9 * f[2] + 2 * f[3]) / 6,
                                    (2 * f[0] - 9 * f[1] + 18 * f[2] - 5 * f[3]) / 6, f[3]};
      if (!visit(cubic, from, to)) return;
    }
    if (face < 0) return;
    from = to;
    t = BccSpline::neighbour(t, face);
  }
}

std::optional<double> BccCell::firstSignChange(const V3d& p, const V3d& q) const {
  return firstSignChangeOn([&](const auto& visit) { overPieces(p, q, visit); });
}

void BccCell::addSignChanges(const V3d& p, const V3d& q, std::vector<double>& found) const {
  addSignChangesOn([&](const auto& visit) { overPieces(p, q, visit); }, found);
}

SurfaceShape BccCell::shape(const V3d& p) const {
  const auto found = levelset::splineDerivatives(
      BccSpline{}, [this](int i, int j, int k) { return at(i, j, k); }, inGrid(p));
  SurfaceShape shape;
  shape.gradient = V3d(found.gradient[0], found.gradient[1], found.gradient[2]);
  shape.trilinearGradient = shape.gradient;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      shape.hessian[i][j] = found.hessian[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  return shape;
}

bool bccMayCross(const openvdb::FloatTree& tree, const Coord& block) {
  openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> accessor(tree);
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (int x = -2; x <= 10; ++x)
    for (int y = -2; y <= 10; ++y)
      for (int z = -2; z <= 10; ++z) {
        const auto value = static_cast<double>(accessor.getValue(block.offsetBy(x, y, z)));
        low = std::min(low, value);
        high = std::max(high, value);
      }
  return isOpenRange(low, high);
}

SurfaceShape bccShape(const openvdb::FloatTree& tree, const V3d& position) {
  const V3d base(std::floor(position.x), std::floor(position.y), std::floor(position.z));
  return BccCell(tree, Coord(static_cast<int>(base.x), static_cast<int>(base.y),
                             static_cast<int>(base.z)))
      .shape(position - base);
}

}  // namespace render
