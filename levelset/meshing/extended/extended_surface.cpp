#include "levelset/meshing/extended/extended_surface.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "levelset/error.h"
#include "levelset/meshing/sharp/sharp_edges.h"

namespace levelset {
namespace {

using Eigen::Vector3d;
using openvdb::Vec3d;

/// A polygon with two normals of a smaller dot product has a feature [Kobbelt01].
constexpr double kFeatureCosine = 0.9;
/// The feature is a corner if the dot product of a normal with the axis of the edge is larger, in
/// magnitude [Kobbelt01]. The axis is perpendicular to the two normals that differ most.
constexpr double kCornerCosine = 0.7;
/// Least length of that axis before it is normalised. Below it, both normals are opposite to each
/// other, and the faces do not meet.
constexpr double kLeastAxis = 0.05;
/// Singular values below this share of the largest are zero. Corners have none.
constexpr double kLeastSingular = 0.02;
/// Largest distance of a feature from its cell, voxels. Farther away, the planes do not belong to
/// one edge or corner.
constexpr double kCellReach = 1;
/// Longest side of a triangle from which a vertex was removed, voxels.
constexpr double kLongestSide = 3;
/// Least increase of the score of a flip. Flips inside a plane have none.
constexpr double kLeastAgreement = 1e-6;

struct Feature {
  Vec3d position;
  VertexSheets sheets;
  bool isCorner = false;
};

/// Finds the feature of one polygon from the crossings at its vertices.
class FeatureFinder {
 public:
  explicit FeatureFinder(const EdgeCrossings& crossings) : crossings_(crossings) {}

  /// @param polygon  vertex numbers
  /// @param cell  lowest corner of the cell
  [[nodiscard]] std::optional<Feature> find(const std::vector<std::uint32_t>& polygon,
                                            const openvdb::Coord& cell) const {
    Vec3d first, second;
    double least = kFeatureCosine;
    bool isFeature = false;
    for (std::size_t i = 0; i < polygon.size(); ++i)
      for (std::size_t j = i + 1; j < polygon.size(); ++j) {
        const Vec3d &a = normal(polygon[i]), &b = normal(polygon[j]);
        if (a.dot(b) >= least) continue;
        least = a.dot(b);
        first = a, second = b;
        isFeature = true;
      }
    if (!isFeature) return std::nullopt;
    Vec3d axis = first.cross(second);
    if (axis.length() < kLeastAxis) return std::nullopt;
    axis.normalize();
    Feature feature;
    for (const std::uint32_t v : polygon)
      feature.isCorner |= std::abs(normal(v).dot(axis)) > kCornerCosine;
    feature.position = fit(polygon, feature.isCorner ? 3 : 2);
    for (int i = 0; i < 3; ++i) {
      const double inCell = feature.position[i] - cell[i];
      if (!(inCell >= -kCellReach && inCell <= 1 + kCellReach)) return std::nullopt;
    }
    for (const std::uint32_t v : polygon) addSheet(normal(v), feature.sheets);
    return feature;
  }

 private:
  [[nodiscard]] const Vec3d& normal(std::uint32_t v) const { return crossings_.at[v].normal; }

  /// Returns the point nearest to the mean of the crossings among those that fit their tangent
  /// planes best by least squares.
  /// @param rank  2 for an edge, along which the planes do not fix the point; 3 for a corner
  [[nodiscard]] Vec3d fit(const std::vector<std::uint32_t>& polygon, Eigen::Index rank) const {
    Vec3d centre(0.0);
    for (const std::uint32_t v : polygon) centre += crossings_.at[v].point;
    centre /= static_cast<double>(polygon.size());
    Eigen::MatrixXd normals(polygon.size(),
                            3);  // JacobiSVD gives thin U and V of dynamic sizes only
    Eigen::VectorXd heights(polygon.size());
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const Vec3d& n = normal(polygon[i]);
      normals.row(row) << n[0], n[1], n[2];
      heights[row] = n.dot(crossings_.at[polygon[i]].point - centre);
    }
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(normals, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const auto& values = svd.singularValues();
    Vector3d shift = Vector3d::Zero();
    for (Eigen::Index i = 0; i < std::min(rank, values.size()); ++i)
      if (values[i] > kLeastSingular * values[0])
        shift += svd.matrixV().col(i) * (svd.matrixU().col(i).dot(heights) / values[i]);
    return centre + Vec3d(shift.x(), shift.y(), shift.z());
  }

  static void addSheet(const Vec3d& n, VertexSheets& sheets) {
    if (sheets.count == VertexSheets::kMost) return;
    for (std::size_t i = 0; i < sheets.count; ++i)
      if (sheetNormal(sheets, i).dot(n) > kOneSheetCosine) return;
    sheets.normal[sheets.count++] = openvdb::Vec3f(n);
  }

