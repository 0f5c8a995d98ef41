#include "levelset/deform/creases/fit_creases.h"

#include <openvdb/tools/Morphology.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <unordered_set>
#include <utility>

#include "levelset/deform/creases/face_fit.h"
#include "levelset/geometry/mesh_sides.h"
#include "levelset/geometry/search/triangle_search.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/meshing/cells/divide_sides.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::Vec3d;

constexpr std::uint32_t kNone = 0xffffffffu;
/// Radius of the part of a face that a fit reads, voxels along the face.
constexpr double kFitReach = 3.5;
/// Least distance of a closest point from a crease, voxels. Nearer ones may belong to both faces.
constexpr double kFromCrease = 0.5;
/// Largest difference between the distance from the mesh and that of the field, voxels.
constexpr double kSameDistance = 0.25;
/// Distance from a crease up to which vertices move onto a fit, voxels. Farther away the vertices
/// of CreasePatches do not depend on the crease.
constexpr double kMovedReach = 2.5;
/// Longest move of a vertex, voxels.
constexpr double kLongestMove = 0.5;
/// Steps and tolerance of the intersection of faces, voxels.
constexpr int kIntersectionSteps = 8;
constexpr double kIntersectionTolerance = 1e-6;
/// Largest distance of a corner from its faces. More than three faces need not meet in one point.
constexpr double kCornerTolerance = 0.05;

/// Face beside a vertex on a crease.
struct CreaseSector {
  std::vector<std::uint32_t> triangles = {};  ///< around the vertex
  std::optional<FaceFit> fit = {};
};

/// Vertex on a crease with its faces.
struct CreasedVertex {
  std::uint32_t vertex = 0;
  std::vector<CreaseSector> sectors = {};
  Vec3d moved = Vec3d(0.0);  ///< intersection of the faces
  bool isFitted = false;     ///< `moved` is valid
};

/// Vertex beside a crease that a fit can move.
struct FitCandidate {
  std::uint32_t vertex = 0;
  double squared = 0;                  ///< squared distance from the vertex on the crease
  std::uint32_t slot = 0, sector = 0;  ///< place of the fit
};

class CreaseFitter {
 public:
  CreaseFitter(CreasedMesh& mesh, const openvdb::FloatGrid& grid) : mesh_(mesh), grid_(grid) {
    findNeighbours();
    findVertices();
    collectSamples();
  }

  void run() {
    std::vector<std::vector<FitCandidate>> candidates(vertices_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, vertices_.size(), 8),
                      [&](const auto& range) {
                        for (std::size_t n = range.begin(); n != range.end(); ++n)
                          fitVertex(static_cast<std::uint32_t>(n), candidates[n]);
                      });
    chooseFits(candidates);
    moveVertices();
  }

  /// Returns the mesh with sides near creases halved, on the fits.
  [[nodiscard]] CreasedMesh divided() const;

 private:
  struct SampleOf {
    std::uint32_t triangle;
    FaceSample sample;
  };

  [[nodiscard]] bool isCrease(std::uint32_t a, std::uint32_t b) const {
    const std::array<std::uint32_t, 2> edge{std::min(a, b), std::max(a, b)};
    return std::binary_search(mesh_.creases.begin(), mesh_.creases.end(), edge);
  }
  [[nodiscard]] Vec3d areaNormal(std::uint32_t triangle) const {
    const auto& [a, b, c] = mesh_.triangles[triangle];
    return (mesh_.positions[b] - mesh_.positions[a]).cross(mesh_.positions[c] - mesh_.positions[a]);
  }
  void findNeighbours();
  void findVertices();
  void findSectors(CreasedVertex& vertex, const std::vector<std::uint32_t>& around) const;
  void collectSamples();
  void fitVertex(std::uint32_t slot, std::vector<FitCandidate>& candidates);
  void intersect(CreasedVertex& vertex) const;
  void chooseFits(const std::vector<std::vector<FitCandidate>>& candidates);
  void moveVertices();
  [[nodiscard]] std::optional<Vec3d> middleOf(const MeshSide& side) const;
  [[nodiscard]] const FaceFit* fitBeside(std::uint32_t vertex, std::uint32_t triangle) const;

  CreasedMesh& mesh_;
  const openvdb::FloatGrid& grid_;
  std::vector<MeshSide> sides_;
  std::vector<std::array<std::uint32_t, 3>> neighbours_;  ///< across the side, none across creases
  std::vector<std::uint32_t> slots_;                      ///< index in vertices_, or kNone
  std::vector<CreasedVertex> vertices_;
  std::vector<std::size_t> firstSample_;  ///< number of the first one of each triangle
  std::vector<FaceSample> samples_;       ///< by triangle
  std::vector<FitCandidate> chosen_;      ///< by vertex
};

