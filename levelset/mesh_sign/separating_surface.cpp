#include "levelset/mesh_sign/separating_surface.h"

#include <Imath/ImathBox.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <span>

#include "levelset/geometry/disjoint_sets.h"
#include "levelset/geometry/exact_predicates.h"
#include "levelset/geometry/mesh_sides.h"
#include "levelset/mesh_sign/near_surface.h"
#include "levelset/mesh_sign/winding.h"
#include "levelset/progress_gate.h"

namespace levelset::convert {
namespace {

using Imath::V3d;
using Polygon = std::vector<V3d>;
/// Connected polygons that are kept in the separating surface, or dropped from it, together.
using Sheet = std::vector<Polygon>;

/// Number of patches above which a tree of all triangles (WindingField) sums the winding numbers
/// even if no triangles cross. With crossings the tree always does.
constexpr std::size_t kFewPoints = 16;
/// Largest error of a winding number. The mesh is closed, so on a triangle the winding number is
/// the mean of two integers, and an error below 1/2 does not change which of them exceeds 1/2.
constexpr double kTolerance = 0.2;
/// Distance relative to the polygon's size: corners nearer to a cutting plane count as on it.
constexpr double kOnPlane = 1e-12;
/// Voxels. Sheets inside the solid that lie within this distance of the separating surface stay in
/// the mesh. The grid cannot resolve the gap, and the distances then still refer to the given mesh.
constexpr double kShallow = 0.25;

V3d areaVector(std::span<const V3d> polygon) {
  V3d sum(0);
  for (std::size_t i = 2; i < polygon.size(); ++i)
    sum += (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
  return sum / 2;
}

V3d centroid(std::span<const V3d> polygon) {
  V3d sum(0);
  for (const V3d& p : polygon) sum += p;
  return sum / static_cast<double>(polygon.size());
}

/// Cuts a convex polygon by the plane through `point` and adds the one or two pieces to `out`. A
/// polygon without corners on both sides stays in one piece.
void cut(const Polygon& polygon, const V3d& point, const V3d& normal, std::vector<Polygon>& out) {
  double size = 0;
  for (const V3d& p : polygon) size = std::max(size, (p - polygon[0]).length());
  const double margin = kOnPlane * size * normal.length();
  std::vector<double> height;
  bool above = false, below = false;
  for (const V3d& p : polygon) {
    const double h = normal.dot(p - point);
    height.push_back(std::abs(h) <= margin ? 0 : h);
    above = above || height.back() > 0;
    below = below || height.back() < 0;
  }
  if (!above || !below) {
    out.push_back(polygon);
    return;
  }
  for (const double side : {1.0, -1.0}) {
    Polygon part;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const std::size_t next = (i + 1) % polygon.size();
      const double from = side * height[i], to = side * height[next];
      if (from >= 0) part.push_back(polygon[i]);
      if (from * to < 0)
        part.push_back(polygon[i] + (polygon[next] - polygon[i]) * (from / (from - to)));
    }
    out.push_back(std::move(part));
  }
}

/// Frees the unused memory of an array. Shrinking copies the array, so a small rest is kept.
template <class T>
void shrink(std::vector<T>& array) {
  if (array.capacity() > array.size() + array.size() / 4) array.shrink_to_fit();
}

class SeparatingSurface {
 public:
  SeparatingSurface(const LocalMesh& mesh, std::span<const TrianglePair> pairs, double flip,
                    const Progress& progress)
      : mesh_(mesh),
        pairs_(pairs),
        flip_(flip),
        progress_(progress),
        groups_(mesh.triangles.size()) {}

  LocalMesh find() {
    findPartners();
    findPatches();
    report(progress_, 0.3);
    std::vector<std::uint32_t> patches;  // lowest triangle index of each patch
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      if (largest_[t] != kNone) patches.push_back(t);
    if (pairs_.empty() && patches.size() <= 1) return mesh_;
    if (!pairs_.empty() || patches.size() > kFewPoints) field_ = WindingField(mesh_);
    report(progress_, 0.6);
    std::vector<char> kept(mesh_.triangles.size(), 0);  // 1 at the index of a patch that stays
    tbb::parallel_for(std::size_t{0}, patches.size(), [&](std::size_t i) {
      const std::uint32_t t = largest_[patches[i]];
      kept[patches[i]] = separates(t, corners(t));
    });
    LocalMesh result;
    // Without the space for the pieces, the arrays would double in size while they grow.
    const std::size_t pieces = kPiecesOfPair * pairs_.size();
    result.points.reserve(mesh_.points.size() + 3 * pieces);
    result.points = mesh_.points;
    result.triangles.reserve(mesh_.triangles.size() + pieces);
    std::map<std::uint32_t, Sheet> dropped;  // patches not kept, by their lowest triangle index
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (isCrossed(t)) continue;
      const std::uint32_t patch = groups_.find(t);
      if (kept[patch]) {
        result.triangles.push_back(mesh_.triangles[t]);
      } else {
        const auto c = corners(t);
        dropped[patch].emplace_back(c.begin(), c.end());
      }
    }
    std::vector<Sheet> sheets;
    for (auto& [patch, sheet] : dropped) sheets.push_back(std::move(sheet));
    addPieces(result, sheets);
    addShallow(sheets, result);
    field_ = WindingField();  // frees memory
    shrink(result.points);
    shrink(result.triangles);
    return result;
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  // Usual number of triangles into which a pair of crossing triangles is cut.
  static constexpr std::size_t kPiecesOfPair = 8;