  const EdgeCrossings& crossings_;
};

class ExtendedMesher {
 public:
  ExtendedMesher(const CellSurface& surface, const EdgeCrossings& crossings,
                 const Progress& progress, bool listsCrossings)
      : surface_(surface),
        crossings_(crossings),
        progress_(progress),
        listsCrossings_(listsCrossings) {}

  ExtendedSurface run() {
    findFeatures();
    report(progress_, 0.5);
    number();
    fill();
    report(progress_, 0.7);
    flipEdges();
    report(progress_, 0.8);
    if (listsCrossings_) listCrossings();
    if (firstFeature_.back() > 0) unfold();
    return std::move(mesh_);
  }

 private:
  template <typename F>
  void forEachBlock(const F& run) const {
    const auto& blocks = surface_.blocks();
    tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
      if (blocks[i].vertexCount || blocks[i].cycleCount) run(i, blocks[i]);
    });
  }

  /// Calls visit(cell, polygon, first triangle in the table) for each polygon of a block, where
  /// `polygon` is a list of vertex numbers.
  template <typename Visit>
  void forEachPolygon(const SurfaceBlock& block, const Visit& visit) const {
    std::vector<std::uint32_t> polygon;
    surface_.forEachCell(block, [&](int x, int y, int z, unsigned pattern) {
      const CellCase& cell = cellTable()[pattern];
      const std::uint8_t* edges = cell.cycleEdges.data();
      std::size_t triangle = 0;
      for (std::size_t i = 0; i < cell.cycleCount; ++i) {
        const std::size_t length = cell.cycleLength[i];
        polygon.clear();
        for (std::size_t k = 0; k < length; ++k)
          polygon.push_back(surface_.vertexOf(block, x, y, z, edges[k]));
        visit(block.origin.offsetBy(x, y, z), polygon, [&](std::size_t t) {
          MeshTriangle corners;
          for (std::size_t k = 0; k < 3; ++k)
            corners[k] = surface_.vertexOf(block, x, y, z, cell.triangles[triangle + t][k]);
          return corners;
        });
        edges += length;
        triangle += length - 2;
      }
    });
  }

  void findFeatures() {
    features_.resize(surface_.cycleCount());
    const FeatureFinder finder(crossings_);
    forEachBlock([&](std::size_t, const SurfaceBlock& block) {
      std::size_t cycle = block.firstCycle;
      forEachPolygon(block, [&](const openvdb::Coord& cell, const auto& polygon, const auto&) {
        features_[cycle++] = finder.find(polygon, cell);
      });
    });
  }

