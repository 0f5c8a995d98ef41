#include "levelset/convert/surface_band.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "levelset/advection/advect.h"
#include "levelset/components/components.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/csg/blend.h"
#include "levelset/csg/clip.h"
#include "levelset/csg/csg.h"
#include "levelset/curvature_flow/smooth.h"
#include "levelset/distance/closest_points.h"
#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/compare.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/morph/morph.h"
#include "levelset/offset/morphology.h"
#include "levelset/offset/offset.h"
#include "levelset/transform/resample.h"
#include "levelset/transform/transform.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"
#include "tests/support/threads.h"

namespace surface_band_test {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::surfaceBand;
using levelset::TriMesh;
using support::patchMesh;
using support::refusal;

/// Square with edges of length 2, centred at `middle`, in the plane through u and v.
TriMesh square(const V3d& middle, const V3d& u, const V3d& v, unsigned cells = 4) {
  return patchMesh(cells + 1, cells + 1, false, false,
                   [=](double s, double t) { return middle + u * (2 * s - 1) + v * (2 * t - 1); });
}

TEST(SurfaceBand, OfAPlaneIsTheDistanceToThePlane) {
  const double h = 0.1;
  const V3d u = V3d(2, 1, 0).normalized(), v = V3d(-1, 2, 1.5).normalized();
  const V3d normal = u.cross(v), middle(0.33, 0.21, -0.07);
  const levelset::SurfaceBandResult made = surfaceBand(square(middle, u, v), h);
  EXPECT_TRUE(made.band.isOpenSurface());
  EXPECT_EQ(made.borderEdges, 16u);
  EXPECT_EQ(made.removedVoxels, 0u);
  EXPECT_DOUBLE_EQ(made.band.halfWidth(), 5);
  std::size_t within = 0, beyond = 0;
  support::forEachActive(made.band, [&](const V3d& p, double phi) {
    const V3d way = p - middle;
    EXPECT_NEAR(phi, way.dot(normal), support::rounding(0.2)) << p;
    EXPECT_LT(std::abs(phi), 5 * h + 1e-6);
    const double over = std::max({0.0, std::abs(way.dot(u)) - 1, std::abs(way.dot(v)) - 1});
    EXPECT_LE(over, 3.5 * h + 1e-6);  // the border and its straight continuation
    ++(over > 0 ? beyond : within);
  });
  // The complete slab of ten voxels over the square, with a rim of at most three and a half voxels
  // around it.
  EXPECT_NEAR(static_cast<double>(within) * h * h * h, 4 * 10 * h, support::measured(0.023));
  EXPECT_NEAR(static_cast<double>(beyond) * h * h * h,
              (4 * 2 * 3.5 * h + M_PI * 12.25 * h * h) * 10 * h, support::measured(0.0968, 0.1));
}

TEST(SurfaceBand, SignsAboutEdgesAndCorners) {
  // A box without its lid. Its edges and corners are convex from below and concave from above.
  TriMesh box;
  box.positions = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                   {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    box.triangles.push_back({a, b, c});
    box.triangles.push_back({a, c, d});
  };
  quad(0, 3, 2, 1);
  quad(0, 1, 5, 4);
  quad(1, 2, 6, 5);
  quad(2, 3, 7, 6);
  quad(3, 0, 4, 7);
  const double h = 0.11;
  std::size_t seen = 0;
  support::forEachActive(surfaceBand(box, h).band, [&](const V3d& p, double phi) {
    if (p.z > 1) return;  // straight continuation
    const V3d q(std::abs(p.x) - 1, std::abs(p.y) - 1, -1 - p.z);
    const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    const double inside = std::max({q.x, q.y, q.z});
    EXPECT_NEAR(phi, inside > 0 ? out.length() : inside, support::rounding(0.4)) << p;
    ++seen;
  });
  EXPECT_GT(seen, 10000u);
}

TEST(SurfaceBand, OfACapIsTheDistanceToTheBall) {
  // With 60 rings the sagitta of the chords is R (π / 60)² / 8 = 3.4e-4.
  const double h = 0.05;
  std::size_t seen = 0;
  const TriMesh cap = support::sphereMesh(1, V3d(0), 60, 0.5);
  support::forEachActive(surfaceBand(cap, h).band, [&](const V3d& p, double phi) {
    if (p.z > 0) return;
    EXPECT_NEAR(phi, p.length() - 1, support::measured(0.00851, 0.012) * h) << p;
    ++seen;
  });
  EXPECT_GT(seen, 10000u);
}

TEST(SurfaceBand, FrontAndBackDoNotMeet) {
  // Two parallel sheets. The back of the upper one faces the front of the lower one.
  const double h = 0.1;
  for (const double gap : {0.73, 0.41, 0.26}) {
    TriMesh sheets = square(V3d(0, 0, 0.013), V3d(1, 0, 0), V3d(0, 1, 0));
    append(sheets, square(V3d(0, 0, 0.013 + gap), V3d(1, 0, 0), V3d(0, 1, 0)));
    const levelset::SurfaceBandResult made = surfaceBand(sheets, h);
    EXPECT_GT(made.removedVoxels, 0u) << gap;
    auto accessor = vdb(made.band).getConstAccessor();
    for (auto it = vdb(made.band).cbeginValueOn(); it; ++it) {
      const openvdb::Coord c = it.getCoord();
      float next;
      if (!accessor.probeValue(c.offsetBy(0, 0, 1), next) || (*it < 0) == (next < 0)) continue;
      EXPECT_LT(*it, next) << gap;  // sign changes from below to above only
    }
  }
}

TEST(SurfaceBand, IgnoresSeamsAndThreads) {
  TriMesh whole = support::sphereMesh(1, V3d(0), 12, 0.7), torn;
  for (const auto& t : whole.triangles) {
    const auto first = static_cast<std::uint32_t>(torn.positions.size());
    for (const std::uint32_t v : t) torn.positions.push_back(whole.positions[v]);
    torn.triangles.push_back({first, first + 1, first + 2});
  }
  const std::uint64_t hash = surfaceBand(whole, 0.1).band.contentHash();
  EXPECT_EQ(surfaceBand(torn, 0.1).band.contentHash(), hash);
  for (const std::size_t count : {1, 4})
    support::onThreads(count, [&] { EXPECT_EQ(surfaceBand(whole, 0.1).band.contentHash(), hash); });
}

TEST(SurfaceBand, RefusesSurfacesWithoutTwoSides) {
  // A strip that is turned over where it closes.
  TriMesh moebius = patchMesh(40, 5, false, false, [](double u, double v) {
    const double a = 2 * M_PI * u, w = 0.4 * (v - 0.5);
    return V3d((1 + w * std::cos(a / 2)) * std::cos(a), (1 + w * std::cos(a / 2)) * std::sin(a),
               w * std::sin(a / 2));
  });
  // The ends coincide only up to rounding.
  for (std::size_t j = 0; j < 5; ++j) moebius.positions[39 * 5 + j] = moebius.positions[4 - j];
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)surfaceBand(moebius, 0.05); }),
              "two faces have opposite orientations");
  TriMesh flipped = square(V3d(0), V3d(1, 0, 0), V3d(0, 1, 0));
  std::swap(flipped.triangles[12][0], flipped.triangles[12][1]);
  const std::string sentence = refusal<InvalidInput>([&] { (void)surfaceBand(flipped, 0.1); });
  EXPECT_SAYS(sentence, "at the edge from (");
  EXPECT_SAYS(sentence, "orient all faces alike");
  TriMesh fin = square(V3d(0), V3d(1, 0, 0), V3d(0, 1, 0), 2);
  fin.positions.emplace_back(0, 0.5, 1);
  fin.triangles.push_back({4, 5, 9});  // third face of the edge from (0, 0) to (0, 1)
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)surfaceBand(fin, 0.1); }),
              "at the edge from (0, 0, 0) to (0, 1, 0), 3 faces meet");
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)surfaceBand(support::sphereMesh(1), 0.1); }),
              "'level-set' converts a closed mesh");
}