  [[nodiscard]] std::array<V3d, 3> corners(std::uint32_t t) const {
    return {mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2)};
  }
  [[nodiscard]] bool isCrossed(std::uint32_t t) const { return first_[t] != first_[t + 1]; }
  [[nodiscard]] std::span<const std::uint32_t> partners(std::uint32_t t) const {
    return {partners_.data() + first_[t], partners_.data() + first_[t + 1]};
  }

  void findPartners() {
    first_.assign(mesh_.triangles.size() + 1, 0);
    for (const auto& [i, j] : pairs_) ++first_[i + 1], ++first_[j + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    partners_.resize(2 * pairs_.size());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (const auto& [i, j] : pairs_) partners_[next[i]++] = j, partners_[next[j]++] = i;
  }

  /// Joins triangles that no other triangle crosses into patches, over edges that exactly two of
  /// them share. The winding number on each side of such a patch is constant.
  void findPatches() {
    groups_ = connectedPatches(mesh_.triangles, [this](std::uint32_t t) { return !isCrossed(t); });
    largest_.assign(mesh_.triangles.size(), kNone);
    std::vector<double> area(mesh_.triangles.size(), -1);
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (isCrossed(t)) continue;
      const std::uint32_t patch = groups_.find(t);
      const double own = areaVector(corners(t)).length();
      if (own > area[patch]) area[patch] = own, largest_[patch] = t;
    }
  }

