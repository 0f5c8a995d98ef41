#include "levelset/meshing/sharp/sharp_vertices.h"

#include <algorithm>
#include <cmath>

#include "levelset/meshing/sharp/tangent_planes.h"

namespace levelset {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using openvdb::Coord;
using openvdb::FloatGrid;
using Plane = TangentPlane;

/// A plane is dropped when another plane of its sheet has an error smaller by this factor.
constexpr double kWorse = 4;
/// Eigenvalues of the matrix Σ n nᵀ over the planes' normals below this share of the largest are
/// noise.
constexpr double kRank = 0.05;
/// Largest distance from the cell, voxels, of the foot of a plane: the point of the plane nearest
/// to its grid point, where it touches the surface.
constexpr double kTouchMargin = 0.75;
/// Largest magnitude of the field at the foot of a plane, voxels. Beside an edge, a plane may
/// extend beyond its face.
constexpr double kOffSurface = 0.3;
/// A point this far outside a cell, voxels, counts as on its border: faces may run through grid
/// points.
constexpr double kOnBorder = 1e-4;
/// Largest distance of a vertex from its cell, voxels.
constexpr double kVertexReach = 1;
/// Largest distance of a vertex from a plane, voxels, up to which the plane counts as one of its
/// sheets.
constexpr double kOffSheet = 0.05;

/// Largest number of Newton steps that move a vertex along its normal to the zero of the field.
constexpr int kSettleSteps = 4;
/// kSettleReach: largest distance from its cell, voxels, to which these steps may move a vertex,
/// since the error of the linear zero crossings is not larger. kLeastFieldSlope: least slope of the
/// field along the normal for which the steps are made.
constexpr double kSettleReach = 0.15;
constexpr double kLeastFieldSlope = 0.5;

openvdb::Vec3f toSheet(const Vector3d& normal) {
  return {static_cast<float>(normal.x()), static_cast<float>(normal.y()),
          static_cast<float>(normal.z())};
}

/// Removes each plane for which another plane of the same sheet has a much smaller error.
void dropWorse(std::vector<FacePlane>& planes) {
  const std::vector<FacePlane> all = planes;
  std::erase_if(planes, [&](const FacePlane& plane) {
    return plane.error > kSurelySmooth &&
           std::any_of(all.begin(), all.end(), [&](const FacePlane& other) {
             return other.error * kWorse < plane.error &&
                    other.normal.dot(plane.normal) > kOneSheetCosine;
           });
  });
}

bool isInCell(const Vector3d& p, double margin) {
  return p.minCoeff() >= -margin && p.maxCoeff() <= 1 + margin;
}

}  // namespace

/// Implementation of VertexPlacer. Positions are relative to the cell's lowest corner until place()
/// returns.
class VertexPlacer::Impl {
 public:
  Impl(const FloatGrid& grid, const Coord& origin) : field_(grid, origin) {}

