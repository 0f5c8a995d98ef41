#include "levelset/inspect/curved_surface.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/distance/surface/surface_points.h"

namespace levelset {
namespace {

using openvdb::Vec3d;

/// Minimum half width, voxels, at which the tricubic stencil beside the surface lies in the band.
constexpr double kTricubicHalfWidth = 3;
/// Maximum distance of the zero set from a triangle, voxels. Beyond it, the triangle stays flat.
constexpr double kLargestLift = 0.4;
/// Minimum cosine between the normals at the corners of a triangle and its own normal. A lower
/// value indicates an edge of the solid.
constexpr double kSmoothCosine = 0.85;
// Newton's method moves a point of a triangle along the normal onto the zero set: maximum number of
// steps, and step, voxels, below which it stops. The remaining error is about the square of the
// last step.
constexpr int kLiftSteps = 4;
constexpr double kLiftTolerance = 1e-3;

struct QuadratureNode {
  double u, v, weight;
};
/// Quadrature rule of degree four on the triangle [Dunavant85]; weights sum to 1.
constexpr double kNear = 0.445948490915965, kFar = 0.091576213509771,
                 kNearWeight = 0.223381589678011, kFarWeight = 0.109951743655322;
constexpr std::array<QuadratureNode, 6> kRule = {{{kNear, kNear, kNearWeight},
                                                  {1 - 2 * kNear, kNear, kNearWeight},
                                                  {kNear, 1 - 2 * kNear, kNearWeight},
                                                  {kFar, kFar, kFarWeight},
                                                  {1 - 2 * kFar, kFar, kFarWeight},
                                                  {kFar, 1 - 2 * kFar, kFarWeight}}};

Vec3d toDouble(const openvdb::Vec3f& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

/// Adds the moments of a surface element at position `p` with the area vector `a`.
void addPiece(SurfaceMoments& sum, const Vec3d& p, const Vec3d& a) {
  sum.volume += p.dot(a) / 3;
  sum.area += a.length();
  for (int i = 0; i < 3; ++i) {
    const double squared = p[i] * p[i] * a[i];
    sum.first[i] += squared / 2;
    sum.second[static_cast<std::size_t>(i)] += squared * p[i] / 3;
  }
  sum.second[3] += p[0] * p[1] * (p[0] * a[0] + p[1] * a[1]) / 4;
  sum.second[4] += p[0] * p[2] * (p[0] * a[0] + p[2] * a[2]) / 4;
  sum.second[5] += p[1] * p[2] * (p[1] * a[1] + p[2] * a[2]) / 4;
}

}  // namespace

void SurfaceMoments::add(const SurfaceMoments& other) {
  volume += other.volume;
  area += other.area;
  meanCurvature += other.meanCurvature;
  first += other.first;
  for (std::size_t i = 0; i < second.size(); ++i) second[i] += other.second[i];
}

SurfaceMoments SurfaceMoments::about(const Vec3d& shift) const {
  SurfaceMoments moved = *this;
  moved.first -= shift * volume;
  constexpr std::array<std::array<int, 2>, 6> kPairs = {
      {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto [j, k] = kPairs[i];
    moved.second[i] += shift[j] * shift[k] * volume - shift[j] * first[k] - shift[k] * first[j];
  }
  return moved;
}

SurfaceMoments flatTriangleMoments(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  SurfaceMoments sum;
  const Vec3d area = (b - a).cross(c - a) * 0.5;
  for (const QuadratureNode& q : kRule)
    addPiece(sum, a * (1 - q.u - q.v) + b * q.u + c * q.v, area * q.weight);
  return sum;
}

SurfaceMoments quadraticPatchMoments(const std::array<Vec3d, 3>& corner,
                                     const std::array<Vec3d, 3>& bend,
                                     const std::array<Vec3d, 3>& normal) {
  SurfaceMoments sum;
  const Vec3d nu = normal[1] - normal[0], nv = normal[2] - normal[0];
  for (const QuadratureNode& q : kRule) {
    const double a = 1 - q.u - q.v, b = q.u, c = q.v;
    const Vec3d p = corner[0] * a + corner[1] * b + corner[2] * c + bend[0] * (a * b) +
                    bend[1] * (b * c) + bend[2] * (c * a);
    const Vec3d su = corner[1] - corner[0] + bend[0] * (a - b) + (bend[1] - bend[2]) * c,
                sv = corner[2] - corner[0] + bend[2] * (a - c) + (bend[1] - bend[0]) * b;
    addPiece(sum, p, su.cross(sv) * (0.5 * q.weight));
    const Vec3d mixed = normal[0] * a + normal[1] * b + normal[2] * c;
    if (const double length = mixed.length(); length > 0.1)
      sum.meanCurvature +=
          q.weight * mixed.dot(nu.cross(sv) + su.cross(nv)) / (4 * length * length);
  }
  return sum;
}

CurvedSurface::CurvedSurface(const IndexMesh& mesh, const openvdb::FloatGrid& grid)
    : mesh_(mesh), field_(grid.constTreePtr()) {
  const double halfWidth = static_cast<double>(grid.background()) / grid.voxelSize()[0];
  if (halfWidth < kTricubicHalfWidth * (1 - 1e-5)) field_ = eikonal::thicken(*field_);
  findNormals();
}

void CurvedSurface::findNormals() {
  normals_.assign(mesh_.positions.size(), openvdb::Vec3f(0));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, normals_.size(), 4096),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      Cache cache = makeCache();
                      for (std::size_t i = range.begin(); i != range.end(); ++i) {
                        const eikonal::DenseBlock& block = cache.around(mesh_.positions[i]);
                        Vec3d normal =
                            block.jet(mesh_.positions[i] - block.origin().asVec3d()).gradient;
                        if (normal.normalize()) normals_[i] = openvdb::Vec3f(normal);
                      }
                    });
}

