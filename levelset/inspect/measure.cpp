#include "levelset/inspect/measure.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "levelset/geometry/surface_components.h"
#include "levelset/inspect/crease_patches.h"
#include "levelset/inspect/curved_surface.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/meshing/cells/cell_surface.h"
#include "levelset/progress_gate.h"

namespace levelset {

namespace {

using openvdb::Vec3d;

/// Sums moments over the triangles of each surface component, chunk by chunk, and adds the chunks
/// in order.
/// @param piece  (triangle, anchor, worker): moments of one triangle
/// @param makeWorker  creates the scratch data of a chunk
template <typename MakeWorker, typename Piece>
std::vector<SurfaceMoments> sumComponents(const std::vector<std::uint32_t>& componentOfTriangle,
                                          const std::vector<Vec3d>& anchors,
                                          const Progress& progress, const MakeWorker& makeWorker,
                                          const Piece& piece) {
  constexpr std::size_t kChunk = 4096;
  struct Part {
    std::uint32_t component;
    SurfaceMoments sum;
  };
  const std::size_t count = componentOfTriangle.size();
  std::vector<std::vector<Part>> parts((count + kChunk - 1) / kChunk);
  ProgressGate gate(progress, parts.size());
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t chunk) {
    auto worker = makeWorker();
    const std::size_t end = std::min(count, (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
      const std::uint32_t component = componentOfTriangle[i];
      if (parts[chunk].empty() || parts[chunk].back().component != component)
        parts[chunk].push_back({component, {}});
      parts[chunk].back().sum.add(piece(i, anchors[component], worker));
    }
    gate.advance(1);
  });
  std::vector<SurfaceMoments> sums(anchors.size());
  for (const auto& chunk : parts)
    for (const Part& part : chunk) sums[part.component].add(part.sum);
  return sums;
}

/// Returns the reference point of the moments of each surface component: its first vertex, which is
/// close to the component even if the components are far apart.
template <typename Vector>
std::vector<Vec3d> componentAnchors(const SurfaceComponents& components,
                                    const std::vector<Vector>& positions) {
  std::vector<Vec3d> anchors(components.figures.size());
  for (std::size_t v = positions.size(); v-- > 0;) {
    const std::uint32_t component = components.componentOfVertex[v];
    if (component != SurfaceComponents::kNoComponent)
      anchors[component] = Vec3d(positions[v][0], positions[v][1], positions[v][2]);
  }
  return anchors;
}

std::vector<std::uint32_t> componentsOfTriangles(
    const SurfaceComponents& components,
    const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<std::uint32_t> result;
  result.reserve(triangles.size());
  for (const auto& t : triangles) result.push_back(components.componentOfVertex[t[0]]);
  return result;
}

/// Converts moments in index space to volume, area, curvature, centroid and inertia in world space.
/// @param whole  moments of all surface components together
/// @param anchor  reference point of the moments
/// @param scale  voxel size, world units
void describeMoments(const SurfaceMoments& whole, const Vec3d& anchor, const Imath::M44d& toWorld,
                     double scale, Measurement& result) {
  result.volume = whole.volume * scale * scale * scale;
  result.area = whole.area * scale * scale;
  result.meanCurvature = whole.meanCurvature * scale;
  if (!(std::abs(whole.volume) > 0)) return;
  const Vec3d middle = whole.first / whole.volume;
  const SurfaceMoments central = whole.about(middle);
  toWorld.multVecMatrix(toImath(anchor + middle), result.centroid);
  const auto& s = central.second;
  const Imath::M33d moment(s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]);
  Imath::M33d linear;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) linear[i][j] = toWorld[i][j];
  const Imath::M33d turned = linear.transposed() * moment * linear * (scale * scale * scale);
  const double trace = turned[0][0] + turned[1][1] + turned[2][2];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result.inertia[i][j] = (i == j ? trace : 0) - turned[i][j];
}

void describeComponents(const SurfaceComponents& components,
                        const std::vector<SurfaceMoments>& sums, const std::vector<Vec3d>& anchors,
                        const Imath::M44d& toWorld, double scale, Measurement& result) {
  if (anchors.empty()) return;
  SurfaceMoments whole;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    result.euler += components.figures[i].euler;
    ++result.surfaces;
    // The sign of its volume distinguishes a component that faces outwards from a cavity. The
    // volume under the flat triangles decides: where the surface bends strongly within a voxel, the
    // volume under the curved triangles may have the wrong sign.
    const double volume = components.figures[i].volume;
    if (volume > 0) ++result.components;
    if (volume < 0) ++result.cavities;
    whole.add(sums[i].about(anchors[0] - anchors[i]));
  }
  describeMoments(whole, anchors[0], toWorld, scale, result);
}

