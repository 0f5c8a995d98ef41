#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>

#include "levelset/meshing/sharp/sharp_evidence.h"
#include "levelset/meshing/sharp/sharp_vertices.h"
#include "levelset/progress_gate.h"

namespace levelset {
namespace {

using openvdb::Vec3d;

/// Inner and outer radius, voxels, of the ring around a feature in which the surface must lie in
/// the planes of the feature's sheets.
constexpr double kRingBegin = 0.8, kRingEnd = 2.3;
/// Largest share of the ring's area that may deviate from the sheets. A triangle deviates if its
/// normal differs from those of the sheets by more than the share kTurn of the angle between the
/// sheets. On a round surface most of the ring deviates, since the normal continues to turn.
constexpr double kOddPart = 0.15, kTurn = 0.35;
/// A triangle of the ring also deviates if it is further than this from the plane of its sheet,
/// voxels.
constexpr double kOffFace = 0.35;
/// A vertex further than this, in voxels, from a plane to which it was fitted is torn: two surfaces
/// run through its cell, and it lies on neither.
constexpr double kTorn = 0.3;
/// A sheet is flat where second differences of the field, in voxels, are below this share of the
/// angle between the feature's sheets, in radians.
constexpr double kFlatBend = 0.06;
/// A plane from a part of the field with second differences above kBent, voxels, is replaced by a
/// plane nearby. The second differences there must be smaller by the factor kFlatter.
constexpr double kBent = 0.005, kFlatter = 4;
/// Largest distance of the replacing plane from the vertex, voxels, so that both planes belong to
/// the same face. It also limits the resulting displacement of the vertex.
constexpr double kSameFace = 0.3;
/// Vertices within this distance of a corner, voxels, do not count as evidence of an edge, since a
/// third sheet may be nearer there.
constexpr double kCornerReach = 2;
/// Distance, voxels, within which connected vertices count as beside a feature.
constexpr double kBeside = 3;

/// Triangles at each vertex of a mesh.
class Fans {
 public:
  explicit Fans(const IndexMesh& mesh) : begin_(mesh.positions.size() + 1) {
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t v : triangle) ++begin_[v + 1];
    for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
    triangles_.resize(mesh.triangles.size() * 3);
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      for (const std::uint32_t v : mesh.triangles[t]) triangles_[next[v]++] = t;
  }
  [[nodiscard]] std::span<const std::uint32_t> at(std::uint32_t vertex) const {
    return {triangles_.data() + begin_[vertex], begin_[vertex + 1] - begin_[vertex]};
  }

 private:
  std::vector<std::size_t> begin_;
  std::vector<std::uint32_t> triangles_;
};

/// Set of numbers: a hash table that keeps its memory when it is cleared.
class NumberSet {
 public:
  void clear() { ++round_, count_ = 0; }
  /// Adds a number. @return false if the set had it already
  bool insert(std::uint32_t number) {
    if (2 * ++count_ > slots_.size()) grow();
    for (std::size_t i = number * std::size_t{2654435761};; ++i) {
      Slot& slot = slots_[i % slots_.size()];
      if (slot.round != round_) return slot = {round_, number}, true;
      if (slot.number == number) return --count_, false;
    }
  }

 private:
  struct Slot {
    std::uint64_t round = 0;
    std::uint32_t number = 0;
  };
  void grow() {
    const std::vector<Slot> old = std::move(slots_);
    slots_.assign(2 * old.size(), {});
    count_ = 1;
    for (const Slot& slot : old)
      if (slot.round == round_) insert(slot.number);
  }

