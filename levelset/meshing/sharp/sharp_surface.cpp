#include "levelset/meshing/sharp/sharp_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "levelset/meshing/sharp/sharp_vertices.h"
#include "levelset/progress_gate.h"

namespace levelset {
namespace {

using Eigen::Vector3d;
using openvdb::Coord;
using openvdb::FloatGrid;

/// Largest distance of a vertex without sheets from a neighbour's sheet that it adopts, and from
/// the intersection of the adopted sheets, voxels.
constexpr double kAdoptReach = 1.25;
/// A vertex that adopts sheets does not move to a point within this distance of another vertex,
/// voxels.
constexpr double kApart = 0.05;
/// Diagonals of a quadrilateral whose sheetGap differs by less, voxels, are equally good.
constexpr double kSameGap = 0.02;

openvdb::Vec3d toIndex(const Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}

/// Returns, for each polygon of a cell, the faces of the cell that it passes twice, with two
/// segments on the face: bit axis·2 + side.
std::array<std::uint8_t, 4> facesPassedTwice(const CellCase& cell) {
  std::array<std::uint8_t, 4> result = {};
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      std::array<int, 4> count = {};
      for (int edge = 0; edge < 12; ++edge) {
        const std::int8_t cycle = cell.cycleOfEdge[static_cast<std::size_t>(edge)];
        if (cycle < 0 || edgeAxis(edge) == axis) continue;
        if (edgeOffset(edge)[static_cast<std::size_t>(axis)] == side) {
          ++count[static_cast<std::uint8_t>(cycle)];
        }
      }
      for (std::size_t cycle = 0; cycle < 4; ++cycle) {
        if (count[cycle] == 4) result[cycle] |= static_cast<std::uint8_t>(1 << (axis * 2 + side));
      }
    }
  }
  return result;
}

/// Segment of a polygon on a cell face that the polygons of both adjacent cells pass twice. The two
/// segments on the face would yield the same mesh edge between both cells, so each gets a vertex of
/// its own.
struct FaceSegment {
  Coord insideCorner;    ///< grid point inside the solid that the segment cuts off
  Coord oppositeCorner;  ///< grid point at the opposite corner of the cell face
  friend bool operator<(const FaceSegment& a, const FaceSegment& b) {
    return std::tie(a.insideCorner, a.oppositeCorner) < std::tie(b.insideCorner, b.oppositeCorner);
  }
  friend bool operator==(const FaceSegment& a, const FaceSegment& b) {
    return a.insideCorner == b.insideCorner && a.oppositeCorner == b.oppositeCorner;
  }
};

/// Slots of the four cells around a crossed grid edge, counter-clockwise about its axis. The two
/// bits of a slot are the offsets of the edge in the cell along axis + 1 (high) and axis + 2 (low),
/// as in cell_table.h. kRingStep is the axis along which a cell differs from the next one (0: axis
/// + 1, 1: axis + 2).
constexpr std::array<unsigned, 4> kRing = {0, 2, 3, 1};
constexpr std::array<int, 4> kRingStep = {0, 1, 0, 1};

constexpr std::uint32_t kNoPolygon = 0xffffffffu;
constexpr std::array<std::uint32_t, 4> kNoPolygons = {kNoPolygon, kNoPolygon, kNoPolygon,
                                                      kNoPolygon};

class DualMesher {
 public:
  DualMesher(const CellSurface& surface, const FloatGrid& grid, const Progress& progress)
      : surface_(surface), grid_(grid), progress_(progress) {}

