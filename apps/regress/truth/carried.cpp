#include "apps/regress/truth/carried.h"

#include <tbb/parallel_for.h>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/shapes/shapes.h"

namespace regress {

using Imath::V3d;

namespace {

V3d carried(V3d p, const levelset::VectorField& velocity, double time) {
  constexpr int kSteps = 256;
  const double dt = time / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const double t = i * dt;
    const V3d k1 = velocity(p, t);
    const V3d k2 = velocity(p + k1 * (dt / 2), t + dt / 2);
    const V3d k3 = velocity(p + k2 * (dt / 2), t + dt / 2);
    const V3d k4 = velocity(p + k3 * dt, t + dt);
    p += (k1 + 2.0 * k2 + 2.0 * k3 + k4) * (dt / 6);
  }
  return p;
}

}  // namespace

levelset::NarrowBand carriedBall(const V3d& centre, double radius,
                                 const levelset::VectorField& velocity, double time,
                                 double voxelSize) {
  levelset::TriMesh mesh =
      levelset::bandToMesh(levelset::makeSphere(radius, centre, voxelSize / 4));
  tbb::parallel_for(std::size_t{0}, mesh.positions.size(), [&](std::size_t i) {
    V3d& p = mesh.positions[i];
    p = carried(centre + (p - centre).normalized() * radius, velocity, time);
  });
  return levelset::meshToBand(mesh, voxelSize, {.sign = levelset::SignMode::Closed}).band;
}

}  // namespace regress