  std::vector<Slot> slots_ = std::vector<Slot>(256);
  std::uint64_t round_ = 1;
  std::size_t count_ = 0;
};

/// Returns the triangles that are connected to a vertex by mesh edges through vertices within
/// `radius` voxels of it.
std::vector<std::uint32_t> trianglesNear(const IndexMesh& mesh, const Fans& fans,
                                         std::uint32_t vertex, double radius) {
  thread_local NumberSet isFound, isReached;
  isFound.clear();
  isReached.clear();
  isReached.insert(vertex);
  const Vec3d centre = mesh.positions[vertex];
  std::vector<std::uint32_t> vertices{vertex}, found;
  for (std::size_t i = 0; i < vertices.size(); ++i)
    for (const std::uint32_t t : fans.at(vertices[i])) {
      if (!isFound.insert(t)) continue;
      found.push_back(t);
      for (const std::uint32_t v : mesh.triangles[t])
        if ((mesh.positions[v] - centre).lengthSqr() < radius * radius && isReached.insert(v))
          vertices.push_back(v);
    }
  return found;
}

/// Returns the widest angle between the normals of two of the sheets, radians.
double widestAngle(const VertexSheets& sheets) {
  double least = 1;
  for (std::size_t i = 0; i < sheets.count; ++i)
    for (std::size_t j = 0; j < i; ++j)
      least = std::min(least, sheetNormal(sheets, i).dot(sheetNormal(sheets, j)));
  return std::acos(std::clamp(least, -1.0, 1.0));
}

/// Returns true when each sheet of a feature is flat at some vertex of the given triangles. A round
/// surface that turns by the same angle within one cell has second differences of at least 2 ·
/// kFlatBend · angle (voxels, radians) everywhere.
bool hasFlatSheets(const IndexMesh& mesh, std::span<const std::uint32_t> triangles,
                   std::uint32_t feature, const std::vector<VertexSheets>& sheets,
                   const std::vector<SheetQuality>& quality) {
  const VertexSheets& own = sheets[feature];
  const double angle = widestAngle(own), turn = std::cos(kTurn * angle);
  unsigned flat = 0;
  for (const std::uint32_t t : triangles)
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (quality[v].bend > kFlatBend * angle) continue;
      for (std::size_t i = 0; i < own.count; ++i)
        for (std::size_t k = 0; k < sheets[v].count; ++k)
          if (sheetNormal(own, i).dot(sheetNormal(sheets[v], k)) > turn) flat |= 1u << i;
    }
  return flat + 1 == 1u << own.count;
}

/// Returns true when the surface in a ring around a feature lies in the planes of its sheets.
bool isConfirmed(const IndexMesh& mesh, const Fans& fans, std::uint32_t vertex,
                 const VertexSheets& sheets, const std::vector<SheetQuality>& quality) {
  const double turn = std::cos(kTurn * widestAngle(sheets));
  double area = 0, odd = 0;
  for (const std::uint32_t t : trianglesNear(mesh, fans, vertex, kRingEnd)) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3d p = mesh.positions[a];
    const Vec3d middle = (p + mesh.positions[b] + mesh.positions[c]) / 3;
    if ((middle - mesh.positions[vertex]).length() < kRingBegin) continue;
    const Vec3d normal = (mesh.positions[b] - p).cross(mesh.positions[c] - p);
    const double size = normal.length();
    const auto& triangle = mesh.triangles[t];
    const bool isTorn = std::any_of(triangle.begin(), triangle.end(),
                                    [&](std::uint32_t v) { return quality[v].misfit > kTorn; });
    bool isIn = false, isFar = false;
    for (std::size_t i = 0; i < sheets.count; ++i) {
      const Vec3d n = sheetNormal(sheets, i);
      const double cosine = normal.dot(n);
      isIn |= cosine >= turn * size && std::abs(n.dot(middle - mesh.positions[vertex])) < kOffFace;
      isFar |= cosine < -turn * size;
    }
    // The opposite side of a thin plate neither confirms nor refutes the sheets.
    if (isFar && !isIn && !isTorn) continue;
    area += size;
    if (!isIn || isTorn) odd += size;
  }
  return area > 0 && odd <= kOddPart * area;
}