void CreaseFitter::findNeighbours() {
  sides_ = sortedSides(mesh_.triangles);
  neighbours_.assign(mesh_.triangles.size(), {kNone, kNone, kNone});
  forEachEdge(sides_, [&](auto first, auto end) {
    if (end - first != 2 || isCrease(first->low, first->high)) return;
    neighbours_[first[0].triangle][first[0].corner] = first[1].triangle;
    neighbours_[first[1].triangle][first[1].corner] = first[0].triangle;
  });
}

void CreaseFitter::findVertices() {
  slots_.assign(mesh_.positions.size(), kNone);
  for (const auto& edge : mesh_.creases)
    for (const std::uint32_t v : edge) slots_[v] = 0;
  for (std::uint32_t v = 0; v < slots_.size(); ++v) {
    if (slots_[v] == kNone) continue;
    slots_[v] = static_cast<std::uint32_t>(vertices_.size());
    vertices_.push_back({.vertex = v});
  }
  std::vector<std::vector<std::uint32_t>> around(vertices_.size());
  for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
    for (const std::uint32_t v : mesh_.triangles[t])
      if (slots_[v] != kNone) around[slots_[v]].push_back(t);
  for (CreasedVertex& vertex : vertices_) findSectors(vertex, around[slots_[vertex.vertex]]);
}

/// Groups the triangles around a vertex that no crease separates.
void CreaseFitter::findSectors(CreasedVertex& vertex,
                               const std::vector<std::uint32_t>& around) const {
  std::vector<bool> isTaken(around.size(), false);
  for (std::size_t n = 0; n < around.size(); ++n) {
    if (isTaken[n]) continue;
    CreaseSector sector;
    std::vector<std::size_t> open{n};
    isTaken[n] = true;
    while (!open.empty()) {
      const std::uint32_t t = around[open.back()];
      open.pop_back();
      sector.triangles.push_back(t);
      for (std::size_t k = 0; k < 3; ++k) {
        const auto& corners = mesh_.triangles[t];
        if (corners[k] != vertex.vertex && corners[(k + 1) % 3] != vertex.vertex) continue;
        const auto found = std::find(around.begin(), around.end(), neighbours_[t][k]);
        if (found == around.end()) continue;
        const auto other = static_cast<std::size_t>(found - around.begin());
        if (isTaken[other]) continue;
        isTaken[other] = true;
        open.push_back(other);
      }
    }
    vertex.sectors.push_back(std::move(sector));
  }
}

