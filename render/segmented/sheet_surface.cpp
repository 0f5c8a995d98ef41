#include "render/segmented/sheet_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

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

  /// Sets the normal of each corner: the sum over the triangles there that make one smooth sheet,
  /// weighted by area. A sheet may have no orientation, so each triangle turns the others to its
  /// side.
  void setNormals() {
    std::vector<V3d> areas;
    for (std::size_t t = 0; t < sheets_.size(); ++t)
      areas.push_back(isStrip(sheets_[t]) ? V3d(0) : areaOf(surface_.triangles[t].corners));
    findTriangles();
    tbb::parallel_for(std::size_t{0}, sheets_.size(), [&](std::size_t t) {
      if (isStrip(sheets_[t])) return;
      SheetSurface::Triangle& triangle = surface_.triangles[t];
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = triangle.corners[k];
        const V3d own = guideOf(t, areas);
        V3d sum(0);
        for (std::uint32_t n = firstAt_[v]; n < firstAt_[v + 1]; ++n) {
          const V3d& other = areas[trianglesAt_[n]];
          const double product = own ^ other;
          if (std::abs(product) < kLeastSmooth * own.length() * other.length()) continue;
          sum += product < 0 ? -other : other;
        }
        triangle.normals[k] = V3f(sum.normalized());
      }
    });
  }

  /// Normal that tells which triangles continue a triangle: its own, or for a sliver, where
  /// rounding decides on that, the normal of the largest triangle beside it.
  [[nodiscard]] V3d guideOf(std::size_t t, const std::vector<V3d>& areas) const {
    const double voxel = field_.voxelSize();
    if (areas[t].length() >= kSliver * voxel * voxel) return areas[t];
    V3d largest = areas[t];
    for (const std::uint32_t v : surface_.triangles[t].corners)
      for (std::uint32_t n = firstAt_[v]; n < firstAt_[v + 1]; ++n)
        if (areas[trianglesAt_[n]].length2() > largest.length2()) largest = areas[trianglesAt_[n]];
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
