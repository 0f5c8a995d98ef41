// Textures drawn through shells: walks of rays through tetrahedra, hits, light and errors.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "render/mapped/mapped_rays.h"
#include "render/mapped/shell_walk.h"
#include "tests/support/measured.h"

namespace mapped_texture_test {

using Imath::Box3d;
using Imath::M33d;
using Imath::M44d;
using Imath::V3d;
using namespace render;

using Position = std::function<V3d(const V3d& texture)>;

/// Shell of evenly spaced nodes in `box`, each moved by `position`.
PrismShell shellOf(const Box3d& box, const std::array<int, 3>& cells, const Position& position) {
  PrismShell shell;
  shell.cells = cells;
  for (int a = 0; a < 3; ++a) {
    const auto axis = static_cast<std::size_t>(a);
    for (int i = 0; i <= cells[axis]; ++i)
      shell.coordinates[axis].push_back(box.min[a] + i * (box.size()[a] / cells[axis]));
  }
  std::vector<V3d> positions;
  for (const double z : shell.coordinates[2])
    for (const double y : shell.coordinates[1])
      for (const double x : shell.coordinates[0]) positions.push_back(position(V3d(x, y, z)));
  Box3d all;
  for (const V3d& p : positions) all.extendBy(p);
  shell.centre = all.center();
  for (const V3d& p : positions) shell.offsets.emplace_back(p - shell.centre);
  return shell;
}

V3d placeOf(const PrismShell& shell, const PrismShell::Node& node) {
  return shell.centre + V3d(shell.offsets[shell.index(node)]);
}

V3d same(const V3d& p) {
  return p;
}

/// Three quarters of a ring about the y axis: straight rays may cross it twice.
V3d bent(const V3d& p) {
  const double angle = p.x / 20, radius = 20 + p.z;
  return {radius * std::sin(angle), p.y + 0.1 * p.z * std::sin(p.x), radius * std::cos(angle)};
}

constexpr std::array<std::array<int, 3>, 6> kPaths = {
    {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};

std::array<V3d, 4> cornersOf(const PrismShell& shell, const ShellTetrahedron& t) {
  PrismShell::Node node = t.cell;
  std::array<V3d, 4> corners = {placeOf(shell, node)};
  for (std::size_t i = 0; i < 3; ++i) {
    ++node[static_cast<std::size_t>(t.axes[i])];
    corners[i + 1] = placeOf(shell, node);
  }
  return corners;
}

std::vector<ShellTetrahedron> allTetrahedra(const PrismShell& shell) {
  std::vector<ShellTetrahedron> all;
  for (int k = 0; k < shell.cells[2]; ++k)
    for (int j = 0; j < shell.cells[1]; ++j)
      for (int i = 0; i < shell.cells[0]; ++i)
        for (const auto& axes : kPaths) all.push_back({{i, j, k}, axes});
  return all;
}

struct Span {
  double enter = -1e300, leave = 1e300;
  [[nodiscard]] double length() const { return std::max(0.0, leave - enter); }
};

/// Part of a line in a tetrahedron, from its four planes.
Span spanIn(const std::array<V3d, 4>& corners, const V3d& origin, const V3d& direction) {
  Span span;
  for (std::size_t i = 0; i < 4; ++i) {
    const V3d &a = corners[(i + 1) % 4], &b = corners[(i + 2) % 4], &c = corners[(i + 3) % 4];
    V3d normal = (b - a).cross(c - a);
    if (normal.dot(corners[i] - a) < 0) normal = -normal;
    const double rate = normal.dot(direction), at = normal.dot(origin - a);
    if (rate == 0) {
      if (at < 0) return {0, -1};
      continue;
    }
    if (rate > 0)
      span.enter = std::max(span.enter, -at / rate);
    else
      span.leave = std::min(span.leave, -at / rate);
  }
  return span;
}

struct Walked {
  std::size_t parts = 0;
  double length = 0;
  std::vector<ShellTetrahedron> tetrahedra;
};

/// Walks, and checks that each part is connected: from face to face, without visiting a
/// tetrahedron twice.
Walked walkThrough(const PrismShell& shell, const V3d& origin, const V3d& direction) {
  const ShellWalker walker(shell);
  Walked walked;
  ShellSegment before;
  std::set<std::pair<PrismShell::Node, std::array<int, 3>>> seen;
  const double far = 1e300;
  walker.walk(origin, direction, -1e300, far, [&](const ShellSegment& segment, bool isFirst) {
    if (isFirst) {
      ++walked.parts;
    } else {
      EXPECT_EQ(segment.enter, before.leave);
      EXPECT_EQ(segment.from, before.to);
      std::size_t shared = 0;
      const auto here = cornersOf(shell, segment.tetrahedron),
                 there = cornersOf(shell, before.tetrahedron);
      for (const V3d& p : here) shared += std::count(there.begin(), there.end(), p) > 0;
      EXPECT_EQ(shared, 3u);
    }
    EXPECT_TRUE(seen.insert({segment.tetrahedron.cell, segment.tetrahedron.axes}).second);
    walked.length += segment.leave - segment.enter;
    walked.tetrahedra.push_back(segment.tetrahedron);
    before = segment;
    return true;
  });
  return walked;
}

class Rays {
 public:
  explicit Rays(unsigned seed) : random_(seed) {}
  double number(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }
  V3d direction() {
    for (;;) {
      const V3d d(number(-1, 1), number(-1, 1), number(-1, 1));
      if (d.length() > 0.1 && d.length() < 1) return d.normalized();
    }
  }
  V3d in(const Box3d& box) {
    return {number(box.min.x, box.max.x), number(box.min.y, box.max.y),
            number(box.min.z, box.max.z)};
  }
  int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }

 private:
  std::mt19937 random_;
};

const Box3d kSlab(V3d(0, 0, 0), V3d(90, 12, 8));

TEST(ShellWalk, VisitsTetrahedraWithoutGaps) {
  const PrismShell shell = shellOf(kSlab, {11, 3, 2}, bent);
  const std::vector<ShellTetrahedron> all = allTetrahedra(shell);
  const ShellWalker walker(shell);
  Rays rays(1);
  std::size_t met = 0, twice = 0;
  double worst = 0;
  for (int n = 0; n < 600; ++n) {
    // A third of the rays pass through a node, and a third through the middle of an edge.
    V3d through = rays.in(walker.bounds());
    if (n % 3 > 0) {
      const ShellTetrahedron& t =
          all[static_cast<std::size_t>(rays.below(static_cast<int>(all.size())))];
      const std::array<V3d, 4> corners = cornersOf(shell, t);
      through = n % 3 == 1 ? corners[1] : (corners[0] + corners[2]) * 0.5;
    }
    const V3d direction = rays.direction(), origin = through - direction * 70;
    double expected = 0;
    for (const ShellTetrahedron& t : all)
      expected += spanIn(cornersOf(shell, t), origin, direction).length();
    const Walked forth = walkThrough(shell, origin, direction),
                 back = walkThrough(shell, through + direction * 70, -direction);
    worst = std::max(worst, std::abs(forth.length - expected));
    worst = std::max(worst, std::abs(back.length - expected));
    // A ray that only touches the border at a node may count as crossing it or not.
    if (n % 3 == 0) {
      EXPECT_EQ(forth.parts, back.parts);
    }
    met += forth.parts > 0;
    twice += forth.parts > 1;
  }
  EXPECT_LT(worst, support::measured(5.5e-13));
  EXPECT_GT(met, 400u);
  EXPECT_GT(twice, 30u);
}

TEST(ShellWalk, CrossesFacesEdgesAndNodesOfALattice) {
  const Box3d box(V3d(-4, -3, -2), V3d(4, 3, 2));
  const PrismShell shell = shellOf(box, {8, 6, 4}, same);
  // Rays through nodes along lattice directions run in faces and along edges of the tetrahedra.
  double worst = 0;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        for (const V3d& through : {V3d(0, 0, 0), V3d(1, 1, 0), V3d(-2, 1, -1), V3d(0.5, 0, 1)}) {
          const V3d direction = V3d(x, y, z).normalized();
          if (V3d(x, y, z) == V3d(0)) continue;
          double enter = -1e300, leave = 1e300;
          for (int a = 0; a < 3; ++a) {
            if (direction[a] == 0) continue;
            const double t0 = (box.min[a] - through[a]) / direction[a],
                         t1 = (box.max[a] - through[a]) / direction[a];
            enter = std::max(enter, std::min(t0, t1));
            leave = std::min(leave, std::max(t0, t1));
          }
          const Walked walked = walkThrough(shell, through - direction * 16, direction);
          EXPECT_EQ(walked.parts, 1u);
          worst = std::max(worst, std::abs(walked.length - (leave - enter)));
        }
  EXPECT_LT(worst, support::measured(2.7e-15));
}

TEST(ShellWalk, EndsWhereTheVisitorAsks) {
  const PrismShell shell = shellOf(kSlab, {11, 3, 2}, bent);
  const ShellWalker walker(shell);
  const V3d origin(-60, 6, -10), direction(1, 0, 0);
  double far = 1e300;
  std::vector<double> entries;
  walker.walk(origin, direction, 0, far, [&](const ShellSegment& segment, bool isFirst) {
    EXPECT_TRUE(isFirst);
    entries.push_back(segment.enter);
    return false;
  });
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_LT(entries[0], entries[1]);
  far = 0.5 * (entries[0] + entries[1]);
  std::size_t visited = 0;
  walker.walk(origin, direction, 0, far, [&](const ShellSegment&, bool) { return ++visited == 0; });
  EXPECT_EQ(visited, 1u);
  walker.walk(origin, direction, entries[1], 1e300, [&](const ShellSegment& segment, bool) {
    EXPECT_GE(segment.leave, entries[1]);
    return true;
  });
}

Scene mappedScene(const levelset::NarrowBand& band, std::vector<PrismShell> shells) {
  Scene scene;
  scene.mapped.push_back(
      {.band = band, .shells = std::make_shared<const std::vector<PrismShell>>(std::move(shells))});
  return scene;
}

Box3d around(const levelset::NarrowBand& band, double margin) {
  Box3d box = band.zeroSetBounds();
  box.min -= V3d(margin);
  box.max += V3d(margin);
  return box;
}

levelset::NarrowBand ring() {
  return levelset::makeTorus(14, 5, V3d(3, -2, 1), V3d(0, 0.6, 0.8), 1);
}

struct Differences {
  std::size_t hits = 0, unlike = 0;
  double distance = 0, normal = 0, facet = 0, curvature = 0;
};

/// Compares the hits of the mapped ring with those of the judge on the ring itself, in the space of
/// the ring.
Differences compareWithJudge(const M44d& map) {
  const levelset::NarrowBand band = ring();
  const M44d back = map.inverse();
  const MappedRays mapped(mappedScene(
      band, {shellOf(around(band, 2), {5, 4, 3}, [&](const V3d& p) { return p * map; })}));
  Scene solid;
  solid.solids.push_back({.band = band});
  const EmbreeScene judge(solid);
  M33d slopes;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) slopes[i][j] = back[i][j];
  Rays rays(7);
  Differences found;
  for (int n = 0; n < 4000; ++n) {
    const V3d through = rays.in(mapped.bounds()), direction = rays.direction(),
              origin = through - direction * rays.number(0, 200);
    V3d textureDirection;
    back.multDirMatrix(direction, textureDirection);
    const double stretch = textureDirection.length();
    const Hit hit = mapped.intersect(origin, direction, 0, 1e300),
              truth = judge.intersect(origin * back, textureDirection / stretch);
    if (hit.found != truth.found) {
      ++found.unlike;
      continue;
    }
    if (!hit.found) continue;
    ++found.hits;
    const auto normalOf = [&](const V3d& normal) {
      return (slopes * M33d(normal.x, 0, 0, normal.y, 0, 0, normal.z, 0, 0));
    };
    const auto turned = [&](const V3d& normal) {
      const M33d column = normalOf(normal);
      return V3d(column[0][0], column[1][0], column[2][0]).normalized();
    };
    // On grazing rays the rounding of the shell moves the hit along the ray.
    const double slope = std::abs(turned(truth.facetNormal).dot(direction));
    found.distance =
        std::max(found.distance, std::abs(hit.distance * stretch - truth.distance) * slope);
    found.normal = std::max(found.normal, (hit.normal - turned(truth.normal)).length() * slope);
    found.facet =
        std::max(found.facet, (hit.facetNormal - turned(truth.facetNormal)).length() * slope);
    found.curvature =
        std::max(found.curvature, std::abs(hit.curvature.mean - truth.curvature.mean) * slope);
    EXPECT_TRUE(mapped.isOccluded(origin, direction, hit.distance + 1e-6));
    EXPECT_FALSE(mapped.isOccluded(origin, direction, hit.distance - 1e-6));
  }
  return found;
}

