#include "mapping/placement/make_patch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "mapping/surface/geodesic.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"

namespace patch_test {

using Imath::V3d;
using levelset::NarrowBand;
using mapping::makePatch;
using mapping::ParticleLayer;
using mapping::PatchResult;
using support::cap;

constexpr double kVoxel = 0.05;

/// Band with distances up to `reach` everywhere in the box, as redistancing computes for patch
/// space.
NarrowBand wideBand(const std::function<double(const V3d&)>& phi, const Imath::Box3d& box,
                    double reach, double voxel = kVoxel) {
  return support::sampleBand(phi, box, voxel, reach / voxel);
}

NarrowBand sphere(double reach = 0.8) {
  return wideBand([](const V3d& p) { return p.length() - 1; }, {V3d(-1), V3d(1)}, reach);
}

NarrowBand slab(double reach = 1) {
  return wideBand([](const V3d& p) { return p.z; }, {V3d(-2, -2, -0.5), V3d(2, 2, 0.5)}, reach,
                  0.1);
}

TEST(Patch, IsALatticeOnAPlane) {
  const PatchResult result =
      makePatch(slab(), {V3d(-1, -0.5, 0), V3d(1, -0.5, 0), V3d(1, 0.5, 0), V3d(-1, 0.5, 0)}, 0.6,
                {.layers = 4});
  ASSERT_EQ(result.patch.layers.size(), 4u);
  for (const ParticleLayer& layer : result.patch.layers) {
    EXPECT_NEAR(layer.height, 0.6 * layer.w, support::doubleRounding(4));
    for (std::size_t j = 0; j < layer.rows; ++j)
      for (std::size_t i = 0; i < layer.columns; ++i) {
        const V3d p = layer.at(i, j);
        EXPECT_NEAR(p.x, -1 + 2.0 * static_cast<double>(i) / static_cast<double>(layer.columns - 1),
                    support::doubleRounding(15) * 0.1);
        EXPECT_NEAR(p.y, -0.5 + static_cast<double>(j) / static_cast<double>(layer.rows - 1),
                    support::doubleRounding(5) * 0.1);
        EXPECT_NEAR(p.z, layer.height, support::doubleRounding(25) * 0.1);
      }
  }
  EXPECT_NEAR(result.report.uLength, 2, support::rounding(2));
  EXPECT_NEAR(result.report.vLength, 1, support::rounding(1));
  EXPECT_LT(result.report.cellAreaVariation, support::rounding(0.6));
  EXPECT_TRUE(result.report.isRelaxed);
  EXPECT_LE(result.patch.particleCount(), 2600u);
}

/// Expects that all four sides of a layer are great circles about a ball's centre, with equal
/// steps.
void expectEvenGreatCircles(const ParticleLayer& layer) {
  std::array<std::vector<V3d>, 4> sides;
  for (std::size_t i = 0; i < layer.columns; ++i) {
    sides[0].push_back(layer.at(i, 0));
    sides[1].push_back(layer.at(i, layer.rows - 1));
  }
  for (std::size_t j = 0; j < layer.rows; ++j) {
    sides[2].push_back(layer.at(0, j));
    sides[3].push_back(layer.at(layer.columns - 1, j));
  }
  for (const std::vector<V3d>& side : sides) {
    const V3d pole = side.front().cross(side.back()).normalized();
    double least = HUGE_VAL, largest = 0;
    for (std::size_t n = 0; n < side.size(); ++n) {
      EXPECT_NEAR(side[n].dot(pole), 0, support::measured(2.22e-4) * kVoxel) << "layer " << layer.w;
      if (n == 0) continue;
      const V3d a = side[n - 1].normalized(), b = side[n].normalized();
      const double step = std::atan2(a.cross(b).length(), a.dot(b));
      least = std::min(least, step), largest = std::max(largest, step);
    }
    EXPECT_GE(least, 0.99 * largest) << "layer " << layer.w;
  }
}

TEST(Patch, LayersOnASphereAreConcentricAndSymmetric) {
  const PatchResult result = makePatch(sphere(), cap(0.6), 0.5, {.layers = 4, .spacing = 0.09});
  EXPECT_FALSE(result.patch.mirrored);
  for (const ParticleLayer& layer : result.patch.layers) {
    ASSERT_EQ(layer.rows, layer.columns);  // a quarter turn maps the grid to itself
    for (std::size_t j = 0; j < layer.rows; ++j)
      for (std::size_t i = 0; i < layer.columns; ++i) {
        const V3d p = layer.at(i, j);
        EXPECT_NEAR(p.length() - 1, layer.height, support::measured(8.76e-5) * kVoxel);
        const V3d mirrored = layer.at(layer.columns - 1 - i, j);
        EXPECT_LT((p - V3d(-mirrored.x, mirrored.y, mirrored.z)).length(),
                  support::measured(6.5e-5) * kVoxel);
        const V3d turned = layer.at(layer.rows - 1 - j, i);
        EXPECT_LT((p - V3d(turned.y, -turned.x, turned.z)).length(),
                  support::measured(6.5e-5) * kVoxel);
      }
    expectEvenGreatCircles(layer);
  }
  const double angle = std::acos(V3d(cap(0.6)[0]).dot(cap(0.6)[1]));
  EXPECT_NEAR(result.report.uLength, angle, support::measured(1.1e-4) * angle);
  EXPECT_NEAR(result.report.vLength, angle, support::measured(1.1e-4) * angle);
}

TEST(Patch, RelaxationEvensTheCells) {
  const PatchResult result = makePatch(sphere(), cap(0.7), 0.3, {.layers = 2, .spacing = 0.08});
  EXPECT_TRUE(result.report.isRelaxed);
  EXPECT_LT(result.report.cellAreaVariation, support::measured(0.039));
}

TEST(Patch, KeepsDensityFromLayerToLayer) {
  const PatchResult result = makePatch(sphere(), cap(0.6), 0.6, {.layers = 3, .spacing = 0.08});
  const ParticleLayer &low = result.patch.layers.front(), &high = result.patch.layers.back();
  EXPECT_GT(high.columns, low.columns);
  EXPECT_NEAR(static_cast<double>(high.columns - 1) / static_cast<double>(low.columns - 1), 1.6,
              support::rounding(2));
  EXPECT_NEAR(result.patch.spacing, 0.08, support::measured(0.00703, 0.01));
}

TEST(Patch, SidesRunOverAnEdge) {
  // Two corners on top of a box, two on its side. The sides go over the edge, not through the box.
  const auto box = [](const V3d& p) {
    const V3d d(std::abs(p.x) - 1, std::abs(p.y) - 1, std::abs(p.z) - 1);
    const V3d out(std::max(d.x, 0.0), std::max(d.y, 0.0), std::max(d.z, 0.0));
    return out.length() + std::min(std::max({d.x, d.y, d.z}), 0.0);
  };
  const NarrowBand band = wideBand(box, {V3d(-1), V3d(1)}, 0.7);
  const PatchResult result =
      makePatch(band, {V3d(-0.5, -0.4, 1), V3d(1, -0.4, 0.5), V3d(1, 0.4, 0.5), V3d(-0.5, 0.4, 1)},
                0.3, {.layers = 3, .spacing = 0.1});
  EXPECT_NEAR(result.report.uLength, 2, support::measured(0.00313));
  EXPECT_NEAR(result.report.vLength, 0.8, support::rounding(1));
  // The zero set of the tricubic interpolant has a bead of height 0.1012 voxel along an edge.
  for (const V3d& p : result.patch.layers.front().positions)
    EXPECT_LT(std::abs(box(p)), support::measured(0.101, 0.1015) * kVoxel);
}

TEST(Patch, ProjectsCornersFromFarAway) {
  // The band has three voxels, the corners are twelve voxels off.
  const NarrowBand thin = sphere(3 * kVoxel);
  const V3d far(0.2, 0.3, 1.5);
  const auto corners = mapping::cornersAround(thin, far, 0.3, 0.2);
  V3d middle(0);
  for (const V3d& c : corners) {
    EXPECT_NEAR(c.length(), 1, support::measured(2.82e-5) * kVoxel);
    middle += c * 0.25;
  }
  EXPECT_LT((middle.normalized() - far.normalized()).length(), support::measured(9.08e-4) * kVoxel);
  EXPECT_THROW((void)mapping::cornersAround(thin, V3d(0, 0, 9), 0.3, 0.2), levelset::InvalidInput);
}

TEST(Patch, CornersAroundAPointHaveTheRequestedSize) {
  const NarrowBand band = slab(0.3);
  const auto straight = mapping::cornersAround(band, V3d(0.1, 0.2, 0.05), 1, 0.6);
  EXPECT_LT((straight[0] - V3d(-0.4, -0.1, 0)).length(), support::doubleRounding(5) * 0.1);
  EXPECT_LT((straight[2] - V3d(0.6, 0.5, 0)).length(), support::doubleRounding(15) * 0.1);
  const auto turned =
      mapping::cornersAround(band, V3d(0.1, 0.2, 0.05), 1, 0.6, std::acos(-1.0) / 2);
  EXPECT_LT((turned[0] - V3d(0.4, -0.3, 0)).length(), support::doubleRounding(4) * 0.1);
  EXPECT_THROW((void)mapping::cornersAround(band, V3d(0), 0, 1), levelset::UsageError);
  EXPECT_THROW((void)mapping::cornersAround(band, V3d(0), 1, 1, NAN), levelset::UsageError);
}

TEST(Patch, RefusesCornersThatRunClockwise) {
  const NarrowBand band = slab();
  const std::array<V3d, 4> clockwise = {V3d(-1, -0.5, 0), V3d(-1, 0.5, 0), V3d(1, 0.5, 0),
                                        V3d(1, -0.5, 0)};
  EXPECT_THROW((void)makePatch(band, clockwise, 0.3), levelset::UsageError);
  const std::string message =
      support::refusal<levelset::UsageError>([&] { (void)makePatch(band, clockwise, 0.3); });
  EXPECT_NE(message.find("\"-1,-0.5,0 1,-0.5,0 1,0.5,0 -1,0.5,0\""), std::string::npos) << message;
  const PatchResult mirrored = makePatch(band, clockwise, 0.3, {.layers = 2, .mirror = true});
  EXPECT_TRUE(mirrored.patch.mirrored);
}

TEST(Patch, RefusesInvalidCorners) {
  const NarrowBand band = slab();
  const std::array<V3d, 4> sound = {V3d(-1, -0.5, 0), V3d(1, -0.5, 0), V3d(1, 0.5, 0),
                                    V3d(-1, 0.5, 0)};
  for (const double height : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity()})
    EXPECT_THROW((void)makePatch(band, sound, height), levelset::UsageError);
  EXPECT_THROW((void)makePatch(band, sound, 0.3, {.layers = 1}), levelset::UsageError);
  EXPECT_THROW((void)makePatch(band, sound, 0.3, {.spacing = -1}), levelset::UsageError);
  EXPECT_THROW((void)makePatch(band, sound, 0.3, {.spacing = 1e-7}), levelset::ResourceLimit);

