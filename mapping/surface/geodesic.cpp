#include "mapping/surface/geodesic.h"

#include <algorithm>
#include <cmath>

#include "mapping/surface/geodesic_search.h"
#include "mapping/surface/surface_walk.h"

namespace mapping {
namespace {

using Imath::V3d;

// No path is shorter than its chord. A straightened path whose length is below this multiple of its
// chord, the straight distance of its ends, is accepted without a search for other paths.
constexpr double kNearlyStraight = 1.01;
// A roughly straightened path is straightened fully only if its length is below this multiple of
// the shortest length found so far.
constexpr double kWorthTrying = 1.02;
// Least cosine between the surface normals at the ends of a path segment that stays on the surface,
// even over an edge.
constexpr double kLeastTurnCosine = -0.7;
// Cosine of 0.2 radians: an arc with this turn is 0.2 % longer than its chord.
constexpr double kFlatCosine = 0.98;
constexpr std::size_t kCoarsestSegments = 8;
constexpr int kMaxSweeps = 600;
constexpr int kSweepsBetweenLooks = 16;
constexpr double kCalm = 1e-5;      // relative decrease of the path's length between two checks
constexpr double kStraight = 1e-3;  // largest move of a point in the last sweep, voxels

V3d tangential(const V3d& offset, const V3d& normal) {
  return offset - normal * offset.dot(normal);
}

/// Walks from a towards b by steps of a voxel on φ = height; returns an empty path when the walk is
/// stuck.
std::vector<V3d> walkTowards(const SurfaceField& field, double height, const V3d& a, const V3d& b) {
  const double step = field.voxelSize();
  const double maxSteps = 4 * (b - a).length() / step + 16;
  std::vector<V3d> path = {a};
  while ((b - path.back()).length() > 1.5 * step) {
    const V3d p = path.back(), offset = b - p;
    const V3d along = tangential(offset, field.normal(p));
    if (along.length() < 1e-3 * offset.length() || static_cast<double>(path.size()) > maxSteps)
      return {};
    V3d next = p + along.normalized() * step;
    if (!field.project(next, height)) return {};
    const double moved = (next - p).length();
    if (moved > 2.5 * step || moved < 0.1 * step) return {};
    path.push_back(next);
  }
  path.push_back(b);
  return path;
}

/// True if a straight step along the surface can turn the normal from `normal` to `next`. Nearly
/// opposite normals mean that the step passes through a thin sheet.
bool isSoundTurn(const V3d& normal, const V3d& next) {
  return normal.dot(next) > kLeastTurnCosine;
}

std::vector<V3d> normalsOn(const SurfaceField& field, const std::vector<V3d>& path) {
  std::vector<V3d> normals;
  for (const V3d& p : path) normals.push_back(field.normal(p));
  return normals;
}

bool isSound(const std::vector<V3d>& normals) {
  for (std::size_t i = 1; i < normals.size(); ++i)
    if (!isSoundTurn(normals[i - 1], normals[i])) return false;
  return true;
}

/// Straightens a path by over-relaxed sweeps until no point moves; the ends stay.
void relaxPath(const SurfaceField& field, double height, std::vector<V3d>& path) {
  if (path.size() < 3) return;
  const double segments = static_cast<double>(path.size() - 1);
  // Optimal SOR factor for a chain.
  const double best = 2 / (1 + std::sin(std::acos(-1.0) / segments));
  double factor = best, lengthBefore = HUGE_VAL;
  const double longest = 0.5 * pathLength(path) / segments;
  std::vector<V3d> normals = normalsOn(field, path);
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double moved = 0;
    for (std::size_t n = 1; n + 1 < path.size(); ++n) {
      // Alternating directions, so that neither end is favoured.
      const std::size_t i = sweep % 2 == 0 ? n : path.size() - 1 - n;
      V3d move = ((path[i - 1] + path[i + 1]) * 0.5 - path[i]) * factor;
      move = tangential(move, normals[i]);
      const double length = move.length();
      if (length > longest) move *= longest / length;
      V3d next = path[i] + move;
      if (!field.project(next, height) || (next - path[i]).length() > 2 * longest) continue;
      const V3d normal = field.normal(next);
      // A segment that stays on the surface must still do so after the move; otherwise the path
      // would jump to the other side of a thin part.
      const auto spoils = [&](std::size_t other) {
        return !isSoundTurn(normal, normals[other]) && isSoundTurn(normals[i], normals[other]);
      };
      if (spoils(i - 1) || spoils(i + 1)) continue;
      moved = std::max(moved, (next - path[i]).length());
      path[i] = next;
      normals[i] = normal;
    }
    if (moved < kStraight * field.voxelSize()) return;
    if (sweep % kSweepsBetweenLooks != 0) continue;
    // Near edges the points may oscillate for ever. So over-relaxation ends when the path's length
    // no longer decreases, and the sweeps end when this happens again.
    const double length = pathLength(path);
    const bool isCalm = lengthBefore - length < kCalm * length;
    if (isCalm && factor == 1) return;
    if (isCalm) factor = 1;
    lengthBefore = length;
  }
}

std::vector<V3d> withMidpoints(const SurfaceField& field, double height,
                               const std::vector<V3d>& path) {
  std::vector<V3d> result = {path.front()};
  for (std::size_t i = 1; i < path.size(); ++i) {
    V3d middle = (path[i - 1] + path[i]) * 0.5;
    if (field.project(middle, height)) result.push_back(middle);
    result.push_back(path[i]);
  }
  return result;
}

/// Inserts points where the surface bends, so that chords do not cut its edges short.
void followBend(const SurfaceField& field, double height, const V3d& p, const V3d& q, int depth,
                std::vector<V3d>& result) {
  const bool isFlat = field.normal(p).dot(field.normal(q)) > kFlatCosine;
  V3d middle = (p + q) * 0.5;
  if (!isFlat && depth > 0 && field.project(middle, height)) {
    // Near a ridge of φ, a midpoint may be projected far aside, which would lengthen the path.
    const double chord = (q - p).length();
    if ((middle - p).length() < chord && (middle - q).length() < chord) {
      followBend(field, height, p, middle, depth - 1, result);
      followBend(field, height, middle, q, depth - 1, result);
      return;
    }
  }
  result.push_back(q);
}

std::vector<V3d> withBends(const SurfaceField& field, double height, const std::vector<V3d>& path) {
  constexpr int kHalvings = 4;
  std::vector<V3d> result = {path.front()};
  for (std::size_t i = 1; i < path.size(); ++i)
    followBend(field, height, path[i - 1], path[i], kHalvings, result);
  return result;
}

/// True if every point of the path lies within `distance` of the chords of another path.
bool isBeside(const std::vector<V3d>& path, const std::vector<V3d>& other, double distance) {
  return std::all_of(path.begin(), path.end(), [&](const V3d& p) {
    for (std::size_t i = 1; i < other.size(); ++i) {
      const V3d chord = other[i] - other[i - 1], offset = p - other[i - 1];
      const double along = std::clamp(offset.dot(chord) / chord.length2(), 0.0, 1.0);
      if ((offset - chord * along).length() <= distance) return true;
    }
    return false;
  });
}

/// Samples a path evenly, about every four voxels, and more densely where a segment would cut
/// through a thin part.
std::vector<V3d> coarsePath(const SurfaceField& field, double height,
                            const std::vector<V3d>& path) {
  const double voxels = pathLength(path) / field.voxelSize();
  std::vector<V3d> result;
  // Segments of about four voxels have chords that stay within any band.
  for (std::size_t segments = std::max(kCoarsestSegments, static_cast<std::size_t>(voxels / 4));;
       segments *= 2) {
    result = sampleByArcLength(path, segments + 1);
    for (std::size_t i = 1; i + 1 < result.size(); ++i) (void)field.project(result[i], height);
    if (isSound(normalsOn(field, result)) || static_cast<double>(segments) > 4 * voxels)
      return result;
  }
}

}  // namespace

