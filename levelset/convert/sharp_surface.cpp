#include "levelset/convert/sharp_surface.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "levelset/convert/sharp_features.h"

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
/// A grid point whose second differences are no larger takes its plane from central differences
/// alone: beside an edge, one face's own values may tell it better.
constexpr double kSurelySmooth = 0.02;
/// Values that close to a plane of unit slope are those of a flat face.
constexpr double kFlat = 1e-4;
/// Of the planes of one sheet, those that are so many times worse than another do not count.
constexpr double kWorse = 4;
/// Eigenvalues of the planes' matrix below that share of the largest are noise.
constexpr double kRank = 0.05;
/// How far from its cell, in voxels, a plane may touch the surface and still be of use.
constexpr double kTouchMargin = 0.75;
/// The field where a plane touches the surface is no larger, voxels, be it beside an edge: a plane
/// may run on beyond its face.
constexpr double kOffSurface = 0.3;
/// How far outside its cell, in voxels, a vertex may lie.
constexpr double kVertexReach = 1;
/// A plane that a vertex lies off by more, voxels, is none of its sheets.
constexpr double kOffSheet = 0.05;
/// How far a vertex without a sheet may be from those of its neighbours, and from where they meet.
constexpr double kAdoptReach = 1.25;
/// Vertices stay that far apart, voxels.
constexpr double kApart = 0.05;
/// Diagonals whose gaps differ by less, voxels, are equally good.
constexpr double kSameGap = 0.02;

/// A tangent plane of the surface, told by one grid point.
struct Plane {
  Vector3d normal = Vector3d::Zero();
  double distance = 0;  ///< of the grid point from it, voxels
  double error = 0;     ///< how far the values around are from it, voxels
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

  /// Trilinear, at most one voxel outside the block.
  [[nodiscard]] double interpolated(const Vector3d& p) const {
    std::array<int, 3> low;
    Vector3d t;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      low[i] = std::clamp(static_cast<int>(std::floor(p[axis])), -1, kEnd - 1);
      t[axis] = p[axis] - low[i];
    }
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const int dx = corner >> 2, dy = (corner >> 1) & 1, dz = corner & 1;
      sum += (dx ? t[0] : 1 - t[0]) * (dy ? t[1] : 1 - t[1]) * (dz ? t[2] : 1 - t[2]) *
             value(low[0] + dx, low[1] + dy, low[2] + dz);
    }
    return sum;
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
    plane.error = bend.cwiseAbs().maxCoeff();
    plane.isSmooth = plane.error < kSmooth;
    if (plane.isSmooth) {
      plane.normal = (ahead - back) / 2;
      plane.isKnown = plane.normal.norm() > 0.5;
    }
    if (!plane.isSmooth) {
      chooseOctant(x, y, z, kPlanar, plane);
    } else if (plane.error > kSurelySmooth) {
      chooseOctant(x, y, z, kFlat, plane);
    }
    if (plane.isKnown) plane.normal.normalize();
    return plane;
  }

  /// Beside an edge of the solid, differences across it mix two faces. Of the eight cells at the
  /// grid point, the one whose corners lie nearest to a plane of unit slope has a face to itself.
  void chooseOctant(int x, int y, int z, double limit, Plane& plane) const {
    double best = limit;
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
      best = plane.error = error;
      plane.normal = Vector3d(sx * dx, sy * dy, sz * dz);
      plane.isKnown = true;
      plane.isSmooth = false;
    }
  }

  std::array<double, kDim * kDim * kDim> values_;
  std::array<Plane, 729> planes_;
  std::array<bool, 729> made_ = {};
};

struct DualVertex {
  Vector3d position;
  VertexSheets sheets = {};
  double misfit = -1;  ///< to the planes that met there, voxels; < 0: none did
};

/// Points x with normal · x = offset.
struct FacePlane {
  Vector3d normal;
  double offset = 0, error = 0;
  [[nodiscard]] double above(const Vector3d& p) const { return normal.dot(p) - offset; }
};

