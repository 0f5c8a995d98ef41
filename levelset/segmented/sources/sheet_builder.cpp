#include "levelset/segmented/sources/sheet_builder.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include "levelset/segmented/local/cut_tetrahedron.h"
#include "levelset/segmented/local/kuhn_cell.h"

namespace levelset {
namespace {

using Imath::V3d;
using Imath::V3i;
using SimplexKey = GridSimplices::Key;

constexpr double kEndReach = 1.5;  // voxels: of ends and corners from the middle of a tetrahedron

bool isLowerPoint(const V3i& a, const V3i& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

V3i blockOriginOf(const V3i& at) {
  return {at.x & ~7, at.y & ~7, at.z & ~7};
}

std::uint32_t voxelOf(const V3i& at) {
  return static_cast<std::uint32_t>((at.x & 7) << 6 | (at.y & 7) << 3 | (at.z & 7));
}

/// Place of an entry in a block.
struct PlacedKey {
  std::uint32_t block;
  std::uint16_t key;
  std::uint32_t index;

  friend bool operator<(const PlacedKey& a, const PlacedKey& b) {
    return std::tie(a.block, a.key) < std::tie(b.block, b.key);
  }
};

/// Sorts entries by block, and writes the first one of each block.
template <class Entry>
std::vector<PlacedKey> sortByBlock(const std::vector<Entry>& entries,
                                   const GridSimplices& simplices, const std::vector<V3i>& origins,
                                   std::vector<std::uint32_t>& first) {
  std::vector<PlacedKey> sorted;
  for (std::uint32_t n = 0; n < entries.size(); ++n) {
    const V3i at = simplices.pointOf(entries[n].key), origin = blockOriginOf(at);
    const auto found = std::lower_bound(origins.begin(), origins.end(), origin, isLowerPoint);
    if (found == origins.end() || *found != origin) continue;
    sorted.push_back({static_cast<std::uint32_t>(found - origins.begin()),
                      SheetData::key(voxelOf(at), GridSimplices::slotOf(entries[n].key)), n});
  }
  std::sort(sorted.begin(), sorted.end());
  first.assign(origins.size() + 1, 0);
  for (const PlacedKey& entry : sorted) ++first[entry.block + 1];
  for (std::size_t b = 0; b < origins.size(); ++b) first[b + 1] += first[b];
  return sorted;
}

}  // namespace

SheetBuilder::SheetBuilder(const std::vector<V3d>& points,
                           const std::vector<std::array<std::uint32_t, 3>>& triangles,
                           const GridSimplices& simplices,
                           const std::vector<GridCrossing>& crossings,
                           const SheetFeatures& features, LabelAt labelAt, IsInside isInside)
    : points_(points),
      triangles_(triangles),
      simplices_(simplices),
      crossings_(crossings),
      features_(features),
      labelAt_(std::move(labelAt)),
      isInside_(std::move(isInside)) {}

std::shared_ptr<const SheetData> SheetBuilder::run(const std::vector<V3i>& origins) {
  chooseEdges();
  placeEdges();
  placeFaces();
  placeEnds();
  placeCorners();
  placed_.insert(placed_.end(), faces_.begin(), faces_.end());
  const auto data = std::make_shared<SheetData>();
  for (const PlacedKey& entry : sortByBlock(edges_, simplices_, origins, data->firstEdge)) {
    data->edges.push_back(entry.key);
    data->positions.push_back(static_cast<float>(edges_[entry.index].position));
  }
  for (const PlacedKey& entry : sortByBlock(placed_, simplices_, origins, data->firstPoint)) {
    data->pointKeys.push_back(entry.key);
    data->points.emplace_back(placed_[entry.index].offset);
  }
  std::sort(owners_.begin(), owners_.end());
  owners_.erase(std::unique(owners_.begin(), owners_.end()), owners_.end());
  data->owners = owners_;
  return data;
}

bool SheetBuilder::isBlocked(const V3i& at, std::uint32_t step) const {
  const SimplexKey key = simplices_.key(at, kuhn::edgeSlot(step));
  const auto found =
      std::lower_bound(crossings_.begin(), crossings_.end(), key,
                       [](const GridCrossing& a, SimplexKey b) { return a.edge < b; });
  return found != crossings_.end() && found->edge == key;
}

bool SheetBuilder::areConnectedNearby(const V3i& at, std::uint32_t step) const {
  // Grid points up to one beyond the cell of the edge.
  constexpr int kSide = 4;
  const V3i low = at - V3i(1);
  const auto indexOf = [&](const V3i& p) {
    const V3i q = p - low;
    return static_cast<std::size_t>((q.x * kSide + q.y) * kSide + q.z);
  };
  const auto isNear = [&](const V3i& p) {
    const V3i q = p - low;
    return std::min({q.x, q.y, q.z}) >= 0 && std::max({q.x, q.y, q.z}) < kSide;
  };
  std::array<bool, kSide * kSide * kSide> isReached{};
  std::vector<V3i> reached = {at};
  isReached[indexOf(at)] = true;
  const std::size_t target = indexOf(at + offsetOfCorner(step));
  for (std::size_t n = 0; n < reached.size() && !isReached[target]; ++n)
    for (std::uint32_t s = 1; s < 8; ++s)
      for (const int sign : {1, -1}) {
        const V3i from = reached[n], to = from + offsetOfCorner(s) * sign;
        if (!isNear(to) || isReached[indexOf(to)] || isBlocked(sign > 0 ? from : to, s)) continue;
        isReached[indexOf(to)] = true;
        reached.push_back(to);
      }
  return isReached[target];
}

/// Returns true if all surfaces that a line crosses lie inside one region: they are sheets, or
/// parts that are thinner than a voxel. Does not need the order of the crossings, which rounding
/// may change where they coincide.
bool SheetBuilder::isBetweenSheets(std::size_t first, std::size_t last, std::uint16_t label) const {
  constexpr double kLeastSlope = 1e-6;  // a line in a plane may cross its triangles back and forth
  for (std::size_t n = first; n <= last; ++n) {
    const std::uint32_t triangle = crossings_[n].triangle;
    if (!isInside_(triangle, label)) return false;
    const auto& t = triangles_[triangle];
    const V3d normal = (points_[t[1]] - points_[t[0]]).cross(points_[t[2]] - points_[t[0]]),
              along(offsetOfCorner(GridSimplices::slotOf(crossings_[n].edge) + 1));
    if (std::abs(normal ^ along) < kLeastSlope * normal.length()) return false;
  }
  return true;
}

void SheetBuilder::chooseEdges() {
  std::vector<std::size_t> firsts;
  for (std::size_t n = 0; n < crossings_.size(); ++n)
    if (n == 0 || crossings_[n].edge != crossings_[n - 1].edge) firsts.push_back(n);
  firsts.push_back(crossings_.size());
  const std::size_t count = firsts.size() - 1;
  std::vector<char> isCrossed(count), isInside(count);
  std::vector<std::uint16_t> labels(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t e) {
    const SimplexKey key = crossings_[firsts[e]].edge;
    const V3i at = simplices_.pointOf(key);
    const std::uint32_t step = GridSimplices::slotOf(key) + 1;
    labels[e] = labelAt_(at);
    isInside[e] = labels[e] == labelAt_(at + offsetOfCorner(step));
    // A line that enters a solid beside its edge and leaves it again separates nothing.
    isCrossed[e] = !isInside[e] || firsts[e + 1] - firsts[e] == 1 ||
                   isBetweenSheets(firsts[e], firsts[e + 1] - 1, labels[e]) ||
                   !areConnectedNearby(at, step);
  });
  for (std::size_t e = 0; e < count; ++e) {
    if (!isCrossed[e]) continue;
    const GridCrossing &first = crossings_[firsts[e]], &last = crossings_[firsts[e + 1] - 1];
    const bool isMultiple = firsts[e + 1] - firsts[e] > 1;
    edges_.push_back({first.edge, (first.position + last.position) / 2, isMultiple});
    if (isInside[e] && !isMultiple) owners_.push_back(labels[e]);
  }
}

const SheetBuilder::CrossedEdge* SheetBuilder::find(const V3i& at, std::uint32_t step) const {
  const SimplexKey key = simplices_.key(at, kuhn::edgeSlot(step));
  const auto found = std::lower_bound(edges_.begin(), edges_.end(), key,
                                      [](const CrossedEdge& a, SimplexKey b) { return a.key < b; });
  return found != edges_.end() && found->key == key ? &*found : nullptr;
}

void SheetBuilder::placeEdges() {
  for (const CrossedEdge& edge : edges_) {
    if (!edge.isMultiple) continue;
    const V3d low(simplices_.pointOf(edge.key)),
        along(offsetOfCorner(GridSimplices::slotOf(edge.key) + 1));
    const auto point =
        features_.closest(SheetFeatures::Kind::Junction, low + along * edge.position);
    if (point) {
      placed_.push_back({edge.key, *point - low});
    } else if (const std::uint16_t label = labelAt_(simplices_.pointOf(edge.key));
               label == labelAt_(simplices_.pointOf(edge.key) +
                                 offsetOfCorner(GridSimplices::slotOf(edge.key) + 1))) {
      owners_.push_back(label);
    }
  }
}

void SheetBuilder::placeFaces() {
  struct FoundFace {
    SimplexKey key;
    bool isJunction, hasPoint;
    V3d point;
  };
  constexpr std::size_t kChunk = 4096;
  std::vector<std::vector<FoundFace>> found((edges_.size() + kChunk - 1) / kChunk);
  // The first crossed edge of a face looks at it.
  const auto lookAt = [&](const CrossedEdge& edge, const V3i& at, const kuhn::FaceSteps& face,
                          std::vector<FoundFace>& result) {
    const V3i middle = at + offsetOfCorner(face.middle);
    std::uint32_t count = 0;
    V3d mean(0);
    for (const CrossedEdge* side :
         {find(at, face.middle), find(at, face.upper), find(middle, face.middle ^ face.upper)}) {
      if (!side) continue;
      if (side < &edge) return;
      ++count;
      mean += V3d(simplices_.pointOf(side->key)) +
              V3d(offsetOfCorner(GridSimplices::slotOf(side->key) + 1)) * side->position;
    }
    if (!holdsFaceNode(count)) return;
    const auto kind = count == 1 ? SheetFeatures::Kind::Rim : SheetFeatures::Kind::Junction;
    const auto point = features_.onFace(
        kind, {V3d(at), V3d(middle), V3d(at + offsetOfCorner(face.upper))}, mean / count);
    result.push_back({simplices_.key(at, kuhn::faceSlot(face.middle, face.upper)), count == 3,
                      point.has_value(), point.value_or(V3d(0))});
  };
  tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t chunk) {
    const std::size_t end = std::min(edges_.size(), (chunk + 1) * kChunk);
    for (std::size_t e = chunk * kChunk; e < end; ++e) {
      const V3i at = simplices_.pointOf(edges_[e].key);
      const std::uint32_t step = GridSimplices::slotOf(edges_[e].key) + 1;
      for (const kuhn::FaceSteps& face : kuhn::kFaces) {
        if (face.middle == step || face.upper == step) lookAt(edges_[e], at, face, found[chunk]);
        if ((face.middle ^ face.upper) == step)
          lookAt(edges_[e], at - offsetOfCorner(face.middle), face, found[chunk]);
      }
    }
  });
  std::vector<FoundFace> all;
  for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
  std::sort(all.begin(), all.end(),
            [](const FoundFace& a, const FoundFace& b) { return a.key < b.key; });
  for (const FoundFace& face : all) {
    if (face.hasPoint) faces_.push_back({face.key, face.point - V3d(simplices_.pointOf(face.key))});
    if (face.isJunction) junctionFaces_.push_back(face.key);
  }
}

