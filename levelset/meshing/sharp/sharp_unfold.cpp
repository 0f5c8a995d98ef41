#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "levelset/meshing/sharp/sharp_edges.h"

namespace levelset {
namespace {

using openvdb::Vec3d;
using Triangle = MeshTriangle;

/// kLeastHeight: least height of a triangle in its sheet, voxels; a lower triangle counts as
/// folded. kLeastGain: least decrease, voxels, of the sum of deficit() over the triangles that a
/// flip or a removal changes.
constexpr double kLeastHeight = 0.02, kLeastGain = 1e-3;
/// Height assigned to a triangle that lies in no sheet, voxels: less than that of any triangle in a
/// sheet.
constexpr double kOffSheets = -10;
/// Largest number of passes in run(), and of passes over the edges in flip(). A flip can require
/// another flip, and a removed vertex can require flips.
constexpr int kUnfoldPasses = 8;

class SheetUnfolder {
 public:
  SheetUnfolder(IndexMesh& mesh, std::vector<VertexSheets>& sheets, double longest,
                const Progress& progress)
      : positions_(mesh.positions),
        triangles_(mesh.triangles),
        sheets_(sheets),
        longest_(longest),
        progress_(progress),
        state_(mesh.triangles.size(), State::Unknown),
        changedIn_(mesh.positions.size(), 0) {}

  void run() {
    for (int pass = 0; pass < kUnfoldPasses; ++pass) {
      const double done = static_cast<double>(pass) / kUnfoldPasses;
      flip(done);
      report(progress_, done);
      if (!collapse()) return;
    }
  }

 private:
  enum class State : char { Unknown, Folded, Flat };

  [[nodiscard]] double longestSide(const Triangle& t) const {
    const Vec3d &a = positions_[t[0]], &b = positions_[t[1]], &c = positions_[t[2]];
    return std::sqrt(std::max({(b - a).lengthSqr(), (c - b).lengthSqr(), (a - c).lengthSqr()}));
  }

  /// Returns the height of a triangle over its longest side, in the sheet that fits it best,
  /// voxels. The height is negative when the triangle is turned over in that sheet, and kOffSheets
  /// when it lies in no sheet.
  [[nodiscard]] double heightInSheet(const Triangle& t) const {
    const Vec3d &a = positions_[t[0]], &b = positions_[t[1]], &c = positions_[t[2]];
    const Vec3d area = (b - a).cross(c - a);
    const double longest = longestSide(t);
    double best = kOffSheets;
    for (std::size_t i = 0; i < 3; ++i) {
      const VertexSheets& sheets = sheets_[t[i]];
      for (std::size_t k = 0; k < sheets.count; ++k) {
        const Vec3d n = sheetNormal(sheets, k);
        const auto isIn = [&](std::size_t j) {
          return isInSheet(n, positions_[t[j]] - positions_[t[i]], sheets_[t[j]]);
        };
        if (isIn((i + 1) % 3) && isIn((i + 2) % 3)) best = std::max(best, n.dot(area) / longest);
      }
    }
    return best;
  }

  /// Returns the folded triangles. Computes the heights of triangles that changed since the last
  /// call only.
  [[nodiscard]] std::vector<std::size_t> foldedTriangles() {
    constexpr std::size_t kChunk = 1 << 14;
    std::vector<std::vector<std::size_t>> found((triangles_.size() + kChunk - 1) / kChunk);
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t chunk) {
      const std::size_t end = std::min(triangles_.size(), (chunk + 1) * kChunk);
      for (std::size_t i = chunk * kChunk; i < end; ++i) {
        if (state_[i] == State::Unknown)
          state_[i] = isFolded(triangles_[i]) ? State::Folded : State::Flat;
        if (state_[i] == State::Folded) found[chunk].push_back(i);
      }
    });
    std::vector<std::size_t> all;
    for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
    return all;
  }

  void markChanged(std::size_t triangle) {
    state_[triangle] = State::Unknown;
    for (const std::uint32_t v : triangles_[triangle]) changedIn_[v] = round_;
  }
  /// Returns true when a triangle with a common vertex has changed since the start of the pass
  /// before, or in the first pass.
  [[nodiscard]] bool hasChangedAt(const Triangle& t) const {
    return std::any_of(t.begin(), t.end(),
                       [&](std::uint32_t v) { return changedIn_[v] == round_; });
  }

