// Segmented fields of meshes with borders, junctions and self-intersections.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/segmented/meshing/extract_label.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/sources/segment_mesh.h"
#include "tests/support/measured.h"
#include "tests/support/sheet_meshes.h"
#include "tests/support/threads.h"

namespace segment_sheets_test {

using namespace levelset;
using Imath::V3d;
using std::numbers::pi;
using support::Frame;
using support::interfaceDefects;
using support::InterfaceDefects;
using support::measured;
using support::measuredOrder;
using support::SheetShape;
using support::sheetShape;
using support::tiltedFrame;

const V3d kOffGrid(0.013, 0.021, 0.037);

SegmentMeshResult segmentSheets(const TriMesh& mesh, double voxel) {
  return segmentMesh(mesh, voxel, {.keepsSheets = true});
}

/// Defects of a mesh, where triangles of sheets may have the same label on both sides.
InterfaceDefects defectsOf(const SegmentedMesh& mesh) {
  InterfaceDefects defects = interfaceDefects(mesh);
  for (const TriangleSides& sides : mesh.sides) defects.misnamed -= sides.behind == sides.front;
  return defects;
}

/// Largest distance of the rims of a mesh from given line segments, and of those from the rims.
struct RimError {
  double outwards = 0, inwards = 0;
};
double distanceToLines(const V3d& p, const std::vector<std::array<V3d, 2>>& lines) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [a, b] : lines) {
    const double t = std::clamp(((b - a) ^ (p - a)) / (b - a).length2(), 0.0, 1.0);
    least = std::min(least, (a + (b - a) * t - p).length());
  }
  return least;
}
std::vector<std::array<V3d, 2>> rimsOf(const SegmentedMesh& mesh) {
  std::vector<std::array<V3d, 2>> rims;
  for (const auto& [a, b] : mesh.rims)
    rims.push_back({mesh.mesh.positions[a], mesh.mesh.positions[b]});
  return rims;
}
RimError rimError(const SegmentedMesh& mesh, const std::vector<std::array<V3d, 2>>& exact) {
  const auto worst = [](const std::vector<std::array<V3d, 2>>& from,
                        const std::vector<std::array<V3d, 2>>& to) {
    double most = 0;
    for (const auto& [a, b] : from)
      for (const double t : {0.0, 0.25, 0.5, 0.75, 1.0})
        most = std::max(most, distanceToLines(a + (b - a) * t, to));
    return most;
  };
  return {worst(rimsOf(mesh), exact), worst(exact, rimsOf(mesh))};
}

TEST(SegmentSheets, EndDisksAtTheirRims) {
  constexpr double kVoxel = 0.1;
  constexpr unsigned kSides = 96;
  const double area = kSides * std::sin(2 * pi / kSides) / 2;
  for (const V3d& centre : {V3d(0), kOffGrid})
    for (const double tilt : {0.0, 15.0, 45.0}) {
      const Frame frame = tiltedFrame(centre, tilt);
      const SegmentMeshResult result = segmentSheets(support::ringMesh(0, 1, frame), kVoxel);
      EXPECT_TRUE(result.field.labels().empty());
      EXPECT_EQ(result.field.sheetLabels(), std::vector<RegionLabel>{kVoid});
      EXPECT_EQ(result.rimEdges, kSides);
      const SegmentedMesh mesh = segmentedToMesh(result.field);
      EXPECT_EQ(defectsOf(mesh), InterfaceDefects());
      // One sheet without holes.
      const SheetShape shape = sheetShape(mesh);
      EXPECT_EQ(shape.components, 1u);
      EXPECT_EQ(shape.rimLoops, 1u);
      EXPECT_EQ(shape.euler, 1);
      EXPECT_EQ(shape.tornRims + shape.wrongRims, 0u);
      EXPECT_TRUE(shape.isOrientable);
      double height = 0;
      for (const V3d& p : mesh.mesh.positions)
        height = std::max(height, std::abs((p - frame.centre) ^ frame.z));
      EXPECT_LT(height, measured(1.42e-6)) << tilt;  // grid points on the disk
      std::vector<std::array<V3d, 2>> rim;
      const auto corner = [&](unsigned j) {
        const double a = 2 * pi * j / kSides;
        return frame.centre + frame.x * std::cos(a) + frame.y * std::sin(a);
      };
      for (unsigned j = 0; j < kSides; ++j) rim.push_back({corner(j), corner(j + 1)});
      const RimError error = rimError(mesh, rim);
      EXPECT_LT(error.outwards / kVoxel, measured(0.0213)) << tilt;
      EXPECT_LT(error.inwards / kVoxel, measured(0.0235)) << tilt;
      const SegmentedMeasurement m = measureSegmented(mesh);
      EXPECT_NEAR(m.area, area, measured(3.2e-3)) << tilt;
      EXPECT_EQ(m.regions[0].sheetArea, m.area);
      EXPECT_EQ(m.regions[0].area, 0);
      EXPECT_NEAR(m.rimLength, 2 * pi, measured(3.6e-3)) << tilt;
    }
}

