#include "levelset/segmented/sources/sheet_features.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "levelset/geometry/mesh_sides.h"

namespace levelset {
namespace {

using Imath::V3d;
using Imath::V3i;

constexpr double kSheetReach = 1;         // voxels: of closest points
constexpr double kFaceTolerance = 1e-6;   // voxels: of points on the border of a face
constexpr double kStraightCosine = 0.95;  // of the angle of a rim that does not bend

bool isLowerCell(const V3i& a, const V3i& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

/// Returns true if a point in the plane of a triangle lies in it, or almost.
bool liesIn(const std::array<V3d, 3>& t, const V3d& p) {
  const V3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    const V3d side = t[(k + 1) % 3] - t[k];
    const double height = (side.cross(p - t[k]) ^ normal) / (normal.length() * side.length());
    if (height < -kFaceTolerance) return false;
  }
  return true;
}

/// Point where a line crosses the plane of a triangle, if it lies in the triangle.
std::optional<V3d> pierce(const V3d& from, const V3d& to, const std::array<V3d, 3>& t) {
  const V3d normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  const double a = (from - t[0]) ^ normal, b = (to - t[0]) ^ normal;
  if ((a > kFaceTolerance && b > kFaceTolerance) || (a < -kFaceTolerance && b < -kFaceTolerance))
    return std::nullopt;
  if (std::abs(a - b) < kFaceTolerance) return std::nullopt;
  const V3d p = from + (to - from) * std::clamp(a / (a - b), 0.0, 1.0);
  return liesIn(t, p) ? std::optional(p) : std::nullopt;
}

V3d closestOnPiece(const V3d& from, const V3d& to, const V3d& p) {
  const V3d along = to - from;
  const double length2 = along.length2();
  return length2 > 0 ? from + along * std::clamp((along ^ (p - from)) / length2, 0.0, 1.0) : from;
}

/// Line along which two triangles meet. Empty for triangles that meet in a point or in their plane.
std::optional<std::array<V3d, 2>> meetingLine(const std::array<V3d, 3>& s,
                                              const std::array<V3d, 3>& t) {
  std::vector<V3d> found;
  for (std::size_t k = 0; k < 3; ++k) {
    if (const auto p = pierce(s[k], s[(k + 1) % 3], t)) found.push_back(*p);
    if (const auto p = pierce(t[k], t[(k + 1) % 3], s)) found.push_back(*p);
  }
  std::array<V3d, 2> best = {V3d(0), V3d(0)};
  double longest = kFaceTolerance;
  for (std::size_t i = 0; i < found.size(); ++i)
    for (std::size_t j = i + 1; j < found.size(); ++j)
      if ((found[i] - found[j]).length() > longest) {
        longest = (found[i] - found[j]).length();
        best = {found[i], found[j]};
      }
  return longest > kFaceTolerance ? std::optional(best) : std::nullopt;
}

}  // namespace

SheetFeatures::SheetFeatures(const std::vector<V3d>& points,
                             const std::vector<std::array<std::uint32_t, 3>>& triangles,
                             const std::vector<std::pair<std::uint32_t, std::uint32_t>>& crossing) {
  struct Ends {
    std::uint32_t rims = 0, junctions = 0;
    std::array<std::uint32_t, 2> along{};  ///< other ends of the rims
  };
  std::vector<Ends> at(points.size());
  forEachEdge(sortedSides(triangles), [&](auto first, auto end) {
    if (end - first == 2) return;
    const bool isRim = end - first == 1;
    addLine(points[first->low], points[first->high], isRim ? Kind::Rim : Kind::Junction);
    rims_ += isRim;
    for (const auto& [v, other] :
         {std::pair(first->low, first->high), std::pair(first->high, first->low)}) {
      if (isRim && at[v].rims < 2) at[v].along[at[v].rims] = other;
      ++(isRim ? at[v].rims : at[v].junctions);
    }
  });
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (at[v].junctions > 0 && (at[v].junctions != 2 || at[v].rims > 0)) ends_.push_back(points[v]);
    if (at[v].junctions > 0 || at[v].rims != 2) continue;
    const V3d a = points[at[v].along[0]] - points[v], b = points[v] - points[at[v].along[1]];
    if ((a ^ b) < kStraightCosine * a.length() * b.length()) corners_.push_back(points[v]);
  }
  const auto cornersOf = [&](std::uint32_t t) -> std::array<V3d, 3> {
    return {points[triangles[t][0]], points[triangles[t][1]], points[triangles[t][2]]};
  };
  for (const auto& [s, t] : crossing)
    if (const auto line = meetingLine(cornersOf(s), cornersOf(t)))
      addLine((*line)[0], (*line)[1], Kind::Junction);
  sortPieces();
}