TEST(MappedTexture, EqualsTheTextureUnderTheIdentity) {
  const Differences found = compareWithJudge(M44d());
  EXPECT_GT(found.hits, 1000u);
  EXPECT_EQ(found.unlike, 0u);
  EXPECT_LT(found.distance, support::measured(7.4e-7));
  EXPECT_LT(found.normal, support::measured(1.9e-7));
  EXPECT_LT(found.facet, support::measured(1.2e-7));
  EXPECT_LT(found.curvature, support::measured(1.8e-8));
}

TEST(MappedTexture, IsTransformedByAnAffineMap) {
  M44d map(1.3, 0.2, -0.1, 0, -0.3, 0.9, 0.4, 0, 0.1, -0.5, 1.1, 0, 100, -50, 20, 1);
  for (const double side : {1.0, -1.0}) {  // −1: mirrored
    for (int a = 0; a < 3; ++a) map[0][a] *= side;
    const Differences found = compareWithJudge(map);
    EXPECT_GT(found.hits, 1000u);
    EXPECT_EQ(found.unlike, 0u);
    EXPECT_LT(found.distance, support::measured(6.9e-7));
    EXPECT_LT(found.normal, support::measured(3.1e-7));
    EXPECT_LT(found.facet, support::measured(3e-7));
  }
}