/// Returns true when two vertices have two sheets each, and each sheet of one vertex is also a
/// sheet of the other.
bool areSameSheets(const VertexSheets& a, const VertexSheets& b) {
  if (a.count != 2 || b.count != 2) return false;
  const auto match = [&](std::size_t i, std::size_t j) {
    return sheetNormal(a, i).dot(sheetNormal(b, j)) > kOneSheetCosine;
  };
  return (match(0, 0) && match(1, 1)) || (match(0, 1) && match(1, 0));
}

/// Returns true when the field values around an edge show that it is not rounded. Considers the
/// vertices of the given triangles on the same edge as `feature`. Vertices near a corner count only
/// if no other vertex has evidence, since a third sheet affects the values near a corner.
bool isSharp(const IndexMesh& mesh, std::span<const std::uint32_t> triangles, std::uint32_t feature,
             const std::vector<VertexSheets>& sheets, const std::vector<EdgeEvidence>& evidence) {
  std::vector<std::uint32_t> edge, corners;
  for (const std::uint32_t t : triangles)
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (areSameSheets(sheets[v], sheets[feature])) edge.push_back(v);
      if (sheets[v].count > 2) corners.push_back(v);
    }
  for (auto* list : {&edge, &corners}) {
    std::sort(list->begin(), list->end());
    list->erase(std::unique(list->begin(), list->end()), list->end());
  }
  EdgeEvidence all, apart;
  for (const std::uint32_t v : edge) {
    all.add(evidence[v]);
    if (std::none_of(corners.begin(), corners.end(), [&](std::uint32_t corner) {
          return (mesh.positions[v] - mesh.positions[corner]).length() < kCornerReach;
        }))
      apart.add(evidence[v]);
  }
  return apart.points[0] + apart.points[1] ? apart.isSharp() : all.isSharp();
}

/// Normal of a sheet, as estimated at one vertex.
struct SheetEstimate {
  std::uint32_t vertex;
  Vec3d normal;
};

/// Returns another vertex's estimate of the sheet of `own`, from the nearest of the given
/// triangles' vertices where the field is much flatter; `own` if there is none.
SheetEstimate flatterSheet(const IndexMesh& mesh, std::span<const std::uint32_t> triangles,
                           const SheetEstimate& own, const std::vector<VertexSheets>& sheets,
                           const std::vector<SheetQuality>& quality) {
  const Vec3d position = mesh.positions[own.vertex];
  SheetEstimate best = own;
  double least = kBeside * kBeside;
  for (const std::uint32_t t : triangles)
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (quality[v].bend * kFlatter > quality[own.vertex].bend ||
          quality[v].misfit > kFeatureMisfit)
        continue;
      const Vec3d to = mesh.positions[v] - position;
      for (std::size_t k = 0; k < sheets[v].count; ++k) {
        const Vec3d n = sheetNormal(sheets[v], k);
        if (n.dot(own.normal) < kOneSheetCosine || std::abs(n.dot(to)) > kSameFace ||
            std::pair(to.lengthSqr(), v) >= std::pair(least, best.vertex))
          continue;
        least = to.lengthSqr();
        best = {v, n};
      }
    }
  return best;
}

