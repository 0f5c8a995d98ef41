#include "levelset/advection/advect.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "levelset/advection/front.h"
#include "levelset/advection/velocity.h"
#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/fields/expression.h"
#include "levelset/fields/grid_vdb.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "tests/support/bands.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace advect_test {

using Imath::V3d;
using levelset::AdvectOptions;
using levelset::AdvectResult;
using levelset::AdvectScheme;
using levelset::NarrowBand;
using levelset::VectorField;
using support::refusal;

constexpr double kPi = 3.14159265358979323846;
using Distance = std::function<double(const V3d&)>;

struct SurfaceError {
  double mean = 0, largest = 0;  ///< errors of the surface, voxels
};

/// Measures the exact distance at the zeros that linear interpolation finds on grid edges.
SurfaceError surfaceError(const NarrowBand& band, const Distance& exact) {
  const openvdb::FloatGrid& grid = levelset::vdb(band);
  const auto accessor = grid.getConstAccessor();
  SurfaceError error;
  std::size_t count = 0;
  for (auto it = grid.cbeginValueOn(); it; ++it) {
    for (int axis = 0; axis < 3; ++axis) {
      openvdb::Coord next = it.getCoord();
      ++next[axis];
      const auto a = static_cast<double>(*it), b = static_cast<double>(accessor.getValue(next));
      if ((a < 0) == (b < 0)) continue;
      openvdb::Vec3d place = it.getCoord().asVec3d();
      place[axis] += a / (a - b);
      const double off =
          std::abs(exact(levelset::toImath(grid.indexToWorld(place)))) / band.voxelSize();
      error.mean += off;
      error.largest = std::max(error.largest, off);
      ++count;
    }
  }
  EXPECT_GT(count, 0u);
  error.mean /= static_cast<double>(count);
  return error;
}

Distance ballDistance(const V3d& center, double radius) {
  return [=](const V3d& p) { return (p - center).length() - radius; };
}

VectorField constantVelocity(const V3d& u) {
  return [u](const V3d&, double) { return u; };
}

double volumeChange(const AdvectResult& result) {
  return result.volumeAfter / result.volumeBefore - 1;
}

const V3d kEnrightCenter(0.35);
constexpr double kEnrightRadius = 0.15;

/// Runs the deformation forward and back, and returns the volume change and the surface error.
AdvectResult enright(int resolution, AdvectScheme scheme = AdvectScheme::Front,
                     const VectorField& velocity = levelset::enrightVelocity()) {
  const NarrowBand ball = levelset::makeSphere(kEnrightRadius, kEnrightCenter, 1.0 / resolution);
  return levelset::advect(ball, velocity, 3, {.scheme = scheme});
}

TEST(SlowAdvect, ReversesEnrightsDeformation) {
  const AdvectResult result = enright(64);
  const SurfaceError error =
      surfaceError(result.band, ballDistance(kEnrightCenter, kEnrightRadius));
  EXPECT_LT(std::abs(volumeChange(result)), support::measured(0.00139));
  EXPECT_LT(error.mean, support::measured(0.00804));
  EXPECT_LT(error.largest, support::measured(0.023));
  EXPECT_TRUE(levelset::check(result.band).passed());
}

TEST(SlowAdvect, ReversesEnrightsDeformationOnAFineGrid) {
  const AdvectResult result = enright(128);
  const SurfaceError error =
      surfaceError(result.band, ballDistance(kEnrightCenter, kEnrightRadius));
  EXPECT_LT(std::abs(volumeChange(result)), support::measured(3.27e-4));
  EXPECT_LT(error.mean, support::measured(0.00387));
}

