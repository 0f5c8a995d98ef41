#include "levelset/meshing/extended/directed_distances.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "levelset/error.h"
#include "levelset/geometry/search/triangle_search.h"
#include "levelset/meshing/sharp/tangent_planes.h"

namespace levelset {
namespace {

using Eigen::Vector3d;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3d;

/// Largest distance of an intersection from the grid edge beyond its ends, as a share of the edge.
/// The signs of the field come from rounded values, so a surface that passes a grid point may meet
/// only the neighbouring edge.
constexpr double kBeyondEnd = 1e-3;
/// The same for tangent planes, which are estimates.
constexpr double kPlaneBeyondEnd = 0.05;
/// Least cosine of the angle between a grid edge and a tangent plane's normal.
constexpr double kLeastSlope = 0.05;
/// Largest amount, voxels, by which a tangent plane may contradict the field at an end of an edge.
constexpr double kConsistent = 0.03;
/// Tolerance of the test that a grid line meets a triangle, as a share of its area. It closes the
/// gaps that rounding leaves between adjacent triangles.
constexpr double kOnTriangle = 1e-9;

Vec3d toIndexSpace(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// A crossed grid edge.
struct GridEdge {
  Coord low;
  int axis = 0;
  bool lowInside = false;  ///< true: the lower end is inside
};

/// Calls run(block) for each block with crossed edges, in parallel.
template <typename PerBlock>
void forEachSurfaceBlock(const CellSurface& surface, const PerBlock& run) {
  const auto& blocks = surface.blocks();
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
    if (blocks[i].vertexCount) run(blocks[i]);
  });
}

GridEdge edgeAt(const SurfaceBlock& block, int x, int y, int z, int axis) {
  return {block.origin.offsetBy(x, y, z), axis, block.value(x * 64 + y * 8 + z) < 0};
}

/// Crossings of the edges of one block with the zero set of the field.
class FieldCrossings {
 public:
  FieldCrossings(const CellSurface& surface, const SurfaceBlock& block, const FloatGrid& grid)
      : surface_(surface), block_(block), planes_(grid, block.origin, 1) {}

  [[nodiscard]] EdgeCrossing at(int x, int y, int z, int axis) {
    const GridEdge edge = edgeAt(block_, x, y, z, axis);
    const TangentPlane low = planes_.plane(x, y, z),
                       high = planes_.plane(x + (axis == 0), y + (axis == 1), z + (axis == 2));
    const Vec3d zero = crossingPoint(surface_, block_, x, y, z, axis);
    const double t = zero[axis] - edge.low[axis];
    const bool isSmooth = low.isSmooth && high.isSmooth && low.isKnown && high.isKnown;
    if (!isSmooth)
      if (const auto crossing = byPlanes(edge, {x, y, z}, t)) return *crossing;
    const Vector3d mixed = (1 - t) * low.gradient + t * high.gradient;
    const double length = mixed.norm();
    if (length > kLeastSlope) return {zero, toIndexSpace(mixed / length)};
    Vec3d along(0.0);
    along[axis] = edge.lowInside ? 1 : -1;
    return {zero, along};
  }

 private:
  /// Tangent plane beside an edge.
  struct Candidate {
    double t = 0;                 ///< share of the edge at which the plane meets it
    double inner = 0, outer = 0;  ///< signed distances of the inner and the outer end, voxels
    double error = 0;             ///< TangentPlane::error
    Vector3d normal = Vector3d::Zero();
  };

  /// Collects the tangent planes of the corners of the four cells at an edge. A plane that does not
  /// separate the ends as their signs do is left out.
  void collect(const GridEdge& edge, const std::array<int, 3>& low) {
    candidates_.clear();
    const auto along = static_cast<std::size_t>(edge.axis);
    const std::size_t u = (along + 1) % 3, v = (along + 2) % 3;
    for (int step = 0; step < 2; ++step)
      for (int du = -1; du <= 1; ++du)
        for (int dv = -1; dv <= 1; ++dv) {
          std::array<int, 3> at = low;
          at[along] += step, at[u] += du, at[v] += dv;
          const TangentPlane& plane = planes_.plane(at[0], at[1], at[2]);
          if (!plane.isKnown) continue;
          const double slope = plane.normal[edge.axis];
          if (slope * (edge.lowInside ? 1 : -1) < kLeastSlope) continue;
          const double atLow = plane.distance - step * slope -
                               du * plane.normal[static_cast<Eigen::Index>(u)] -
                               dv * plane.normal[static_cast<Eigen::Index>(v)];
          const double t = -atLow / slope;
          if (!(t >= -kPlaneBeyondEnd && t <= 1 + kPlaneBeyondEnd)) continue;
          candidates_.push_back({std::clamp(t, 0.0, 1.0), edge.lowInside ? atLow : atLow + slope,
                                 edge.lowInside ? atLow + slope : atLow, plane.error,
                                 plane.normal});
        }
  }

