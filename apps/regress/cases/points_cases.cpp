#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/points/processing/normals.h"
#include "levelset/points/processing/point_spacing.h"
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
  long euler;            ///< Euler characteristic of the surface
  std::size_t surfaces;  ///< connected parts of the surface
};

std::vector<PointShape> shapes(const V3d& shift) {
  return {{"sphere", ball(shift, 0.4), 2, 1},
          {"torus", torus(shift, V3d(1, 2, 3), 0.35, 0.15), 0, 1},
          {"cube", box(shift, V3d(0.7)), 2, 1}};
}

struct NamedMethod {
  const char* name;
  PointMethod method;
};
constexpr NamedMethod kPointMethods[] = {{"mls", PointMethod::MovingLeastSquares},
                                         {"mpu", PointMethod::MultilevelPartition},
                                         {"rbf", PointMethod::RadialBasis},
                                         {"meshless", PointMethod::Meshless}};

struct CloudKind {
  bool isNoisy = false;
  bool hasHole = false;  ///< a large share of the surface is a guess
};

/// Measures the solids of a cloud by all methods.
void measureSolids(Recorder& out, const Sample& at, const PointShape& shape,
                   const PointCloud& cloud, const CloudKind& kind = {}) {
  constexpr std::size_t kNoisyNeighbours = 40;
  constexpr double kNoisyLambda = 30;
  for (const NamedMethod& method : kPointMethods) {
    levelset::PointsToBandOptions options{.method = method.method,
                                          .acceptUnsupported = kind.hasHole};
    const bool isRadial = method.method == PointMethod::RadialBasis;
    if (kind.isNoisy && isRadial) options.lambda = kNoisyLambda;
    if (kind.isNoisy && !isRadial) options.neighbours = kNoisyNeighbours;
    out.measure({std::string(shape.name) + ", " + method.name, at, shape.truth}, kOurs,
                [&] { return pointsToBand(cloud, at.voxelSize, options).band; });
  }
}

/// States that the surface of each method has the topology of the shape.
void expectTopology(Recorder& out, const Sample& at, const PointShape& shape,
                    const PointCloud& cloud, bool hasHole = false) {
  if (at.phase != kQuickPhase) return;
  for (const NamedMethod& method : kPointMethods)
    out.expect(
        fmt::format("{}, {} at resolution {}", shape.name, method.name, at.resolution),
        fmt::format("Euler characteristic {}, surfaces: {}", shape.euler, shape.surfaces), [&] {
          const auto found = measure(
              bandToMesh(pointsToBand(cloud, at.voxelSize,
                                      {.method = method.method, .acceptUnsupported = hasHole})
                             .band));
          return std::pair(
              found.euler == shape.euler && found.surfaces == shape.surfaces,
              fmt::format("Euler characteristic {}, surfaces: {}", found.euler, found.surfaces));
        });
}

/// Placements of the case. The quick budget has one at each resolution, because the points lie
/// irregularly on the grid at every placement.
std::vector<Sample> pointSamples(const Recorder& out) {
  std::vector<Sample> all = out.samples();
  if (out.isQuick()) std::erase_if(all, [](const Sample& at) { return at.phase != kQuickPhase; });
  return all;
}

void cleanPoints(Recorder& out) {
  for (const Sample& at : pointSamples(out))
    for (const PointShape& shape : shapes(at.shift)) {
      const PointCloud cloud = pointsOn(shape.truth, at.voxelSize);
      measureSolids(out, at, shape, cloud);
      expectTopology(out, at, shape, cloud);
    }
}

/// Points with a noise of a fifth of their spacing, and normals that are computed from them.
void noisyPoints(Recorder& out) {
  constexpr int kNeighbours = 40;
  constexpr double kNoise = 0.2;
  for (const Sample& at : pointSamples(out))
    for (const PointShape& shape : shapes(at.shift)) {
      PointCloud cloud = pointsOn(shape.truth, at.voxelSize);
      std::mt19937_64 random(1);
      std::normal_distribution<double> noise(0, kNoise * 2 * at.voxelSize);
      for (V3d& p : cloud.positions)
        for (int axis = 0; axis < 3; ++axis) p[axis] += noise(random);
      cloud = levelset::estimateNormals(std::move(cloud), {.neighbours = kNeighbours}).cloud;
      measureSolids(out, at, shape, cloud, {.isNoisy = true});
    }
}

