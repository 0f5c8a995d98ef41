#include "levelset/deform/cage/cage.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "levelset/deform/cage/cage_shared.h"
#include "levelset/error.h"
#include "levelset/geometry/closest_on_triangle.h"
#include "levelset/geometry/mesh_sides.h"
#include "levelset/mesh_sign/self_intersections.h"

namespace levelset {
namespace {

using cage::CageFoot;
using cage::CageTriangle;
using cage::MeanValueWeights;
using cage::Sloped;
using Imath::V3d;

/// Smallest area of a triangle over the square of its longest edge.
constexpr double kLeastFlatness = 1e-9;
/// Distance from an edge within which a point lies on it, and step to a point inside whose
/// derivatives jet() takes there; over the diagonal.
constexpr double kOnEdge = 1e-13, kEdgeStep = 1e-6;
/// Distance from a face, over the diagonal, below which weights are multiplied by the height.
constexpr double kNearFace = 0.02;

std::string cagePlace(const V3d& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z);
}

/// Refuses cages that are not closed surfaces with one orientation.
void requireClosed(const TriMesh& mesh) {
  if (mesh.triangles.empty())
    throw InvalidInput("the cage has no triangles; give a closed triangle mesh");
  for (const V3d& p : mesh.positions)
    if (!std::isfinite(p.x + p.y + p.z))
      throw InvalidInput("the cage has a coordinate that is not finite; give finite numbers");
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    if (std::max({a, b, c}) >= mesh.positions.size())
      throw InvalidInput(fmt::format(
          "triangle {} of the cage has a vertex that the cage lacks; write the mesh again", t));
    const V3d &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
    const double longest = std::max({(q - p).length2(), (r - q).length2(), (p - r).length2()});
    if (!((q - p).cross(r - p).length() > kLeastFlatness * longest))
      throw InvalidInput(
          fmt::format("triangle {} of the cage, at {}, has no area; remove it, or move a vertex", t,
                      cagePlace(p)));
  }
  forEachEdge(sortedSides(mesh.triangles), [&](auto first, auto end) {
    const V3d& place = mesh.positions[first->low];
    if (end - first != 2)
      throw InvalidInput(fmt::format(
          "an edge of the cage at {} belongs to {} triangles instead of 2, so the cage is not "
          "closed; close it, and merge duplicate vertices",
          cagePlace(place), end - first));
    if (first[0].rises == first[1].rises)
      throw InvalidInput(fmt::format(
          "triangles {} and {} of the cage, at {}, face opposite sides; turn one of them around",
          first[0].triangle, first[1].triangle, cagePlace(place)));
  });
}

/// Parts that face opposite sides have no common inside, and their mean-value weights may cancel.
void requireOneOrientation(const TriMesh& mesh) {
  std::vector<std::uint32_t> part(mesh.positions.size());
  std::iota(part.begin(), part.end(), 0u);
  const auto root = [&](std::uint32_t v) {
    while (part[v] != v) v = part[v] = part[part[v]];
    return v;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    part[root(b)] = root(a);
    part[root(c)] = root(a);
  }
  std::map<std::uint32_t, double> volumes;
  for (const auto& [a, b, c] : mesh.triangles)
    volumes[root(a)] += mesh.positions[a].dot(mesh.positions[b].cross(mesh.positions[c]));
  for (const auto& [first, volume] : volumes)
    if ((volume > 0) != (volumes.begin()->second > 0))
      throw InvalidInput(fmt::format(
          "the part of the cage at {} faces inwards where the part at {} faces outwards, or the "
          "reverse; turn its triangles around, and remove parts within another part",
          cagePlace(mesh.positions[first]), cagePlace(mesh.positions[volumes.begin()->first])));
}

/// Finds if a point lies on an edge or a vertex, and where.
CageFoot cageFootOf(const std::vector<CageTriangle>& parts, const V3d& x, double within) {
  CageFoot foot;
  for (std::size_t t = 0; t < parts.size(); ++t) {
    const CageTriangle& part = parts[t];
    if (!(std::abs(part.normal.dot(part.corners[0] - x)) <= within)) continue;
    const auto closest = closestOnTriangle(x, part.corners[0], part.corners[1], part.corners[2]);
    if (!((closest.point - x).length() <= within)) continue;
    foot.isOnSurface = true;
    V3d shares;
    for (int n = 0; n < 3; ++n)
      shares[n] = 1 - part.slopes[static_cast<std::size_t>(n)].dot(
                          part.corners[static_cast<std::size_t>(n)] - closest.point);
    bool isOnEdge = closest.part < 6;
    for (std::size_t n = 0; n < 3; ++n)  // distance from the edge: share / |slope|
      isOnEdge = isOnEdge || shares[static_cast<int>(n)] <= within * part.slopes[n].length();
    if (!isOnEdge) continue;
    if (!foot.isOnEdge) foot = {true, true, t, shares, V3d(0)};
    foot.inwards -= part.normal;
  }
  return foot;
}

