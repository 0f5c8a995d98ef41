#include "levelset/inspect/measure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "levelset/csg/csg.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace measure_test {

using namespace levelset;
using Imath::V3d;
using std::numbers::pi;

NarrowBand sphere(double radius, double voxelSize, const V3d& centre) {
  return support::sampleBand([=](const V3d& p) { return (p - centre).length() - radius; },
                             {centre - V3d(radius), centre + V3d(radius)}, voxelSize);
}

double torusDistance(const V3d& p, double radius, double tube) {
  return std::hypot(std::hypot(p.x, p.y) - radius, p.z) - tube;
}

/// Solid sphere with a cavity that contains another solid.
NarrowBand nested(double h) {
  return support::sampleBand(
      [](const V3d& p) {
        const double r = p.length();
        return std::min(std::max(r - 20, 14 - r), r - 6);
      },
      {V3d(-20), V3d(20)}, h);
}

TriMesh tetrahedron();

TEST(Measure, DistinguishesTinyCavitiesFromSolids) {
  // One grid point inside a ball, or far from it, has a small value of the other sign. A surface of
  // such curvature has a negligible volume.
  for (const float value : {1e-4f, 0.01f, 0.1f, 0.4f, 0.9f}) {
    for (const bool isVoid : {true, false}) {
      NarrowBand ball = sphere(8, 1, V3d(0.3, 0.2, 0.1));
      openvdb::FloatGrid& grid = editVdb(ball);
      auto accessor = grid.getAccessor();
      const openvdb::Coord c(isVoid ? 0 : 20, 1, 2);
      for (int axis = 0; axis < 3; ++axis)
        for (const int step : {-2, -1, 1, 2}) {
          openvdb::Coord next = c;
          next[axis] += step;
          accessor.setValue(next, isVoid ? -1.f : 1.f);
        }
      accessor.setValue(c, isVoid ? value : -value);
      const Measurement m = measure(ball);
      EXPECT_EQ(m.components, isVoid ? 1u : 2u) << value;
      EXPECT_EQ(m.cavities, isVoid ? 1u : 0u) << value;
    }
  }
}

TriMesh tetrahedron() {
  return {{V3d(0), V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)},
          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

TEST(Measure, SphereConvergesFourthOrder) {
  double error[2][3] = {};
  for (int i = 0; i < 2; ++i) {
    const double h = 1. / (16 << i);
    for (int k = 0; k < 3; ++k) {
      const Measurement m = measure(sphere(1, h, V3d(0.13 * k, 0.29 * k, 0.41 * k) * h));
      error[i][0] += std::abs(m.volume / (4 * pi / 3) - 1) / 3;
      error[i][1] += std::abs(m.area / (4 * pi) - 1) / 3;
      error[i][2] += std::abs(m.meanCurvature / (4 * pi) - 1) / 3;
    }
  }
  EXPECT_LT(error[1][0], support::measured(1.15e-10));
  EXPECT_LT(error[1][1], support::measured(3.66e-9));
  EXPECT_LT(error[1][2], support::measured(3.65e-9));
  EXPECT_GT(std::log2(error[0][0] / error[1][0]), support::measuredOrder(3.91));
  EXPECT_GT(std::log2(error[0][1] / error[1][1]), support::measuredOrder(4.02));
  EXPECT_GT(std::log2(error[0][2] / error[1][2]), support::measuredOrder(3.91));
}

/// Compares with the exact moments of inertia of a torus of unit density about its axis and across
/// it.
TEST(Measure, MeasuresCentroidAndInertia) {
  const double radius = 12, tube = 5, volume = 2 * pi * pi * radius * tube * tube;
  const V3d centre(0.3, -2.6, 7.1);
  const NarrowBand torus =
      support::sampleBand([&](const V3d& p) { return torusDistance(p - centre, radius, tube); },
                          {centre - V3d(17, 17, 5), centre + V3d(17, 17, 5)}, 1);
  const Measurement m = measure(torus);
  EXPECT_NEAR((m.centroid - centre).length(), 0, support::measured(1.26e-5));
  const double axial = volume * (radius * radius + 0.75 * tube * tube),
               across = volume * (radius * radius / 2 + 0.625 * tube * tube);
  EXPECT_NEAR(m.inertia[2][2], axial, support::measured(1.78e-5) * axial);
  EXPECT_NEAR(m.inertia[0][0], across, support::measured(2.04e-5) * across);
  EXPECT_NEAR(m.inertia[0][1], 0, support::rounding(1.5) * across);
  EXPECT_NEAR(m.meanCurvature, 2 * pi * pi * radius,
              support::measured(5.95e-6) * 2 * pi * pi * radius);

  // The same torus in voxels of 0.1, rotated by 90 degrees about z.
  auto grid = vdb(torus).deepCopy();
  for (auto it = grid->beginValueAll(); it; ++it) it.setValue(*it * 0.1f);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(
      openvdb::math::Mat4d(0., 0.1, 0., 0., -0.1, 0., 0., 0., 0., 0., 0.1, 0., 0., 0., 0., 1.)));
  const Measurement small = measure(makeBand(grid));
  EXPECT_NEAR((small.centroid - V3d(0.26, 0.03, 0.71)).length(), 0, support::measured(1.26e-6));
  EXPECT_NEAR(small.inertia[2][2], 1e-5 * axial, support::measured(1.78e-10) * axial);
  EXPECT_NEAR(small.meanCurvature, 0.1 * m.meanCurvature,
              support::measured(4.22e-12) * m.meanCurvature);
}