/// LeVeque's velocity at time 0 on a staggered grid. The time factor is applied outside.
levelset::FieldGrid staggeredEnright(int resolution) {
  const auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3s(0.0f));
  grid->setTransform(levelset::uniformTransform(1.0 / resolution));
  grid->setGridClass(openvdb::GRID_STAGGERED);
  const VectorField exact = levelset::enrightVelocity();
  auto accessor = grid->getAccessor();
  for (int x = 0; x <= resolution; ++x)
    for (int y = 0; y <= resolution; ++y)
      for (int z = 0; z <= resolution; ++z) {
        openvdb::Vec3s value;
        for (int i = 0; i < 3; ++i) {
          openvdb::Vec3d place(x, y, z);
          place[i] -= 0.5;
          value[i] = static_cast<float>(exact(levelset::toImath(grid->indexToWorld(place)), 0)[i]);
        }
        accessor.setValue(openvdb::Coord(x, y, z), value);
      }
  return levelset::importField(grid);
}

TEST(SlowAdvect, ReversesTheDeformationWithAVelocityGrid) {
  const VectorField steady = levelset::asVectorField(staggeredEnright(64));
  const AdvectResult result = enright(64, AdvectScheme::Front, [steady](const V3d& p, double time) {
    return steady(p, time) * std::cos(kPi * time / 3);
  });
  EXPECT_LT(std::abs(volumeChange(result)), support::measured(0.00132));
  EXPECT_LT(surfaceError(result.band, ballDistance(kEnrightCenter, kEnrightRadius)).mean,
            support::measured(0.00861));
}

TEST(Advect, MovesASphereExactly) {
  const double h = 0.05;
  const V3d from(0.1, -0.2, 0.03), by(1.234, -0.77, 0.4);
  const NarrowBand ball = levelset::makeSphere(1, from, h);
  for (const double time : {1.0, -1.0}) {
    const AdvectResult result = levelset::advect(ball, constantVelocity(by), time);
    const SurfaceError error = surfaceError(result.band, ballDistance(from + by * time, 1));
    EXPECT_LT(error.largest, support::measured(0.0127)) << time;
    EXPECT_EQ(result.band.halfWidth(), ball.halfWidth());
    EXPECT_EQ(result.band.indexToWorld(), ball.indexToWorld());
  }
  EXPECT_EQ(levelset::advect(ball, constantVelocity(by), 0).band.contentHash(), ball.contentHash());
  // Zero velocity does not move the solid.
  EXPECT_LT(
      surfaceError(levelset::advect(ball, constantVelocity(V3d(0)), 5).band, ballDistance(from, 1))
          .largest,
      support::measured(0.0105));
}

TEST(Advect, ConvergesInSecondOrder) {
  std::vector<double> errors;
  for (const int resolution : {24, 48, 96}) {
    const double h = 1.0 / resolution;
    const NarrowBand ball = levelset::makeSphere(0.15, V3d(0.5, 0.75, 0.5), h);
    const AdvectResult result = levelset::advect(ball, levelset::vortexVelocity(2), 2);
    errors.push_back(h * surfaceError(result.band, ballDistance(V3d(0.5, 0.75, 0.5), 0.15)).mean);
  }
  EXPECT_GT(std::log2(errors[0] / errors[1]), support::measuredOrder(1.83, 1.7));
  EXPECT_GT(std::log2(errors[1] / errors[2]), support::measuredOrder(1.96, 1.7));
}

// A shrinking surface keeps its number of triangles. Judged by triangles per area it would look
// crumpled, as Enright's sphere once did on its way back at 128.
TEST(Advect, FollowsACompressedSurface) {
  const V3d center(0.3, -0.2, 0.1);
  const auto inwards = [=](const V3d& p, double) { return center - p; };
  const AdvectResult result =
      levelset::advect(levelset::makeSphere(60, center, 1), inwards, std::log(10.0));
  EXPECT_LT(surfaceError(result.band, ballDistance(center, 6)).mean,
            support::measured(0.00721, 0.01));
}