/// Visits the weights of all triangles. Mean-value weights are multiplied by the height of x over
/// one triangle, if x is near it, so that they stay finite.
template <class Visit>
void forEachMeanValue(const std::vector<CageTriangle>& parts, const V3d& x, double near,
                      const Visit& visit) {
  thread_local std::vector<MeanValueWeights> all;
  all.resize(parts.size());
  std::size_t pivot = parts.size();
  for (std::size_t t = 0; t < parts.size(); ++t) {
    all[t] = cage::meanValueWeights(parts[t], x);
    if (all[t].isScaled && std::abs(all[t].height) < near &&
        (pivot == parts.size() || std::abs(all[t].height) < std::abs(all[pivot].height)))
      pivot = t;
  }
  const Sloped factor =
      pivot < parts.size() ? Sloped{all[pivot].height, -parts[pivot].normal} : Sloped{1, V3d(0)};
  for (std::size_t t = 0; t < parts.size(); ++t) {
    Sloped by = factor;
    if (t == pivot) {
      by = {1, V3d(0)};
    } else if (all[t].isScaled) {
      const double height = all[t].height;
      by = {factor.value / height,
            (factor.slope * height + parts[t].normal * factor.value) / (height * height)};
    }
    for (std::size_t n = 0; n < 3; ++n) {
      const Sloped& term = all[t].terms[n];
      visit(t, n, Sloped{term.value * by.value, term.slope * by.value + by.slope * term.value});
    }
  }
}

/// Adds a coordinate times a displacement to a jet.
void addMove(DeformationJet& jet, const Sloped& coordinate, const V3d& move) {
  jet.position += move * coordinate.value;
  for (int axis = 0; axis < 3; ++axis)
    jet.slopes[static_cast<std::size_t>(axis)] += move * coordinate.slope[axis];
}

DeformationJet identityJet(const V3d& x) {
  return {x, {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)}};
}

double cageDiagonal(const std::vector<V3d>& points) {
  Imath::Box3d box;
  for (const V3d& p : points) box.extendBy(p);
  return box.size().length();
}

}  // namespace

V3d cage::stretchedNormal(const CageTriangle& rest, const std::array<V3d, 3>& moved) {
  const V3d u = rest.corners[1] - rest.corners[0], v = rest.corners[2] - rest.corners[0];
  const V3d a = moved[1] - moved[0], b = moved[2] - moved[0];
  const double squares =
      a.length2() * v.length2() - 2 * a.dot(b) * u.dot(v) + b.length2() * u.length2();
  const double stretch =
      std::sqrt(std::max(squares, 0.0)) / (std::numbers::sqrt2 * rest.doubleArea);
  return a.cross(b).normalized() * stretch;
}

void CageDeformation::Shared::setMoved(std::vector<V3d> positions) {
  moved = std::move(positions);
  moves.resize(rest.size());
  for (std::size_t n = 0; n < rest.size(); ++n) moves[n] = moved[n] - rest[n];
  normalMoves.clear();
  if (kind != CageCoordinates::Green) return;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& [a, b, c] = triangles[t];
    const V3d &p = moved[a], &q = moved[b], &r = moved[c];
    const double longest = std::max({(q - p).length2(), (r - q).length2(), (p - r).length2()});
    if (!((q - p).cross(r - p).length() > kLeastFlatness * longest))
      throw InvalidInput(fmt::format(
          "triangle {} of the moved cage, at {}, has no area, so that it has no normal; "
          "move a vertex, or use mean-value coordinates",
          t, cagePlace(p)));
    // The identity keeps every bit.
    const bool isStill = moves[a] == V3d(0) && moves[b] == V3d(0) && moves[c] == V3d(0);
    normalMoves.push_back(isStill ? V3d(0)
                                  : cage::stretchedNormal(parts[t], {p, q, r}) - parts[t].normal);
  }
}

