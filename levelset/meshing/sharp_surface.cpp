#include "levelset/meshing/sharp_surface.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <tuple>

namespace levelset {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using openvdb::Coord;
using openvdb::FloatGrid;

/// Second difference, in voxels, up to which a grid point counts as smooth.
constexpr double kSmooth = 0.15;
/// How far the values around a grid point may be from a plane of unit slope for it to tell one.
constexpr double kPlanar = 0.1;
/// Eigenvalues of the planes' matrix below that share of the largest are noise.
constexpr double kRank = 0.05;
/// How far from its cell, in voxels, a plane may touch the surface and still be of use.
constexpr double kTouchMargin = 0.75;
/// How far outside its cell, in voxels, a vertex may lie.
constexpr double kVertexReach = 1;
/// Normals further apart than that form an edge.
constexpr double kEdgeCosine = 0.9;

/// A tangent plane of the surface, told by one grid point.
struct Plane {
  Vector3d normal = Vector3d::Zero();
  double distance = 0;  ///< of the grid point from it, voxels
  bool isSmooth = false;
  bool isKnown = false;
};

/// The values of a block and of two layers around it, in voxels, and what planes they tell.
class BlockField {
 public:
  BlockField(const FloatGrid& grid, const Coord& origin) {
    auto values = grid.getConstAccessor();
    const double inverse = 1 / grid.voxelSize()[0];
    std::size_t i = 0;
    for (int x = -1; x <= kEnd; ++x)
      for (int y = -1; y <= kEnd; ++y)
        for (int z = -1; z <= kEnd; ++z)
          values_[i++] = static_cast<double>(values.getValue(origin.offsetBy(x, y, z))) * inverse;
  }

  [[nodiscard]] double value(int x, int y, int z) const {
    return values_[static_cast<std::size_t>(((x + 1) * kDim + y + 1) * kDim + z + 1)];
  }

  /// Each coordinate in [0, 8].
  [[nodiscard]] const Plane& plane(int x, int y, int z) {
    const auto i = static_cast<std::size_t>((x * 9 + y) * 9 + z);
    if (!made_[i]) {
      planes_[i] = makePlane(x, y, z);
      made_[i] = true;
    }
    return planes_[i];
  }

 private:
  static constexpr int kEnd = 9, kDim = kEnd + 2;

  Plane makePlane(int x, int y, int z) const {
    Plane plane;
    plane.distance = value(x, y, z);
    const Vector3d back(value(x - 1, y, z), value(x, y - 1, z), value(x, y, z - 1));
    const Vector3d ahead(value(x + 1, y, z), value(x, y + 1, z), value(x, y, z + 1));
    const Vector3d bend = back + ahead - Vector3d::Constant(2 * plane.distance);
    plane.isSmooth = bend.cwiseAbs().maxCoeff() < kSmooth;
    if (plane.isSmooth) {
      plane.normal = (ahead - back) / 2;
      plane.isKnown = plane.normal.norm() > 0.5;
    } else {
      chooseOctant(x, y, z, plane);
    }
    if (plane.isKnown) plane.normal.normalize();
    return plane;
  }

  /// Beside an edge of the solid, differences across it mix two faces. Of the eight cells at the
  /// grid point, the one whose corners lie nearest to a plane of unit slope has a face to itself.
  void chooseOctant(int x, int y, int z, Plane& plane) const {
    double best = kPlanar;
    for (int octant = 0; octant < 8; ++octant) {
      const int sx = octant & 4 ? 1 : -1, sy = octant & 2 ? 1 : -1, sz = octant & 1 ? 1 : -1;
      const double base = plane.distance;
      const double dx = value(x + sx, y, z) - base, dy = value(x, y + sy, z) - base,
                   dz = value(x, y, z + sz) - base;
      const double error = std::abs(std::sqrt(dx * dx + dy * dy + dz * dz) - 1) +
                           std::abs(value(x + sx, y + sy, z) - base - dx - dy) +
                           std::abs(value(x + sx, y, z + sz) - base - dx - dz) +
                           std::abs(value(x, y + sy, z + sz) - base - dy - dz) +
                           std::abs(value(x + sx, y + sy, z + sz) - base - dx - dy - dz);
      if (!(error < best)) continue;
      best = error;
      plane.normal = Vector3d(sx * dx, sy * dy, sz * dz);
      plane.isKnown = true;
    }
  }