TEST(SegmentSheets, KeepsTheCornersOfRims) {
  // A square, also with corners on grid points.
  for (const V3d& centre : {V3d(0), kOffGrid})
    for (const double tilt : {0.0, 15.0, 45.0}) {
      const Frame frame = tiltedFrame(centre, tilt);
      const auto at = [&](double x, double y) { return frame.centre + frame.x * x + frame.y * y; };
      TriMesh square;
      square.positions = {at(-1, -1), at(1, -1), at(1, 1), at(-1, 1)};
      square.triangles = {{0, 1, 2}, {0, 3, 2}};  // faces differ
      const SegmentedMesh mesh = segmentedToMesh(segmentSheets(square, 0.1).field);
      std::vector<std::array<V3d, 2>> rim;
      for (std::size_t k = 0; k < 4; ++k)
        rim.push_back({square.positions[k], square.positions[(k + 1) % 4]});
      const RimError error = rimError(mesh, rim);
      // Corners on grid points may be cut by half a voxel.
      const bool isOnGrid = centre == V3d(0);
      EXPECT_LT(error.outwards, isOnGrid ? measured(0.05) : support::rounding(1)) << tilt;
      EXPECT_LT(error.inwards, support::rounding(1)) << tilt;
      EXPECT_NEAR(measureSegmented(mesh).area, 4, isOnGrid ? measured(0.01) : measured(7.9e-9))
          << tilt;
      EXPECT_TRUE(sheetShape(mesh).isOrientable);
      EXPECT_EQ(sheetShape(mesh).euler, 1);
    }
}

TEST(SegmentSheets, FindsMoebiusStrips) {
  constexpr double kWidth = 0.8;
  const TriMesh strip = support::moebiusMesh(kWidth, tiltedFrame(kOffGrid, 20), 400, 25);
  // Area of the smooth strip by the midpoint rule.
  double exact = 0;
  constexpr int kSteps = 400;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const double u = (i + 0.5) / kSteps, v = 2 * (j + 0.5) / kSteps - 1, e = 1e-5;
      const auto at = [&](double du, double dv) {
        return support::moebiusPoint(kWidth, u + du, v + dv);
      };
      exact += (at(e, 0) - at(-e, 0)).cross(at(0, e) - at(0, -e)).length() / (4 * e * e) * 2 /
               (kSteps * kSteps);
    }
  std::vector<double> errors;
  for (const double voxel : {0.2, 0.1, 0.05}) {
    const SegmentMeshResult result = segmentSheets(strip, voxel);
    EXPECT_TRUE(result.field.labels().empty());
    EXPECT_TRUE(result.thinParts.empty());
    const SegmentedMesh mesh = segmentedToMesh(result.field);
    EXPECT_EQ(defectsOf(mesh), InterfaceDefects());
    const SheetShape shape = sheetShape(mesh);
    EXPECT_EQ(shape.components, 1u);
    EXPECT_EQ(shape.rimLoops, 1u);
    EXPECT_EQ(shape.euler, 0);
    EXPECT_FALSE(shape.isOrientable);
    EXPECT_EQ(shape.tornRims + shape.wrongRims, 0u);
    errors.push_back(std::abs(measureSegmented(mesh).area - exact));
  }
  EXPECT_LT(errors[0], measured(5.3e-4));
  EXPECT_LT(errors[1], measured(1.2e-4));
  EXPECT_LT(errors[2], measured(1.8e-4));  // of the triangles of the mesh
}

