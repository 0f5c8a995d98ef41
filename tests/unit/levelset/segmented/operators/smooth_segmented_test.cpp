// Motion of the interfaces of a partition by mean curvature: speed, angles, volumes.

#include "levelset/segmented/operators/smooth_segmented.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "levelset/curvature_flow/curvature_flow.h"
#include "levelset/error.h"
#include "levelset/inspect/compare.h"
#include "levelset/segmented/meshing/extract_label.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/measured.h"
#include "tests/support/segmented.h"
#include "tests/support/threads.h"

namespace smooth_segmented_test {

using namespace levelset;
using Imath::V3d;
using std::numbers::pi;
using support::interfaceDefects;
using support::InterfaceDefects;
using support::measured;
using support::measuredOrder;

const V3d kCentre(0.013, 0.021, 0.037);

SegmentedField ball(double radius, double voxel) {
  return segmentSolids(std::vector<NarrowBand>{makeSphere(radius, kCentre, voxel)}).field;
}

TEST(SmoothSegmented, ShrinksBallsWithSecondOrder) {
  constexpr double kTime = 0.1;
  const double exact = std::sqrt(1 - 4 * kTime);
  std::vector<double> errors;
  for (const double voxel : {0.2, 0.1 * std::numbers::sqrt2, 0.1}) {
    const SmoothSegmentedResult result = smoothSegmented(ball(1, voxel), kTime);
    const SegmentedMesh mesh = segmentedToMesh(result.field);
    double sum = 0;
    for (const V3d& p : mesh.mesh.positions) sum += (p - kCentre).length() - exact;
    errors.push_back(std::abs(sum) / static_cast<double>(mesh.mesh.positions.size()));
  }
  EXPECT_LT(errors[0], measured(0.0110));
  EXPECT_LT(errors[2], measured(0.0027));
  EXPECT_GT(std::log2(errors[0] / errors[2]), measuredOrder(2.06));
}

/// The kernel at junctions averages over ten voxels. A ball of six voxels elsewhere must not be
/// affected.
TEST(SmoothSegmented, MovesSmallBallsAwayFromJunctionsAtTheirSpeed) {
  constexpr double kTime = 0.05, kVoxel = 0.1, kRadius = 0.6;
  const std::vector<NarrowBand> solids{makeSphere(1, V3d(0), kVoxel),
                                       makeSphere(1, V3d(1.2, 0, 0), kVoxel),
                                       makeSphere(kRadius, V3d(-3, 0, 0), kVoxel)};
  const SegmentedField field = segmentSolids(solids).field;
  ASSERT_GT(measureSegmented(field).junctionLength, 1);
  const double volume = measureSegmented(smoothSegmented(field, kTime).field).regions[3].volume,
               radius = std::cbrt(volume / (4 * pi / 3)),
               exact = std::sqrt(kRadius * kRadius - 4 * kTime);
  EXPECT_LT(std::abs(radius - exact), measured(6.2e-3));
}

TEST(SmoothSegmented, AgreesWithCurvatureFlow) {
  constexpr double kTime = 0.05, kVoxel = 0.1;
  // A peanut: its waist moves outwards, its ends move inwards.
  const NarrowBand solid = support::sampleBand(
      [](const V3d& p) {
        const double a = (p - V3d(0.5, 0, 0)).length() - 0.8,
                     b = (p + V3d(0.5, 0, 0)).length() - 0.8;
        return -std::log(std::exp(-4 * a) + std::exp(-4 * b)) / 4;
      },
      {V3d(-1.5), V3d(1.5)}, kVoxel, 4);
  const NarrowBand smooth = curvatureFlow(solid, kTime).band;
  const SegmentedField field =
      smoothSegmented(segmentSolids(std::vector<NarrowBand>{solid}).field, kTime).field;
  const Comparison difference = compare(extractLabel(field, 1), smooth);
  EXPECT_LT(difference.hausdorff() / kVoxel, measured(0.0332));  // voxels
  // The surface has moved by more than a voxel.
  EXPECT_GT(compare(solid, smooth).hausdorff() / kVoxel, 1);
}

/// Point in a plane across a junction.
struct PlanePoint {
  double x, y;
};

/// Direction in which an interface leaves a junction, radians. Fits a parabola to its vertices from
/// 2 to 6 voxels off the junction.
/// @param place  position of a point in the plane; empty: the point does not count
template <typename Place>
double directionOf(const SegmentedMesh& mesh, TriangleSides sides, const PlanePoint& junction,
                   double voxel, const Place& place) {
  std::vector<std::uint32_t> vertices;
  for (std::size_t t = 0; t < mesh.sides.size(); ++t)
    if (mesh.sides[t] == sides)
      vertices.insert(vertices.end(), mesh.mesh.triangles[t].begin(), mesh.mesh.triangles[t].end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  // Unit vectors from the junction are linear in the distance, along a parabola.
  double n = 0, s1 = 0, s2 = 0, x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  for (const std::uint32_t v : vertices) {
    const std::optional<PlanePoint> p = place(mesh.mesh.positions[v]);
    if (!p) continue;
    const double x = p->x - junction.x, y = p->y - junction.y, s = std::hypot(x, y);
    if (s < 2 * voxel || s > 6 * voxel) continue;
    n += 1;
    s1 += s;
    s2 += s * s;
    x0 += x / s;
    x1 += x;
    y0 += y / s;
    y1 += y;
  }
  return std::atan2(y0 * s2 - y1 * s1, x0 * s2 - x1 * s1);
}

/// Largest difference of the three angles at a junction from 120°, degrees.
/// @param labels  of the regions that meet there, ascending
template <typename Place>
double angleError(const SegmentedMesh& mesh, const std::array<RegionLabel, 3>& labels, double voxel,
                  const Place& place) {
  PlanePoint junction{0, 0};
  double count = 0;
  for (const JunctionEdge& edge : mesh.junctions) {
    if (edge.labels != labels) continue;
    const std::optional<PlanePoint> p = place(mesh.mesh.positions[edge.vertices[0]]);
    if (!p) continue;
    junction.x += p->x;
    junction.y += p->y;
    ++count;
  }
  junction.x /= count;
  junction.y /= count;
  std::array<double, 3> directions = {
      directionOf(mesh, {labels[1], labels[0]}, junction, voxel, place),
      directionOf(mesh, {labels[2], labels[0]}, junction, voxel, place),
      directionOf(mesh, {labels[2], labels[1]}, junction, voxel, place)};
  std::sort(directions.begin(), directions.end());
  double worst = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double next = k < 2 ? directions[k + 1] : directions[0] + 2 * pi;
    worst = std::max(worst, std::abs(next - directions[k] - 2 * pi / 3) * 180 / pi);
  }
  return worst;
}

/// Prism over a triangle with equal sides, cut by three half-planes that meet at right and straight
/// angles. Three straight interfaces at 120° that end on the sides are at rest.
constexpr double kInradius = 0.7, kHalfHeight = 0.25;
SegmentedField junctionInAPrism(double voxel) {
  const auto prism = [](const V3d& p) {
    double d = std::abs(p.z) - kHalfHeight;
    for (int k = 0; k < 3; ++k) {
      const double angle = 2 * pi / 3 * k;
      d = std::max(d, p.x * std::cos(angle) + p.y * std::sin(angle) - kInradius);
    }
    return d;
  };
  const auto part = [&](double sign) {
    return support::sampleBand(
        [&, sign](const V3d& p) {
          return std::max({prism(p), 0.013 - p.x, sign * (p.y - 0.021)});
        },
        {V3d(-2 * kInradius, -2, -kHalfHeight), V3d(kInradius, 2, kHalfHeight)}, voxel);
  };
  const NarrowBand whole = support::sampleBand(
      prism, {V3d(-2 * kInradius, -2, -kHalfHeight), V3d(kInradius, 2, kHalfHeight)}, voxel);
  return segmentSolids(std::vector<NarrowBand>{whole, part(1), part(-1)}).field;
}
std::optional<PlanePoint> inThePrism(const V3d& p) {
  if (std::abs(p.z) > kHalfHeight / 2) return {};
  return PlanePoint{p.x, p.y};
}

TEST(SmoothSegmented, RelaxesAStraightJunctionTo120Degrees) {
  constexpr double kVoxel = 0.1;
  const SegmentedField field = junctionInAPrism(kVoxel);
  const std::array<RegionLabel, 3> labels = {1, 2, 3};
  // 180° in place of 120°.
  EXPECT_GT(angleError(segmentedToMesh(field), labels, kVoxel, inThePrism), 50);
  const SmoothSegmentedResult result = smoothSegmented(field, 0.5, {.steps = 25, .fixed = {kVoid}});
  const SegmentedMesh mesh = segmentedToMesh(result.field);
  EXPECT_LT(angleError(mesh, labels, kVoxel, inThePrism), measured(0.883, 1));
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  // The walls do not move.
  const SegmentedMeasurement before = measureSegmented(field), after = measureSegmented(mesh);
  EXPECT_NEAR(after.volume / before.volume, 1, measured(2.5e-3));
}

/// Ball cut into two equal halves.
SegmentedField halves(double voxel, const V3d& axis) {
  std::vector<NarrowBand> solids;
  for (const double sign : {1.0, -1.0})
    solids.push_back(support::sampleBand(
        [&](const V3d& p) {
          return std::max(sign * (p - kCentre).dot(axis), (p - kCentre).length() - 1);
        },
        {kCentre - V3d(1), kCentre + V3d(1)}, voxel));
  return segmentSolids(solids).field;
}

/// Standard double bubble with two volumes of 2 π / 3: caps of one radius r, which meet a flat disc
/// at 120°. Each bubble has the volume 9 π r³ / 8.
SegmentedField doubleBubble(double voxel, const V3d& axis) {
  const double r = std::cbrt(16.0 / 27);
  std::vector<NarrowBand> solids;
  for (const double sign : {1.0, -1.0})
    solids.push_back(support::sampleBand(
        [&](const V3d& p) {
          return std::max(sign * (p - kCentre).dot(axis),
                          (p - kCentre + axis * (sign * r / 2)).length() - r);
        },
        {kCentre - V3d(1.5), kCentre + V3d(1.5)}, voxel));
  return segmentSolids(solids).field;
}

/// Largest relative differences of a partition from the standard double bubble. The errors of the
/// mesh itself cancel, as both are on one grid.
struct BubbleErrors {
  double volume = 0, cap = 0, disc = 0, angle = 0;
};
BubbleErrors bubbleErrors(const SegmentedField& field, double voxel, const V3d& axis) {
  const SegmentedMesh mesh = segmentedToMesh(field);
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  const SegmentedMeasurement m = measureSegmented(mesh),
                             exact = measureSegmented(doubleBubble(voxel, axis));
  BubbleErrors errors;
  for (std::size_t k = 0; k < 2; ++k) {
    errors.volume = std::max(errors.volume,
                             std::abs(m.regions[k + 1].volume / exact.regions[k + 1].volume - 1));
    errors.cap =
        std::max(errors.cap, std::abs(m.interfaces[k].area / exact.interfaces[k].area - 1));
  }
  errors.disc = std::abs(m.interfaces[2].area / exact.interfaces[2].area - 1);
  errors.angle = angleError(mesh, {0, 1, 2}, voxel, [&](const V3d& world) {
    const V3d p = world - kCentre;
    const double along = p.dot(axis);
    return std::optional<PlanePoint>(PlanePoint{along, (p - axis * along).length()});
  });
  return errors;
}

TEST(SmoothSegmented, RelaxesToTheStandardDoubleBubble) {
  constexpr double kVoxel = 0.15;
  const V3d axis(0.6, 0.48, 0.64);
  const BubbleErrors before = bubbleErrors(halves(kVoxel, axis), kVoxel, axis),
                     after = bubbleErrors(
                         smoothSegmented(halves(kVoxel, axis), 1.8, {.keepsVolumes = true}).field,
                         kVoxel, axis);
  EXPECT_LT(after.volume, measured(2.9e-3));
  EXPECT_LT(after.cap, measured(2.5e-3));
  EXPECT_LT(after.disc, measured(2.6e-4));
  EXPECT_LT(after.angle, measured(0.466, 1));
  EXPECT_GT(before.disc, 0.8);
  EXPECT_GT(before.angle, 50);
}

TEST(SmoothSegmented, KeepsTheStandardDoubleBubble) {
  constexpr double kVoxel = 0.1;
  const V3d axis(0.6, 0.48, 0.64);
  const BubbleErrors errors =
      bubbleErrors(smoothSegmented(doubleBubble(kVoxel, axis), 0.02, {.keepsVolumes = true}).field,
                   kVoxel, axis);
  EXPECT_LT(errors.volume, measured(3.82e-5));
  EXPECT_LT(errors.cap, measured(1.27e-4));
  EXPECT_LT(errors.disc, measured(2.96e-4));
  EXPECT_LT(errors.angle, measured(0.652));  // the exact field has 0.61
}

TEST(SlowSmoothSegmented, KeepsTheStandardDoubleBubbleAtThreeResolutions) {
  const V3d axis(0.6, 0.48, 0.64);
  std::vector<BubbleErrors> errors;
  for (const double voxel : {0.1 * std::numbers::sqrt2, 0.1, 0.05 * std::numbers::sqrt2})
    errors.push_back(
        bubbleErrors(smoothSegmented(doubleBubble(voxel, axis), 0.05, {.keepsVolumes = true}).field,
                     voxel, axis));
  const BubbleErrors figures[] = {
      {.volume = 5.6e-5, .cap = 4.1e-4, .disc = 1.65e-3, .angle = 0.92},
      {.volume = 2.3e-5, .cap = 1.4e-4, .disc = 3.5e-4, .angle = 0.58},
      {.volume = 2.9e-5, .cap = 4.7e-4, .disc = 2.3e-3, .angle = 0.051}};
  for (std::size_t n = 0; n < 3; ++n) {
    EXPECT_LT(errors[n].cap, measured(figures[n].cap));
    EXPECT_LT(errors[n].disc, measured(figures[n].disc));
    EXPECT_LT(errors[n].volume, measured(figures[n].volume));
    EXPECT_LT(errors[n].angle, measured(figures[n].angle, 1));
  }
}

/// Standard triple bubble with equal volumes: caps of radius r, about centres r / √3 from an axis,
/// and three flat walls that meet on it at 120°.
constexpr double kTripleRadius = 0.75;
V3d tripleCentre(const support::Frame& frame, int k) {
  const double angle = 2 * pi / 3 * k;
  return frame.centre +
         (frame.x * std::cos(angle) + frame.y * std::sin(angle)) * (kTripleRadius / std::sqrt(3.0));
}
SegmentedField tripleBubble(const support::Frame& frame, double voxel) {
  std::vector<NarrowBand> solids;
  for (int k = 0; k < 3; ++k)
    solids.push_back(support::sampleBand(
        [&](const V3d& p) {
          return std::max(support::sectorDistance(frame, k, p),
                          (p - tripleCentre(frame, k)).length() - kTripleRadius);
        },
        {frame.centre - V3d(1.3), frame.centre + V3d(1.3)}, voxel));
  return segmentSolids(solids).field;
}

/// Largest errors of a triple bubble: relative to the mesh of the exact one, and angles in degrees.
struct TripleErrors {
  double volume = 0, cap = 0, wall = 0, axisAngle = 0, rimAngle = 0;
};
TripleErrors tripleErrors(const SegmentedField& field, const support::Frame& frame, double voxel) {
  const SegmentedMesh mesh = segmentedToMesh(field);
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  EXPECT_EQ(mesh.junctionPoints.size(), 2u);
  const SegmentedMeasurement m = measureSegmented(mesh),
                             exact = measureSegmented(tripleBubble(frame, voxel));
  TripleErrors errors;
  for (std::size_t k = 1; k < 4; ++k)
    errors.volume =
        std::max(errors.volume, std::abs(m.regions[k].volume / exact.regions[k].volume - 1));
  for (std::size_t k = 0; k < 6; ++k) {
    double& worst = m.interfaces[k].sides.front == kVoid ? errors.cap : errors.wall;
    worst = std::max(worst, std::abs(m.interfaces[k].area / exact.interfaces[k].area - 1));
  }
  errors.axisAngle = angleError(mesh, {1, 2, 3}, voxel, [&](const V3d& world) {
    const V3d p = world - frame.centre;
    if (std::abs(p ^ frame.z) > 0.25) return std::optional<PlanePoint>();
    return std::optional<PlanePoint>(PlanePoint{p ^ frame.x, p ^ frame.y});
  });
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3;
    // The rim of a wall is a circle about the line through both centres.
    const V3d a = tripleCentre(frame, k), b = tripleCentre(frame, l), middle = (a + b) / 2,
              normal = (b - a).normalized(), outwards = (middle - frame.centre).normalized();
    const auto low = static_cast<RegionLabel>(std::min(k, l) + 1),
               high = static_cast<RegionLabel>(std::max(k, l) + 1);
    const auto place = [&](const V3d& world) {
      const V3d p = world - middle;
      const double along = p ^ normal;
      const V3d flat = p - normal * along;
      if ((flat ^ outwards) < 0.8 * flat.length()) return std::optional<PlanePoint>();
      return std::optional<PlanePoint>(PlanePoint{along, flat.length()});
    };
    errors.rimAngle = std::max(errors.rimAngle, angleError(mesh, {kVoid, low, high}, voxel, place));
  }
  return errors;
}

