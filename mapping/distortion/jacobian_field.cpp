#include "mapping/distortion/jacobian_field.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "mapping/maps/prism_map.h"
#include "mapping/rbf/rbf_map.h"
#include "mapping/untangle/prism_cells.h"

namespace mapping {
namespace {

using Imath::Box3d;
using Imath::V3d;
using levelset::FieldGrid;

/// Grid in which each grid point keeps the least of the values that are added to it.
class LeastGrid {
 public:
  explicit LeastGrid(double voxelSize)
      : grid_(openvdb::FloatGrid::create(1)), accessor_(grid_->getAccessor()) {
    grid_->setTransform(levelset::uniformTransform(voxelSize));
    grid_->setName("jacobian");
  }

  void add(const openvdb::Coord& at, double value) {
    constexpr double kMost = 1e30;
    const auto number = static_cast<float>(std::clamp(value, -kMost, kMost));
    if (!accessor_.isValueOn(at) || number < accessor_.getValue(at))
      accessor_.setValueOn(at, number);
  }

  /// Calls visit(grid point, barycentric coordinates) for the grid points in a tetrahedron of
  /// either orientation.
  template <typename Visit>
  void forEachInside(const Lattice::Corners& corners, const Visit& visit) const {
    Box3d box;
    for (const V3d& corner : corners) box.extendBy(corner);
    const openvdb::Vec3d low = grid_->worldToIndex(levelset::toVdb(box.min)),
                         high = grid_->worldToIndex(levelset::toVdb(box.max));
    openvdb::Coord c;
    for (c[0] = ceiling(low[0]); c[0] <= high[0]; ++c[0])
      for (c[1] = ceiling(low[1]); c[1] <= high[1]; ++c[1])
        for (c[2] = ceiling(low[2]); c[2] <= high[2]; ++c[2]) {
          const auto shares = barycentric(corners, levelset::toImath(grid_->indexToWorld(c)));
          // Grid points on a face belong to both tetrahedra at the face, even after rounding.
          constexpr double kOnAFace = -1e-9;
          if (std::all_of(shares.begin(), shares.end(), [](double s) { return s >= kOnAFace; }))
            visit(c, shares);
        }
  }

  [[nodiscard]] openvdb::Coord nearest(const V3d& place) const {
    return openvdb::Coord::round(grid_->worldToIndex(levelset::toVdb(place)));
  }

  [[nodiscard]] const openvdb::FloatGrid::Ptr& grid() const { return grid_; }

  [[nodiscard]] FieldGrid finish(const FoldCertificate& certificate) {
    for (const FoldPoint& fold : certificate.worst) add(nearest(fold.position), fold.jacobian);
    return levelset::importField(grid_);
  }

 private:
  static int ceiling(double x) { return static_cast<int>(std::ceil(x)); }
  openvdb::FloatGrid::Ptr grid_;
  openvdb::FloatGrid::Accessor accessor_;
};

/// Checks the options and the memory estimate before the grid is built. The estimate counts the
/// grid points in the bounding boxes of all cells.
void checkField(const Patch& patch, const JacobianFieldOptions& options) {
  if (!(options.voxelSize > 0) || !std::isfinite(options.voxelSize)) {
    throw levelset::UsageError(
        fmt::format("the voxel size is {}; give a positive number", options.voxelSize));
  }
  const std::vector<V3d> positions = particlePositions(patch);
  const PrismCells cells(patch, options.embedDepth);
  double points = 0;
  for (std::size_t n = 0; n < cells.size(); ++n) {
    Box3d box;
    for (const ParticleSum& corner : cells.at(n).corners)
      box.extendBy(positionOf(corner, positions));
    const V3d sides = box.size() / options.voxelSize;
    points += (sides.x + 1) * (sides.y + 1) * (sides.z + 1);
    for (int axis = 0; axis < 3; ++axis) {
      constexpr double kMostIndex = 1e9;
      if (!(std::max(std::abs(box.min[axis]), std::abs(box.max[axis])) <
            kMostIndex * options.voxelSize)) {
        throw levelset::ResourceLimit(
            fmt::format("with a voxel size of {:.3g} the grid exceeds the range of 32-bit indices; "
                        "use larger voxels",
                        options.voxelSize));
      }
    }
  }
  constexpr double kBytesPerPoint = 160;  // including the samples of a smooth map
  levelset::requireMemory(points * kBytesPerPoint, options.maxMemory);
}

/// Corners of one of a cell's six tetrahedra, as corner indices of the cell. Bits 0, 1 and 2 of an
/// index select the upper end of u, v and w.
std::array<std::size_t, 4> tetrahedronOf(int order) {
  const auto& axes = Lattice::kOrders[static_cast<std::size_t>(order)];
  std::array<std::size_t, 4> corners = {0, 0, 0, 7};
  corners[1] = 1u << axes[0];
  corners[2] = corners[1] + (1u << axes[1]);
  return corners;
}

V3d unitCorner(std::size_t corner) {
  return {static_cast<double>(corner & 1), static_cast<double>(corner >> 1 & 1),
          static_cast<double>(corner >> 2)};
}

/// Determinant of a trilinear map at a point of the unit cube.
double trilinearDeterminant(const std::array<V3d, 8>& corners, const V3d& at) {
  std::array<V3d, 3> slopes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    slopes[axis] = V3d(0);
    for (std::size_t n = 0; n < 8; ++n) {
      const V3d end = unitCorner(n);
      double weight = end[static_cast<int>(axis)] > 0 ? 1 : -1;
      for (const std::size_t other : {(axis + 1) % 3, (axis + 2) % 3}) {
        const auto o = static_cast<int>(other);
        weight *= end[o] > 0 ? at[o] : 1 - at[o];
      }
      slopes[axis] += corners[n] * weight;
    }
  }
  return slopes[0].dot(slopes[1].cross(slopes[2]));
}

/// Calls visit(grid point, determinant of texture → patch) in all cells between the particles.
template <typename Visit>
void forEachInCells(const Patch& patch, double embedDepth, const LeastGrid& grid,
                    const Visit& visit) {
  const std::vector<V3d> positions = particlePositions(patch);
  const PrismCells cells(patch, embedDepth);
  for (std::size_t n = 0; n < cells.size(); ++n) {
    const PrismCell cell = cells.at(n);
    std::array<V3d, 8> corners;
    for (std::size_t i = 0; i < 8; ++i) corners[i] = positionOf(cell.corners[i], positions);
    const V3d sides = cell.box.size();
    for (int order = 0; order < 6; ++order) {
      const std::array<std::size_t, 4> ends = tetrahedronOf(order);
      grid.forEachInside(
          {corners[ends[0]], corners[ends[1]], corners[ends[2]], corners[ends[3]]},
          [&](const openvdb::Coord& at, const std::array<double, 4>& shares) {
            V3d local(0);
            for (std::size_t i = 0; i < 4; ++i) local += unitCorner(ends[i]) * shares[i];
            visit(at, trilinearDeterminant(corners, local) / (sides.x * sides.y * sides.z));
          });
    }
  }
}

}  // namespace

