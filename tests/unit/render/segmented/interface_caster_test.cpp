// Ray casting of segmented fields: against the judge, the field itself, formulas and meshes.

#include "render/segmented/interface_caster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "levelset/segmented/meshing/segmented_to_mesh.h"
#include "render/meshes/mesh_rays.h"
#include "render/segmented/interface_judge.h"
#include "render/segmented/interface_kernel.h"
#include "tests/support/measured.h"
#include "tests/support/segmented_scenes.h"

namespace interface_caster_test {

using Imath::V3d;
using levelset::RegionLabel;
using levelset::SegmentedField;
using support::doubleRounding;
using support::measured;
using support::measuredOrder;
using namespace render;

/// Differences between the hits of kernel and judge.
struct Agreement {
  std::size_t hits = 0, unlike = 0, relabelled = 0;
  double distance = 0, facet = 0, normal = 0;  // largest; of normals: lengths of differences
};

void compare(const InterfaceHit& a, const InterfaceHit& b, Agreement& all) {
  all.unlike += a.found != b.found;
  if (!a.found || !b.found) return;
  ++all.hits;
  if (a.front != b.front || a.behind != b.behind) {
    ++all.relabelled;
    return;
  }
  all.distance = std::max(all.distance, std::abs(a.distance - b.distance));
  all.facet = std::max(all.facet, (a.facetNormal - b.facetNormal).length());
  all.normal = std::max(all.normal, (a.normal - b.normal).length());
}

TEST(InterfaceCaster, AgreesWithTheJudge) {
  for (const support::SegmentedScene& scene : support::segmentedScenes())
    for (const bool hides : {false, true}) {
      const InterfaceCaster caster(scene.field, hides ? scene.hidden : std::vector<RegionLabel>());
      const InterfaceJudge judge(caster);
      Agreement all;
      for (const Camera& camera : support::segmentedViews(32, 24))
        for (const InterfaceRay& ray : support::raysOf(camera))
          compare(caster.firstHit(ray), judge.firstHit(ray), all);
      EXPECT_GT(all.hits, 500u) << scene.name;
      EXPECT_EQ(all.unlike, 0u) << scene.name << hides;
      EXPECT_EQ(all.relabelled, 0u) << scene.name << hides;
      EXPECT_LT(all.distance, doubleRounding(600)) << scene.name << hides;
      EXPECT_LT(all.facet, doubleRounding(6000)) << scene.name << hides;
      EXPECT_LT(all.normal, doubleRounding(15000)) << scene.name << hides;
    }
}

TEST(InterfaceCaster, StopsWhereTheLabelOfTheFieldFirstChanges) {
  for (const support::SegmentedScene& scene : support::segmentedScenes()) {
    const InterfaceCaster caster(scene.field);
    const levelset::SegmentedSampler sampler(scene.field);
    std::size_t hits = 0, before = 0, behind = 0, early = 0;
    for (const Camera& camera : support::segmentedViews(16, 12))
      for (const InterfaceRay& ray : support::raysOf(camera)) {
        const InterfaceHit hit = caster.firstHit(ray);
        const auto labelAt = [&](double t) {
          return sampler.label(ray.origin + ray.direction * t);
        };
        const double end = hit.found ? hit.distance : ray.near + 5;
        const RegionLabel first = labelAt(ray.near);
        constexpr int kSteps = 200;
        for (int s = 1; s < kSteps; ++s)
          early += labelAt(ray.near + (end - ray.near) * s / kSteps) != first;
        if (!hit.found) continue;
        ++hits;
        constexpr double kBeside = 1e-9;
        before += labelAt(end - kBeside) != hit.front;
        behind += labelAt(end + kBeside) != hit.behind;
      }
    EXPECT_GT(hits, 100u) << scene.name;
    EXPECT_EQ(early, 0u) << scene.name;
    EXPECT_EQ(before, 0u) << scene.name;
    EXPECT_EQ(behind, 0u) << scene.name;
  }
}

TEST(InterfaceCaster, FindsAllCrossingsInOrderFromBothSides) {
  const InterfaceCaster caster(support::nestedBalls(1, 0.62, 0.05));
  const V3d direction = V3d(1, 0.2, -0.1).normalized();
  const auto crossings = [&](const V3d& along) {
    std::vector<InterfaceHit> hits;
    InterfaceRay ray{along * -3, along, 0, 10};
    for (InterfaceHit hit = caster.firstHit(ray); hit.found && hits.size() < 9;
         hit = caster.firstHit(ray)) {
      hits.push_back(hit);
      ray = InterfaceCaster::behind(ray, hit);
    }
    return hits;
  };
  const std::vector<InterfaceHit> there = crossings(direction), back = crossings(-direction);
  ASSERT_EQ(there.size(), 4u);
  ASSERT_EQ(back.size(), 4u);
  const double distances[] = {2, 2.38, 3.62, 4}, errors[] = {1.8e-4, 8.1e-4, 8.1e-4, 1.8e-4};
  const RegionLabel labels[] = {0, 1, 2, 1, 0};
  for (std::size_t n = 0; n < 4; ++n) {
    // An interpolant lies up to h²/(4R) inside a ball.
    EXPECT_NEAR(there[n].distance, distances[n], measured(errors[n])) << n;
    EXPECT_EQ(there[n].front, labels[n]);
    EXPECT_EQ(there[n].behind, labels[n + 1]);
    EXPECT_GT(-there[n].normal.dot(direction), 0.99);
    EXPECT_NEAR(there[n].distance + back[3 - n].distance, 6, 1e-12);
    EXPECT_EQ(back[3 - n].front, there[n].behind);
    EXPECT_EQ(back[3 - n].behind, there[n].front);
    EXPECT_NEAR((back[3 - n].normal + there[n].normal).length(), 0, 1e-12);
  }
}

TEST(InterfaceCaster, ConvergesToBallsBehindHiddenRegions) {
  struct Errors {
    double distance = 0, normal = 0, facet = 0;
  };
  const auto errorsAt = [](double voxel) {
    // The view is from one side of the hidden ball; its far side is within the visible depths.
    const InterfaceCaster caster(support::nestedBalls(1, 0.62, voxel), {1});
    Errors errors;
    for (const InterfaceRay& ray : support::raysOf(support::segmentedViews(24, 24)[0])) {
      const InterfaceHit hit = caster.firstHit(ray);
      if (!hit.found) continue;
      const V3d p = ray.origin + ray.direction * hit.distance;
      EXPECT_EQ(hit.front, 1);
      EXPECT_EQ(hit.behind, 2);
      errors.distance = std::max(errors.distance, std::abs(p.length() - 0.62));
      errors.normal = std::max(errors.normal, (p.normalized() - hit.normal).length());
      errors.facet = std::max(errors.facet, (p.normalized() - hit.facetNormal).length());
    }
    return errors;
  };
  const Errors coarse = errorsAt(0.1), middle = errorsAt(0.05), fine = errorsAt(0.025);
  const auto order = [](double a, double b) { return std::log2(a / b); };
  EXPECT_LT(coarse.distance, measured(4.03e-3));
  EXPECT_GT(order(coarse.distance, middle.distance), measuredOrder(2.02));
  EXPECT_GT(order(middle.distance, fine.distance), measuredOrder(1.99));
  EXPECT_LT(coarse.normal, measured(5.11e-3));
  EXPECT_GT(order(coarse.normal, middle.normal), measuredOrder(2.0));
  EXPECT_GT(order(middle.normal, fine.normal), measuredOrder(2.05));
  EXPECT_LT(coarse.facet, measured(0.105));
  EXPECT_GT(order(middle.facet, fine.facet), measuredOrder(1.08));
}

TEST(InterfaceCaster, SeesNothingOfHiddenRegions) {
  const SegmentedField field = support::threeBalls(0.1);
  const InterfaceCaster none(field, {1, 2, 3});
  EXPECT_TRUE(none.bounds().isEmpty());
  for (const InterfaceRay& ray : support::raysOf(support::segmentedViews(16, 12)[0])) {
    EXPECT_FALSE(none.firstHit(ray).found);
    EXPECT_FALSE(none.isOccluded(ray));
  }
  const InterfaceCaster third(field, {1, 2});
  EXPECT_FALSE(third.isShown(0));
  EXPECT_FALSE(third.isShown(1));
  EXPECT_TRUE(third.isShown(3));
  EXPECT_NEAR((third.bounds().max - V3d(0.8, 1.5, 1.0)).length(), 0, 0.02);
  const InterfaceCaster all(field);
  EXPECT_EQ(all.bounds().min, field.interfaceBounds().min);
  EXPECT_EQ(all.bounds().max, field.interfaceBounds().max);
  for (const InterfaceRay& ray : support::raysOf(support::segmentedViews(16, 12)[0]))
    EXPECT_EQ(all.isOccluded(ray), all.firstHit(ray).found);
}

TEST(InterfaceCaster, HasTheSameBitsWithoutSkippedBlocks) {
  for (const support::SegmentedScene& scene : support::segmentedScenes()) {
    const InterfaceCaster caster(scene.field, scene.hidden);
    // A mask without cells makes the kernel step through all cells of a block.
    InterfaceTables slow = *caster.tables();
    const auto none = static_cast<std::int32_t>(slow.masks.size() / 16);
    slow.masks.resize(slow.masks.size() + 16);
    for (std::size_t n = 1; n < slow.table.size(); n += 2)
      if (slow.table[n] < 0) slow.table[n] = none;
    std::size_t hits = 0;
    for (const Camera& camera : support::segmentedViews(16, 12))
      for (const InterfaceRay& ray : support::raysOf(camera)) {
        const InterfaceHit fast = caster.firstHit(ray);
        const InterfaceStart start = caster.start(ray);
        if (!start.isInside) continue;
        InterfaceKernel kernel(slow, true);
        auto found = InterfaceKernel::rayOf(start);
        kernel.followInterfaces(found, 1 << 30);
        ASSERT_EQ(fast.found, found.state == InterfaceKernel::kCrossed);
        if (!fast.found) continue;
        ++hits;
        ASSERT_EQ(fast.distance, found.t);
        ASSERT_EQ(fast.front, found.front);
        ASSERT_EQ(fast.behind, found.behind);
      }
    EXPECT_GT(hits, 100u) << scene.name;
  }
}

TEST(InterfaceCaster, HasTheDepthsAndSidesOfTheMesh) {
  // Facets of a mesh lie up to h²/(8R) beside the interpolant. Around junctions both differ more.
  for (const support::SegmentedScene& scene : support::segmentedScenes()) {
    if (scene.name == "faceted") continue;  // the edges of facets are everywhere
    const levelset::SegmentedMesh mesh = levelset::segmentedToMesh(scene.field);
    Scene triangles;
    std::map<std::pair<RegionLabel, RegionLabel>, levelset::TriMesh> parts;
    for (std::size_t t = 0; t < mesh.sides.size(); ++t)
      parts[{mesh.sides[t].front, mesh.sides[t].behind}].triangles.push_back(
          mesh.mesh.triangles[t]);
    std::vector<std::set<RegionLabel>> sides;
    for (auto& [labels, part] : parts) {
      part.positions = mesh.mesh.positions;
      sides.push_back({labels.first, labels.second});
      triangles.meshes.push_back({std::make_shared<const levelset::TriMesh>(part)});
    }
    const MeshRays rays(triangles);
    const InterfaceCaster caster(scene.field);
    const double voxel = scene.field.voxelSize();
    std::vector<double> differences;
    std::size_t relabelled = 0, one = 0;
    for (const Camera& camera : support::segmentedViews(40, 30))
      for (const InterfaceRay& ray : support::raysOf(camera)) {
        const InterfaceHit hit = caster.firstHit(ray);
        const Hit other = rays.intersect(ray.origin, ray.direction, ray.near, ray.far);
        one += hit.found != other.found;
        if (!hit.found || !other.found) continue;
        double toJunction = 1e9;
        for (const levelset::JunctionEdge& edge : mesh.junctions)
          for (const std::uint32_t v : edge.vertices)
            toJunction = std::min(toJunction, (mesh.mesh.positions[v] - other.position).length());
        const double slant = std::abs(ray.direction.dot(other.facetNormal));
        if (toJunction < 2 * voxel || slant < 0.3) continue;
        relabelled += sides[other.solid] != std::set<RegionLabel>{hit.front, hit.behind};
        differences.push_back(std::abs(hit.distance - other.distance) * slant / voxel);
      }
    ASSERT_GT(differences.size(), 500u) << scene.name;
    std::sort(differences.begin(), differences.end());
    EXPECT_EQ(relabelled, 0u) << scene.name;
    EXPECT_LE(one, 4u) << scene.name;  // of 4800 pixels, at silhouettes
    // At the edges of boxes the interpolant and the facets round differently.
    const bool hasEdges = scene.name == "slabs";
    EXPECT_LT(differences[differences.size() * 99 / 100], measured(hasEdges ? 0.115 : 0.019))
        << scene.name;
    EXPECT_LT(differences.back(), measured(hasEdges ? 0.295 : 0.029)) << scene.name;
  }
}

}  // namespace interface_caster_test