std::uint32_t SheetBuilder::crossedEdges(const V3i& cell, std::size_t tetrahedron) const {
  std::uint32_t crossed = 0;
  for (std::size_t e = 0; e < CutTetrahedron::kEdges.size(); ++e) {
    const auto [i, j] = CutTetrahedron::kEdges[e];
    const kuhn::Corner low = kuhn::kTetrahedra[tetrahedron][i],
                       high = kuhn::kTetrahedra[tetrahedron][j];
    if (find(cell + offsetOfCorner(low), low ^ high)) crossed |= 1u << e;
  }
  return crossed;
}

/// Points on the faces of a tetrahedron.
std::vector<V3d> SheetBuilder::pointsOfFaces(const V3i& cell, std::size_t tetrahedron) const {
  std::vector<V3d> points;
  for (std::size_t opposite = 0; opposite < 4; ++opposite) {
    std::array<kuhn::Corner, 3> chain{};
    std::size_t n = 0;
    for (std::size_t i = 0; i < 4; ++i)
      if (i != opposite) chain[n++] = kuhn::kTetrahedra[tetrahedron][i];
    const SimplexKey key = simplices_.key(cell + offsetOfCorner(chain[0]),
                                          kuhn::faceSlot(chain[1] ^ chain[0], chain[2] ^ chain[0]));
    const auto face =
        std::lower_bound(faces_.begin(), faces_.end(), key,
                         [](const PlacedPoint& a, SimplexKey b) { return a.key < b; });
    if (face != faces_.end() && face->key == key)
      points.push_back(V3d(simplices_.pointOf(key)) + face->offset);
  }
  return points;
}