TEST(SegmentSheets, FindsTheLobesOfAKleinBottle) {
  constexpr double kLobe = 0.5;
  const TriMesh bottle = support::kleinMesh(kLobe, tiltedFrame(kOffGrid, 0), 192, 96);
  std::vector<double> errors, places, volumes;
  for (const double voxel : {0.1, 0.05, 0.025}) {
    const SegmentMeshResult result = segmentSheets(bottle, voxel);
    EXPECT_EQ(result.field.labels(), std::vector<RegionLabel>{1});
    EXPECT_TRUE(result.field.sheetLabels().empty());
    EXPECT_GT(result.crossingTriangles, 100u);
    EXPECT_EQ(result.rimEdges, 0u);
    const SegmentedMesh mesh = segmentedToMesh(result.field);
    EXPECT_TRUE(mesh.rims.empty());
    // The bottle crosses itself in the circle of radius 1.
    double worst = 0;
    for (const JunctionEdge& edge : mesh.junctions)
      for (const std::uint32_t v : edge.vertices) {
        const V3d p = mesh.mesh.positions[v] - kOffGrid;
        worst = std::max(worst, std::hypot(std::hypot(p.x, p.y) - 1, p.z));
      }
    places.push_back(worst / voxel);
    const SegmentedMeasurement m = measureSegmented(mesh);
    errors.push_back(std::abs(m.junctionLength - 2 * pi));
    // The sections are figures of eight with the area 4/3 lobe², centred on the circle.
    volumes.push_back(std::abs(m.regions[1].volume / (8 * pi / 3 * kLobe * kLobe) - 1));
    const SegmentedSampler sampler(result.field);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(-1, 1);
    std::size_t wrong = 0, tested = 0;
    for (int n = 0; n < 20000; ++n) {
      const V3d p(1.6 * unit(random), 1.6 * unit(random), 0.6 * unit(random));
      // In the plane of the figure of eight: q² = p² (1 − p² / lobe²).
      const double a = std::atan2(p.y, p.x), r = std::hypot(p.x, p.y) - 1,
                   u = r * std::cos(a / 2) + p.z * std::sin(a / 2),
                   v = p.z * std::cos(a / 2) - r * std::sin(a / 2),
                   inside = u * u * (1 - u * u / (kLobe * kLobe)) - v * v;
      if (std::abs(inside) < 0.5 * voxel * std::hypot(u, v) + 0.5 * voxel * voxel) continue;
      ++tested;
      wrong += sampler.label(p + kOffGrid) != (inside > 0 ? 1 : kVoid);
    }
    EXPECT_GT(tested, 5000u);
    EXPECT_EQ(wrong, 0u);
  }
  // The places are those of the facets, 2e-4 to 4e-4 beside the smooth circle.
  EXPECT_LT(places[0], measured(0.0054));
  EXPECT_LT(places[1], measured(0.0080));
  EXPECT_LT(places[2], measured(0.0160));
  EXPECT_LT(errors[2], measured(3.3e-4));
  EXPECT_LT(volumes[0], measured(0.0139));
  EXPECT_LT(volumes[1], measured(0.0050));
  EXPECT_LT(volumes[2], measured(0.0028));
}

TEST(SegmentSheets, JoinThePagesOfABook) {
  const Frame frame = support::turnedFrame(kOffGrid, 0.7);
  const TriMesh book = support::bookMesh({0, 72, 144, 216, 288}, 1, 2, frame);
  for (const double voxel : {0.1, 0.05, 0.025}) {
    const SegmentMeshResult result = segmentSheets(book, voxel);
    // All sectors are connected around the pages.
    EXPECT_TRUE(result.field.labels().empty());
    EXPECT_EQ(result.field.sheetLabels(), std::vector<RegionLabel>{kVoid});
    EXPECT_EQ(result.patches, 5u);
    const SegmentedMesh mesh = segmentedToMesh(result.field);
    EXPECT_EQ(defectsOf(mesh), InterfaceDefects());
    double worst = 0, low = 0, high = 0;
    for (const JunctionEdge& edge : mesh.junctions)
      for (const std::uint32_t v : edge.vertices) {
        const V3d p = mesh.mesh.positions[v] - frame.centre;
        worst = std::max(worst, std::hypot(p ^ frame.x, p ^ frame.y));
        low = std::min(low, p ^ frame.z);
        high = std::max(high, p ^ frame.z);
      }
    EXPECT_LT(worst, support::rounding(1));
    EXPECT_NEAR(high - low, 2, support::rounding(1));
    const SegmentedMeasurement m = measureSegmented(mesh);
    EXPECT_NEAR(m.area, 10, measured(0.42) * voxel);
    // Strips fold back along the spine, but each piece of it counts once.
    EXPECT_NEAR(m.junctionLength, 2, measured(2.2e-9));
    EXPECT_EQ(sheetShape(mesh).components, 1u);
  }
}

