// A band written in parts is the file of the complete band, to the byte.

#include "levelset/files/band_parts_writer.h"

#include <gtest/gtest.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <string>
#include <utility>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/crop.h"
#include "levelset/vdb.h"
#include "tests/support/files.h"

namespace band_parts_writer_test {

using Imath::Box3i;
using Imath::V3d;
using Imath::V3i;
using levelset::BandPartsWriter;
using levelset::kPartCell;
using levelset::NarrowBand;
using support::readText;
using support::TemporaryFolder;

constexpr int kFar = 1 << 30;

/// Boxes that fill space: cut at the given cell numbers along each axis.
std::vector<Box3i> boxesCutAt(const std::vector<int>& cells) {
  std::vector<int> faces{-kFar};
  for (const int cell : cells) faces.push_back(cell * kPartCell);
  faces.push_back(kFar);
  std::vector<Box3i> boxes;
  for (std::size_t x = 1; x < faces.size(); ++x)
    for (std::size_t y = 1; y < faces.size(); ++y)
      for (std::size_t z = 1; z < faces.size(); ++z)
        boxes.emplace_back(V3i(faces[x - 1], faces[y - 1], faces[z - 1]),
                           V3i(faces[x] - 1, faces[y] - 1, faces[z] - 1));
  return boxes;
}

/// Writes a band as a whole and in parts, the last part first, and returns both files.
std::pair<std::string, std::string> bothFiles(const NarrowBand& band,
                                              const std::vector<Box3i>& boxes) {
  const TemporaryFolder folder;
  levelset::writeBand(folder / "whole.vdb", band);
  BandPartsWriter writer(folder / "parts.vdb");
  for (auto box = boxes.rbegin(); box != boxes.rend(); ++box) writer.add(band, *box);
  EXPECT_EQ(writer.activeVoxelCount(), band.activeVoxelCount());
  writer.commit();
  EXPECT_EQ(folder.fileCount(), 2u);
  return {readText(folder / "whole.vdb"), readText(folder / "parts.vdb")};
}

TEST(BandPartsWriter, PartsGiveTheFileOfTheWhole) {
  const std::vector<Box3i> boxes = boxesCutAt({-1, 0, 1});
  const NarrowBand ball = levelset::makeSphere(20, V3d(3, -2, 1), 0.1);  // contains complete cells
  const auto [whole, parts] = bothFiles(ball, boxes);
  EXPECT_EQ(whole == parts, true);
  const NarrowBand two = levelset::unite(levelset::makeBox(V3d(30, 2, 2), V3d(20, 0, 0), 0.1),
                                         levelset::makeSphere(2, V3d(-30), 0.1));
  const auto [apart, apartParts] = bothFiles(two, boxes);
  EXPECT_EQ(apart == apartParts, true);
}

TEST(BandPartsWriter, NodesBetweenInsideNodesAreInside) {
  // Two blocks inside the solid, with a node of 4096³ grid points between them that has no block.
  const auto grid = levelset::emptyLevelSet(levelset::uniformTransform(0.1), 3);
  for (const openvdb::Coord& at : {openvdb::Coord(4095), openvdb::Coord(0, 0, 8192)})
    grid->tree().touchLeaf(at)->fill(-grid->background(), false);
  openvdb::tools::signedFloodFill(grid->tree());
  ASSERT_LT(grid->tree().getValue(openvdb::Coord(5, 5, 5000)), 0);
  const auto [whole, parts] = bothFiles(levelset::makeBand(grid), boxesCutAt({0, 16, 32, 64}));
  EXPECT_EQ(whole == parts, true);
}

TEST(BandPartsWriter, AMissingPartIsMissingInTheFile) {
  // This test would fail if the comparison above could not.
  std::vector<Box3i> boxes = boxesCutAt({0});
  const NarrowBand ball = levelset::makeSphere(8, V3d(0), 0.1);
  const TemporaryFolder folder;
  levelset::writeBand(folder / "whole.vdb", ball);
  BandPartsWriter writer(folder / "parts.vdb");
  for (std::size_t i = 1; i < boxes.size(); ++i) writer.add(ball, boxes[i]);
  writer.commit();
  EXPECT_LT(writer.activeVoxelCount(), ball.activeVoxelCount());
  EXPECT_NE(readText(folder / "whole.vdb") == readText(folder / "parts.vdb"), true);
}

TEST(BandPartsWriter, RefusesWhatIsNoPart) {
  const TemporaryFolder folder;
  EXPECT_THROW(BandPartsWriter(folder / "a.nvdb"), levelset::UsageError);
  EXPECT_THROW(BandPartsWriter(folder / "missing" / "a.vdb"), levelset::IoError);
  BandPartsWriter writer(folder / "a.vdb");
  EXPECT_THROW(writer.commit(), levelset::InvalidInput);
  const Box3i all(V3i(-kFar), V3i(kFar - 1));
  writer.add(levelset::makeSphere(1, V3d(0), 0.1), all);
  EXPECT_THROW(writer.add(levelset::makeSphere(1, V3d(0), 0.2), all), levelset::InvalidInput);
}

TEST(BandPartsWriter, LeavesNoFileWithoutCommit) {
  const TemporaryFolder folder;
  {
    BandPartsWriter writer(folder / "a.vdb");
    writer.add(levelset::makeSphere(1, V3d(0), 0.1), {V3i(-kFar), V3i(kFar - 1)});
  }
  EXPECT_EQ(folder.fileCount(), 0u);
}

TEST(ReadBandRegion, EqualsTheWholeInTheRegion) {
  const TemporaryFolder folder;
  const NarrowBand ball = levelset::makeSphere(8, V3d(0), 0.1);
  levelset::writeBand(folder / "a.vdb", ball);
  const Imath::Box3d region(V3d(1.2, -3, 0), V3d(9, 2.1, 8));
  const NarrowBand part = levelset::readBand(folder / "a.vdb", {.region = region});
  EXPECT_LT(part.activeVoxelCount(), ball.activeVoxelCount() / 3);
  EXPECT_GT(part.activeVoxelCount(), 0u);
  EXPECT_EQ(levelset::cropped(ball, {.region = region}).contentHash(),
            levelset::cropped(part, {.region = region}).contentHash());
}

}  // namespace band_parts_writer_test