void SheetBuilder::placeEnds() {
  std::vector<SimplexKey> tetrahedra;
  for (const SimplexKey face : junctionFaces_) {
    const kuhn::FaceSteps& steps = kuhn::kFaces[GridSimplices::slotOf(face) - 7];
    for (kuhn::Corner low = 0; low < 8; ++low) {
      if (low & steps.upper) continue;
      for (std::size_t t = 0; t < 6; ++t) {
        const auto& chain = kuhn::kTetrahedra[t];
        const auto holds = [&](kuhn::Corner corner) {
          return std::find(chain.begin(), chain.end(), corner) != chain.end();
        };
        if (holds(low) && holds(low | steps.middle) && holds(low | steps.upper))
          tetrahedra.push_back(simplices_.key(simplices_.pointOf(face) - offsetOfCorner(low),
                                              kuhn::tetrahedronSlot(t)));
      }
    }
  }
  std::sort(tetrahedra.begin(), tetrahedra.end());
  tetrahedra.erase(std::unique(tetrahedra.begin(), tetrahedra.end()), tetrahedra.end());
  for (const SimplexKey key : tetrahedra) {
    const V3i cell = simplices_.pointOf(key);
    const std::size_t t = GridSimplices::slotOf(key) - kuhn::tetrahedronSlot(0);
    const CutTetrahedron& cut = cutTetrahedron(crossedEdges(cell, t), false);
    const std::vector<V3d> points = pointsOfFaces(cell, t);
    if (!cut.hasInside || points.empty()) continue;
    const V3d mean =
        std::accumulate(points.begin(), points.end(), V3d(0)) / static_cast<double>(points.size());
    const V3d* best = nullptr;
    // Junctions also branch where more than three sheets meet in a line, away from its ends.
    double least = cut.isJunctionPoint ? kEndReach / 2 : kEndReach;
    for (const V3d& end : features_.ends()) {
      if ((end - mean).length() >= least) continue;
      least = (end - mean).length();
      best = &end;
    }
    if (best) {
      placed_.push_back({key, *best - V3d(cell)});
    } else if (!cut.isJunctionPoint) {
      const auto point = features_.closest(SheetFeatures::Kind::Junction, mean);
      if (point) placed_.push_back({key, *point - V3d(cell)});
    }
  }
}

