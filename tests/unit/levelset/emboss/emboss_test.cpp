#include "levelset/emboss/emboss.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace emboss_test {

using namespace levelset;
using Imath::V2d;
using Imath::V3d;
using std::numbers::pi;

const char* const kNames[] = {"round", "flat", "sharp", "smooth"};

EmbossOptions with(EmbossProfile profile) {
  return {.profile = profile};
}
EmbossCurveShape through(std::vector<V3d> points) {
  return {.points = std::move(points)};
}
EmbossCurveShape at(std::vector<V3d> points) {
  return {.points = std::move(points), .isJoined = false};
}

/// Box with a large upper face in the plane z = `top`.
NarrowBand ground(double top, double voxel) {
  return makeBox(V3d(1.8, 1.8, 1), V3d(0, 0, top - 0.5), voxel);
}

double segmentDistance(const V3d& p, const V3d& a, const V3d& b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).length2(), 0.0, 1.0);
  return (p - a - t * (b - a)).length();
}

double height(EmbossProfile profile, double u) {
  if (u >= 1) return 0;
  if (profile == EmbossProfile::Round) return std::sqrt(1 - u * u);
  if (profile == EmbossProfile::Flat) return 1;
  if (profile == EmbossProfile::Sharp) return 1 - u;
  return std::pow(1 - u * u, 3);
}

/// Unsigned distance from a point of the half plane (d, φ) to the section, by a fine polyline.
class Section {
 public:
  Section(EmbossProfile profile, double width, double most) {
    constexpr int kSteps = 300;
    for (int i = 0; i <= kSteps; ++i) {
      const double u = std::sin(pi / 2 * i / kSteps);
      nodes_.emplace_back(width * u, most * height(profile, i < kSteps ? u : 1));
    }
    if (profile == EmbossProfile::Flat) nodes_.insert(nodes_.end() - 1, V2d(width, most));
    nodes_.emplace_back(width + 100, 0);
  }
  [[nodiscard]] double distance(const V2d& p) const {
    double least = 1e9;
    for (std::size_t i = 0; i + 1 < nodes_.size(); ++i) {
      const V2d &a = nodes_[i], &b = nodes_[i + 1];
      const double t = std::clamp((p - a).dot(b - a) / (b - a).length2(), 0.0, 1.0);
      least = std::min(least, (p - a - t * (b - a)).length2());
    }
    return std::sqrt(least);
  }

 private:
  std::vector<V2d> nodes_;
};

/// Largest errors of a band by the side of the surface, voxels.
struct Errors {
  double inside = 0, outside = 0, mean = 0;
};

constexpr double kWidth = 0.3, kHeight = 0.2, kTop = 0.0137;
const V3d kBegin(-0.31, -0.13, kTop), kEnd(0.27, 0.21, kTop);

/// Errors of the distances to a plane that is embossed along a segment, at every eleventh
/// voxel near it.
Errors errorsOnPlane(EmbossProfile profile, double most, double voxel) {
  const NarrowBand made =
      emboss(ground(kTop, voxel), through({kBegin, kEnd}), kWidth, most, with(profile));
  EXPECT_EQ(made.halfWidth(), 3);
  const Section section(profile, kWidth, most);
  Errors errors;
  int count = 0, sampled = 0;
  support::forEachActive(made, [&](const V3d& p, double value) {
    const V3d onPlane(p.x, p.y, kTop);
    const double d = segmentDistance(onPlane, kBegin, kEnd);
    if (d > kWidth + 3 * voxel || p.z < kTop - 0.4 || ++count % 11 != 0) return;
    const double least = section.distance({d, p.z - kTop});
    const bool isInside = p.z - kTop < most * height(profile, d / kWidth);
    const double error = std::abs(value - (isInside ? -least : least)) / voxel;
    double& side = isInside ? errors.inside : errors.outside;
    side = std::max(side, error);
    errors.mean += error;
    ++sampled;
  });
  EXPECT_GT(sampled, 100);
  errors.mean /= sampled;
  return errors;
}

struct PlaneFigures {
  EmbossProfile profile;
  double height, voxel;
  double inside, outside, mean;  ///< voxels
};

