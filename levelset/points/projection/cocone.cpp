#include "levelset/points/projection/cocone.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "levelset/error.h"
#include "levelset/points/projection/delaunay.h"

namespace levelset::points {
namespace {

using Imath::V3d;
using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// Greatest sine between the plane across the normal and a co-cone.
const double kCoconeSine = std::sin(std::numbers::pi / 8);

/// End of an edge of the Voronoi diagram: a position, or a direction at infinity.
struct VoronoiEnd {
  V3d at;
  bool isInfinite = false;
};

/// Returns the centre of the sphere through four points. Thin tetrahedra lose digits, so it is
/// computed in extended precision.
V3d circumcentre(const V3d& a, const V3d& b, const V3d& c, const V3d& d) {
  using Wide = Imath::Vec3<long double>;
  const Wide u(b - a), v(c - a), w(d - a);
  const Wide vw = v.cross(w);
  const long double volume = u.dot(vw);
  const Wide across = vw * u.length2() + w.cross(u) * v.length2() + u.cross(v) * w.length2();
  // Rounding may hide the volume of a thin tetrahedron. Its centre is far away.
  const long double least = 1e-18L * std::sqrt(u.length2() * v.length2() * w.length2());
  const long double safe =
      std::abs(volume) > least ? volume : std::copysign(std::max(least, 1e-300L), volume);
  const Wide offset = across / (2 * safe);
  return a + V3d(static_cast<double>(offset.x), static_cast<double>(offset.y),
                 static_cast<double>(offset.z));
}

class Cocone {
 public:
  Cocone(std::span<const V3d> positions, const Tetrahedra& tetrahedra)
      : positions_(positions), tetrahedra_(tetrahedra) {
    centres_.reserve(tetrahedra.corners.size());
    for (const auto& t : tetrahedra.corners)
      centres_.push_back(
          circumcentre(positions[t[0]], positions[t[1]], positions[t[2]], positions[t[3]]));
  }

  /// Returns the directions of the poles.
  [[nodiscard]] std::vector<V3d> poles() const;
  [[nodiscard]] std::vector<Edge> edges(const std::vector<V3d>& normals) const;

 private:
  /// Corners of the face opposite a corner.
  [[nodiscard]] std::array<std::uint32_t, 3> face(std::size_t tetrahedron, std::size_t i) const {
    const auto& t = tetrahedra_.corners[tetrahedron];
    return {t[(i + 1) % 4], t[(i + 2) % 4], t[(i + 3) % 4]};
  }
  void chooseOnHull(const std::vector<V3d>& hull, std::vector<V3d>& direction) const;
  [[nodiscard]] V3d outwards(std::size_t tetrahedron, std::size_t i) const;
  [[nodiscard]] bool meetsCocone(std::uint32_t point, const V3d& normal, const VoronoiEnd& from,
                                 const VoronoiEnd& to) const;