/// Prism with six sides about the z axis of a frame, with three walls at 120° that meet in the
/// axis.
TriMesh prismWithWalls(double radius, double height, const Frame& frame) {
  TriMesh mesh;
  for (const double z : {-height / 2, height / 2}) {
    mesh.positions.push_back(frame.centre + frame.z * z);
    for (int k = 0; k < 6; ++k)
      mesh.positions.push_back(frame.centre + frame.z * z +
                               frame.x * (radius * std::cos(k * pi / 3)) +
                               frame.y * (radius * std::sin(k * pi / 3)));
  }
  for (std::uint32_t k = 0; k < 6; ++k) {
    const std::uint32_t a = 1 + k, b = 1 + (k + 1) % 6;
    for (const std::array<std::uint32_t, 3> t :
         {std::array{0u, b, a}, {7u, a + 7, b + 7}, {a, b, b + 7}, {a, b + 7, a + 7}})
      mesh.triangles.push_back(t);
    if (k % 2 == 1) continue;
    mesh.triangles.push_back({0, a, a + 7});
    mesh.triangles.push_back({0, a + 7, 7});
  }
  return mesh;
}

TEST(SlowSegmentSheets, SeparatesThreeHalfPlanesInRandomPoses) {
  // A thousand prisms in one mesh, a few voxels large.
  constexpr int kSide = 10;
  constexpr double kRadius = 3, kHeight = 4, kSpacing = 9;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  std::vector<Frame> frames;
  TriMesh mesh;
  for (int n = 0; n < kSide * kSide * kSide; ++n) {
    Frame frame;
    frame.centre = V3d(n / kSide / kSide, n / kSide % kSide, n % kSide) * kSpacing +
                   V3d(unit(random), unit(random), unit(random));
    frame.x = V3d(normal(random), normal(random), normal(random)).normalized();
    frame.y = frame.x.cross(V3d(normal(random), normal(random), normal(random))).normalized();
    frame.z = frame.x.cross(frame.y);
    frames.push_back(frame);
    const TriMesh prism = prismWithWalls(kRadius, kHeight, frame);
    const auto offset = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), prism.positions.begin(), prism.positions.end());
    for (const auto& t : prism.triangles)
      mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  }
  const SegmentedField field = segmentSheets(mesh, 1).field;
  EXPECT_EQ(field.labels().size(), 3 * frames.size());
  EXPECT_TRUE(field.sheetLabels().empty());
  const SegmentedSampler sampler(field);
  std::size_t mixed = 0, tested = 0;
  for (const Frame& frame : frames) {
    std::array<RegionLabel, 3> labels{};
    for (int sector = 0; sector < 3; ++sector)
      for (int m = 0; m < 30; ++m) {
        const double a = (unit(random) - 0.5) * 2 * pi / 3,
                     r = 0.8 * kRadius * std::sqrt(unit(random)), z = (unit(random) - 0.5) * 0.6,
                     around = a + (sector * 120 + 60) * pi / 180;
        // Half a voxel from the walls.
        if (r * std::sin(pi / 3 - std::abs(a)) < 0.5) continue;
        ++tested;
        const RegionLabel label =
            sampler.label(frame.centre + frame.x * (r * std::cos(around)) +
                          frame.y * (r * std::sin(around)) + frame.z * (kHeight * z));
        RegionLabel& known = labels[static_cast<std::size_t>(sector)];
        if (known == kVoid) known = label;
        mixed += label != known || label == kVoid;
      }
    mixed += labels[0] == labels[1] || labels[1] == labels[2] || labels[2] == labels[0];
  }
  EXPECT_GT(tested, 40000u);
  EXPECT_EQ(mixed, 0u);
}

