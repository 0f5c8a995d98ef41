#include "levelset/grids/sample.h"

#include <gtest/gtest.h>

#include <cmath>

#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace sample_test {

using namespace levelset;
using Imath::V3d;

/// A rotation, a scaling by h and a translation, so that index and world space differ in every way
/// a band permits.
Imath::M44d skewedPlacement(double h) {
  Imath::M44d scale, turn, move;
  scale.setScale(h);
  turn.setEulerAngles(V3d(0.3, -0.7, 1.1));
  move.setTranslation(V3d(5, -3, 2));
  return scale * turn * move;
}

/// Cube about the index origin in which every grid point is active and samples `phi`.
NarrowBand sampleCube(const std::function<double(const V3d&)>& phi, const Imath::M44d& placement) {
  const auto transform =
      openvdb::math::Transform::createLinearTransform(openvdb::math::Mat4d(&placement[0][0]));
  const auto grid = emptyLevelSet(transform, 1000);
  for (const openvdb::Coord& c : openvdb::CoordBBox(openvdb::Coord(-14), openvdb::Coord(14))) {
    const auto value = static_cast<float>(phi(toImath(grid->indexToWorld(c))));
    grid->tree().setValueOn(c, value);
  }
  return makeBand(grid);
}

std::vector<V3d> probes(const Imath::M44d& placement) {
  std::vector<V3d> result;
  for (double x = -9.9; x < 10; x += 2.73)
    for (double y = -9.8; y < 10; y += 3.1)
      for (double z = -9.7; z < 10; z += 2.87) result.push_back(V3d(x, y, z) * placement);
  return result;
}

TEST(Sample, TrilinearReproducesPlanes) {
  const double h = 0.25;
  const V3d slope(0.2, -0.5, 0.8);
  const Imath::M44d placement = skewedPlacement(h);
  const NarrowBand band = sampleCube([&](const V3d& p) { return (slope ^ p) + 0.1; }, placement);
  const BandSampler sampler(band);
  for (const V3d& p : probes(placement)) {
    EXPECT_NEAR(sampler.value(p), (slope ^ p) + 0.1, support::rounding(8) * h);
    EXPECT_NEAR((sampler.gradient(p) - slope).length(), 0, support::measured(1.51e-6));
    EXPECT_NEAR((sampler.normal(p) - slope.normalized()).length(), 0, support::measured(1.55e-6));
    EXPECT_TRUE(sampler.isInBand(p));
  }
}

TEST(Sample, TricubicReproducesQuadrics) {
  const Imath::M44d placement = skewedPlacement(0.5);
  const auto phi = [](const V3d& p) {
    const V3d q = p - V3d(5, -3, 2);
    return 0.1 * q.x * q.x - 0.2 * q.y * q.z + 0.15 * q.z * q.z + 0.3 * q.x * q.y - q.x;
  };
  const auto slope = [](const V3d& p) {
    const V3d q = p - V3d(5, -3, 2);
    return V3d(0.2 * q.x + 0.3 * q.y - 1, -0.2 * q.z + 0.3 * q.x, -0.2 * q.y + 0.3 * q.z);
  };
  const BandSampler cubic(sampleCube(phi, placement), Interpolation::Tricubic);
  for (const V3d& p : probes(placement)) {
    EXPECT_NEAR(cubic.value(p), phi(p), support::rounding(10));
    EXPECT_NEAR((cubic.gradient(p) - slope(p)).length(), 0, support::measured(2.57e-6));
  }
}

TEST(Sample, GradientIsTheDerivativeOfTheValue) {
  const Imath::M44d placement = skewedPlacement(0.5);
  const NarrowBand band =
      sampleCube([](const V3d& p) { return std::sin(p.x) + p.y * p.z; }, placement);
  for (const Interpolation method : {Interpolation::Trilinear, Interpolation::Tricubic}) {
    const BandSampler sampler(band, method);
    for (const V3d& p : probes(placement)) {
      const V3d slope = sampler.gradient(p);
      for (int axis = 0; axis < 3; ++axis) {
        V3d step(0);
        step[axis] = 1e-6;
        const double difference = (sampler.value(p + step) - sampler.value(p - step)) / 2e-6;
        EXPECT_NEAR(slope[axis], difference, support::measured(1.07e-8));
      }
    }
  }
}