/// The point nearest to `centre` among those that fit the planes best.
Vector3d fitPlanes(const std::vector<FacePlane>& planes, const Vector3d& centre) {
  Matrix3d matrix = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const FacePlane& plane : planes) {
    matrix += plane.normal * plane.normal.transpose();
    right -= plane.normal * plane.above(centre);
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

openvdb::Vec3d toIndex(const Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}

openvdb::Vec3f toSheet(const Vector3d& normal) {
  return {static_cast<float>(normal.x()), static_cast<float>(normal.y()),
          static_cast<float>(normal.z())};
}

/// The planes that pass through a point, one of each sheet.
VertexSheets sheetsAt(const Vector3d& point, const std::vector<FacePlane>& planes) {
  VertexSheets sheets;
  for (const FacePlane& plane : planes) {
    if (sheets.count == VertexSheets::kMost || std::abs(plane.above(point)) > kOffSheet) continue;
    const openvdb::Vec3f sheet = toSheet(plane.normal);
    bool isKnown = false;
    for (std::size_t i = 0; i < sheets.count; ++i)
      isKnown |= static_cast<double>(sheets.normal[i].dot(sheet)) > kOneSheetCosine;
    if (!isKnown) sheets.normal[sheets.count++] = sheet;
  }
  return sheets;
}

/// Largest distance of a point to the planes.
double misfitOf(const Vector3d& point, const std::vector<FacePlane>& planes) {
  double misfit = 0;
  for (const FacePlane& plane : planes) misfit = std::max(misfit, std::abs(plane.above(point)));
  return misfit;
}

/// Leaves out planes that another one of their sheet tells much better.
void dropWorse(std::vector<FacePlane>& planes) {
  const std::vector<FacePlane> all = planes;
  std::erase_if(planes, [&](const FacePlane& plane) {
    return plane.error > kSurelySmooth &&
           std::any_of(all.begin(), all.end(), [&](const FacePlane& other) {
             return other.error * kWorse < plane.error &&
                    other.normal.dot(plane.normal) > kOneSheetCosine;
           });
  });
}

bool isInCell(const Vector3d& p, double margin) {
  return p.minCoeff() >= -margin && p.maxCoeff() <= 1 + margin;
}

/// Places the vertices of one cell; positions are relative to its lowest corner.
class CellVertices {
 public:
  CellVertices(BlockField& field, int x, int y, int z) : field_(field), x_(x), y_(y), z_(z) {}

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
    return isSmooth ? placeSmooth(centre) : placeByPlanes(centre, corners);
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
  [[nodiscard]] DualVertex placeSmooth(const Vector3d& centre) const {
    Vector3d mean = Vector3d::Zero();
    for (const auto& [point, normal] : crossings_) mean += normal;
    if (!(mean.norm() > 0.1)) return {centre};
    mean.normalize();
    VertexSheets sheets;
    sheets.normal[sheets.count++] = toSheet(mean);
    double above = 0, below = 0;
    for (const auto& [point, normal] : crossings_) {
      const Vector3d unit = normal.normalized();
      above += unit.dot(mean) * unit.dot(point - centre);
      below += unit.dot(mean) * unit.dot(mean);
    }
    const Vector3d result = centre + mean * (above / below / 2);
    return {isInCell(result, 0) ? result : centre, sheets};
  }

  /// A point on the edge or corner where the planes meet. It may lie a little outside the cell: it
  /// is on the surface there, which the nearest point of the cell is not.
  DualVertex placeByPlanes(const Vector3d& centre, unsigned corners) {
    for (const auto& [touch, reach] :
         {std::pair(kTouchMargin, 0.0), std::pair(0.0, 0.0), std::pair(kTouchMargin, kVertexReach),
          std::pair(0.0, kVertexReach)}) {
      collectPlanes(corners, touch);
      if (planes_.empty()) continue;
      const Vector3d fitted = fitPlanes(planes_, centre);
      if (isInCell(fitted, reach))
        return {fitted, sheetsAt(fitted, planes_), misfitOf(fitted, planes_)};
    }
    const Vector3d moved = toNearestPlane(centre, corners);
    return {moved, sheetsAt(moved, planes_)};
  }

  /// Planes that touch the surface in the cell or within `margin` of it.
  void collectPlanes(unsigned corners, double margin) {
    planes_.clear();
    for (int corner = 0; corner < 8; ++corner) {
      if (!((corners >> corner) & 1)) continue;
      const std::array<int, 3> offset = {corner >> 2, (corner >> 1) & 1, corner & 1};
      const Plane& plane = planeAt(offset);
      const Vector3d point(offset[0], offset[1], offset[2]);
      const Vector3d foot = point - plane.distance * plane.normal;
      if (!plane.isKnown || !isInCell(foot, margin)) continue;
      if (std::abs(field_.interpolated(foot + Vector3d(x_, y_, z_))) > kOffSurface) continue;
      planes_.push_back({plane.normal, plane.normal.dot(point) - plane.distance, plane.error});
    }
    dropWorse(planes_);
  }

  Vector3d toNearestPlane(const Vector3d& centre, unsigned corners) {
    collectPlanes(corners, kTouchMargin);
    Vector3d shift = Vector3d::Constant(1);
    for (const FacePlane& plane : planes_) {
      const double distance = -plane.above(centre);
      if (std::abs(distance) < shift.norm()) shift = distance * plane.normal;
    }
    return isInCell(centre + shift, 0) ? Vector3d(centre + shift) : centre;
  }

  BlockField& field_;
  int x_, y_, z_;
  std::vector<std::pair<Vector3d, Vector3d>> crossings_;  ///< with normals
  std::vector<FacePlane> planes_;
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

  /// With `inserts`, edges and corners between the cells get vertices of their own.
  SharpMesh run(bool inserts) {
    vertices_.resize(surface_.cycleCount());
    twice_.resize(surface_.cycleCount());
    cells_.resize(surface_.vertexCount());
    forEachBlock([this](const SurfaceBlock& block) { placeBlock(block); });
    collectSegments();
    adoptSheets();
    SharpMesh mesh;
    mesh.positions.reserve(vertices_.size() + segments_.size());
    for (const DualVertex& v : vertices_) mesh.positions.push_back(toIndex(v.position));
    for (const FaceSegment& segment : segments_) mesh.positions.push_back(middle(segment));
    emit(mesh);
    collectFeatures(mesh);
    if (!inserts) return mesh;
    std::vector<VertexSheets> sheets(mesh.positions.size());
    for (std::size_t i = 0; i < vertices_.size(); ++i) sheets[i] = vertices_[i].sheets;
    insertFeatures(mesh, sheets);
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

  void collectFeatures(SharpMesh& mesh) const {
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      const DualVertex& vertex = vertices_[v];
      if (vertex.sheets.count < 2 || vertex.misfit < 0) continue;
      SharpFeature feature{.vertex = static_cast<std::uint32_t>(v),
                           .normals = {},
                           .normalCount = vertex.sheets.count,
                           .misfit = vertex.misfit};
      for (std::size_t i = 0; i < vertex.sheets.count; ++i)
        feature.normals[i] = openvdb::Vec3d(vertex.sheets.normal[i]).unit();
      mesh.features.push_back(feature);
    }
  }

  /// A cell beside a corner may have no grid point with a face to itself. Its vertex then goes
  /// where the sheets of the vertices around it meet.
  void adoptSheets() {
    std::vector<std::size_t> slot(vertices_.size(), kNoSlot);
    std::size_t count = 0;
    for (std::size_t v = 0; v < vertices_.size(); ++v)
      if (!vertices_[v].sheets.count) slot[v] = count++;
    if (!count) return;
    std::vector<std::vector<std::uint32_t>> around(count);
    for (const auto& cells : cells_)
      for (const std::uint32_t v : cells)
        if (slot[v] != kNoSlot)
          around[slot[v]].insert(around[slot[v]].end(), cells.begin(), cells.end());
    for (std::size_t v = 0; v < vertices_.size(); ++v)
      if (slot[v] != kNoSlot) adoptFrom(around[slot[v]], vertices_[v]);
  }

  void adoptFrom(const std::vector<std::uint32_t>& around, DualVertex& vertex) const {
    std::vector<FacePlane> planes;
    for (const std::uint32_t v : around) {
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
      return &vertices_[v] != &vertex && (vertices_[v].position - fitted).norm() < kApart;
    };
    if ((fitted - vertex.position).norm() > kAdoptReach ||
        std::any_of(around.begin(), around.end(), isTaken))
      return;
    vertex = {fitted, sheetsAt(fitted, planes), misfitOf(fitted, planes)};
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

  /// A diagonal must not cut across an edge of the solid; otherwise the shorter one.
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

  static constexpr std::size_t kNoSlot = static_cast<std::size_t>(-1);
  const CellSurface& surface_;
  const FloatGrid& grid_;
  std::vector<DualVertex> vertices_;                 ///< by polygon
  std::vector<std::uint8_t> twice_;                  ///< facesPassedTwice, by polygon
  std::vector<std::array<std::uint32_t, 4>> cells_;  ///< polygons around each crossed edge, by slot
  std::vector<FaceSegment> segments_;
  std::vector<std::size_t> firstTriangle_;
};

}  // namespace

IndexMesh sharpSurface(const CellSurface& surface, const FloatGrid& grid) {
  return DualMesher(surface, grid).run(true);
}

SharpMesh dualSurface(const CellSurface& surface, const FloatGrid& grid) {
  return DualMesher(surface, grid).run(false);
}

}  // namespace levelset
