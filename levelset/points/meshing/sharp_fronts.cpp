#include "levelset/points/meshing/sharp_fronts.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "levelset/points/creases/meeting.h"
#include "levelset/points/processing/normals.h"

namespace levelset::points {

using Imath::V3d;

namespace {

/// Factors on the edge lengths of sharp edges, and on those between them, for tries.
constexpr double kOutlineScales[] = {1, 0.8, 0.6};
constexpr double kInnerScales[] = {1, 0.9, 0.8, 0.7};

/// Pairs of all pieces of the parts that have conflicts.
std::vector<std::array<std::uint32_t, 2>> wholeParts(
    const Pieces& pieces, const std::vector<std::array<std::uint32_t, 2>>& conflicts) {
  std::set<std::uint32_t> parts;
  for (const auto& pair : conflicts) parts.insert(pieces.parts[pair[0]]);
  std::map<std::uint32_t, std::uint32_t> first;
  std::vector<std::array<std::uint32_t, 2>> pairs;
  for (std::uint32_t i = 0; i < pieces.count; ++i)
    if (parts.contains(pieces.parts[i]))
      pairs.push_back({first.emplace(pieces.parts[i], i).first->second, i});
  return pairs;
}

/// Vectors to the outside.
struct Sides {
  std::vector<V3d> vectors;
  std::size_t guessed = 0;  ///< parts whose outside is a guess
};

/// Returns the sides of the surface, or those of normals that keep sharp edges.
Sides sidesOf(const PointSurface& whole, const SharpOptions& options) {
  Sides sides;
  for (std::size_t i = 0; i < whole.size(); ++i) sides.vectors.push_back(whole.normal(i));
  sides.guessed = whole.guessedParts();
  if (options.hasSides) return sides;
  PointCloud cloud;
  cloud.positions.assign(whole.positions().begin(), whole.positions().end());
  const NormalsResult found = estimateNormals(
      std::move(cloud),
      {.maxMemory = options.maxMemory, .progress = subProgress(options.progress, 0, 0.1)});
  for (std::size_t i = 0; i < whole.size(); ++i)
    if (found.cloud.normals[i].length2() > 0) sides.vectors[i] = V3d(found.cloud.normals[i]);
  sides.guessed = found.report.guessed;
  return sides;
}

/// Turns the normals of pieces over, so that they agree across the curves. The larger part of the
/// points of connected pieces keeps its sides.
void turnPieces(const CreaseNetwork& network, Pieces& pieces) {
  struct Link {
    std::uint32_t to;
    bool isOpposed;
  };
  std::vector<std::vector<Link>> links(pieces.count);
  const auto link = [&](const std::array<std::uint32_t, 2>& pair, bool isOpposed) {
    links[pair[0]].push_back({pair[1], isOpposed});
    links[pair[1]].push_back({pair[0], isOpposed});
  };
  for (const CreaseCurve& curve : network.curves) link(curve.pieces, false);
  for (const auto& pair : network.opposed) link(pair, true);
  std::vector<std::size_t> sizes(pieces.count, 0);
  for (const std::uint32_t piece : pieces.pieces)
    if (piece != kNoPiece) ++sizes[piece];
  std::vector<char> isTurned(pieces.count, 0), isSeen(pieces.count, 0);
  for (std::uint32_t start = 0; start < pieces.count; ++start) {
    if (isSeen[start]) continue;
    std::vector<std::uint32_t> connected = {start};
    isSeen[start] = 1;
    std::array<std::size_t, 2> points{};
    for (std::size_t k = 0; k < connected.size(); ++k) {
      const std::uint32_t at = connected[k];
      points[isTurned[at] != 0 ? 1 : 0] += sizes[at];
      for (const Link& one : links[at]) {
        if (isSeen[one.to]) continue;
        isSeen[one.to] = 1;
        isTurned[one.to] = static_cast<char>((isTurned[at] != 0) != one.isOpposed);
        connected.push_back(one.to);
      }
    }
    if (points[1] > points[0])
      for (const std::uint32_t at : connected) isTurned[at] = isTurned[at] == 0;
  }
  for (std::size_t i = 0; i < pieces.pieces.size(); ++i)
    if (pieces.pieces[i] != kNoPiece && isTurned[pieces.pieces[i]] != 0)
      pieces.normals[i] = -pieces.normals[i];
}

}  // namespace

SharpSurface divideSurface(const PointSurface& whole, const SharpOptions& options) {
  constexpr int kMostRounds = 4, kMostMoves = 4;
  SharpSurface result;
  Pieces& pieces = result.pieces;
  const Sides sides = sidesOf(whole, options);
  result.guessed = sides.guessed;
  pieces = findPieces(whole, options.angle, sides.vectors);
  for (int round = 0; pieces.count > whole.partCount(); ++round) {
    const double done = std::min(0.9, 0.1 + 0.15 * round);
    int fits = 0;
    const auto divide = [&] {
      PointSurface divided = whole;
      const double from = done + 0.1 * fits / (kMostMoves + 1);
      ++fits;
      divided.divide(pieces.pieces, pieces.count, pieces.normals, options.smoothing,
                     subProgress(options.progress, from, from + 0.1 / (kMostMoves + 1)));
      return divided;
    };
    PointSurface divided = divide();
    for (int move = 0; move < kMostMoves && reassign(whole, divided, pieces) > 0; ++move)
      divided = divide();
    result.network = traceCreases(whole, divided, pieces);
    if (result.network.conflicts.empty() && result.network.opposed.empty()) {
      result.divided = std::move(divided);
      return result;
    }
    const CreaseNetwork network = std::move(result.network);
    result.network = {};
    if (round == 0 && !options.hasSides && !network.opposed.empty()) {
      turnPieces(network, pieces);
      continue;
    }
    auto conflicts = network.conflicts;
    conflicts.insert(conflicts.end(), network.opposed.begin(), network.opposed.end());
    pieces.join(round < kMostRounds ? conflicts : wholeParts(pieces, conflicts));
  }
  return result;
}

struct SharpFronts::Outline {
  std::vector<V3d> positions;
  std::vector<std::uint32_t> cornerVertices;  ///< for each corner of the network, or kNoPiece
  std::map<std::uint32_t, std::vector<std::uint32_t>>
      vertices;  ///< along each curve, with both ends
  std::map<std::uint32_t, std::vector<std::array<V3d, 2>>> normals;  ///< the same
};

SharpFronts::SharpFronts(const PointSurface& whole, const SharpSurface& sharp,
                         const PointEdgeLimits& limits)
    : surface_(*sharp.divided),
      sharp_(sharp),
      limits_(limits),
      lengths_(lengthsAtPoints(*sharp.divided, whole.graph(), limits, capsAtCreases())),
      borders_(*sharp.divided),
      parts_(partsOf(*sharp.divided, lengths_)),
      pieces_(whole.partCount()),
      curves_(whole.partCount()) {
  for (std::uint32_t i = 0; i < sharp.pieces.count; ++i)
    pieces_[sharp.pieces.parts[i]].push_back(i);
  for (std::uint32_t c = 0; c < sharp.network.curves.size(); ++c)
    curves_[sharp.pieces.parts[sharp.network.curves[c].pieces[0]]].push_back(c);
}

double SharpFronts::expectedTriangles() const {
  double sum = 0;
  for (const auto& pieces : pieces_)
    if (pieces.size() > 1)
      for (const std::uint32_t i : pieces) sum += parts_[i].expected;
  return sum;
}

/// Limits the edge lengths beside curves that bend: the chord of the angle.
std::vector<double> SharpFronts::capsAtCreases() const {
  std::vector<double> caps(surface_.size(), INFINITY);
  constexpr std::size_t kSpan = 4;  // positions each way, two spacings
  const double chord = 2 * std::sin(limits_.angle / 2);
  for (const CreaseCurve& curve : sharp_.network.curves) {
    const std::size_t n = curve.positions.size();
    if (n < 3) continue;
    for (std::size_t i = 0; i < n; ++i) {
      std::size_t before, after;
      if (curve.isClosed()) {
        const std::size_t span = std::min(kSpan, (n - 1) / 2);
        before = (i + n - span) % n;
        after = (i + span) % n;
      } else {
        const std::size_t span = std::min({kSpan, i, n - 1 - i});
        if (span == 0) continue;
        before = i - span;
        after = i + span;
      }
      const V3d back = curve.positions[i] - curve.positions[before],
                on = curve.positions[after] - curve.positions[i];
      const double turned = std::atan2(back.cross(on).length(), back.dot(on));
      if (!(turned > 0)) continue;
      const double cap = chord * 0.5 * (back.length() + on.length()) / turned;
      for (std::size_t k = 0; k < 2; ++k) {
        const std::uint32_t near =
            surface_.nearest(curve.positions[i], curve.normals[i][k], curve.pieces[k]);
        if (near != kNoPiece) caps[near] = std::min(caps[near], cap);
      }
    }
  }
  return caps;
}

double SharpFronts::lengthAt(const CreaseCurve& curve, std::size_t position) const {
  double length = limits_.longest;
  for (std::size_t k = 0; k < 2; ++k) {
    const std::uint32_t near =
        surface_.nearest(curve.positions[position], curve.normals[position][k], curve.pieces[k]);
    if (near != kNoPiece) length = std::min(length, lengths_[near]);
  }
  return length;
}

/// Adds the vertices of a curve, one edge length apart.
void SharpFronts::addCurve(std::uint32_t number, double scale, Outline& outline) const {
  const CreaseCurve& curve = sharp_.network.curves[number];
  const std::size_t n = curve.positions.size(), spans = curve.isClosed() ? n : n - 1;
  // Number of edges up to each position.
  std::vector<double> edges(1, 0.0);
  for (std::size_t i = 0; i < spans; ++i) {
    const std::size_t j = (i + 1) % n;
    const double density = 0.5 * (1 / lengthAt(curve, i) + 1 / lengthAt(curve, j));
    edges.push_back(edges.back() +
                    (curve.positions[j] - curve.positions[i]).length() * density / scale);
  }
  // Two curves between the same corners must not share an edge.
  const auto ends = std::minmax(curve.corners[0], curve.corners[1]);
  const auto isBeside = [&](std::uint32_t c) {
    const auto& other = sharp_.network.curves[c].corners;
    return c != number && std::minmax(other[0], other[1]) == ends;
  };
  const auto& all = curves_[sharp_.pieces.parts[curve.pieces[0]]];
  const std::size_t least = curve.isClosed() || ends.first == ends.second   ? 3
                            : std::any_of(all.begin(), all.end(), isBeside) ? 2
                                                                            : 1;
  const std::size_t count = std::max(least, static_cast<std::size_t>(std::lround(edges.back())));
  auto& vertices = outline.vertices[number];
  auto& normals = outline.normals[number];
  const auto addCorner = [&](std::size_t end, std::size_t position) {
    std::uint32_t& vertex = outline.cornerVertices[curve.corners[end]];
    if (vertex == kNoPiece) {
      vertex = static_cast<std::uint32_t>(outline.positions.size());
      outline.positions.push_back(curve.positions[position]);
    }
    vertices.push_back(vertex);
    normals.push_back(curve.normals[position]);
  };
  if (!curve.isClosed()) addCorner(0, 0);
  for (std::size_t k = curve.isClosed() ? 0 : 1; k < count; ++k) {
    const double wanted = edges.back() * static_cast<double>(k) / static_cast<double>(count);
    const auto above = std::upper_bound(edges.begin(), edges.end() - 1, wanted);
    const auto j = std::max<std::size_t>(1, static_cast<std::size_t>(above - edges.begin()));
    const double part = (wanted - edges[j - 1]) / std::max(edges[j] - edges[j - 1], 1e-300);
    const V3d &from = curve.positions[j - 1], &to = curve.positions[j % n];
    const auto& sides = curve.normals[part > 0.5 ? j % n : j - 1];
    V3d position = from + (to - from) * part;
    std::array<V3d, 2> own = sides;
    const double span = (to - from).length();
    if (const auto at = meet(surface_, curve.pieces, sides, position, span, span)) {
      position = at->position;
      own = {at->normals[0], at->normals[1]};
    }
    vertices.push_back(static_cast<std::uint32_t>(outline.positions.size()));
    outline.positions.push_back(position);
    normals.push_back(own);
  }
  if (!curve.isClosed()) addCorner(1, n - 1);
}

SharpFronts::Outline SharpFronts::outlineOf(std::uint32_t part, double scale) const {
  Outline outline;
  outline.cornerVertices.assign(sharp_.network.corners.size(), kNoPiece);
  for (const std::uint32_t c : curves_[part]) addCurve(c, scale, outline);
  return outline;
}

/// Returns the loops around a piece.
SharpFronts::PieceLoops SharpFronts::loopsOf(std::uint32_t piece, const Outline& outline) const {
  PieceLoops result;
  std::map<std::uint32_t, std::uint32_t> own;  // vertices of the outline
  for (const std::vector<PieceSide>& loop : sharp_.network.loops[piece]) {
    std::vector<std::uint32_t>& vertices = result.start.loops.emplace_back();
    for (const PieceSide& side : loop) {
      const auto& along = outline.vertices.at(side.curve);
      const auto& normals = outline.normals.at(side.curve);
      // Each side ends where the next one begins.
      const std::size_t count =
          along.size() - (sharp_.network.curves[side.curve].isClosed() ? 0 : 1);
      for (std::size_t k = 0; k < count; ++k) {
        const std::size_t at = side.isReversed ? along.size() - 1 - k : k;
        const auto [found, isNew] =
            own.emplace(along[at], static_cast<std::uint32_t>(result.numbers.size()));
        if (isNew) {
          result.numbers.push_back(along[at]);
          result.start.positions.push_back(outline.positions[along[at]]);
          result.start.normals.push_back(normals[at][side.isReversed]);
        }
        vertices.push_back(found->second);
      }
    }
    for (std::size_t i = 0; i < vertices.size(); ++i)
      result.longest =
          std::max(result.longest, (result.start.positions[vertices[i]] -
                                    result.start.positions[vertices[(i + 1) % vertices.size()]])
                                       .length());
  }
  return result;
}

PartMesh SharpFronts::meshPiece(std::uint32_t piece, const PieceLoops& loops, double scale,
                                const Progress& progress) const {
  const SurfacePart& part = parts_[piece];
  PartMesh best;
  best.missed = part.points.size() + 1;
  for (const double inner : kInnerScales) {
    PartMesh found;
    found.scale = scale * inner;
    const PartFront front(surface_, borders_, lengths_, piece, part, found.scale);
    AdvancingFrontOptions options = advancingFrontOptions(part, found.scale, progress);
    options.longest = std::max(options.longest, loops.longest);
    found.front = advanceFront(front, loops.start, options);
    found.missed = countMissed(found.front, surface_, part, lengths_, found.scale);
    // A hole is filled where a curve of the piece was not found, too.
    if (found.isComplete() && found.front.filled == 0) return found;
    found.missed += found.front.filled;
    if (found.missed < best.missed) best = std::move(found);
  }
  return best;
}

/// Joins the meshes of the pieces. Returns false if they do not fit together.
bool SharpFronts::join(const std::vector<PartMesh>& fronts, std::vector<PieceLoops>& loops,
                       const Outline& outline, FrontMesh& mesh) const {
  mesh.positions = outline.positions;
  std::set<std::array<std::uint32_t, 2>> sides;
  for (std::size_t i = 0; i < fronts.size(); ++i) {
    const FrontMesh& front = fronts[i].front;
    std::vector<std::uint32_t>& numbers = loops[i].numbers;
    for (std::size_t v = numbers.size(); v < front.positions.size(); ++v) {
      numbers.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
      mesh.positions.push_back(front.positions[v]);
    }
    for (const auto& t : front.triangles) {
      const std::array<std::uint32_t, 3> own = {numbers[t[0]], numbers[t[1]], numbers[t[2]]};
      mesh.triangles.push_back(own);
      for (std::size_t k = 0; k < 3; ++k)
        if (!sides.insert({own[k], own[(k + 1) % 3]}).second) return false;
    }
  }
  for (const auto& [curve, vertices] : outline.vertices)
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      if (k + 1 == vertices.size() && !sharp_.network.curves[curve].isClosed()) break;
      const std::uint32_t a = vertices[k], b = vertices[(k + 1) % vertices.size()];
      if (!sides.contains({a, b}) || !sides.contains({b, a})) return false;
    }
  mesh.isClosed = true;
  return true;
}

PartMesh SharpFronts::mesh(std::uint32_t part, const Progress& progress) const {
  const std::vector<std::uint32_t>& pieces = pieces_[part];
  PartMesh result;
  for (const double scale : kOutlineScales) {
    const Outline outline = outlineOf(part, scale);
    std::vector<PartMesh> fronts(pieces.size());
    std::vector<PieceLoops> loops(pieces.size());
    tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t i) {
      loops[i] = loopsOf(pieces[i], outline);
      fronts[i] = meshPiece(pieces[i], loops[i], scale, progress);
    });
    result = {};
    for (const PartMesh& front : fronts) {
      result.missed += front.missed + !front.front.isClosed;
      result.scale = std::min(result.scale, front.scale);
    }
    if (result.missed == 0 && join(fronts, loops, outline, result.front)) return result;
    result.front = {};
  }
  return result;
}

}  // namespace levelset::points