  /// Chooses the tangent plane that an edge beside an edge or corner of the solid meets.
  /// @param zero  share of the edge at which the linear interpolant is zero
  [[nodiscard]] std::optional<EdgeCrossing> byPlanes(const GridEdge& edge,
                                                     const std::array<int, 3>& low, double zero) {
    collect(edge, low);
    if (candidates_.empty()) return std::nullopt;
    const auto value = [&](bool isLow) {
      const int end = isLow ? 0 : 1;
      return planes_.value(low[0] + end * (edge.axis == 0), low[1] + end * (edge.axis == 1),
                           low[2] + end * (edge.axis == 2));
    };
    const double inner = value(edge.lowInside), outer = value(!edge.lowInside);
    bool isConvex = true, isConcave = true;
    for (const Candidate& plane : candidates_) {
      isConvex &= plane.inner <= inner + kConsistent;
      isConcave &= plane.outer >= outer - kConsistent;
    }
    const Candidate* best = nullptr;
    double least = 0;
    for (const Candidate& plane : candidates_) {
      // Distance from the inner end: the edge leaves an intersection of half-spaces at the first
      // plane and a union of them at the last.
      const double left = edge.lowInside ? plane.t : 1 - plane.t;
      const double rank = isConvex == isConcave ? std::abs(plane.t - zero)
                          : isConvex            ? left
                                                : -left;
      if (best && !(rank < least)) continue;
      best = &plane;
      least = rank;
    }
    return EdgeCrossing{pointOnEdge(surface_, edge.low, edge.axis, best->t),
                        toIndexSpace(best->normal)};
  }

  const CellSurface& surface_;
  const SurfaceBlock& block_;
  TangentPlanes planes_;
  std::vector<Candidate> candidates_;
};

/// Triangles of the original mesh in index space.
class OriginalMesh {
 public:
  OriginalMesh(const TriMesh& mesh, const FloatGrid& grid) {
    check(mesh);
    std::vector<Vec3d> points(mesh.positions.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i] = grid.transform().worldToIndex(toVdb(mesh.positions[i]));
    std::vector<TriangleItem> triangles;
    triangles.reserve(mesh.triangles.size());
    double volume = 0;
    const Vec3d& origin = points[mesh.triangles[0][0]];
    for (const auto& t : mesh.triangles) {
      const Vec3d &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
      triangles.push_back(
          {{toImath(a), toImath(b), toImath(c)}, static_cast<std::uint32_t>(triangles.size())});
      volume += (a - origin).dot((b - origin).cross(c - origin));
    }
    isInverted_ = volume < 0;
    triangles_ = TriangleSearch(std::move(triangles));
  }

  struct Hit {
    double t = 0;  ///< share of the edge
    Vec3d normal;
    bool isTurned = false;  ///< the normal was reversed, so that it faces the outer end
  };
  /// Returns the intersection with an edge that is nearest to the share `near` of the edge, the one
  /// of the lowest triangle among equals. Its normal faces the outer end of the edge. Where the
  /// edge leaves the solid, enters it and leaves it again, the entry is not taken.
  [[nodiscard]] std::optional<Hit> meet(const GridEdge& edge, double near) const {
    Vec3d middle = edge.low.asVec3d();
    middle[edge.axis] += 0.5;
    constexpr double kReach = 0.5 + 2 * kBeyondEnd;
    const double squared = kReach * kReach;
    std::optional<Hit> best;
    std::uint32_t bestIndex = 0;
    triangles_.visit(toImath(middle), squared, [&](const TriangleItem& triangle) {
      const auto hit = meetTriangle(
          {toVdb(triangle.corners[0]), toVdb(triangle.corners[1]), toVdb(triangle.corners[2])},
          edge);
      if (!hit) return;
      const std::uint32_t index = triangle.index;
      if (best && best->isTurned != hit->isTurned) {
        if (best->isTurned) best = hit, bestIndex = index;
        return;
      }
      const double gap = std::abs(hit->t - near), least = best ? std::abs(best->t - near) : 2;
      if (gap > least || (gap == least && index > bestIndex)) return;
      best = hit;
      bestIndex = index;
    });
    return best;
  }