TEST(Emboss, GivesAPlaneTheProfileOnBothSides) {
  const std::vector<PlaneFigures> measured = {
      {EmbossProfile::Round, kHeight, 0.04, 0.245, 0.145, 0.0189},
      {EmbossProfile::Round, -kHeight, 0.04, 0.171, 0.311, 0.0189},
      {EmbossProfile::Flat, kHeight, 0.04, 0.286, 0.261, 0.0145},
      {EmbossProfile::Flat, -kHeight, 0.04, 0.309, 0.258, 0.0176},
      {EmbossProfile::Sharp, kHeight, 0.04, 0.133, 0.312, 0.00863},
      {EmbossProfile::Sharp, -kHeight, 0.04, 0.291, 0.15, 0.00769},
      {EmbossProfile::Smooth, kHeight, 0.04, 0.0142, 0.0115, 0.00107},
      {EmbossProfile::Smooth, -kHeight, 0.04, 0.0115, 0.0093, 0.00104},
      {EmbossProfile::Smooth, 0.3 * 0.04, 0.04, 0.000288, 0.000301,
       3.8e-05},  // a height below one voxel
  };
  for (const PlaneFigures& m : measured) {
    const Errors found = errorsOnPlane(m.profile, m.height, m.voxel);
    const std::string what = std::string(kNames[static_cast<int>(m.profile)]) + " " +
                             std::to_string(m.height) + ": " + std::to_string(found.inside) + " " +
                             std::to_string(found.outside) + " " + std::to_string(found.mean);
    EXPECT_LE(found.inside, support::measured(m.inside)) << what;
    EXPECT_LE(found.outside, support::measured(m.outside)) << what;
    EXPECT_LE(found.mean, support::measured(m.mean)) << what;
  }
}

/// Ball embossed at a point of its surface: a surface of revolution. Returns the largest distance,
/// voxels, of the zeros of the band's tricubic interpolant from it, to first order.
double errorOnBall(double most, double width, double voxel) {
  const V3d centre(0.013, 0.029, 0.017), axis = V3d(1, 2, 3).normalized();
  const NarrowBand made = emboss(makeSphere(1, centre, voxel), at({centre + axis}), width, most,
                                 with(EmbossProfile::Smooth));
  EXPECT_TRUE(check(made).passed());
  const BandSampler phi(made, Interpolation::Tricubic);
  double worst = 0;
  int compared = 0;
  support::forEachActive(made, [&](const V3d& p, double value) {
    if (std::abs(value) > 1.5 * voxel) return;
    V3d q = p;
    for (int i = 0; i < 4; ++i) q -= phi.normal(q) * phi.value(q);
    q -= centre;
    const double r = q.length(), d = (q / r - axis).length(), u = d / width;
    if (u > 1.2) return;
    const double slope = u < 1 ? -6 * most / width * u * (1 - u * u) * (1 - u * u) : 0;
    const double along = slope * std::sqrt(1 - d * d / 4) / r;  // by the arc length at q
    worst = std::max(
        worst, std::abs(r - 1 - most * height(EmbossProfile::Smooth, u)) / std::hypot(1, along));
    ++compared;
  });
  EXPECT_GT(compared, 50);
  return worst / voxel;
}

TEST(Emboss, RaisesAndSinksABallWithSecondOrder) {
  const struct {
    double height;
    std::array<double, 3> measured;  // voxels
  } cases[] = {{0.3, {0.00846, 0.00247, 0.000671}}, {-0.3, {0.048, 0.00841, 0.00199}}};
  for (const auto& [most, measured] : cases) {
    std::array<double, 3> errors;
    for (std::size_t i = 0; i < 3; ++i) {
      const double voxel = 0.12 / std::pow(2, i);
      errors[i] = errorOnBall(most, 0.7, voxel);
      EXPECT_LE(errors[i], support::measured(measured[i])) << most << " " << voxel;
      errors[i] *= voxel;
    }
    EXPECT_GT(std::log2(errors[0] / errors[2]) / 2, support::measuredOrder(2.82)) << most;
  }
}

