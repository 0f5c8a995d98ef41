// Segmented fields of volumes of labels, and how fields store many labels.

#include "levelset/segmented/segment_labels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "tests/support/measured.h"
#include "tests/support/segmented.h"
#include "tests/support/threads.h"

namespace segment_labels_test {

using namespace levelset;
using Imath::V3d;
using Imath::V3i;
using std::numbers::pi;
using support::interfaceDefects;
using support::InterfaceDefects;
using support::measured;
using support::measuredOrder;

/// Volume of cubic voxels of size `spacing` with a grid point at `origin`.
Volume volumeOf(const V3i& size, double spacing, const V3d& origin,
                const std::function<double(const V3i&)>& label) {
  VolumeGrid grid;
  grid.size = size;
  for (int i = 0; i < 3; ++i) {
    grid.indexToWorld[i][i] = spacing;
    grid.indexToWorld[3][i] = origin[i];
  }
  std::vector<float> values;
  for (int k = 0; k < size.z; ++k)
    for (int j = 0; j < size.y; ++j)
      for (int i = 0; i < size.x; ++i) values.push_back(static_cast<float>(label(V3i(i, j, k))));
  return {grid, values};
}

/// Ball of radius 1 in two halves, labels 7 and 300.
Volume ballHalves(int size) {
  const double spacing = 2.4 / size;
  const V3d origin(-1.2 + spacing / 2, -1.19 + spacing / 2, -1.18 + spacing / 2);
  return volumeOf(V3i(size), spacing, origin, [&](const V3i& at) {
    const V3d p = origin + V3d(at) * spacing;
    if (p.length() >= 1) return 0;
    return p.dot(V3d(0.6, 0.48, 0.64)) < 0 ? 7 : 300;
  });
}

TEST(SegmentLabels, PutsInterfacesHalfwayBetweenSamples) {
  // Two boxes of samples that touch.
  const Volume volume = volumeOf(V3i(12), 0.5, V3d(3, 4, 5), [](const V3i& at) {
    if (at.y < 2 || at.y > 9 || at.z < 2 || at.z > 9) return 0;
    return at.x < 2 ? 0 : at.x < 6 ? 1 : at.x < 10 ? 2 : 0;
  });
  const SegmentedField field = segmentLabels(volume);
  EXPECT_EQ(field.labels(), (std::vector<RegionLabel>{1, 2}));
  EXPECT_EQ(field.voxelSize(), 0.5);
  const SegmentedSampler sampler(field);
  const auto at = [](int i, int j, int k) { return V3d(3, 4, 5) + 0.5 * V3d(i, j, k); };
  EXPECT_NEAR(sampler.distance(at(5, 5, 5)), 0.25, 1e-6);
  EXPECT_NEAR(sampler.distance(at(4, 5, 5)), 0.75, 1e-6);
  EXPECT_NEAR(sampler.distance(at(1, 1, 5)), 0.5 * std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(sampler.signedDistance(at(6, 5, 5), 1), 0.25, 1e-6);
  EXPECT_NEAR(sampler.signedDistance(at(5, 5, 5), 1), -0.25, 1e-6);
  EXPECT_EQ(sampler.distance(at(30, 5, 5)), 1);  // half width
  const Imath::Box3d bounds = field.interfaceBounds();
  EXPECT_NEAR((bounds.min - at(2, 2, 2) + V3d(0.25)).length(), 0, 1e-6);
  EXPECT_NEAR((bounds.max - at(9, 9, 9) - V3d(0.25)).length(), 0, 1e-6);
  EXPECT_EQ(interfaceDefects(segmentedToMesh(field)), InterfaceDefects());
}

TEST(SegmentLabels, SmoothsStepsAway) {
  struct Case {
    double smooth, volume, outer, inner;
  };
  for (const Case& c : {Case{0, 0.0030, 1.0938, 0.9323}, Case{1, 0.0142, 0.0345, 0.0823}}) {
    const SegmentedField field = segmentLabels(ballHalves(64), {.smooth = c.smooth});
    const SegmentedMesh mesh = segmentedToMesh(field);
    EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
    const SegmentedMeasurement m = measureSegmented(mesh);
    ASSERT_EQ(m.regions.size(), 3u);
    EXPECT_NEAR(m.regions[1].volume, 2 * pi / 3, measured(c.volume));
    EXPECT_NEAR(m.interfaces[0].area, 2 * pi, measured(c.outer));
    EXPECT_NEAR(m.interfaces[2].area, pi, measured(c.inner));
  }
}

TEST(SegmentLabels, ConvergesWithSecondOrder) {
  const auto error = [](int size) {
    const SegmentedMeasurement m = measureSegmented(segmentLabels(ballHalves(size), {.smooth = 1}));
    return std::abs(m.volume - 4 * pi / 3);
  };
  EXPECT_GT(std::log2(error(32) / error(64)), measuredOrder(2.05));
}

TEST(SegmentLabels, ReadsMirroredVolumes) {
  const Volume volume = ballHalves(32);
  VolumeGrid grid = volume.grid();
  const V3i size = grid.size;
  std::vector<float> mirrored;
  for (int k = 0; k < size.z; ++k)
    for (int j = 0; j < size.y; ++j)
      for (int i = 0; i < size.x; ++i)
        mirrored.push_back(static_cast<float>(volume.at(size.x - 1 - i, j, k)));
  grid.indexToWorld[3][0] += (size.x - 1) * grid.indexToWorld[0][0];
  grid.indexToWorld[0][0] *= -1;
  const SegmentedMeasurement one = measureSegmented(segmentLabels(volume)),
                             other = measureSegmented(segmentLabels(Volume(grid, mirrored)));
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(one.regions[k].volume, other.regions[k].volume, 1e-9);
}

TEST(SegmentLabels, StoresManyLabelsInABlock) {
  constexpr int kSize = 12;
  // Palettes of 2 to 500 labels in a block have codes of 1 to 16 bits.
  for (const std::size_t count : {2u, 4u, 16u, 200u, 60000u}) {
    std::mt19937_64 random(count);
    std::vector<RegionLabel> labels(static_cast<std::size_t>(kSize) * kSize * kSize);
    for (RegionLabel& label : labels) label = static_cast<RegionLabel>(65535 - random() % count);
    const auto index = [](const V3i& at) {
      return static_cast<std::size_t>((at.z * kSize + at.y) * kSize + at.x);
    };
    const SegmentedField field = segmentLabels(
        volumeOf(V3i(kSize), 1, V3d(0), [&](const V3i& at) { return labels[index(at)]; }));
    const SegmentedSampler sampler(field);
    for (int k = 0; k < kSize; ++k)
      for (int j = 0; j < kSize; ++j)
        for (int i = 0; i < kSize; ++i) {
          const V3i at(i, j, k);
          ASSERT_EQ(sampler.label(V3d(at)), labels[index(at)]);
          if (i + 1 == kSize || labels[index(at)] == labels[index(V3i(i + 1, j, k))]) continue;
          ASSERT_NEAR(sampler.signedDistance(V3d(at), labels[index(V3i(i + 1, j, k))]), 0.5, 1e-6);
        }
    if (count <= 200) {
      EXPECT_EQ(field.labels().size(), count);
    }
    EXPECT_EQ(interfaceDefects(segmentedToMesh(field, {.sharpensJunctions = count == 4})),
              InterfaceDefects());
  }
}

TEST(SegmentLabels, HasTheSameBitsWithAnyNumberOfThreads) {
  const Volume volume = ballHalves(32);
  const auto run = [&](std::size_t threads) {
    return support::onThreads(threads,
                              [&] { return segmentLabels(volume, {.smooth = 1}).contentHash(); });
  };
  EXPECT_EQ(run(1), run(4));
}

TEST(SegmentLabels, Refuses) {
  const auto volumeWith = [](double value) {
    return volumeOf(V3i(4), 1, V3d(0),
                    [&](const V3i& at) { return at == V3i(1, 2, 3) ? value : 1; });
  };
  for (const double value : {0.5, -1.0, 65536.0}) {
    try {
      (void)segmentLabels(volumeWith(value));
      FAIL() << value;
    } catch (const InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find("at index [1, 2, 3]"), std::string::npos);
    }
  }
  EXPECT_THROW((void)segmentLabels(volumeOf(V3i(4), 1, V3d(0), [](const V3i&) { return 0; })),
               InvalidInput);
  EXPECT_THROW((void)segmentLabels(volumeWith(1), {.smooth = 0.3}), UsageError);
  EXPECT_THROW((void)segmentLabels(volumeWith(1), {.smooth = -1}), UsageError);
  EXPECT_THROW((void)segmentLabels(volumeWith(1), {.smooth = 4}), UsageError);
  EXPECT_THROW((void)segmentLabels(volumeWith(1), {.maxMemory = 1}), ResourceLimit);
  VolumeGrid grid = volumeWith(1).grid();
  grid.indexToWorld[0][0] = 2;
  EXPECT_THROW((void)segmentLabels(Volume(grid, std::vector<float>(64, 1))), InvalidInput);
  grid.indexToWorld[0][0] = std::sqrt(0.75);
  grid.indexToWorld[0][1] = 0.5;
  EXPECT_THROW((void)segmentLabels(Volume(grid, std::vector<float>(64, 1))), InvalidInput);
}

TEST(SegmentedField, IsEmptyByDefault) {
  const SegmentedField field;
  EXPECT_TRUE(field.isEmpty());
  EXPECT_TRUE(field.labels().empty());
  EXPECT_EQ(field.memoryUse(), 0u);
  EXPECT_TRUE(field.interfaceBounds().isEmpty());
}

TEST(SegmentedField, HashesItsContents) {
  const Volume volume = ballHalves(16);
  const SegmentedField one = segmentLabels(volume), same = segmentLabels(volume),
                       other = segmentLabels(ballHalves(18));
  EXPECT_EQ(one.contentHash(), same.contentHash());
  EXPECT_NE(one.contentHash(), other.contentHash());
  EXPECT_NE(one.contentHash(), SegmentedField().contentHash());
}

}  // namespace segment_labels_test