 private:
  using Corners = std::array<Vec3d, 3>;

  static void check(const TriMesh& mesh) {
    if (mesh.triangles.empty())
      throw InvalidInput("the original mesh has no triangles; give the mesh of the level set");
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      const Imath::V3d& p = mesh.positions[v];
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
        throw InvalidInput(fmt::format(
            "vertex {} of the original mesh has a coordinate that is not finite; repair the mesh",
            v));
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (const std::uint32_t v : mesh.triangles[t])
        if (v >= mesh.positions.size())
          throw InvalidInput(fmt::format(
              "triangle {} of the original mesh refers to vertex {}, but there are only {} "
              "vertices; repair the mesh",
              t, v, mesh.positions.size()));
  }

  [[nodiscard]] std::optional<Hit> meetTriangle(const Corners& corners,
                                                const GridEdge& edge) const {
    const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
    const Vec3d line = edge.low.asVec3d();
    // Twice the areas, in the plane across the edge, of the triangles between the line and each
    // side: the barycentric coordinates of the intersection.
    std::array<double, 3> area;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d &a = corners[(k + 1) % 3], &b = corners[(k + 2) % 3];
      area[k] = (a[u] - line[u]) * (b[v] - line[v]) - (a[v] - line[v]) * (b[u] - line[u]);
    }
    const double whole = area[0] + area[1] + area[2];
    if (whole == 0) return std::nullopt;
    double position = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double weight = area[k] / whole;
      if (!(weight >= -kOnTriangle)) return std::nullopt;
      position += weight * (corners[k][edge.axis] - line[edge.axis]);
    }
    if (!(position >= -kBeyondEnd && position <= 1 + kBeyondEnd)) return std::nullopt;
    Hit hit{std::clamp(position, 0.0, 1.0),
            (corners[1] - corners[0]).cross(corners[2] - corners[0])};
    if (!hit.normal.normalize(0)) return std::nullopt;
    if (isInverted_) hit.normal = -hit.normal;
    hit.isTurned = (hit.normal[edge.axis] > 0) != edge.lowInside;
    if (hit.isTurned) hit.normal = -hit.normal;
    return hit;
  }

  bool isInverted_ = false;  ///< the triangles are oriented inwards
  TriangleSearch triangles_;
};

}  // namespace

EdgeCrossings crossingsOfField(const CellSurface& surface, const FloatGrid& grid) {
  EdgeCrossings result{std::vector<EdgeCrossing>(surface.vertexCount()), surface.vertexCount()};
  forEachSurfaceBlock(surface, [&](const SurfaceBlock& block) {
    FieldCrossings field(surface, block, grid);
    std::size_t vertex = block.firstVertex;
    CellSurface::forEachVertex(block, [&](int x, int y, int z, int axis) {
      result.at[vertex++] = field.at(x, y, z, axis);
    });
  });
  return result;
}

EdgeCrossings crossingsOfMesh(const CellSurface& surface, const FloatGrid& grid,
                              const TriMesh& original) {
  const OriginalMesh mesh(original, grid);
  EdgeCrossings result{std::vector<EdgeCrossing>(surface.vertexCount())};
  std::vector<std::size_t> missed(surface.blocks().size());
  forEachSurfaceBlock(surface, [&](const SurfaceBlock& block) {
    std::optional<FieldCrossings> field;
    std::size_t vertex = block.firstVertex;
    CellSurface::forEachVertex(block, [&](int x, int y, int z, int axis) {
      const GridEdge edge = edgeAt(block, x, y, z, axis);
      const double near = crossingPoint(surface, block, x, y, z, axis)[axis] - edge.low[axis];
      EdgeCrossing& crossing = result.at[vertex++];
      if (const auto hit = mesh.meet(edge, near)) {
        crossing = {pointOnEdge(surface, edge.low, axis, hit->t), hit->normal};
        return;
      }
      if (!field) field.emplace(surface, block, grid);
      crossing = field->at(x, y, z, axis);
      ++missed[block.neighbour[0]];
    });
  });
  for (const std::size_t count : missed) result.fromField += count;
  if (!result.at.empty() && result.fromField == result.at.size())
    throw InvalidInput(
        "the original mesh meets no grid edge that the surface crosses; give the mesh from which "
        "the level set was computed, in the same place");
  return result;
}

}  // namespace levelset
