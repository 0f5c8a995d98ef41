#include "levelset/adaptive/adaptive_to_mesh.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "levelset/adaptive/octree/adaptive_tree.h"
#include "levelset/adaptive/tricubic_to_trilinear.h"
#include "levelset/memory/memory_limit.h"

namespace levelset {
namespace {

using Imath::V3d;
using Imath::V3i;

// Least distance of a vertex from the ends of its edge, a share of its length: vertices at one
// corner would coincide.
constexpr double kEndMargin = 1e-4;

/// Names a vertex: an undivided edge by its lower end and axis, or a loop in a leaf.
using VertexKey = std::uint64_t;

VertexKey edgeKey(const V3i& low, int axis) {
  return static_cast<std::uint64_t>(low.x) | static_cast<std::uint64_t>(low.y) << 20 |
         static_cast<std::uint64_t>(low.z) << 40 | static_cast<std::uint64_t>(axis) << 60;
}
VertexKey loopKey(std::uint32_t block, int octant, int loop) {
  return std::uint64_t{1} << 63 | static_cast<std::uint64_t>(block) << 16 |
         static_cast<std::uint64_t>(octant) << 12 | static_cast<std::uint64_t>(loop);
}

struct Vertex {
  VertexKey key;
  V3d position;  ///< cells of level 0
};

/// Triangles of a range of blocks.
struct Piece {
  std::vector<Vertex> vertices;  ///< a key may come several times
  std::vector<std::array<VertexKey, 3>> triangles;
};

/// Corner of a leaf, or of a smaller one beside it.
struct Node {
  V3i at;
  bool isInside;
  double value;
};

class LeafMesher {
 public:
  LeafMesher(const AdaptiveTree& tree, Piece& piece)
      : tree_(tree), octree_(tree.octree), piece_(piece) {}
  void mesh(std::uint32_t block, int octant);

 private:
  /// Segment in a face of the leaf, with the inside on its right as seen from outside the leaf.
  struct Segment {
    std::size_t from, to;  ///< numbers of vertices of the leaf
  };
  struct LeafVertex {
    VertexKey key;
    V3d position;
    int faces;  ///< bits of the leaf's faces that hold it
  };
  [[nodiscard]] bool isCellSplit(const V3i& low, int level) const;
  [[nodiscard]] Node node(const V3i& at) const;
  void addFace(const V3i& low, int level, int axis, int side);
  void addEdgeNodes(const V3i& from, int axis, int direction, int level);
  void addSegments(const V3i& low, int level, int axis);
  [[nodiscard]] std::size_t vertexOn(const Node& a, const Node& b);
  void closeLoop(const std::vector<std::size_t>& loop, std::uint32_t block, int octant, int number);
  [[nodiscard]] V3d centreOf(const std::vector<std::size_t>& loop) const;