  /// Winding number of the mesh without the triangles `without`. The point lies in the planes of
  /// these triangles, where their solid angles are undefined.
  [[nodiscard]] double windingAt(const V3d& point, std::span<const std::uint32_t> without) const {
    double w = 0;
    if (field_.isEmpty()) {
      for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) w += turnsOf(t, point);
    } else {
      w = field_.within(kTolerance, point);
    }
    for (const std::uint32_t t : without) w -= turnsOf(t, point);
    return w;
  }
  [[nodiscard]] double turnsOf(std::uint32_t t, const V3d& point) const {
    return solidAngle(mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2), point);
  }

  [[nodiscard]] bool isCoplanar(std::uint32_t s, std::uint32_t t) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (orient3d(mesh_.corner(s, 0), mesh_.corner(s, 1), mesh_.corner(s, 2), mesh_.corner(t, k)))
        return false;
    return true;
  }

  /// Returns true when the point, which lies in the triangle's plane, lies in the triangle.
  [[nodiscard]] bool covers(std::uint32_t t, const V3d& point) const {
    const std::array<V3d, 3> c = corners(t);
    const V3d normal = areaVector(c);
    for (std::size_t k = 0; k < 3; ++k)
      if (normal.dot((c[(k + 1) % 3] - c[k]).cross(point - c[k])) < 0) return false;
    return true;
  }

  /// Returns true when a polygon of triangle t has the solid on exactly one side. No triangle may
  /// cross the polygon.
  [[nodiscard]] bool separates(std::uint32_t t, std::span<const V3d> polygon) const {
    const V3d point = centroid(polygon), normal = areaVector(corners(t));
    std::vector<std::uint32_t> inPlane = {t};
    double jump = 1;  // increase of the winding number from the front of t to its back
    for (const std::uint32_t other : partners(t)) {
      if (!isCoplanar(t, other)) continue;
      inPlane.push_back(other);
      if (covers(other, point)) jump += normal.dot(areaVector(corners(other))) > 0 ? 1 : -1;
    }
    const double middle = windingAt(point, inPlane);
    const double back = flip_ * (middle + jump / 2), front = flip_ * (middle - jump / 2);
    return (back > 0.5) != (front > 0.5);
  }

  /// Cuts a triangle along all triangles that cross it. A triangle cuts only the parts whose
  /// bounding boxes overlap its own.
  [[nodiscard]] std::vector<Polygon> pieces(std::uint32_t t) const {
    const std::array<V3d, 3> own = corners(t);
    std::vector<Polygon> parts = {Polygon(own.begin(), own.end())};
    for (const std::uint32_t other : partners(t)) {
      const std::array<V3d, 3> c = corners(other);
      const V3d normal = areaVector(c);
      if (!isCoplanar(other, t)) {
        parts = cutAll(parts, c, c[0], normal);
        continue;
      }
      for (std::size_t k = 0; k < 3; ++k)
        parts = cutAll(parts, c, c[k], (c[(k + 1) % 3] - c[k]).cross(normal));
    }
    return parts;
  }

  [[nodiscard]] static std::vector<Polygon> cutAll(const std::vector<Polygon>& parts,
                                                   const std::array<V3d, 3>& by, const V3d& point,
                                                   const V3d& normal) {
    Imath::Box3d reach;
    for (const V3d& p : by) reach.extendBy(p);
    std::vector<Polygon> result;
    for (const Polygon& part : parts) {
      Imath::Box3d box;
      for (const V3d& p : part) box.extendBy(p);
      if (box.intersects(reach))
        cut(part, point, normal, result);
      else
        result.push_back(part);
    }
    return result;
  }

  static void add(const Polygon& polygon, LocalMesh& result) {
    const auto first = static_cast<std::uint32_t>(result.points.size());
    result.points.insert(result.points.end(), polygon.begin(), polygon.end());
    for (std::uint32_t k = 2; k < polygon.size(); ++k)
      result.triangles.push_back({first, first + k - 1, first + k});
  }

  /// Cuts all crossed triangles. Adds the pieces that separate inside from outside to `result`, and
  /// each other piece as a sheet to `sheets`.
  void addPieces(LocalMesh& result, std::vector<Sheet>& sheets) const {
    std::vector<std::uint32_t> crossed;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      if (isCrossed(t)) crossed.push_back(t);
    struct Found {
      std::vector<Polygon> kept, dropped;
    };
    std::vector<Found> found(crossed.size());
    const Progress last = subProgress(progress_, 0.6, 1);
    ProgressGate gate(last, crossed.size());
    tbb::parallel_for(std::size_t{0}, crossed.size(), [&](std::size_t i) {
      for (Polygon& piece : pieces(crossed[i]))
        (separates(crossed[i], piece) ? found[i].kept : found[i].dropped)
            .push_back(std::move(piece));
      gate.advance(1);
    });
    for (Found& list : found) {
      for (const Polygon& piece : list.kept) add(piece, result);
      for (Polygon& piece : list.dropped) sheets.push_back({std::move(piece)});
    }
  }

  /// Adds those of the dropped sheets to `result` whose sample points all lie within kShallow of
  /// the surface in `result`.
  static void addShallow(const std::vector<Sheet>& sheets, LocalMesh& result) {
    // First test one point of each sheet. This excludes most sheets that lie deep in the solid.
    std::vector<V3d> points;
    for (const Sheet& sheet : sheets) {
      const auto largest =
          std::max_element(sheet.begin(), sheet.end(), [](const Polygon& a, const Polygon& b) {
            return areaVector(a).length2() < areaVector(b).length2();
          });
      points.push_back(centroid(*largest));
    }
    const std::vector<char> isNear = areNear(result, points, kShallow);
    points.clear();
    std::vector<std::size_t> candidates, ends;
    for (std::size_t i = 0; i < sheets.size(); ++i) {
      if (!isNear[i]) continue;
      for (const Polygon& polygon : sheets[i]) addSamples(polygon, points);
      candidates.push_back(i);
      ends.push_back(points.size());
    }
    const std::vector<char> areSamplesNear = areNear(result, points, kShallow);
    for (std::size_t k = 0, from = 0; k < candidates.size(); from = ends[k++]) {
      const auto first = areSamplesNear.begin();
      if (std::all_of(first + static_cast<std::ptrdiff_t>(from),
                      first + static_cast<std::ptrdiff_t>(ends[k]), [](char near) { return near; }))
        for (const Polygon& polygon : sheets[candidates[k]]) add(polygon, result);
    }
  }

  static void addSamples(const Polygon& polygon, std::vector<V3d>& points) {
    points.push_back(centroid(polygon));
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      points.push_back(polygon[i]);
      points.push_back((polygon[i] + polygon[(i + 1) % polygon.size()]) / 2);
    }
  }

  const LocalMesh& mesh_;
  std::span<const TrianglePair> pairs_;
  double flip_;
  const Progress& progress_;
  std::vector<std::size_t> first_;       // start of each triangle's partners in partners_
  std::vector<std::uint32_t> partners_;  // for each triangle, the triangles that intersect it
  DisjointSets groups_;
  /// Largest triangle of each patch, at the index of the patch's lowest triangle; kNone elsewhere.
  std::vector<std::uint32_t> largest_;
  WindingField field_;
};

}  // namespace

LocalMesh separatingSurface(const LocalMesh& mesh, std::span<const TrianglePair> pairs, double flip,
                            const Progress& progress) {
  return SeparatingSurface(mesh, pairs, flip, progress).find();
}

}  // namespace levelset::convert