double pathLength(const std::vector<V3d>& path) {
  double length = 0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).length();
  return length;
}

std::vector<V3d> sampleByArcLength(const std::vector<V3d>& path, std::size_t count) {
  const double total = pathLength(path);
  std::vector<V3d> result = {path.front()};
  double reached = 0;
  std::size_t segment = 1;
  for (std::size_t n = 1; n + 1 < count; ++n) {
    const double wanted = total * static_cast<double>(n) / static_cast<double>(count - 1);
    double length = (path[segment] - path[segment - 1]).length();
    while (reached + length < wanted && segment + 1 < path.size()) {
      reached += length;
      ++segment;
      length = (path[segment] - path[segment - 1]).length();
    }
    const double part = length > 0 ? std::clamp((wanted - reached) / length, 0.0, 1.0) : 0;
    result.push_back(path[segment - 1] + (path[segment] - path[segment - 1]) * part);
  }
  result.push_back(path.back());
  return result;
}

std::vector<V3d> straighten(const SurfaceField& field, double height, std::vector<V3d> path) {
  const double voxels = pathLength(path) / field.voxelSize();
  path = coarsePath(field, height, path);
  relaxPath(field, height, path);
  while (static_cast<double>(path.size()) < voxels) {
    const std::size_t before = path.size();
    path = withMidpoints(field, height, path);
    if (path.size() == before) break;
    relaxPath(field, height, path);
  }
  return withBends(field, height, path);
}