TEST(Advect, RotatesSolidsRigidly) {
  const double h = 0.05;
  const VectorField spin = levelset::rotationVelocity(V3d(0.5, 0.3, 0), V3d(1, 2, 3));
  const auto turned = [&](const NarrowBand& solid) { return levelset::advect(solid, spin, 1); };

  const AdvectResult torus = turned(levelset::makeTorus(1, 0.35, V3d(0), V3d(0, 0, 1), h));
  EXPECT_LT(
      surfaceError(torus.band,
                   [](const V3d& p) { return std::hypot(std::hypot(p.x, p.y) - 1, p.z) - 0.35; })
          .largest,
      support::measured(0.0227));
  EXPECT_LT(std::abs(volumeChange(torus)), support::measured(9.49e-4, 1e-3));

  const auto boxDistance = [](const V3d& half) {
    return [half](const V3d& p) {
      const V3d q(std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z);
      const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
      return out.length() + std::min(0.0, std::max({q.x, q.y, q.z}));
    };
  };
  // Edges fall between grid points, so linear zeros are off by up to half a voxel.
  const AdvectResult cube = turned(levelset::makeBox(V3d(1.52), V3d(0), h));
  const SurfaceError cubeError = surfaceError(cube.band, boxDistance(V3d(0.76)));
  EXPECT_LT(cubeError.mean, support::measured(0.00959));
  EXPECT_LT(cubeError.largest, support::measured(0.0986));
  EXPECT_LT(std::abs(volumeChange(cube)), support::measured(0.00136, 2e-3));

  const AdvectResult plate = turned(levelset::makeBox(V3d(1.5, 1.5, 1.7 * h), V3d(0), h));
  EXPECT_LT(surfaceError(plate.band, boxDistance(V3d(0.75, 0.75, 0.85 * h))).mean,
            support::measured(0.0218));
  EXPECT_LT(std::abs(volumeChange(plate)), support::measured(0.00487));
}

TEST(Advect, RotatesZalesaksSphere) {
  const V3d center(50, 75, 50);
  const NarrowBand solid = levelset::subtract(
      levelset::makeSphere(15, center, 1), levelset::makeBox(V3d(5, 40, 40), V3d(50, 65, 50), 1));
  const VectorField spin = levelset::rotationVelocity(V3d(50, 50, 50), V3d(0, 0, 1), 628);
  const AdvectResult result = levelset::advect(solid, spin, 628);
  const auto exact = [&](const V3d& p) {
    const V3d q(std::abs(p.x - 50) - 2.5, p.y - 85, 0);
    const double slot =
        std::hypot(std::max(q.x, 0.0), std::max(q.y, 0.0)) + std::min(0.0, std::max(q.x, q.y));
    return std::max((p - center).length() - 15, -slot);
  };
  const SurfaceError error = surfaceError(result.band, exact);
  EXPECT_LT(std::abs(volumeChange(result)), support::measured(1.56e-4));
  EXPECT_LT(error.mean, support::measured(0.0128));
  EXPECT_LT(error.largest, support::measured(0.465));
}

TEST(Advect, KeepsSheetsBetweenItsCalls) {
  const double h = 1.0 / 32;
  const NarrowBand ball = levelset::makeSphere(kEnrightRadius, kEnrightCenter, h);
  const VectorField velocity = levelset::enrightVelocity();
  levelset::Advection advection(ball);
  for (int quarter = 0; quarter < 4; ++quarter) advection.advance(velocity, 0.75);
  const AdvectResult result = advection.result();
  EXPECT_LT(surfaceError(result.band, ballDistance(kEnrightCenter, kEnrightRadius)).mean,
            support::measured(0.0149));
  EXPECT_LT(std::abs(volumeChange(result)), support::measured(0.00512));
}

TEST(Advect, RunsBackwards) {
  const NarrowBand ball = levelset::makeSphere(0.2, V3d(0.5, 0.7, 0.5), 0.02);
  const VectorField shear = levelset::vectorExpression("sin(pi*y)*(1 + t), 0.3*x, 0.2*cos(t)");
  levelset::Advection advection(ball, {.start = 0.5});
  advection.advance(shear, 0.8);
  advection.advance(shear, -0.8);
  EXPECT_LT(surfaceError(advection.result().band, ballDistance(V3d(0.5, 0.7, 0.5), 0.2)).largest,
            support::measured(0.0169));
}