TEST(SurfaceBand, RefusesInvalidArguments) {
  const TriMesh sheet = square(V3d(0), V3d(1, 0, 0), V3d(0, 1, 0));
  EXPECT_THROW((void)surfaceBand(sheet, 0.1, {.halfWidth = 3}), levelset::UsageError);
  EXPECT_THROW((void)surfaceBand(sheet, 0), levelset::UsageError);
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)surfaceBand({}, 0.1); }),
              "the mesh has no triangles");
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)surfaceBand(sheet, 3); }), "the voxel");
  EXPECT_THROW((void)surfaceBand(sheet, 0.1, {.progress = [](double) { return false; }}),
               levelset::Cancelled);
  EXPECT_THROW((void)surfaceBand(sheet, 0.01, {.maxMemory = 1000}), levelset::ResourceLimit);
}

TEST(SurfaceBand, ReportsPositionsBeyondTheBorder) {
  const double h = 0.1;
  const NarrowBand band = surfaceBand(square(V3d(0), V3d(1, 0, 0), V3d(0, 1, 0)), h).band;
  const levelset::BandSampler sampler(band);
  EXPECT_EQ(sampler.beyondBorder(V3d(0.8, 0.3, 0.1)), 0);
  EXPECT_NEAR(sampler.beyondBorder(V3d(1.25, 0.3, 0.1)), 0.25, support::rounding(1));
  EXPECT_NEAR(sampler.beyondBorder(V3d(1.2, -1.1, 0)), std::hypot(0.2, 0.1),
              support::rounding(0.5) * h);
  EXPECT_EQ(sampler.beyondBorder(V3d(1.5, 0.3, 0)), 0);
  const NarrowBand moved = transform(band, Imath::M44d().setScale(2));
  EXPECT_NEAR(levelset::BandSampler(moved).beyondBorder(V3d(2.5, 0.6, 0.2)), 0.5,
              support::rounding(1));
  EXPECT_EQ(levelset::BandSampler(support::sampleBand([](const V3d& p) { return p.length() - 1; },
                                                      {V3d(-1), V3d(1)}, h))
                .beyondBorder(V3d(1, 0, 0)),
            0);
}

