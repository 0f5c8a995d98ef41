#include "levelset/mesh_sign/mesh_topology.h"

#include <algorithm>

#include "levelset/geometry/position_table.h"

namespace levelset::convert {
namespace {

/// For each vertex, the lowest index of the vertices at the same position.
std::vector<std::uint32_t> weld(const std::vector<Imath::V3d>& positions) {
  PositionTable table(positions, positions.size());
  std::vector<std::uint32_t> first(positions.size());
  for (std::uint32_t v = 0; v < positions.size(); ++v)
    first[v] = table.findOrInsert(positions[v], v);
  return first;
}

/// Items grouped by a key in [0, keys), by a stable counting sort.
struct Buckets {
  std::vector<std::size_t> begin;    ///< start of each group, keys + 1 entries
  std::vector<std::uint32_t> items;  ///< grouped by key

  template <typename KeyOf>
  Buckets(std::size_t keys, std::size_t count, const KeyOf& keyOf)
      : begin(keys + 1, 0), items(count) {
    for (std::size_t i = 0; i < count; ++i) ++begin[keyOf(i) + 1];
    for (std::size_t k = 0; k < keys; ++k) begin[k + 1] += begin[k];
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    for (std::size_t i = 0; i < count; ++i) items[next[keyOf(i)]++] = static_cast<std::uint32_t>(i);
  }
};

/// Rotates the face so that its lowest vertex comes first. Equal faces of equal orientation become
/// equal triples.
Triangle canonical(const Triangle& t) {
  const std::size_t low =
      static_cast<std::size_t>(std::min_element(t.begin(), t.end()) - t.begin());
  return {t[low], t[(low + 1) % 3], t[(low + 2) % 3]};
}

/// Removes each face that has the same vertices and orientation as an earlier face.
std::vector<Triangle> withoutRepeated(const std::vector<Triangle>& triangles,
                                      std::size_t vertices) {
  const Buckets byVertex(vertices, triangles.size(),
                         [&](std::size_t i) { return canonical(triangles[i])[0]; });
  std::vector<bool> repeated(triangles.size(), false);
  std::vector<std::pair<Triangle, std::uint32_t>> row;
  for (std::size_t v = 0; v < vertices; ++v) {
    row.clear();
    for (std::size_t i = byVertex.begin[v]; i < byVertex.begin[v + 1]; ++i)
      row.emplace_back(canonical(triangles[byVertex.items[i]]), byVertex.items[i]);
    std::sort(row.begin(), row.end());
    for (std::size_t i = 1; i < row.size(); ++i)
      if (row[i].first == row[i - 1].first) repeated[row[i].second] = true;
  }
  std::vector<Triangle> kept;
  kept.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (!repeated[i]) kept.push_back(triangles[i]);
  return kept;
}

void countEdges(MeshTopology& topology, std::size_t vertices) {
  const std::vector<Triangle>& triangles = topology.triangles;
  const auto from = [&](std::size_t e) { return triangles[e / 3][e % 3]; };
  const auto to = [&](std::size_t e) { return triangles[e / 3][(e % 3 + 1) % 3]; };
  const Buckets byLow(vertices, triangles.size() * 3,
                      [&](std::size_t e) { return std::min(from(e), to(e)); });
  // Edges with the lower vertex v: the higher vertex, and +1 if the face runs from v to it, else
  // −1.
  std::vector<std::pair<std::uint32_t, int>> row;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    row.clear();
    for (std::size_t i = byLow.begin[v]; i < byLow.begin[v + 1]; ++i) {
      const std::size_t e = byLow.items[i];
      row.emplace_back(std::max(from(e), to(e)), from(e) == v ? 1 : -1);
    }
    std::sort(row.begin(), row.end());
    for (std::size_t i = 0; i < row.size();) {
      const std::uint32_t other = row[i].first;
      std::size_t faces = 0;
      int net = 0;
      for (; i < row.size() && row[i].first == other; ++i, ++faces) net += row[i].second;
      topology.boundaryEdges += faces == 1;
      topology.nonManifoldEdges += faces > 2;
      topology.oddEdges += faces % 2;
      if (net > 0) topology.boundary.push_back({v, other, net});
      if (net < 0) topology.boundary.push_back({other, v, -net});
    }
  }
}

}  // namespace

MeshTopology findTopology(const TriMesh& mesh) {
  const std::vector<std::uint32_t> first = weld(mesh.positions);
  MeshTopology topology;
  topology.triangles.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const Triangle w = {first[t[0]], first[t[1]], first[t[2]]};
    if (w[0] != w[1] && w[1] != w[2] && w[2] != w[0]) topology.triangles.push_back(w);
  }
  std::vector<Triangle> single = withoutRepeated(topology.triangles, mesh.positions.size());
  countEdges(topology, mesh.positions.size());
  if (single.size() < topology.triangles.size()) {
    MeshTopology other;
    other.triangles = std::move(single);
    countEdges(other, mesh.positions.size());
    // Decimated meshes may contain coincident faces that each close a sheet of their own. Removing
    // one of these faces would open the mesh, so then all repeated faces stay.
    if (other.boundary.size() <= topology.boundary.size() && other.oddEdges <= topology.oddEdges)
      topology = std::move(other);
  }
  topology.dropped = mesh.triangles.size() - topology.triangles.size();
  return topology;
}

}  // namespace levelset::convert