TEST(Advect, DoesNotMoveWhereTheMaskIsZero) {
  const double h = 0.05;
  const NarrowBand ball = levelset::makeSphere(1, V3d(0), h);
  AdvectOptions options;
  options.mask = {.field = [](const V3d& p) { return p.x; }, .min = 0.2, .max = 0.6};
  const NarrowBand moved =
      levelset::advect(ball, constantVelocity(V3d(0.5, 0, 0)), 1, options).band;
  EXPECT_NEAR(moved.zeroSetBounds().max.x, 1.5, support::measured(0.00216) * h);
  EXPECT_NEAR(moved.zeroSetBounds().min.x, -1, support::measured(0.00216) * h);
  const auto accessor = levelset::vdb(moved).getConstAccessor();
  for (auto it = levelset::vdb(ball).cbeginValueOn(); it; ++it) {
    // Farther than three voxels, the moving part does not affect distances.
    if (it.getCoord().x() > 0.2 / h - 4) continue;
    ASSERT_NEAR(accessor.getValue(it.getCoord()), *it, support::measured(0.00793) * h);
  }
}

TEST(Advect, DetectsMotionOfASmallPart) {
  // The jet is fast and covers only three voxels of a large ball. The surface cannot move beyond
  // it.
  const NarrowBand ball = levelset::makeSphere(40, V3d(0), 1);
  const V3d place(39, 7, 5);
  const VectorField jet = [&](const V3d& p, double) {
    return V3d(1000 * std::max(0.0, 1 - (p - place).length2() / 9), 0, 0);
  };
  const NarrowBand drawn = levelset::advect(ball, jet, 0.1).band;
  EXPECT_LE(drawn.zeroSetBounds().max.x, place.x + 3.1);
  EXPECT_GE(drawn.zeroSetBounds().max.x, 41);
  AdvectOptions options;
  options.mask = {
      .field = [&](const V3d& p) { return 3 - (p - place).length(); }, .min = 0, .max = 2};
  const NarrowBand masked =
      levelset::advect(ball, constantVelocity(V3d(300, 0, 0)), 1, options).band;
  EXPECT_LE(masked.zeroSetBounds().max.x, place.x + 3.1);
  EXPECT_GE(masked.zeroSetBounds().max.x, 40.5);
}

TEST(Advect, FollowsVelocitiesThatStartAndStop) {
  const NarrowBand ball = levelset::makeSphere(10, V3d(0), 1);
  const VectorField shaken = [](const V3d&, double t) { return V3d(60 * std::cos(60 * t), 0, 0); };
  // At rest at the start, in the middle and at the end.
  const VectorField pulses = [](const V3d&, double t) {
    return V3d(60 * std::pow(std::sin(20 * kPi * t), 2), 0, 0);
  };
  // Nonzero within the first step and zero at its ends only.
  const VectorField early = [](const V3d&, double t) {
    return V3d(t < 0.0259001 ? 6000 * std::sin(415.86 * t) : 0, 0, 0);
  };
  const double shift = 6000 / 415.86 * (1 - std::cos(415.86 * 0.0259001));
  EXPECT_LE(
      surfaceError(levelset::advect(ball, early, 1).band, ballDistance(V3d(shift, 0, 0), 10)).mean,
      support::measured(0.0369));
  // At rest for most of the interval.
  const VectorField late = [](const V3d&, double t) {
    return V3d(t > 0.18 && t < 0.24 ? 1000 * std::pow(std::sin(kPi * (t - 0.18) / 0.06), 2) : 0, 0,
               0);
  };
  for (const AdvectScheme scheme : {AdvectScheme::Front, AdvectScheme::SemiLagrangian}) {
    EXPECT_NEAR(levelset::advect(ball, late, 1, {.scheme = scheme}).band.zeroSetBounds().max.x, 40,
                support::measured(0.00357));
    const bool isFront = scheme == AdvectScheme::Front;
    const NarrowBand there = levelset::advect(ball, shaken, 1, {.scheme = scheme}).band;
    EXPECT_LE(surfaceError(there, ballDistance(V3d(std::sin(60.0), 0, 0), 10)).mean,
              isFront ? support::measured(0.0105) : support::measured(0.00415));
    const NarrowBand moved = levelset::advect(ball, pulses, 1, {.scheme = scheme}).band;
    EXPECT_LE(surfaceError(moved, ballDistance(V3d(30, 0, 0), 10)).mean,
              isFront ? support::measured(0.00847) : support::measured(0.00674));
  }
}

