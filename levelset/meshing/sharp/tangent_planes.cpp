#include "levelset/meshing/sharp/tangent_planes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/grids/padded_leaf_vdb.h"

namespace levelset {
namespace {

using Eigen::Vector3d;
using openvdb::Coord;
using openvdb::FloatGrid;

/// Largest deviation, voxels, from a plane of unit slope of the values in one cell at a grid point,
/// if they are to define the tangent plane there.
constexpr double kPlanar = 0.1;
/// Field values that differ from a plane of unit slope by less, voxels, are those of a flat face.
constexpr double kFlatCell = 1e-4;

}  // namespace

TangentPlanes::TangentPlanes(const FloatGrid& grid, const Coord& origin, int margin)
    : margin_(margin) {
  const auto cubed = [](int side) { return static_cast<std::size_t>(side * side * side); };
  std::vector<float> values(cubed(kSide + 2 + 2 * margin));
  copyPaddedLeaf(grid.getConstAccessor(), origin, 1 + margin, 2 + margin, values.data());
  const double inverse = 1 / grid.voxelSize()[0];
  values_.reserve(values.size());
  for (const float value : values) values_.push_back(static_cast<double>(value) * inverse);
  planes_.resize(cubed(kSide + 2 * margin));
  made_.resize(planes_.size());
}

double TangentPlanes::interpolated(const Vector3d& p) const {
  std::array<int, 3> low;
  Vector3d t;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    low[i] = std::clamp(static_cast<int>(std::floor(p[axis])), -1, kSide - 1);
    t[axis] = p[axis] - low[i];
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner >> 2, dy = (corner >> 1) & 1, dz = corner & 1;
    sum += (dx ? t[0] : 1 - t[0]) * (dy ? t[1] : 1 - t[1]) * (dz ? t[2] : 1 - t[2]) *
           value(low[0] + dx, low[1] + dy, low[2] + dz);
  }
  return sum;
}

double TangentPlanes::curved(const Vector3d& p) const {
  std::array<int, 3> low;
  Vector3d t;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    low[i] = std::clamp(static_cast<int>(std::floor(p[axis])), 0, kSide - 2);
    t[axis] = p[axis] - low[i];
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner >> 2, dy = (corner >> 1) & 1, dz = corner & 1;
    const int x = low[0] + dx, y = low[1] + dy, z = low[2] + dz;
    const double here = value(x, y, z);
    const Vector3d bend(value(x - 1, y, z) + value(x + 1, y, z) - 2 * here,
                        value(x, y - 1, z) + value(x, y + 1, z) - 2 * here,
                        value(x, y, z - 1) + value(x, y, z + 1) - 2 * here);
    const double weight = (dx ? t[0] : 1 - t[0]) * (dy ? t[1] : 1 - t[1]) * (dz ? t[2] : 1 - t[2]);
    sum += weight * (here - bend.dot((t.array() * (1 - t.array())).matrix()) / 2);
  }
  return sum;
}

const TangentPlane& TangentPlanes::plane(int x, int y, int z) {
  const int side = kSide + 2 * margin_;
  const auto i =
      static_cast<std::size_t>(((x + margin_) * side + y + margin_) * side + z + margin_);
  if (!made_[i]) {
    planes_[i] = makePlane(x, y, z);
    made_[i] = true;
  }
  return planes_[i];
}

TangentPlane TangentPlanes::makePlane(int x, int y, int z) const {
  TangentPlane plane;
  plane.distance = value(x, y, z);
  const Vector3d back(value(x - 1, y, z), value(x, y - 1, z), value(x, y, z - 1));
  const Vector3d forward(value(x + 1, y, z), value(x, y + 1, z), value(x, y, z + 1));
  const Vector3d bend = back + forward - Vector3d::Constant(2 * plane.distance);
  plane.error = bend.cwiseAbs().maxCoeff();
  plane.bend = std::max(plane.error, std::abs(bend.sum()));
  plane.isSmooth = plane.error < kSmoothBend;
  plane.gradient = (forward - back) / 2;
  if (plane.isSmooth) {
    plane.normal = plane.gradient;
    plane.isKnown = plane.normal.norm() > 0.5;
  }
  if (!plane.isSmooth) {
    chooseOctant(x, y, z, kPlanar, plane);
  } else if (plane.error > kSurelySmooth) {
    chooseOctant(x, y, z, kFlatCell, plane);
  }
  if (plane.isKnown) plane.normal.normalize();
  return plane;
}

/// Estimates the plane from one of the eight cells at the grid point. Beside an edge of the
/// solid, central differences mix two faces. The cell whose values lie nearest to a plane of unit
/// slope belongs to one face. If no cell is within `limit`, the plane does not change.
/// @param limit  largest deviation of a cell's values from a plane of unit slope, voxels
void TangentPlanes::chooseOctant(int x, int y, int z, double limit, TangentPlane& plane) const {
  double best = limit;
  for (int octant = 0; octant < 8; ++octant) {
    const int sx = octant & 4 ? 1 : -1, sy = octant & 2 ? 1 : -1, sz = octant & 1 ? 1 : -1;
    const double base = plane.distance;
    const double dx = value(x + sx, y, z) - base, dy = value(x, y + sy, z) - base,
                 dz = value(x, y, z + sz) - base;
    const double error = std::abs(std::sqrt(dx * dx + dy * dy + dz * dz) - 1) +
                         std::abs(value(x + sx, y + sy, z) - base - dx - dy) +
                         std::abs(value(x + sx, y, z + sz) - base - dx - dz) +
                         std::abs(value(x, y + sy, z + sz) - base - dy - dz) +
                         std::abs(value(x + sx, y + sy, z + sz) - base - dx - dy - dz);
    if (!(error < best)) continue;
    best = plane.error = error;
    plane.normal = Vector3d(sx * dx, sy * dy, sz * dz);
    plane.isKnown = true;
    plane.isSmooth = false;
  }
  // Reduce `bend` only if the cell's values are flat up to rounding. At the pole of a small ball
  // they are nearly as flat as on a face, but the field around is bent.
  if (best < kFlatCell) plane.bend = best;
}

}  // namespace levelset