/// Returns the integral of the mean curvature of a mesh: half the sum over all edges of length
/// times angle between the normals, positive at convex edges [Steiner40].
double edgeCurvature(const TriMesh& mesh) {
  struct Side {
    std::uint32_t low, high;
    std::size_t triangle;
  };
  std::vector<Side> sides;
  sides.reserve(mesh.triangles.size() * 3);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    for (std::size_t k = 0; k < 3; ++k)
      sides.push_back({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3]), i});
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  const auto normal = [&](std::size_t i) {
    const auto& t = mesh.triangles[i];
    return (mesh.positions[t[1]] - mesh.positions[t[0]])
        .cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
  };
  double sum = 0;
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    if (sides[i].low != sides[i + 1].low || sides[i].high != sides[i + 1].high) continue;
    const auto& t = mesh.triangles[sides[i].triangle];
    Imath::V3d along = mesh.positions[sides[i].high] - mesh.positions[sides[i].low];
    for (std::size_t k = 0; k < 3; ++k)
      if (t[k] == sides[i].high && t[(k + 1) % 3] == sides[i].low) along = -along;
    const Imath::V3d first = normal(sides[i].triangle), second = normal(sides[i + 1].triangle);
    const double length = along.length();
    if (length > 0)
      sum += std::atan2(first.cross(second).dot(along), first.dot(second) * length) * length / 2;
  }
  return sum;
}

Measurement figuresOf(const NarrowBand& solid) {
  Measurement result;
  result.voxelSize = solid.voxelSize();
  result.halfWidth = solid.halfWidth();
  result.activeVoxels = solid.activeVoxelCount();
  return result;
}

/// Returns the mesh with closed seams if it has attributes whose seams double vertices; else
/// nullopt.
std::optional<TriMesh> withoutItsSeams(const TriMesh& mesh) {
  if (mesh.attributes.isEmpty()) return std::nullopt;
  return withoutSeams(mesh, memoryLimit(kNoMemoryLimit));
}

}  // namespace

// Integrates in index space, relative to a vertex, so that the distance of the solid from the world
// origin does not affect the result.
Measurement measure(const NarrowBand& solid, const Progress& progress) {
  requireSolid(solid);
  report(progress, 0);
  Measurement result = figuresOf(solid);
  if (solid.isEmpty()) return result;
  const IndexMesh mesh = marchCells(CellSurface(vdb(solid)));
  report(progress, 0.2);
  const SurfaceComponents components = findSurfaceComponents(mesh.positions, mesh.triangles);
  const std::vector<Vec3d> anchors = componentAnchors(components, mesh.positions);
  report(progress, 0.3);
  const CurvedSurface surface(mesh, vdb(solid));
  const Progress last = subProgress(progress, 0.4, 1);
  const std::vector<SurfaceMoments> sums = sumComponents(
      componentsOfTriangles(components, mesh.triangles), anchors, last,
      [&] { return surface.makeCache(); },
      [&](std::size_t i, const Vec3d& anchor, CurvedSurface::Cache& cache) {
        return surface.moments(i, anchor, cache);
      });
  const Imath::M44d matrix = solid.indexToWorld();
  describeComponents(components, sums, anchors, matrix, result.voxelSize, result);
  for (const Vec3d& p : mesh.positions) result.bounds.extendBy(toImath(p) * matrix);
  return result;
}

Measurement measureSharp(const NarrowBand& solid, const Progress& progress) {
  requireSolid(solid);
  report(progress, 0);
  Measurement result = figuresOf(solid);
  if (solid.isEmpty()) return result;
  const openvdb::FloatGrid& grid = vdb(solid);
  const CellSurface cells(grid);
  const EdgeCrossings crossings = crossingsOfField(cells, grid);
  ExtendedSurface mesh =
      extendedSurface(cells, crossings, subProgress(progress, 0.1, 0.3), /*listsCrossings=*/true);
  if (mesh.edgeVertices + mesh.cornerVertices == 0)
    return measure(solid, subProgress(progress, 0.3, 1));
  const CreasePatches patches(mesh, crossings, grid);
  const SurfaceComponents components = findSurfaceComponents(mesh.positions, mesh.triangles);
  const std::vector<Vec3d> anchors = componentAnchors(components, mesh.positions);
  const CurvedSurface surface(mesh, grid);
  report(progress, 0.5);
  const Progress last = subProgress(progress, 0.5, 1);
  const std::vector<SurfaceMoments> sums = sumComponents(
      componentsOfTriangles(components, mesh.triangles), anchors, last,
      [&] { return surface.makeCache(); },
      [&](std::size_t i, const Vec3d& anchor, CurvedSurface::Cache& cache) {
        return patches.contains(i) ? patches.moments(i, anchor) : surface.moments(i, anchor, cache);
      });
  const Imath::M44d matrix = solid.indexToWorld();
  describeComponents(components, sums, anchors, matrix, result.voxelSize, result);
  result.meanCurvature += patches.edgeCurvature() * result.voxelSize;
  for (const Vec3d& p : mesh.positions) result.bounds.extendBy(toImath(p) * matrix);
  return result;
}