  std::span<const V3d> positions_;
  const Tetrahedra& tetrahedra_;
  std::vector<V3d> centres_;
};

/// Returns the unit normal of a face, away from the tetrahedron.
V3d Cocone::outwards(std::size_t tetrahedron, std::size_t i) const {
  const auto f = face(tetrahedron, i);
  const V3d &a = positions_[f[0]], &b = positions_[f[1]], &c = positions_[f[2]];
  const V3d normal = (b - a).cross(c - a).normalized();
  const V3d& opposite = positions_[tetrahedra_.corners[tetrahedron][i]];
  return normal.dot(opposite - a) > 0 ? -normal : normal;
}

std::vector<V3d> Cocone::poles() const {
  std::vector<V3d> direction(positions_.size(), V3d(0));
  std::vector<V3d> hull(positions_.size(), V3d(0));
  std::vector<double> farthest(positions_.size(), -1);
  for (std::size_t t = 0; t < centres_.size(); ++t)
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint32_t p = tetrahedra_.corners[t][i];
      const V3d to = centres_[t] - positions_[p];
      if (to.length2() > farthest[p]) {
        farthest[p] = to.length2();
        direction[p] = to;
      }
      if (tetrahedra_.neighbours[t][i] != Tetrahedra::kNone) continue;
      for (const std::uint32_t q : face(t, i)) hull[q] += outwards(t, i);
    }
  chooseOnHull(hull, direction);
  for (V3d& d : direction) d.normalize();
  return direction;
}

/// Computes the directions of the points on the convex hull, whose cells are not bounded. The mean
/// direction of the infinite edges is that of the pole [Amenta00]. On a border it leans far. The
/// farthest corner of the cell and the plane through the nearest neighbours do not.
void Cocone::chooseOnHull(const std::vector<V3d>& hull, std::vector<V3d>& direction) const {
  constexpr std::size_t kNearest = 8;
  constexpr double kLean = 0.05;  // mean squared sine between neighbours and tangent plane
  using Near = std::pair<double, std::uint32_t>;
  std::vector<std::vector<Near>> near(hull.size());
  const auto isOnHull = [&](std::uint32_t p) { return hull[p].length2() > 0; };
  for (const auto& t : tetrahedra_.corners)
    for (const std::uint32_t p : t)
      for (const std::uint32_t q : t)
        if (p != q && isOnHull(p))
          near[p].emplace_back((positions_[q] - positions_[p]).length2(), q);
  for (std::uint32_t p = 0; p < hull.size(); ++p) {
    if (!isOnHull(p)) continue;
    std::sort(near[p].begin(), near[p].end());
    near[p].erase(std::unique(near[p].begin(), near[p].end()), near[p].end());
    near[p].resize(std::min(near[p].size(), kNearest));
    // Points of another sheet are farther off.
    constexpr double kOtherSheet = 2.5;
    const double second = near[p][std::min<std::size_t>(1, near[p].size() - 1)].first;
    while (near[p].back().first > kOtherSheet * kOtherSheet * second) near[p].pop_back();
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Near& other : near[p]) {
      const V3d d = (positions_[other.second] - positions_[p]).normalized();
      const Eigen::Vector3d along(d.x, d.y, d.z);
      spread += along * along.transpose() / static_cast<double>(near[p].size());
    }
    const auto lean = [&](const V3d& to) {
      const V3d unit = to.normalized();
      const Eigen::Vector3d n(unit.x, unit.y, unit.z);
      return n.dot(spread * n);
    };
    if (lean(hull[p]) <= lean(direction[p])) direction[p] = hull[p];
    if (lean(direction[p]) <= kLean) continue;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    const Eigen::Vector3d normal = solver.eigenvectors().col(0);
    const V3d plane(normal.x(), normal.y(), normal.z());
    // At a sharp edge, all directions lean alike.
    if (lean(plane) < 0.5 * lean(direction[p])) direction[p] = plane;
  }
}

bool Cocone::meetsCocone(std::uint32_t point, const V3d& normal, const VoronoiEnd& from,
                         const VoronoiEnd& to) const {
  const auto sine = [&](const VoronoiEnd& end) {
    const V3d d = end.isInfinite ? end.at : end.at - positions_[point];
    const double length = d.length();
    return length > 0 ? d.dot(normal) / length : 0;
  };
  const double a = sine(from), b = sine(to);
  // If both have the same sign, the least sine along the edge is at one of its ends.
  return a * b <= 0 || std::min(std::abs(a), std::abs(b)) <= kCoconeSine;
}

std::vector<Edge> Cocone::edges(const std::vector<V3d>& normals) const {
  std::vector<Edge> found;
  for (std::size_t t = 0; t < centres_.size(); ++t)
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint32_t other = tetrahedra_.neighbours[t][i];
      if (other != Tetrahedra::kNone && other < t) continue;
      const VoronoiEnd from{centres_[t]};
      const VoronoiEnd to = other == Tetrahedra::kNone ? VoronoiEnd{outwards(t, i), true}
                                                       : VoronoiEnd{centres_[other]};
      const auto f = face(t, i);
      std::array<bool, 3> meets;
      for (std::size_t k = 0; k < 3; ++k) meets[k] = meetsCocone(f[k], normals[f[k]], from, to);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = (k + 1) % 3;
        if (meets[k] && meets[next])
          found.emplace_back(std::min(f[k], f[next]), std::max(f[k], f[next]));
      }
    }
  return found;
}

/// Plane through points, by principal components.
struct Plane {
  V3d centre, u, v, normal;
  double deviation = 0;  ///< greatest distance of a point
  bool isLine = false;
};