  const AdaptiveTree& tree_;
  const HashedOctree& octree_;
  Piece& piece_;
  CellKey leaf_;
  HashedOctree::Place place_{};
  std::vector<Node> ring_;  ///< boundary of a face, counter-clockwise as seen from outside the leaf
  std::vector<LeafVertex> vertices_;
  std::vector<Segment> segments_;
};

bool LeafMesher::isCellSplit(const V3i& low, int level) const {
  const int side = 1 << octree_.depth();
  if (level == 0 || low.x < 0 || low.y < 0 || low.z < 0 || low.x >= side || low.y >= side ||
      low.z >= side)
    return false;
  return octree_.isSplit({std::uint32_t(low.x), std::uint32_t(low.y), std::uint32_t(low.z), level});
}

/// Reads a value from a block that has the point as a corner. All such blocks have the same value.
Node LeafMesher::node(const V3i& at) const {
  const int depth = octree_.depth(), side = 1 << depth;
  int level = depth - 1;
  for (int axis = 0; axis < 3; ++axis)
    level = std::min(level, std::countr_zero(static_cast<unsigned>(at[axis])));
  for (int octant = 0; octant < 8; ++octant) {
    const V3i cell = at - V3i(octant & 1 ? 0 : 1, octant & 2 ? 0 : 1, octant & 4 ? 0 : 1);
    if (cell.x < 0 || cell.y < 0 || cell.z < 0 || cell.x >= side || cell.y >= side ||
        cell.z >= side)
      continue;
    const CellKey parent =
        CellKey{std::uint32_t(cell.x), std::uint32_t(cell.y), std::uint32_t(cell.z), 0}.ancestor(
            level + 1);
    const std::uint32_t block = octree_.block(parent);
    if (block == HashedOctree::kNone) continue;
    const V3i index = (at - parent.low()) / (1 << level);
    const double value =
        tree_.data.values[block][static_cast<std::size_t>(index.x + 3 * index.y + 9 * index.z)];
    return {at, value < 0, value};
  }
  return {at, false, 0};  // no cell has this corner
}

/// Adds the corners along an edge but its last one. Cells around the edge may divide it.
void LeafMesher::addEdgeNodes(const V3i& from, int axis, int direction, int level) {
  const int length = 1 << level;
  V3i low = from;
  if (direction < 0) low[axis] -= length;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  bool isDivided = false;
  for (int around = 0; around < 4 && !isDivided; ++around) {
    V3i cell = low;
    if (around & 1) cell[u] -= length;
    if (around & 2) cell[v] -= length;
    isDivided = isCellSplit(cell, level);
  }
  if (!isDivided) {
    ring_.push_back(node(from));
    return;
  }
  V3i middle = from;
  middle[axis] += direction * length / 2;
  addEdgeNodes(from, axis, direction, level - 1);
  addEdgeNodes(middle, axis, direction, level - 1);
}

/// Adds the segments in a face of the leaf, or in the faces of smaller cells that divide it.
/// @param low   lowest corner of the face
/// @param side  0 for the lower face of the leaf, 1 for the upper one
void LeafMesher::addFace(const V3i& low, int level, int axis, int side) {
  const int length = 1 << level;
  V3i beside = low;
  if (side == 0) beside[axis] -= length;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (isCellSplit(beside, level)) {
    for (int quarter = 0; quarter < 4; ++quarter) {
      V3i at = low;
      if (quarter & 1) at[u] += length / 2;
      if (quarter & 2) at[v] += length / 2;
      addFace(at, level - 1, axis, side);
    }
    return;
  }
  // Counter-clockwise from outside: u before v on an upper face.
  const int first = side == 1 ? u : v, second = side == 1 ? v : u;
  V3i at = low;
  ring_.clear();
  for (const auto& [along, direction] :
       {std::pair(first, 1), std::pair(second, 1), std::pair(first, -1), std::pair(second, -1)}) {
    addEdgeNodes(at, along, direction, level);
    at[along] += direction * length;
  }
  addSegments(low, level, axis);
}

/// Joins the vertices on the boundary of a face. Where the inside touches the boundary in several
/// runs, the value at the centre decides whether they are joined.
void LeafMesher::addSegments(const V3i& low, int level, int axis) {
  struct Change {
    std::size_t vertex;
    bool enters;  ///< into the solid
  };
  static thread_local std::vector<Change> changes;
  changes.clear();
  for (std::size_t i = 0; i < ring_.size(); ++i) {
    const Node &a = ring_[i], &b = ring_[(i + 1) % ring_.size()];
    if (a.isInside != b.isInside) changes.push_back({vertexOn(a, b), b.isInside});
  }
  const std::size_t count = changes.size();
  if (count == 0) return;
  bool joinsInside = false;
  if (count > 2) {
    const int length = 1 << level, u = (axis + 1) % 3, v = (axis + 2) % 3;
    double sum = 0;
    for (int corner = 0; corner < 4; ++corner) {
      V3i at = low;
      if (corner & 1) at[u] += length;
      if (corner & 2) at[v] += length;
      sum += node(at).value;
    }
    joinsInside = sum < 0;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (!changes[i].enters) continue;
    const std::size_t other = joinsInside ? (i + count - 1) % count : (i + 1) % count;
    segments_.push_back({changes[i].vertex, changes[other].vertex});
  }
}

std::size_t LeafMesher::vertexOn(const Node& a, const Node& b) {
  const Node &low = a.at.x + a.at.y + a.at.z < b.at.x + b.at.y + b.at.z ? a : b,
             &high = &low == &a ? b : a;
  const int axis = low.at.x != high.at.x ? 0 : low.at.y != high.at.y ? 1 : 2;
  const VertexKey key = edgeKey(low.at, axis);
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    if (vertices_[i].key == key) return i;
  const double share = std::clamp(low.value / (low.value - high.value), kEndMargin, 1 - kEndMargin);
  V3d position = V3d(low.at);
  position[axis] += share * (high.at[axis] - low.at[axis]);
  int faces = 0;
  for (int k = 0; k < 3; ++k) {
    if (k == axis) continue;
    if (low.at[k] == leaf_.low()[k]) faces |= 1 << (2 * k);
    if (low.at[k] == leaf_.low()[k] + static_cast<int>(leaf_.edge())) faces |= 2 << (2 * k);
  }
  vertices_.push_back({key, position, faces});
  return vertices_.size() - 1;
}

/// Moves the mean of the vertices of a loop onto the zero set of the leaf's interpolant.
V3d LeafMesher::centreOf(const std::vector<std::size_t>& loop) const {
  V3d sum(0);
  for (const std::size_t v : loop) sum += vertices_[v].position;
  const double edge = leaf_.edge();
  V3d at = (sum / double(loop.size()) - V3d(leaf_.low())) / edge;
  const LeafInterpolant leaf = tree_.interpolant(place_);
  constexpr int kSteps = 4;
  for (int step = 0; step < kSteps; ++step) {
    const V3d slope = leaf.slope(at);
    if (!(slope.length2() > 0)) break;
    at -= slope * (leaf.value(at) / slope.length2());
    constexpr double kMargin = 0.02;  // a vertex in a face could coincide with one of the neighbour
    for (int axis = 0; axis < 3; ++axis) at[axis] = std::clamp(at[axis], kMargin, 1 - kMargin);
  }
  return V3d(leaf_.low()) + at * edge;
}

/// Fills a loop with triangles. A diagonal in a face of the leaf could also be one of the leaf
/// beside it: four triangles would share it. Such loops get a vertex in the middle.
void LeafMesher::closeLoop(const std::vector<std::size_t>& loop, std::uint32_t block, int octant,
                           int number) {
  const std::size_t count = loop.size();
  const auto at = [&](std::size_t i) -> const LeafVertex& { return vertices_[loop[i % count]]; };
  std::size_t best = count;
  double shortest = INFINITY;
  constexpr std::size_t kLargestFan = 6;
  for (std::size_t start = 0; start < count && count <= kLargestFan; ++start) {
    double longest = 0;
    bool isAllowed = true;
    for (std::size_t k = 2; k + 1 < count; ++k) {
      const LeafVertex &a = at(start), &b = at(start + k);
      isAllowed = isAllowed && (a.faces & b.faces) == 0;
      longest = std::max(longest, (a.position - b.position).length2());
    }
    if (isAllowed && longest < shortest) {
      shortest = longest;
      best = start;
    }
  }
  if (best < count) {
    for (std::size_t k = 1; k + 1 < count; ++k)
      piece_.triangles.push_back({at(best).key, at(best + k).key, at(best + k + 1).key});
    return;
  }
  const VertexKey centre = loopKey(block, octant, number);
  piece_.vertices.push_back({centre, centreOf(loop)});
  for (std::size_t k = 0; k < count; ++k)
    piece_.triangles.push_back({centre, at(k).key, at(k + 1).key});
}

void LeafMesher::mesh(std::uint32_t block, int octant) {
  const CellKey leaf = octree_.parent(block).child(octant);
  int inside = 0;
  for (int corner = 0; corner < 8; ++corner) inside += tree_.corner(block, octant, corner) < 0;
  if (inside == 0 || inside == 8 || octree_.isSplit(leaf)) return;
  leaf_ = leaf;
  place_ = {leaf, block};
  vertices_.clear();
  segments_.clear();
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      V3i low = leaf.low();
      if (side == 1) low[axis] += static_cast<int>(leaf.edge());
      addFace(low, leaf.level, axis, side);
    }
  constexpr std::size_t kNone = ~std::size_t{0};
  std::vector<std::size_t> next(vertices_.size(), kNone);
  for (const Segment& s : segments_) next[s.from] = s.to;
  std::vector<std::size_t> loop;
  int number = 0;
  for (std::size_t first = 0; first < next.size(); ++first) {
    if (next[first] == kNone) continue;
    loop.clear();
    for (std::size_t v = first; next[v] != kNone;) {
      loop.push_back(v);
      v = std::exchange(next[v], kNone);
    }
    closeLoop(loop, block, octant, number++);
  }
  for (const LeafVertex& v : vertices_) piece_.vertices.push_back({v.key, v.position});
}

}  // namespace

