#include "render/shading/surface_point.h"

#include "levelset/vdb.h"
#include "render/shading/surface_shape_vdb.h"

namespace render {
namespace {

using Imath::V3d;

V3d unitOr(const V3d& v, const V3d& fallback) {
  const V3d unit = v.normalized();
  return unit == V3d(0) ? fallback : unit;
}

SurfaceShape shapeAt(const levelset::NarrowBand& band, const Imath::M44d& indexToWorld,
                     const V3d& world) {
  return surfaceShape(levelset::vdb(band).tree(), world * indexToWorld.inverse());
}

}  // namespace

void addNormals(Hit& hit, const levelset::NarrowBand& band, const V3d& direction) {
  const Imath::M44d indexToWorld = band.indexToWorld();
  const SurfaceShape shape = shapeAt(band, indexToWorld, hit.position);
  // For a rotation with uniform scale, gradients turn as directions do.
  V3d facet, smooth;
  indexToWorld.multDirMatrix(shape.trilinearGradient, facet);
  indexToWorld.multDirMatrix(shape.gradient, smooth);
  hit.facetNormal = unitOr(facet, unitOr(smooth, -direction));
  hit.normal = unitOr(smooth, hit.facetNormal);
  hit.surfaceError = shape.interpolationError;
}

CurvatureSample curvatureAt(const levelset::NarrowBand& band, const V3d& world) {
  const SurfaceShape shape = shapeAt(band, band.indexToWorld(), world);
  const Curvatures c = curvaturesOf(shape.gradient, shape.hessian);
  const double h = band.voxelSize();
  return {c.mean / h, c.gauss / (h * h), c.k1 / h, c.k2 / h};
}

}  // namespace render
