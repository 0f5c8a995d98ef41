// Distances from interfaces and sheets at any position.

#include "levelset/segmented/meshing/segmented_distance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "levelset/error.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/segmented/sources/segment_mesh.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"

namespace segmented_distance_test {

using namespace levelset;
using Imath::V3d;
using support::measured;
using support::measuredOrder;

TEST(SegmentedDistance, MeasuresNestedBallsWithSecondOrder) {
  std::vector<double> errors;
  for (const double voxel : {0.1, 0.05}) {
    const SegmentedField field =
        segmentSolids(
            std::vector<NarrowBand>{makeSphere(1, V3d(0), voxel), makeSphere(0.5, V3d(0), voxel)})
            .field;
    const SegmentedDistance all(field), outer(field, {.region = 1}), inner(field, {.region = 2}),
        around(field, {.region = kVoid});
    double worst = 0;
    const auto compare = [&](double value, double exact) {
      worst = std::max(worst, std::abs(value - exact));
    };
    for (const double r : {0.05, 0.3, 0.62, 0.8, 1.3, 5.0}) {
      const V3d p = V3d(0.36, 0.48, 0.8) * r;
      const double a = std::abs(r - 1), b = std::abs(r - 0.5);
      compare(all.value(p), std::min(a, b));
      compare(outer.value(p), r > 0.5 && r < 1 ? -std::min(a, b) : std::min(a, b));
      compare(inner.value(p), r - 0.5);
      compare(around.value(p), 1 - r);
    }
    errors.push_back(worst);
  }
  EXPECT_LT(errors[0], measured(3.46e-3));
  EXPECT_GT(std::log2(errors[0] / errors[1]), measuredOrder(2.1));
}

TEST(SegmentedDistance, MeasuresSheets) {
  // A sphere with a triangle inside it, and a square beside it.
  TriMesh mesh = support::sphereMesh(1, V3d(0), 24);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const V3d& p : {V3d(-0.5, -0.5, 0.01), V3d(0.5, -0.5, 0.01), V3d(0, 0.5, 0.01)})
    mesh.positions.push_back(p);
  mesh.triangles.push_back({first, first + 1, first + 2});
  const SegmentedField field = segmentMesh(mesh, 0.1, {.keepsSheets = true}).field;
  const SegmentedDistance all(field), sheets(field, {.onlySheets = true}),
      region(field, {.region = 1});
  const V3d above(0.02, -0.1, 0.25);
  EXPECT_NEAR(all.value(above), 0.24, support::rounding(4));
  EXPECT_NEAR(sheets.value(above), 0.24, support::rounding(4));
  EXPECT_NEAR(sheets.value(V3d(0.02, -0.1, 4)), 3.99, support::rounding(16));
  // The sheet is no border of the region.
  EXPECT_NEAR(region.value(above), above.length() - 1, measured(6e-3));
  EXPECT_TRUE(std::isnan(all.value(V3d(0, NAN, 0))));
}

TEST(SegmentedDistance, Refuses) {
  const SegmentedField field =
      segmentSolids(std::vector<NarrowBand>{makeSphere(1, V3d(0), 0.2)}).field;
  EXPECT_EQ(SegmentedDistance(field, {.onlySheets = true}).value(V3d(0)),
            std::numeric_limits<double>::infinity());
  EXPECT_EQ(SegmentedDistance(SegmentedField()).value(V3d(0)),
            std::numeric_limits<double>::infinity());
  EXPECT_THROW(SegmentedDistance(field, {.region = 2}), UsageError);
  EXPECT_THROW(SegmentedDistance(field, {.region = 1, .onlySheets = true}), UsageError);
  EXPECT_THROW(SegmentedDistance(field, {.maxMemory = 1000}), ResourceLimit);
}

}  // namespace segmented_distance_test