TEST(SegmentSheets, MeasureTheCircleOfFourSheets) {
  constexpr unsigned kRings = 48, kSides = 2 * kRings;
  // A ring around the equator, where the sphere and its diaphragm already meet.
  TriMesh mesh = support::sphereWithHoledDiaphragm(kOffGrid, 0.4, kRings);
  support::addEquatorRing(mesh, kOffGrid, 1.4, kRings);
  std::vector<double> errors;
  for (const double voxel : {0.2, 0.1, 0.05}) {
    const SegmentedMesh result = segmentedToMesh(segmentSheets(mesh, voxel).field);
    EXPECT_FALSE(result.strips.empty());
    errors.push_back(
        std::abs(measureSegmented(result).junctionLength - kSides * 2.0 * std::sin(pi / kSides)));
  }
  EXPECT_LT(errors[0], measured(3.95e-3));
  EXPECT_GT(std::log2(errors[0] / errors[2]) / 2, measuredOrder(1.25));
}

TEST(SegmentSheets, HoldADiaphragmWithAHole) {
  constexpr unsigned kRings = 48;
  constexpr double kSides = 2 * kRings, kHole = 0.4;
  const double polygon = kSides / 2 * std::sin(2 * pi / kSides);
  std::vector<double> junctions, rims, areas;
  for (const double voxel : {0.2, 0.1, 0.05}) {
    const SegmentMeshResult result =
        segmentSheets(support::sphereWithHoledDiaphragm(kOffGrid, kHole, kRings), voxel);
    EXPECT_EQ(result.field.labels(), std::vector<RegionLabel>{1});
    EXPECT_EQ(result.field.sheetLabels(), std::vector<RegionLabel>{1});
    const SegmentedMesh mesh = segmentedToMesh(result.field);
    EXPECT_EQ(defectsOf(mesh), InterfaceDefects());
    const SheetShape shape = sheetShape(mesh);
    EXPECT_EQ(shape.rimLoops, 1u);
    EXPECT_EQ(shape.components, 1u);
    EXPECT_EQ(shape.tornRims + shape.wrongRims, 0u);
    EXPECT_EQ(shape.euler, 2);  // of a sphere and a ring
    const SegmentedMeasurement m = measureSegmented(mesh);
    ASSERT_EQ(m.interfaces.size(), 2u);
    EXPECT_EQ(m.interfaces[1].sides, (TriangleSides{1, 1}));
    areas.push_back(std::abs(m.interfaces[1].area - polygon * (1 - kHole * kHole)));
    junctions.push_back(std::abs(m.junctionLength - kSides * 2 * std::sin(pi / kSides)));
    rims.push_back(std::abs(m.rimLength - kHole * kSides * 2 * std::sin(pi / kSides)));
    // The solid does not know the diaphragm.
    const TriMesh solid = regionSurface(result.field, 1);
    EXPECT_NEAR(signedVolume(solid), m.regions[1].volume, measured(3e-9));
    const auto edges = support::sheetShape(
        {solid, std::vector<TriangleSides>(solid.triangles.size()), {}, {}, {}, {}});
    EXPECT_EQ(edges.borderEdges, 0u);
    EXPECT_EQ(edges.euler, 2);
  }
  EXPECT_LT(areas[0], measured(8.4e-3));
  EXPECT_LT(junctions[0], measured(0.158));
  EXPECT_LT(rims[0], measured(6.5e-3));
  EXPECT_GT(std::log2(areas[0] / areas[2]) / 2, measuredOrder(2.53));
  EXPECT_GT(std::log2(junctions[0] / junctions[2]) / 2, measuredOrder(0.84));
  EXPECT_GT(std::log2(rims[0] / rims[2]) / 2, measuredOrder(1.55));
}

