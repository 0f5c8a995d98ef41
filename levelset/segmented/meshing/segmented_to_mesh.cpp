#include "levelset/segmented/meshing/segmented_to_mesh.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress_gate.h"
#include "levelset/segmented/local/cut_tetrahedron.h"
#include "levelset/segmented/local/kuhn_cell.h"
#include "levelset/segmented/local/orient_sheets.h"
#include "levelset/segmented/meshing/cell_crossings_vdb.h"
#include "levelset/segmented/meshing/sharpen_junctions.h"
#include "levelset/segmented/meshing/sheet_places_vdb.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {
namespace {

using Imath::V3d;
using Imath::V3i;
using openvdb::Coord;

/// Block of cells, with the vertices of their lowest corners.
struct MeshBlock {
  Coord block;
  bool isCut = true;                ///< false: only owns vertices of other blocks
  std::vector<std::uint16_t> keys;  ///< one for each vertex: voxel × 32 + slot, ascending
  std::size_t firstVertex = 0, firstTriangle = 0, firstJunction = 0;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<TriangleSides> sides;
  std::vector<JunctionEdge> junctions;
  std::vector<std::array<std::uint32_t, 2>> rims;
  std::vector<std::uint32_t> strips;  ///< by triangle of the block
  std::vector<std::uint32_t> points;
};

/// Labels of the corners of the cells of a block.
struct CellLabels {
  static constexpr int kSide = 9;
  std::array<RegionLabel, kSide * kSide * kSide> labels;
  bool isUniform = true;

  CellLabels(SegmentedReader& reader, const Coord& origin) {
    std::size_t n = 0;
    for (int x = 0; x < kSide; ++x)
      for (int y = 0; y < kSide; ++y)
        for (int z = 0; z < kSide; ++z, ++n) {
          labels[n] = reader.label(origin.offsetBy(x, y, z));
          isUniform = isUniform && labels[n] == labels[0];
        }
  }
  /// @return false if all corners have one label
  bool cell(std::uint32_t voxel, std::array<RegionLabel, 8>& corners) const {
    const Coord at = SegmentedData::localOf(voxel);
    bool isMixed = false;
    for (kuhn::Corner c = 0; c < 8; ++c) {
      const Coord p = at + cornerOffset(c);
      corners[c] = labels[static_cast<std::size_t>((p[0] * kSide + p[1]) * kSide + p[2])];
      isMixed = isMixed || corners[c] != corners[0];
    }
    return isMixed;
  }
};

bool allDiffer(RegionLabel a, RegionLabel b, RegionLabel c) {
  return a != b && b != c && c != a;
}
bool allDiffer(const std::array<RegionLabel, 4>& l) {
  return allDiffer(l[0], l[1], l[2]) && l[3] != l[0] && l[3] != l[1] && l[3] != l[2];
}

class SegmentedMesher {
 public:
  /// @param region  empty: all regions; else only blocks near this one are cut
  SegmentedMesher(const SegmentedData& data, const SegmentedMeshOptions& options,
                  std::optional<RegionLabel> region = {})
      : data_(data), options_(options), region_(region) {}

  SegmentedMesh run() {
    gatherBlocks();
    forEachBlock(0, 0.2, [&](MeshBlock& block) {
      data_.sheets ? findCrossings(block) : findVertices(block);
    });
    std::erase_if(blocks_, [](const MeshBlock& block) { return block.keys.empty(); });
    std::size_t vertices = 0;
    for (MeshBlock& block : blocks_) {
      block.firstVertex = vertices;
      vertices += block.keys.size();
    }
    // About two triangles for each vertex.
    requireMemory(static_cast<double>(vertices) * (sizeof(V3d) + 2 * 2 * 16),
                  memoryLeft(options_.maxMemory));
    if (vertices > 0xffffffffu)
      throw ResourceLimit("the interfaces have more than 2^32 vertices; use larger voxels");
    result_.mesh.positions.resize(vertices);
    isDoubtful_.resize(vertices);
    forEachBlock(0.2, 0.4, [&](MeshBlock& block) {
      data_.sheets ? placeCrossings(block) : placeVertices(block);
    });
    forEachBlock(0.4, 0.7, [&](MeshBlock& block) {
      data_.sheets ? cutCrossedCells(block) : cutCells(block);
    });
    collect();
    // The points of junctions of a field with sheets are exact.
    if (data_.sheets)
      orient();
    else if (options_.sharpensJunctions)
      sharpenJunctions(data_, isDoubtful_, result_, subProgress(options_.progress, 0.7, 1));
    tbb::parallel_for(std::size_t{0}, vertices, [&](std::size_t v) {
      V3d& p = result_.mesh.positions[v];
      p = toImath(data_.transform->indexToWorld(toVdb(p)));
    });
    report(options_.progress, 1);
    return std::move(result_);
  }