TEST(Measure, MeasuresMomentsOfBoxes) {
  const V3d half(9, 12, 15.5), centre(1, 2, 3);
  const NarrowBand box = support::sampleBand(
      [&](const V3d& p) {
        const V3d q(std::abs(p.x - 1) - half.x, std::abs(p.y - 2) - half.y,
                    std::abs(p.z - 3) - half.z);
        const V3d outer(std::max(q.x, 0.), std::max(q.y, 0.), std::max(q.z, 0.));
        return outer.length() + std::min(std::max({q.x, q.y, q.z}), 0.);
      },
      {centre - half, centre + half}, 1);
  const double volume = 8 * half.x * half.y * half.z;
  const double curvature = pi / 2 * 2 * (half.x + half.y + half.z);  // ½ Σ length × π/2 of 12 edges
  // The cells of a band round its edges by half a voxel² of the cross-section, nearly 1 % here.
  const std::array<std::pair<Measurement, double>, 2> cases = {
      {{measure(box), support::measured(0.00805)},
       {measure(bandToMesh(box, {.sharp = true})), support::doubleRounding(30)}}};
  for (const auto& [m, tolerance] : cases) {
    EXPECT_NEAR(m.volume, volume, tolerance * volume);
    EXPECT_NEAR((m.centroid - centre).length(), 0, 3 * tolerance);
    const double xx = volume * (half.y * half.y + half.z * half.z) / 3;
    EXPECT_NEAR(m.inertia[0][0], xx, 2 * tolerance * xx);
    EXPECT_NEAR(m.meanCurvature, 2 * curvature, support::measured(0.0658) * curvature);
  }
}

TEST(Measure, ReportsTopologyOfTorusAndNestedComponents) {
  const Measurement torus =
      measure(support::sampleBand([](const V3d& p) { return torusDistance(p, 12, 5); },
                                  {V3d(-17, -17, -5), V3d(17, 17, 5)}, 1));
  EXPECT_EQ(torus.euler, 0);
  EXPECT_EQ(torus.components, 1u);
  EXPECT_EQ(torus.surfaces, 1u);
  EXPECT_EQ(torus.cavities, 0u);
  EXPECT_NEAR(torus.volume, 2 * pi * pi * 12 * 25,
              support::measured(2.17e-5) * 2 * pi * pi * 12 * 25);
  const Measurement shells = measure(nested(1));
  EXPECT_EQ(shells.components, 2u);
  EXPECT_EQ(shells.surfaces, 3u);
  EXPECT_EQ(shells.cavities, 1u);
  EXPECT_EQ(shells.euler, 6);
  const double exact = 4 * pi / 3 * (20. * 20 * 20 - 14. * 14 * 14 + 6. * 6 * 6);
  EXPECT_NEAR(shells.volume, exact, support::rounding(0.6) * exact);
}

TEST(Measure, ReportsFiguresOfTheBand) {
  const NarrowBand band = sphere(5, 0.5, V3d(1, 2, 3));
  const Measurement m = measure(band);
  EXPECT_EQ(m.activeVoxels, band.activeVoxelCount());
  EXPECT_DOUBLE_EQ(m.voxelSize, 0.5);
  EXPECT_NEAR(m.halfWidth, 3, support::rounding(3));
  const Imath::Box3d box = band.zeroSetBounds();
  EXPECT_NEAR((m.bounds.min - box.min).length(), 0, support::rounding(1) * 0.5);
  EXPECT_NEAR((m.bounds.max - box.max).length(), 0, support::rounding(1) * 0.5);
  EXPECT_EQ(measure(NarrowBand()).volume, 0);
  EXPECT_EQ(measure(NarrowBand()).surfaces, 0u);
}