FieldGrid jacobianField(const Patch& patch, const FoldCertificate& certificate,
                        const JacobianFieldOptions& options) {
  checkField(patch, options);
  LeastGrid grid(options.voxelSize);
  const double unit = (patch.mirrored ? -1 : 1) * certificate.unit;
  forEachInCells(
      patch, options.embedDepth, grid,
      [&](const openvdb::Coord& at, double determinant) { grid.add(at, determinant / unit); });
  return grid.finish(certificate);
}

FieldGrid jacobianField(const Patch& patch, const PrismMap& map, const FoldCertificate& certificate,
                        const JacobianFieldOptions& options) {
  checkField(patch, options);
  LeastGrid grid(options.voxelSize);
  const double unit = (patch.mirrored ? -1 : 1) * certificate.unit;
  const auto volume = [](const Lattice::Corners& c) {
    return (c[1] - c[0]).dot((c[2] - c[0]).cross(c[3] - c[0]));
  };
  const Lattice& lattice = map.lattice();
  const auto cells = lattice.cells();
  for (int k = 0; k < cells[2]; ++k)
    for (int j = 0; j < cells[1]; ++j)
      for (int i = 0; i < cells[0]; ++i)
        for (int order = 0; order < 6; ++order) {
          const Tetrahedron t{{i, j, k}, order};
          const Lattice::Corners world = lattice.corners(t), texture = lattice.textureCorners(t);
          if (!map.holdsTexture((texture[0] + texture[3]) / 2.0)) continue;
          const double value = volume(world) / (volume(texture) * unit);
          grid.forEachInside(world, [&](const openvdb::Coord& at, const std::array<double, 4>&) {
            grid.add(at, value);
          });
        }
  return grid.finish(certificate);
}

FieldGrid jacobianField(const Patch& patch, const RbfMap& map, const FoldCertificate& certificate,
                        const JacobianFieldOptions& options) {
  checkField(patch, options);
  LeastGrid grid(options.voxelSize);
  forEachInCells(patch, options.embedDepth, grid,
                 [&](const openvdb::Coord& at, double) { grid.add(at, 0); });
  std::vector<openvdb::Coord> points;
  std::vector<MapSample> samples;
  for (auto it = grid.grid()->cbeginValueOn(); it; ++it) {
    points.push_back(it.getCoord());
    samples.push_back({levelset::toImath(grid.grid()->indexToWorld(it.getCoord())), V3d(0), {}});
  }
  evaluateRbf(map, patch, samples);
  LeastGrid result(options.voxelSize);
  const double hand = patch.mirrored ? -1 : 1;
  for (std::size_t n = 0; n < points.size(); ++n)
    result.add(points[n], hand * samples[n].jacobian.determinant() / certificate.unit);
  return result.finish(certificate);
}

}  // namespace mapping