/// Keeps a point with a probability that falls from one at the highest point on the x axis to a
/// ninth at the lowest one, so that the spacing there is three times as large.
void unevenPoints(Recorder& out) {
  for (const Sample& at : pointSamples(out))
    for (const PointShape& shape : shapes(at.shift)) {
      const PointCloud cloud = pointsOn(shape.truth, at.voxelSize);
      std::mt19937_64 random(1);
      std::uniform_real_distribution<double> chance(0, 1);
      const Imath::Box3d box = bounds(cloud);
      std::vector<std::uint32_t> kept;
      for (std::uint32_t i = 0; i < cloud.size(); ++i) {
        const double along = (cloud.positions[i].x - box.min.x) / box.size().x;
        if (chance(random) < std::pow(9.0, along - 1)) kept.push_back(i);
      }
      const PointCloud uneven = selectPoints(cloud, kept);
      measureSolids(out, at, shape, uneven);
      expectTopology(out, at, shape, uneven);
    }
}

/// A tenth of the height of a ball has no points.
void pointsWithHole(Recorder& out) {
  for (const Sample& at : pointSamples(out)) {
    const PointShape shape{"sphere", ball(at.shift, 0.4), 2, 1};
    const PointCloud cloud = pointsOn(shape.truth, at.voxelSize);
    std::vector<std::uint32_t> kept;
    for (std::uint32_t i = 0; i < cloud.size(); ++i)
      if (cloud.positions[i].z - at.shift.z < 0.32) kept.push_back(i);
    const PointCloud open = selectPoints(cloud, kept);
    measureSolids(out, at, shape, open, {.hasHole = true});
    expectTopology(out, at, shape, open, true);
  }
}

/// Ball with a ball-shaped cavity: two sheets at a distance of three spacings.
PointShape hollowBall(const Sample& at) {
  const double outer = 0.4, inner = outer - 3 * 2 * at.voxelSize;
  const V3d centre = at.shift;
  return {"hollow ball",
          {.distance =
               [=](const V3d& p) {
                 const double radius = (p - centre).length();
                 return std::max(radius - outer, inner - radius);
               },
           .centre = centre,
           .reach = outer},
          4,
          2};
}

void sheetsOfPoints(Recorder& out) {
  for (const Sample& at : pointSamples(out)) {
    const PointShape shape = hollowBall(at);
    const PointCloud cloud = pointsOn(shape.truth, at.voxelSize);
    measureSolids(out, at, shape, cloud);
    expectTopology(out, at, shape, cloud);
  }
}

