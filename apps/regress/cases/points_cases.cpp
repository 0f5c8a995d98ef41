#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/points/processing/normals.h"
#include "levelset/points/processing/sample_mesh.h"
#include "levelset/points/surface/particles.h"
#include "levelset/points/surface/points_to_band.h"

namespace regress {

using Imath::V3d;
using levelset::PointCloud;
using levelset::PointMethod;

namespace {

V3d gradient(const Truth& truth, const V3d& at) {
  constexpr double kStep = 1e-5;
  V3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    V3d step(0);
    step[axis] = kStep;
    slope[axis] = truth.distance(at + step) - truth.distance(at - step);
  }
  return slope.normalized();
}

/// Points on the surface of a solid, with its normals, at a distance of two voxels.
PointCloud pointsOn(const Truth& truth, double voxelSize) {
  // The mesh only distributes the points: they are moved to the surface of the closed form.
  PointCloud cloud =
      sampleMesh(levelset::bandToMesh(exactBand(truth, voxelSize)), {.spacing = 2 * voxelSize});
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    V3d& p = cloud.positions[i];
    for (int n = 0; n < 3; ++n) p -= truth.distance(p) * gradient(truth, p);
    cloud.normals[i] = Imath::V3f(gradient(truth, p));
  }
  return cloud;
}

struct PointShape {
  const char* name;
  Truth truth;
};

std::vector<PointShape> shapes(const V3d& shift) {
  return {{"sphere", ball(shift, 0.4)},
          {"torus", torus(shift, V3d(1, 2, 3), 0.35, 0.15)},
          {"cube", box(shift, V3d(0.7))}};
}

struct NamedMethod {
  const char* name;
  PointMethod method;
  double noiseLambda = 0;  ///< relaxation λ where the points have noise
};
constexpr NamedMethod kPointMethods[] = {{"mls", PointMethod::MovingLeastSquares},
                                         {"mpu", PointMethod::MultilevelPartition},
                                         {"rbf", PointMethod::RadialBasis, 30},
                                         {"meshless", PointMethod::Meshless}};

void cleanPoints(Recorder& out) {
  for (const Sample& at : out.samples())
    for (const PointShape& shape : shapes(at.shift)) {
      const PointCloud cloud = pointsOn(shape.truth, at.voxelSize);
      for (const NamedMethod& method : kPointMethods)
        out.measure({std::string(shape.name) + ", " + method.name, at, shape.truth}, kOurs, [&] {
          return pointsToBand(cloud, at.voxelSize, {.method = method.method}).band;
        });
    }
}

/// Points with a noise of a fifth of their spacing, and normals that are computed from them.
void noisyPoints(Recorder& out) {
  constexpr std::size_t kNeighbours = 40;
  for (const Sample& at : out.samples())
    for (const PointShape& shape : shapes(at.shift)) {
      PointCloud cloud = pointsOn(shape.truth, at.voxelSize);
      std::mt19937_64 random(1);
      std::normal_distribution<double> noise(0, 0.2 * 2 * at.voxelSize);
      for (V3d& p : cloud.positions)
        for (int axis = 0; axis < 3; ++axis) p[axis] += noise(random);
      cloud = levelset::estimateNormals(std::move(cloud), {.neighbours = kNeighbours}).cloud;
      for (const NamedMethod& method : kPointMethods)
        out.measure({std::string(shape.name) + ", " + method.name, at, shape.truth}, kOurs, [&] {
          return pointsToBand(cloud, at.voxelSize,
                              {.method = method.method,
                               .neighbours = kNeighbours,
                               .lambda = method.noiseLambda})
              .band;
        });
    }
}

void particleBalls(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const V3d a = at.shift, b = at.shift + V3d(0.4, 0.1, 0);
    const PointCloud cloud{.positions = {a, b}, .radii = {0.35F, 0.25F}};
    const Truth truth = twoBalls(levelset::CsgOperation::Union, a, double{cloud.radii[0]}, b,
                                 double{cloud.radii[1]});
    out.measure({"two balls", at, truth}, kOurs, [&] {
      return particlesToBand(cloud, at.voxelSize, {.kernel = levelset::ParticleKernel::Balls});
    });
  }
}