TEST(Measure, IsTheSameFarFromOrigin) {
  const NarrowBand band = sphere(10, 1, V3d(0.2));
  auto grid = vdb(band).deepCopy();
  grid->transform().postTranslate(openvdb::Vec3d(1e6, 2e6, -1e6));
  const Measurement here = measure(band), there = measure(makeBand(grid));
  EXPECT_EQ(here.volume, there.volume);
  EXPECT_EQ(here.area, there.area);
  EXPECT_NEAR(there.bounds.min.x - here.bounds.min.x, 1e6, 1e-6);
  TriMesh mesh = bandToMesh(band);
  const double volume = measure(mesh).volume;
  for (V3d& p : mesh.positions) p += V3d(1e6, 2e6, -1e6);
  EXPECT_NEAR(measure(mesh).volume, volume, support::measured(3.33e-13) * volume);
}

TEST(Measure, AgreesWithItsMesh) {
  // The mesh lies inside the curved surface by at most a quarter of the curvature.
  const NarrowBand band = nested(1);
  const Measurement ofBand = measure(band), ofMesh = measure(bandToMesh(band));
  EXPECT_NEAR(ofBand.volume, ofMesh.volume, support::measured(0.00133) * ofBand.volume);
  EXPECT_NEAR(ofBand.area, ofMesh.area, support::measured(0.00149) * ofBand.area);
  EXPECT_NEAR(ofBand.meanCurvature, ofMesh.meanCurvature,
              support::measured(0.0014) * ofBand.meanCurvature);
  EXPECT_EQ(ofBand.components, ofMesh.components);
  EXPECT_EQ(ofBand.cavities, ofMesh.cavities);
  EXPECT_EQ(ofBand.euler, ofMesh.euler);
}

TEST(Measure, HoldsInNarrowBands) {
  const V3d centre(0.3, 0.1, -0.4);
  for (const double halfWidth : {1.0, 1.5, 2.0, 5.0}) {
    const Measurement m =
        measure(support::sampleBand([=](const V3d& p) { return (p - centre).length() - 20; },
                                    {centre - V3d(20), centre + V3d(20)}, 1, halfWidth));
    EXPECT_NEAR(m.volume, 4 * pi / 3 * 8000,
                (halfWidth < 3 ? support::measured(6.54e-5) : support::measured(2.2e-10)) * 4 * pi /
                    3 * 8000)
        << halfWidth;
  }
}

/// A cylinder whose rims cross the grid: exact distances, except outside its rims.
NarrowBand cylinder(double radius, double length, const V3d& centre, double voxelSize) {
  return makeCylinder(radius, length, centre, V3d(0.3, 0.5, 1).normalized(), voxelSize);
}

TEST(MeasureSharp, AStraightCylinderHasItsVolume) {
  const double radius = 0.5, length = 4, volume = pi * radius * radius * length;
  const double area = 2 * pi * radius * (radius + length);
  const double curvature = pi * length + pi * pi * radius;  // of the side, and of both rims
  // Radii of 6, 12 and 24 voxels. measure() has errors of 6e-3, 2e-3 and 1e-3 in volume.
  const double volumes[] = {1.6e-5, 2.5e-5, 5.7e-6}, areas[] = {7.5e-4, 4.3e-6, 5.5e-5},
               curvatures[] = {8.5e-4, 3.3e-3, 2e-3};
  int level = 0;
  for (const double voxels : {6.0, 12.0, 24.0}) {
    const Measurement m =
        measureSharp(cylinder(radius, length, V3d(0.013, 0.021, 0.007), radius / voxels));
    EXPECT_LT(std::abs(m.volume / volume - 1), support::measured(volumes[level], 1e-4));
    EXPECT_LT(std::abs(m.area / area - 1), support::measured(areas[level]));
    EXPECT_LT(std::abs(m.meanCurvature / curvature - 1), support::measured(curvatures[level]));
    ++level;
    EXPECT_EQ(m.euler, 2);
    EXPECT_EQ(m.components, 1u);
  }
}

