#include "levelset/points/creases/crease_samples.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <optional>

#include "levelset/points/creases/meeting.h"

namespace levelset::points {
namespace {

using Imath::V3d;

/// Three pieces near a point, with a normal of each.
struct Triple {
  std::uint32_t point;
  std::array<std::uint32_t, 3> pieces;
  std::array<V3d, 3> normals;
};

/// Finds the points with three or more pieces among the neighbours of their neighbours.
std::vector<Triple> findTriples(const PointSurface& whole, const PointSurface& divided,
                                const Pieces& pieces) {
  std::vector<Triple> triples;
  std::map<std::uint32_t, std::pair<double, std::uint32_t>> nearest;  // point of each piece
  const auto visit = [&](std::uint32_t from, std::uint32_t point) {
    if (pieces.pieces[point] == kNoPiece || !divided.hasFit(point)) return;
    const std::pair found{(whole.positions()[point] - whole.positions()[from]).length2(), point};
    const auto [at, isNew] = nearest.emplace(pieces.pieces[point], found);
    if (!isNew) at->second = std::min(at->second, found);
  };
  for (std::uint32_t i = 0; i < whole.size(); ++i) {
    bool isBeside = false;
    for (const std::uint32_t j : whole.graph().neighbours(i))
      isBeside = isBeside || pieces.pieces[j] != pieces.pieces[i];
    if (!isBeside) continue;
    nearest.clear();
    visit(i, i);
    for (const std::uint32_t j : whole.graph().neighbours(i)) {
      visit(i, j);
      for (const std::uint32_t k : whole.graph().neighbours(j)) visit(i, k);
    }
    constexpr std::size_t kMostPieces = 8;
    if (nearest.size() < 3 || nearest.size() > kMostPieces) continue;
    for (auto a = nearest.begin(); a != nearest.end(); ++a)
      for (auto b = std::next(a); b != nearest.end(); ++b)
        for (auto c = std::next(b); c != nearest.end(); ++c) {
          const auto normal = [&](const auto& one) { return divided.normal(one->second.second); };
          triples.push_back({i, {a->first, b->first, c->first}, {normal(a), normal(b), normal(c)}});
        }
  }
  return triples;
}

/// Corner with what is needed to compute it again for more pieces.
struct FoundCorner {
  V3d position;
  std::vector<std::uint32_t> pieces;
  std::vector<V3d> normals;
  double spacing;
};

/// Merges two corners at about one position.
FoundCorner merged(const FoundCorner& a, const FoundCorner& b) {
  FoundCorner result = a;
  for (std::size_t k = 0; k < b.pieces.size(); ++k) {
    const auto at = std::lower_bound(result.pieces.begin(), result.pieces.end(), b.pieces[k]);
    if (at != result.pieces.end() && *at == b.pieces[k]) continue;
    result.normals.insert(result.normals.begin() + (at - result.pieces.begin()), b.normals[k]);
    result.pieces.insert(at, b.pieces[k]);
  }
  return result;
}

}  // namespace

std::vector<PairSamples> sampleCreases(const PointSurface& whole, const PointSurface& divided,
                                       const Pieces& pieces) {
  struct Edge {
    std::array<std::uint32_t, 2> pieces, points;
  };
  std::vector<Edge> edges;
  for (std::uint32_t i = 0; i < whole.size(); ++i)
    for (const std::uint32_t j : whole.graph().neighbours(i)) {
      const std::uint32_t a = pieces.pieces[i], b = pieces.pieces[j];
      if (a < b && a != kNoPiece && b != kNoPiece && divided.hasFit(i) && divided.hasFit(j))
        edges.push_back({{a, b}, {i, j}});
    }
  std::vector<std::optional<CreaseSample>> found(edges.size());
  tbb::parallel_for(std::size_t{0}, edges.size(), [&](std::size_t e) {
    const auto [i, j] = edges[e].points;
    const double spacing = 0.5 * (whole.spacing(i) + whole.spacing(j));
    constexpr double kSampleReach = 2;  // spacings
    const V3d sides[] = {divided.normal(i), divided.normal(j)};
    const auto at =
        meet(divided, edges[e].pieces, sides, (whole.positions()[i] + whole.positions()[j]) * 0.5,
             spacing, kSampleReach * spacing);
    if (at) found[e] = {at->position, {at->normals[0], at->normals[1]}, spacing};
  });
  std::map<std::array<std::uint32_t, 2>, PairSamples> pairs;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    PairSamples& pair = pairs[edges[e].pieces];
    pair.pieces = edges[e].pieces;
    if (found[e])
      pair.samples.push_back(*found[e]);
    else
      ++pair.lost;
  }
  std::vector<PairSamples> result;
  for (auto& [key, pair] : pairs) result.push_back(std::move(pair));
  return result;
}

std::vector<CreaseCorner> findCorners(const PointSurface& whole, const PointSurface& divided,
                                      const Pieces& pieces) {
  const std::vector<Triple> triples = findTriples(whole, divided, pieces);
  constexpr double kTripleReach = 2.5, kSame = 0.5;  // spacings
  std::vector<std::optional<FoundCorner>> found(triples.size());
  tbb::parallel_for(std::size_t{0}, triples.size(), [&](std::size_t t) {
    const Triple& one = triples[t];
    const double spacing = whole.spacing(one.point);
    const auto at = meet(divided, one.pieces, one.normals, whole.positions()[one.point], spacing,
                         kTripleReach * spacing);
    if (!at) return;
    found[t] = FoundCorner{at->position,
                           {one.pieces.begin(), one.pieces.end()},
                           {one.normals.begin(), one.normals.end()},
                           spacing};
  });
  std::vector<FoundCorner> corners;
  for (const auto& one : found) {
    if (!one) continue;
    const auto same = std::find_if(corners.begin(), corners.end(), [&](const FoundCorner& other) {
      return (other.position - one->position).length() < kSame * other.spacing;
    });
    if (same == corners.end())
      corners.push_back(*one);
    else
      *same = merged(*same, *one);
  }
  std::vector<CreaseCorner> result;
  for (FoundCorner& corner : corners) {
    if (corner.pieces.size() > 3)
      if (const auto at = meet(divided, corner.pieces, corner.normals, corner.position,
                               corner.spacing, corner.spacing))
        corner.position = at->position;
    result.push_back({corner.position, std::move(corner.pieces)});
  }
  return result;
}

}  // namespace levelset::points