  std::array<V3d, 4> twice = sound;
  twice[2] = twice[1];
  EXPECT_THROW((void)makePatch(band, twice, 0.3), levelset::InvalidInput);
  std::array<V3d, 4> straight = sound;
  straight[2] = V3d(0.5, -0.5, 0), straight[3] = V3d(-0.5, -0.5, 0);
  EXPECT_THROW((void)makePatch(band, straight, 0.3), levelset::InvalidInput);
  std::array<V3d, 4> far = sound;
  far[0] = V3d(-90, -80, 70);
  EXPECT_THROW((void)makePatch(band, far, 0.3), levelset::InvalidInput);
  std::array<V3d, 4> nan = sound;
  nan[3].x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)makePatch(band, nan, 0.3), levelset::UsageError);
  EXPECT_THROW((void)makePatch(NarrowBand(), sound, 0.3), levelset::InvalidInput);
}

TEST(Patch, RefusesCornersOnSeparateComponents) {
  const NarrowBand two = wideBand(
      [](const V3d& p) {
        return std::min((p - V3d(-0.8, 0, 0)).length(), (p - V3d(0.8, 0, 0)).length()) - 0.5;
      },
      {V3d(-1.3, -0.5, -0.5), V3d(1.3, 0.5, 0.5)}, 0.15);
  const std::array<V3d, 4> across = {V3d(-0.8, -0.3, 0.4), V3d(0.8, -0.3, 0.4), V3d(0.8, 0.3, 0.4),
                                     V3d(-0.8, 0.3, 0.4)};
  EXPECT_THROW((void)makePatch(two, across, 0.1), levelset::InvalidInput);
}