Measurement measure(const TriMesh& mesh, const Progress& progress) {
  report(progress, 0);
  if (const auto closed = withoutItsSeams(mesh)) return measure(*closed, progress);
  Measurement result;
  const SurfaceComponents components = findSurfaceComponents(mesh.positions, mesh.triangles);
  const std::vector<Vec3d> anchors = componentAnchors(components, mesh.positions);
  const Progress middle = subProgress(progress, 0.3, 0.6);
  const std::vector<SurfaceMoments> sums = sumComponents(
      componentsOfTriangles(components, mesh.triangles), anchors, middle, [] { return 0; },
      [&](std::size_t i, const Vec3d& anchor, int) {
        const auto& t = mesh.triangles[i];
        return flatTriangleMoments(toVdb(mesh.positions[t[0]]) - anchor,
                                   toVdb(mesh.positions[t[1]]) - anchor,
                                   toVdb(mesh.positions[t[2]]) - anchor);
      });
  describeComponents(components, sums, anchors, Imath::M44d(), 1, result);
  result.meanCurvature = edgeCurvature(mesh);
  result.bounds = bounds(mesh);
  report(progress, 1);
  return result;
}

namespace {

/// Triangle corners grouped by vertex. The corners at vertex v are spokes[first[v]] to
/// spokes[first[v + 1] − 1]. Each holds the next and the previous vertex of its triangle.
struct VertexFans {
  std::vector<std::size_t> first;
  std::vector<std::array<std::uint32_t, 2>> spokes;
};

VertexFans collectFans(const TriMesh& mesh) {
  VertexFans fans;
  fans.first.assign(mesh.positions.size() + 1, 0);
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t) ++fans.first[v + 1];
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) fans.first[v + 1] += fans.first[v];
  fans.spokes.resize(mesh.triangles.size() * 3);
  std::vector<std::size_t> next(fans.first.begin(), fans.first.end() - 1);
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      fans.spokes[next[t[i]]++] = {t[(i + 1) % 3], t[(i + 2) % 3]};
    }
  }
  return fans;
}

/// Classifies the edges from `vertex` to vertices of higher index, and the vertex itself.
class FanClassifier {
 public:
  void classify(std::uint32_t vertex, const std::array<std::uint32_t, 2>* begin, std::size_t count,
                Manifoldness& out) {
    if (!count) return;
    spokes_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      spokes_.push_back({begin[i][0], i, true});
      spokes_.push_back({begin[i][1], i, false});
    }
    std::sort(spokes_.begin(), spokes_.end(), [](const Spoke& a, const Spoke& b) {
      return a.to != b.to ? a.to < b.to : a.triangle < b.triangle;
    });
    fan_.resize(count);
    for (std::size_t i = 0; i < count; ++i) fan_[i] = i;
    std::size_t fans = count;
    for (std::size_t i = 0, end = 0; i < spokes_.size(); i = end) {
      std::size_t leaving = 0;
      for (end = i; end < spokes_.size() && spokes_[end].to == spokes_[i].to; ++end) {
        leaving += spokes_[end].isOutgoing;
        fans -= join(spokes_[i].triangle, spokes_[end].triangle);
      }
      if (vertex <= spokes_[i].to) classifyEdge(vertex, spokes_[i].to, end - i, leaving, out);
    }
    out.nonManifoldVertices += fans > 1;
  }

 private:
  struct Spoke {
    std::uint32_t to;
    std::size_t triangle;
    bool isOutgoing;  ///< true when the triangle traverses the edge from the vertex to `to`
  };

  static void classifyEdge(std::uint32_t from, std::uint32_t to, std::size_t faces,
                           std::size_t leaving, Manifoldness& out) {
    if (from == to || faces > 2) {
      ++out.nonManifoldEdges;
    } else if (faces == 1) {
      ++out.boundaryEdges;
    } else if (leaving != 1) {
      ++out.misorientedEdges;
    }
  }

  std::size_t root(std::size_t i) {
    while (fan_[i] != i) i = fan_[i] = fan_[fan_[i]];
    return i;
  }
  std::size_t join(std::size_t a, std::size_t b) {
    a = root(a), b = root(b);
    fan_[std::max(a, b)] = std::min(a, b);
    return a != b;
  }

  std::vector<Spoke> spokes_;
  std::vector<std::size_t> fan_;
};

}  // namespace

Manifoldness manifoldness(const TriMesh& mesh) {
  if (const auto closed = withoutItsSeams(mesh)) return manifoldness(*closed);
  const VertexFans fans = collectFans(mesh);
  constexpr std::size_t kChunk = 1 << 14;
  std::vector<Manifoldness> parts((mesh.positions.size() + kChunk - 1) / kChunk);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
    FanClassifier classifier;
    const std::size_t end = std::min(mesh.positions.size(), (part + 1) * kChunk);
    for (std::size_t v = part * kChunk; v < end; ++v) {
      classifier.classify(static_cast<std::uint32_t>(v), fans.spokes.data() + fans.first[v],
                          fans.first[v + 1] - fans.first[v], parts[part]);
    }
  });
  Manifoldness total;
  for (const Manifoldness& part : parts) {
    total.boundaryEdges += part.boundaryEdges;
    total.nonManifoldEdges += part.nonManifoldEdges;
    total.misorientedEdges += part.misorientedEdges;
    total.nonManifoldVertices += part.nonManifoldVertices;
  }
  return total;
}

}  // namespace levelset