  std::array<double, kDim * kDim * kDim> values_;
  std::array<Plane, 729> planes_;
  std::array<bool, 729> made_ = {};
};

struct DualVertex {
  Vector3d position;
  bool isFeature = false;
};

/// Normals closer than that are of one face.
constexpr double kOneFaceCosine = 0.96;

/// The faces among the planes that a vertex was fitted to.
SharpFeature featureAt(const Vector3d& position,
                       const std::vector<std::pair<Vector3d, double>>& planes) {
  SharpFeature feature;
  for (const auto& [normal, offset] : planes) {
    feature.misfit = std::max(feature.misfit, std::abs(normal.dot(position) - offset));
    const openvdb::Vec3d n(normal.x(), normal.y(), normal.z());
    const auto last = feature.normals.begin() + static_cast<std::ptrdiff_t>(feature.normalCount);
    const bool isKnown = std::any_of(feature.normals.begin(), last,
                                     [&](const auto& m) { return m.dot(n) > kOneFaceCosine; });
    if (!isKnown && feature.normalCount < feature.normals.size())
      feature.normals[feature.normalCount++] = n;
  }
  return feature;
}

/// The point nearest to `centre` among those that fit the planes best.
Vector3d fitPlanes(const std::vector<std::pair<Vector3d, double>>& planes, const Vector3d& centre) {
  Matrix3d matrix = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const auto& [normal, offset] : planes) {
    matrix += normal * normal.transpose();
    right += normal * (offset - normal.dot(centre));
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(matrix);
  const Vector3d& values = solver.eigenvalues();
  Vector3d shift = Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    if (values[i] < kRank * values[2]) continue;
    const Vector3d direction = solver.eigenvectors().col(i);
    shift += direction * (direction.dot(right) / values[i]);
  }
  return centre + shift;
}

bool isInCell(const Vector3d& p, double margin) {
  return p.minCoeff() >= -margin && p.maxCoeff() <= 1 + margin;
}

/// Places the vertices of one cell; positions are relative to its lowest corner.
class CellVertices {
 public:
  CellVertices(BlockField& field, int x, int y, int z) : field_(field), x_(x), y_(y), z_(z) {}

  /// The planes that the last vertex was fitted to, positions as the vertex.
  [[nodiscard]] const std::vector<std::pair<Vector3d, double>>& planes() const { return planes_; }

  DualVertex place(const std::uint8_t* edges, std::size_t count) {
    crossings_.clear();
    planes_.clear();
    bool isSmooth = true;
    unsigned corners = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto offset = edgeOffset(edges[i]);
      const auto axis = static_cast<std::size_t>(edgeAxis(edges[i]));
      auto end = offset;
      end[axis] = 1;
      const Plane &low = planeAt(offset), &high = planeAt(end);
      isSmooth &= low.isSmooth && high.isSmooth && low.isKnown && high.isKnown;
      const double t = crossing(low.distance, high.distance);
      Vector3d point(offset[0], offset[1], offset[2]);
      point[static_cast<int>(axis)] = t;
      crossings_.emplace_back(point, (1 - t) * low.normal + t * high.normal);
      corners |= 1u << cornerOf(offset[0], offset[1], offset[2]);
      corners |= 1u << cornerOf(end[0], end[1], end[2]);
    }
    Vector3d centre = Vector3d::Zero();
    for (const auto& crossing : crossings_) centre += crossing.first;
    centre /= static_cast<double>(count);
    return isSmooth ? DualVertex{placeSmooth(centre), false} : placeByPlanes(centre, corners);
  }

 private:
  const Plane& planeAt(const std::array<int, 3>& offset) {
    return field_.plane(x_ + offset[0], y_ + offset[1], z_ + offset[2]);
  }

  static double crossing(double low, double high) {
    const double t = low / (low - high);
    return t >= 0 && t <= 1 ? t : 0.5;
  }

  /// The mean of the crossings lies as far inside a curved surface as the tangent planes at them
  /// lie outside: half way between is on it to higher order.
  [[nodiscard]] Vector3d placeSmooth(const Vector3d& centre) const {
    Vector3d mean = Vector3d::Zero();
    for (const auto& [point, normal] : crossings_) mean += normal;
    if (!(mean.norm() > 0.1)) return centre;
    mean.normalize();
    double above = 0, below = 0;
    for (const auto& [point, normal] : crossings_) {
      const Vector3d unit = normal.normalized();
      above += unit.dot(mean) * unit.dot(point - centre);
      below += unit.dot(mean) * unit.dot(mean);
    }
    const Vector3d result = centre + mean * (above / below / 2);
    return isInCell(result, 0) ? result : centre;
  }

  /// A point on the edge or corner where the planes meet. It may lie a little outside the cell: it
  /// is on the surface there, which the nearest point of the cell is not.
  DualVertex placeByPlanes(const Vector3d& centre, unsigned corners) {
    for (const auto& [touch, reach] :
         {std::pair(kTouchMargin, 0.0), std::pair(0.0, 0.0), std::pair(kTouchMargin, kVertexReach),
          std::pair(0.0, kVertexReach)}) {
      const bool isFeature = collectPlanes(corners, touch);
      if (planes_.empty()) continue;
      const Vector3d fitted = fitPlanes(planes_, centre);
      if (isInCell(fitted, reach)) return {fitted, isFeature};
    }
    return {toNearestPlane(centre, corners), false};
  }

  /// Planes that touch the surface in the cell or within `margin` of it. @return do they form an
  /// edge?
  bool collectPlanes(unsigned corners, double margin) {
    planes_.clear();
    double leastCosine = 1;
    for (int corner = 0; corner < 8; ++corner) {
      if (!((corners >> corner) & 1)) continue;
      const std::array<int, 3> offset = {corner >> 2, (corner >> 1) & 1, corner & 1};
      const Plane& plane = planeAt(offset);
      const Vector3d point(offset[0], offset[1], offset[2]);
      if (!plane.isKnown || !isInCell(point - plane.distance * plane.normal, margin)) continue;
      for (const auto& other : planes_) {
        leastCosine = std::min(leastCosine, plane.normal.dot(other.first));
      }
      planes_.emplace_back(plane.normal, plane.normal.dot(point) - plane.distance);
    }
    return leastCosine < kEdgeCosine;
  }

  Vector3d toNearestPlane(const Vector3d& centre, unsigned corners) {
    collectPlanes(corners, kTouchMargin);
    Vector3d shift = Vector3d::Constant(1);
    for (const auto& [normal, offset] : planes_) {
      const double distance = offset - normal.dot(centre);
      if (std::abs(distance) < shift.norm()) shift = distance * normal;
    }
    return isInCell(centre + shift, 0) ? Vector3d(centre + shift) : centre;
  }

  BlockField& field_;
  int x_, y_, z_;
  std::vector<std::pair<Vector3d, Vector3d>> crossings_;  ///< with normals
  std::vector<std::pair<Vector3d, double>> planes_;
};

