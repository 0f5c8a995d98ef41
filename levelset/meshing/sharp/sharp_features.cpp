#include "levelset/meshing/sharp/sharp_features.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include "levelset/meshing/sharp/sharp_edges.h"

namespace levelset {
namespace {

using openvdb::Vec3d;
using Triangle = MeshTriangle;

/// A mesh edge or triangle within this distance, voxels, of the edge or corner of the solid stays
/// as it is.
constexpr double kFeatureTolerance = 0.01;
/// Largest distance, voxels, of a vertex beyond an edge of its face if it is to move onto the edge.
/// Its neighbour on the other face is at least kOffEdge voxels from the plane of the first face.
constexpr double kBeyondEdge = 0.05, kOffEdge = 0.1;
/// Largest distance of a new vertex from the middle of the mesh edge or triangle that it splits,
/// voxels.
constexpr double kFeatureReach = 1.5;
/// Sheets whose normals have a larger dot product form no edge.
constexpr double kCreaseCosine = 0.88;
/// Largest number of passes of FeatureInserter::run(). Vertices that a pass inserts may require
/// others in the next pass: a corner follows after its three edges.
constexpr int kPasses = 8;
/// Least distance between two vertices at corners of the solid, voxels.
constexpr double kCornerApart = 0.1;
/// Least determinant of the three unit normals at a corner. Below it, one sheet is nearly parallel
/// to the intersection line of the other two.
constexpr double kLeastDeterminant = 0.05;
constexpr std::uint32_t kNoVertex = 0xffffffffu;

/// Plane n·x = d of a sheet.
struct SheetPlane {
  Vec3d n;
  double d;
  [[nodiscard]] double above(const Vec3d& p) const { return n.dot(p) - d; }
};

struct NewVertex {
  Vec3d position;
  VertexSheets sheets;
  double gap = 0;  ///< distance of the vertex from the mesh edge or triangle it splits, voxels
};

void addSheet(VertexSheets& sheets, const Vec3d& n) {
  if (sheets.count == VertexSheets::kMost) return;
  for (std::size_t i = 0; i < sheets.count; ++i)
    if (sheetNormal(sheets, i).dot(n) > kOneSheetCosine) return;
  sheets.normal[sheets.count++] = openvdb::Vec3f(n);
}

/// Returns the point on the intersection line of two sheets that is nearest to the middle of the
/// segment from `a` to `b`. Point `a` lies on the sheet with normal `na`, point `b` on the sheet
/// with normal `nb`. Returns none where the sheets form no edge between both points.
std::optional<Vec3d> creasePoint(const Vec3d& a, const Vec3d& na, const Vec3d& b, const Vec3d& nb) {
  const double cosine = na.dot(nb);
  if (cosine > kCreaseCosine || cosine < -kCreaseCosine) return std::nullopt;
  // Across a convex edge each point lies below the other's plane, across a concave edge above it.
  const double belowB = nb.dot(a - b), belowA = na.dot(b - a);
  if (!(belowA * belowB > 0)) return std::nullopt;
  const Vec3d middle = (a + b) * 0.5;
  const double da = na.dot(a - middle), db = nb.dot(b - middle);
  const double squaredSine = 1 - cosine * cosine;
  return middle + na * ((da - cosine * db) / squaredSine) + nb * ((db - cosine * da) / squaredSine);
}

double segmentDistance(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d along = b - a;
  const double t = std::clamp((p - a).dot(along) / along.lengthSqr(), 0.0, 1.0);
  return (p - a - along * t).length();
}

class FeatureInserter {
 public:
  FeatureInserter(IndexMesh& mesh, std::vector<VertexSheets>& sheets, const Progress& progress)
      : positions_(mesh.positions),
        triangles_(mesh.triangles),
        sheets_(sheets),
        progress_(progress) {}

  void run() {
    pullOntoEdges();
    collectCorners();
    for (int pass = 0; pass < kPasses; ++pass) {
      const auto reportProgress = [&](double done) { report(progress_, (pass + done) / kPasses); };
      reportProgress(0);
      collect();
      if (edges_.empty() && faces_.empty()) return;
      hasChanged_ = false;
      reportProgress(0.4);
      flipEdges();
      reportProgress(0.8);
      splitEdges();
      splitFaces();
      if (!hasChanged_) return;
    }
  }