TEST(SegmentSheets, HoldAWallWithADoor) {
  for (const V3d& origin : {V3d(0), kOffGrid}) {
    const SegmentMeshResult result = segmentSheets(support::boxWithDoor(origin), 0.1);
    EXPECT_EQ(result.field.labels(), std::vector<RegionLabel>{1});
    EXPECT_EQ(result.field.sheetLabels(), std::vector<RegionLabel>{1});
    const SegmentedMesh mesh = segmentedToMesh(result.field);
    EXPECT_EQ(defectsOf(mesh), InterfaceDefects());
    const SegmentedMeasurement m = measureSegmented(mesh);
    ASSERT_EQ(m.interfaces.size(), 2u);
    EXPECT_NEAR(m.regions[1].sheetArea, 4 - 0.6 * 1.4, measured(1.5e-3));
    EXPECT_NEAR(m.rimLength, 2 * 1.4 + 0.6, support::rounding(1));
    EXPECT_NEAR(m.volume, 12, measured(0.0176));
    const SegmentedSampler sampler(result.field);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-0.5, 3.5);
    for (int n = 0; n < 2000; ++n) {
      const V3d p(unit(random), unit(random), unit(random));
      const double inside = std::min({p.x, 3 - p.x, p.y, 2 - p.y, p.z, 2 - p.z});
      if (std::abs(inside) > 0.1) {
        EXPECT_EQ(sampler.label(origin + p), inside > 0 ? 1 : kVoid);
      }
    }
    const NarrowBand solid = extractLabel(result.field, 1);
    EXPECT_FALSE(solid.isEmpty());
  }
}

TEST(SegmentSheets, AreTheSameForAnyOrientation) {
  TriMesh mesh = support::sphereWithHoledDiaphragm(kOffGrid, 0.4, 12);
  const SegmentedField field = segmentSheets(mesh, 0.1).field;
  const SegmentedMesh given = segmentedToMesh(field);
  std::mt19937 random(1);
  for (auto& t : mesh.triangles)
    if (random() % 2) std::swap(t[1], t[2]);
  // Duplicates, of either orientation.
  for (std::size_t t = 0; t < 40; ++t) {
    mesh.triangles.push_back(mesh.triangles[7 * t]);
    if (t % 2) std::swap(mesh.triangles.back()[0], mesh.triangles.back()[1]);
  }
  const SegmentedField turned = segmentSheets(mesh, 0.1).field;
  EXPECT_EQ(turned.labels(), field.labels());
  EXPECT_EQ(turned.sheetLabels(), field.sheetLabels());
  const SegmentedMesh again = segmentedToMesh(turned);
  ASSERT_EQ(again.mesh.triangles, given.mesh.triangles);
  EXPECT_EQ(again.sides, given.sides);
  double worst = 0;
  for (std::size_t v = 0; v < given.mesh.positions.size(); ++v)
    worst = std::max(worst, (again.mesh.positions[v] - given.mesh.positions[v]).length());
  EXPECT_LT(worst, support::rounding(1));
}

TEST(SegmentSheets, NameSheetsThatAreTooClose) {
  constexpr double kVoxel = 0.1, kGap = 0.05;
  for (const double tilt : {0.0, 15.0}) {
    const Frame frame = tiltedFrame(kOffGrid, tilt);
    Frame above = frame;
    above.centre += frame.z * kGap;
    const SegmentMeshResult result = segmentSheets(
        support::joined(support::ringMesh(0, 1, frame), support::ringMesh(0, 1, above)), kVoxel);
    ASSERT_EQ(result.thinParts.size(), 1u);
    const ThinPart& part = result.thinParts[0];
    EXPECT_EQ(part.label, kVoid);
    EXPECT_NEAR(part.thickness, kGap, 1e-9);
    EXPECT_GT(part.places, 200u);
    EXPECT_LT(std::abs((part.position - frame.centre) ^ frame.z), kGap);
    EXPECT_LT((part.position - frame.centre).length(), 1);
    // Nothing is missing: what no grid point separates is one sheet.
    const double area = measureSegmented(result.field).area;
    EXPECT_GT(area, 0.99 * pi);
    EXPECT_LT(area, 2.01 * pi);
    EXPECT_EQ(defectsOf(segmentedToMesh(result.field)), InterfaceDefects());
  }
}

