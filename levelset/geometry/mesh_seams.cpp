#include <algorithm>
#include <optional>
#include <tuple>

#include "levelset/geometry/disjoint_sets.h"
#include "levelset/geometry/position_table.h"
#include "levelset/mesh.h"
#include "levelset/progress.h"

namespace levelset {
namespace {

/// Returns true when two vertices have equal positions. Otherwise the mesh has no seam to close,
/// and the edges need not be sorted.
bool anyCoincide(const std::vector<Imath::V3d>& positions) {
  convert::PositionTable table(positions, positions.size());
  for (std::uint32_t v = 0; v < positions.size(); ++v)
    if (table.findOrInsert(positions[v], v) != v) return true;
  return false;
}

/// Border edge: an edge with only one triangle.
struct BorderSide {
  /// For each end, the vertex that represents all border vertices at its position; low ≤ high.
  std::uint32_t low, high;
  std::uint32_t atLow, atHigh;  ///< vertices of the triangle itself at these ends
  bool rises;                   ///< the triangle runs along the edge from low to high
};

/// Finds the edges with a single triangle, in triangle order.
std::vector<BorderSide> findBorder(const TriMesh& mesh) {
  struct Side {
    std::uint32_t low, high;
    std::size_t number;
  };
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::size_t n = 0; n < 3 * mesh.triangles.size(); ++n) {
    const auto& t = mesh.triangles[n / 3];
    const auto [low, high] = std::minmax({t[n % 3], t[(n % 3 + 1) % 3]});
    sides.push_back({low, high, n});
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.number) < std::tie(b.low, b.high, b.number);
  });
  std::vector<std::size_t> alone;
  for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
    for (end = i + 1;
         end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high;)
      ++end;
    if (end == i + 1 && sides[i].low != sides[i].high) alone.push_back(sides[i].number);
  }
  std::sort(alone.begin(), alone.end());
  std::vector<BorderSide> border;
  border.reserve(alone.size());
  for (const std::size_t n : alone) {
    const auto& t = mesh.triangles[n / 3];
    border.push_back({0, 0, t[n % 3], t[(n % 3 + 1) % 3], true});
  }
  return border;
}

/// Sets the representatives of the ends of border edges: border vertices at equal positions get the
/// same one. Vertices off the border do not take part, so surface components that merely touch keep
/// their own vertices.
void findEndVertices(const std::vector<Imath::V3d>& positions, std::vector<BorderSide>& border) {
  convert::PositionTable table(positions, border.size());
  for (BorderSide& side : border) {
    side.low = table.findOrInsert(positions[side.atLow], side.atLow);
    side.high = table.findOrInsert(positions[side.atHigh], side.atHigh);
    if (side.low <= side.high) continue;
    std::swap(side.low, side.high);
    std::swap(side.atLow, side.atHigh);
    side.rises = false;
  }
}

void join(DisjointSets& vertices, const BorderSide& a, const BorderSide& b) {
  vertices.join(a.atLow, b.atLow);
  vertices.join(a.atHigh, b.atHigh);
}

/// Joins border edges at equal positions. In triangle order, edges that run in opposite directions
/// are paired like brackets. The triangles of one surface component are consecutive in a mesh, so
/// two components that share an edge stay separate. The unpaired edges are joined to the first
/// edge at their position. Three faces at an edge, or two of opposite orientation, thus share one
/// edge, as in a mesh without seams.
void joinSides(const std::vector<BorderSide>& border, DisjointSets& vertices) {
  std::vector<std::size_t> order(border.size()), open;
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tie(border[a].low, border[a].high, a) < std::tie(border[b].low, border[b].high, b);
  });
  for (std::size_t i = 0, end = 0; i < order.size(); i = end) {
    const BorderSide& first = border[order[i]];
    open.clear();
    for (end = i; end < order.size(); ++end) {
      const BorderSide& side = border[order[end]];
      if (side.low != first.low || side.high != first.high) break;
      if (!open.empty() && border[open.back()].rises != side.rises) {
        join(vertices, border[open.back()], side);
        open.pop_back();
      } else {
        open.push_back(order[end]);
      }
    }
    if (end == i + 1) continue;
    for (const std::size_t left : open) join(vertices, first, border[left]);
  }
}

/// Removes the vertices that another vertex represents, and the triangles that have become
/// degenerate.
TriMesh withJoined(const TriMesh& mesh, DisjointSets& vertices) {
  TriMesh joined;
  joined.precision = mesh.precision;
  joined.spacing = mesh.spacing;
  std::vector<std::uint32_t> number(mesh.positions.size());
  for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
    const std::uint32_t first = vertices.find(v);
    if (first == v) {
      number[v] = static_cast<std::uint32_t>(joined.positions.size());
      joined.positions.push_back(mesh.positions[v]);
    } else {
      number[v] = number[first];
    }
  }
  joined.triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const bool wasLine = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    const std::array<std::uint32_t, 3> w = {number[t[0]], number[t[1]], number[t[2]]};
    if (wasLine || (w[0] != w[1] && w[1] != w[2] && w[2] != w[0])) joined.triangles.push_back(w);
  }
  return joined;
}

}  // namespace

std::optional<TriMesh> withoutSeams(const TriMesh& mesh, std::size_t maxMemory) {
  const auto triangles = static_cast<double>(mesh.triangles.size()),
             vertices = static_cast<double>(mesh.positions.size());
  constexpr double kTableBytes = 16, kSideBytes = 16 + 8;
  requireMemory(vertices * kTableBytes, maxMemory);
  if (!anyCoincide(mesh.positions)) return std::nullopt;
  requireMemory(triangles * 3 * kSideBytes, maxMemory);
  std::vector<BorderSide> border = findBorder(mesh);
  if (border.empty()) return std::nullopt;
  // Bytes of the border edges, their order and their position table; then of the resulting mesh.
  constexpr double kBorderBytes = sizeof(BorderSide) + 2 * 8 + kTableBytes;
  requireMemory(static_cast<double>(border.size()) * kBorderBytes + triangles * 12 + vertices * 32,
                maxMemory);
  findEndVertices(mesh.positions, border);
  DisjointSets joined(mesh.positions.size());
  joinSides(border, joined);
  return withJoined(mesh, joined);
}

}  // namespace levelset