TEST(Emboss, AddsAndRemovesTheVolumeOfTheProfile) {
  const NarrowBand block = makeBox(V3d(1.4, 1.4, 1.4), V3d(0.01), 0.05);
  const double before = measure(block).volume, disc = pi * 0.4 * 0.4 * 0.5;
  const struct {
    EmbossProfile profile;
    double height, ofCylinder, measured;
  } cases[] = {{EmbossProfile::Round, -0.5, 2.0 / 3, 0.00879},
               {EmbossProfile::Flat, 0.5, 1, 0.00895},
               {EmbossProfile::Sharp, 0.5, 1.0 / 3, 0.00466},
               {EmbossProfile::Smooth, -0.5, 0.25, 0.00154}};
  for (const auto& [profile, most, ofCylinder, measured] : cases) {
    const NarrowBand made = emboss(block, at({V3d(0.1, -0.05, 0.71)}), 0.4, most, with(profile));
    const double change = (measure(made).volume - before) / (std::copysign(disc, most));
    EXPECT_NEAR(change, ofCylinder, support::measured(measured) * ofCylinder);
    EXPECT_TRUE(check(made).passed()) << kNames[static_cast<int>(profile)] << most;
  }
}

TEST(Emboss, ReturnsTheSolidWithoutAHeight) {
  const NarrowBand ball = makeSphere(1, V3d(0.01), 0.05);
  EXPECT_EQ(emboss(ball, at({V3d(0, 0, 1)}), 0.3, 0).contentHash(), ball.contentHash());
}

TEST(Emboss, KeepsTheBitsOutOfReach) {
  const NarrowBand ball = makeSphere(1, V3d(0.01, 0.02, 0.03), 0.06);
  const V3d a(0, 0, 1.03), b(0.3, 0, 0.95);
  for (const EmbossProfile profile : {EmbossProfile::Round, EmbossProfile::Flat})
    for (const double most : {0.15, -0.15}) {
      const NarrowBand made = emboss(ball, through({a, b}), 0.2, most, with(profile));
      openvdb::CoordBBox box = vdb(ball).evalActiveVoxelBoundingBox();
      box.expand(vdb(made).evalActiveVoxelBoundingBox());
      const auto old = vdb(ball).getConstAccessor(), now = vdb(made).getConstAccessor();
      std::size_t far = 0, near = 0, changed = 0;
      for (auto c = box.begin(); c; ++c) {
        const double d = segmentDistance(toImath(vdb(ball).indexToWorld(*c)), a, b);
        const bool isEqual =
            old.getValue(*c) == now.getValue(*c) && old.isValueOn(*c) == now.isValueOn(*c);
        if (d < 0.2 + 0.15 + 3 * 0.06 + 2 * 0.06) {
          ++near;
          changed += !isEqual;
          continue;
        }
        ++far;
        if (!isEqual) ADD_FAILURE() << *c << ", " << d << " from the curve";
      }
      EXPECT_GT(far, 10000u);
      EXPECT_GT(changed, near / 10);
    }
}

TEST(Emboss, SinksAPlaneLikeTheMirroredRise) {
  // The plane lies between two layers of grid points.
  const double voxel = 0.04, top = 0.5 * voxel;
  const NarrowBand flat = ground(top, voxel);
  const EmbossCurveShape curve = through({V3d(-0.2, 0.03, top), V3d(0.1, 0.2, top)});
  // Creases are rounded differently in convex and concave places.
  const std::pair<EmbossProfile, double> cases[] = {{EmbossProfile::Sharp, 0.287},
                                                    {EmbossProfile::Smooth, 2.8e-7}};
  for (const auto& [profile, measured] : cases) {
    const NarrowBand up = emboss(flat, curve, 0.2, 0.17, with(profile)),
                     down = emboss(flat, curve, 0.2, -0.17, with(profile));
    const auto below = vdb(down).getConstAccessor();
    double worst = 0;
    for (auto it = vdb(up).cbeginValueOn(); it; ++it) {
      const openvdb::Coord c = it.getCoord();
      if (std::abs(c.x()) > 15 || std::abs(c.y()) > 15 || std::abs(c.z()) > 10) continue;
      const openvdb::Coord mirrored(c.x(), c.y(), 1 - c.z());
      worst = std::max(worst, static_cast<double>(std::abs(*it + below.getValue(mirrored))));
    }
    EXPECT_LE(worst / voxel, support::measured(measured)) << kNames[static_cast<int>(profile)];
  }
}