Bounds cleanPointBounds() {
  return Bounds()
      .measured("cube, meshless", "surface_l1_vx", {{16, 0.0854}, {32, 0.0535}, {64, 0.0269}})
      .measured("cube, meshless", "surface_linf_vx",
                {{16, 1.15}, {32, 0.948, Budget::Quick}, {32, 1.42, Budget::Full}, {64, 1.12}})
      .measured("cube, meshless", "missed_hits", {{16, 0.0701}, {32, 0.0367}, {64, 0.0172}})
      .measured("cube, mls", "surface_l1_vx", {{16, 0.0961}, {32, 0.0587}, {64, 0.0282}})
      .measured("cube, mls", "surface_linf_vx", {{16, 0.599}, {32, 0.639}, {64, 0.881}})
      .measured("cube, mls", "missed_hits", {{16, 0.0976}, {32, 0.0471}, {64, 0.0246}})
      .measured("sphere, meshless", "surface_l1_vx", {{16, 0.0266}, {32, 0.0125}, {64, 0.00635}})
      .measured("sphere, meshless", "surface_linf_vx", {{16, 0.156}, {32, 0.0888}, {64, 0.0465}})
      .measured("sphere, meshless", "missed_hits",
                {{16, 0.0115},
                 {32, 0.000684, Budget::Quick},
                 {32, 0.00275, Budget::Full},
                 {64, 0.000669}})
      .measured("sphere, mls", "surface_l1_vx", {{16, 0.0108}, {32, 0.00122}, {64, 0.000149}})
      .measured("sphere, mls", "surface_linf_vx", {{16, 0.0215}, {32, 0.00274}, {64, 0.000373}})
      .measured("sphere, mls", "missed_hits",
                {{16, 0.00209}, {32, 0.000684, Budget::Quick}, {32, 0.000344, Budget::Full}})
      .measured("torus, meshless", "surface_l1_vx", {{16, 0.0435}, {32, 0.02}, {64, 0.00985}})
      .measured("torus, meshless", "surface_linf_vx", {{16, 0.373}, {32, 0.173}, {64, 0.0933}})
      .measured(
          "torus, meshless", "missed_hits",
          {{16, 0.0268}, {32, 0.0105, Budget::Quick}, {32, 0.00667, Budget::Full}, {64, 0.00154}})
      .measured("torus, mls", "surface_l1_vx", {{16, 0.0717}, {32, 0.0095}, {64, 0.00111}})
      .measured("torus, mls", "surface_linf_vx", {{16, 0.211}, {32, 0.0294}, {64, 0.00409}})
      .measured("torus, mls", "missed_hits",
                {{16, 0.0361}, {32, 0.00574, Budget::Quick}, {32, 0.00333, Budget::Full}});
}

Bounds noisyPointBounds() {
  return Bounds()
      .measured("cube, meshless", "surface_l1_vx", {{24, 0.251}, {32, 0.224}})
      .measured("cube, meshless", "surface_linf_vx", {{24, 2.07}, {32, 1.11}})
      .measured("cube, meshless", "missed_hits", {{24, 0.0893}, {32, 0.0787}})
      .measured("cube, mls", "surface_l1_vx", {{24, 0.254}, {32, 0.217}})
      .measured("cube, mls", "surface_linf_vx", {{24, 1.18}, {32, 1.14}})
      .measured("cube, mls", "missed_hits", {{24, 0.11}, {32, 0.0922}})
      .measured("sphere, meshless", "surface_l1_vx", {{24, 0.166}, {32, 0.172}})
      .measured("sphere, meshless", "surface_linf_vx", {{24, 0.946}, {32, 0.8}})
      .measured("sphere, meshless", "missed_hits", {{24, 0.0442}, {32, 0.0271}})
      .measured("sphere, mls", "surface_l1_vx", {{24, 0.103}, {32, 0.109}})
      .measured("sphere, mls", "surface_linf_vx", {{24, 0.422}, {32, 0.465}})
      .measured("sphere, mls", "missed_hits", {{24, 0.0354}, {32, 0.0165}})
      .measured("torus, meshless", "surface_l1_vx", {{24, 0.197}, {32, 0.187}})
      .measured("torus, meshless", "surface_linf_vx", {{24, 0.842}, {32, 0.903}})
      .measured("torus, meshless", "missed_hits", {{24, 0.06}, {32, 0.0441}})
      .measured("torus, mls", "surface_l1_vx", {{24, 0.156}, {32, 0.145}})
      .measured("torus, mls", "surface_linf_vx", {{24, 0.602}, {32, 0.641}})
      .measured("torus, mls", "missed_hits", {{24, 0.0382}, {32, 0.0329}});
}

Bounds particleBounds() {
  return Bounds()
      .measured("two balls", "surface_l1_vx", {{16, 0.00893}, {32, 0.00401}, {64, 0.00221}})
      .measured("two balls", "surface_linf_vx", {{16, 0.242}, {32, 0.262}, {64, 0.279}})
      .measured("two balls", "missed_hits",
                {{16, 0.00817},
                 {32, 0.00935, Budget::Quick},
                 {32, 0.00615, Budget::Full},
                 {64, 0.00122}});
}

}  // namespace

void addPointCases(std::vector<Case>& all) {
  all.push_back({.name = "points-clean",
                 .group = "points",
                 .title = "surfaces of points without noise",
                 .definition =
                     "Points with exact normals, two voxels apart, on a sphere of radius 0.4, a "
                     "torus of radii 0.35 and 0.15, and a cube of edge 0.7. Solids by 'level-set "
                     "--method mls', 'mpu', 'rbf' and 'meshless'.",
                 .citation = "closed form",
                 .quick = {16, 32},
                 .full = {32, 64},
                 .bounds = cleanPointBounds(),
                 .run = cleanPoints});
  all.push_back({.name = "points-noise",
                 .group = "points with noise",
                 .title = "surfaces of noisy points without normals",
                 .definition =
                     "The points of 'points-clean', with a noise whose standard deviation is a "
                     "fifth of their spacing. Normals come from 40 neighbours, and so do the "
                     "surfaces. 'rbf' has '--lambda 30'.",
                 .citation = "closed form",
                 .quick = {24},
                 .full = {32},
                 .bounds = noisyPointBounds(),
                 .run = noisyPoints});
  all.push_back({.name = "points-particles",
                 .group = "particles",
                 .title = "union of the balls of particles",
                 .definition = "Two balls of radii 0.35 and 0.25 whose surfaces meet in a circle.",
                 .citation = "closed form",
                 .quick = {16, 32},
                 .full = {32, 64},
                 .bounds = particleBounds(),
                 .run = particleBalls});
}

}  // namespace regress