/// Finds the closest triangle of each grid point near a crease.
void CreaseFitter::collectSamples() {
  const double voxelSize = grid_.voxelSize()[0];
  openvdb::MaskTree near;
  for (const CreasedVertex& vertex : vertices_)
    near.setValueOn(Coord::floor(mesh_.positions[vertex.vertex]));
  constexpr int kReach = 5, kTriangleReach = 5;  // reach of a fit and of the band, and its foot
  openvdb::tools::dilateActiveValues(near, kReach, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::EXPAND_TILES);
  openvdb::MaskTree wide(near);
  openvdb::tools::dilateActiveValues(wide, kTriangleReach, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::EXPAND_TILES);
  std::vector<TriangleItem> items;
  for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh_.triangles[t];
    if (!wide.isValueOn(Coord::floor(mesh_.positions[a]))) continue;
    items.push_back(
        {{toImath(mesh_.positions[a]), toImath(mesh_.positions[b]), toImath(mesh_.positions[c])},
         t});
  }
  const TriangleSearch surface(std::move(items));
  std::vector<TriangleItem> edges;
  for (const auto& [a, b] : mesh_.creases)
    edges.push_back(
        {{toImath(mesh_.positions[a]), toImath(mesh_.positions[b]), toImath(mesh_.positions[b])},
         static_cast<std::uint32_t>(edges.size())});
  const TriangleSearch creases(std::move(edges));

  std::vector<const openvdb::FloatTree::LeafNodeType*> leaves;
  near.voxelizeActiveTiles();
  for (auto it = near.cbeginLeaf(); it; ++it)
    if (const auto* leaf = grid_.tree().probeConstLeaf(it->origin())) leaves.push_back(leaf);
  std::vector<std::vector<SampleOf>> found(leaves.size());
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t n) {
    const auto* mask = near.probeConstLeaf(leaves[n]->origin());
    for (auto it = leaves[n]->cbeginValueOn(); it; ++it) {
      if (!mask->isValueOn(it.pos())) continue;
      const double distance = static_cast<double>(*it) / voxelSize;
      const Imath::V3d at = toImath(it.getCoord().asVec3d());
      const double limit = std::abs(distance) + kSameDistance;
      const auto [closest, item] = surface.closestItem(at, limit * limit);
      if (!item || !(std::sqrt(closest.squared) > std::abs(distance) - kSameDistance)) continue;
      const Imath::V3d foot = item->closestPoint(at);
      if (creases.closestItem(foot, kFromCrease * kFromCrease).second) continue;
      found[n].push_back({item->index, {toVdb(at), distance, toVdb(foot)}});
    }
  });
  std::vector<SampleOf> all;
  for (auto& list : found) all.insert(all.end(), list.begin(), list.end());
  std::stable_sort(all.begin(), all.end(),
                   [](const SampleOf& a, const SampleOf& b) { return a.triangle < b.triangle; });
  firstSample_.assign(mesh_.triangles.size() + 1, 0);
  for (const SampleOf& sample : all) {
    ++firstSample_[sample.triangle + 1];
    samples_.push_back(sample.sample);
  }
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) firstSample_[t + 1] += firstSample_[t];
}

void CreaseFitter::fitVertex(std::uint32_t slot, std::vector<FitCandidate>& candidates) {
  CreasedVertex& vertex = vertices_[slot];
  const Vec3d& origin = mesh_.positions[vertex.vertex];
  for (std::uint32_t s = 0; s < vertex.sectors.size(); ++s) {
    CreaseSector& sector = vertex.sectors[s];
    // The part of the face around the vertex.
    std::vector<std::uint32_t> part = sector.triangles;
    std::unordered_set<std::uint32_t> isKnown(part.begin(), part.end());
    std::vector<FaceSample> samples;
    Vec3d normal(0.0);
    double side = 0;
    for (std::size_t n = 0; n < part.size(); ++n) {
      const std::uint32_t t = part[n];
      const auto& corners = mesh_.triangles[t];
      const Vec3d centre = (mesh_.positions[corners[0]] + mesh_.positions[corners[1]] +
                            mesh_.positions[corners[2]]) /
                           3.0;
      if ((centre - origin).lengthSqr() > kFitReach * kFitReach) continue;
      const Vec3d area = areaNormal(t);
      normal += area;
      for (std::size_t k = firstSample_[t]; k < firstSample_[t + 1]; ++k) {
        samples.push_back(samples_[k]);
        side += (samples_[k].position - samples_[k].foot).dot(area) * samples_[k].distance;
      }
      for (const std::uint32_t next : neighbours_[t])
        if (next != kNone && isKnown.insert(next).second) part.push_back(next);
    }
    if (!normal.normalize()) continue;
    if (side < 0) normal = -normal;
    sector.fit = FaceFit::make(origin, normal, kFitReach, samples);
    if (!sector.fit) continue;
    for (const std::uint32_t t : part)
      for (const std::uint32_t v : mesh_.triangles[t]) {
        const double squared = (mesh_.positions[v] - origin).lengthSqr();
        if (slots_[v] == kNone && squared < kMovedReach * kMovedReach)
          candidates.push_back({v, squared, slot, s});
      }
  }
  intersect(vertex);
}