/// Half of the normals are flipped, then `normals` computes them.
void flippedPoints(Recorder& out) {
  for (const Sample& at : pointSamples(out))
    for (const PointShape& shape : shapes(at.shift)) {
      PointCloud cloud = pointsOn(shape.truth, at.voxelSize);
      for (std::size_t i = 0; i < cloud.size(); i += 2) cloud.normals[i] = -cloud.normals[i];
      if (at.phase == kQuickPhase)
        out.expectRefusal(fmt::format("{} at resolution {}", shape.name, at.resolution),
                          levelset::ExitCode::Input,
                          [&] { (void)pointsToBand(cloud, at.voxelSize); });
      cloud = levelset::estimateNormals(std::move(cloud), {}).cloud;
      measureSolids(out, at, shape, cloud);
      expectTopology(out, at, shape, cloud);
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
      .measured(
          "cube, mpu", "surface_l1_vx",
          {{16, 0.0261}, {32, 0.0092, Budget::Quick}, {32, 0.0148, Budget::Full}, {64, 0.00677}})
      .measured("cube, mpu", "surface_linf_vx", {{16, 0.19}, {32, 0.255}, {64, 0.249}})
      .measured("cube, mpu", "missed_hits", {{16, 0.0488}, {32, 0.0229}, {64, 0.00935}})
      .measured("cube, rbf", "surface_l1_vx", {{16, 0.0949}, {32, 0.0541}, {64, 0.0289}})
      .measured("cube, rbf", "surface_linf_vx", {{16, 0.733}, {32, 0.594}, {64, 0.581}})
      .measured("cube, rbf", "missed_hits", {{16, 0.0738}, {32, 0.0394}, {64, 0.0197}})
      .measured("sphere, meshless", "surface_l1_vx", {{16, 0.0266}, {32, 0.0125}, {64, 0.00635}})
      .measured("sphere, meshless", "surface_linf_vx", {{16, 0.156}, {32, 0.0888}, {64, 0.0465}})
      .measured("sphere, meshless", "missed_hits",
                {{16, 0.00314},
                 {32, 0.000684, Budget::Quick},
                 {32, 0.00275, Budget::Full},
                 {64, 0.000669}})
      .measured("sphere, mls", "surface_l1_vx", {{16, 0.0108}, {32, 0.00122}, {64, 0.000149}})
      .measured("sphere, mls", "surface_linf_vx", {{16, 0.0215}, {32, 0.00274}, {64, 0.000373}})
      .measured("sphere, mls", "missed_hits",
                {{16, 0.00209}, {32, 0.000684, Budget::Quick}, {32, 0.000344, Budget::Full}})
      .measured("sphere, mpu", "surface_l1_vx", {{16, 0.00424}, {32, 0.000615}, {64, 0.000818}})
      .measured("sphere, mpu", "surface_linf_vx", {{16, 0.0207}, {32, 0.00674}, {64, 0.00347}})
      .measured("sphere, mpu", "missed_hits",
                {{16, 0}, {32, 0.000172, Budget::Full}, {64, 0.000134}})
      .measured("sphere, rbf", "surface_l1_vx", {{16, 0.00949}, {32, 0.00497}, {64, 0.00256}})
      .measured("sphere, rbf", "surface_linf_vx", {{16, 0.0152}, {32, 0.0105}, {64, 0.00588}})
      .measured("sphere, rbf", "missed_hits", {{16, 0.00628}, {32, 0.00137}, {64, 0.000134}})
      .measured("torus, meshless", "surface_l1_vx", {{16, 0.0435}, {32, 0.02}, {64, 0.00985}})
      .measured("torus, meshless", "surface_linf_vx", {{16, 0.373}, {32, 0.173}, {64, 0.0933}})
      .measured(
          "torus, meshless", "missed_hits",
          {{16, 0.0268}, {32, 0.0105, Budget::Quick}, {32, 0.00667, Budget::Full}, {64, 0.00154}})
      .measured("torus, mls", "surface_l1_vx", {{16, 0.0717}, {32, 0.0095}, {64, 0.00111}})
      .measured("torus, mls", "surface_linf_vx", {{16, 0.211}, {32, 0.0294}, {64, 0.00409}})
      .measured("torus, mls", "missed_hits",
                {{16, 0.0361}, {32, 0.00574, Budget::Quick}, {32, 0.00333, Budget::Full}})
      .measured("torus, mpu", "surface_l1_vx", {{16, 0.0321}, {32, 0.0119}, {64, 0.00255}})
      .measured("torus, mpu", "surface_linf_vx",
                {{16, 0.214}, {32, 0.052, Budget::Quick}, {32, 0.0827, Budget::Full}, {64, 0.0286}})
      .measured("torus, mpu", "missed_hits", {{16, 0.0107}, {32, 0.00382}, {64, 0.000578}})
      .measured("torus, rbf", "surface_l1_vx", {{16, 0.00874}, {32, 0.00205}, {64, 0.00115}})
      .measured("torus, rbf", "surface_linf_vx", {{16, 0.0993}, {32, 0.0162}, {64, 0.0109}})
      .measured("torus, rbf", "missed_hits", {{16, 0.00134}, {32, 0.000953, Budget::Full}});
}

Bounds noisyPointBounds() {
  return Bounds()
      .measured("cube, meshless", "surface_l1_vx", {{24, 0.251}, {32, 0.224}})
      .measured("cube, meshless", "surface_linf_vx", {{24, 2.07}, {32, 1.1}})
      .measured("cube, meshless", "missed_hits", {{24, 0.0893}, {32, 0.0787}})
      .measured("cube, mls", "surface_l1_vx", {{24, 0.254}, {32, 0.217}})
      .measured("cube, mls", "surface_linf_vx", {{24, 1.18}, {32, 1.14}})
      .measured("cube, mls", "missed_hits", {{24, 0.11}, {32, 0.0922}})
      .measured("cube, mpu", "surface_l1_vx", {{24, 0.23}, {32, 0.245}})
      .measured("cube, mpu", "surface_linf_vx", {{24, 1.45}, {32, 1.44}})
      .measured("cube, mpu", "missed_hits", {{24, 0.12}, {32, 0.116}})
      .measured("cube, rbf", "surface_l1_vx", {{24, 0.286}, {32, 0.235}})
      .measured("cube, rbf", "surface_linf_vx", {{24, 1.23}, {32, 1.21}})
      .measured("cube, rbf", "missed_hits", {{24, 0.121}, {32, 0.102}})
      .measured("sphere, meshless", "surface_l1_vx", {{24, 0.166}, {32, 0.172}})
      .measured("sphere, meshless", "surface_linf_vx", {{24, 0.946}, {32, 0.8}})
      .measured("sphere, meshless", "missed_hits", {{24, 0.0442}, {32, 0.0271}})
      .measured("sphere, mls", "surface_l1_vx", {{24, 0.103}, {32, 0.109}})
      .measured("sphere, mls", "surface_linf_vx", {{24, 0.422}, {32, 0.465}})
      .measured("sphere, mls", "missed_hits", {{24, 0.0354}, {32, 0.0165}})
      .measured("sphere, mpu", "surface_l1_vx", {{24, 0.113}, {32, 0.0979}})
      .measured("sphere, mpu", "surface_linf_vx", {{24, 0.385}, {32, 0.344}})
      .measured("sphere, mpu", "missed_hits", {{24, 0.0306}, {32, 0.016}})
      .measured("sphere, rbf", "surface_l1_vx", {{24, 0.103}, {32, 0.0989}})
      .measured("sphere, rbf", "surface_linf_vx", {{24, 0.384}, {32, 0.408}})
      .measured("sphere, rbf", "missed_hits", {{24, 0.0314}, {32, 0.0148}})
      .measured("torus, meshless", "surface_l1_vx", {{24, 0.197}, {32, 0.187}})
      .measured("torus, meshless", "surface_linf_vx", {{24, 0.842}, {32, 0.903}})
      .measured("torus, meshless", "missed_hits", {{24, 0.06}, {32, 0.0441}})
      .measured("torus, mls", "surface_l1_vx", {{24, 0.155}, {32, 0.145}})
      .measured("torus, mls", "surface_linf_vx", {{24, 0.602}, {32, 0.641}})
      .measured("torus, mls", "missed_hits", {{24, 0.0382}, {32, 0.0331}})
      .measured("torus, mpu", "surface_l1_vx", {{24, 0.213}, {32, 0.142}})
      .measured("torus, mpu", "surface_linf_vx", {{24, 0.699}, {32, 0.613}})
      .measured("torus, mpu", "missed_hits", {{24, 0.0556}, {32, 0.0338}})
      .measured("torus, rbf", "surface_l1_vx", {{24, 0.175}, {32, 0.131}})
      .measured("torus, rbf", "surface_linf_vx", {{24, 0.726}, {32, 0.47}})
      .measured("torus, rbf", "missed_hits", {{24, 0.0425}, {32, 0.031}});
}

Bounds unevenPointBounds() {
  return Bounds()
      .measured("cube, meshless", "surface_l1_vx", {{24, 0.388}, {48, 0.365}})
      .measured("cube, meshless", "surface_linf_vx", {{24, 4.64}, {48, 7.23}})
      .measured("cube, meshless", "missed_hits", {{24, 0.127}, {48, 0.0833}})
      .measured("cube, mls", "surface_l1_vx", {{24, 0.305}, {48, 0.216}})
      .measured("cube, mls", "surface_linf_vx", {{24, 1.68}, {48, 5.71}})
      .measured("cube, mls", "missed_hits", {{24, 0.164}, {48, 0.0892}})
      .measured("cube, mpu", "surface_l1_vx", {{24, 0.017}, {48, 0.171}})
      .measured("cube, mpu", "surface_linf_vx", {{24, 0.191}, {48, 8.14}})
      .measured("cube, mpu", "missed_hits", {{24, 0.0166}, {48, 0.0362}})
      .measured("cube, rbf", "surface_l1_vx", {{24, 0.227}, {48, 0.195}})
      .measured("cube, rbf", "surface_linf_vx", {{24, 2.07}, {48, 2.65}})
      .measured("cube, rbf", "missed_hits", {{24, 0.108}, {48, 0.0461}})
      .measured("sphere, meshless", "surface_l1_vx", {{24, 0.205}, {48, 0.111}})
      .measured("sphere, meshless", "surface_linf_vx", {{24, 1.68}, {48, 1.33}})
      .measured("sphere, meshless", "missed_hits", {{24, 0.0563}, {48, 0.0157}})
      .measured("sphere, mls", "surface_l1_vx", {{24, 0.0407}, {48, 0.00814}})
      .measured("sphere, mls", "surface_linf_vx", {{24, 0.535}, {48, 0.112}})
      .measured("sphere, mls", "missed_hits", {{24, 0.0121}, {48, 0.00176}})
      .measured("sphere, mpu", "surface_l1_vx", {{24, 0.0292}, {48, 0.00734}})
      .measured("sphere, mpu", "surface_linf_vx", {{24, 0.524}, {48, 0.242}})
      .measured("sphere, mpu", "missed_hits", {{24, 0.00724}, {48, 0.000878}})
      .measured("sphere, rbf", "surface_l1_vx", {{24, 0.0213}, {48, 0.0129}})
      .measured("sphere, rbf", "surface_linf_vx", {{24, 0.141}, {48, 0.046}})
      .measured("sphere, rbf", "missed_hits", {{24, 0.00644}, {48, 0.000878}})
      .measured("torus, meshless", "surface_l1_vx", {{24, 0.387}, {48, 0.157}})
      .measured("torus, meshless", "surface_linf_vx", {{24, 3.14}, {48, 3}})
      .measured("torus, meshless", "missed_hits", {{24, 0.133}, {48, 0.0305}})
      .measured("torus, mls", "surface_l1_vx", {{24, 0.257}, {48, 0.0611}})
      .measured("torus, mls", "surface_linf_vx", {{24, 2.65}, {48, 1.1}})
      .measured("torus, mls", "missed_hits", {{24, 0.0774}, {48, 0.00975}})
      .measured("torus, mpu", "surface_l1_vx", {{24, 0.318}, {48, 0.0512}})
      .measured("torus, mpu", "surface_linf_vx", {{24, 4.55}, {48, 0.781}})
      .measured("torus, mpu", "missed_hits", {{24, 0.0802}, {48, 0.00768}})
      .measured("torus, rbf", "surface_l1_vx", {{24, 0.0739}, {48, 0.0138}})
      .measured("torus, rbf", "surface_linf_vx", {{24, 0.639}, {48, 0.208}})
      .measured("torus, rbf", "missed_hits", {{24, 0.0207}, {48, 0.00166}});
}

Bounds holeBounds() {
  return Bounds()
      .measured("sphere, meshless", "surface_l1_vx", {{24, 0.068}, {48, 0.128}})
      .measured("sphere, meshless", "surface_linf_vx", {{24, 1.72}, {48, 3.33}})
      .measured("sphere, meshless", "missed_hits", {{24, 0.0241}, {48, 0.0117}})
      .measured("sphere, mls", "surface_l1_vx", {{24, 0.0404}, {48, 0.119}})
      .measured("sphere, mls", "surface_linf_vx", {{24, 1.73}, {48, 3.33}})
      .measured("sphere, mls", "missed_hits", {{24, 0.00241}, {48, 0.00893}})
      .measured("sphere, mpu", "surface_l1_vx", {{24, 0.0318}, {48, 0.115}})
      .measured("sphere, mpu", "surface_linf_vx", {{24, 1.72}, {48, 3.33}})
      .measured("sphere, mpu", "missed_hits", {{24, 0.00724}, {48, 0.00951}})
      .measured("sphere, rbf", "surface_l1_vx", {{24, 0.0107}, {48, 0.0419}})
      .measured("sphere, rbf", "surface_linf_vx", {{24, 0.132}, {48, 3.37}})
      .measured("sphere, rbf", "missed_hits", {{24, 0.000805}, {48, 0.006}});
}

Bounds sheetBounds() {
  return Bounds()
      .measured("hollow ball, meshless", "surface_l1_vx", {{24, 0.0221}, {48, 0.00952}})
      .measured("hollow ball, meshless", "surface_linf_vx", {{24, 0.28}, {48, 0.113}})
      .measured("hollow ball, meshless", "missed_hits", {{24, 0.012}, {48, 0.00159}})
      .measured("hollow ball, mls", "surface_l1_vx", {{24, 0.0156}, {48, 0.000599}})
      .measured("hollow ball, mls", "surface_linf_vx", {{24, 0.177}, {48, 0.00291}})
      .measured("hollow ball, mls", "missed_hits", {{24, 0.0106}})
      .measured("hollow ball, mpu", "surface_l1_vx", {{24, 0.0235}, {48, 0.00125}})
      .measured("hollow ball, mpu", "surface_linf_vx", {{24, 0.17}, {48, 0.00703}})
      .measured("hollow ball, mpu", "missed_hits", {{24, 0.0106}})
      .measured("hollow ball, rbf", "surface_l1_vx", {{24, 0.0126}, {48, 0.0204}})
      .measured("hollow ball, rbf", "surface_linf_vx", {{24, 0.0698}, {48, 0.066}})
      .measured("hollow ball, rbf", "missed_hits", {{24, 0.00423}, {48, 0.00318}});
}

Bounds flippedBounds() {
  return Bounds()
      .measured("cube, meshless", "surface_l1_vx", {{24, 0.0701}, {48, 0.0356}})
      .measured("cube, meshless", "surface_linf_vx", {{24, 0.613}, {48, 1.24}})
      .measured("cube, meshless", "missed_hits", {{24, 0.0436}, {48, 0.024}})
      .measured("cube, mls", "surface_l1_vx", {{24, 0.0746}, {48, 0.0416}})
      .measured("cube, mls", "surface_linf_vx", {{24, 0.743}, {48, 0.679}})
      .measured("cube, mls", "missed_hits", {{24, 0.0571}, {48, 0.0327}})
      .measured("cube, mpu", "surface_l1_vx", {{24, 0.0248}, {48, 0.0101}})
      .measured("cube, mpu", "surface_linf_vx", {{24, 0.791}, {48, 0.857}})
      .measured("cube, mpu", "missed_hits", {{24, 0.0384}, {48, 0.0173}})
      .measured("cube, rbf", "surface_l1_vx", {{24, 0.0648}, {48, 0.0392}})
      .measured("cube, rbf", "surface_linf_vx", {{24, 0.617}, {48, 0.597}})
      .measured("cube, rbf", "missed_hits", {{24, 0.0415}, {48, 0.027}})
      .measured("sphere, meshless", "surface_l1_vx", {{24, 0.0175}, {48, 0.00858}})
      .measured("sphere, meshless", "surface_linf_vx", {{24, 0.119}, {48, 0.0671}})
      .measured("sphere, meshless", "missed_hits", {{24, 0.00322}, {48, 0.00176}})
      .measured("sphere, mls", "surface_l1_vx", {{24, 0.00294}, {48, 0.000353}})
      .measured("sphere, mls", "surface_linf_vx", {{24, 0.00614}, {48, 0.000891}})
      .measured("sphere, mls", "missed_hits", {{24, 0}})
      .measured("sphere, mpu", "surface_l1_vx", {{24, 0.00181}, {48, 0.000838}})
      .measured("sphere, mpu", "surface_linf_vx", {{24, 0.0113}, {48, 0.00657}})
      .measured("sphere, mpu", "missed_hits", {{24, 0}, {48, 0.000146}})
      .measured("sphere, rbf", "surface_l1_vx", {{24, 0.00638}, {48, 0.00326}})
      .measured("sphere, rbf", "surface_linf_vx", {{24, 0.0118}, {48, 0.00743}})
      .measured("sphere, rbf", "missed_hits", {{24, 0.000805}})
      .measured("torus, meshless", "surface_l1_vx", {{24, 0.0279}, {48, 0.0131}})
      .measured("torus, meshless", "surface_linf_vx", {{24, 0.203}, {48, 0.129}})
      .measured("torus, meshless", "missed_hits", {{24, 0.00654}, {48, 0.00249}})
      .measured("torus, mls", "surface_l1_vx", {{24, 0.0238}, {48, 0.00275}})
      .measured("torus, mls", "surface_linf_vx", {{24, 0.086}, {48, 0.0171}})
      .measured("torus, mls", "missed_hits", {{24, 0.00109}, {48, 0.000208}})
      .measured("torus, mpu", "surface_l1_vx", {{24, 0.029}, {48, 0.00503}})
      .measured("torus, mpu", "surface_linf_vx", {{24, 0.144}, {48, 0.0431}})
      .measured("torus, mpu", "missed_hits", {{24, 0.00545}, {48, 0.00104}})
      .measured("torus, rbf", "surface_l1_vx", {{24, 0.00338}, {48, 0.00131}})
      .measured("torus, rbf", "surface_linf_vx", {{24, 0.035}, {48, 0.00894}})
      .measured("torus, rbf", "missed_hits", {{24, 0}, {48, 0.000623}});
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
  all.push_back({.name = "points-uneven",
                 .group = "uneven points",
                 .title = "surfaces of unevenly spaced points",
                 .definition =
                     "A part of the points of 'points-clean'. The spacing grows from two voxels to "
                     "six against the x axis.",
                 .citation = "closed form",
                 .quick = {24},
                 .full = {48},
                 .bounds = unevenPointBounds(),
                 .run = unevenPoints});
  all.push_back({.name = "points-hole",
                 .group = "points with a hole",
                 .title = "surfaces of points with a hole",
                 .definition =
                     "Points on a sphere of radius 0.4 without those in its highest tenth. The "
                     "result is compared with the whole ball, so the error is largest in the hole. "
                     "'level-set' needs '--accept-sign'.",
                 .citation = "closed form",
                 .quick = {24},
                 .full = {48},
                 .bounds = holeBounds(),
                 .run = pointsWithHole});
  all.push_back({.name = "points-sheets",
                 .group = "points on two sheets",
                 .title = "surfaces of points on two sheets",
                 .definition =
                     "Points on a sphere of radius 0.4 and on the wall of its cavity, three "
                     "spacings away.",
                 .citation = "closed form",
                 .quick = {24},
                 .full = {48},
                 .bounds = sheetBounds(),
                 .run = sheetsOfPoints});
  all.push_back({.name = "points-flipped",
                 .group = "points with flipped normals",
                 .title = "surfaces of points of which half the normals were flipped",
                 .definition =
                     "The points of 'points-clean' with every second normal flipped, which "
                     "'level-set' refuses. Then 'normals' computes them from the positions.",
                 .citation = "closed form",
                 .quick = {24},
                 .full = {48},
                 .bounds = flippedBounds(),
                 .run = flippedPoints});
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