TEST(Sample, ConvergesInThirdOrderOnASphere) {
  double previous = 0;
  for (const int resolution : {12, 24, 48}) {
    const double h = 1.0 / resolution;
    const NarrowBand band =
        support::sampleBand([](const V3d& p) { return p.length() - 1; }, {V3d(-1), V3d(1)}, h, 4);
    const BandSampler sampler(band, Interpolation::Tricubic);
    double worst = 0;
    for (int i = 0; i < 500; ++i) {
      const double u = std::acos(1 - 2 * (i + 0.5) / 500), v = 2.399963 * i;
      const V3d p(std::sin(u) * std::cos(v), std::sin(u) * std::sin(v), std::cos(u));
      ASSERT_TRUE(sampler.isInBand(p));
      worst = std::max(worst, std::abs(sampler.value(p)));
      EXPECT_LT((sampler.normal(p) - p).length(), support::measured(0.038) * h * h);
    }
    if (previous > 0) {
      EXPECT_GT(std::log2(previous / worst), support::measuredOrder(2.93, 2.8)) << "h = " << h;
    }
    previous = worst;
  }
}

TEST(Sample, IsConstantOutsideTheBand) {
  const NarrowBand band =
      support::sampleBand([](const V3d& p) { return p.length() - 1; }, {V3d(-1), V3d(1)}, 0.05);
  for (const Interpolation method : {Interpolation::Trilinear, Interpolation::Tricubic}) {
    BandSampler sampler(band, method);
    for (const double far : {3.0, 1e6, 1e30}) {
      EXPECT_NEAR(sampler.value(V3d(far, 0, 0)), 0.15, support::measured(5.96e-9));
      EXPECT_FALSE(sampler.isInBand(V3d(far, 0, 0)));
    }
    EXPECT_NEAR(sampler.value(V3d(0)), -0.15, support::measured(5.96e-9));
    EXPECT_EQ(sampler.gradient(V3d(0)), V3d(0));
    EXPECT_EQ(sampler.normal(V3d(0)), V3d(0));
    EXPECT_TRUE(std::isnan(sampler.value(V3d(std::nan(""), 0, 0))));
    // After a move the new sampler owns the band.
    BandSampler moved = std::move(sampler);
    EXPECT_NEAR(moved.value(V3d(1, 0, 0)), 0, support::rounding(1) * 0.05);
  }
}

TEST(Sample, ReportsWhichPositionsAllSamplesCover) {
  const double h = 0.125;
  NarrowBand band = sampleCube([](const V3d& p) { return p.x; }, Imath::M44d().setScale(h));
  editVdb(band).tree().setValueOff(openvdb::Coord(6, 6, 6), 1.0f);
  const BandSampler linear(band), cubic(band, Interpolation::Tricubic);
  // Compared with the definition, over cells within one leaf and across leaves.
  for (const openvdb::Coord& c : openvdb::CoordBBox(openvdb::Coord(2), openvdb::Coord(12))) {
    const V3d p = (toImath(c.asVec3d()) + V3d(0.5)) * h;
    const auto holds = [&](int before, int after) {
      for (int axis = 0; axis < 3; ++axis)
        if (6 < c[axis] - before || 6 > c[axis] + after) return false;
      return true;
    };
    EXPECT_EQ(linear.isInBand(p), !holds(0, 1)) << c;
    EXPECT_EQ(cubic.isInBand(p), !holds(1, 2)) << c;
  }
  EXPECT_FALSE(linear.isInBand(V3d(14.5 * h)));
  EXPECT_FALSE(cubic.isInBand(V3d(13.5 * h)));
}

}  // namespace sample_test
