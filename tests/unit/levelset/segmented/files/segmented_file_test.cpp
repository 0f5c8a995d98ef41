// Segmented fields in .vdb files.

#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "levelset/files/band_file.h"
#include "levelset/segmented/files/segmented_file.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/operators/edit_segmented.h"
#include "levelset/segmented/operators/offset_region.h"
#include "levelset/segmented/place_segmented.h"
#include "levelset/segmented/sources/segment_mesh.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/segmented_scenes.h"
#include "tests/support/sheet_meshes.h"

namespace segmented_file_test {

using namespace levelset;
using Imath::V3d;
using support::doubleRounding;

SegmentedField sheetsOf(const TriMesh& mesh, double voxel) {
  return segmentMesh(mesh, voxel, {.keepsSheets = true}).field;
}

std::vector<std::pair<std::string, SegmentedField>> allFields() {
  const support::Frame frame = support::tiltedFrame(V3d(0.013, 0.021, 0.037), 15);
  const SegmentedField balls = support::threeBalls(0.1);
  Imath::M44d turn;
  turn.setAxisAngle(V3d(1, 2, -1).normalized(), 0.7);
  return {{"nested balls", support::nestedBalls(1, 0.6, 0.1)},
          {"three balls", balls},
          {"offset", offsetRegion(balls, 2, 0.15)},
          {"relabelled", relabel(balls, {{1, 65535}, {2, 300}})},
          {"turned", placeSegmented(balls, turn)},
          {"labels of a volume", segmentLabels(support::turnedLabels(24, support::tissueAt))},
          {"book", sheetsOf(support::bookMesh({0, 70, 140, 210, 290}, 1, 2, frame), 0.1)},
          {"Möbius strip", sheetsOf(support::moebiusMesh(0.4, frame), 0.1)},
          {"diaphragm", sheetsOf(support::sphereWithHoledDiaphragm(V3d(0), 0.4, 24), 0.15)}};
}

TEST(SegmentedFile, KeepsTheBitsOfFieldsAndFiles) {
  const support::TemporaryFolder folder;
  std::size_t sheets = 0;
  for (const auto& [name, field] : allFields()) {
    SCOPED_TRACE(name);
    writeSegmented(folder / "a.vdb", field);
    const SegmentedField back = readSegmented(folder / "a.vdb");
    EXPECT_EQ(back.contentHash(), field.contentHash());
    EXPECT_EQ(back.labels(), field.labels());
    EXPECT_EQ(back.sheetLabels(), field.sheetLabels());
    EXPECT_EQ(back.extraCount(), field.extraCount());
    EXPECT_EQ(back.halfWidth(), field.halfWidth());
    sheets += !field.sheetLabels().empty();
    writeSegmented(folder / "b.vdb", back);
    EXPECT_EQ(support::readText(folder / "a.vdb"), support::readText(folder / "b.vdb"));
    EXPECT_TRUE(holdsSegmented(folder / "a.vdb"));
    const SegmentedFileInfo info = segmentedFileInfo(folder / "a.vdb");
    EXPECT_EQ(info.activeVoxels, field.activeVoxelCount());
    EXPECT_NEAR(info.voxelSize, field.voxelSize(), 1e-12);
    EXPECT_EQ(info.halfWidth, field.halfWidth());
  }
  EXPECT_EQ(sheets, 3u);
}

/// OpenVDB's own reader finds the same labels and distances.
TEST(SegmentedFile, IsReadByOpenVdb) {
  openvdb::initialize();
  const support::TemporaryFolder folder;
  const SegmentedField field = support::threeBalls(0.1);
  writeSegmented(folder / "a.vdb", field);
  openvdb::io::File file((folder / "a.vdb").string());
  file.open();
  const auto labels = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("label"));
  const auto distances = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("distance"));
  EXPECT_EQ(distances->activeVoxelCount(), field.activeVoxelCount());
  const SegmentedSampler sampler(field);
  std::size_t inside = 0;
  for (int i = -14; i <= 20; ++i)
    for (int j = -14; j <= 20; ++j) {
      const openvdb::Coord at(i, j, 1);
      const openvdb::Vec3d p = labels->indexToWorld(at);
      const RegionLabel label = sampler.label({p[0], p[1], p[2]});
      // A grid point on an interface belongs to either side of it, by rounding.
      if (sampler.distance({p[0], p[1], p[2]}) > 1e-6) {
        EXPECT_EQ(labels->tree().getValue(at), static_cast<float>(label));
        EXPECT_EQ(labels->tree().isValueOn(at), label != kVoid);
      }
      EXPECT_NEAR(static_cast<double>(distances->tree().getValue(at)),
                  sampler.distance({p[0], p[1], p[2]}), doubleRounding(4));
      inside += label != kVoid;
    }
  EXPECT_GT(inside, 300u);
}