TriMesh adaptiveToMesh(const AdaptiveField& field, const AdaptiveToMeshOptions& options) {
  TriMesh mesh;
  report(options.progress, 0);
  if (field.isEmpty()) return mesh;
  if (field.isTricubic())
    return adaptiveToMesh(
        trilinearSurface(field, options.maxMemory, subProgress(options.progress, 0, 0.5)),
        {.maxMemory = options.maxMemory, .progress = subProgress(options.progress, 0.5, 1)});
  const AdaptiveTree& tree = *field.shared();
  constexpr std::uint32_t kBlocks = 1024;
  const auto blocks = static_cast<std::uint32_t>(tree.octree.blockCount());
  // A crossing leaf has about five triangles and shared vertices.
  std::atomic<std::size_t> crossing = 0;
  tbb::parallel_for(std::uint32_t{0}, blocks, [&](std::uint32_t block) {
    const auto [low, high] =
        std::minmax_element(tree.data.values[block].begin(), tree.data.values[block].end());
    if (*low < 0 && *high >= 0) crossing += 8;
  });
  constexpr double kBytesPerLeaf = 500;
  requireMemory(kBytesPerLeaf * double(crossing), memoryLimit(options.maxMemory));
  report(options.progress, 0.1);
  std::vector<Piece> pieces((blocks + kBlocks - 1) / kBlocks);
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t n) {
    LeafMesher mesher(tree, pieces[n]);
    const auto first = static_cast<std::uint32_t>(n) * kBlocks;
    for (std::uint32_t block = first; block < std::min(blocks, first + kBlocks); ++block)
      for (int octant = 0; octant < 8; ++octant) mesher.mesh(block, octant);
  });
  report(options.progress, 0.6);

  // === Numbers of the vertices
  std::size_t vertexCount = 0, triangleCount = 0;
  for (const Piece& piece : pieces) {
    vertexCount += piece.vertices.size();
    triangleCount += piece.triangles.size();
  }
  std::vector<Vertex> vertices;
  vertices.reserve(vertexCount);
  for (Piece& piece : pieces) {
    vertices.insert(vertices.end(), piece.vertices.begin(), piece.vertices.end());
    std::vector<Vertex>().swap(piece.vertices);
  }
  const auto before = [](const Vertex& a, const Vertex& b) { return a.key < b.key; };
  tbb::parallel_sort(vertices.begin(), vertices.end(), before);
  const auto isSame = [](const Vertex& a, const Vertex& b) { return a.key == b.key; };
  vertices.erase(std::unique(vertices.begin(), vertices.end(), isSame), vertices.end());
  mesh.positions.reserve(vertices.size());
  for (const Vertex& v : vertices) mesh.positions.push_back(tree.origin + v.position * tree.unit);
  report(options.progress, 0.8);
  mesh.triangles.resize(triangleCount);
  std::vector<std::size_t> starts(1, 0);
  for (const Piece& piece : pieces) starts.push_back(starts.back() + piece.triangles.size());
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t n) {
    for (std::size_t t = 0; t < pieces[n].triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto found = std::lower_bound(vertices.begin(), vertices.end(),
                                            Vertex{pieces[n].triangles[t][k], {}}, before);
        mesh.triangles[starts[n] + t][k] = static_cast<std::uint32_t>(found - vertices.begin());
      }
  });
  report(options.progress, 1);
  return mesh;
}

}  // namespace levelset
