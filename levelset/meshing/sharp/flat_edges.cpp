#include "levelset/meshing/sharp/flat_edges.h"

#include <Eigen/Dense>
#include <cmath>
#include <vector>

namespace levelset {
namespace {

using Eigen::Vector3d;
using openvdb::Coord;
using openvdb::Vec3d;

// Grid points of a face: least and largest distance from the edge along the face, largest distance
// from the vertex along the edge, and largest deviation of their values from a plane, voxels. The
// slope deviates from 1 by no more than that. Interpolation across the edge changes values up to
// two voxels from it. On a narrow face, fewer grid points must fit better.
struct Window {
  double end, along, misfit;
};
constexpr double kBegin = 2;
constexpr Window kWindows[] = {{5.5, 2, 3e-4}, {3, 1, 1e-4}};
// Largest deviation of the values from the vertex's plane, voxels. Faces that bend more are not
// flat, which spares the fit.
constexpr double kBendsAway = 0.2;
// Largest distance of the grid points from the plane of the face, voxels.
constexpr double kOffPlane = 2;
// Least number of grid points. A plane has four unknowns.
constexpr std::size_t kLeastPoints = 8;
// Largest distance of the nearest point from a half-space that contains it, voxels.
constexpr double kOutside = 1e-9;

/// Fits a plane to the values of the grid points of a face. Returns none if the face is not flat.
/// @param inFace  unit vector in the face, perpendicular to the edge and away from it
std::optional<FlatFace> fitFace(const Vec3d& vertex, const Vec3d& normal, const Vec3d& edge,
                                const Vec3d& inFace, const Window& window,
                                const openvdb::FloatGrid& grid,
                                const openvdb::FloatGrid::ConstAccessor& field) {
  std::vector<Eigen::Vector4d> rows;
  std::vector<double> values;
  const double voxelSize = grid.voxelSize()[0];
  constexpr int kReach = 4;  // at least the half diagonal of the face's box
  const Coord centre = Coord::round(vertex + inFace * ((kBegin + window.end) / 2));
  for (const Coord& c : openvdb::CoordBBox(centre.offsetBy(-kReach), centre.offsetBy(kReach))) {
    const Vec3d to = c.asVec3d() - vertex;
    const double away = to.dot(inFace);
    if (away < kBegin || away > window.end || std::abs(to.dot(normal)) > kOffPlane ||
        std::abs(to.dot(edge)) > window.along)
      continue;
    float value = 0;
    if (!field.probeValue(c, value)) continue;
    const double deviation = static_cast<double>(value) / voxelSize - normal.dot(to);
    if (std::abs(deviation) > kBendsAway) return std::nullopt;
    rows.emplace_back(to.x(), to.y(), to.z(), 1);
    values.push_back(deviation);
  }
  if (rows.size() < kLeastPoints) return std::nullopt;
  Eigen::Matrix<double, Eigen::Dynamic, 4> matrix(static_cast<Eigen::Index>(rows.size()), 4);
  Eigen::VectorXd right(matrix.rows());
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    matrix.row(i) = rows[static_cast<std::size_t>(i)];
    right[i] = values[static_cast<std::size_t>(i)];
  }
  // The least correction of the vertex's plane, since the grid points may lie on a line.
  const Eigen::Vector4d change = matrix.completeOrthogonalDecomposition().solve(right);
  const Vec3d n = normal + Vec3d(change[0], change[1], change[2]);
  const double slope = n.length();
  if (!((matrix * change - right).cwiseAbs().maxCoeff() < window.misfit &&
        std::abs(slope - 1) < window.misfit))
    return std::nullopt;
  return FlatFace{n / slope, (n.dot(vertex) - change[3]) / slope};
}

/// Returns the point nearest to `point` in which some planes meet. Returns none if the planes are
/// parallel, or if another point of the half-spaces below them is nearer.
std::optional<Vec3d> meetingPoint(const std::vector<FlatFace>& faces, unsigned subset,
                                  const Vec3d& point) {
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> normals(3, __builtin_popcount(subset));
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> above(normals.cols());
  Eigen::Index k = 0;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (!(subset >> i & 1)) continue;
    const Vec3d& n = faces[i].normal;
    normals.col(k) = Vector3d(n.x(), n.y(), n.z());
    above[k++] = faces[i].above(point);
  }
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3> gram =
      normals.transpose() * normals;
  if (!(gram.determinant() > 1e-6)) return std::nullopt;
  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> along = gram.inverse() * above;
  if (along.minCoeff() < 0) return std::nullopt;
  const Vector3d shift = normals * along;
  return point - Vec3d(shift.x(), shift.y(), shift.z());
}

}  // namespace

std::optional<FlatEdge> flatEdge(const SharpVertex& vertex, const openvdb::FloatGrid& grid,
                                 const openvdb::FloatGrid::ConstAccessor& field) {
  const Vec3d n0 = sheetNormal(vertex.sheets, 0), n1 = sheetNormal(vertex.sheets, 1);
  const double cosine = n0.dot(n1);
  Vec3d edge = n0.cross(n1), in0 = n0 * cosine - n1, in1 = n1 * cosine - n0;
  if (!edge.normalize() || !in0.normalize() || !in1.normalize()) return std::nullopt;
  // The faces of a concave edge lie on the other sides.
  const auto fit = [&](const Vec3d& normal, const Vec3d& inFace) {
    std::optional<FlatFace> face;
    for (const Window& window : kWindows) {
      if (face) break;
      face = fitFace(vertex.position, normal, edge, inFace, window, grid, field);
      if (face) face->isNarrow = &window != kWindows;
    }
    return face;
  };
  for (const double side : {1.0, -1.0}) {
    const auto first = fit(n0, in0 * side);
    if (!first) continue;
    const auto second = fit(n1, in1 * side);
    if (second) return FlatEdge{vertex.position, {*first, *second}, side > 0};
  }
  return std::nullopt;
}

PolyhedronPoint nearestOnPolyhedron(const std::vector<FlatFace>& faces, const Vec3d& point) {
  const FlatFace* top = &faces.front();
  for (const FlatFace& face : faces)
    if (face.above(point) > top->above(point)) top = &face;
  if (const double above = top->above(point); above <= 0)
    return {above, point - top->normal * above};
  PolyhedronPoint nearest{INFINITY, point};
  for (unsigned subset = 1; subset < 1u << faces.size(); ++subset) {
    if (__builtin_popcount(subset) > 3) continue;
    const std::optional<Vec3d> found = meetingPoint(faces, subset, point);
    if (!found) continue;
    const double distance = (point - *found).length();
    if (distance >= nearest.distance) continue;
    bool isInside = true;
    for (const FlatFace& face : faces) isInside &= face.above(*found) < kOutside;
    if (isInside) nearest = {distance, *found};
  }
  return nearest;
}

}  // namespace levelset