TEST(Patch, RefusesHeightsBeyondTheMedialAxis) {
  // In a trough of radius 1 no point is farther from the wall than 1.
  const NarrowBand trough = wideBand([](const V3d& p) { return 1 - std::hypot(p.y, p.z); },
                                     {V3d(-1, -1, -1), V3d(1, 1, 1)}, 1.3);
  const double y = 0.5, z = -std::sqrt(0.75);
  const std::array<V3d, 4> corners = {V3d(-0.5, -y, z), V3d(0.5, -y, z), V3d(0.5, y, z),
                                      V3d(-0.5, y, z)};
  EXPECT_NO_THROW((void)makePatch(trough, corners, 0.5, {.layers = 3, .spacing = 0.15}));
  EXPECT_THROW((void)makePatch(trough, corners, 1.15, {.layers = 3, .spacing = 0.15}),
               levelset::InvalidInput);
}

TEST(Patch, SidesPassThroughTheGivenPoints) {
  const std::array<V3d, 4> corners = {V3d(-1, -0.5, 0), V3d(1, -0.5, 0), V3d(1, 0.5, 0),
                                      V3d(-1, 0.5, 0)};
  mapping::PatchOptions options{.layers = 2, .spacing = 0.1};
  options.sides[0] = {V3d(0, -1, 0.3)};  // beside the surface; it is projected
  options.sides[1] = {V3d(1.3, -0.2, 0), V3d(1.3, 0.2, 0)};
  const PatchResult result = makePatch(slab(), corners, 0.4, options);
  for (const ParticleLayer& layer : result.patch.layers) {
    const V3d tip(0, -1, layer.height);
    double nearest = 9;
    for (std::size_t i = 0; i < layer.columns; ++i) {
      const V3d p = layer.at(i, 0);
      EXPECT_NEAR(p.y, -1 + 0.5 * std::abs(p.x), support::doubleRounding(1.5));
      nearest = std::min(nearest, (p - tip).length());
    }
    EXPECT_LT(nearest, support::measured(0.0532, 0.06));
    for (std::size_t j = 0; j < layer.rows; ++j) {
      const V3d p = layer.at(layer.columns - 1, j);
      EXPECT_NEAR(p.x, 1 + std::min(0.3, 0.5 - std::abs(p.y)), support::doubleRounding(1.5));
    }
  }
  EXPECT_NEAR(result.report.vLength, 0.5 * (1 + 0.4 + 2 * std::hypot(0.3, 0.3)),
              support::doubleRounding(1.5));
  options.sides[2] = {V3d(1, 0.5, 0)};  // the end of the side
  EXPECT_THROW((void)makePatch(slab(), corners, 0.4, options), levelset::InvalidInput);
  options.sides[2] = {V3d(NAN, 0, 0)};
  EXPECT_THROW((void)makePatch(slab(), corners, 0.4, options), levelset::UsageError);
}