TEST(MeasureSharp, ABoxIsExact) {
  const V3d size(1.5, 1.5, 4), centre(0.01, 0.02, 0.03);
  const Measurement m = measureSharp(makeBox(size, centre, 0.05));
  EXPECT_NEAR(m.volume, 9, support::rounding(1) * 9);
  EXPECT_NEAR(m.area, 28.5, support::rounding(1) * 28.5);
  EXPECT_NEAR(m.meanCurvature, pi * 7, support::rounding(1) * pi * 7);  // ½ Σ length × π/2
  EXPECT_NEAR((m.centroid - centre).length(), 0, support::rounding(1));
  EXPECT_NEAR((m.bounds.min - (centre - size * 0.5)).length(), 0, support::rounding(1));
  EXPECT_NEAR(m.inertia[0][0], 9 * (1.5 * 1.5 + 16) / 12, support::rounding(10));
}

/// The difference of two boxes has concave edges. A sphere inside it is a cavity without edges.
TEST(MeasureSharp, EdgesMayBeConcave) {
  const NarrowBand block = makeBox(V3d(2, 2, 2), V3d(0.01, 0.02, 0.03), 0.05),
                   step = makeBox(V3d(2, 2, 2), V3d(1.01, 1.02, 0.03), 0.05),
                   ball = makeSphere(0.3, V3d(-0.5, -0.5, 0), 0.05);
  const Measurement m = measureSharp(subtract(subtract(block, step), ball));
  const double cavity = 4 * pi / 3 * 0.027;
  EXPECT_NEAR(m.volume, 6 - cavity, support::measured(1.04e-4));
  EXPECT_EQ(m.cavities, 1u);
  EXPECT_EQ(m.surfaces, 2u);
}

TEST(MeasureSharp, SmoothSolidsKeepTheirBits) {
  for (const NarrowBand& solid : {sphere(10, 1, V3d(0.2)), nested(1)}) {
    const Measurement a = measure(solid), b = measureSharp(solid);
    EXPECT_EQ(a.volume, b.volume);
    EXPECT_EQ(a.area, b.area);
    EXPECT_EQ(a.meanCurvature, b.meanCurvature);
    EXPECT_EQ(a.inertia, b.inertia);
    EXPECT_EQ(a.bounds, b.bounds);
  }
  EXPECT_EQ(measureSharp(NarrowBand()).volume, 0);
}

TEST(Manifoldness, AcceptsClosedMesh) {
  EXPECT_TRUE(manifoldness(tetrahedron()).isClosedManifold());
  const Measurement m = measure(tetrahedron());
  EXPECT_NEAR(m.volume, 1. / 6, support::doubleRounding(1));
  EXPECT_NEAR(m.area, 1.5 + std::sqrt(3) / 2, support::doubleRounding(15));
  EXPECT_EQ(m.euler, 2);
}

TEST(Manifoldness, CountsEachDefect) {
  TriMesh open = tetrahedron();
  open.triangles.pop_back();
  EXPECT_EQ(manifoldness(open).boundaryEdges, 3u);
  EXPECT_EQ(manifoldness(open).nonManifoldVertices, 0u);

  TriMesh flipped = tetrahedron();
  std::swap(flipped.triangles[3][0], flipped.triangles[3][1]);
  EXPECT_EQ(manifoldness(flipped).misorientedEdges, 3u);
  EXPECT_EQ(manifoldness(flipped).nonManifoldEdges, 0u);

  TriMesh fin = tetrahedron();
  fin.positions.push_back(V3d(1, 1, 1));
  fin.triangles.push_back({1, 2, 4});
  EXPECT_EQ(manifoldness(fin).nonManifoldEdges, 1u);
  EXPECT_EQ(manifoldness(fin).boundaryEdges, 2u);

  TriMesh bowTie = tetrahedron();  // a second tetrahedron that shares vertex 0
  for (const V3d& p : {V3d(-1, 0, 0), V3d(0, -1, 0), V3d(0, 0, -1)}) bowTie.positions.push_back(p);
  for (const auto& t : tetrahedron().triangles) {
    const auto moved = [](std::uint32_t v) { return v ? v + 3 : 0; };
    bowTie.triangles.push_back({moved(t[0]), moved(t[1]), moved(t[2])});
  }
  const Manifoldness found = manifoldness(bowTie);
  EXPECT_EQ(found.nonManifoldVertices, 1u);
  EXPECT_EQ(found.boundaryEdges + found.nonManifoldEdges + found.misorientedEdges, 0u);
}

}  // namespace measure_test