void CreaseFitter::intersect(CreasedVertex& vertex) const {
  const std::size_t count = vertex.sectors.size();
  if (count < 2) return;
  for (const CreaseSector& sector : vertex.sectors)
    if (!sector.fit) return;
  const Vec3d start = mesh_.positions[vertex.vertex];
  Vec3d point = start;
  Eigen::MatrixXd slopes(count, 3);
  Eigen::VectorXd heights(count);
  double last = INFINITY;
  for (int step = 0; step < kIntersectionSteps && last > kIntersectionTolerance; ++step) {
    for (std::size_t s = 0; s < count; ++s) {
      const FaceFit::Value at = vertex.sectors[s].fit->valueAt(point);
      const auto row = static_cast<Eigen::Index>(s);
      const double length = at.gradient.length();
      heights[row] = at.height / length;
      slopes.row(row) << at.gradient[0] / length, at.gradient[1] / length, at.gradient[2] / length;
    }
    const Eigen::Vector3d change = slopes.completeOrthogonalDecomposition().solve(heights);
    point -= Vec3d(change.x(), change.y(), change.z());
    last = change.norm();
    if (!((point - start).length() < kLongestMove)) return;
  }
  if (!(last < kIntersectionTolerance)) return;
  for (const CreaseSector& sector : vertex.sectors)
    if (std::abs(sector.fit->valueAt(point).height) > kCornerTolerance) return;
  vertex.moved = point;
  vertex.isFitted = true;
}

/// Chooses the fit of the nearest vertex on a crease for each vertex beside creases.
void CreaseFitter::chooseFits(const std::vector<std::vector<FitCandidate>>& candidates) {
  for (std::size_t n = 0; n < vertices_.size(); ++n)
    if (vertices_[n].isFitted)
      chosen_.insert(chosen_.end(), candidates[n].begin(), candidates[n].end());
  std::sort(chosen_.begin(), chosen_.end(), [](const FitCandidate& a, const FitCandidate& b) {
    return std::tie(a.vertex, a.squared, a.slot, a.sector) <
           std::tie(b.vertex, b.squared, b.slot, b.sector);
  });
  chosen_.erase(std::unique(chosen_.begin(), chosen_.end(),
                            [](const FitCandidate& a, const FitCandidate& b) {
                              return a.vertex == b.vertex;
                            }),
                chosen_.end());
}

void CreaseFitter::moveVertices() {
  std::erase_if(chosen_, [&](const FitCandidate& choice) {
    const Vec3d moved = vertices_[choice.slot].sectors[choice.sector].fit->projected(
        mesh_.positions[choice.vertex]);
    const bool isFar = !((moved - mesh_.positions[choice.vertex]).length() < kLongestMove);
    if (!isFar) mesh_.positions[choice.vertex] = moved;
    return isFar;
  });
  for (const CreasedVertex& vertex : vertices_)
    if (vertex.isFitted) mesh_.positions[vertex.vertex] = vertex.moved;
}

