#include "render/segmented/sheet_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "levelset/geometry/perpendicular.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace render {
namespace {

using Imath::V3d;
using Imath::V3f;
using levelset::RegionLabel;
using SheetCorner = std::pair<std::uint32_t, RegionLabel>;  ///< vertex of the sheets of a region
using SheetEdge = std::pair<std::uint32_t, std::uint32_t>;  ///< vertices, ascending

// Cosine of the largest angle between triangles that make one smooth sheet.
constexpr double kLeastSmooth = 0.74;
constexpr double kSliver = SheetSurface::kSliver;
// Largest distance of an interpolated interface from that of the mesh, voxels; 0.3 were measured
// beside edges of solids.
constexpr double kLargestGap = 0.6;
constexpr double kGapStep = 0.05;
// A border ends that far beyond the interpolated interface, voxels.
constexpr double kOverlap = 0.1;

SheetEdge edgeOf(std::uint32_t a, std::uint32_t b) {
  return a < b ? SheetEdge(a, b) : SheetEdge(b, a);
}

class SheetFinder {
 public:
  SheetFinder(const levelset::SegmentedField& field, levelset::SegmentedMesh mesh)
      : field_(field), mesh_(std::move(mesh)) {}

  std::shared_ptr<const SheetSurface> run() {
    chooseTriangles();
    if (sheets_.empty()) return nullptr;
    takeTriangles();
    setNormals();
    addBorders();
    return std::make_shared<const SheetSurface>(std::move(surface_));
  }

 private:
  [[nodiscard]] V3d areaOf(const std::array<std::uint32_t, 3>& c) const {
    const std::vector<V3d>& p = surface_.positions;
    return (p[c[1]] - p[c[0]]).cross(p[c[2]] - p[c[0]]);
  }

  [[nodiscard]] bool isStrip(std::size_t meshTriangle) const {
    return std::binary_search(mesh_.strips.begin(), mesh_.strips.end(), meshTriangle);
  }

  /// Chooses the triangles of sheets. A strip without width counts if it joins sheets, as the pages
  /// of a book. Where interfaces cross, a strip joins nothing but them.
  void chooseTriangles() {
    std::vector<char> isReached(mesh_.mesh.positions.size());
    std::vector<std::size_t> strips;
    const auto take = [&](std::size_t t) {
      sheets_.push_back(t);
      for (const std::uint32_t v : mesh_.mesh.triangles[t]) isReached[v] = true;
    };
    for (std::size_t t = 0; t < mesh_.sides.size(); ++t)
      if (mesh_.sides[t].front == mesh_.sides[t].behind) isStrip(t) ? strips.push_back(t) : take(t);
    for (std::size_t before = 0; before != sheets_.size();) {
      before = sheets_.size();
      std::erase_if(strips, [&](std::size_t t) {
        const auto& corners = mesh_.mesh.triangles[t];
        if (!isReached[corners[0]] && !isReached[corners[1]] && !isReached[corners[2]])
          return false;
        take(t);
        return true;
      });
    }
    std::sort(sheets_.begin(), sheets_.end());
  }

  /// Copies the triangles of sheets, and numbers their vertices.
  void takeTriangles() {
    constexpr std::uint32_t kUnused = 0xffffffffu;
    numbers_.assign(mesh_.mesh.positions.size(), kUnused);
    surface_.triangles.reserve(sheets_.size());
    for (const std::size_t t : sheets_) {
      SheetSurface::Triangle triangle{{}, mesh_.sides[t].front, {}};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t vertex = mesh_.mesh.triangles[t][k];
        if (numbers_[vertex] == kUnused) {
          numbers_[vertex] = static_cast<std::uint32_t>(surface_.positions.size());
          surface_.positions.push_back(mesh_.mesh.positions[vertex]);
        }
        triangle.corners[k] = numbers_[vertex];
      }
      surface_.triangles.push_back(triangle);
    }
    surface_.meshVertices = surface_.positions.size();
    surface_.meshTriangles = surface_.triangles.size();
  }

  /// Sets the normal of each corner, from the triangles there that make one smooth sheet. A sheet
  /// may have no orientation, so each triangle turns the others to its side.
  void setNormals() {
    for (std::size_t t = 0; t < sheets_.size(); ++t)
      areas_.push_back(isStrip(sheets_[t]) ? V3d(0) : areaOf(surface_.triangles[t].corners));
    findTriangles();
    tbb::parallel_for(std::size_t{0}, sheets_.size(), [&](std::size_t t) {
      if (isStrip(sheets_[t])) return;
      SheetSurface::Triangle& triangle = surface_.triangles[t];
      const V3d guide = guideOf(t);
      for (std::size_t k = 0; k < 3; ++k)
        triangle.normals[k] = V3f(normalAt(triangle.corners[k], guide));
    });
  }