TEST(SlowSmoothSegmented, KeepsTheStandardTripleBubble) {
  const support::Frame frame = support::turnedFrame(kCentre, 0.7);
  std::vector<TripleErrors> errors;
  for (const double voxel : {0.1 * std::numbers::sqrt2, 0.1, 0.05 * std::numbers::sqrt2}) {
    const SegmentedField field = tripleBubble(frame, voxel);
    errors.push_back(
        tripleErrors(smoothSegmented(field, 0.025, {.keepsVolumes = true}).field, frame, voxel));
    const TripleErrors& e = errors.back();
    EXPECT_LT(e.volume, measured(3.2e-4));
    EXPECT_LT(e.cap, measured(7.44e-4));
    EXPECT_LT(e.axisAngle, measured(0.146));
  }
  EXPECT_LT(errors[0].wall, measured(5.6e-3));
  EXPECT_LT(errors[0].rimAngle, measured(1.27));
  EXPECT_LT(errors[2].rimAngle, measured(0.654, 1));
  EXPECT_GT(std::log2(errors[0].wall / errors[2].wall), measuredOrder(2.03));
}

TEST(SmoothSegmented, KeepsTheVolumesOfATripleBubble) {
  constexpr double kVoxel = 0.15;
  const support::Frame frame = support::turnedFrame(kCentre, 0.7);
  const SegmentedField field = segmentSolids(support::ballSectors(frame, 1, kVoxel)).field;
  const SmoothSegmentedResult result = smoothSegmented(field, 0.05, {.keepsVolumes = true});
  const SegmentedMesh mesh = segmentedToMesh(result.field);
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  EXPECT_EQ(mesh.junctionPoints.size(), 2u);
  const SegmentedMeasurement m = measureSegmented(mesh), before = measureSegmented(field);
  // The errors of the meshes of the ball and of the bubbles differ.
  for (std::size_t k = 1; k < 4; ++k)
    EXPECT_NEAR(m.regions[k].volume / before.regions[k].volume, 1, measured(0.0243));
  // Less area than before.
  EXPECT_LT(m.area, before.area);
}