void SheetBuilder::placeCorners() {
  constexpr double kOneSide = 0.9;  // cosine, seen from the corner
  std::vector<SimplexKey> taken;
  for (const V3d& p : features_.corners()) {
    // The sheet may end at the corner without crossing an edge of its tetrahedron. The nearest
    // tetrahedron with a rim takes it then.
    V3i centre;
    for (int axis = 0; axis < 3; ++axis) centre[axis] = static_cast<int>(std::floor(p[axis]));
    std::optional<SimplexKey> best;
    double least = kEndReach;
    V3i cell;
    for (cell.x = centre.x - 1; cell.x <= centre.x + 1; ++cell.x)
      for (cell.y = centre.y - 1; cell.y <= centre.y + 1; ++cell.y)
        for (cell.z = centre.z - 1; cell.z <= centre.z + 1; ++cell.z)
          for (std::size_t t = 0; t < 6; ++t) {
            const std::uint32_t crossed = crossedEdges(cell, t);
            if (crossed == 0) continue;
            const CutTetrahedron& cut = cutTetrahedron(crossed, false);
            if (cut.hasInside || cut.rims.size() != 1) continue;
            const std::vector<V3d> points = pointsOfFaces(cell, t);
            if (points.size() != 2) continue;
            // The rim enters on one side of the corner and leaves on the other one.
            const V3d a = points[0] - p, b = points[1] - p;
            if ((a ^ b) > kOneSide * a.length() * b.length()) continue;
            const double distance = ((a + b) / 2).length();
            if (distance >= least) continue;
            const SimplexKey key = simplices_.key(cell, kuhn::tetrahedronSlot(t));
            if (std::find(taken.begin(), taken.end(), key) != taken.end()) continue;
            least = distance;
            best = key;
          }
    if (!best) continue;
    taken.push_back(*best);
    placed_.push_back({*best, p - V3d(simplices_.pointOf(*best))});
  }
}

