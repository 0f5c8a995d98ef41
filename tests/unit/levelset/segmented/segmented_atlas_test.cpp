// Atlas of 20 regions: labels, junctions, areas and volumes beside closed forms.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <vector>

#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/segment_solids.h"
#include "tests/support/measured.h"
#include "tests/support/power_atlas.h"
#include "tests/support/segmented.h"

namespace segmented_atlas_test {

using namespace levelset;
using Imath::V3d;
using std::numbers::pi;
using support::interfaceDefects;
using support::InterfaceDefects;
using support::measured;
using support::measuredOrder;
using support::PowerAtlas;

constexpr double kLeastArea = 1e-9;  // of a face, above rounding

/// Closed forms of all cells and faces.
struct AtlasTruth {
  std::vector<double> volumes, spheres;                         ///< by cell
  std::map<std::pair<std::size_t, std::size_t>, double> areas;  ///< by labels, front first
  double length = 0, area = 0;
};
AtlasTruth truthOf(const PowerAtlas& atlas) {
  AtlasTruth truth;
  for (std::size_t i = 0; i < PowerAtlas::kCells; ++i) {
    truth.volumes.push_back(atlas.volume(i));
    const double sphere = atlas.sphereArea(i);
    if (sphere > 0) truth.areas[{0, i + 1}] = sphere;
    truth.area += sphere;
    for (std::size_t j = i + 1; j < PowerAtlas::kCells; ++j) {
      const PowerAtlas::Face face = atlas.face(i, j);
      if (!(face.area > kLeastArea)) continue;
      truth.areas[{i + 1, j + 1}] = face.area;
      truth.area += face.area;
      truth.length += face.inner / 3 + face.sphere;  // three faces meet in an edge
    }
  }
  return truth;
}

/// Largest errors of an atlas.
struct AtlasErrors {
  double junction = 0, meanJunction = 0, point = 0;  // voxels
  double length = 0, area = 0, face = 0, volume = 0, cell = 0;
  double folds = 0;    // vertices at which a junction turns by more than 90°
  double flipped = 0;  // share of the triangles, against the normals of the closed forms
};

void countFolds(const PowerAtlas& atlas, const SegmentedMesh& mesh, AtlasErrors& errors) {
  const std::vector<V3d>& positions = mesh.mesh.positions;
  std::map<std::uint32_t, std::vector<std::uint32_t>> neighbours;
  for (const JunctionEdge& edge : mesh.junctions)
    for (std::size_t end = 0; end < 2; ++end)
      neighbours[edge.vertices[end]].push_back(edge.vertices[1 - end]);
  for (const auto& [vertex, list] : neighbours)
    if (list.size() == 2)
      errors.folds +=
          (positions[vertex] - positions[list[0]]).dot(positions[list[1]] - positions[vertex]) < 0;
  for (std::size_t t = 0; t < mesh.sides.size(); ++t) {
    const auto& [a, b, c] = mesh.mesh.triangles[t];
    const RegionLabel front = mesh.sides[t].front, behind = mesh.sides[t].behind;
    const V3d outwards = front == kVoid
                             ? positions[a]
                             : atlas.plane(behind - 1u, front - 1u).normal;  // towards the front
    errors.flipped +=
        outwards.dot((positions[b] - positions[a]).cross(positions[c] - positions[a])) < 0;
  }
  errors.flipped /= static_cast<double>(mesh.sides.size());
}
AtlasErrors atlasErrors(const PowerAtlas& atlas, const AtlasTruth& truth, double voxel) {
  const SegmentSolidsResult result = segmentSolids(atlas.solids(voxel));
  EXPECT_EQ(result.field.labels().size(), PowerAtlas::kCells);
  EXPECT_TRUE(result.vanished.empty());
  // Labels are exact away from interfaces.
  const SegmentedSampler sampler(result.field);
  std::size_t wrong = 0, points = 0;
  for (double x = -1.05; x < 1.05; x += 0.071)
    for (double y = -1.05; y < 1.05; y += 0.073)
      for (double z = -1.05; z < 1.05; z += 0.067) {
        const auto [label, depth] = atlas.labelAt(V3d(x, y, z));
        if (depth < 0.5 * voxel) continue;
        ++points;
        wrong += sampler.label(V3d(x, y, z)) != label;
      }
  EXPECT_GT(points, 20000u);
  EXPECT_EQ(wrong, 0u);

  const SegmentedMesh mesh = segmentedToMesh(result.field);
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  AtlasErrors errors;
  countFolds(atlas, mesh, errors);
  std::map<std::uint32_t, std::set<std::size_t>> labels;
  for (const JunctionEdge& edge : mesh.junctions)
    for (const std::uint32_t v : edge.vertices)
      labels[v].insert(edge.labels.begin(), edge.labels.end());
  double sum = 0;
  for (const auto& [vertex, around] : labels) {
    EXPECT_LE(around.size(), 4u);
    const double error =
        atlas.distanceFromJunction(mesh.mesh.positions[vertex],
                                   std::vector<std::size_t>(around.begin(), around.end())) /
        voxel;
    double& worst = around.size() == 3 ? errors.junction : errors.point;
    worst = std::max(worst, error);
    sum += error;
  }
  errors.meanJunction = sum / static_cast<double>(labels.size());

  const SegmentedMeasurement m = measureSegmented(mesh);
  errors.length = std::abs(m.junctionLength - truth.length);
  errors.area = std::abs(m.area - truth.area);
  errors.volume = std::abs(m.volume - 4 * pi / 3);
  for (std::size_t i = 0; i < PowerAtlas::kCells; ++i)
    errors.cell = std::max(errors.cell, std::abs(m.regions[i + 1].volume - truth.volumes[i]));
  EXPECT_EQ(m.interfaces.size(), truth.areas.size());
  for (const InterfaceMeasure& interface : m.interfaces) {
    const auto exact = truth.areas.find({interface.sides.front, interface.sides.behind});
    if (exact == truth.areas.end()) {
      ADD_FAILURE() << interface.sides.front << " touches " << interface.sides.behind;
      continue;
    }
    errors.face = std::max(errors.face, std::abs(interface.area - exact->second));
  }
  return errors;
}

TEST(SegmentedAtlas, ClosedFormsAddUp) {
  const PowerAtlas atlas;
  const AtlasTruth truth = truthOf(atlas);
  double volume = 0, sphere = 0;
  for (std::size_t i = 0; i < PowerAtlas::kCells; ++i) {
    volume += truth.volumes[i];
    sphere += atlas.sphereArea(i);
    EXPECT_GT(truth.volumes[i], 0.01);
  }
  EXPECT_NEAR(volume, 4 * pi / 3, measured(1e-6));
  EXPECT_NEAR(sphere, 4 * pi, measured(1e-6));
}

TEST(SegmentedAtlas, AgreesWithClosedForms) {
  const PowerAtlas atlas;
  const AtlasErrors errors = atlasErrors(atlas, truthOf(atlas), 0.05);
  EXPECT_LT(errors.meanJunction, measured(5.7e-4));
  EXPECT_LT(errors.junction, measured(0.0342));
  EXPECT_LT(errors.point, measured(4.2e-3));
  EXPECT_LT(errors.length, measured(6.8e-3));
  EXPECT_LT(errors.area, measured(2.1e-3));
  EXPECT_LT(errors.face, measured(9.3e-4));
  EXPECT_LT(errors.volume, measured(4.48e-3));
  EXPECT_LT(errors.cell, measured(5.28e-4));
  EXPECT_LT(errors.folds, measured(3));
  EXPECT_LT(errors.flipped, measured(7.4e-4));
}

TEST(SlowSegmentedAtlas, ConvergesToClosedForms) {
  const PowerAtlas atlas;
  const AtlasTruth truth = truthOf(atlas);
  std::vector<AtlasErrors> errors;
  for (const double voxel : {0.05, 0.05 / std::numbers::sqrt2, 0.025}) {
    errors.push_back(atlasErrors(atlas, truth, voxel));
    EXPECT_LT(errors.back().meanJunction, measured(5.7e-4));
    EXPECT_LT(errors.back().junction, measured(0.0342));
    EXPECT_LT(errors.back().point, measured(0.0185));
    EXPECT_LT(errors.back().length, measured(0.0415));
    EXPECT_LT(errors.back().area, measured(3.7e-3));
    EXPECT_LT(errors.back().folds, measured(29));
    EXPECT_LT(errors.back().flipped, measured(2.6e-3));
  }
  // Junctions are in voxels, so their order in world units is larger by one.
  EXPECT_GT(1 + std::log2(errors[0].meanJunction / errors[2].meanJunction), measuredOrder(3.01));
  const auto worst = [](const AtlasErrors& e) { return std::max(e.junction, e.point); };
  EXPECT_GT(1 + std::log2(worst(errors[0]) / worst(errors[2])), measuredOrder(1.89, 1.5));
  EXPECT_GT(std::log2(errors[0].volume / errors[2].volume), measuredOrder(1.89));
  EXPECT_GT(std::log2(errors[0].cell / errors[2].cell), measuredOrder(1.87));
}

}  // namespace segmented_atlas_test
