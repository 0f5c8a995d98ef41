#include "apps/regress/truth/machine_part.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace regress {

using Imath::M44d;
using Imath::V2d;
using Imath::V3d;

namespace {

constexpr double kHoleRadius = 0.17, kHalfThickness = 0.15;
constexpr int kFacets = 1440;
/// Outline of the plate, counter-clockwise: a rectangle with a chamfered corner. The hole is at the
/// origin.
constexpr std::array<std::array<double, 2>, 5> kOutline = {
    {{-0.5, -0.3}, {0.5, -0.3}, {0.5, 0.12}, {0.32, 0.3}, {-0.5, 0.3}}};

V2d outline(std::size_t i) {
  return {kOutline[i % kOutline.size()][0], kOutline[i % kOutline.size()][1]};
}

/// Signed distance to the outline, a convex polygon.
double outlineDistance(const V2d& p) {
  double nearest = 1e300, above = -1e300;
  for (std::size_t i = 0; i < kOutline.size(); ++i) {
    const V2d a = outline(i), along = outline(i + 1) - a;
    const double t = std::clamp((p - a).dot(along) / along.length2(), 0.0, 1.0);
    nearest = std::min(nearest, (p - a - along * t).length());
    above = std::max(above, (p - a).dot(V2d(along.y, -along.x)) / along.length());
  }
  return above > 0 ? nearest : -nearest;
}

Truth partTruth() {
  double area = 0, length = 0;
  for (std::size_t i = 0; i < kOutline.size(); ++i) {
    area += outline(i).cross(outline(i + 1)) / 2;
    length += (outline(i + 1) - outline(i)).length();
  }
  constexpr double kPi = std::numbers::pi;
  area -= kPi * kHoleRadius * kHoleRadius;
  length += 2 * kPi * kHoleRadius;
  return {.distance =
              [](const V3d& p) {
                // The hole and the outline are apart, so the larger of both distances is exact.
                const V2d q(p.x, p.y);
                const double across = std::max(outlineDistance(q), kHoleRadius - q.length()),
                             along = std::abs(p.z) - kHalfThickness;
                return std::hypot(std::max(across, 0.0), std::max(along, 0.0)) +
                       std::min(0.0, std::max(across, along));
              },
          .volume = area * 2 * kHalfThickness,
          .area = 2 * area + length * 2 * kHalfThickness,
          .centre = V3d(0),
          .reach = 0.61};
}

/// Point of the outline in the direction of an angle from the origin.
V2d outlineAt(double angle) {
  const V2d direction(std::cos(angle), std::sin(angle));
  double nearest = 1e300;
  for (std::size_t i = 0; i < kOutline.size(); ++i) {
    const V2d a = outline(i), along = outline(i + 1) - a, normal(along.y, -along.x);
    if (normal.dot(direction) > 0)
      nearest = std::min(nearest, normal.dot(a) / normal.dot(direction));
  }
  return direction * nearest;
}

levelset::TriMesh partMesh() {
  // One quadrilateral of each cap for each direction from the axis of the hole. The directions to
  // the corners are among them.
  std::vector<std::pair<double, V2d>> spokes;
  for (int k = 0; k < kFacets; ++k) {
    const double angle = 2 * std::numbers::pi * k / kFacets - std::numbers::pi;
    spokes.emplace_back(angle, outlineAt(angle));
  }
  for (std::size_t i = 0; i < kOutline.size(); ++i)
    spokes.emplace_back(std::atan2(outline(i).y, outline(i).x), outline(i));
  std::sort(spokes.begin(), spokes.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  levelset::TriMesh mesh;
  for (const auto& [angle, outer] : spokes) {
    const V2d inner = V2d(std::cos(angle), std::sin(angle)) * kHoleRadius;
    for (const double z : {-kHalfThickness, kHalfThickness}) {
      mesh.positions.emplace_back(inner.x, inner.y, z);
      mesh.positions.emplace_back(outer.x, outer.y, z);
    }
  }
  const auto count = static_cast<std::uint32_t>(spokes.size());
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t a = 4 * i, b = 4 * ((i + 1) % count);
    // Corners of the quadrilaterals in a section: 0 inner low, 1 outer low, 2 inner high, 3 outer
    // high. Each pair runs along one face, with the outside on its right.
    for (const auto& [from, to] :
         {std::pair(0u, 1u), std::pair(1u, 3u), std::pair(3u, 2u), std::pair(2u, 0u)}) {
      mesh.triangles.push_back({a + from, b + from, b + to});
      mesh.triangles.push_back({a + from, b + to, a + to});
    }
  }
  return mesh;
}

}  // namespace

MachinePart machinePart(const M44d& placement) {
  MachinePart part{moved(partTruth(), placement), partMesh(), {}, {}};
  for (V3d& p : part.mesh.positions) p = p * placement;
  constexpr int kPieces = 16;
  const auto addSegment = [&](const V3d& from, const V3d& to) {
    for (int k = 0; k < kPieces; ++k)
      part.edges.push_back((from + (to - from) * (static_cast<double>(k) / kPieces)) * placement);
  };
  for (std::size_t i = 0; i < kOutline.size(); ++i) {
    const V2d a = outline(i), b = outline(i + 1);
    for (const double z : {-kHalfThickness, kHalfThickness}) {
      part.corners.push_back(V3d(a.x, a.y, z) * placement);
      addSegment(V3d(a.x, a.y, z), V3d(b.x, b.y, z));
    }
    addSegment(V3d(a.x, a.y, -kHalfThickness), V3d(a.x, a.y, kHalfThickness));
  }
  for (int k = 0; k < 4 * kPieces; ++k) {
    const double angle = 2 * std::numbers::pi * k / (4 * kPieces);
    for (const double z : {-kHalfThickness, kHalfThickness})
      part.edges.push_back(V3d(kHoleRadius * std::cos(angle), kHoleRadius * std::sin(angle), z) *
                           placement);
  }
  return part;
}

}  // namespace regress