  /// Numbers the features and the triangles, block by block.
  void number() {
    const auto& blocks = surface_.blocks();
    firstFeature_.assign(blocks.size() + 1, surface_.vertexCount());
    firstTriangle_.assign(blocks.size() + 1, 0);
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      std::size_t count = 0;
      for (std::size_t c = 0; c < blocks[i].cycleCount; ++c)
        count += features_[blocks[i].firstCycle + c].has_value();
      firstFeature_[i + 1] = firstFeature_[i] + count;
      // A fan has two triangles more than the polygon without a feature.
      firstTriangle_[i + 1] = firstTriangle_[i] + blocks[i].triangleCount + 2 * count;
    }
    if (firstFeature_.back() > std::numeric_limits<std::uint32_t>::max())
      throw ResourceLimit("the surface needs more than 4294967295 vertices; use larger voxels");
  }

  void fill() {
    mesh_.positions.resize(firstFeature_.back());
    mesh_.triangles.resize(firstTriangle_.back());
    tbb::parallel_for(std::size_t{0}, crossings_.at.size(),
                      [&](std::size_t v) { mesh_.positions[v] = crossings_.at[v].point; });
    forEachBlock([&](std::size_t index, const SurfaceBlock& block) {
      std::size_t cycle = block.firstCycle, vertex = firstFeature_[index],
                  triangle = firstTriangle_[index];
      forEachPolygon(block, [&](const openvdb::Coord&, const auto& polygon, const auto& corners) {
        if (const auto& feature = features_[cycle++]) {
          mesh_.positions[vertex] = feature->position;
          for (std::size_t k = 0; k < polygon.size(); ++k)
            mesh_.triangles[triangle++] = {static_cast<std::uint32_t>(vertex), polygon[k],
                                           polygon[(k + 1) % polygon.size()]};
          ++vertex;
        } else {
          for (std::size_t t = 0; t + 2 < polygon.size(); ++t)
            mesh_.triangles[triangle++] = corners(t);
        }
      });
    });
    for (const auto& feature : features_)
      if (feature) ++(feature->isCorner ? mesh_.cornerVertices : mesh_.edgeVertices);
  }

  [[nodiscard]] bool isFeature(std::uint32_t v) const { return v >= surface_.vertexCount(); }

  /// Triangles of the fans, which have a feature as their first vertex.
  [[nodiscard]] std::vector<std::size_t> fanTriangles() const {
    std::vector<std::size_t> fans;
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i)
      if (isFeature(mesh_.triangles[i][0])) fans.push_back(i);
    return fans;
  }

  /// Agreement of a triangle with the normals at its crossings, in [−1, 1].
  [[nodiscard]] double agreement(const MeshTriangle& t) const {
    const Vec3d& a = mesh_.positions[t[0]];
    Vec3d area = (mesh_.positions[t[1]] - a).cross(mesh_.positions[t[2]] - a);
    if (!area.normalize(1e-12)) return -1;
    double sum = 0, count = 0;
    for (const std::uint32_t v : t)
      if (!isFeature(v)) sum += area.dot(crossings_.at[v].normal), ++count;
    return sum / count;
  }

  /// Flips the mesh edges between two fans that become edges between features, if the triangles
  /// then agree better with the normals. A mesh edge with both ends on one face stays.
  void flipEdges() {
    const std::vector<std::size_t> fans = fanTriangles();
    std::vector<TriangleSide> sides;
    addSides(mesh_.triangles, fans, mesh_.positions.size(), sides);
    std::vector<PairedEdge> edges = pairSides(std::move(sides));
    std::erase_if(edges, [&](const PairedEdge& edge) {
      return isFeature(edge.high) || !isFeature(mesh_.triangles[edge.triangle[0]][0]) ||
             !isFeature(mesh_.triangles[edge.triangle[1]][0]);
    });
    auto present = edgesBeside(edges, mesh_.triangles, mesh_.positions.size());
    for (const PairedEdge& edge : edges) {
      const EdgeFlip flip = flipOf(edge, mesh_.triangles, present);
      if (!flip.isPossible) continue;
      const double before = agreement(mesh_.triangles[edge.triangle[0]]) +
                            agreement(mesh_.triangles[edge.triangle[1]]);
      if (agreement(flip.left) + agreement(flip.right) > before + kLeastAgreement)
        applyFlip(flip, edge, mesh_.triangles, present);
    }
  }

  /// Repairs triangles without area, and those that are turned over in their face: where the
  /// planes of two cells meet in one corner, both get a vertex there. Then drops unused vertices.
  void unfold() {
    std::vector<VertexSheets> sheets(mesh_.positions.size());
    std::size_t vertex = surface_.vertexCount();
    for (const auto& feature : features_)
      if (feature) sheets[vertex++] = feature->sheets;
    for (const MeshTriangle& t : mesh_.triangles) {
      if (std::none_of(t.begin(), t.end(), [&](std::uint32_t v) { return isFeature(v); })) continue;
      for (const std::uint32_t v : t)
        if (!isFeature(v)) sheets[v] = {1, {openvdb::Vec3f(crossings_.at[v].normal)}};
    }
    unfoldSheets(mesh_, sheets, subProgress(progress_, 0.8, 1), kLongestSide);
    dropUnused();
  }

  void listCrossings() {
    for (std::uint32_t v = 0; v < mesh_.positions.size(); ++v)
      mesh_.crossing.push_back(isFeature(v) ? ExtendedSurface::kFeature : v);
  }

  void dropUnused() {
    constexpr std::uint32_t kUnused = 0xffffffffu;
    std::vector<std::uint32_t> number(mesh_.positions.size(), kUnused);
    for (const MeshTriangle& t : mesh_.triangles)
      for (const std::uint32_t v : t) number[v] = 0;
    std::uint32_t kept = 0;
    for (std::size_t v = 0; v < number.size(); ++v) {
      if (number[v] == kUnused) continue;
      mesh_.positions[kept] = mesh_.positions[v];
      if (listsCrossings_) mesh_.crossing[kept] = mesh_.crossing[v];
      number[v] = kept++;
    }
    mesh_.positions.resize(kept);
    if (listsCrossings_) mesh_.crossing.resize(kept);
    for (MeshTriangle& t : mesh_.triangles)
      for (std::uint32_t& v : t) v = number[v];
  }

  const CellSurface& surface_;
  const EdgeCrossings& crossings_;
  const Progress& progress_;
  bool listsCrossings_;
  std::vector<std::optional<Feature>> features_;  ///< one for each polygon
  /// [block]: number of its first feature among the vertices, and of its first triangle.
  std::vector<std::size_t> firstFeature_, firstTriangle_;
  ExtendedSurface mesh_;
};

}  // namespace

ExtendedSurface extendedSurface(const CellSurface& surface, const EdgeCrossings& crossings,
                                const Progress& progress, bool listsCrossings) {
  return ExtendedMesher(surface, crossings, progress, listsCrossings).run();
}

}  // namespace levelset