CageDeformation::CageDeformation(const TriMesh& rest, const TriMesh& moved,
                                 CageCoordinates coordinates, const Progress& progress) {
  requireClosed(rest);
  if (moved.positions.size() != rest.positions.size())
    throw InvalidInput(
        fmt::format("the cage has {} vertices, but the moved cage {}; both need the same vertices "
                    "and triangles",
                    rest.positions.size(), moved.positions.size()));
  if (moved.triangles != rest.triangles)
    throw InvalidInput(
        "the cage and the moved cage have different triangles; move the vertices of a copy, and "
        "keep their order");
  for (const V3d& p : moved.positions)
    if (!std::isfinite(p.x + p.y + p.z))
      throw InvalidInput("the moved cage has a coordinate that is not finite; give finite numbers");
  const auto crossing = convert::findSelfIntersections(rest.triangles, rest.positions, progress);
  if (!crossing.empty())
    throw InvalidInput(
        fmt::format("the cage intersects itself: triangles {} and {}, at {}; move them apart",
                    crossing[0].first, crossing[0].second,
                    cagePlace(rest.positions[rest.triangles[crossing[0].first][0]])));
  requireOneOrientation(rest);
  auto shared = std::make_shared<Shared>();
  shared->kind = coordinates;
  shared->triangles = rest.triangles;
  if (signedVolume(rest) < 0)
    for (auto& t : shared->triangles) std::swap(t[1], t[2]);
  shared->rest = rest.positions;
  shared->size = cageDiagonal(rest.positions);
  for (const auto& [a, b, c] : shared->triangles)
    shared->parts.push_back(
        cage::cageTriangle(rest.positions[a], rest.positions[b], rest.positions[c]));
  shared->setMoved(moved.positions);
  shared_ = std::move(shared);
}

CageDeformation::~CageDeformation() = default;

CageDeformation CageDeformation::withMoved(std::vector<V3d> moved) const {
  if (moved.size() != shared_->rest.size())
    throw InvalidInput(
        fmt::format("the cage has {} vertices, but {} positions are given; give one "
                    "for each vertex",
                    shared_->rest.size(), moved.size()));
  for (const V3d& p : moved)
    if (!std::isfinite(p.x + p.y + p.z))
      throw InvalidInput("the moved cage has a coordinate that is not finite; give finite numbers");
  auto shared = std::make_shared<Shared>(*shared_);
  shared->setMoved(std::move(moved));
  return CageDeformation(std::move(shared));
}

CageCoordinates CageDeformation::coordinates() const {
  return shared_->kind;
}
const std::vector<std::array<std::uint32_t, 3>>& CageDeformation::triangles() const {
  return shared_->triangles;
}
const std::vector<V3d>& CageDeformation::rest() const {
  return shared_->rest;
}
const std::vector<V3d>& CageDeformation::moved() const {
  return shared_->moved;
}

bool CageDeformation::isIdentity() const {
  return std::all_of(shared_->moves.begin(), shared_->moves.end(),
                     [](const V3d& move) { return move == V3d(0); });
}

Imath::Box3d CageDeformation::bounds() const {
  Imath::Box3d box;
  for (const V3d& p : shared_->moved) box.extendBy(p);
  return box;
}

bool CageDeformation::contains(const V3d& x) const {
  double sum = 0;
  for (const CageTriangle& part : shared_->parts) {
    const V3d a = part.corners[0] - x, b = part.corners[1] - x, c = part.corners[2] - x;
    const double r = a.length(), s = b.length(), t = c.length();
    sum += std::atan2(a.dot(b.cross(c)), r * s * t + a.dot(b) * t + b.dot(c) * r + c.dot(a) * s);
  }
  return sum > std::numbers::pi;
}

void CageDeformation::requireDefined(const std::vector<V3d>& points, const char* what) const {
  if (shared_->kind == CageCoordinates::MeanValue) return;
  for (std::size_t n = 0; n < points.size(); ++n)
    if (!contains(points[n]) &&
        !cageFootOf(shared_->parts, points[n], kOnEdge * shared_->size).isOnSurface)
      throw InvalidInput(fmt::format(
          "{} {} at {} is outside the cage, where Green coordinates are not defined; use a larger "
          "cage, or mean-value coordinates",
          what, n, cagePlace(points[n])));
}

const std::vector<CageTriangle>& CageDeformation::parts() const {
  return shared_->parts;
}
V3d CageDeformation::stretchedNormalOf(std::size_t triangle) const {
  return shared_->parts[triangle].normal + shared_->normalMoves[triangle];
}