  /// Normal of the smooth sheet at a vertex: that of a quadratic polynomial through it, fitted to
  /// the vertices of the triangles around it and of those beside them. Cells cut triangles
  /// irregularly, so that a mean of their normals is hardly better than the normal of one.
  /// @param guide  normal that tells which triangles belong to the sheet
  [[nodiscard]] V3d normalAt(std::uint32_t vertex, const V3d& guide) const {
    V3d mean(0);
    std::vector<std::uint32_t> around;
    forEachAligned(vertex, guide, [&](std::uint32_t t, double side) {
      mean += areas_[t] * side;
      around.insert(around.end(), surface_.triangles[t].corners.begin(),
                    surface_.triangles[t].corners.end());
    });
    mean.normalize();
    sortUnique(around);
    for (const std::uint32_t near : std::vector<std::uint32_t>(around))
      forEachAligned(near, guide, [&](std::uint32_t t, double) {
        around.insert(around.end(), surface_.triangles[t].corners.begin(),
                      surface_.triangles[t].corners.end());
      });
    sortUnique(around);
    const auto [x, y] = levelset::tangents(mean);
    // Normal equations, with the right-hand side in the last column.
    std::array<std::array<double, 6>, 5> rows{};
    for (const std::uint32_t near : around) {
      const V3d p = (surface_.positions[near] - surface_.positions[vertex]) / field_.voxelSize();
      const double u = p ^ x, v = p ^ y;
      const std::array<double, 6> terms = {u, v, u * u, u * v, v * v, p ^ mean};
      for (std::size_t i = 0; i < 5; ++i)
        for (std::size_t j = 0; j < 6; ++j) rows[i][j] += terms[i] * terms[j];
    }
    const auto slopes = solved(rows);
    return slopes ? (mean - x * (*slopes)[0] - y * (*slopes)[1]).normalized() : mean;
  }

  /// First two unknowns of five equations, by elimination from the last unknown on; none where the
  /// equations are nearly dependent.
  static std::optional<std::array<double, 2>> solved(std::array<std::array<double, 6>, 5> rows) {
    constexpr double kLeastPivot = 1e-3;  // voxels² and voxels⁴, summed over the vertices
    for (std::size_t n = 5; n-- > 0;) {
      if (!(rows[n][n] > kLeastPivot)) return std::nullopt;
      for (std::size_t i = 0; i < n; ++i) {
        const double factor = rows[i][n] / rows[n][n];
        for (std::size_t j = 0; j < 6; ++j) rows[i][j] -= factor * rows[n][j];
      }
    }
    const double first = rows[0][5] / rows[0][0];
    return std::array{first, (rows[1][5] - rows[1][0] * first) / rows[1][1]};
  }

  static void sortUnique(std::vector<std::uint32_t>& numbers) {
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  }

  /// Calls add(triangle, side) for the triangles at a vertex that continue a sheet; `side` is −1
  /// for those that face the other way.
  template <typename Add>
  void forEachAligned(std::uint32_t vertex, const V3d& guide, const Add& add) const {
    for (std::uint32_t n = firstAt_[vertex]; n < firstAt_[vertex + 1]; ++n) {
      const V3d& area = areas_[trianglesAt_[n]];
      const double product = guide ^ area;
      if (std::abs(product) > kLeastSmooth * guide.length() * area.length())
        add(trianglesAt_[n], product < 0 ? -1.0 : 1.0);
    }
  }

  /// Normal that tells which triangles continue a triangle: its own, or for a sliver, where
  /// rounding decides on that, the normal of the largest triangle beside it.
  [[nodiscard]] V3d guideOf(std::size_t t) const {
    const double voxel = field_.voxelSize();
    if (areas_[t].length() >= kSliver * voxel * voxel) return areas_[t];
    V3d largest = areas_[t];
    for (const std::uint32_t v : surface_.triangles[t].corners)
      for (std::uint32_t n = firstAt_[v]; n < firstAt_[v + 1]; ++n)
        if (areas_[trianglesAt_[n]].length2() > largest.length2())
          largest = areas_[trianglesAt_[n]];
    return largest;
  }

  /// Lists the triangles at each vertex.
  void findTriangles() {
    firstAt_.assign(surface_.positions.size() + 1, 0);
    for (const auto& triangle : surface_.triangles)
      for (const std::uint32_t v : triangle.corners) ++firstAt_[v + 1];
    for (std::size_t v = 1; v < firstAt_.size(); ++v) firstAt_[v] += firstAt_[v - 1];
    trianglesAt_.resize(3 * surface_.triangles.size());
    std::vector<std::uint32_t> next = firstAt_;
    for (std::uint32_t t = 0; t < surface_.triangles.size(); ++t)
      for (const std::uint32_t v : surface_.triangles[t].corners) trianglesAt_[next[v]++] = t;
  }