TEST(Advect, FollowsAVelocityThatChangesAheadOfTheSurface) {
  const NarrowBand ball = levelset::makeSphere(16, V3d(0), 1);
  // A gust across the path, narrower than a step.
  const VectorField gust = [](const V3d& p, double) {
    const double x = (p.x - 25) / 1.5;
    return V3d(60, 60 * std::exp(-x * x), 0);
  };
  const NarrowBand moved = levelset::advect(ball, gust, 1).band;
  const SurfaceError error =
      surfaceError(moved, ballDistance(V3d(60, 1.5 * std::sqrt(kPi), 0), 16));
  EXPECT_LE(error.mean, support::measured(0.00607));
  EXPECT_LE(error.largest, support::measured(0.0153));
}

TEST(Advect, CorrectsTheVolumeOnlyOnRequest) {
  const NarrowBand ball = levelset::makeSphere(1, V3d(0), 0.08);
  const VectorField growth = [](const V3d& p, double) { return p * 0.1; };
  const AdvectResult grown = levelset::advect(ball, growth, 1);
  EXPECT_NEAR(volumeChange(grown), std::exp(0.3) - 1, support::measured(0.00133));
  const AdvectResult fixed = levelset::advect(ball, growth, 1, {.fixVolume = true});
  EXPECT_NEAR(levelset::measure(fixed.band).volume, fixed.volumeBefore,
              support::measured(8.42e-6) * fixed.volumeBefore);
  EXPECT_NEAR(volumeChange(fixed), std::exp(0.3) - 1, support::measured(0.00133));
}

TEST(SlowAdvect, GridSchemesTransportASphere) {
  const double h = 0.08;
  const V3d center(0.6, 0, 0);
  const NarrowBand ball = levelset::makeSphere(0.4, center, h);
  const VectorField spin = levelset::rotationVelocity(V3d(0), V3d(0, 0, 1));
  for (const AdvectScheme scheme : {AdvectScheme::SemiLagrangian, AdvectScheme::Upwind}) {
    const AdvectResult result = levelset::advect(ball, spin, 1, {.scheme = scheme});
    const SurfaceError error = surfaceError(result.band, ballDistance(center, 0.4));
    EXPECT_LT(error.mean, support::measured(0.0104)) << static_cast<int>(scheme);
    EXPECT_LT(error.largest, support::measured(0.0314)) << static_cast<int>(scheme);
    EXPECT_LT(std::abs(volumeChange(result)), support::measured(0.00323))
        << static_cast<int>(scheme);
    EXPECT_TRUE(levelset::check(result.band).passed());
  }
}

TEST(Advect, UpwindDifferencesConverge) {
  std::vector<double> errors;  // voxels
  const V3d from(0.02, 0.03, -0.01), by(0.21, 0.34, 0.13);
  for (const double resolution : {4.0, 8.0, 16.0}) {
    const NarrowBand ball = levelset::makeSphere(1, from, 1 / resolution);
    const AdvectResult result =
        levelset::advect(ball, constantVelocity(by), 1, {.scheme = AdvectScheme::Upwind});
    errors.push_back(surfaceError(result.band, ballDistance(from + by, 1)).mean);
  }
  EXPECT_LT(errors[0], support::measured(0.00965));
  EXPECT_LT(errors[2], support::measured(0.00261));
  // One order more in world units.
  EXPECT_GT(std::log2(errors[0] / errors[1]), support::measuredOrder(0.903));
  EXPECT_GT(std::log2(errors[1] / errors[2]), support::measuredOrder(0.982));
}