  SharpMesh run() {
    vertices_.resize(surface_.cycleCount());
    twice_.resize(surface_.cycleCount());
    cells_.resize(surface_.vertexCount(), kNoPolygons);
    const Progress placed = subProgress(progress_, 0, 0.4);
    ProgressGate gate(placed, surface_.blocks().size());
    forEachBlock([&](const SurfaceBlock& block) {
      placeBlock(block);
      gate.advance(1);
    });
    collectSegments();
    report(progress_, 0.4);
    adoptSheets();
    report(progress_, 0.45);
    SharpMesh mesh = assemble();
    std::vector<SheetQuality> quality(mesh.positions.size());
    for (std::size_t i = 0; i < vertices_.size(); ++i)
      quality[i] = {vertices_[i].misfit, vertices_[i].bend};
    const std::vector<bool> isBeside =
        confirmFeatures(mesh, grid_, mesh.sheets, quality, subProgress(progress_, 0.5, 0.7));
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      const openvdb::Vec3d& p = mesh.positions[i];
      vertices_[i].position = isBeside[i] ? Vector3d(p[0], p[1], p[2]) : vertices_[i].smooth;
      vertices_[i].sheets = isBeside[i] ? mesh.sheets[i] : VertexSheets();
    }
    report(progress_, 0.7);
    mesh = {};  // releases its memory before the next mesh is made
    mesh = assemble();
    release();
    insertFeatures(mesh, mesh.sheets, subProgress(progress_, 0.75, 1));
    return mesh;
  }

 private:
  template <typename F>
  void forEachBlock(const F& run) const {
    const auto& blocks = surface_.blocks();
    tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
      if (blocks[i].vertexCount || blocks[i].cycleCount) run(blocks[i]);
    });
  }

  void placeBlock(const SurfaceBlock& block) {
    static const std::array<std::array<std::uint8_t, 4>, 256> twiceTable = [] {
      std::array<std::array<std::uint8_t, 4>, 256> table;
      for (std::size_t i = 0; i < 256; ++i) table[i] = facesPassedTwice(cellTable()[i]);
      return table;
    }();
    if (!block.cycleCount) return;
    VertexPlacer placer(grid_, block.origin);
    std::size_t cycle = block.firstCycle;
    const Vector3d origin(block.origin.x(), block.origin.y(), block.origin.z());
    surface_.forEachCell(block, [&](int x, int y, int z, unsigned pattern) {
      const CellCase& cell = cellTable()[pattern];
      const std::uint8_t* edges = cell.cycleEdges.data();
      for (std::size_t i = 0; i < cell.cycleCount; edges += cell.cycleLength[i++], ++cycle) {
        vertices_[cycle] = placer.place(x, y, z, edges, cell.cycleLength[i]);
        vertices_[cycle].position += origin;
        vertices_[cycle].smooth += origin;
        twice_[cycle] = twiceTable[pattern][i];
        for (std::size_t k = 0; k < cell.cycleLength[i]; ++k) {
          const std::uint32_t crossing = surface_.vertexOf(block, x, y, z, edges[k]);
          cells_[crossing][edges[k] & 3u] = static_cast<std::uint32_t>(cycle);
        }
      }
    });
  }

  /// Returns true when all cells around a crossed edge belong to the surface. Other edges get no
  /// quadrilateral.
  [[nodiscard]] static bool isComplete(const std::array<std::uint32_t, 4>& cells) {
    return std::find(cells.begin(), cells.end(), kNoPolygon) == cells.end();
  }

  /// Returns true when the side of the quadrilateral from slot kRing[i] to the next one lies on a
  /// cell face that the polygons of both adjacent cells pass twice.
  [[nodiscard]] bool isDoubled(const std::array<std::uint32_t, 4>& cells, int axis,
                               std::size_t i) const {
    const int step = (axis + 1 + kRingStep[i]) % 3;
    const unsigned from = kRing[i], to = kRing[(i + 1) % 4];
    // The cell in which the edge has the larger offset lies lower; its upper face is shared.
    const unsigned bit = kRingStep[i] == 0 ? 2 : 1;
    const std::uint32_t lower = cells[from & bit ? from : to],
                        upper = cells[from & bit ? to : from];
    return (twice_[lower] >> (step * 2 + 1)) & (twice_[upper] >> (step * 2)) & 1;
  }

  /// Returns the segment on the face between the cells in the slots kRing[i] and kRing[i + 1]. The
  /// crossed grid edge that starts at `low` has the same offset along the second axis of the face
  /// in both cells. This offset gives the side of the edge on which the face lies.
  [[nodiscard]] static FaceSegment segmentAt(const Coord& low, int axis, bool lowInside,
                                             std::size_t i) {
    const int other = (axis + 2 - kRingStep[i]) % 3;  // second axis of the face, beside `axis`
    const unsigned bit = kRingStep[i] == 0 ? 1 : 2;
    Coord high = low;
    high[axis] += 1;
    FaceSegment segment;
    segment.insideCorner = lowInside ? low : high;
    segment.oppositeCorner = lowInside ? high : low;
    segment.oppositeCorner[other] += kRing[i] & bit ? -1 : 1;
    return segment;
  }

  /// Gives vertices without sheets the sheets of their neighbours. A cell beside a corner may have
  /// no grid point whose values belong to one face of the solid. Its vertex then moves to the
  /// intersection of the neighbours' sheets.
  void adoptSheets() {
    std::vector<bool> isWithout(vertices_.size());
    std::vector<std::uint32_t> without;
    for (std::uint32_t v = 0; v < vertices_.size(); ++v)
      if (!vertices_[v].sheets.count) isWithout[v] = true, without.push_back(v);
    if (without.empty()) return;
    std::vector<std::vector<std::uint32_t>> around(without.size());
    for (const auto& cells : cells_)
      for (const std::uint32_t v : cells) {
        if (v == kNoPolygon || !isWithout[v]) continue;
        const auto slot = std::lower_bound(without.begin(), without.end(), v) - without.begin();
        auto& list = around[static_cast<std::size_t>(slot)];
        list.insert(list.end(), cells.begin(), cells.end());
      }
    for (std::size_t i = 0; i < without.size(); ++i) adoptFrom(around[i], vertices_[without[i]]);
  }

  void adoptFrom(const std::vector<std::uint32_t>& around, DualVertex& vertex) const {
    std::vector<FacePlane> planes;
    for (const std::uint32_t v : around) {
      if (v == kNoPolygon) continue;
      const DualVertex& other = vertices_[v];
      for (std::size_t i = 0; i < other.sheets.count; ++i) {
        const openvdb::Vec3f& n = other.sheets.normal[i];
        const Vector3d normal = Eigen::Vector3f(n[0], n[1], n[2]).cast<double>();
        const FacePlane plane{normal, normal.dot(other.position), 0};
        if (std::abs(plane.above(vertex.position)) < kAdoptReach) planes.push_back(plane);
      }
    }
    if (planes.empty()) return;
    const Vector3d fitted = fitPlanes(planes, vertex.position);
    const auto isTaken = [&](std::uint32_t v) {
      return v != kNoPolygon && &vertices_[v] != &vertex &&
             (vertices_[v].position - fitted).norm() < kApart;
    };
    if ((fitted - vertex.position).norm() > kAdoptReach ||
        std::any_of(around.begin(), around.end(), isTaken))
      return;
    vertex.position = fitted;
    vertex.sheets = sheetsAt(fitted, planes);
    vertex.misfit = 0;
    for (const FacePlane& plane : planes)
      vertex.misfit = std::max(vertex.misfit, std::abs(plane.above(fitted)));
  }

  [[nodiscard]] SharpMesh assemble() const {
    SharpMesh mesh;
    mesh.positions.reserve(vertices_.size() + segments_.size());
    for (const DualVertex& v : vertices_) mesh.positions.push_back(toIndex(v.position));
    for (const FaceSegment& segment : segments_) mesh.positions.push_back(middle(segment));
    mesh.sheets.resize(mesh.positions.size());
    for (std::size_t i = 0; i < vertices_.size(); ++i) mesh.sheets[i] = vertices_[i].sheets;
    emit(mesh);
    return mesh;
  }

  /// Calls visit(number, lower end, axis, true if the lower end is inside) for each crossed edge
  /// whose four cells all belong to the surface.
  template <typename Visit>
  void forEachCrossing(const SurfaceBlock& block, const Visit& visit) const {
    std::size_t vertex = block.firstVertex;
    CellSurface::forEachVertex(block, [&](int x, int y, int z, int axis) {
      const std::size_t number = vertex++;
      if (!isComplete(cells_[number])) return;
      const bool lowInside = block.value(x * 64 + y * 8 + z) < 0;
      visit(number, block.origin.offsetBy(x, y, z), axis, lowInside);
    });
  }

  /// Frees what insertFeatures() does not need.
  void release() {
    std::vector<DualVertex>().swap(vertices_);
    std::vector<std::uint8_t>().swap(twice_);
    std::vector<std::array<std::uint32_t, 4>>().swap(cells_);
    std::vector<FaceSegment>().swap(segments_);
  }

  void collectSegments() {
    std::vector<std::vector<FaceSegment>> found(surface_.blocks().size());
    std::vector<std::size_t> triangles(surface_.blocks().size());
    forEachBlock([&](const SurfaceBlock& block) {
      const std::size_t index = block.neighbour[0];
      forEachCrossing(block, [&](std::size_t v, const Coord& low, int axis, bool lowInside) {
        triangles[index] += 2;
        for (std::size_t i = 0; i < 4; ++i) {
          if (!isDoubled(cells_[v], axis, i)) continue;
          found[index].push_back(segmentAt(low, axis, lowInside, i));
          ++triangles[index];
        }
      });
    });
    firstTriangle_.assign(found.size() + 1, 0);
    for (std::size_t i = 0; i < found.size(); ++i) {
      segments_.insert(segments_.end(), found[i].begin(), found[i].end());
      firstTriangle_[i + 1] = firstTriangle_[i] + triangles[i];
    }
    std::sort(segments_.begin(), segments_.end());
    segments_.erase(std::unique(segments_.begin(), segments_.end()), segments_.end());
  }

  /// Returns the midpoint between the zero crossings on the two edges of the face that meet at the
  /// segment's inside corner.
  [[nodiscard]] openvdb::Vec3d middle(const FaceSegment& segment) const {
    const openvdb::FloatTree& tree = grid_.tree();
    const double own = static_cast<double>(tree.getValue(segment.insideCorner));
    openvdb::Vec3d result = segment.insideCorner.asVec3d();
    for (int axis = 0; axis < 3; ++axis) {
      const int step = segment.oppositeCorner[axis] - segment.insideCorner[axis];
      if (!step) continue;
      Coord beyond = segment.insideCorner;
      beyond[axis] += step;
      const double other = static_cast<double>(tree.getValue(beyond));
      const double t = std::clamp(own / (own - other), 1e-3, 1 - 1e-3);
      result[axis] += step * t / 2;
    }
    return result;
  }

  void emit(IndexMesh& mesh) const {
    mesh.triangles.resize(firstTriangle_.back());
    forEachBlock([&](const SurfaceBlock& block) {
      std::size_t next = firstTriangle_[block.neighbour[0]];
      std::vector<std::uint32_t> polygon;
      forEachCrossing(block, [&](std::size_t v, const Coord& low, int axis, bool lowInside) {
        polygon.clear();
        std::size_t start = 0;
        for (std::size_t i = 0; i < 4; ++i) {
          polygon.push_back(cells_[v][kRing[i]]);
          if (!isDoubled(cells_[v], axis, i)) continue;
          const auto found = std::lower_bound(segments_.begin(), segments_.end(),
                                              segmentAt(low, axis, lowInside, i));
          start = polygon.size();
          polygon.push_back(static_cast<std::uint32_t>(vertices_.size()) +
                            static_cast<std::uint32_t>(found - segments_.begin()));
        }
        if (polygon.size() == 4) start = firstOfDiagonal(polygon);
        for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
          std::uint32_t b = polygon[(start + i) % polygon.size()];
          std::uint32_t c = polygon[(start + i + 1) % polygon.size()];
          if (!lowInside) std::swap(b, c);
          mesh.triangles[next++] = {polygon[start], b, c};
        }
      });
    });
  }

  /// Returns the index (0 or 1) of the vertex at which the better diagonal of a quadrilateral
  /// starts. The better diagonal does not cut across an edge of the solid; if this does not decide,
  /// it is the shorter one.
  [[nodiscard]] std::size_t firstOfDiagonal(const std::vector<std::uint32_t>& quad) const {
    const auto gap = [&](std::size_t i) {
      const DualVertex &a = vertices_[quad[i]], &b = vertices_[quad[i + 2]];
      return sheetGap(toIndex(a.position), a.sheets, toIndex(b.position), b.sheets);
    };
    const double first = gap(0), second = gap(1);
    if (std::abs(first - second) > kSameGap) return first < second ? 0 : 1;
    const auto length = [&](std::size_t i) {
      return (vertices_[quad[i]].position - vertices_[quad[i + 2]].position).squaredNorm();
    };
    return length(0) <= length(1) ? 0 : 1;
  }

  const CellSurface& surface_;
  const FloatGrid& grid_;
  const Progress& progress_;
  std::vector<DualVertex> vertices_;  ///< one for each polygon of a cell
  std::vector<std::uint8_t> twice_;   ///< facesPassedTwice() of each polygon
  /// Polygons around each crossed edge, by slot; kNoPolygon where the cell does not belong to the
  /// surface.
  std::vector<std::array<std::uint32_t, 4>> cells_;
  std::vector<FaceSegment> segments_;
  std::vector<std::size_t> firstTriangle_;
};

}  // namespace

SharpMesh sharpSurface(const CellSurface& surface, const FloatGrid& grid,
                       const Progress& progress) {
  return DualMesher(surface, grid, progress).run();
}

}  // namespace levelset