TEST(Emboss, TreatsDegenerateCurvesLikePoints) {
  const NarrowBand ball = makeSphere(1, V3d(0.01), 0.08);
  const V3d a(0, 0, 1), b(0.5, 0, 0.87), c(0, 0.5, 0.87);
  const auto hash = [&](const EmbossCurveShape& curve) {
    return emboss(ball, curve, 0.25, 0.1).contentHash();
  };
  const std::uint64_t point = hash(at({a}));
  EXPECT_EQ(hash(through({a})), point);
  EXPECT_EQ(hash(through({a, a, a})), point);
  EXPECT_EQ(hash(at({a, a})), point);
  EXPECT_EQ(hash({.points = {a}, .isClosed = true, .isSpline = true}), point);
  EXPECT_NE(hash(through({a, b})), point);
  EXPECT_EQ(hash(through({a, b, b})), hash(through({a, b})));
  EXPECT_EQ(hash(through({a, b, c, a})), hash({.points = {a, b, c}, .isClosed = true}));
  EXPECT_NE(hash(through({a, b, c})), hash({.points = {a, b, c}, .isClosed = true}));
  EXPECT_NE(hash(through({a, b, c})), hash({.points = {a, b, c}, .isSpline = true}));
}

// A plate of thickness 0.4, its upper face at z = 0.2.
NarrowBand plate(double centre) {
  return makeBox(V3d(0.9, 0.9, 0.4), V3d(0.01, 0.01, centre), 0.05);
}

TEST(Emboss, SinksThroughAPlate) {
  const NarrowBand solid = plate(0.0071);
  const EmbossCurveShape curve = at({V3d(0.03, 0.02, 0.2071)});
  const double volume = measure(solid).volume;
  // The flat hole is a cylinder; the lower face is out of its width.
  const double depths[] = {0.1, 0.25, 3.0};
  for (const double depth : depths) {
    const NarrowBand made = emboss(solid, curve, 0.3, -depth, with(EmbossProfile::Flat));
    const Measurement m = measure(made);
    const double hole = pi * 0.3 * 0.3 * std::min(depth, 0.4);
    EXPECT_NEAR((volume - m.volume) / hole, 1, support::measured(0.0459)) << depth;
    EXPECT_TRUE(check(made).passed()) << depth;
  }
  // A ball much smaller than the depth is pierced.
  const NarrowBand ball = makeSphere(0.5, V3d(0.01), 0.04);
  const NarrowBand pierced = emboss(ball, at({V3d(0.01, 0.01, 0.51)}), 0.2, -2);
  EXPECT_LT(measure(pierced).volume, 0.95 * measure(ball).volume);
  EXPECT_TRUE(check(pierced).passed());
  EXPECT_THROW((void)emboss(ball, at({V3d(0.01)}), 1.2, -2, with(EmbossProfile::Flat)),
               InvalidInput);
}

TEST(Emboss, RisesToAnotherPartOfTheSurface) {
  const NarrowBand pair = unite(plate(0.0071), plate(0.8071));
  const EmbossCurveShape curve = at({V3d(0.03, 0.02, 0.2071)});
  const double volume = measure(pair).volume;
  for (const double height : {0.3, 0.6}) {
    const NarrowBand made = emboss(pair, curve, 0.3, height, with(EmbossProfile::Flat));
    const Measurement m = measure(made);
    const double post = pi * 0.3 * 0.3 * std::min(height, 0.4);
    EXPECT_NEAR((m.volume - volume) / post, 1, support::measured(0.0666)) << height;
    EXPECT_EQ(m.components, height < 0.4 ? 2u : 1u);
    EXPECT_TRUE(check(made).passed()) << height;
  }
}