TEST(Advect, SemiLagrangianStepsKeepTheVolumeOfNarrowBands) {
  const VectorField spin = levelset::rotationVelocity(V3d(0), V3d(0, 0, 1));
  for (const double halfWidth : {1.0, 1.5}) {
    const NarrowBand ball =
        levelset::makeSphere(0.4, V3d(0.6, 0, 0), 0.08, {.halfWidth = halfWidth});
    const AdvectResult result =
        levelset::advect(ball, spin, 1, {.scheme = AdvectScheme::SemiLagrangian});
    EXPECT_LT(std::abs(volumeChange(result)), support::measured(0.00307)) << halfWidth;
    EXPECT_NEAR(result.band.halfWidth(), halfWidth, support::rounding(1.5));
  }
}

TEST(Advect, AnswersOnTurnedGrids) {
  NarrowBand ball = levelset::makeSphere(1, V3d(0), 0.1);
  Imath::M44d place;
  place.setAxisAngle(V3d(1, 1, 0).normalized(), 0.6);
  place[3][0] = 5;
  ball = levelset::transform(std::move(ball), place);
  for (const AdvectScheme scheme :
       {AdvectScheme::Front, AdvectScheme::SemiLagrangian, AdvectScheme::Upwind}) {
    const AdvectResult result =
        levelset::advect(ball, constantVelocity(V3d(0, 0, 0.7)), 1, {.scheme = scheme});
    EXPECT_LT(surfaceError(result.band, ballDistance(V3d(5, 0, 0.7), 1)).largest,
              support::measured(0.0227));
  }
}

TEST(Advect, EndsForDiscontinuousVelocities) {
  const double h = 0.2;
  const NarrowBand ball = levelset::makeSphere(1, V3d(0), h);
  // Away from each other, past each other, and towards each other.
  for (const char* text :
       {"x > 0 ? 1 : -1, 0, 0", "y > 0 ? 1 : -1, 0, 0", "x > 0 ? -1 : 1, 0, 0"}) {
    for (const AdvectScheme scheme : {AdvectScheme::Front, AdvectScheme::SemiLagrangian}) {
      try {
        const NarrowBand band =
            levelset::advect(ball, levelset::vectorExpression(text), 0.5, {.scheme = scheme}).band;
        EXPECT_NEAR(band.zeroSetBounds().max.z, 1, support::measured(0.28) * h) << text;
        EXPECT_LE(band.zeroSetBounds().max.x, 1.5 + h) << text;
      } catch (const levelset::Error& error) {
        EXPECT_NE(std::string(error.what()).find("; "), std::string::npos) << error.what();
      }
    }
  }
}

TEST(Front, HasFewTrianglesWhereItIsStretched) {
  // Enright's sphere at half time, where the sheet is widest and thinnest. Its number of triangles
  // is a third below the limit for a crumpled front, at any resolution.
  for (const double n : {16.0, 32.0}) {
    const NarrowBand ball = levelset::makeSphere(kEnrightRadius * n, kEnrightCenter * n, 1);
    const VectorField enrights = levelset::enrightVelocity();
    const levelset::flow::Velocity inVoxels = [&](const V3d& p, double t) {
      return enrights(p / n, t) * n;
    };
    levelset::flow::Front front(levelset::bandToMesh(ball), levelset::kNoMemoryLimit);
    (void)front.advance({.velocity = inVoxels, .from = 0, .to = 1.5, .toWorld = {}});
    const double count = static_cast<double>(front.mesh().triangles.size());
    EXPECT_LT(count / levelset::surfaceArea(front.mesh()), 36) << n;
  }
}

TEST(Advect, RefusesCrumplingByAJump) {
  const NarrowBand ball = levelset::makeSphere(1, V3d(0.01, 0.02, 0.03), 1.0 / 16);
  EXPECT_THROW(
      (void)levelset::advect(ball, levelset::vectorExpression("0, x < 0.01 ? -1 : 1, 0"), 0.25),
      levelset::ResourceLimit);
}

