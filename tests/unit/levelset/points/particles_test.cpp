#include "levelset/points/surface/particles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "tests/support/bands.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace particles_test {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::ParticleKernel;
using levelset::ParticleOptions;
using levelset::particlesToBand;
using levelset::PointCloud;
using levelset::UsageError;
using support::measured;
using support::refusal;

constexpr ParticleKernel kKernels[] = {ParticleKernel::Balls, ParticleKernel::Blobs,
                                       ParticleKernel::ZhuBridson, ParticleKernel::Anisotropic};

/// Particles of a fluid in the unit cube: a lattice with random displacements.
PointCloud fluid(int edge) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> move(-0.25, 0.25);
  PointCloud cloud;
  for (int i = 0; i < edge; ++i)
    for (int j = 0; j < edge; ++j)
      for (int k = 0; k < edge; ++k)
        cloud.positions.push_back(
            V3d(i + 0.5 + move(random), j + 0.5 + move(random), k + 0.5 + move(random)) / edge);
  return cloud;
}

TEST(Particles, OneParticleIsItsBall) {
  for (const ParticleKernel kernel : kKernels)
    for (const V3d& at : {V3d(0.3, -0.2, 0.1), V3d(1e6, 2e6, -1e6)}) {
      const double radius = 0.7, voxel = 0.05;
      const NarrowBand band =
          particlesToBand({.positions = {at}}, voxel, {.kernel = kernel, .radius = radius});
      double worst = 0;
      support::forEachActive(band, [&](const V3d& p, double value) {
        worst = std::max(worst, std::abs(value - ((p - at).length() - radius)));
      });
      EXPECT_LT(worst / voxel, measured(2.16e-4));
    }
}

TEST(Particles, BallsAreTheirUnion) {
  PointCloud cloud{.positions = {V3d(0), V3d(0.8, 0, 0), V3d(5, 0, 0)},
                   .radii = {0.6f, 0.4f, 0.5f}};
  const double voxel = 0.04;
  const NarrowBand band = particlesToBand(cloud, voxel, {.kernel = ParticleKernel::Balls});
  double outside = 0;
  support::forEachActive(band, [&](const V3d& p, double value) {
    double truth = 1e9;
    for (std::size_t i = 0; i < 3; ++i)
      truth = std::min(truth, (p - cloud.positions[i]).length() - double{cloud.radii[i]});
    // Inside, and beside the crease, the distance to the union is not the least one.
    if (truth > 0 && std::abs(p.x - 0.5) > 0.15)
      outside = std::max(outside, std::abs(value - truth));
  });
  EXPECT_LT(outside / voxel, measured(2.2e-4));
  EXPECT_EQ(levelset::measure(band).components, 2);
}

TEST(Particles, SmoothTheFaceOfAFluid) {
  const int edge = 16;
  const PointCloud cloud = fluid(edge);
  struct Face {
    ParticleKernel kernel;
    double height, roughness, volume;  // mean and deviation in spacings; all measured
  };
  for (const Face& face : {Face{ParticleKernel::Blobs, 0.45, 0.082, 1.159},
                           Face{ParticleKernel::ZhuBridson, 0.11, 0.085, 1.042},
                           Face{ParticleKernel::Anisotropic, -0.16, 0.051, 0.965}}) {
    const NarrowBand band = particlesToBand(cloud, 0.25 / edge, {.kernel = face.kernel});
    double sum = 0, squares = 0, count = 0;
    for (const V3d& p : bandToMesh(band).positions)
      if (p.z > 0.5 && std::max(std::abs(p.x - 0.5), std::abs(p.y - 0.5)) < 0.25) {
        const double height = (p.z - 1) * edge;
        sum += height;
        squares += height * height;
        ++count;
      }
    const double mean = sum / count;
    EXPECT_NEAR(mean, face.height, 0.03);
    EXPECT_LT(std::sqrt(squares / count - mean * mean), measured(face.roughness));
    const levelset::Measurement measurement = levelset::measure(band);
    EXPECT_NEAR(measurement.volume, face.volume, 0.01);
    EXPECT_EQ(measurement.surfaces, 1);
  }
}

TEST(Particles, HaveTheSameBitsOnAnyNumberOfThreads) {
  const PointCloud cloud = fluid(8);
  for (const ParticleKernel kernel : kKernels) {
    const auto run = [&] { return particlesToBand(cloud, 0.03, {.kernel = kernel}).contentHash(); };
    EXPECT_EQ(support::onThreads(1, run), support::onThreads(4, run));
  }
}

TEST(Particles, AtOnePlaceCountOnce) {
  PointCloud cloud = fluid(6), doubled = cloud;
  doubled.positions.insert(doubled.positions.end(), cloud.positions.begin(), cloud.positions.end());
  for (const ParticleKernel kernel : kKernels) {
    const ParticleOptions options{.kernel = kernel, .radius = 0.1};
    EXPECT_EQ(particlesToBand(cloud, 0.04, options).contentHash(),
              particlesToBand(doubled, 0.04, options).contentHash());
  }
}

TEST(Particles, RefuseWhatMakesNoSolid) {
  const auto refused = [](const PointCloud& cloud, double voxel,
                          const ParticleOptions& options = {}) {
    return refusal<InvalidInput>([&] { (void)particlesToBand(cloud, voxel, options); });
  };
  EXPECT_SAYS(refused({}, 0.1), "empty");
  EXPECT_SAYS(refused({.positions = {V3d(1)}}, 0.1), "give --radius");
  EXPECT_SAYS(refused({.positions = std::vector<V3d>(1000, V3d(1))}, 0.1), "give --radius");
  EXPECT_SAYS(refused({.positions = {V3d(1)}}, 0.5, {.radius = 0.4}), "smaller voxels");
  EXPECT_FALSE(refused({.positions = {V3d(std::nan(""))}}, 0.1, {.radius = 1}).empty());
  const PointCloud one{.positions = {V3d(1)}};
  for (const ParticleOptions& options :
       {ParticleOptions{.radius = -1}, ParticleOptions{.radius = 1, .reach = 1},
        ParticleOptions{.radius = 1, .reach = 11}, ParticleOptions{.radius = 1, .halfWidth = 0.5}})
    EXPECT_THROW((void)particlesToBand(one, 0.1, options), UsageError);
  EXPECT_THROW((void)particlesToBand(one, 0, {.radius = 1}), UsageError);
  EXPECT_THROW((void)particlesToBand(one, 0.01, {.radius = 1, .maxMemory = 1000}),
               levelset::ResourceLimit);
}

}  // namespace particles_test