TEST(SurfaceBand, IsNoSolid) {
  const NarrowBand band = surfaceBand(square(V3d(0), V3d(1, 0, 0), V3d(0, 1, 0)), 0.1).band;
  const NarrowBand ball =
      support::sampleBand([](const V3d& p) { return p.length() - 1; }, {V3d(-1), V3d(1)}, 0.1);
  const auto refuses = [&](const std::function<void()>& run) {
    EXPECT_SAYS(refusal<InvalidInput>(run), "the operand is an open");
  };
  refuses([&] { (void)measure(band); });
  refuses([&] { (void)unite(ball, band); });
  refuses([&] { (void)levelset::blend(levelset::CsgOperation::Union, band, ball, 0.3); });
  refuses([&] { (void)levelset::offset(band, 0.1); });
  refuses([&] { (void)shell(band, 0.2, levelset::ShellSide::In); });
  refuses([&] { (void)clip(band, Imath::Box3d(V3d(-1), V3d(1))); });
  refuses([&] { (void)levelset::keepLargest(band, 1); });
  refuses([&] { (void)levelset::resample(band, 0.2); });
  refuses([&] { (void)levelset::redistance(band); });
  refuses([&] { (void)levelset::closestPoints(band); });
  refuses([&] { (void)smooth(band, levelset::SmoothKind::Gaussian, 0.2); });
  refuses([&] { (void)morph(ball, band); });
  refuses([&] { (void)compare(ball, band); });
  refuses([&] { (void)levelset::bandToMesh(band); });
  const auto still = [](const V3d&, double) { return V3d(0); };
  refuses([&] { (void)levelset::advect(band, still, 1); });
  const support::TemporaryFolder folder;
  refuses([&] { levelset::writeBand(folder / "a.vdb", band); });
  EXPECT_EQ(folder.fileCount(), 0u);
  EXPECT_FALSE(levelset::meshToBand(support::sphereMesh(1), 0.2).band.isOpenSurface());
}

}  // namespace surface_band_test