TEST(Advect, GivesTheSameBitsForAnyNumberOfThreads) {
  const NarrowBand ball = levelset::makeSphere(0.15, V3d(0.35), 1.0 / 32);
  for (const AdvectScheme scheme :
       {AdvectScheme::Front, AdvectScheme::SemiLagrangian, AdvectScheme::Upwind}) {
    std::uint64_t hash[2];
    for (std::size_t i = 0; i < 2; ++i)
      hash[i] = support::onThreads(i ? 4 : 1, [&] {
        return levelset::advect(ball, levelset::enrightVelocity(), 0.2, {.scheme = scheme})
            .band.contentHash();
      });
    EXPECT_EQ(hash[0], hash[1]);
  }
}

TEST(Advect, RefusesUndefinedVelocities) {
  const NarrowBand ball = levelset::makeSphere(1, V3d(0), 0.1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const AdvectScheme scheme :
       {AdvectScheme::Front, AdvectScheme::SemiLagrangian, AdvectScheme::Upwind}) {
    const AdvectOptions options{.scheme = scheme};
    EXPECT_NE(refusal<levelset::InvalidInput>([&] {
                (void)levelset::advect(ball, constantVelocity(V3d(0, nan, 0)), 1, options);
              }).find("velocity is not finite at"),
              std::string::npos);
    EXPECT_NE(refusal<levelset::ResourceLimit>([&] {
                (void)levelset::advect(ball, constantVelocity(V3d(1e9, 0, 0)), 1, options);
              }).find("shorter time"),
              std::string::npos);
  }
  // Velocities beyond the path of the surface do not matter.
  const VectorField halfSpace = [nan](const V3d& p, double) {
    return p.x < 3 ? V3d(1, 0, 0) : V3d(nan);
  };
  EXPECT_NEAR(levelset::advect(ball, halfSpace, 1.99).band.zeroSetBounds().max.x, 2.99,
              support::measured(4.43e-4));
  EXPECT_THROW((void)levelset::advect(ball, halfSpace, 2.1), levelset::InvalidInput);
  const VectorField aheadOfSteps = [nan](const V3d& p, double t) {
    return V3d(p.x < 14 ? 600 * std::sin(600 * t) : nan, 0, 0);
  };
  EXPECT_NO_THROW((void)levelset::advect(ball, aheadOfSteps, 0.1));
  // Defined from the start on, and late in a day counted in seconds.
  const VectorField fromStart = [](const V3d&, double t) { return V3d(std::sqrt(t - 0.1), 0, 0); };
  for (const AdvectScheme scheme : {AdvectScheme::Front, AdvectScheme::SemiLagrangian})
    EXPECT_NO_THROW((void)levelset::advect(ball, fromStart, 0.3, {.start = 0.1, .scheme = scheme}));
  EXPECT_NO_THROW(
      (void)levelset::advect(ball, constantVelocity(V3d(1, 0, 0)), 2e-6, {.start = 1.7e9}));
  // NaN that begins during the motion.
  EXPECT_THROW((void)levelset::advect(ball, levelset::vectorExpression("1/sqrt(0.5 - t), 0, 0"), 1),
               levelset::Error);
  EXPECT_THROW((void)levelset::advect(ball, constantVelocity(V3d(1)), nan), levelset::UsageError);
  EXPECT_THROW((void)levelset::advect(ball, constantVelocity(V3d(1)), INFINITY),
               levelset::UsageError);
  EXPECT_THROW((void)levelset::advect(NarrowBand(), constantVelocity(V3d(1)), 1),
               levelset::InvalidInput);
  EXPECT_THROW((void)levelset::advect(
                   ball, [](const V3d& p, double) { return p * -1.0; }, 8),
               levelset::InvalidInput);
  EXPECT_THROW((void)levelset::advect(ball, constantVelocity(V3d(1)), 1, {.maxMemory = 10000}),
               levelset::ResourceLimit);
  EXPECT_THROW((void)levelset::advect(ball, constantVelocity(V3d(1)), 1,
                                      {.progress = [](double f) { return f < 0.3; }}),
               levelset::Cancelled);
  EXPECT_THROW((void)levelset::rotationVelocity(V3d(0), V3d(0)), levelset::UsageError);
  EXPECT_THROW((void)levelset::enrightVelocity(0), levelset::UsageError);
}

}  // namespace advect_test
