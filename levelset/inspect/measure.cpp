#include "levelset/inspect/measure.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "levelset/convert/cell_surface.h"
#include "levelset/inspect/shells.h"

namespace levelset {

namespace {

void describeShells(const std::vector<ShellFigures>& shells, Measurement& result) {
  for (const ShellFigures& shell : shells) {
    result.volume += shell.volume;
    result.area += shell.area;
    result.euler += shell.euler;
    ++result.shells;
    if (shell.volume > 0) ++result.components;
    if (shell.volume < 0) ++result.cavities;
  }
}

}  // namespace

// The figures are those of the uniform mesh in index space: near to the numbers' origin, so that a
// part far away in the world measures the same.
Measurement measure(const NarrowBand& solid) {
  Measurement result;
  result.voxelSize = solid.voxelSize();
  result.halfWidth = solid.halfWidth();
  result.activeVoxels = solid.activeVoxelCount();
  if (solid.isEmpty()) return result;
  const IndexMesh mesh = marchCells(CellSurface(vdb(solid)));
  describeShells(findShells(mesh.positions, mesh.triangles).figures, result);
  result.area *= result.voxelSize * result.voxelSize;
  result.volume *= result.voxelSize * result.voxelSize * result.voxelSize;
  const Imath::M44d matrix = solid.indexToWorld();
  for (const openvdb::Vec3d& p : mesh.positions) result.bounds.extendBy(toImath(p) * matrix);
  return result;
}

Measurement measure(const TriMesh& mesh) {
  Measurement result;
  describeShells(findShells(mesh.positions, mesh.triangles).figures, result);
  result.bounds = bounds(mesh);
  return result;
}

namespace {

/// The corners of the triangles at each vertex: for each, the vertices after and before it.
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

/// Judges the edges from `vertex` to higher ones, and the vertex itself.
class FanJudge {
 public:
  void judge(std::uint32_t vertex, const std::array<std::uint32_t, 2>* begin, std::size_t count,
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
        leaving += spokes_[end].leaves;
        fans -= join(spokes_[i].triangle, spokes_[end].triangle);
      }
      if (vertex <= spokes_[i].to) judgeEdge(vertex, spokes_[i].to, end - i, leaving, out);
    }
    out.nonManifoldVertices += fans > 1;
  }

 private:
  struct Spoke {
    std::uint32_t to;
    std::size_t triangle;
    bool leaves;  ///< the triangle runs from the vertex to `to`
  };

  static void judgeEdge(std::uint32_t from, std::uint32_t to, std::size_t faces,
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
  const VertexFans fans = collectFans(mesh);
  constexpr std::size_t kChunk = 1 << 14;
  std::vector<Manifoldness> parts((mesh.positions.size() + kChunk - 1) / kChunk);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
    FanJudge judge;
    const std::size_t end = std::min(mesh.positions.size(), (part + 1) * kChunk);
    for (std::size_t v = part * kChunk; v < end; ++v) {
      judge.judge(static_cast<std::uint32_t>(v), fans.spokes.data() + fans.first[v],
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