 private:
  template <typename Work>
  void forEachBlock(double from, double to, const Work& work) {
    const Progress progress = subProgress(options_.progress, from, to);
    ProgressGate gate(progress, blocks_.size());
    tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t b) {
      work(blocks_[b]);
      gate.advance(1);
    });
  }

  /// Collects the stored blocks and the ones below them, whose cells reach into them. For one
  /// region adds the blocks above, which own vertices of these cells.
  void gatherBlocks() {
    std::vector<Coord> coords;
    for (std::size_t b = 0; b < data_.blockCount(); ++b) {
      if (region_ && !holds(b, *region_)) continue;
      const Coord at = SegmentedData::blockCoord(data_.blocks[b].origin);
      for (kuhn::Corner c = 0; c < 8; ++c) coords.push_back(at - cornerOffset(c));
    }
    sortUnique(coords);
    std::vector<Coord> owners = coords;
    if (region_) {
      for (const Coord& coord : coords)
        for (kuhn::Corner c = 1; c < 8; ++c) owners.push_back(coord + cornerOffset(c));
      sortUnique(owners);
    }
    for (const Coord& coord : owners) {
      blocks_.emplace_back();
      blocks_.back().block = coord;
      blocks_.back().isCut = std::binary_search(coords.begin(), coords.end(), coord);
    }
  }
  static void sortUnique(std::vector<Coord>& coords) {
    std::sort(coords.begin(), coords.end());
    coords.erase(std::unique(coords.begin(), coords.end()), coords.end());
  }

  /// Returns true if voxels of a block, or beside it, belong to a region.
  [[nodiscard]] bool holds(std::size_t block, RegionLabel region) const {
    const auto first = data_.palettes.begin() + data_.blocks[block].palette,
               last = data_.palettes.begin() + data_.blocks[block + 1].palette;
    return std::find(first, last, region) != last;
  }

  static Coord originOf(const MeshBlock& block) {
    return {block.block[0] << 3, block.block[1] << 3, block.block[2] << 3};
  }

  void findVertices(MeshBlock& block) const {
    SegmentedReader reader(data_);
    const CellLabels labels(reader, originOf(block));
    if (labels.isUniform) return;
    std::array<RegionLabel, 8> l;
    for (std::uint32_t voxel = 0; voxel < SegmentedData::kVoxels; ++voxel) {
      if (!labels.cell(voxel, l)) continue;
      const auto add = [&](std::uint32_t slot) {
        block.keys.push_back(static_cast<std::uint16_t>(voxel * 32 + slot));
      };
      for (kuhn::Corner step = 1; step < 8; ++step)
        if (l[0] != l[step]) add(kuhn::edgeSlot(step));
      for (const kuhn::FaceSteps& face : kuhn::kFaces)
        if (allDiffer(l[0], l[face.middle], l[face.upper]))
          add(kuhn::faceSlot(face.middle, face.upper));
      for (std::size_t t = 0; t < 6; ++t)
        if (allDiffer(labelsOf(t, l))) add(kuhn::tetrahedronSlot(t));
    }
  }

  static std::array<RegionLabel, 4> labelsOf(std::size_t tetrahedron,
                                             const std::array<RegionLabel, 8>& l) {
    const auto& c = kuhn::kTetrahedra[tetrahedron];
    return {l[c[0]], l[c[1]], l[c[2]], l[c[3]]};
  }

  /// Point where the interface crosses the edge between two grid points, index coordinates.
  /// @param isDoubtful  becomes true when another interface is nearer to one of the grid points
  static V3d crossing(SegmentedReader& reader, const Coord& a, const Coord& b,
                      bool* isDoubtful = nullptr) {
    const SegmentedReader::Nearest u = reader.nearest(a), v = reader.nearest(b);
    if (isDoubtful) *isDoubtful = u.neighbour != v.label || v.neighbour != u.label;
    const double du = static_cast<double>(reader.distanceTo(a, u, v.label)),
                 dv = static_cast<double>(reader.distanceTo(b, v, u.label));
    const double t =
        du + dv > 0 ? std::clamp(du / (du + dv), kuhn::kEndGap, 1 - kuhn::kEndGap) : 0.5;
    return V3d(a[0], a[1], a[2]) * (1 - t) + V3d(b[0], b[1], b[2]) * t;
  }

  /// Sets the positions of the vertices, in index coordinates.
  void placeVertices(MeshBlock& block) {
    SegmentedReader reader(data_);
    const Coord origin = originOf(block);
    for (std::size_t i = 0; i < block.keys.size(); ++i) {
      const std::uint32_t voxel = block.keys[i] >> 5, slot = block.keys[i] & 31;
      const Coord low = origin + SegmentedData::localOf(voxel);
      V3d& p = result_.mesh.positions[block.firstVertex + i];
      if (slot < 7) {
        bool isDoubtful = false;
        p = crossing(reader, low, low + cornerOffset(slot + 1), &isDoubtful);
        isDoubtful_[block.firstVertex + i] = isDoubtful;
      } else if (slot < 19) {
        const kuhn::FaceSteps& face = kuhn::kFaces[slot - 7];
        p = centre<3>(reader, low, {0, face.middle, face.upper});
      } else {
        p = centre<4>(reader, low, kuhn::kTetrahedra[slot - 19]);
      }
    }
  }

  /// Mean of the crossings on the edges of a simplex.
  template <std::size_t n>
  static V3d centre(SegmentedReader& reader, const Coord& low,
                    const std::array<kuhn::Corner, n>& corners) {
    V3d sum(0);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = i + 1; j < n; ++j)
        sum += crossing(reader, low + cornerOffset(corners[i]), low + cornerOffset(corners[j]));
    constexpr std::size_t kEdges = n * (n - 1) / 2;
    return sum / static_cast<double>(kEdges);
  }

  /// Vertex as the cut of a tetrahedron names it: the corners of its simplex.
  struct Node {
    std::uint32_t vertex;
    V3i place;  ///< centre of the simplex, twelfths of a cell: decides the orientation
  };

  /// Cell that is being cut.
  struct Cut {
    MeshBlock& block;
    std::array<const MeshBlock*, 8> around;  ///< blocks at the offsets of the corners
    Coord local;                             ///< place of the lowest corner
    std::size_t tetrahedron;

    [[nodiscard]] const std::array<kuhn::Corner, 4>& corners() const {
      return kuhn::kTetrahedra[tetrahedron];
    }
    [[nodiscard]] std::uint32_t vertex(kuhn::Corner low, std::uint32_t slot) const {
      const Coord at = local + cornerOffset(low);
      const MeshBlock& owner =
          *around[static_cast<std::size_t>((at[0] >> 3) * 4 + (at[1] >> 3) * 2 + (at[2] >> 3))];
      const auto key = static_cast<std::uint16_t>(SegmentedData::offsetOf(at) * 32 + slot);
      const auto found = std::lower_bound(owner.keys.begin(), owner.keys.end(), key);
      return static_cast<std::uint32_t>(owner.firstVertex +
                                        static_cast<std::size_t>(found - owner.keys.begin()));
    }
    [[nodiscard]] V3i place(std::size_t i) const {
      const Coord at = cornerOffset(corners()[i]);
      return V3i(at[0], at[1], at[2]) * 12;
    }
    [[nodiscard]] Node edge(std::size_t i, std::size_t j) const {
      const auto [low, high] = std::minmax(i, j);
      const kuhn::Corner from = corners()[low];
      return {vertex(from, kuhn::edgeSlot(corners()[high] ^ from)), (place(i) + place(j)) / 2};
    }
    [[nodiscard]] Node face(std::size_t i, std::size_t j, std::size_t k) const {
      std::array<std::size_t, 3> order = {i, j, k};
      std::sort(order.begin(), order.end());
      const kuhn::Corner from = corners()[order[0]];
      return {vertex(from, kuhn::faceSlot(corners()[order[1]] ^ from, corners()[order[2]] ^ from)),
              (place(i) + place(j) + place(k)) / 3};
    }
    [[nodiscard]] Node inside() const {
      return {vertex(corners()[0], kuhn::tetrahedronSlot(tetrahedron)),
              (place(0) + place(1) + place(2) + place(3)) / 4};
    }
  };

  void cutCells(MeshBlock& block) {
    if (!block.isCut) return;
    SegmentedReader reader(data_);
    const CellLabels labels(reader, originOf(block));
    Cut cut{block, {}, {}, 0};
    for (kuhn::Corner c = 0; c < 8; ++c) cut.around[c] = find(block.block + cornerOffset(c));
    std::array<RegionLabel, 8> l;
    for (std::uint32_t voxel = 0; voxel < SegmentedData::kVoxels; ++voxel) {
      if (!labels.cell(voxel, l)) continue;
      cut.local = SegmentedData::localOf(voxel);
      for (cut.tetrahedron = 0; cut.tetrahedron < 6; ++cut.tetrahedron)
        cutTetrahedron(cut, labelsOf(cut.tetrahedron, l));
    }
  }

  [[nodiscard]] const MeshBlock* find(const Coord& block) const {
    const auto found =
        std::lower_bound(blocks_.begin(), blocks_.end(), block,
                         [](const MeshBlock& a, const Coord& b) { return a.block < b; });
    return found != blocks_.end() && found->block == block ? &*found : nullptr;
  }

  void cutTetrahedron(const Cut& cut, const std::array<RegionLabel, 4>& l) const {
    // Corners by label: those of the largest group first.
    std::array<std::size_t, 4> at = {0, 1, 2, 3};
    const auto groupSize = [&](std::size_t i) { return std::count(l.begin(), l.end(), l[i]); };
    std::stable_sort(at.begin(), at.end(), [&](std::size_t i, std::size_t j) {
      return groupSize(i) != groupSize(j) ? groupSize(i) > groupSize(j) : l[i] < l[j];
    });
    const auto [a, b, c, d] = at;
    switch (groupSize(a)) {
      case 4:
        return;
      case 3:
        return add(cut, l, a, d, {cut.edge(a, d), cut.edge(b, d), cut.edge(c, d)});
      case 2:
        if (l[c] == l[d])
          return add(cut, l, a, d,
                     {cut.edge(a, c), cut.edge(a, d), cut.edge(b, d), cut.edge(b, c)});
        break;
      default:
        return cutFour(cut, l);
    }
    const Node first = cut.face(a, c, d), second = cut.face(b, c, d);
    add(cut, l, a, c, {cut.edge(a, c), cut.edge(b, c), second, first});
    add(cut, l, a, d, {cut.edge(a, d), cut.edge(b, d), second, first});
    add(cut, l, c, d, {cut.edge(c, d), first, second});
    addJunction(cut, first, second, {l[a], l[c], l[d]});
  }

  void cutFour(const Cut& cut, const std::array<RegionLabel, 4>& l) const {
    const Node centre = cut.inside();
    cut.block.points.push_back(centre.vertex);
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = i + 1; j < 4; ++j) {
        const std::size_t k = i != 0 && j != 0 ? 0 : i != 1 && j != 1 ? 1 : 2, m = 6 - i - j - k;
        const Node edge = cut.edge(i, j);
        add(cut, l, i, j, {edge, cut.face(i, j, k), centre});
        add(cut, l, i, j, {edge, centre, cut.face(i, j, m)});
      }
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t j = (i + 1) % 4, k = (i + 2) % 4;
      addJunction(cut, cut.face(i, j, k), centre, {l[i], l[j], l[k]});
    }
  }

  static void addJunction(const Cut& cut, const Node& from, const Node& to,
                          std::array<RegionLabel, 3> labels) {
    std::sort(labels.begin(), labels.end());
    cut.block.junctions.push_back({{from.vertex, to.vertex}, labels});
  }

  /// Adds a polygon of the interface between the labels of corners i and j.
  void add(const Cut& cut, const std::array<RegionLabel, 4>& l, std::size_t i, std::size_t j,
           std::initializer_list<Node> polygon) const {
    if (l[i] < l[j]) std::swap(i, j);
    const TriangleSides sides{l[i], l[j]};
    std::array<Node, 4> nodes;
    std::copy(polygon.begin(), polygon.end(), nodes.begin());
    const std::size_t count = polygon.size();
    V3i normal(0);
    for (std::size_t n = 1; n + 1 < count; ++n)
      normal += (nodes[n].place - nodes[0].place).cross(nodes[n + 1].place - nodes[0].place);
    if ((normal ^ (cut.place(j) - cut.place(i))) < 0)
      std::reverse(nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(count));
    const auto addTriangle = [&](std::size_t p, std::size_t q, std::size_t r) {
      cut.block.triangles.push_back({nodes[p].vertex, nodes[q].vertex, nodes[r].vertex});
      cut.block.sides.push_back(sides);
    };
    if (count == 3) return addTriangle(0, 1, 2);
    const auto diagonal = [&](std::size_t p, std::size_t q) {
      return (result_.mesh.positions[nodes[p].vertex] - result_.mesh.positions[nodes[q].vertex])
          .length2();
    };
    if (diagonal(1, 3) < diagonal(0, 2)) {
      addTriangle(0, 1, 3);
      addTriangle(1, 2, 3);
    } else {
      addTriangle(0, 1, 2);
      addTriangle(0, 2, 3);
    }
  }

  // === Fields with sheets
  void findCrossings(MeshBlock& block) const {
    const CellCrossings crossings(data_, originOf(block));
    if (crossings.isEmpty()) return;
    for (std::uint32_t voxel = 0; voxel < SegmentedData::kVoxels; ++voxel) {
      const Coord cell = SegmentedData::localOf(voxel);
      if (!crossings.hasCrossings(cell)) continue;
      const auto add = [&](std::uint32_t slot) {
        block.keys.push_back(SheetData::key(voxel, slot));
      };
      for (kuhn::Corner step = 1; step < 8; ++step)
        if (crossings.isCrossed(cell, 0, step)) add(kuhn::edgeSlot(step));
      for (const kuhn::FaceSteps& face : kuhn::kFaces)
        if (holdsFaceNode(crossings.edgesOfFace(cell, face)))
          add(kuhn::faceSlot(face.middle, face.upper));
      for (std::size_t t = 0; t < 6; ++t)
        if (crossings.cut(cell, t).hasInside) add(kuhn::tetrahedronSlot(t));
    }
  }

  void placeCrossings(MeshBlock& block) {
    const SheetPlaces places(data_, originOf(block));
    for (std::size_t i = 0; i < block.keys.size(); ++i)
      result_.mesh.positions[block.firstVertex + i] = places.place(block.keys[i]);
  }

  void cutCrossedCells(MeshBlock& block) {
    if (!block.isCut) return;
    SegmentedReader reader(data_);
    const Coord origin = originOf(block);
    const SheetPlaces places(data_, origin);
    if (places.crossings().isEmpty()) return;
    Cut cut{block, {}, {}, 0};
    for (kuhn::Corner c = 0; c < 8; ++c) cut.around[c] = find(block.block + cornerOffset(c));
    for (std::uint32_t voxel = 0; voxel < SegmentedData::kVoxels; ++voxel) {
      cut.local = SegmentedData::localOf(voxel);
      if (!places.crossings().hasCrossings(cut.local)) continue;
      std::array<RegionLabel, 8> l;
      for (kuhn::Corner c = 0; c < 8; ++c)
        l[c] = reader.label(origin + cut.local + cornerOffset(c));
      for (cut.tetrahedron = 0; cut.tetrahedron < 6; ++cut.tetrahedron)
        addSurfaces(places, cut, places.crossings().cut(cut.local, cut.tetrahedron),
                    labelsOf(cut.tetrahedron, l));
    }
  }

  void addSurfaces(const SheetPlaces& places, const Cut& cut, const CutTetrahedron& surfaces,
                   const std::array<RegionLabel, 4>& l) const {
    const auto vertexOf = [&](CutTetrahedron::Node node) {
      if (node == CutTetrahedron::kInside) return cut.inside().vertex;
      if (node < CutTetrahedron::kFirstFace)
        return cut.edge(CutTetrahedron::kEdges[node][0], CutTetrahedron::kEdges[node][1]).vertex;
      const std::size_t opposite = node - CutTetrahedron::kFirstFace;
      return cut.face(opposite == 0 ? 1 : 0, opposite <= 1 ? 2 : 1, opposite == 3 ? 2 : 3).vertex;
    };
    for (const CutTetrahedron::Polygon& polygon : surfaces.polygons) {
      std::vector<std::uint32_t> vertices;
      for (const CutTetrahedron::Node node : polygon.nodes) vertices.push_back(vertexOf(node));
      const RegionLabel from = l[polygon.from], to = l[polygon.to];
      // Odd tetrahedra are mirrored; normals point to the smaller label.
      if ((cut.tetrahedron % 2 == 1) != (from < to)) std::reverse(vertices.begin(), vertices.end());
      const auto first = static_cast<std::uint32_t>(cut.block.triangles.size());
      addPolygon(cut.block, vertices, {std::max(from, to), std::min(from, to)});
      if (!isStrip(places, cut, polygon)) continue;
      for (std::uint32_t t = first; t < cut.block.triangles.size(); ++t)
        cut.block.strips.push_back(t);
    }
    for (const auto& rim : surfaces.rims)
      cut.block.rims.push_back({vertexOf(rim[0]), vertexOf(rim[1])});
    for (const CutTetrahedron::Junction& junction : surfaces.junctions) {
      std::array<RegionLabel, 3> labels{};
      std::size_t n = 0;
      for (std::size_t corner = 0; corner < 4; ++corner)
        if (corner != junction.face) labels[n++] = l[corner];
      std::sort(labels.begin(), labels.end());
      cut.block.junctions.push_back(
          {{vertexOf(junction.nodes[0]), vertexOf(junction.nodes[1])}, labels});
    }
    // Without a stored point it is a branch of the strips along one line.
    if (surfaces.isJunctionPoint &&
        places.storedPoint(originOf(cut.block) + cut.local, kuhn::tetrahedronSlot(cut.tetrahedron)))
      cut.block.points.push_back(cut.inside().vertex);
  }

  /// Returns true if all edges that a polygon crosses have their crossing on a junction.
  static bool isStrip(const SheetPlaces& places, const Cut& cut,
                      const CutTetrahedron::Polygon& polygon) {
    return std::all_of(polygon.nodes.begin(), polygon.nodes.end(), [&](CutTetrahedron::Node node) {
      if (node >= CutTetrahedron::kFirstFace) return true;
      const auto [i, j] = CutTetrahedron::kEdges[node];
      const kuhn::Corner low = cut.corners()[i], high = cut.corners()[j];
      return places
          .storedPoint(originOf(cut.block) + cut.local + cornerOffset(low),
                       kuhn::edgeSlot(low ^ high))
          .has_value();
    });
  }

  /// Adds a polygon as a fan from the vertex with the shortest diagonals.
  void addPolygon(MeshBlock& block, const std::vector<std::uint32_t>& vertices,
                  const TriangleSides& sides) const {
    const std::size_t count = vertices.size();
    std::size_t best = 0;
    double least = INFINITY;
    for (std::size_t first = 0; first < count; ++first) {
      double sum = 0;
      for (std::size_t n = 2; n + 1 < count; ++n)
        sum += (result_.mesh.positions[vertices[first]] -
                result_.mesh.positions[vertices[(first + n) % count]])
                   .length2();
      if (sum >= least) continue;
      least = sum;
      best = first;
    }
    for (std::size_t n = 1; n + 1 < count; ++n) {
      block.triangles.push_back(
          {vertices[best], vertices[(best + n) % count], vertices[(best + n + 1) % count]});
      block.sides.push_back(sides);
    }
  }

  void orient() {
    std::vector<char> isSheet(result_.sides.size());
    for (std::size_t t = 0; t < isSheet.size(); ++t)
      isSheet[t] = result_.sides[t].behind == result_.sides[t].front;
    orientSheets(result_.mesh.triangles, isSheet);
  }

  void collect() {
    std::size_t triangles = 0, junctions = 0;
    for (const MeshBlock& block : blocks_) {
      triangles += block.triangles.size();
      junctions += block.junctions.size();
    }
    result_.mesh.triangles.reserve(triangles);
    result_.sides.reserve(triangles);
    result_.junctions.reserve(junctions);
    const auto move = [](auto& from, auto& to) {
      to.insert(to.end(), from.begin(), from.end());
      from = {};
    };
    for (MeshBlock& block : blocks_) {
      for (std::uint32_t& triangle : block.strips)
        triangle += static_cast<std::uint32_t>(result_.mesh.triangles.size());
      move(block.strips, result_.strips);
      move(block.triangles, result_.mesh.triangles);
      move(block.sides, result_.sides);
      move(block.junctions, result_.junctions);
      move(block.rims, result_.rims);
      move(block.points, result_.junctionPoints);
    }
  }

  const SegmentedData& data_;
  const SegmentedMeshOptions& options_;
  std::optional<RegionLabel> region_;
  std::vector<MeshBlock> blocks_;  ///< by x, y, z
  std::vector<char> isDoubtful_;   ///< by vertex; not bool, which threads could not set
  SegmentedMesh result_;
};

}  // namespace