void takeFlatterPlanes(IndexMesh& mesh, const Fans& fans, std::vector<VertexSheets>& sheets,
                       const std::vector<SheetQuality>& quality,
                       const std::vector<bool>& isBeside) {
  std::vector<std::uint32_t> bent;
  for (std::uint32_t v = 0; v < sheets.size(); ++v)
    if (isBeside[v] && sheets[v].count && quality[v].bend > kBent) bent.push_back(v);
  std::vector<std::pair<Vec3d, VertexSheets>> moved(bent.size());
  tbb::parallel_for(std::size_t{0}, bent.size(), [&](std::size_t i) {
    const std::uint32_t v = bent[i];
    moved[i] = {mesh.positions[v], sheets[v]};
    const auto near = trianglesNear(mesh, fans, v, kBeside);
    std::vector<FacePlane> planes;
    for (std::size_t k = 0; k < sheets[v].count; ++k) {
      const auto [on, n] =
          flatterSheet(mesh, near, {v, sheetNormal(sheets[v], k)}, sheets, quality);
      moved[i].second.normal[k] = openvdb::Vec3f(n);
      planes.push_back({{n[0], n[1], n[2]}, n.dot(mesh.positions[on])});
    }
    const Vec3d& p = mesh.positions[v];
    const Eigen::Vector3d fitted = fitPlanes(planes, {p[0], p[1], p[2]});
    const Vec3d target(fitted.x(), fitted.y(), fitted.z());
    if ((target - p).length() > kSameFace)
      moved[i].second = sheets[v];
    else
      moved[i].first = target;
  });
  for (std::size_t i = 0; i < bent.size(); ++i)
    std::tie(mesh.positions[bent[i]], sheets[bent[i]]) = moved[i];
}

}  // namespace

std::vector<bool> confirmFeatures(IndexMesh& mesh, const openvdb::FloatGrid& field,
                                  std::vector<VertexSheets>& sheets,
                                  const std::vector<SheetQuality>& quality,
                                  const Progress& progress) {
  std::vector<bool> isBeside(mesh.positions.size());
  std::vector<std::uint32_t> features;
  for (std::uint32_t v = 0; v < sheets.size(); ++v)
    if (sheets[v].count > 1 && quality[v].misfit <= kFeatureMisfit) features.push_back(v);
  if (features.empty()) return isBeside;
  report(progress, 0);
  const Fans fans(mesh);
  report(progress, 0.2);
  const Progress asked = subProgress(progress, 0.2, 1);
  ProgressGate gate(asked, 2 * features.size());
  std::vector<EdgeEvidence> evidence(mesh.positions.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, features.size(), 64),
                    [&](const auto& range) {
                      const auto accessor = field.getConstAccessor();
                      for (std::size_t i = range.begin(); i != range.end(); ++i) {
                        const std::uint32_t v = features[i];
                        if (sheets[v].count == 2)
                          evidence[v] = edgeEvidence(mesh.positions[v], sheets[v], field, accessor);
                      }
                      gate.advance(range.size());
                    });
  std::vector<std::vector<std::uint32_t>> near(features.size());
  std::vector<char> isSure(features.size()), isEdge(mesh.positions.size());
  tbb::parallel_for(std::size_t{0}, features.size(), [&](std::size_t i) {
    const std::uint32_t v = features[i];
    near[i] = trianglesNear(mesh, fans, v, kBeside);
    const bool mayBeEdge = isSharp(mesh, near[i], v, sheets, evidence);
    isSure[i] = (mayBeEdge || sheets[v].count > 2) &&
                hasFlatSheets(mesh, near[i], v, sheets, quality) &&
                isConfirmed(mesh, fans, v, sheets[v], quality);
    isEdge[v] = isSure[i] && mayBeEdge;
    if (!isSure[i]) near[i] = {};
    gate.advance(1);
  });
  // The values at a corner depend on three sheets, so they are not compared with those of a sharp
  // edge. A corner is accepted if an accepted edge ends there.
  const auto touchesEdge = [&](std::uint32_t t) {
    const auto& [a, b, c] = mesh.triangles[t];
    return isEdge[a] || isEdge[b] || isEdge[c];
  };
  for (std::size_t i = 0; i < features.size(); ++i) {
    const bool isCorner = isSure[i] && sheets[features[i]].count > 2 &&
                          std::any_of(near[i].begin(), near[i].end(), touchesEdge);
    if (!isCorner && !isEdge[features[i]]) continue;
    for (const std::uint32_t t : near[i])
      for (const std::uint32_t v : mesh.triangles[t]) isBeside[v] = true;
  }
  takeFlatterPlanes(mesh, fans, sheets, quality, isBeside);
  return isBeside;
}

}  // namespace levelset