std::vector<NarrowGap> SheetBuilder::narrowGaps() const {
  constexpr double kLeastSlope = 0.5;     // of a surface to the line
  constexpr double kLeastParallel = 0.9;  // cosine of the angle of both surfaces
  struct OnLine {
    int axis;
    V3i line;  ///< coordinates across, with 0 along the axis
    double at;
    SimplexKey edge;
    std::uint32_t triangle;
  };
  std::vector<OnLine> all;
  for (const GridCrossing& crossing : crossings_) {
    const std::uint32_t step = GridSimplices::slotOf(crossing.edge) + 1;
    if (step != 1 && step != 2 && step != 4) continue;
    const int axis = step == 4 ? 0 : step == 2 ? 1 : 2;
    V3i line = simplices_.pointOf(crossing.edge);
    const double at = line[axis] + crossing.position;
    line[axis] = 0;
    all.push_back({axis, line, at, crossing.edge, crossing.triangle});
  }
  std::sort(all.begin(), all.end(), [](const OnLine& a, const OnLine& b) {
    return std::tie(a.axis, a.line.x, a.line.y, a.line.z, a.at, a.triangle) <
           std::tie(b.axis, b.line.x, b.line.y, b.line.z, b.at, b.triangle);
  });
  const auto normalOf = [&](std::uint32_t t) {
    const V3d &a = points_[triangles_[t][0]], &b = points_[triangles_[t][1]],
              &c = points_[triangles_[t][2]];
    return (b - a).cross(c - a).normalized();
  };
  std::vector<NarrowGap> gaps;
  for (std::size_t n = 1; n < all.size(); ++n) {
    const OnLine &a = all[n - 1], &b = all[n];
    if (a.axis != b.axis || a.line != b.line || b.at - a.at >= 2) continue;
    const V3d u = normalOf(a.triangle), v = normalOf(b.triangle);
    const double slope = std::min(std::abs(u[a.axis]), std::abs(v[a.axis]));
    if (slope < kLeastSlope || std::abs(u ^ v) < kLeastParallel) continue;
    NarrowGap gap;
    gap.thickness = (b.at - a.at) * slope;
    if (gap.thickness >= 1) continue;
    gap.isLost = a.edge == b.edge;
    // The upper end of the first edge lies between them, if a grid point does.
    V3i between = simplices_.pointOf(a.edge);
    if (!gap.isLost) between[a.axis] += 1;
    gap.label = labelAt_(between);
    gap.position = V3d(a.line);
    gap.position[a.axis] = (a.at + b.at) / 2;
    gaps.push_back(gap);
  }
  return gaps;
}

std::vector<ThinPart> thinPartsOf(const std::vector<NarrowGap>& gaps, double voxelSize) {
  std::vector<ThinPart> parts;
  for (const NarrowGap& gap : gaps) {
    auto part =
        std::lower_bound(parts.begin(), parts.end(), gap.label,
                         [](const ThinPart& p, RegionLabel label) { return p.label < label; });
    if (part == parts.end() || part->label != gap.label) {
      part = parts.insert(part, ThinPart());
      part->label = gap.label;
      part->thickness = std::numeric_limits<double>::infinity();
    }
    ++part->places;
    part->isLost = part->isLost || gap.isLost;
    if (gap.thickness * voxelSize >= part->thickness) continue;
    part->thickness = gap.thickness * voxelSize;
    part->position = gap.position * voxelSize;
  }
  return parts;
}

}  // namespace levelset