 private:
  /// Moves vertices that lie on one face, slightly beyond its edge, onto the edge.
  void pullOntoEdges() {
    std::vector<std::pair<std::uint32_t, NewVertex>> moved;
    for (const Triangle& t : triangles_)
      for (std::size_t i = 0; i < 3; ++i)
        for (const std::uint32_t b : {t[(i + 1) % 3], t[(i + 2) % 3]})
          if (sheets_[t[i]].count == 1)
            if (auto vertex = onEdge(t[i], b)) moved.emplace_back(t[i], *vertex);
    std::sort(moved.begin(), moved.end(), [](const auto& p, const auto& q) {
      return std::tie(p.first, p.second.gap) < std::tie(q.first, q.second.gap);
    });
    std::uint32_t last = kNoVertex;
    for (const auto& [v, vertex] : moved) {
      if (v == last) continue;
      last = v;
      positions_[v] = vertex.position;
      sheets_[v] = vertex.sheets;
    }
  }

  /// Returns the nearest position on the edge between the sheet of vertex `a` and one of the sheets
  /// of its neighbour `b`, if `a` lies slightly beyond that edge.
  [[nodiscard]] std::optional<NewVertex> onEdge(std::uint32_t a, std::uint32_t b) const {
    const Vec3d na = sheetNormal(sheets_[a], 0), to = positions_[b] - positions_[a];
    std::optional<NewVertex> best;
    for (std::size_t i = 0; i < sheets_[b].count; ++i) {
      const Vec3d nb = sheetNormal(sheets_[b], i);
      const double cosine = na.dot(nb), above = -nb.dot(to), other = na.dot(to);
      if (std::abs(cosine) > kCreaseCosine || std::abs(above) > kBeyondEdge ||
          std::abs(other) < kOffEdge || above * other >= 0)
        continue;
      const Vec3d along = nb - na * cosine;  // in the plane of `a`
      const Vec3d shift = along * (-above / along.lengthSqr());
      if (best && best->gap <= shift.length()) continue;
      best = NewVertex{positions_[a] + shift, sheets_[a], shift.length()};
      addSheet(best->sheets, nb);
    }
    return best;
  }

  [[nodiscard]] double gapBetween(std::uint32_t a, std::uint32_t b) const {
    return sheetGap(positions_[a], sheets_[a], positions_[b], sheets_[b]);
  }

  /// Returns the vertex on an edge or corner of the solid that must split the mesh edge ab; none if
  /// the mesh edge already follows the surface.
  [[nodiscard]] std::optional<NewVertex> edgeVertex(std::uint32_t a, std::uint32_t b) const {
    if (gapBetween(a, b) < kFeatureTolerance) return std::nullopt;
    const Vec3d &pa = positions_[a], &pb = positions_[b];
    const Vec3d middle = (pa + pb) * 0.5;
    std::optional<NewVertex> best;
    double least = kFeatureReach;
    for (std::size_t i = 0; i < sheets_[a].count; ++i) {
      for (std::size_t j = 0; j < sheets_[b].count; ++j) {
        const Vec3d na = sheetNormal(sheets_[a], i), nb = sheetNormal(sheets_[b], j);
        const std::optional<Vec3d> point = creasePoint(pa, na, pb, nb);
        if (!point || (*point - middle).length() >= least) continue;
        const double gap = segmentDistance(*point, pa, pb);
        if (gap < kFeatureTolerance) continue;
        least = (*point - middle).length();
        best = NewVertex{*point, {}, gap};
        addSheet(best->sheets, na);
        addSheet(best->sheets, nb);
      }
    }
    if (best) return best;
    // The edge of the solid may end at a corner before it passes between both vertices.
    const std::array<std::uint32_t, 2> ends = {a, b};
    best = cornerOf(ends, middle);
    if (best) best->gap = segmentDistance(best->position, pa, pb);
    return best && best->gap > kFeatureTolerance ? best : std::nullopt;
  }

  /// Returns true when a triangle lies in a sheet of one of its vertices and faces the side of the
  /// sheet's normal.
  [[nodiscard]] bool fitsSheet(const Triangle& t) const {
    const Vec3d area =
        (positions_[t[1]] - positions_[t[0]]).cross(positions_[t[2]] - positions_[t[0]]);
    for (std::size_t i = 0; i < 3; ++i) {
      const VertexSheets& sheets = sheets_[t[i]];
      for (std::size_t k = 0; k < sheets.count; ++k) {
        const Vec3d n = sheetNormal(sheets, k);
        const auto isIn = [&](std::size_t j) {
          return isInSheet(n, positions_[t[j]] - positions_[t[i]], sheets_[t[j]]);
        };
        if (isIn((i + 1) % 3) && isIn((i + 2) % 3) && n.dot(area) > 0) return true;
      }
    }
    return false;
  }