  [[nodiscard]] bool isFolded(const Triangle& t) const {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return sheets_[v].count > 0; }) &&
           heightInSheet(t) < kLeastHeight;
  }

  /// Flips mesh edges where this decreases the sum of deficit() of both triangles beside the edge.
  /// Triangles are turned over in their sheet if vertices along an edge of the solid are out of
  /// order. A triangle has no area if its three vertices lie on such an edge.
  void flip(double done) {
    for (int pass = 0; pass < kUnfoldPasses; ++pass) {
      report(progress_, done);
      faces_ = foldedTriangles();
      // No flip helps a triangle while nothing around it changes.
      std::erase_if(faces_, [&](std::size_t i) { return !hasChangedAt(triangles_[i]); });
      ++round_;
      if (faces_.empty()) return;
      std::vector<TriangleSide> sides;
      addSides(triangles_, faces_, positions_.size(), sides);
      std::vector<PairedEdge> edges = pairSides(std::move(sides));
      std::unordered_set<std::uint64_t> present = edgesBeside(edges, triangles_, positions_.size());
      for (PairedEdge& edge : edges) edge.weight = gain(edge, flipOf(edge, triangles_, present));
      std::stable_sort(edges.begin(), edges.end(), [](const PairedEdge& a, const PairedEdge& b) {
        return a.weight > b.weight;
      });
      touched_.assign(triangles_.size(), false);
      bool hasChanged = false;
      for (const PairedEdge& edge : edges) {
        const auto [first, second] = edge.triangle;
        if (touched_[first] || touched_[second]) continue;
        const EdgeFlip flip = flipOf(edge, triangles_, present);
        if (gain(edge, flip) < kLeastGain) continue;
        applyFlip(flip, edge, triangles_, present);
        touched_[first] = touched_[second] = hasChanged = true;
        markChanged(first);
        markChanged(second);
      }
      if (!hasChanged) return;
    }
  }

  /// Returns the amount by which a triangle's height in its sheet is below kLeastHeight, voxels; 0
  /// if it is not below.
  [[nodiscard]] double deficit(const Triangle& t) const {
    return std::max(0.0, kLeastHeight - heightInSheet(t));
  }

  /// Returns the decrease of the sum of deficit() of the edge's two triangles by a flip, voxels; 0
  /// if the flip is impossible.
  [[nodiscard]] double gain(const PairedEdge& edge, const EdgeFlip& flip) const {
    if (!flip.isPossible) return 0;
    return deficit(triangles_[edge.triangle[0]]) + deficit(triangles_[edge.triangle[1]]) -
           deficit(flip.left) - deficit(flip.right);
  }

  /// Removes superfluous vertices where no flip unfolds a triangle. A vertex is superfluous if a
  /// neighbour can replace it without folding other triangles.
  /// @return true when a vertex was removed
  bool collapse() {
    faces_ = foldedTriangles();
    if (faces_.empty()) return false;
    std::map<std::uint32_t, std::vector<std::size_t>> fans;
    const std::vector<bool> isIn = markVertices(triangles_, faces_, positions_.size());
    for (std::size_t i = 0; i < triangles_.size(); ++i)
      for (const std::uint32_t v : triangles_[i])
        if (isIn[v]) fans[v].push_back(i);
    touched_.assign(triangles_.size(), false);
    std::vector<bool> isGone(triangles_.size()), isUnused(positions_.size());
    for (const std::size_t i : faces_) {
      const Triangle t = triangles_[i];
      for (std::size_t k = 0; k < 6 && !isGone[i]; ++k) {
        const std::uint32_t from = t[k % 3], to = t[(k + 1 + k / 3) % 3];
        if (!canStandFor(fans[from], from, to, fans[to])) continue;
        for (const std::size_t j : fans[from]) {
          touched_[j] = true;
          markChanged(j);
          Triangle& moved = triangles_[j];
          isGone[j] = std::find(moved.begin(), moved.end(), to) != moved.end();
          std::replace(moved.begin(), moved.end(), from, to);
          markChanged(j);
        }
        for (const std::size_t j : fans[to]) touched_[j] = true;
        isUnused[from] = true;
      }
    }
    for (std::size_t v = 0; v < isUnused.size(); ++v)
      if (isUnused[v]) sheets_[v].count = 0;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < triangles_.size(); ++i)
      if (!isGone[i]) {
        state_[kept] = state_[i];
        triangles_[kept++] = triangles_[i];
      }
    const bool hasChanged = kept < triangles_.size();
    triangles_.resize(kept);
    state_.resize(kept);
    return hasChanged;
  }

  /// Returns true when `to` can replace its neighbour `from`, given the triangles at `from` (`fan`)
  /// and at `to` (`other`). This pass must not have changed any of them, and `to` must have as many
  /// sheets as `from` or more. The mesh must stay a manifold: their only common neighbours are the
  /// two vertices opposite to their edge. The sum of deficit() over `fan` must decrease, and no
  /// triangle may become longer than longest_ and than it was.
  [[nodiscard]] bool canStandFor(const std::vector<std::size_t>& fan, std::uint32_t from,
                                 std::uint32_t to, const std::vector<std::size_t>& other) const {
    if (sheets_[to].count < sheets_[from].count) return false;
    const auto isTouched = [&](std::size_t j) { return touched_[j]; };
    if (std::any_of(fan.begin(), fan.end(), isTouched) ||
        std::any_of(other.begin(), other.end(), isTouched))
      return false;
    std::set<std::uint32_t> around, aroundOther;
    for (const std::size_t j : fan) around.insert(triangles_[j].begin(), triangles_[j].end());
    for (const std::size_t j : other)
      aroundOther.insert(triangles_[j].begin(), triangles_[j].end());
    std::size_t common = 0;
    for (const std::uint32_t v : around) common += v != from && v != to && aroundOther.count(v);
    if (common != 2 || (fan.size() < 4 && other.size() < 4)) return false;
    double before = 0, after = 0;
    for (const std::size_t j : fan) {
      Triangle moved = triangles_[j];
      before += deficit(moved);
      if (std::find(moved.begin(), moved.end(), to) != moved.end()) continue;
      std::replace(moved.begin(), moved.end(), from, to);
      if (longestSide(moved) > std::max(longest_, longestSide(triangles_[j]))) return false;
      after += deficit(moved);
    }
    return before - after > kLeastGain;
  }

  std::vector<Vec3d>& positions_;
  std::vector<Triangle>& triangles_;
  std::vector<VertexSheets>& sheets_;
  const double longest_;
  const Progress& progress_;
  std::vector<std::size_t> faces_;  ///< indices of the folded triangles
  std::vector<bool> touched_;       ///< [triangle]: true when this pass changed it
  std::vector<State> state_;        ///< [triangle]
  int round_ = 0;                   ///< number of passes over the edges so far
  std::vector<int> changedIn_;      ///< [vertex]: round of the last change of a triangle there
};

}  // namespace

void unfoldSheets(IndexMesh& mesh, std::vector<VertexSheets>& sheets, const Progress& progress,
                  double longest) {
  SheetUnfolder(mesh, sheets, longest, progress).run();
}

}  // namespace levelset