Plane planeThrough(std::span<const V3d> positions) {
  V3d centre(0);
  for (const V3d& p : positions) centre += p / static_cast<double>(positions.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const V3d& p : positions) {
    const Eigen::Vector3d d(p.x - centre.x, p.y - centre.y, p.z - centre.z);
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  const auto axis = [&](int i) {
    const Eigen::Vector3d a = solver.eigenvectors().col(i);
    return V3d(a.x(), a.y(), a.z()).normalized();
  };
  Plane plane{centre, axis(2), axis(1), axis(0)};
  for (const V3d& p : positions)
    plane.deviation = std::max(plane.deviation, std::abs((p - centre).dot(plane.normal)));
  constexpr double kLeastWidth = 1e-14;  // 1e-7 of the length; the squares are rounded
  plane.isLine = !(solver.eigenvalues()[1] > kLeastWidth * solver.eigenvalues()[2]);
  return plane;
}

/// Returns the Delaunay edges of points in a plane. With one point beside the plane, they are edges
/// of tetrahedra.
std::vector<Edge> planarEdges(std::span<const V3d> positions, const Plane& plane) {
  std::vector<V3d> flat;
  flat.reserve(positions.size() + 1);
  double extent = 0;
  for (const V3d& p : positions) {
    flat.emplace_back((p - plane.centre).dot(plane.u), (p - plane.centre).dot(plane.v), 0);
    extent = std::max(extent, flat.back().length());
  }
  const auto apex = static_cast<std::uint32_t>(flat.size());
  flat.emplace_back(0, 0, extent);
  std::vector<Edge> found;
  for (const auto& t : delaunayTetrahedra(flat).corners)
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = i + 1; j < 4; ++j)
        if (t[i] != apex && t[j] != apex)
          found.emplace_back(std::min(t[i], t[j]), std::max(t[i], t[j]));
  return found;
}

CoconeGraph graphOf(std::vector<Edge> edges, std::vector<V3d> normals) {
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  CoconeGraph graph;
  graph.normals = std::move(normals);
  graph.first.assign(graph.normals.size() + 1, 0);
  for (const auto& [a, b] : edges) {
    ++graph.first[a + 1];
    ++graph.first[b + 1];
  }
  for (std::size_t i = 1; i < graph.first.size(); ++i) graph.first[i] += graph.first[i - 1];
  graph.ends.resize(2 * edges.size());
  std::vector<std::size_t> next(graph.first.begin(), graph.first.end() - 1);
  // In the order of the edges, each list gets its lower neighbours first: the lists ascend.
  for (const auto& [a, b] : edges) graph.ends[next[b]++] = a;
  for (const auto& [a, b] : edges) graph.ends[next[a]++] = b;
  return graph;
}

/// Removes long edges that are steep to the surface. Cells of points on borders are not bounded,
/// and their co-cones reach to other sheets.
CoconeGraph withoutSteepEdges(CoconeGraph graph, std::span<const V3d> positions) {
  constexpr double kSteep = 0.8, kLong = 1.5;
  std::vector<double> medians(positions.size(), 0), lengths;
  for (std::size_t p = 0; p < positions.size(); ++p) {
    lengths.clear();
    for (const std::uint32_t q : graph.neighbours(p))
      lengths.push_back((positions[q] - positions[p]).length());
    if (lengths.empty()) continue;
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    medians[p] = *middle;
  }
  std::vector<Edge> kept;
  for (std::uint32_t p = 0; p < positions.size(); ++p)
    for (const std::uint32_t q : graph.neighbours(p)) {
      if (q < p) continue;
      const V3d along = positions[q] - positions[p];
      const double length = along.length();
      const bool isSteep = std::max(std::abs(along.dot(graph.normals[p])),
                                    std::abs(along.dot(graph.normals[q]))) > kSteep * length;
      if (!isSteep || length <= kLong * std::min(medians[p], medians[q])) kept.emplace_back(p, q);
    }
  return graphOf(std::move(kept), std::move(graph.normals));
}

}  // namespace

CoconeGraph coconeGraph(std::span<const V3d> positions, std::size_t maxMemory,
                        const Progress& progress) {
  const Plane plane = planeThrough(positions);
  if (plane.isLine)
    throw InvalidInput(
        "all points lie on a line within rounding, so no surface passes through them; check the "
        "units and the columns of the file");
  double extent = 0;
  for (const V3d& p : positions) extent = std::max(extent, (p - plane.centre).length());
  // Below it, the distances from the plane are mostly rounding.
  constexpr double kFlat = 1e-10;
  if (plane.deviation <= kFlat * extent)
    return graphOf(planarEdges(positions, plane), std::vector<V3d>(positions.size(), plane.normal));
  const Tetrahedra tetrahedra = delaunayTetrahedra(positions, maxMemory, progress);
  const Cocone cocone(positions, tetrahedra);
  std::vector<V3d> normals = cocone.poles();
  std::vector<Edge> edges = cocone.edges(normals);
  return withoutSteepEdges(graphOf(std::move(edges), std::move(normals)), positions);
}

}  // namespace levelset::points
