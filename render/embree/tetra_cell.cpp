#include <algorithm>
#include <cmath>

#include "levelset/splines/cubic_c1_spline.h"
#include "levelset/splines/quadratic_super_spline.h"
#include "render/embree/cubic_root.h"
#include "render/embree/tetra_cell_vdb.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::PartitionTetrahedron;
using openvdb::Coord;

/// Calls work(spline) with the spline of a filter.
template <typename Work>
auto withTetraSpline(Filter filter, const Work& work) {
  if (filter == Filter::CubicC1) return work(levelset::CubicC1Spline());
  return work(levelset::QuadraticSuperSpline());
}

std::array<double, 3> fromMiddle(const V3d& p) {
  return {p.x - 0.5, p.y - 0.5, p.z - 0.5};
}

/// Tetrahedron of the cube around the origin; the sides of a position beyond the cube by rounding
/// count.
PartitionTetrahedron tetrahedronAt(const V3d& p) {
  std::array<double, 3> at = fromMiddle(p);
  for (double& a : at) a = std::clamp(a, -0.4999999, 0.4999999);
  return levelset::Type6Partition::locate(at);
}

}  // namespace

TetraCell::TetraCell(const openvdb::FloatTree& tree, const Coord& datum, Filter filter)
    : filter_(filter) {
  openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> accessor(tree);
  std::size_t n = 0;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        data_[n++] = static_cast<double>(accessor.getValue(datum.offsetBy(x, y, z)));
}

bool TetraCell::mayCross() const {
  const auto [low, high] = std::minmax_element(data_.begin(), data_.end());
  // Negative weights of the quadratic super spline have a sum of at most 1/16.
  const double room = filter_ == Filter::SuperQuadratic ? (*high - *low) / 16 : 0;
  if (*low - room >= 0 || *high + room < 0) return false;
  const auto sample = [this](int i, int j, int k) {
    return data_[static_cast<std::size_t>(9 * (i + 1) + 3 * (j + 1) + k + 1)];
  };
  return withTetraSpline(filter_, [&](const auto& spline) {
    bool anyInside = false, anyOutside = false;
    for (int t = 0; t < levelset::Type6Partition::kTetrahedra && !(anyInside && anyOutside); ++t)
      for (const double b : spline.coefficients(sample, {{}, t}).coefficients)
        (b < 0 ? anyInside : anyOutside) = true;
    return anyInside && anyOutside;
  });
}

double TetraCell::value(const V3d& p) const {
  const auto sample = [this](int i, int j, int k) {
    return data_[static_cast<std::size_t>(9 * (i + 1) + 3 * (j + 1) + k + 1)];
  };
  return withTetraSpline(filter_, [&](const auto& spline) {
    const PartitionTetrahedron t = tetrahedronAt(p);
    return spline.coefficients(sample, t).value(
        spline.template barycentric<double>(t).coordinates(fromMiddle(p)));
  });
}

template <typename Visit>
void TetraCell::overPieces(const V3d& p, const V3d& q, const Visit& visit) const {
  const auto sample = [this](int i, int j, int k) {
    return data_[static_cast<std::size_t>(9 * (i + 1) + 3 * (j + 1) + k + 1)];
  };
  // Fractions at which the segment meets the planes |x| = |y|, |y| = |z| and |z| = |x|.
  std::vector<double> ends{0, 1};
  const V3d a = p - V3d(0.5), d = q - p;
  for (int axis = 0; axis < 3; ++axis)
    for (const int sign : {-1, 1}) {
      const int other = (axis + 1) % 3;
      const double share = -(a[axis] + sign * a[other]) / (d[axis] + sign * d[other]);
      if (share > 0 && share < 1) ends.push_back(share);
    }
  std::sort(ends.begin(), ends.end());
  withTetraSpline(filter_, [&](const auto& spline) {
    std::optional<double> before;
    for (std::size_t n = 0; n + 1 < ends.size(); ++n) {
      const double from = ends[n], to = ends[n + 1];
      if (!(to > from)) continue;
      const PartitionTetrahedron t = tetrahedronAt(p + d * (0.5 * (from + to)));
      const auto form = spline.coefficients(sample, t);
      const auto map = spline.template barycentric<double>(t);
      std::array<double, 4> f;
      for (std::size_t i = 0; i < 4; ++i) {
        const double share = i == 3 ? to : from + static_cast<double>(i) / 3 * (to - from);
        f[i] = form.value(map.coordinates(fromMiddle(p + d * share)));
      }
      if (before) f[0] = *before;
      before = f[3];
      // The cubic through four values.
      const BernsteinCubic cubic = {f[0], (-5 * f[0] + 18 * f[1] - 9 * f[2] + 2 * f[3]) / 6,
                                    (2 * f[0] - 9 * f[1] + 18 * f[2] - 5 * f[3]) / 6, f[3]};
      if (!visit(cubic, from, to)) return 0;
    }
    return 0;
  });
}

std::optional<double> TetraCell::firstSignChange(const V3d& p, const V3d& q) const {
  return firstSignChangeOn([&](const auto& visit) { overPieces(p, q, visit); });
}

void TetraCell::addSignChanges(const V3d& p, const V3d& q, std::vector<double>& found) const {
  addSignChangesOn([&](const auto& visit) { overPieces(p, q, visit); }, found);
}

SurfaceShape TetraCell::shape(const V3d& p) const {
  const auto sample = [this](int i, int j, int k) {
    return data_[static_cast<std::size_t>(9 * (i + 1) + 3 * (j + 1) + k + 1)];
  };
  return withTetraSpline(filter_, [&](const auto& spline) {
    const PartitionTetrahedron t = tetrahedronAt(p);
    const auto form = spline.coefficients(sample, t);
    const auto map = spline.template barycentric<double>(t);
    const auto weights = map.coordinates(fromMiddle(p));
    const auto gradient = levelset::gradientAt(form, map, weights);
    const auto hessian = levelset::hessianAt(form, map, weights);
    SurfaceShape shape;
    shape.gradient = V3d(gradient[0], gradient[1], gradient[2]);
    shape.trilinearGradient = shape.gradient;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        shape.hessian[i][j] = hessian[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    return shape;
  });
}

SurfaceShape tetraShape(const openvdb::FloatTree& tree, const V3d& position, Filter filter) {
  const V3d base(std::floor(position.x), std::floor(position.y), std::floor(position.z));
  return TetraCell(
             tree,
             Coord(static_cast<int>(base.x), static_cast<int>(base.y), static_cast<int>(base.z)),
             filter)
      .shape(position - base);
}

}  // namespace render