  [[nodiscard]] bool isOffSheets(const Triangle& t) const {
    const bool hasFeature =
        std::any_of(t.begin(), t.end(), [this](std::uint32_t v) { return sheets_[v].count > 1; });
    const bool isKnown =
        std::all_of(t.begin(), t.end(), [this](std::uint32_t v) { return sheets_[v].count > 0; });
    return hasFeature && isKnown && !fitsSheet(t);
  }

  /// Returns the corner where the sheets of the given vertices meet. Returns none unless there are
  /// three sheets, the corner is within kFeatureReach of `near`, and no vertex lies there yet.
  [[nodiscard]] std::optional<NewVertex> cornerOf(std::span<const std::uint32_t> vertices,
                                                  const Vec3d& near) const {
    NewVertex corner;
    std::vector<SheetPlane> planes;
    for (const std::uint32_t v : vertices) {
      for (std::size_t k = 0; k < sheets_[v].count; ++k) {
        const std::uint8_t before = corner.sheets.count;
        const Vec3d n = sheetNormal(sheets_[v], k);
        addSheet(corner.sheets, n);
        if (corner.sheets.count > before) planes.push_back({n, n.dot(positions_[v])});
      }
    }
    if (planes.size() != 3) return std::nullopt;
    const Vec3d &n0 = planes[0].n, &n1 = planes[1].n, &n2 = planes[2].n;
    const double determinant = n0.dot(n1.cross(n2));
    if (std::abs(determinant) < kLeastDeterminant) return std::nullopt;
    corner.position =
        (n1.cross(n2) * planes[0].d + n2.cross(n0) * planes[1].d + n0.cross(n1) * planes[2].d) /
        determinant;
    if ((corner.position - near).length() > kFeatureReach || isTaken(corner.position))
      return std::nullopt;
    return corner;
  }

  /// Returns the vertex at a corner of the solid that must split a triangle whose sides need no
  /// vertex, or none.
  [[nodiscard]] std::optional<NewVertex> faceVertex(const Triangle& t) const {
    if (!isOffSheets(t)) return std::nullopt;
    const Vec3d &a = positions_[t[0]], &b = positions_[t[1]], &c = positions_[t[2]];
    std::optional<NewVertex> vertex = cornerOf(t, (a + b + c) / 3.0);
    if (!vertex) return std::nullopt;
    Vec3d normal = (b - a).cross(c - a);
    normal.normalize();
    vertex->gap = std::abs(normal.dot(vertex->position - a));
    if (vertex->gap < kFeatureTolerance) return std::nullopt;
    return vertex;
  }

  // === Vertices at corners of the solid, by position, so that no corner gets two vertices

  static std::array<int, 3> cornerCell(const Vec3d& p) {
    return {static_cast<int>(std::floor(p[0])), static_cast<int>(std::floor(p[1])),
            static_cast<int>(std::floor(p[2]))};
  }

  [[nodiscard]] bool isTaken(const Vec3d& p) const {
    const std::array<int, 3> low = cornerCell(p - Vec3d(kCornerApart)),
                             high = cornerCell(p + Vec3d(kCornerApart));
    for (int x = low[0]; x <= high[0]; ++x)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int z = low[2]; z <= high[2]; ++z) {
          const auto found = corners_.find({x, y, z});
          if (found == corners_.end()) continue;
          for (const std::uint32_t v : found->second)
            if ((positions_[v] - p).length() < kCornerApart) return true;
        }
    return false;
  }

  void collectCorners() {
    for (std::uint32_t v = 0; v < sheets_.size(); ++v)
      if (sheets_[v].count > 2) corners_[cornerCell(positions_[v])].push_back(v);
  }