std::vector<V3d> geodesic(const SurfaceField& field, double height, const V3d& a, const V3d& b,
                          double longest) {
  const GeodesicSearch search(field, height, a, b);
  std::vector<V3d> path = walkTowards(field, height, a, b);
  if (path.empty() || pathLength(path) > longest) path = search.shortest();
  if (path.empty() || pathLength(path) > longest) return {};
  path = straighten(field, height, std::move(path));
  double shortest = pathLength(path);
  if (shortest <= kNearlyStraight * (b - a).length()) return path;
  for (const std::vector<V3d>& offset : search.alternatives(shortest)) {
    std::vector<V3d> other = coarsePath(field, height, offset);
    relaxPath(field, height, other);
    if (pathLength(withBends(field, height, other)) > kWorthTrying * shortest ||
        isBeside(other, path, 2 * field.voxelSize()))
      continue;
    other = straighten(field, height, std::move(other));
    const double length = pathLength(other);
    if (length >= shortest) continue;
    shortest = length;
    path = std::move(other);
  }
  return path;
}

std::vector<V3d> geodesicLike(const SurfaceField& field, double height, const V3d& a, const V3d& b,
                              const std::vector<V3d>& path) {
  // Longest segment of an unbroken path, as a multiple of the mean segment.
  constexpr double kLongest = 3;
  const double voxels = pathLength(path) / field.voxelSize();
  const std::size_t segments = std::max(kCoarsestSegments, static_cast<std::size_t>(voxels / 2));
  std::vector<V3d> moved = sampleByArcLength(path, segments + 1);
  const V3d first = a - path.front(), last = b - path.back();
  for (std::size_t i = 1; i < segments; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(segments);
    moved[i] += first * (1 - t) + last * t;
    if (!field.project(moved[i], height)) return {};
  }
  moved.front() = a;
  moved.back() = b;
  const double most = kLongest * pathLength(moved) / static_cast<double>(segments);
  for (std::size_t i = 1; i <= segments; ++i)
    if ((moved[i] - moved[i - 1]).length() > most) return {};
  if (!isSound(normalsOn(field, moved))) return {};
  return straighten(field, height, std::move(moved));
}

std::optional<V3d> walkStraight(const SurfaceField& field, double height, const V3d& from,
                                const V3d& direction, double length) {
  SurfaceWalk walk(field, height, from, direction);
  if (!walk.advance(length)) return {};
  return walk.position();
}

}  // namespace mapping