TEST(MappedTexture, HasTheFirstHitOfABentShell) {
  const levelset::NarrowBand band =
      levelset::makeBox(V3d(80, 7, 4), V3d(45, 6, 4), 0.5);  // sides on faces of the tetrahedra
  const PrismShell shell = shellOf(kSlab, {18, 12, 4}, bent);
  const MappedRays mapped(mappedScene(band, {shell}));
  Scene solid;
  solid.solids.push_back({.band = band});
  const EmbreeScene judge(solid);
  const std::vector<ShellTetrahedron> all = allTetrahedra(shell);
  const ShellWalker walker(shell);
  Rays rays(3);
  std::size_t hits = 0, unlike = 0;
  double worst = 0;
  for (int n = 0; n < 500; ++n) {
    const V3d direction = rays.direction(),
              origin = rays.in(mapped.bounds()) - direction * (n % 2 ? 70 : 0);
    // The judge intersects the transformed ray in each tetrahedron.
    double truth = std::numeric_limits<double>::infinity();
    for (const ShellTetrahedron& t : all) {
      Span span = spanIn(cornersOf(shell, t), origin, direction);
      if (!(span.length() > 0) || span.leave < 0) continue;
      // Zeros on a common face must not be lost by rounding in both tetrahedra.
      constexpr double kOverlap = 1e-9;
      span.enter = std::max(0.0, span.enter - kOverlap);
      span.leave += kOverlap;
      const M33d slopes = walker.slopes(t);
      const V3d corner = placeOf(shell, t.cell);
      const V3d from = shell.textureOf(t.cell) + (origin - corner) * slopes,
                along = direction * slopes;
      const double stretch = along.length();
      const Hit hit =
          judge.intersect(from, along / stretch, span.enter * stretch, span.leave * stretch);
      if (hit.found) truth = std::min(truth, hit.distance / stretch);
    }
    const Hit hit = mapped.intersect(origin, direction, 0, 1e300);
    if (hit.found != std::isfinite(truth)) {
      ++unlike;
    } else if (hit.found) {
      ++hits;
      worst = std::max(worst, std::abs(hit.distance - truth));
    }
  }
  EXPECT_GT(hits, 100u);
  EXPECT_EQ(unlike, 0u);
  EXPECT_LT(worst, support::measured(3e-14));
}