  void collect() {
    constexpr std::size_t kChunk = 1 << 14;
    const std::size_t chunks = (triangles_.size() + kChunk - 1) / kChunk;
    std::vector<std::vector<TriangleSide>> sides(chunks);
    std::vector<std::vector<std::size_t>> faces(chunks);
    tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
      const std::size_t end = std::min(triangles_.size(), (chunk + 1) * kChunk);
      for (std::size_t i = chunk * kChunk; i < end; ++i) {
        const Triangle& t = triangles_[i];
        bool isCut = false;
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t a = std::min(t[k], t[(k + 1) % 3]),
                              b = std::max(t[k], t[(k + 1) % 3]);
          if (!edgeVertex(a, b)) continue;
          sides[chunk].push_back({a, b, i});
          isCut = true;
        }
        if (!isCut && isOffSheets(t)) faces[chunk].push_back(i);
      }
    });
    std::vector<TriangleSide> all;
    faces_.clear();
    for (std::size_t i = 0; i < chunks; ++i) {
      all.insert(all.end(), sides[i].begin(), sides[i].end());
      faces_.insert(faces_.end(), faces[i].begin(), faces[i].end());
    }
    // The sides of the triangles in faces_ are added too: a flip of a side may join its triangle to
    // a corner vertex beyond that side.
    addSides(triangles_, faces_, positions_.size(), all);
    edges_ = pairSides(std::move(all));
    for (PairedEdge& edge : edges_) {
      const std::optional<NewVertex> vertex = edgeVertex(edge.low, edge.high);
      edge.weight = vertex ? vertex->gap : 0;
    }
    std::stable_sort(edges_.begin(), edges_.end(),
                     [](const PairedEdge& a, const PairedEdge& b) { return a.weight > b.weight; });
  }

  void flipEdges() {
    if (edges_.empty()) return;
    std::unordered_set<std::uint64_t> present = edgesBeside(edges_, triangles_, positions_.size());
    touched_.assign(triangles_.size(), false);
    for (PairedEdge& edge : edges_) {
      const auto [first, second] = edge.triangle;
      if (touched_[first] || touched_[second]) continue;
      const EdgeFlip flip = flipOf(edge, triangles_, present);
      if (!flip.isPossible || !fitsSheet(flip.left) || !fitsSheet(flip.right)) continue;
      applyFlip(flip, edge, triangles_, present);
      touched_[first] = touched_[second] = hasChanged_ = true;
      edge.done = true;
    }
  }

  [[nodiscard]] std::uint32_t add(const NewVertex& vertex) {
    hasChanged_ = true;
    const auto index = static_cast<std::uint32_t>(positions_.size());
    positions_.push_back(vertex.position);
    sheets_.push_back(vertex.sheets);
    if (vertex.sheets.count > 2) corners_[cornerCell(vertex.position)].push_back(index);
    return index;
  }

  /// Inserts a vertex into each mesh edge that still cuts across an edge of the solid, and splits
  /// the triangles beside it. Triangles that a flip has changed are left to the next pass.
  void splitEdges() {
    struct Cut {
      std::size_t triangle;
      std::uint32_t low, high, vertex;
    };
    std::vector<Cut> cuts;
    for (const PairedEdge& edge : edges_) {
      const auto [first, second] = edge.triangle;
      if (edge.done || edge.weight == 0 || touched_[first] || touched_[second]) continue;
      const std::optional<NewVertex> found = edgeVertex(edge.low, edge.high);
      if (!found) continue;  // another mesh edge has got the vertex at this corner
      const std::uint32_t vertex = add(*found);
      cuts.push_back({first, edge.low, edge.high, vertex});
      cuts.push_back({second, edge.low, edge.high, vertex});
    }
    std::sort(cuts.begin(), cuts.end(), [](const Cut& a, const Cut& b) {
      return std::tie(a.triangle, a.low, a.high) < std::tie(b.triangle, b.low, b.high);
    });
    for (std::size_t i = 0, end = 0; i < cuts.size(); i = end) {
      const Triangle t = triangles_[cuts[i].triangle];
      std::array<std::uint32_t, 3> middle;  // [k]: new vertex on the side from t[k] to t[k + 1]
      middle.fill(kNoVertex);
      for (end = i; end < cuts.size() && cuts[end].triangle == cuts[i].triangle; ++end)
        for (std::size_t k = 0; k < 3; ++k)
          if (edgeKey(t[k], t[(k + 1) % 3]) == edgeKey(cuts[end].low, cuts[end].high))
            middle[k] = cuts[end].vertex;
      splitTriangle(cuts[i].triangle, t, middle, end - i);
    }
  }

  void splitTriangle(std::size_t index, const Triangle& t,
                     const std::array<std::uint32_t, 3>& middle, std::size_t count) {
    if (count == 3) {
      triangles_[index] = middle;
      for (std::size_t k = 0; k < 3; ++k)
        triangles_.push_back({t[k], middle[k], middle[(k + 2) % 3]});
      return;
    }
    std::size_t k = 0;  // side k is cut; if two sides are cut, these are k and k + 1
    while (middle[k] == kNoVertex || (count == 2 && middle[(k + 1) % 3] == kNoVertex)) ++k;
    const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3], ab = middle[k];
    if (count == 1) {
      triangles_[index] = {a, ab, c};
      triangles_.push_back({ab, b, c});
      return;
    }
    const std::uint32_t bc = middle[(k + 1) % 3];
    triangles_[index] = {ab, b, bc};
    if (gapBetween(a, bc) < gapBetween(ab, c)) {
      triangles_.push_back({a, ab, bc});
      triangles_.push_back({a, bc, c});
    } else {
      triangles_.push_back({a, ab, c});
      triangles_.push_back({ab, bc, c});
    }
  }

  void splitFaces() {
    for (const std::size_t i : faces_) {
      if (!touched_.empty() && touched_[i]) continue;
      const Triangle t = triangles_[i];
      const std::optional<NewVertex> vertex = faceVertex(t);
      if (!vertex) continue;
      const std::uint32_t v = add(*vertex);
      triangles_[i] = {t[0], t[1], v};
      triangles_.push_back({t[1], t[2], v});
      triangles_.push_back({t[2], t[0], v});
    }
    touched_.clear();
  }

  std::vector<Vec3d>& positions_;
  std::vector<Triangle>& triangles_;
  std::vector<VertexSheets>& sheets_;
  const Progress& progress_;
  /// Mesh edges that cut across an edge of the solid, with NewVertex::gap as weight, and the sides
  /// of the triangles in faces_ with weight 0.
  std::vector<PairedEdge> edges_;
  /// Triangles that lie in no sheet and of which no side cuts across an edge of the solid.
  std::vector<std::size_t> faces_;
  std::map<std::array<int, 3>, std::vector<std::uint32_t>> corners_;  ///< corner vertices by cell
  bool hasChanged_ = false;    ///< true: this pass has changed the mesh
  std::vector<bool> touched_;  ///< [triangle]: true when a flip of this pass has changed it
};