TEST(Emboss, CutsAGrooveOverAnEdge) {
  // The groove runs over the edge x = 0.46 of the plate, at which it has its full depth.
  const NarrowBand solid = plate(0.0071);
  const double volume = measure(solid).volume;
  const NarrowBand made = emboss(solid, through({V3d(-2, 0.01, 0.2071), V3d(2, 0.01, 0.2071)}), 0.2,
                                 -0.15, with(EmbossProfile::Flat));
  // The curve is within the width of the end faces too: they sink around it.
  EXPECT_TRUE(check(made).passed());
  const BandSampler phi(made);
  for (double x = -0.55; x < 0.57; x += 0.02)
    for (const double depth : {0.03, 0.07, 0.11})
      EXPECT_GT(phi.value(V3d(x, 0.01, 0.2071 - depth)), 0) << x << " " << depth;
  EXPECT_NEAR((volume - measure(made).volume) / (0.4 * 0.15 * 0.9), 1, support::measured(0.0289));
}

TEST(Emboss, RefusesACurveFarFromTheSurface) {
  const NarrowBand ball = makeSphere(1, V3d(0.01, 0, 0), 0.05);
  for (const auto& [place, distance] :
       {std::pair(V3d(0.01, 0, 1.5), 0.5), {V3d(0.01, 0, 0.4), 0.6}, {V3d(100.01, 0, 0), 99}}) {
    try {
      (void)emboss(ball, at({place}), 0.3, 0.1);
      FAIL();
    } catch (const InvalidInput& e) {
      const std::string message = e.what(), begin = "the curve is ";
      ASSERT_EQ(message.substr(0, begin.size()), begin);
      EXPECT_NEAR(std::stod(message.substr(begin.size())), distance, support::measured(1e-4));
    }
  }
  // A part of the curve may be far away.
  EXPECT_NO_THROW((void)emboss(ball, through({V3d(0, 0, 1), V3d(0, 0, 9)}), 0.3, 0.1));
}

TEST(Emboss, RefusesWhatItCannotUse) {
  const NarrowBand ball = makeSphere(1, V3d(0), 0.1);
  const EmbossCurveShape curve = at({V3d(0, 0, 1)});
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    EXPECT_THROW((void)emboss(ball, curve, bad, 0.1), UsageError);
    EXPECT_THROW((void)emboss(ball, curve, 0.3, bad), UsageError);
    EXPECT_THROW((void)emboss(ball, curve, 0.3, 0.1, {.halfWidth = bad}), UsageError);
    EXPECT_THROW((void)emboss(ball, at({V3d(0, 0, 1), V3d(bad, 0, 1)}), 0.3, 0.1), UsageError);
  }
  EXPECT_THROW((void)emboss(ball, curve, 0, 0.1), UsageError);
  EXPECT_THROW((void)emboss(ball, curve, -1, 0.1), UsageError);
  EXPECT_THROW((void)emboss(ball, at({}), 0.3, 0.1), UsageError);
  EXPECT_THROW((void)emboss(NarrowBand(), curve, 0.3, 0.1), InvalidInput);
  EXPECT_THROW((void)emboss(ball, curve, 0.3, 0.1, {.maxMemory = 1000}), ResourceLimit);
  EXPECT_THROW((void)emboss(ball, curve, 0.3, 0.1, {.progress = [](double) { return false; }}),
               Cancelled);
}

TEST(Emboss, MakesBandsOfOtherHalfWidths) {
  for (const double before : {2.0, 3.0, 6.0}) {
    const NarrowBand ball = makeSphere(1, V3d(0.01), 0.08, {.halfWidth = before});
    for (const std::optional<double> after : {std::optional<double>{}, {2.0}, {5.0}}) {
      const NarrowBand made = emboss(ball, at({V3d(0, 0, 1)}), 0.4, 0.15, {.halfWidth = after});
      EXPECT_EQ(made.halfWidth(), after.value_or(before));
      EXPECT_TRUE(check(made).passed());
      EXPECT_NEAR(measure(made).bounds.max.z, 1.01 + 0.15, 0.05);
    }
  }
}

TEST(Emboss, HasTheSameBitsForAnyNumberOfThreads) {
  const NarrowBand ball = makeSphere(1, V3d(0.01), 0.04);
  const auto run = [&] {
    return emboss(ball, through({V3d(0, 0, 1), V3d(0.6, 0, 0.8)}), 0.2, 0.1).contentHash();
  };
  const std::uint64_t one = support::onThreads(1, run);
  for (const std::size_t threads : {2, 3, 8}) EXPECT_EQ(support::onThreads(threads, run), one);
}

}  // namespace emboss_test