/// A plate with a ball above it, as solids or with the ball mapped.
Scene ballOnPlate(bool isMapped) {
  Scene scene;
  scene.solids.push_back({.band = levelset::makeBox(V3d(60, 60, 6), V3d(0, 0, -15), 1)});
  const levelset::NarrowBand ball = levelset::makeSphere(10, V3d(0), 1);
  if (isMapped)
    scene.mapped = mappedScene(ball, {shellOf(around(ball, 1.5), {3, 3, 3}, same)}).mapped;
  else
    scene.solids.push_back({.band = ball});
  scene.camera =
      framingCamera(Box3d(V3d(-30, -30, -18), V3d(30, 30, 10)), 160, 120, 0.6, {0, 0, 1});
  return scene;
}

TEST(MappedTexture, IsLitAndCastsShadowsLikeASolid) {
  const RenderOptions options = {.samples = 2, .lightSpacing = 1};
  const Image solid = renderCpu(ballOnPlate(false), options),
              mapped = renderCpu(ballOnPlate(true), options);
  double depth = 0, colour = 0, shadow = 0;
  std::size_t unlike = 0;
  const Image bare = [&] {
    Scene scene = ballOnPlate(false);
    scene.solids.pop_back();
    return renderCpu(scene, options);
  }();
  for (std::size_t i = 0; i < solid.pixelCount(); ++i) {
    const double a = static_cast<double>(solid.channels.at("Z")[i]),
                 b = static_cast<double>(mapped.channels.at("Z")[i]);
    if (std::isfinite(a) != std::isfinite(b) || std::abs(a - b) > 1) {
      ++unlike;
      continue;
    }
    if (!std::isfinite(a)) continue;
    depth = std::max(depth, std::abs(a - b));
    const auto difference = [&](const Image& other) {
      return std::abs(static_cast<double>(solid.channels.at("G")[i] - other.channels.at("G")[i]));
    };
    colour += difference(mapped);
    if (static_cast<double>(bare.channels.at("Z")[i]) == a) shadow += difference(bare);
  }
  EXPECT_EQ(unlike, 0u);
  EXPECT_LT(depth, support::measured(4.6e-5));
  // The shadow of the ball on the plate is there, and all colours are those of the solids.
  EXPECT_GT(shadow, 50);
  EXPECT_LT(colour, support::measured(1.5e-3) * shadow);
}