TEST(SmoothSegmented, ReportsRegionsThatVanish) {
  // The smaller ball vanishes at R² / 4.
  const SegmentedField field =
      segmentSolids(
          std::vector<NarrowBand>{makeSphere(0.4, V3d(2, 0, 0), 0.1), makeSphere(1, V3d(0), 0.1)},
          {.labels = {7, 9}})
          .field;
  const SmoothSegmentedResult result = smoothSegmented(field, 0.06, {.steps = 11});
  ASSERT_EQ(result.vanished.size(), 1u);
  EXPECT_EQ(result.vanished[0].label, 7);
  EXPECT_NEAR(result.vanished[0].time, 0.04, measured(0.01));
  EXPECT_EQ(result.field.labels(), (std::vector<RegionLabel>{9}));
  EXPECT_THROW((void)smoothSegmented(ball(0.4, 0.1), 0.1), InvalidInput);
}

TEST(SmoothSegmented, HasTheSameBitsWithAnyNumberOfThreads) {
  const SegmentedField field = halves(0.2, V3d(0.6, 0.48, 0.64));
  const auto run = [&](std::size_t threads) {
    return support::onThreads(threads, [&] {
      return smoothSegmented(field, 0.05, {.keepsVolumes = true}).field.contentHash();
    });
  };
  EXPECT_EQ(run(1), run(2));
}

TEST(SmoothSegmented, Refuses) {
  const SegmentedField field = ball(1, 0.2);
  const auto refuse = [&](double time, const SmoothSegmentedOptions& options) {
    (void)smoothSegmented(field, time, options);
  };
  EXPECT_EQ(smoothSegmented(field, 0).field.contentHash(), field.contentHash());
  EXPECT_THROW(refuse(-1, {}), UsageError);
  EXPECT_THROW(refuse(NAN, {}), UsageError);
  EXPECT_THROW(refuse(0.1, {.steps = 0}), UsageError);
  EXPECT_THROW(refuse(0.2, {.steps = 1}), UsageError);
  EXPECT_THROW(refuse(0.1, {.fixed = {3}}), UsageError);
  EXPECT_THROW(refuse(0.1, {.maxMemory = 1000}), ResourceLimit);
  EXPECT_THROW(refuse(0.1, {.progress = [](double) { return false; }}), Cancelled);
  EXPECT_THROW((void)smoothSegmented(SegmentedField(), 0.1), InvalidInput);
}

}  // namespace smooth_segmented_test