  DualVertex place(int x, int y, int z, const std::uint8_t* edges, std::size_t count) {
    x_ = x, y_ = y, z_ = z;
    crossings_.clear();
    planes_.clear();
    bool isSmooth = true;
    double bend = 0;
    unsigned corners = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto offset = edgeOffset(edges[i]);
      const auto axis = static_cast<std::size_t>(edgeAxis(edges[i]));
      auto end = offset;
      end[axis] = 1;
      const Plane &low = planeAt(offset), &high = planeAt(end);
      isSmooth &= low.isSmooth && high.isSmooth && low.isKnown && high.isKnown;
      bend = std::max({bend, low.bend, high.bend});
      const double t = crossing(low.distance, high.distance);
      Vector3d point(offset[0], offset[1], offset[2]);
      point[static_cast<int>(axis)] = t;
      crossings_.emplace_back(point, (1 - t) * low.gradient + t * high.gradient);
      corners |= 1u << cornerOf(offset[0], offset[1], offset[2]);
      corners |= 1u << cornerOf(end[0], end[1], end[2]);
    }
    Vector3d centre = Vector3d::Zero();
    for (const auto& crossing : crossings_) centre += crossing.first;
    centre /= static_cast<double>(count);
    DualVertex vertex = placeSmooth(centre);
    vertex.bend = bend;
    if (!isSmooth) {
      settle(vertex);
      placeByPlanes(centre, corners, vertex);
    }
    const Vector3d cell(x_, y_, z_);
    vertex.position += cell;
    vertex.smooth += cell;
    return vertex;
  }

 private:
  const Plane& planeAt(const std::array<int, 3>& offset) {
    return field_.plane(x_ + offset[0], y_ + offset[1], z_ + offset[2]);
  }

  static double crossing(double low, double high) {
    const double t = low / (low - high);
    return t >= 0 && t <= 1 ? t : 0.5;
  }

  /// Computes the vertex on a smooth surface. The mean of the crossings lies as far inside a curved
  /// surface as their tangent planes lie outside. So the midpoint between both, along the mean
  /// normal, is on the surface to higher order.
  [[nodiscard]] DualVertex placeSmooth(const Vector3d& centre) const {
    Vector3d mean = Vector3d::Zero();
    for (const auto& [point, normal] : crossings_) mean += normal;
    if (!(mean.norm() > 0.1)) return {centre, {}, centre};
    mean.normalize();
    VertexSheets sheets;
    sheets.normal[sheets.count++] = toSheet(mean);
    double above = 0, below = 0;
    for (const auto& [point, normal] : crossings_) {
      const Vector3d unit = normal.normalized();
      above += unit.dot(mean) * unit.dot(point - centre);
      below += unit.dot(mean) * unit.dot(mean);
    }
    Vector3d result = centre + mean * (above / below / 2);
    if (!isInCell(result, 0)) result = centre;
    return {result, sheets, result};
  }

  /// Moves the smooth position of a vertex to the zero of the field along its normal. Where the
  /// radius of curvature is close to a voxel, the midpoint of placeSmooth() is not accurate enough.
  void settle(DualVertex& vertex) const {
    if (!vertex.sheets.count) return;
    const openvdb::Vec3d n = sheetNormal(vertex.sheets, 0);
    const Vector3d normal(n[0], n[1], n[2]), cell(x_, y_, z_);
    double slope = 0;
    for (const auto& [point, gradient] : crossings_) slope += gradient.dot(normal);
    slope /= static_cast<double>(crossings_.size());
    if (!(slope > kLeastFieldSlope)) return;
    Vector3d p = vertex.smooth;
    for (int i = 0; i < kSettleSteps && isInCell(p, 1); ++i)
      p -= normal * (field_.curved(p + cell) / slope);
    if (isInCell(p, kSettleReach)) vertex.smooth = p;
  }

  /// Computes the vertex on the edge or corner where the tangent planes of the cell's grid points
  /// meet. It may lie up to kVertexReach outside the cell: it is on the surface there, and the
  /// nearest point of the cell is not. If no such point exists, moves the vertex to the nearest
  /// plane.
  void placeByPlanes(const Vector3d& centre, unsigned corners, DualVertex& vertex) {
    for (const auto& [touch, reach] :
         {std::pair(kTouchMargin, kOnBorder), std::pair(kOnBorder, kOnBorder),
          std::pair(kTouchMargin, kVertexReach), std::pair(kOnBorder, kVertexReach)}) {
      collectPlanes(corners, touch);
      if (planes_.empty()) continue;
      const Vector3d fitted = fitPlanes(planes_, centre);
      if (isInCell(fitted, reach)) return moveTo(fitted, vertex);
    }
    moveTo(toNearestPlane(centre, corners), vertex);
  }

  void moveTo(const Vector3d& position, DualVertex& vertex) const {
    vertex.position = position;
    vertex.sheets = sheetsAt(position, planes_);
    vertex.bend = planes_.empty() ? 1 : 0;
    for (const FacePlane& plane : planes_) {
      vertex.misfit = std::max(vertex.misfit, std::abs(plane.above(position)));
      vertex.bend = std::max(vertex.bend, plane.bend);
    }
  }

  /// Collects the tangent planes of the cell's corners in the bit mask `corners` that touch the
  /// surface in the cell or within `margin` voxels of it.
  void collectPlanes(unsigned corners, double margin) {
    planes_.clear();
    for (int corner = 0; corner < 8; ++corner) {
      if (!((corners >> corner) & 1)) continue;
      const std::array<int, 3> offset = {corner >> 2, (corner >> 1) & 1, corner & 1};
      const Plane& plane = planeAt(offset);
      const Vector3d point(offset[0], offset[1], offset[2]);
      const Vector3d foot = point - plane.distance * plane.normal;
      if (!plane.isKnown || !isInCell(foot, margin)) continue;
      if (std::abs(field_.interpolated(foot + Vector3d(x_, y_, z_))) > kOffSurface) continue;
      planes_.push_back(
          {plane.normal, plane.normal.dot(point) - plane.distance, plane.error, plane.bend});
    }
    dropWorse(planes_);
  }

  Vector3d toNearestPlane(const Vector3d& centre, unsigned corners) {
    collectPlanes(corners, kTouchMargin);
    Vector3d shift = Vector3d::Constant(1);
    for (const FacePlane& plane : planes_) {
      const double distance = -plane.above(centre);
      if (std::abs(distance) < shift.norm()) shift = distance * plane.normal;
    }
    return isInCell(centre + shift, 0) ? Vector3d(centre + shift) : centre;
  }

  TangentPlanes field_;
  int x_ = 0, y_ = 0, z_ = 0;  ///< lowest grid point of the current cell, relative to the block
  std::vector<std::pair<Vector3d, Vector3d>> crossings_;  ///< zero crossings, gradients there
  std::vector<FacePlane> planes_;
};

Vector3d fitPlanes(const std::vector<FacePlane>& planes, const Vector3d& centre) {
  Matrix3d matrix = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const FacePlane& plane : planes) {
    matrix += plane.normal * plane.normal.transpose();
    right -= plane.normal * plane.above(centre);
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(matrix);
  const Vector3d& values = solver.eigenvalues();
  Vector3d shift = Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    if (values[i] < kRank * values[2]) continue;
    const Vector3d direction = solver.eigenvectors().col(i);
    shift += direction * (direction.dot(right) / values[i]);
  }
  return centre + shift;
}

VertexSheets sheetsAt(const Vector3d& point, const std::vector<FacePlane>& planes) {
  VertexSheets sheets;
  for (const FacePlane& plane : planes) {
    if (sheets.count == VertexSheets::kMost || std::abs(plane.above(point)) > kOffSheet) continue;
    const openvdb::Vec3f sheet = toSheet(plane.normal);
    bool isKnown = false;
    for (std::size_t i = 0; i < sheets.count; ++i)
      isKnown |= static_cast<double>(sheets.normal[i].dot(sheet)) > kOneSheetCosine;
    if (!isKnown) sheets.normal[sheets.count++] = sheet;
  }
  return sheets;
}

VertexPlacer::VertexPlacer(const FloatGrid& grid, const Coord& origin)
    : impl_(std::make_unique<Impl>(grid, origin)) {}
VertexPlacer::~VertexPlacer() = default;

DualVertex VertexPlacer::place(int x, int y, int z, const std::uint8_t* edges, std::size_t count) {
  return impl_->place(x, y, z, edges, count);
}

}  // namespace levelset