/// Faces of a cell that one polygon passes twice: bit axis·2 + side, by polygon of the case.
std::array<std::uint8_t, 4> facesPassedTwice(const CellCase& cell) {
  std::array<std::uint8_t, 4> result = {};
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      std::array<int, 4> count = {};
      for (int edge = 0; edge < 12; ++edge) {
        const int cycle = cell.cycleOfEdge[static_cast<std::size_t>(edge)];
        if (cycle < 0 || edgeAxis(edge) == axis) continue;
        if (edgeOffset(edge)[static_cast<std::size_t>(axis)] == side) {
          ++count[static_cast<std::size_t>(cycle)];
        }
      }
      for (std::size_t cycle = 0; cycle < 4; ++cycle) {
        if (count[cycle] == 4) result[cycle] |= static_cast<std::uint8_t>(1 << (axis * 2 + side));
      }
    }
  }
  return result;
}

/// A segment on a face that two cells pass twice: both cells would be joined by two equal edges. A
/// vertex of its own on each segment keeps them apart.
struct FaceSegment {
  Coord insideCorner;    ///< the corner that the segment cuts off
  Coord oppositeCorner;  ///< of the face
  friend bool operator<(const FaceSegment& a, const FaceSegment& b) {
    return std::tie(a.insideCorner, a.oppositeCorner) < std::tie(b.insideCorner, b.oppositeCorner);
  }
  friend bool operator==(const FaceSegment& a, const FaceSegment& b) {
    return a.insideCorner == b.insideCorner && a.oppositeCorner == b.oppositeCorner;
  }
};

/// Slots of the cells around an edge, counter-clockwise about its axis, by the two offsets of the
/// edge in the cell; and the axis (0: axis + 1, 1: axis + 2) in which each differs from the next
/// one.
constexpr std::array<unsigned, 4> kRing = {0, 2, 3, 1};
constexpr std::array<int, 4> kRingStep = {0, 1, 0, 1};

class DualMesher {
 public:
  DualMesher(const CellSurface& surface, const FloatGrid& grid) : surface_(surface), grid_(grid) {}

