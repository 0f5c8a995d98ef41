#include "levelset/mesh_sign/sign_field.h"

#include <cmath>

#include "levelset/geometry/disjoint_sets.h"

namespace levelset::convert {
namespace {

using Imath::V3d;
using Imath::V3i;

/// Mesh and the fans of triangles that close its boundary, and the correction of their winding
/// number. Crossings with grid lines give this number, an integer.
struct ClosedMesh {
  LocalMesh mesh;
  std::vector<int> weights;            ///< multiplicity of each triangle; empty: 1 each
  std::vector<WeightedTriangle> rest;  ///< triangles whose winding number is added as a correction
};

/// Closes each loop of the boundary by a fan of triangles around the mean of its vertices. The
/// edges of a loop form a cycle, so mesh and fans together have no boundary, whatever the loop's
/// shape.
ClosedMesh closeByFans(const LocalMesh& mesh, const std::vector<BoundaryEdge>& boundary) {
  ClosedMesh closed{mesh, std::vector<int>(mesh.triangles.size(), 1), {}};
  DisjointSets loops(mesh.points.size());
  for (const BoundaryEdge& e : boundary) loops.join(e.from, e.to);
  struct Apex {
    V3d sum = V3d(0);
    double count = 0;
    std::uint32_t index = 0;
  };
  std::unordered_map<std::uint32_t, Apex> apexes;
  for (const BoundaryEdge& e : boundary) {
    Apex& apex = apexes[loops.find(e.from)];
    apex.sum += mesh.points[e.from] + mesh.points[e.to];
    apex.count += 2;
  }
  for (const BoundaryEdge& e : boundary) {
    Apex& apex = apexes[loops.find(e.from)];
    if (apex.index == 0) {
      apex.index = static_cast<std::uint32_t>(closed.mesh.points.size());
      closed.mesh.points.push_back(apex.sum / apex.count);
    }
    closed.mesh.triangles.push_back({apex.index, e.to, e.from});
    closed.weights.push_back(e.multiplicity);
    const auto& p = closed.mesh.points;
    closed.rest.push_back(
        {{p[apex.index], p[e.to], p[e.from]}, -static_cast<double>(e.multiplicity)});
  }
  return closed;
}

ClosedMesh soupOf(const LocalMesh& mesh) {
  ClosedMesh closed;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    closed.rest.push_back({{mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)}, 1});
  return closed;
}

/// Six times the signed volume of the tetrahedra from the mean of all corners to the triangles;
/// positive for a mesh that faces outwards.
double orientedVolume(const LocalMesh& mesh, const std::vector<int>& weights) {
  V3d mean(0);
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) mean += mesh.points[v];
  mean /= static_cast<double>(3 * mesh.triangles.size());
  double volume = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const V3d a = mesh.corner(t, 0) - mean, b = mesh.corner(t, 1) - mean,
              c = mesh.corner(t, 2) - mean;
    volume += a.dot(b.cross(c)) * (weights.empty() ? 1 : weights[t]);
  }
  return volume;
}

ClosedMesh prepare(const LocalMesh& mesh, const MeshTopology& topology, SignField::Rule rule) {
  if (rule != SignField::Rule::Winding || topology.boundary.empty()) return {mesh, {}, {}};
  if (topology.boundary.size() > mesh.triangles.size()) return soupOf(mesh);
  return closeByFans(mesh, topology.boundary);
}

}  // namespace

SignField::SignField(const LocalMesh& mesh, const MeshTopology& topology, Rule rule,
                     const Progress& progress)
    : rule_(rule), lines_([&] {
        ClosedMesh closed = prepare(mesh, topology, rule);
        if (rule != Rule::Parity) {
          const bool soup = closed.mesh.triangles.empty();
          if (orientedVolume(soup ? mesh : closed.mesh, closed.weights) < 0) flip_ = -1;
        }
        field_ = WindingField(closed.rest);
        return LineCrossings(closed.mesh, closed.weights, progress);
      }()) {}

double SignField::fromSum(const CrossingSum& sum) const {
  return rule_ == Rule::Parity ? sum.crossings % 2 : flip_ * sum.winding;
}

double SignField::refine(double integer, const V3d& point) const {
  for (const double tolerance : {2e-2, 1e-3, 1e-5, 1e-7}) {
    const double w = integer + flip_ * field_.within(tolerance, point);
    const double quarters = w * 4;
    const double nearest = std::round(quarters);
    const bool decided =
        std::abs(quarters - nearest) > 4 * tolerance || nearest < 0.5 || nearest > 3.5;
    if (decided) return w;
  }
  return integer + flip_ * field_.exact(point);
}

double SignField::winding(const V3i& point) const {
  const double integer = fromSum(lines_.at(point.x, point.y, point.z));
  return isOpen() ? refine(integer, V3d(point)) : integer;
}

void SignField::winding(const V3i& origin, BlockWinding& out) const {
  std::array<CrossingSum, 64> sums;
  const bool clear = isUnambiguousIn(origin);
  for (int y = 0; y < kBlockDim; ++y) {
    lines_.slab(origin.x, origin.y + y, origin.z, sums.data());
    for (int x = 0; x < kBlockDim; ++x)
      for (int z = 0; z < kBlockDim; ++z) {
        const double integer = fromSum(sums[static_cast<std::size_t>(8 * x + z)]);
        out[static_cast<std::size_t>(64 * x + 8 * y + z)] =
            clear ? integer : refine(integer, V3d(origin + V3i(x, y, z)));
      }
  }
}

bool SignField::isUnambiguousIn(const V3i& origin) const {
  return !isOpen() || field_.bound(V3d(origin) + V3d(3.5), 6.07) < 0.25;
}

}  // namespace levelset::convert