SegmentedMesh segmentedToMesh(const SegmentedField& field, const SegmentedMeshOptions& options) {
  if (field.isEmpty()) return {};
  return SegmentedMesher(*field.shared(), options).run();
}

TriMesh regionSurface(const SegmentedField& field, RegionLabel region,
                      const SegmentedMeshOptions& options) {
  if (field.isEmpty()) return {};
  return regionSurface(SegmentedMesher(*field.shared(), options, region).run(), region);
}

TriMesh regionSurface(const SegmentedMesh& mesh, RegionLabel region) {
  TriMesh surface;
  constexpr std::uint32_t kUnused = 0xffffffffu;
  std::vector<std::uint32_t> vertices(mesh.mesh.positions.size(), kUnused);
  for (std::size_t t = 0; t < mesh.sides.size(); ++t) {
    if ((mesh.sides[t].behind == region) == (mesh.sides[t].front == region)) continue;
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& vertex = vertices[mesh.mesh.triangles[t][k]];
      if (vertex == kUnused) {
        vertex = static_cast<std::uint32_t>(surface.positions.size());
        surface.positions.push_back(mesh.mesh.positions[mesh.mesh.triangles[t][k]]);
      }
      triangle[k] = vertex;
    }
    if (mesh.sides[t].front == region) std::swap(triangle[1], triangle[2]);
    surface.triangles.push_back(triangle);
  }
  return surface;
}

}  // namespace levelset