/// Removes and returns the triangles in which edges of the solid are sought, usually a small part.
/// These have a vertex with sheets, or have two vertices in common with such triangles.
std::vector<Triangle> takeFeaturePart(std::vector<Triangle>& triangles,
                                      const std::vector<VertexSheets>& sheets) {
  std::vector<bool> isNear(sheets.size());
  for (const Triangle& t : triangles)
    if (std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return sheets[v].count > 0; }))
      for (const std::uint32_t v : t) isNear[v] = true;
  std::vector<Triangle> part;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Triangle t = triangles[i];
    if (std::count_if(t.begin(), t.end(), [&](std::uint32_t v) { return isNear[v]; }) > 1)
      part.push_back(t);
    else
      triangles[kept++] = t;
  }
  triangles.resize(kept);
  return part;
}

/// Removes the vertices that no triangle uses, and their sheets.
void removeUnused(IndexMesh& mesh, std::vector<VertexSheets>& sheets) {
  std::vector<bool> isUsed(mesh.positions.size());
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) isUsed[v] = true;
  std::vector<std::uint32_t> target(mesh.positions.size());
  std::uint32_t count = 0;
  for (std::size_t v = 0; v < target.size(); ++v) {
    target[v] = count;
    if (!isUsed[v]) continue;
    mesh.positions[count] = mesh.positions[v];
    sheets[count++] = sheets[v];
  }
  if (count == target.size()) return;
  mesh.positions.resize(count);
  sheets.resize(count);
  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& v : t) v = target[v];
}

}  // namespace

double sheetGap(const Vec3d& from, const VertexSheets& fromSheets, const Vec3d& to,
                const VertexSheets& toSheets) {
  if (!fromSheets.count || !toSheets.count) return 0;
  const Vec3d along = to - from;
  double least = along.length();
  for (const VertexSheets* sheets : {&fromSheets, &toSheets})
    for (std::size_t i = 0; i < sheets->count; ++i)
      least = std::min(least, std::abs(sheetNormal(*sheets, i).dot(along)));
  return least;
}

void insertFeatures(IndexMesh& mesh, std::vector<VertexSheets>& sheets, const Progress& progress) {
  std::vector<Triangle> rest = std::move(mesh.triangles);
  mesh.triangles = takeFeaturePart(rest, sheets);
  if (mesh.triangles.empty()) {
    mesh.triangles = std::move(rest);
    return;
  }
  // Run twice: after unfoldSheets() a triangle may lack a corner vertex, because a folded triangle
  // had that vertex.
  for (const double begin : {0.0, 0.5}) {
    FeatureInserter(mesh, sheets, subProgress(progress, begin, begin + 0.3)).run();
    unfoldSheets(mesh, sheets, subProgress(progress, begin + 0.3, begin + 0.5));
  }
  mesh.triangles.insert(mesh.triangles.end(), rest.begin(), rest.end());
  removeUnused(mesh, sheets);
}

}  // namespace levelset
