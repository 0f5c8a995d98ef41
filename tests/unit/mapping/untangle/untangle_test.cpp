#include "mapping/untangle/untangle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "levelset/error.h"
#include "mapping/distortion/fold_certificate.h"
#include "mapping/maps/prism_map.h"
#include "mapping/placement/make_patch.h"
#include "mapping/untangle/prism_elements.h"
#include "tests/support/component_counts.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace untangle_test {

using Imath::V3d;
using levelset::NarrowBand;
using mapping::DistortionGain;
using mapping::ElementSlopes;
using mapping::FoldVerdict;
using mapping::minimiseDistortion;
using mapping::Patch;
using mapping::untangle;
using mapping::Untangling;
using support::makeSlab;
using support::patchAt;

/// Patch of 2 × 2 and height 1 on a slab.
Patch flatPatch(std::size_t columns, std::size_t layers, double scale = 1) {
  return patchAt([=](const V3d& t) { return V3d(2 * t.x - 1, 2 * t.y - 1, t.z) * scale; }, columns,
                 columns, layers, scale);
}

void expectCertified(const Patch& patch) {
  EXPECT_EQ(mapping::certifyLayers(patch, 0).verdict(), FoldVerdict::Certified);
  EXPECT_EQ(mapping::certifyPrisms(mapping::PrismMap(patch, {}), patch.mirrored).verdict(),
            FoldVerdict::Certified);
}

/// Largest distance between corresponding particles of two patches.
double farthestFrom(const Patch& a, const Patch& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.layers.size(); ++k)
    for (std::size_t n = 0; n < a.layers[k].positions.size(); ++n)
      most = std::max(most, (a.layers[k].positions[n] - b.layers[k].positions[n]).length());
  return most;
}

TEST(PrismElements, StressIsTheDerivativeOfTheEnergy) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 40; ++trial) {
    ElementSlopes f = {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
    for (V3d& column : f) column += V3d(unit(random), unit(random), unit(random)) * 0.8;
    const auto check = [&](const auto& density, double bound) {
      const mapping::ElementEnergy at = density(f);
      if (!std::isfinite(at.value)) return;
      for (std::size_t i = 0; i < 3; ++i)
        for (int axis = 0; axis < 3; ++axis) {
          ElementSlopes ahead = f, behind = f;
          ahead[i][axis] += 1e-6, behind[i][axis] -= 1e-6;
          const double slope = (density(ahead).value - density(behind).value) / 2e-6;
          EXPECT_NEAR(at.stress[i][axis], slope, bound * (1 + std::abs(slope)));
        }
    };
    if (mapping::determinantOf(f) > 0.1)
      check(mapping::symmetricDirichlet, support::measured(2.48e-9));
    for (const double epsilon : {1.0, 0.3})
      check([=](const ElementSlopes& g) { return mapping::foldoverEnergy(g, epsilon); },
            support::measured(2.48e-9));
  }
}