  SharpMesh run() {
    vertices_.resize(surface_.cycleCount());
    features_.resize(surface_.blocks().size());
    twice_.resize(surface_.cycleCount());
    cells_.resize(surface_.vertexCount());
    forEachBlock([this](const SurfaceBlock& block) { placeBlock(block); });
    collectSegments();
    SharpMesh mesh;
    for (const auto& part : features_)
      mesh.features.insert(mesh.features.end(), part.begin(), part.end());
    mesh.positions.reserve(vertices_.size() + segments_.size());
    for (const DualVertex& v : vertices_) {
      mesh.positions.emplace_back(v.position.x(), v.position.y(), v.position.z());
    }
    for (const FaceSegment& segment : segments_) mesh.positions.push_back(middle(segment));
    emit(mesh);
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
    BlockField field(grid_, block.origin);
    std::size_t cycle = block.firstCycle;
    const Vector3d origin(block.origin.x(), block.origin.y(), block.origin.z());
    surface_.forEachCell(block, [&](int x, int y, int z, unsigned pattern) {
      const CellCase& cell = cellTable()[pattern];
      CellVertices placer(field, x, y, z);
      const std::uint8_t* edges = cell.cycleEdges.data();
      for (std::size_t i = 0; i < cell.cycleCount; edges += cell.cycleLength[i++], ++cycle) {
        vertices_[cycle] = placer.place(edges, cell.cycleLength[i]);
        if (vertices_[cycle].isFeature) {
          SharpFeature& feature = features_[block.neighbour[0]].emplace_back(
              featureAt(vertices_[cycle].position, placer.planes()));
          feature.vertex = static_cast<std::uint32_t>(cycle);
        }
        vertices_[cycle].position += origin + Vector3d(x, y, z);
        twice_[cycle] = twiceTable[pattern][i];
        for (std::size_t k = 0; k < cell.cycleLength[i]; ++k) {
          const std::uint32_t crossing = surface_.vertexOf(block, x, y, z, edges[k]);
          cells_[crossing][edges[k] & 3u] = static_cast<std::uint32_t>(cycle);
        }
      }
    });
  }

  /// Is the side of the quadrilateral from slot kRing[i] to the next one of the doubled kind?
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

  /// The face lies towards the side where the edge of that slot pair is: both cells share the other
  /// offset, which says on which side of the edge the face is.
  [[nodiscard]] static FaceSegment segmentAt(const Coord& low, int axis, bool lowInside,
                                             std::size_t i) {
    const int other = (axis + 2 - kRingStep[i]) % 3;  // the axis along which the face extends
    const unsigned bit = kRingStep[i] == 0 ? 1 : 2;
    Coord high = low;
    high[axis] += 1;
    FaceSegment segment;
    segment.insideCorner = lowInside ? low : high;
    segment.oppositeCorner = lowInside ? high : low;
    segment.oppositeCorner[other] += kRing[i] & bit ? -1 : 1;
    return segment;
  }

  template <typename Visit>
  void forEachCrossing(const SurfaceBlock& block, const Visit& visit) const {
    std::size_t vertex = block.firstVertex;
    CellSurface::forEachVertex(block, [&](int x, int y, int z, int axis) {
      const bool lowInside = block.value(x * 64 + y * 8 + z) < 0;
      visit(vertex++, block.origin.offsetBy(x, y, z), axis, lowInside);
    });
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

  /// Half way between the crossings on both edges of the face at the corner that is cut off.
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

  /// A diagonal must not cut across an edge of the solid: it starts from vertices on one, where
  /// there are such. Otherwise the shorter one.
  [[nodiscard]] std::size_t firstOfDiagonal(const std::vector<std::uint32_t>& quad) const {
    const auto features = [&](std::size_t i) {
      return vertices_[quad[i]].isFeature + vertices_[quad[i + 2]].isFeature;
    };
    if (features(0) != features(1)) return features(0) > features(1) ? 0 : 1;
    const auto length = [&](std::size_t i) {
      return (vertices_[quad[i]].position - vertices_[quad[i + 2]].position).squaredNorm();
    };
    return length(0) <= length(1) ? 0 : 1;
  }

  const CellSurface& surface_;
  const FloatGrid& grid_;
  std::vector<DualVertex> vertices_;                 ///< by polygon
  std::vector<std::uint8_t> twice_;                  ///< facesPassedTwice, by polygon
  std::vector<std::array<std::uint32_t, 4>> cells_;  ///< polygons around each crossed edge, by slot
  std::vector<FaceSegment> segments_;
  std::vector<std::vector<SharpFeature>> features_;  ///< by block
  std::vector<std::size_t> firstTriangle_;
};

}  // namespace

SharpMesh sharpSurface(const CellSurface& surface, const FloatGrid& grid) {
  return DualMesher(surface, grid).run();
}

}  // namespace levelset