void SheetFeatures::addLine(const V3d& from, const V3d& to, Kind kind) {
  const auto count = static_cast<std::size_t>(std::ceil(std::max(1.0, (to - from).length())));
  const auto at = [&](std::size_t n) {
    return n == count ? to : from + (to - from) * (static_cast<double>(n) / double(count));
  };
  for (std::size_t n = 0; n < count; ++n) pieces_.push_back({at(n), at(n + 1), kind});
}

void SheetFeatures::sortPieces() {
  for (std::uint32_t n = 0; n < pieces_.size(); ++n) {
    V3i low, high;
    for (int axis = 0; axis < 3; ++axis) {
      const auto [least, most] = std::minmax(pieces_[n].from[axis], pieces_[n].to[axis]);
      low[axis] = static_cast<int>(std::floor(least));
      high[axis] = static_cast<int>(std::floor(most));
    }
    V3i cell;
    for (cell.x = low.x; cell.x <= high.x; ++cell.x)
      for (cell.y = low.y; cell.y <= high.y; ++cell.y)
        for (cell.z = low.z; cell.z <= high.z; ++cell.z) cells_.emplace_back(cell, n);
  }
  std::sort(cells_.begin(), cells_.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? isLowerCell(a.first, b.first) : a.second < b.second;
  });
}

template <class Visit>
void SheetFeatures::forEachPiece(const V3d& low, const V3d& high, Kind kind,
                                 const Visit& visit) const {
  V3i cell;
  const auto down = [](double x) { return static_cast<int>(std::floor(x)); };
  for (cell.x = down(low.x); cell.x <= down(high.x); ++cell.x)
    for (cell.y = down(low.y); cell.y <= down(high.y); ++cell.y)
      for (cell.z = down(low.z); cell.z <= down(high.z); ++cell.z) {
        auto entry =
            std::lower_bound(cells_.begin(), cells_.end(), cell,
                             [](const auto& a, const V3i& b) { return isLowerCell(a.first, b); });
        for (; entry != cells_.end() && entry->first == cell; ++entry)
          if (pieces_[entry->second].kind == kind) visit(pieces_[entry->second]);
      }
}

std::optional<V3d> SheetFeatures::onFace(Kind kind, const std::array<V3d, 3>& face,
                                         const V3d& near) const {
  V3d low = face[0], high = face[0];
  for (const V3d& p : face)
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  std::optional<V3d> best;
  double least = std::numeric_limits<double>::infinity();
  forEachPiece(low - V3d(kFaceTolerance), high + V3d(kFaceTolerance), kind,
               [&](const Piece& piece) {
                 const auto p = pierce(piece.from, piece.to, face);
                 if (!p || (*p - near).length() >= least) return;
                 least = (*p - near).length();
                 best = p;
               });
  return best ? best : closest(kind, near);
}

std::optional<V3d> SheetFeatures::closest(Kind kind, const V3d& to) const {
  std::optional<V3d> best;
  double least = kSheetReach;
  forEachPiece(to - V3d(kSheetReach), to + V3d(kSheetReach), kind, [&](const Piece& piece) {
    const V3d p = closestOnPiece(piece.from, piece.to, to);
    if ((p - to).length() >= least) return;
    least = (p - to).length();
    best = p;
  });
  return best;
}

}  // namespace levelset