/// Fit of the face of a triangle at one of its corners; null without one.
const FaceFit* CreaseFitter::fitBeside(std::uint32_t vertex, std::uint32_t triangle) const {
  if (slots_[vertex] != kNone) {
    const CreasedVertex& creased = vertices_[slots_[vertex]];
    if (!creased.isFitted) return nullptr;
    for (const CreaseSector& sector : creased.sectors)
      if (std::find(sector.triangles.begin(), sector.triangles.end(), triangle) !=
          sector.triangles.end())
        return &*sector.fit;
    return nullptr;
  }
  const auto found = std::lower_bound(
      chosen_.begin(), chosen_.end(), vertex,
      [](const FitCandidate& choice, std::uint32_t v) { return choice.vertex < v; });
  if (found == chosen_.end() || found->vertex != vertex) return nullptr;
  return &*vertices_[found->slot].sectors[found->sector].fit;
}

/// Middle of a side on its face, or on the crease if it lies on one; empty without fits.
std::optional<Vec3d> CreaseFitter::middleOf(const MeshSide& side) const {
  const Vec3d straight = (mesh_.positions[side.low] + mesh_.positions[side.high]) * 0.5;
  if (isCrease(side.low, side.high)) {
    for (const std::uint32_t v : {side.low, side.high}) {
      const CreasedVertex& creased = vertices_[slots_[v]];
      if (!creased.isFitted || creased.sectors.size() != 2) continue;
      Vec3d point = straight;
      for (int step = 0; step < kIntersectionSteps; ++step) {
        const FaceFit::Value a = creased.sectors[0].fit->valueAt(point),
                             b = creased.sectors[1].fit->valueAt(point);
        const double aa = a.gradient.lengthSqr(), bb = b.gradient.lengthSqr(),
                     ab = a.gradient.dot(b.gradient), determinant = aa * bb - ab * ab;
        if (!(determinant > 1e-3 * aa * bb)) return {};
        point -= a.gradient * ((bb * a.height - ab * b.height) / determinant) +
                 b.gradient * ((aa * b.height - ab * a.height) / determinant);
      }
      if ((point - straight).length() < kLongestMove) return point;
    }
    return {};
  }
  const FaceFit* fit = fitBeside(side.low, side.triangle);
  if (slots_[side.low] != kNone || !fit)
    if (const FaceFit* other = fitBeside(side.high, side.triangle)) fit = other;
  if (!fit) return {};
  const Vec3d point = fit->projected(straight);
  if (!((point - straight).length() < kLongestMove)) return {};
  return point;
}

CreasedMesh CreaseFitter::divided() const {
  std::vector<SideMiddle> middles;
  CreasedMesh result;
  forEachEdge(sides_, [&](auto first, auto) {
    const std::optional<Vec3d> middle = middleOf(*first);
    if (isCrease(first->low, first->high)) {
      const auto number = static_cast<std::uint32_t>(mesh_.positions.size() + middles.size());
      if (middle) {
        result.creases.push_back({first->low, number});
        result.creases.push_back({first->high, number});
      } else {
        result.creases.push_back({first->low, first->high});
      }
    }
    if (middle) middles.push_back({first->low, first->high, *middle});
  });
  std::sort(result.creases.begin(), result.creases.end());
  static_cast<IndexMesh&>(result) = divideSides(mesh_, middles);
  return result;
}

}  // namespace

CreasedMesh fitCreases(CreasedMesh mesh, const openvdb::FloatGrid& grid, std::size_t maxMemory,
                       const Progress& progress) {
  report(progress, 0);
  // A triangle has sides, neighbours and a place in the search. About 120 grid points lie beside a
  // crease edge, each with samples in three lists.
  constexpr double kTriangleBytes = 220, kEdgeBytes = 120 * 184;
  requireMemory(kTriangleBytes * static_cast<double>(mesh.triangles.size()) +
                    kEdgeBytes * static_cast<double>(mesh.creases.size()),
                memoryLeft(memoryLimit(maxMemory)));
  CreaseFitter fitter(mesh, grid);
  report(progress, 0.3);
  fitter.run();
  report(progress, 0.9);
  return fitter.divided();
}

}  // namespace levelset