TEST(SegmentSheets, KeepAPlateThinnerThanAVoxel) {
  const SegmentMeshResult result =
      segmentSheets(support::boxMesh(V3d(-1, -1, 0.02), V3d(1, 1, 0.06)), 0.1);
  EXPECT_TRUE(result.field.labels().empty());
  ASSERT_EQ(result.thinParts.size(), 1u);
  EXPECT_TRUE(result.thinParts[0].isLost);
  EXPECT_NEAR(result.thinParts[0].thickness, 0.04, 1e-9);
  const SegmentedMesh mesh = segmentedToMesh(result.field);
  EXPECT_EQ(defectsOf(mesh), InterfaceDefects());
  for (const V3d& p : mesh.mesh.positions)
    if (std::max(std::abs(p.x), std::abs(p.y)) < 0.9) {
      EXPECT_NEAR(p.z, 0.04, 1e-7);
    }
  EXPECT_NEAR(measureSegmented(mesh).area, 4, measured(0.237));
}

TEST(SegmentSheets, HaveNoneInClosedMeshes) {
  for (const TriMesh& mesh : {support::sphereMesh(1, kOffGrid, 24),
                              support::boxMesh(V3d(-1), V3d(1)), support::torusMesh(1, 0.4)}) {
    const SegmentMeshResult result = segmentSheets(mesh, 0.1);
    EXPECT_EQ(result.field.labels(), std::vector<RegionLabel>{1});
    EXPECT_TRUE(result.field.sheetLabels().empty());
    EXPECT_TRUE(result.thinParts.empty());
    const SegmentedMesh segmented = segmentedToMesh(result.field);
    EXPECT_EQ(defectsOf(segmented), InterfaceDefects());
    EXPECT_TRUE(segmented.rims.empty());
    EXPECT_TRUE(segmented.junctions.empty());
    // The same regions and distances as without the option.
    const SegmentedField plain = segmentMesh(mesh, 0.1).field;
    EXPECT_EQ(plain.activeVoxelCount(), result.field.activeVoxelCount());
    EXPECT_NEAR(measureSegmented(segmented).volume, signedVolume(mesh), measured(0.0174));
    EXPECT_LT(plain.memoryUse(), result.field.memoryUse());
  }
}

TEST(SegmentSheets, HaveTheSameBitsWithAnyNumberOfThreads) {
  const TriMesh mesh = support::joined(support::sphereWithHoledDiaphragm(V3d(0.01), 0.4, 12),
                                       support::kleinMesh(0.4, tiltedFrame(V3d(0, 0, 3), 10)));
  const auto run = [&](std::size_t threads) {
    return support::onThreads(threads, [&] {
      const SegmentMeshResult result = segmentSheets(mesh, 0.1);
      return std::pair(result.field.contentHash(), segmentedToMesh(result.field).mesh.positions);
    });
  };
  const auto one = run(1), two = run(2);
  EXPECT_EQ(one.first, two.first);
  EXPECT_TRUE(one.second == two.second);
}

TEST(SegmentSheets, Refuse) {
  const TriMesh disk = support::ringMesh(0, 1, tiltedFrame(kOffGrid, 15));
  try {
    (void)segmentMesh(disk, 0.1);
    ADD_FAILURE() << "a disk without keepsSheets";
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("keep such sheets with --sheets"), std::string::npos);
  }
  TriMesh broken = disk;
  broken.positions[5].x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)segmentSheets(broken, 0.1), InvalidInput);
  EXPECT_THROW((void)segmentSheets(TriMesh(), 0.1), InvalidInput);
  EXPECT_THROW((void)segmentMesh(disk, 0.1, {.keepsSheets = true, .maxMemory = 1000}),
               ResourceLimit);
  EXPECT_THROW(
      (void)segmentMesh(disk, 0.1, {.keepsSheets = true, .progress = [](double) { return false; }}),
      Cancelled);
  const SegmentedField field = segmentSheets(disk, 0.1).field;
  EXPECT_THROW((void)extractLabel(field, kVoid), UsageError);
  EXPECT_THROW((void)extractLabel(field, 1), NoSurface);
  EXPECT_TRUE(regionSurface(field, 1).isEmpty());
}

}  // namespace segment_sheets_test
