#include "levelset/segmented/meshing/measure_segmented.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace levelset {

using Imath::V3d;

namespace {

/// Straight piece of a junction curve.
struct JunctionPiece {
  V3d from, step;  ///< the end is from + step
  double length;
};

/// Length of the union of pieces of curves. Pieces that run along each other, forwards or
/// backwards, count once: each point counts by one over the number of pieces that cover it.
class JunctionUnion {
 public:
  explicit JunctionUnion(std::vector<JunctionPiece> pieces) : pieces_(std::move(pieces)) {
    for (const JunctionPiece& piece : pieces_) cell_ = std::max(cell_, piece.length);
    for (std::uint32_t n = 0; n < pieces_.size(); ++n)
      places_.emplace_back(cellOf(pieces_[n].from + pieces_[n].step / 2), n);
    std::sort(places_.begin(), places_.end());
  }

  [[nodiscard]] double length() const {
    double sum = 0;
    for (const JunctionPiece& piece : pieces_) sum += shareOf(piece);
    return sum;
  }

 private:
  using Cell = std::array<long, 3>;
  // Largest distance of pieces that run along each other, as a multiple of the longest piece.
  static constexpr double kApart = 0.1;
  static constexpr double kParallel = 0.7;  // least cosine of their angle

  [[nodiscard]] Cell cellOf(const V3d& p) const {
    return {std::lround(p.x / cell_), std::lround(p.y / cell_), std::lround(p.z / cell_)};
  }

  /// Integral of one over the number of pieces along a piece.
  [[nodiscard]] double shareOf(const JunctionPiece& piece) const {
    std::vector<std::pair<double, int>> ends;  // begin and end of the parts that others cover
    const Cell centre = cellOf(piece.from + piece.step / 2);
    for (long x = -1; x <= 1; ++x)
      for (long y = -1; y <= 1; ++y) {
        const Cell low = {centre[0] + x, centre[1] + y, centre[2] - 1},
                   high = {low[0], low[1], centre[2] + 1};
        for (auto place = std::lower_bound(places_.begin(), places_.end(), std::pair(low, 0u));
             place != places_.end() && place->first <= high; ++place)
          addPart(piece, pieces_[place->second], ends);
      }
    std::sort(ends.begin(), ends.end());
    double sum = 0, last = 0;
    int count = 0;
    for (const auto& [at, change] : ends) {
      if (count > 0) sum += (at - last) / count;
      last = at;
      count += change;
    }
    return sum;
  }

  /// Adds the ends of the part of a piece that another one covers.
  void addPart(const JunctionPiece& piece, const JunctionPiece& other,
               std::vector<std::pair<double, int>>& ends) const {
    const V3d along = piece.step / piece.length;
    const double slope = other.step.dot(along);
    if (std::abs(slope) < kParallel * other.length) return;
    const double first = (other.from - piece.from).dot(along),
                 begin = std::max(0.0, std::min(first, first + slope)),
                 end = std::min(piece.length, std::max(first, first + slope));
    if (!(begin < end)) return;
    const double middle = (begin + end) / 2;
    const V3d gap =
        other.from + other.step * ((middle - first) / slope) - piece.from - along * middle;
    if (gap.length() > kApart * cell_) return;
    ends.emplace_back(begin, 1);
    ends.emplace_back(end, -1);
  }

  std::vector<JunctionPiece> pieces_;
  double cell_ = 0;  ///< edge of a cell of the search: the longest piece
  std::vector<std::pair<Cell, std::uint32_t>> places_;  ///< pieces by the cell of their middle
};

/// Length of the junction curves. Those on both sides of a strip lie on one line, and may fold back
/// along it.
double lengthOfJunctions(const SegmentedMesh& segmented) {
  double sum = 0;
  std::vector<JunctionPiece> pieces;
  for (const JunctionEdge& edge : segmented.junctions) {
    const V3d from = segmented.mesh.positions[edge.vertices[0]],
              step = segmented.mesh.positions[edge.vertices[1]] - from;
    const double length = step.length();
    if (segmented.strips.empty())
      sum += length;
    else if (length > 0)
      pieces.push_back({from, step, length});
  }
  return pieces.empty() ? sum : JunctionUnion(std::move(pieces)).length();
}

}  // namespace

SegmentedMeasurement measureSegmented(const SegmentedMesh& segmented) {
  SegmentedMeasurement result;
  const TriMesh& mesh = segmented.mesh;
  result.triangles = mesh.triangles.size();
  result.junctionPoints = segmented.junctionPoints.size();
  // Relative to the centre of each region, volumes keep their digits far from the origin.
  std::map<RegionLabel, RegionMeasure> regions;
  regions[kVoid].label = kVoid;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const RegionLabel label : {segmented.sides[t].behind, segmented.sides[t].front}) {
      RegionMeasure& region = regions[label];
      region.label = label;
      for (const std::uint32_t v : mesh.triangles[t]) region.bounds.extendBy(mesh.positions[v]);
    }
  std::map<std::pair<RegionLabel, RegionLabel>, InterfaceMeasure> interfaces;
  auto strip = segmented.strips.begin();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (strip != segmented.strips.end() && *strip == t) {
      ++strip;
      continue;
    }
    const auto& [behind, front] = segmented.sides[t];
    const V3d &a = mesh.positions[mesh.triangles[t][0]], &b = mesh.positions[mesh.triangles[t][1]],
              &c = mesh.positions[mesh.triangles[t][2]];
    const double area = (b - a).cross(c - a).length() / 2;
    const auto add = [&](RegionLabel label, double sign) {
      RegionMeasure& region = regions[label];
      region.area += area;
      ++region.triangles;
      if (label == kVoid) return;
      const V3d centre = region.bounds.center();
      region.volume += sign * ((a - centre).cross(b - centre) ^ (c - centre)) / 6;
    };
    if (behind == front) {
      regions[front].sheetArea += area;
      ++regions[front].triangles;
    } else {
      add(behind, 1);
      add(front, -1);
    }
    InterfaceMeasure& interface = interfaces[{front, behind}];
    interface.sides = segmented.sides[t];
    interface.area += area;
    ++interface.triangles;
  }
  for (const auto& [label, region] : regions) {
    result.regions.push_back(region);
    result.volume += region.volume;
  }
  for (const auto& [sides, interface] : interfaces) {
    result.interfaces.push_back(interface);
    result.area += interface.area;
  }
  result.junctionLength = lengthOfJunctions(segmented);
  for (const auto& [a, b] : segmented.rims)
    result.rimLength += (mesh.positions[a] - mesh.positions[b]).length();
  return result;
}

SegmentedMeasurement measureSegmented(const SegmentedField& field,
                                      const SegmentedMeshOptions& options) {
  return measureSegmented(segmentedToMesh(field, options));
}

}  // namespace levelset