TEST(Patch, WrapsAThinEar) {
  // A plate of six voxels with a round edge: two corners above, two below.
  const double half = 0.15;
  const NarrowBand plate =
      wideBand([=](const V3d& p) { return V3d(std::max(0.0, p.x - 1), 0, p.z).length() - half; },
               {V3d(-1.5, -1.5, -half), V3d(1.2, 1.5, half)}, 0.4);
  const PatchResult result = makePatch(
      plate,
      {V3d(0.4, -0.4, half), V3d(0.4, -0.4, -half), V3d(0.4, 0.4, -half), V3d(0.4, 0.4, half)}, 0.2,
      {.layers = 2, .spacing = 0.1});
  EXPECT_NEAR(result.report.uLength, 1.2 + std::acos(-1.0) * half, support::measured(6.76e-4));
  EXPECT_NEAR(result.report.vLength, 0.8, support::rounding(1));
  EXPECT_TRUE(std::any_of(result.patch.layers[1].positions.begin(),
                          result.patch.layers[1].positions.end(),
                          [](const V3d& p) { return p.x > 1.3; }));
}

TEST(Patch, HasTheRequestedNumberOfCells) {
  const PatchResult result = makePatch(sphere(), cap(0.6), 0.4, {.layers = 3, .cells = {7, 5}});
  for (const ParticleLayer& layer : result.patch.layers) {
    EXPECT_EQ(layer.columns, 8u);
    EXPECT_EQ(layer.rows, 6u);
  }
  EXPECT_THROW((void)makePatch(sphere(), cap(0.6), 0.4, {.cells = {7, 0}}), levelset::UsageError);
}

TEST(Patch, StopsWhenCancelled) {
  EXPECT_THROW(
      (void)makePatch(slab(), {V3d(-1, -0.5, 0), V3d(1, -0.5, 0), V3d(1, 0.5, 0), V3d(-1, 0.5, 0)},
                      0.3, {.progress = [](double) { return false; }}),
      levelset::Cancelled);
}

}  // namespace patch_test
