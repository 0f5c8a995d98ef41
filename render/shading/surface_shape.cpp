#include "render/shading/surface_shape.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/geometry/perpendicular.h"
#include "render/shading/principal_direction.h"

namespace render {
namespace {

using Imath::V3d;

V3d unitOr(const V3d& v, const V3d& fallback) {
  const V3d unit = v.normalized();
  return unit == V3d(0) ? fallback : unit;
}

V3d row(const Imath::M44d& m, int i) {
  return {m[i][0], m[i][1], m[i][2]};
}

/// Normal curvature of the surface, per voxel, along the projection of a direction onto the tangent
/// plane. It is 0 for a direction parallel to the normal, and where the gradient vanishes. @param
/// direction  in index space, of any length
double curvatureAlong(const SurfaceShape& shape, const V3d& direction) {
  const double length = shape.gradient.length();
  if (!(length > 0)) return 0;
  const V3d normal = shape.gradient / length;
  const V3d along = direction - normal * direction.dot(normal);
  if (!(along.length2() > 1e-12 * direction.length2())) return 0;
  return along.dot(along * shape.hessian) / (length * along.length2());
}

/// First principal direction in index space, of unit length, from the shape operator in two tangent
/// vectors [Sigg05]. The published eigenvector vanishes for some operators, e.g. diagonal ones. The
/// longer one of two equivalent vectors does not. Where k1 = k2 it is a tangent vector.
V3d firstDirection(const SurfaceShape& shape) {
  const double length = shape.gradient.length();
  if (!(length > 0)) return V3d(0);
  const auto [u, v] = levelset::tangents(shape.gradient / length);
  const V3d bentU = u * shape.hessian, bentV = v * shape.hessian;
  const double half = 0.5 * (u.dot(bentU) - v.dot(bentV)), mixed = u.dot(bentV);
  const double spread = std::sqrt(half * half + mixed * mixed);
  const V3d along = half >= 0 ? u * (half + spread) + v * mixed : u * mixed + v * (spread - half);
  return unitOr(along, u);
}

/// Principal, mean and Gauss curvatures from gradient and Hessian [Goldman05], per world unit, k1 ≥
/// k2. Zero where the gradient vanishes. The direction is not set.
CurvatureSample curvaturesOf(const SurfaceShape& shape, double voxelSize) {
  const V3d& g = shape.gradient;
  const Imath::M33d& h = shape.hessian;
  const double squared = g.length2(), length = std::sqrt(squared);
  if (!(length > 0)) return {};
  const auto minor = [&](int i, int j) {  // cofactor (i, j) of h
    const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
    return h[a][c] * h[b][d] - h[a][d] * h[b][c];
  };
  double gHg = 0, gAg = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      gHg += g[i] * h[i][j] * g[j];
      gAg += g[i] * minor(i, j) * g[j];
    }
  }
  const double trace = h[0][0] + h[1][1] + h[2][2];
  const double mean = (squared * trace - gHg) / (2 * squared * length) / voxelSize;
  const double gauss = gAg / (squared * squared) / (voxelSize * voxelSize);
  const double spread = std::sqrt(std::max(0.0, mean * mean - gauss));
  return {mean, gauss, mean + spread, mean - spread};
}

/// Curvatures of the same surface with inside and outside exchanged.
CurvatureSample flipped(const CurvatureSample& sample) {
  return {-sample.mean, sample.gauss, -sample.k2, -sample.k1};
}

/// Derivatives of the field of a volume along world axes, per world unit.
SurfaceShape worldShape(const SurfaceShape& shape, const Imath::M44d& worldToIndex) {
  const V3d rows[3] = {row(worldToIndex, 0), row(worldToIndex, 1), row(worldToIndex, 2)};
  SurfaceShape world;
  for (int i = 0; i < 3; ++i) {
    world.gradient[i] = rows[i].dot(shape.gradient);
    world.trilinearGradient[i] = rows[i].dot(shape.trilinearGradient);
    for (int j = 0; j < 3; ++j) world.hessian[i][j] = rows[i].dot(rows[j] * shape.hessian);
  }
  return world;
}

}  // namespace

void addShape(Hit& hit, const SurfaceShape& shape, const Imath::M44d& indexToWorld,
              const V3d& direction) {
  // A rotation with uniform scale maps gradients like directions.
  V3d facet, smooth;
  indexToWorld.multDirMatrix(shape.trilinearGradient, facet);
  indexToWorld.multDirMatrix(shape.gradient, smooth);
  hit.facetNormal = unitOr(facet, unitOr(smooth, -direction));
  hit.normal = unitOr(smooth, hit.facetNormal);
  hit.surfaceError = shape.interpolationError;
  const V3d axes[3] = {row(indexToWorld, 0), row(indexToWorld, 1), row(indexToWorld, 2)};
  const double voxelSize = axes[0].length();
  hit.curvature = curvaturesOf(shape, voxelSize);
  hit.viewCurvature = curvatureAlong(shape, V3d(axes[0].dot(direction), axes[1].dot(direction),
                                                axes[2].dot(direction))) /
                      voxelSize;
  if (!hit.isFlipped) return;
  hit.facetNormal = -hit.facetNormal;
  hit.normal = -hit.normal;
  hit.curvature = flipped(hit.curvature);
  hit.viewCurvature = -hit.viewCurvature;
}

void addVolumeShape(Hit& hit, const SurfaceShape& shape, const Imath::M44d& worldToIndex,
                    double voxelSize, const V3d& direction) {
  SurfaceShape world = worldShape(shape, worldToIndex);
  const double slope = world.gradient.length();
  world.interpolationError =
      shape.interpolationError < slope * voxelSize ? shape.interpolationError / slope : 0;
  if (shape.interpolationError > 0 && !(world.interpolationError > 0))
    world.interpolationError = voxelSize;
  addShape(hit, world, Imath::M44d(), direction);
}

void addDirection(Hit& hit, const SurfaceShape& shape, const Imath::M44d& indexToWorld) {
  V3d first;
  indexToWorld.multDirMatrix(firstDirection(shape), first);
  // With inside and outside exchanged, both directions change places.
  if (hit.isFlipped) first = hit.normal.cross(first);
  hit.curvature.direction1 = asLine(first.normalized());
}

void addVolumeDirection(Hit& hit, const SurfaceShape& shape, const Imath::M44d& worldToIndex) {
  addDirection(hit, worldShape(shape, worldToIndex), Imath::M44d());
}

}  // namespace render