TEST(MappedTexture, IsDrawnByTheGraphicsProcessorToo) {
  const RenderOptions options = {.samples = 1, .ambientSamples = 2, .shadowSamples = 1};
  const ImageComparison found =
      compareImages(renderGpu(ballOnPlate(true), options), renderCpu(ballOnPlate(true), options),
                    {.exact = true});
  EXPECT_TRUE(found.agrees()) << found.reason();
}

TEST(MappedTexture, IsRefusedWhereItCannotBeDrawn) {
  const Scene scene = ballOnPlate(true);
  EXPECT_THROW((void)renderEmbree(scene), levelset::UsageError);
  EXPECT_THROW((void)renderCpu(scene, {.filter = Filter::BSpline}), levelset::UsageError);
  EXPECT_THROW((void)renderCpu(scene, {.thickness = true}), levelset::UsageError);
  const auto refuses = [&](const std::function<void(PrismShell&)>& damage) {
    PrismShell shell = shellOf(kSlab, {2, 2, 2}, same);
    damage(shell);
    EXPECT_THROW(MappedRays(mappedScene(ring(), {shell})), levelset::InvalidInput);
  };
  refuses([](PrismShell& shell) { shell.cells = {0, 2, 2}; });
  refuses([](PrismShell& shell) { shell.offsets.pop_back(); });
  refuses([](PrismShell& shell) { shell.coordinates[1].push_back(100); });
  refuses([](PrismShell& shell) { shell.coordinates[2][1] = shell.coordinates[2][0]; });
  refuses([](PrismShell& shell) { shell.offsets[3].y = std::numeric_limits<float>::quiet_NaN(); });
}

TEST(MappedTexture, IsNotDrawnWithoutAShell) {
  Scene scene = mappedScene(ring(), {});
  EXPECT_TRUE(MappedRays(scene).isEmpty());
  scene.mapped[0].shells = nullptr;
  EXPECT_TRUE(MappedRays(scene).isEmpty());
  EXPECT_THROW((void)renderCpu(scene), levelset::InvalidInput);
}

}  // namespace mapped_texture_test