bool CurvedSurface::isSmooth(std::size_t triangle) const {
  const auto& t = mesh_.triangles[triangle];
  Vec3d own = (mesh_.positions[t[1]] - mesh_.positions[t[0]])
                  .cross(mesh_.positions[t[2]] - mesh_.positions[t[0]]);
  // For a sliver, the normal at a corner is more reliable than that of the triangle.
  if (own.length() < 0.05) own = toDouble(normals_[t[0]]);
  own.normalize();
  return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) {
    return toDouble(normals_[v]).dot(own) > kSmoothCosine;
  });
}

CurvedSurface::Node CurvedSurface::node(std::size_t triangle, bool bends, double u, double v,
                                        Cache& cache) const {
  const auto& t = mesh_.triangles[triangle];
  const Vec3d &a = mesh_.positions[t[0]], &b = mesh_.positions[t[1]], &c = mesh_.positions[t[2]];
  const Vec3d na = toDouble(normals_[t[0]]), nb = toDouble(normals_[t[1]]),
              nc = toDouble(normals_[t[2]]);
  const Vec3d flat = a * (1 - u - v) + b * u + c * v;
  Vec3d su = b - a, sv = c - a;
  const Vec3d normal = na * (1 - u - v) + nb * u + nc * v, nu = nb - na, nv = nc - na;
  Node result{flat, su.cross(sv) * 0.5};
  if (bends) {
    double lift = 0;
    for (int step = 0; step < kLiftSteps; ++step) {
      const Vec3d at = flat + normal * lift;
      const eikonal::DenseBlock& block = cache.around(at);
      const eikonal::Jet jet = block.jet(at - block.origin().asVec3d());
      const double slope = jet.gradient.dot(normal);
      const double change = -jet.value / slope;
      if (!(std::abs(lift + change) < kLargestLift)) break;
      lift += change;
      if (std::abs(change) > kLiftTolerance && step + 1 < kLiftSteps) continue;
      su += nu * lift, sv += nv * lift;
      su -= normal * (jet.gradient.dot(su) / slope);
      sv -= normal * (jet.gradient.dot(sv) / slope);
      result.position = flat + normal * lift;
      result.isFlat = false;
      result.areaVector = su.cross(sv) * 0.5;
      break;
    }
  }
  // (k1 + k2) dA = n · (n_u × S_v + S_u × n_v) for the surface S(u, v) and its interpolated unit
  // normals n(u, v). Across an edge of the solid, these normals turn by the angle of the edge.
  const double length = normal.length();
  if (length > 0.1) {
    const Vec3d unit = normal / length;
    result.meanCurvature = unit.dot(nu.cross(sv) + su.cross(nv)) / (4 * length);
  }
  return result;
}

SurfaceMoments CurvedSurface::moments(std::size_t triangle, const Vec3d& anchor,
                                      Cache& cache) const {
  SurfaceMoments sum;
  const bool bends = isSmooth(triangle);
  for (const QuadratureNode& q : kRule) {
    const Node at = node(triangle, bends, q.u, q.v, cache);
    addPiece(sum, at.position - anchor, at.areaVector * q.weight);
    sum.meanCurvature += at.meanCurvature * q.weight;
  }
  return sum;
}

CurvedSurface::Sample CurvedSurface::middle(std::size_t triangle, Cache& cache) const {
  const Node at = node(triangle, isSmooth(triangle), 1. / 3, 1. / 3, cache);
  return {at.position, at.areaVector.length(), at.isFlat};
}

}  // namespace levelset