TEST(SegmentedFile, RefusesOtherFiles) {
  const support::TemporaryFolder folder;
  writeBand(folder / "ball.vdb", makeSphere(1, V3d(0), 0.2));
  EXPECT_FALSE(holdsSegmented(folder / "ball.vdb"));
  EXPECT_FALSE(holdsSegmented(folder / "missing.vdb"));
  EXPECT_FALSE(holdsSegmented("-"));
  EXPECT_SAYS(support::refusal<InvalidInput>([&] { (void)readSegmented(folder / "ball.vdb"); }),
              "holds no segmentation");
  EXPECT_SAYS(support::refusal<IoError>([&] { (void)readSegmented(folder / "missing.vdb"); }),
              "missing");
  EXPECT_SAYS(support::refusal<InvalidInput>([&] { writeSegmented(folder / "a.vdb", {}); }),
              "there is no segmentation");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.vdb"));
}

TEST(SegmentedFile, KeepsToTheMemoryLimit) {
  const support::TemporaryFolder folder;
  writeSegmented(folder / "a.vdb", support::threeBalls(0.05));
  EXPECT_THROW((void)readSegmented(folder / "a.vdb", {.maxMemory = 1'000'000}), ResourceLimit);
}

/// Writes the grids of a file again, after a change of one of them.
template <typename Change>
void rewrite(const std::filesystem::path& from, const std::filesystem::path& to,
             const std::string& name, const Change& change) {
  openvdb::initialize();
  openvdb::io::File file(from.string());
  file.open();
  const openvdb::GridPtrVecPtr grids = file.getGrids();
  openvdb::GridPtrVec kept;
  for (const openvdb::GridBase::Ptr& grid : *grids)
    if (grid->getName() != name || change(*openvdb::gridPtrCast<openvdb::FloatGrid>(grid)))
      kept.push_back(grid);
  openvdb::io::File(to.string()).write(kept);
}

TEST(SegmentedFile, RefusesGridsThatContradictEachOther) {
  const support::TemporaryFolder folder;
  const auto good = folder / "good.vdb", bad = folder / "bad.vdb";
  writeSegmented(good, support::threeBalls(0.1));
  const auto refuses = [&](const std::string& grid, const auto& change, const char* message) {
    SCOPED_TRACE(grid);
    rewrite(good, bad, grid, change);
    EXPECT_SAYS(support::refusal<InvalidInput>([&] { (void)readSegmented(bad); }), message);
  };
  rewrite(good, bad, "none", [](openvdb::FloatGrid&) { return true; });
  EXPECT_EQ(readSegmented(bad).contentHash(), readSegmented(good).contentHash());
  const auto setFirst = [](float value) {
    return [value](openvdb::FloatGrid& grid) {
      grid.tree().setValue(grid.tree().cbeginValueOn().getCoord(), value);
      return true;
    };
  };
  refuses(
      "neighbour", [](openvdb::FloatGrid&) { return false; }, "'neighbour' is missing");
  refuses(
      "neighbour_2", [](openvdb::FloatGrid&) { return false; }, "'neighbour_2' is missing");
  refuses("label", setFirst(0.5f), "contradict");
  refuses("label", setFirst(70000), "contradict");
  refuses("distance", setFirst(-0.01f), "contradict");
  refuses("distance", setFirst(NAN), "contradict");
  refuses("distance", setFirst(5), "contradict");
  refuses("neighbour", setFirst(-1), "contradict");
  refuses("distance_2", setFirst(INFINITY), "contradict");
  refuses(
      "distance",
      [](openvdb::FloatGrid& grid) {
        grid.tree().setValueOff(grid.tree().cbeginValueOn().getCoord());
        return true;
      },
      "contradict");
  refuses(
      "distance",
      [](openvdb::FloatGrid& grid) {
        grid.tree().setValue(openvdb::Coord(500), 0.01f);
        return true;
      },
      "outside the blocks");
  refuses(
      "label",
      [](openvdb::FloatGrid& grid) {
        grid.removeMeta("segmented_half_width");
        return true;
      },
      "half width");
  EXPECT_SAYS(support::refusal<InvalidInput>([&] { (void)segmentedFileInfo(bad); }), "half width");
}

TEST(SegmentedFile, SurvivesMutatedFiles) {
  const support::TemporaryFolder folder;
  const support::Frame frame = support::tiltedFrame(V3d(0.013, 0.021, 0.037), 15);
  std::vector<std::string> good;
  for (const SegmentedField& field :
       {support::threeBalls(0.25), sheetsOf(support::moebiusMesh(0.4, frame, 24), 0.2)}) {
    writeSegmented(folder / "good.vdb", field);
    good.push_back(support::readText(folder / "good.vdb"));
  }
  std::mt19937 random(7);
  std::size_t refused = 0, read = 0;
  for (std::size_t n = 0; n < 200; ++n) {
    SCOPED_TRACE(n);
    support::writeText(folder / "mutant.vdb", support::mutated(good[n % 2], random));
    try {
      const SegmentedField field = readSegmented(folder / "mutant.vdb", {.maxMemory = 100'000'000});
      ++read;
      const SegmentedMesh mesh = segmentedToMesh(field);
      EXPECT_TRUE(std::isfinite(measureSegmented(mesh).junctionLength));
    } catch (const Error& error) {
      ++refused;
      EXPECT_GT(std::string(error.what()).size(), 30u);
    }
  }
  EXPECT_EQ(refused + read, 200u);
  EXPECT_GT(refused, 60u);
}

}  // namespace segmented_file_test