DeformationJet CageDeformation::jet(const V3d& x, Sloped* totalWeight) const {
  const Shared& s = *shared_;
  const CageFoot foot = cageFootOf(s.parts, x, kOnEdge * s.size);
  if (foot.isOnEdge) {
    V3d inwards = foot.inwards;
    if (!(inwards.length() > 1e-6)) inwards = -s.parts[foot.triangle].normal;
    const V3d step = inwards.normalized() * (kEdgeStep * s.size);
    DeformationJet result = jet(x + step);
    if (s.kind == CageCoordinates::MeanValue) {
      result.position = x;
      for (std::size_t n = 0; n < 3; ++n)
        result.position +=
            s.moves[s.triangles[foot.triangle][n]] * foot.shares[static_cast<int>(n)];
    } else {
      for (int axis = 0; axis < 3; ++axis)
        result.position -= result.slopes[static_cast<std::size_t>(axis)] * step[axis];
    }
    return result;
  }
  DeformationJet result = identityJet(x);
  if (s.kind == CageCoordinates::Green) {
    for (std::size_t t = 0; t < s.parts.size(); ++t) {
      const cage::GreenWeights weights = cage::greenWeights(s.parts[t], x);
      for (std::size_t n = 0; n < 3; ++n)
        addMove(result, weights.corners[n], s.moves[s.triangles[t][n]]);
      addMove(result, weights.normal, s.normalMoves[t]);
    }
    return result;
  }
  Sloped total;
  DeformationJet sum{V3d(0), {V3d(0), V3d(0), V3d(0)}};
  forEachMeanValue(s.parts, x, totalWeight ? 0 : kNearFace * s.size,
                   [&](std::size_t t, std::size_t n, const Sloped& weight) {
                     total.value += weight.value;
                     total.slope += weight.slope;
                     addMove(sum, weight, s.moves[s.triangles[t][n]]);
                   });
  if (totalWeight) *totalWeight = total;
  const V3d move = sum.position / total.value;
  result.position += move;
  for (std::size_t axis = 0; axis < 3; ++axis)
    result.slopes[axis] +=
        (sum.slopes[axis] - move * total.slope[static_cast<int>(axis)]) / total.value;
  return result;
}

CageDeformation::Coordinates CageDeformation::coordinatesAt(const V3d& x) const {
  const Shared& s = *shared_;
  const CageFoot foot = cageFootOf(s.parts, x, kOnEdge * s.size);
  Coordinates result;
  result.vertices.assign(s.rest.size(), 0);
  result.vertexSlopes.assign(s.rest.size(), V3d(0));
  if (foot.isOnEdge) {
    V3d inwards = foot.inwards;
    if (!(inwards.length() > 1e-6)) inwards = -s.parts[foot.triangle].normal;
    const V3d step = inwards.normalized() * (kEdgeStep * s.size);
    result = coordinatesAt(x + step);
    if (s.kind == CageCoordinates::MeanValue) {
      result.vertices.assign(s.rest.size(), 0);
      for (std::size_t n = 0; n < 3; ++n)
        result.vertices[s.triangles[foot.triangle][n]] = foot.shares[static_cast<int>(n)];
    } else {
      for (std::size_t n = 0; n < s.rest.size(); ++n)
        result.vertices[n] -= result.vertexSlopes[n].dot(step);
      for (std::size_t t = 0; t < s.parts.size(); ++t)
        result.triangles[t] -= result.triangleSlopes[t].dot(step);
    }
    return result;
  }
  const auto add = [&](std::size_t t, std::size_t n, const Sloped& weight) {
    result.vertices[s.triangles[t][n]] += weight.value;
    result.vertexSlopes[s.triangles[t][n]] += weight.slope;
  };
  if (s.kind == CageCoordinates::Green) {
    for (std::size_t t = 0; t < s.parts.size(); ++t) {
      const cage::GreenWeights weights = cage::greenWeights(s.parts[t], x);
      for (std::size_t n = 0; n < 3; ++n) add(t, n, weights.corners[n]);
      result.triangles.push_back(weights.normal.value);
      result.triangleSlopes.push_back(weights.normal.slope);
    }
    return result;
  }
  Sloped total;
  forEachMeanValue(s.parts, x, kNearFace * s.size,
                   [&](std::size_t t, std::size_t n, const Sloped& weight) {
                     total.value += weight.value;
                     total.slope += weight.slope;
                     add(t, n, weight);
                   });
  for (std::size_t n = 0; n < s.rest.size(); ++n) {
    result.vertices[n] /= total.value;
    result.vertexSlopes[n] =
        (result.vertexSlopes[n] - total.slope * result.vertices[n]) / total.value;
  }
  return result;
}

}  // namespace levelset