TEST(PrismElements, RotationsHaveNoDistortionAndFoldsAreForbidden) {
  const double c = std::cos(0.7), s = std::sin(0.7);
  const ElementSlopes turned = {V3d(c, s, 0), V3d(-s, c, 0), V3d(0, 0, 1)};
  EXPECT_NEAR(mapping::symmetricDirichlet(turned).value, 6, support::doubleRounding(25));
  for (const V3d& column : mapping::symmetricDirichlet(turned).stress)
    EXPECT_LE(column.length(), support::doubleRounding(4));
  // 2² + 1 + 1 and the reciprocals of these.
  EXPECT_NEAR(mapping::symmetricDirichlet({V3d(2, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)}).value,
              6 + 2.25, support::doubleRounding(40));
  const ElementSlopes mirrored = {V3d(-1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
  EXPECT_EQ(mapping::symmetricDirichlet(mirrored).value, std::numeric_limits<double>::infinity());
  // The other energy tends to 3 + 2 for a box, and to infinity at a fold.
  EXPECT_NEAR(mapping::foldoverEnergy(turned, 1e-9).value, 5, support::doubleRounding(20));
  EXPECT_GT(mapping::foldoverEnergy(mirrored, 1e-3).value, 1e5);
  EXPECT_TRUE(std::isfinite(mapping::foldoverEnergy(mirrored, 1e-3).value));
}

TEST(Untangle, KeepsAPatchWithoutFolds) {
  const Patch patch = flatPatch(7, 4);
  const Untangling result = untangle(makeSlab(2, 0.1), patch);
  EXPECT_EQ(result.before.folded, 0u);
  EXPECT_NEAR(result.before.leastJacobian, 1, support::doubleRounding(10));
  EXPECT_EQ(result.iterations, 0u);
  EXPECT_EQ(farthestFrom(result.patch, patch), 0);
}

TEST(Untangle, RepairsParticlesBeyondTheirNeighbours) {
  Patch patch = flatPatch(9, 4);
  patch.layers[1].positions[4 * 9 + 4] += V3d(0.9, 0.4, 0.5);
  patch.layers[3].positions[2 * 9 + 6] += V3d(-0.2, 0.6, -0.9);
  patch.layers[0].positions[3 * 9 + 3] += V3d(0.6, 0, 0);
  const NarrowBand base = makeSlab(2, 0.1);
  const Untangling result = untangle(base, patch);
  EXPECT_GT(result.before.folded, 3u);
  EXPECT_LT(result.before.leastJacobian, -0.5);
  ASSERT_TRUE(result.isUntangled());
  EXPECT_GT(result.after.leastJacobian, 0.3);
  EXPECT_GT(result.farthestMove, 0.2);
  expectCertified(result.patch);
  // The sides on the surface stay in place, and all surface particles stay on the surface.
  const mapping::ParticleLayer &surface = result.patch.layers[0], &before = patch.layers[0];
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(surface.at(i, 0), before.at(i, 0));
    EXPECT_EQ(surface.at(8, i), before.at(8, i));
  }
  for (const V3d& p : surface.positions) EXPECT_NEAR(p.z, 0, support::rounding(1));
}

TEST(Untangle, RepairsOffsetsBeyondTheMedialAxis) {
  // Above the axis of a trough of radius 1 the sides cross.
  const NarrowBand trough = support::sampleBand(
      [](const V3d& p) { return std::max(1 - std::hypot(p.y, p.z + 1e-9), -0.5); },
      {V3d(-1, -1, -1), V3d(1, 1, 1)}, 0.05);
  const Patch patch = patchAt(
      [](const V3d& t) {
        const double angle = 1.5 * (t.y - 0.5), r = 1 - 1.4 * t.z;
        return V3d(t.x - 0.5, r * std::sin(angle), -r * std::cos(angle));
      },
      7, 9, 5, 1.4);
  const Untangling result = untangle(trough, patch);
  EXPECT_GT(result.before.folded, 40u);
  ASSERT_TRUE(result.isUntangled());
  EXPECT_GT(result.after.leastJacobian, 0.05);
  expectCertified(result.patch);
  for (const V3d& p : result.patch.layers[0].positions)
    EXPECT_NEAR(std::hypot(p.y, p.z), 1, support::measured(3.54e-6));
}

TEST(Untangle, ReportsWhereItFails) {
  // Two fixed sides cross on the surface itself.
  const auto crossed = [](const V3d& t) {
    return V3d((2 * t.x - 1) * (1 - 2 * t.y), 2 * t.y - 1, t.z);
  };
  const Patch patch = patchAt(crossed, 5, 6, 3);
  const NarrowBand base = makeSlab(2, 0.1);
  const Untangling result = untangle(base, patch, {.mostIterations = 200});
  EXPECT_FALSE(result.isUntangled());
  EXPECT_GT(result.after.folded, 0u);
  EXPECT_LE(result.after.folded, result.before.folded);
  EXPECT_EQ(mapping::countFolds(result.patch).folded, result.after.folded);
}

TEST(Untangle, HandlesCellsWithoutVolumeAndClockwisePatches) {
  const NarrowBand base = makeSlab(2, 0.1);
  // The complete top layer coincides with the layer below.
  Patch flat = flatPatch(5, 3);
  flat.layers[2].positions = flat.layers[1].positions;
  const Untangling raised = untangle(base, flat);
  EXPECT_EQ(raised.before.folded, 16u);
  EXPECT_TRUE(raised.isUntangled());
  expectCertified(raised.patch);

  Patch clockwise =
      patchAt([](const V3d& t) { return V3d(1 - 2 * t.x, 2 * t.y - 1, t.z); }, 6, 6, 3);
  clockwise.mirrored = true;
  EXPECT_EQ(mapping::countFolds(clockwise).folded, 0u);
  clockwise.layers[1].positions[2 * 6 + 2] += V3d(0.7, 0.5, 0);
  const Untangling mended = untangle(base, clockwise);
  EXPECT_GT(mended.before.folded, 0u);
  EXPECT_TRUE(mended.isUntangled());
  expectCertified(mended.patch);

  Patch smallest = flatPatch(2, 2);
  std::swap(smallest.layers[1].positions[0], smallest.layers[1].positions[3]);
  std::swap(smallest.layers[1].positions[1], smallest.layers[1].positions[2]);
  const Untangling turned = untangle(base, smallest);
  EXPECT_EQ(turned.before.folded, 1u);
  EXPECT_TRUE(turned.isUntangled());
}

TEST(Untangle, RimsFollowTheirNeighbours) {
  // If untangling moves a patch with rims, the rims move with it.
  const NarrowBand base = support::makeBall(2, 0.1);
  Patch patch = mapping::makePatch(base, support::cap(0.5, 2), 0.5, {.spacing = 0.3}).patch;
  ASSERT_TRUE(patch.layers[3].hasRim());
  const std::size_t columns = patch.layers[3].columns;
  patch.layers[3].positions[2 * columns + 1] += V3d(0.5, 0.4, 0);
  const Untangling result = untangle(base, patch);
  ASSERT_TRUE(result.isUntangled());
  for (std::size_t k = 0; k < patch.layers.size(); ++k) {
    const mapping::ParticleLayer &layer = result.patch.layers[k], &old = patch.layers[k];
    const int rows = static_cast<int>(layer.rows);
    for (int j = 0; j < rows; ++j) {
      const V3d expected = old.beyond(-1, j) + (layer.beyond(0, j) - old.beyond(0, j)) * 2.0 -
                           (layer.beyond(1, j) - old.beyond(1, j));
      EXPECT_LE((layer.beyond(-1, j) - expected).length(),
                k == 0 ? support::measured(0.00454) : support::doubleRounding(4));
    }
  }
}

TEST(Untangle, SameBitsForAnyNumberOfThreadsAndScale) {
  const auto run = [](double scale) {
    Patch patch = flatPatch(6, 3, scale);
    patch.layers[1].positions[14] += V3d(0.8, 0.3, 0.1) * scale;
    return untangle(makeSlab(2 * scale, 0.1 * scale), patch).patch;
  };
  const Patch one = support::onThreads(1, [&] { return run(1); });
  const Patch three = support::onThreads(3, [&] { return run(1); });
  EXPECT_EQ(farthestFrom(one, three), 0);
  // Powers of two change no bit of a mantissa.
  Patch large = run(1024);
  for (auto& layer : large.layers)
    for (V3d& p : layer.positions) p /= 1024;
  EXPECT_LE(farthestFrom(one, large), support::doubleRounding(4));
}

TEST(MinimiseDistortion, KeepsIsometries) {
  const Patch patch = flatPatch(8, 4);
  const DistortionGain result = minimiseDistortion(makeSlab(2, 0.1), patch);
  EXPECT_NEAR(result.before.mean, 6, support::measured(1.32e-13));
  EXPECT_EQ(farthestFrom(result.patch, patch), 0);
  // The surface of a cylinder, with an offset layer so thin that its top is almost isometric too.
  const double height = 1e-3;
  const NarrowBand rod = support::sampleBand([](const V3d& p) { return std::hypot(p.x, p.z) - 1; },
                                             {V3d(-1, -1, -1), V3d(1, 1, 1)}, 0.05);
  const Patch bent = patchAt(
      [=](const V3d& t) {
        const double angle = 1.2 * (t.x - 0.5), r = 1 + height * t.z;
        return V3d(r * std::sin(angle), t.y - 0.5, r * std::cos(angle));
      },
      13, 9, 3, height);
  const DistortionGain thin = minimiseDistortion(rod, bent);
  // Chords of twelve cells are inclined to the perpendicular direction by a twenty-fourth of the
  // angle.
  EXPECT_NEAR(thin.before.mean, 6 + 2 * 0.05 * 0.05, support::measured(6.59e-6));
  EXPECT_LE(thin.after.mean, thin.before.mean);
  for (std::size_t n = 0; n < bent.layers[0].positions.size(); ++n)
    EXPECT_LE((thin.patch.layers[0].positions[n] - bent.layers[0].positions[n]).length(),
              support::rounding(1) * height);
}

TEST(MinimiseDistortion, ADistortedPlaneBecomesUniformAgain) {
  const Patch uniform = flatPatch(9, 4);
  Patch distorted = uniform;
  for (auto& layer : distorted.layers)
    for (V3d& p : layer.positions) {
      const double inside = (1 - p.x * p.x) * (1 - p.y * p.y);
      p += V3d(0.25 * inside * std::cos(2 * p.y), 0.2 * inside * std::sin(3 * p.x), 0);
    }
  const NarrowBand base = makeSlab(2, 0.1);
  const DistortionGain result = minimiseDistortion(base, distorted);
  EXPECT_GT(result.before.mean, 6.1);
  EXPECT_LE(result.after.mean, 6 + 1e-5);
  EXPECT_LE(result.after.most, 6 + 1e-3);
  EXPECT_LE(farthestFrom(result.patch, uniform), support::measured(0.00123));
  EXPECT_NEAR(result.farthestMove, farthestFrom(result.patch, distorted),
              support::doubleRounding(4));
}

TEST(MinimiseDistortion, TheEnergyNeverIncreases) {
  const NarrowBand base = support::makeBall(2, 0.1);
  const Patch patch = mapping::makePatch(base, support::cap(0.6, 2), 1, {.spacing = 0.3}).patch;
  double last = HUGE_VAL;
  for (const std::size_t iterations : {0u, 1u, 2u, 4u, 8u, 16u}) {
    const DistortionGain result = minimiseDistortion(base, patch, {.mostIterations = iterations});
    EXPECT_LE(result.after.mean, result.before.mean);
    EXPECT_LT(result.after.mean, last) << iterations;
    last = result.after.mean;
    EXPECT_EQ(mapping::countFolds(result.patch).folded, 0u);
  }
}

TEST(MinimiseDistortion, ImprovesACap) {
  // A patch with half the height of the ball's radius over a cap of 0.6 loses three fifths of its
  // distortion.
  const NarrowBand base = support::makeBall(2, 0.1);
  const Patch patch =
      mapping::makePatch(base, support::cap(0.6, 2), 1, {.layers = 4, .spacing = 0.4}).patch;
  const DistortionGain fixed = minimiseDistortion(base, patch);
  const DistortionGain free = minimiseDistortion(base, patch, {.freeSides = true});
  EXPECT_LE(fixed.after.mean - 6, support::measured(0.144) * (fixed.before.mean - 6));
  EXPECT_LE(free.after.mean, fixed.after.mean + 1e-6);
  EXPECT_LT(fixed.after.percent99, fixed.before.percent99);
  expectCertified(fixed.patch);
  expectCertified(free.patch);
  for (const Patch* relaxed : {&fixed.patch, &free.patch})
    for (const V3d& p : relaxed->layers[0].positions)
      EXPECT_NEAR(p.length(), 2, support::measured(6.02e-6));
}

TEST(MinimiseDistortion, ImprovesOverACreaseAndStaysOnBothSides) {
  // The crease lies between rows of particles.
  const auto corner = [](const V3d& p) {
    const double x = p.x, z = p.z;
    return x > 0 && z > 0 ? std::hypot(x, z) : std::max(x, z);
  };
  const NarrowBand base =
      support::sampleBand(corner, {V3d(-1.5, -1, -1.5), V3d(0.5, 1, 0.5)}, 0.05);
  const Patch patch =
      mapping::makePatch(
          base, {V3d(-0.6, -0.6, 0), V3d(0, -0.6, -0.6), V3d(0, 0.6, -0.6), V3d(-0.6, 0.6, 0)}, 0.4,
          {.layers = 4, .spacing = 0.1})
          .patch;
  const DistortionGain result = minimiseDistortion(base, patch);
  EXPECT_LT(result.after.mean - 6, support::measured(0.454, 0.6) * (result.before.mean - 6));
  expectCertified(result.patch);
  for (const V3d& p : result.patch.layers[0].positions)
    EXPECT_NEAR(corner(p), 0, support::measured(0.00158));
}

TEST(MinimiseDistortion, KeepsTheSidesOfThinEars) {
  // A plate three voxels thick. Its other side is nearer than the next particle.
  const auto plate = [](const V3d& p) {
    const V3d d(std::abs(p.x) - 5, std::abs(p.y) - 5, std::abs(p.z) - 0.375);
    return std::max({d.x, d.y, d.z});
  };
  const NarrowBand base = support::sampleBand(plate, {V3d(-5, -5, -0.375), V3d(5, 5, 0.375)}, 0.25);
  Patch patch =
      patchAt([](const V3d& t) { return V3d(9 * t.x - 4.5, 9 * t.y - 4.5, 0.375 + 1.5 * t.z); }, 7,
              7, 3, 1.5);
  patch.layers[0].positions[3 * 7 + 3] += V3d(2.2, 0.4, 0);
  const Untangling mended = untangle(base, patch);
  EXPECT_GT(mended.before.folded, 0u);
  ASSERT_TRUE(mended.isUntangled());
  const DistortionGain relaxed = minimiseDistortion(base, mended.patch);
  EXPECT_LE(relaxed.after.mean, 6 + 1e-4);
  for (const Patch* found : {&mended.patch, &relaxed.patch})
    for (const V3d& p : found->layers[0].positions) EXPECT_NEAR(p.z, 0.375, support::rounding(1));
}

TEST(MinimiseDistortion, DependsOnNeitherScaleNorThreads) {
  const NarrowBand base = makeSlab(2, 0.1);
  const Patch patch = flatPatch(7, 3);
  // Only proportions matter. The patch's own proportions count as zero distortion.
  for (const double scale : {0.01, 100.0}) {
    const DistortionGain same =
        minimiseDistortion(base, patch, {.proportions = V3d(2, 2, 1) * scale});
    EXPECT_NEAR(same.before.mean, 6, support::doubleRounding(150));
    EXPECT_LE(farthestFrom(same.patch, patch), support::rounding(1));
  }
  // A texture twice as high moves the top up.
  const DistortionGain higher = minimiseDistortion(base, patch, {.proportions = V3d(2, 2, 2)});
  EXPECT_LT(higher.after.mean, higher.before.mean);
  EXPECT_GT(higher.patch.layers[2].at(3, 3).z, 1.2);

  const auto run = [](double scale) {
    Patch wavy = flatPatch(7, 3, scale);
    wavy.layers[1].positions[24] += V3d(0.1, 0.05, 0.1) * scale;
    return minimiseDistortion(makeSlab(2 * scale, 0.1 * scale), wavy);
  };
  const DistortionGain one = support::onThreads(1, [&] { return run(1); });
  const DistortionGain three = support::onThreads(3, [&] { return run(1); });
  EXPECT_EQ(farthestFrom(one.patch, three.patch), 0);
  EXPECT_EQ(one.after.mean, three.after.mean);
  EXPECT_NEAR(run(1e-5).after.mean, one.after.mean, support::doubleRounding(60));
  EXPECT_NEAR(run(1e5).after.mean, one.after.mean, support::doubleRounding(50));
}

TEST(MinimiseDistortion, RefusesInvalidPatches) {
  const NarrowBand base = makeSlab(2, 0.1);
  Patch folded = flatPatch(5, 3);
  folded.layers[1].positions[12] += V3d(1, 1, 0);
  EXPECT_THROW((void)minimiseDistortion(base, folded), levelset::InvalidInput);
  EXPECT_THROW((void)minimiseDistortion(base, {}), levelset::InvalidInput);
  const Patch patch = flatPatch(5, 3);
  EXPECT_THROW((void)minimiseDistortion(makeSlab(2, 0.1, 0.5), patch), levelset::InvalidInput);
  EXPECT_THROW((void)minimiseDistortion(base, patch, {.embedDepth = std::nan("")}),
               levelset::UsageError);
  EXPECT_THROW((void)minimiseDistortion(base, patch, {.proportions = V3d(1, 1, 0)}),
               levelset::UsageError);
  EXPECT_THROW((void)minimiseDistortion(base, patch, {.maxMemory = 1000}), levelset::ResourceLimit);
  Patch broken = patch;
  broken.layers[2].positions[3].x = std::nan("");
  EXPECT_THROW((void)untangle(base, broken), levelset::InvalidInput);
  Patch mended = folded;
  EXPECT_THROW((void)untangle(base, mended, {.progress = [](double) { return false; }}),
               levelset::Cancelled);
}

}  // namespace untangle_test