  /// Continues sheets across the interfaces that they meet.
  void addBorders() {
    std::map<SheetEdge, std::vector<std::size_t>> users;  // sheet triangles at edges of junctions
    for (const levelset::JunctionEdge& edge : mesh_.junctions)
      if (edge.labels[0] != edge.labels[2] &&
          (edge.labels[0] == edge.labels[1] || edge.labels[1] == edge.labels[2]))
        users[edgeOf(numbers_[edge.vertices[0]], numbers_[edge.vertices[1]])] = {};
    if (users.empty()) return;
    for (std::size_t t = 0; t < surface_.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3 && !isStrip(sheets_[t]); ++k) {
        const auto found = users.find(sideOf(t, k));
        if (found != users.end()) found->second.push_back(3 * t + k);
      }
    // Directions in which the sheets go on.
    std::map<SheetCorner, V3d> directions;
    for (const auto& [edge, sides] : users) {
      if (sides.size() != 1) continue;
      const std::size_t t = sides[0] / 3;
      const V3d along = surface_.positions[edge.second] - surface_.positions[edge.first],
                area = areaOf(surface_.triangles[t].corners);
      V3d outwards = along.cross(area).normalized();
      const std::uint32_t opposite = surface_.triangles[t].corners[(sides[0] % 3 + 2) % 3];
      if ((outwards ^ (surface_.positions[opposite] - surface_.positions[edge.first])) > 0)
        outwards = -outwards;
      for (const std::uint32_t v : {edge.first, edge.second})
        directions.try_emplace({v, surface_.triangles[t].label}, V3d(0)).first->second +=
            outwards * area.length();
    }
    std::map<SheetCorner, std::uint32_t> ends;
    for (const auto& [corner, direction] : directions) {
      if (!(direction.length() > 0)) continue;
      const double length =
          lengthOfBorder(surface_.positions[corner.first], direction.normalized(), corner.second);
      if (length <= 0) continue;
      ends[corner] = static_cast<std::uint32_t>(surface_.positions.size());
      surface_.positions.push_back(surface_.positions[corner.first] +
                                   direction.normalized() * length);
    }
    for (const auto& [edge, sides] : users)
      if (sides.size() == 1) addBorder(sides[0] / 3, sides[0] % 3, ends);
  }

  [[nodiscard]] SheetEdge sideOf(std::size_t t, std::size_t k) const {
    const auto& corners = surface_.triangles[t].corners;
    return edgeOf(corners[k], corners[(k + 1) % 3]);
  }

  /// Distance from a vertex at an interface to a point beyond the interpolated interface, world
  /// units; 0 if the interface is not there.
  [[nodiscard]] double lengthOfBorder(const V3d& from, const V3d& direction,
                                      RegionLabel label) const {
    const double voxel = field_.voxelSize();
    if (!sampler_) sampler_.emplace(field_);
    for (double gap = 0; gap <= kLargestGap; gap += kGapStep)
      if (sampler_->label(from + direction * (gap * voxel)) != label)
        return (gap + kOverlap) * voxel;
    return 0;
  }

  void addBorder(std::size_t t, std::size_t k, const std::map<SheetCorner, std::uint32_t>& ends) {
    const SheetSurface::Triangle triangle = surface_.triangles[t];
    const std::size_t l = (k + 1) % 3;
    const std::uint32_t a = triangle.corners[k], b = triangle.corners[l];
    const auto endA = ends.find({a, triangle.label}), endB = ends.find({b, triangle.label});
    const V3f &u = triangle.normals[k], &v = triangle.normals[l];
    const auto add = [&](const std::array<std::uint32_t, 3>& corners,
                         const std::array<V3f, 3>& normals) {
      surface_.triangles.push_back({corners, triangle.label, normals});
    };
    if (endA != ends.end()) add({b, a, endA->second}, {v, u, u});
    if (endB == ends.end()) return;
    if (endA != ends.end())
      add({b, endA->second, endB->second}, {v, u, v});
    else
      add({b, a, endB->second}, {v, u, v});
  }

  const levelset::SegmentedField& field_;
  levelset::SegmentedMesh mesh_;
  std::vector<std::size_t> sheets_;     ///< triangles of the mesh
  std::vector<std::uint32_t> numbers_;  ///< by vertex of the mesh
  SheetSurface surface_;
  std::vector<V3d> areas_;  ///< by triangle: normals as long as twice the area; 0 for strips
  std::vector<std::uint32_t> firstAt_, trianglesAt_;  ///< by vertex of the surface
  mutable std::optional<levelset::SegmentedSampler> sampler_;
};

}  // namespace

std::shared_ptr<const SheetSurface> sheetSurface(const levelset::SegmentedField& field,
                                                 std::size_t maxBytes) {
  if (field.isEmpty() || !field.shared()->sheets) return nullptr;
  return SheetFinder(field, levelset::segmentedToMesh(field, {.maxMemory = maxBytes})).run();
}

}  // namespace render
