#include "levelset/files/band_file.h"

#include <fmt/core.h>
#include <nanovdb/util/IO.h>
#include <openvdb/io/Stream.h>

#include <cstdint>
#include <ctime>
#include <limits>
#include <random>

#include "levelset/error.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"

namespace band_file_test {

using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::readBand;
using openvdb::FloatGrid;
using support::refusal;
using support::TemporaryFolder;
namespace fs = std::filesystem;

NarrowBand sphere(double radius = 4, double voxelSize = 0.5) {
  const Imath::Box3d box(Imath::V3d(-radius), Imath::V3d(radius));
  return support::sampleBand([=](const Imath::V3d& p) { return p.length() - radius; }, box,
                             voxelSize);
}

/// Editable copy of the band's grid with that name.
FloatGrid::Ptr gridOf(const NarrowBand& band, const std::string& name) {
  const FloatGrid::Ptr grid = levelset::vdb(band).deepCopy();
  grid->setName(name);
  return grid;
}

/// Writes grids with OpenVDB's own writer.
void writeForeign(const fs::path& path, const openvdb::GridPtrVec& grids,
                  std::uint32_t compression = openvdb::io::COMPRESS_BLOSC |
                                              openvdb::io::COMPRESS_ACTIVE_MASK) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.setCompression(compression);
  file.write(grids);
}

TEST(BandFile, KeepsEveryBit) {
  const TemporaryFolder folder;
  NarrowBand band = sphere();
  levelset::editVdb(band).transform().postRotate(0.3, openvdb::math::Y_AXIS);
  levelset::editVdb(band).transform().postTranslate(openvdb::Vec3d(1.1, -7, 1e4));
  levelset::writeBand(folder / "a.vdb", band);
  const NarrowBand again = readBand(folder / "a.vdb");
  EXPECT_EQ(again.contentHash(), band.contentHash());
  EXPECT_EQ(again.activeVoxelCount(), band.activeVoxelCount());
  EXPECT_EQ(again.indexToWorld(), band.indexToWorld());
}

TEST(BandFile, BlocksAreVisitedAtTheCentresOfTheLeaves) {
  const TemporaryFolder folder;
  NarrowBand band = sphere();
  levelset::editVdb(band).transform().postRotate(0.3, openvdb::math::Y_AXIS);
  levelset::writeBand(folder / "a.vdb", band);
  std::vector<Imath::V3d> centres;
  levelset::visitBlocks(folder / "a.vdb", {},
                        [&](const Imath::V3d& centre) { centres.push_back(centre); });
  const FloatGrid& grid = levelset::vdb(band);
  ASSERT_EQ(centres.size(), grid.tree().leafCount());
  ASSERT_GT(centres.size(), 7u);
  std::size_t i = 0;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf, ++i) {
    const openvdb::Vec3d centre(leaf->origin().x() + 3.5, leaf->origin().y() + 3.5,
                                leaf->origin().z() + 3.5);
    EXPECT_LT((centres[i] - levelset::toImath(grid.indexToWorld(centre))).length(), 1e-12);
  }
}

TEST(BandFile, IsReadByOpenVdbWithTheSameValues) {
  const TemporaryFolder folder;
  const NarrowBand band = sphere();
  levelset::writeBand(folder / "a.vdb", band, {.name = "ball"});
  openvdb::io::File file((folder / "a.vdb").string());
  file.open(false);
  const auto grid = openvdb::gridPtrCast<FloatGrid>(file.readGrid("ball"));
  ASSERT_TRUE(grid);
  EXPECT_EQ(levelset::importBand(grid).contentHash(), band.contentHash());
  EXPECT_EQ(file.getGrids()->size(), 1u);
}

TEST(BandFile, IsReadByNanoVdbWithTheSameValues) {
  const TemporaryFolder folder;
  NarrowBand band = sphere();
  levelset::editVdb(band).transform().postTranslate(openvdb::Vec3d(1.1, -7, 1e4));
  levelset::writeBand(folder / "a.nvdb", band, {.name = "ball"});
  const auto handle = nanovdb::io::readGrid((folder / "a.nvdb").string());
  const nanovdb::NanoGrid<float>* grid = handle.grid<float>();
  ASSERT_NE(grid, nullptr);
  EXPECT_STREQ(grid->gridName(), "ball");
  EXPECT_TRUE(grid->isLevelSet());
  EXPECT_EQ(grid->activeVoxelCount(), band.activeVoxelCount());
  const auto read = grid->getAccessor();
  const FloatGrid& source = levelset::vdb(band);
  for (auto it = source.cbeginValueAll(); it; ++it) {
    const openvdb::Coord c = it.getCoord();
    ASSERT_EQ(read.getValue({c.x(), c.y(), c.z()}), *it) << c;
    const openvdb::Vec3d place = source.indexToWorld(c);
    const nanovdb::Vec3d other = grid->indexToWorld(nanovdb::Vec3d(c.x(), c.y(), c.z()));
    for (int axis = 0; axis < 3; ++axis)
      ASSERT_NEAR(other[axis], place[axis], support::doubleRounding(50000)) << c;
  }
}

TEST(BandFile, WritesTheSameBytesForTheSameBand) {
  const TemporaryFolder folder;
  for (const std::string format : {"vdb", "nvdb"}) {
    levelset::writeBand(folder / ("a." + format), sphere());
    levelset::writeBand(folder / "b", sphere(), {.format = format});
    const std::string bytes = support::readText(folder / ("a." + format));
    EXPECT_GT(bytes.size(), 10000u);
    EXPECT_EQ(support::readText(folder / "b"), bytes) << format;
    levelset::writeBand(folder / "c", sphere(4.01), {.format = format});
    EXPECT_NE(support::readText(folder / "c"), bytes) << format;
  }
}

TEST(BandFile, ReadsEveryCompressionOfOpenVdb) {
  const TemporaryFolder folder;
  const NarrowBand band = sphere();
  namespace io = openvdb::io;
  for (const std::uint32_t packing : {io::COMPRESS_NONE, io::COMPRESS_ZIP, io::COMPRESS_BLOSC}) {
    for (const std::uint32_t mask : {0, static_cast<int>(io::COMPRESS_ACTIVE_MASK)}) {
      writeForeign(folder / "a.vdb", {gridOf(band, "a")}, packing | mask);
      EXPECT_EQ(readBand(folder / "a.vdb").contentHash(), band.contentHash())
          << packing << " " << mask;
    }
  }
}

TEST(BandFile, ReadsStreamsWithoutOffsets) {
  const TemporaryFolder folder;
  const NarrowBand band = sphere();
  openvdb::initialize();
  for (const std::uint32_t compression : {0u, 3u, 6u}) {
    std::ofstream out(folder / "a.vdb", std::ios::binary);
    openvdb::io::Stream stream(out);
    stream.setCompression(compression);
    stream.write(openvdb::GridCPtrVec{gridOf(sphere(2), "first"), gridOf(band, "second")});
    out.close();
    EXPECT_EQ(readBand(folder / "a.vdb", {.grid = "second"}).contentHash(), band.contentHash());
  }
}

TEST(BandFile, ReadsHalfAndDoubleGrids) {
  const TemporaryFolder folder;
  const NarrowBand band = sphere();
  const auto half = gridOf(band, "half");
  half->setSaveFloatAsHalf(true);
  const auto wide = openvdb::DoubleGrid::create(
      std::make_shared<openvdb::DoubleTree>(levelset::vdb(band).tree()));
  wide->setName("wide");
  wide->setTransform(levelset::vdb(band).transform().copy());
  wide->setGridClass(openvdb::GRID_LEVEL_SET);
  for (const std::uint32_t compression : {0u, 1u, 2u, 3u, 4u, 6u}) {
    writeForeign(folder / "a.vdb", {half, wide}, compression);
    EXPECT_EQ(readBand(folder / "a.vdb", {.grid = "wide"}).contentHash(), band.contentHash());
    const NarrowBand coarse = readBand(folder / "a.vdb", {.grid = "half"});
    EXPECT_EQ(coarse.activeVoxelCount(), band.activeVoxelCount());
    const auto accessor = levelset::vdb(band).getConstAccessor();
    support::forEachActive(coarse, [&](const Imath::V3d& p, double phi) {
      const auto index =
          levelset::vdb(coarse).transform().worldToIndexCellCentered(levelset::toVdb(p));
      // Half floats have 11 bits.
      ASSERT_NEAR(phi, static_cast<double>(accessor.getValue(index)),
                  std::abs(phi) * 0x1p-11 + 1e-7);
    });
  }
}

TEST(BandFile, ReadsActiveTilesAsVoxels) {
  const TemporaryFolder folder;
  const auto grid = gridOf(sphere(), "a");
  grid->tree().addTile(1, openvdb::Coord(800, 0, 0), -0.25f, true);
  writeForeign(folder / "a.vdb", {grid});
  levelset::BandRepairs repairs;
  const NarrowBand band = readBand(folder / "a.vdb", {.repairs = &repairs});
  EXPECT_EQ(band.activeVoxelCount(), sphere().activeVoxelCount() + 512);
  EXPECT_EQ(repairs.activeTiles, 1u);
  EXPECT_EQ(repairs.inactiveValues, 0u);
}

TEST(BandFile, ReportsItsRepairs) {
  const TemporaryFolder folder;
  const auto grid = gridOf(sphere(), "a");
  const auto leaf = grid->tree().beginLeaf();
  for (auto it = leaf->beginValueOff(); it; ++it) it.setValue(0.25f * *it);
  const auto changed = leaf->offVoxelCount();
  ASSERT_GT(changed, 0u);
  writeForeign(folder / "a.vdb", {grid}, openvdb::io::COMPRESS_ZIP);
  levelset::BandRepairs repairs;
  const NarrowBand band = readBand(folder / "a.vdb", {.repairs = &repairs});
  EXPECT_EQ(repairs.inactiveValues, changed);
  EXPECT_EQ(band.contentHash(), sphere().contentHash());
  static_cast<void>(readBand(folder / "a.vdb"));  // the report is optional
}

TEST(BandFile, ReadsASharedTree) {
  const TemporaryFolder folder;
  const auto grid = gridOf(sphere(), "owner");
  const auto shared = grid->copy();  // the same tree
  shared->setName("shared");
  shared->setTransform(levelset::uniformTransform(2));
  writeForeign(folder / "a.vdb", {grid, shared});
  const NarrowBand band = readBand(folder / "a.vdb", {.grid = "shared"});
  EXPECT_EQ(band.voxelSize(), 2);
  EXPECT_EQ(band.activeVoxelCount(), sphere().activeVoxelCount());
}

TEST(BandFile, PicksTheOnlyLevelSet) {
  const TemporaryFolder folder;
  const auto fog = gridOf(sphere(), "fog");
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  const auto vectors = openvdb::Vec3SGrid::create();
  vectors->setName("vectors");
  writeForeign(folder / "a.vdb", {fog, vectors, gridOf(sphere(2), "ball")});
  EXPECT_EQ(readBand(folder / "a.vdb").contentHash(), sphere(2).contentHash());

  const auto sentence = [&](const std::string& grid) {
    return refusal<InvalidInput>(
        [&] { static_cast<void>(readBand(folder / "a.vdb", {.grid = grid})); });
  };
  EXPECT_SAYS(sentence("fog"), "not a level set");
  EXPECT_SAYS(sentence("vectors"), "vec3s");
  EXPECT_SAYS(sentence("none"), "'fog' (float, fog volume)");
  writeForeign(folder / "a.vdb", {gridOf(sphere(2), "a"), gridOf(sphere(2), "b")});
  EXPECT_SAYS(sentence(""), "choose one with --grid");
  writeForeign(folder / "a.vdb", {gridOf(sphere(2), "a"), gridOf(sphere(2), "a")});
  EXPECT_SAYS(sentence("a"), "more than one grid of that name");
  writeForeign(folder / "a.vdb", {fog});
  EXPECT_SAYS(sentence(""), "no level set");
}

TEST(BandFile, RefusesInvalidBands) {
  const TemporaryFolder folder;
  const auto sentence = [&](const FloatGrid::Ptr& grid) {
    writeForeign(folder / "a.vdb", {grid});
    return refusal<InvalidInput>([&] { static_cast<void>(readBand(folder / "a.vdb")); });
  };
  auto grid = gridOf(sphere(), "a");
  grid->tree().setValueOn(openvdb::Coord(8, 0, 0), std::numeric_limits<float>::quiet_NaN());
  EXPECT_SAYS(sentence(grid), "holds nan");
  grid = gridOf(sphere(), "a");
  grid->transform().postScale(openvdb::Vec3d(1, 2, 1));
  EXPECT_SAYS(sentence(grid), "scales its axes differently");
  grid = gridOf(sphere(), "a");
  grid->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), 0.5, 10, 1));
  EXPECT_SAYS(sentence(grid), "frustum");
}

TEST(BandFile, KeepsToTheMemoryLimit) {
  const TemporaryFolder folder;
  levelset::writeBand(folder / "a.vdb", sphere());
  EXPECT_THROW(static_cast<void>(readBand(folder / "a.vdb", {.maxMemory = 100000})),
               levelset::ResourceLimit);
  EXPECT_THROW(static_cast<void>(readBand(folder / "a.vdb", {.maxMemory = 1000})),
               levelset::ResourceLimit);
  // An active tile represents more voxels than any machine can store.
  const auto grid = gridOf(sphere(), "a");
  for (int i = 1; i < 100; ++i) grid->tree().addTile(3, openvdb::Coord(4096 * i, 0, 0), 0.1f, true);
  writeForeign(folder / "a.vdb", {grid});
  EXPECT_THROW(static_cast<void>(readBand(folder / "a.vdb")), levelset::ResourceLimit);
}

TEST(BandFile, RefusesMissingAndForeignFiles) {
  const TemporaryFolder folder;
  EXPECT_THROW(static_cast<void>(readBand(folder / "missing.vdb")), levelset::IoError);
  EXPECT_THROW(static_cast<void>(readBand(folder.path())), levelset::IoError);
  support::writeText(folder / "a.vdb", "");
  EXPECT_SAYS(refusal<InvalidInput>([&] { static_cast<void>(readBand(folder / "a.vdb")); }),
              "is empty");
  support::writeText(folder / "a.vdb", "ply\nformat ascii 1.0\n");
  EXPECT_SAYS(refusal<InvalidInput>([&] { static_cast<void>(readBand(folder / "a.vdb")); }),
              "not an OpenVDB file");
  levelset::writeBand(folder / "a.nvdb", sphere());
  EXPECT_THROW(static_cast<void>(readBand(folder / "a.nvdb")), levelset::UsageError);
}

TEST(BandFile, RefusesUnwritableFiles) {
  const TemporaryFolder folder;
  EXPECT_THROW(levelset::writeBand(folder / "a.xyz", sphere()), levelset::UsageError);
  EXPECT_THROW(levelset::writeBand(folder / "a.vdb", NarrowBand()), InvalidInput);
  EXPECT_THROW(levelset::writeBand(folder / "missing/a.vdb", sphere()), levelset::IoError);
  EXPECT_THROW(levelset::writeBand("/dev/full", sphere(), {.format = "vdb"}), levelset::IoError);
  EXPECT_EQ(folder.fileCount(), 0u);
}

// === Damaged files: an error or a valid band, quickly, for any bytes

/// @return true if the file was accepted
bool survives(const fs::path& path) {
  const std::clock_t begin = std::clock();
  bool taken = false;
  try {
    taken = !readBand(path).isEmpty();
  } catch (const levelset::InvalidInput&) {
  } catch (const levelset::ResourceLimit&) {
  }
  try {
    static_cast<void>(levelset::bandFileInfo(path));
  } catch (const levelset::InvalidInput&) {
  }
  // CPU seconds of all threads, so that other processes do not count.
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 2);
  return taken;
}

TEST(BandFile, RefusesAnyTruncation) {
  const TemporaryFolder folder;
  for (const std::uint32_t compression : {0u, 3u, 6u}) {
    writeForeign(folder / "a.vdb", {gridOf(sphere(), "a")}, compression);
    const std::string whole = support::readText(folder / "a.vdb");
    for (std::size_t part = 0; part < 50; ++part) {
      support::writeText(folder / "cut.vdb", whole.substr(0, whole.size() * part / 50));
      EXPECT_FALSE(survives(folder / "cut.vdb")) << part;
    }
    support::writeText(folder / "cut.vdb", whole.substr(0, whole.size() - 1));
    EXPECT_FALSE(survives(folder / "cut.vdb"));
  }
}

void expectSurvivesDamage(int times) {
  const TemporaryFolder folder;
  std::mt19937 random(20260721);
  int taken = 0, refused = 0;
  for (const std::uint32_t compression : {0u, 3u, 6u}) {
    writeForeign(folder / "a.vdb", {gridOf(sphere(), "a")}, compression);
    const std::string whole = support::readText(folder / "a.vdb");
    for (int i = 0; i < times; ++i) {
      std::string damaged = whole;
      // Every other change is near the front of the file, where counts and sizes are stored.
      const std::size_t reach = i % 2 ? damaged.size() : 2000;
      for (int k = 0; k <= i % 3; ++k)
        damaged[random() % reach] = static_cast<char>(i % 5 ? random() & 0xFF : 0xFF);
      support::writeText(folder / "damaged.vdb", damaged);
      (survives(folder / "damaged.vdb") ? taken : refused) += 1;
    }
  }
  EXPECT_GT(taken, times / 6);
  EXPECT_GT(refused, times / 6);
}

TEST(BandFile, SurvivesRandomDamage) {
  expectSurvivesDamage(100);
}

TEST(SlowBandFile, SurvivesRandomDamage) {
  expectSurvivesDamage(2000);
}

TEST(BandFile, ReportsTheContentsOfAFile) {
  const TemporaryFolder folder;
  const auto fog = openvdb::DoubleGrid::create();
  fog->setName("fog");
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  writeForeign(folder / "a.vdb", {gridOf(sphere(), "ball"), fog});
  const auto grids = levelset::bandFileInfo(folder / "a.vdb");
  ASSERT_EQ(grids.size(), 2u);
  EXPECT_EQ(grids[0].name, "ball");
  EXPECT_EQ(grids[0].type, "float");
  EXPECT_EQ(grids[0].gridClass, "level set");
  EXPECT_EQ(grids[0].activeVoxels, sphere().activeVoxelCount());
  EXPECT_EQ(grids[0].voxelSize, 0.5);
  EXPECT_EQ(grids[0].indexBounds.min, Imath::V3d(-10));
  EXPECT_EQ(grids[0].indexBounds.max, Imath::V3d(10));
  EXPECT_GT(grids[0].bytes, 2048u);
  EXPECT_EQ(grids[1].type, "double");
  EXPECT_EQ(grids[1].gridClass, "fog volume");
  EXPECT_TRUE(grids[1].indexBounds.isEmpty());
}

TEST(BandFile, ReportsTheBoundsOfABand) {
  const TemporaryFolder folder;
  NarrowBand band = support::sampleBand([](const Imath::V3d& p) { return p.length() - 4; },
                                        Imath::Box3d(Imath::V3d(-4), Imath::V3d(4)), 0.25, 5);
  levelset::editVdb(band).transform().postRotate(0.3, openvdb::math::Y_AXIS);
  levelset::editVdb(band).transform().postTranslate(openvdb::Vec3d(1, -7, 30));
  levelset::writeBand(folder / "a.vdb", band);
  const levelset::GridInfo info = levelset::bandFileInfo(folder / "a.vdb").at(0);
  EXPECT_NEAR(info.halfWidth, 5, support::doubleRounding(40));
  EXPECT_NEAR((info.worldBounds.center() - Imath::V3d(1, -7, 30)).length(), 0,
              support::rounding(1));
  // The rotated box around the ball and its band, as wide as the projections of its edges.
  const double reach = (4 + 5 * 0.25) * (std::cos(0.3) + std::sin(0.3));
  EXPECT_NEAR(info.worldBounds.size().x / 2, reach, support::measured(0.313));
  EXPECT_NEAR(info.worldBounds.size().y / 2, 4 + 5 * 0.25, support::measured(0.25, 0.26));
}

TEST(BandFile, RecognizesFormatsByName) {
  for (const char* name : {"a.vdb", "A.VDB", "nvdb", "x/y.nvdb"})
    EXPECT_TRUE(levelset::isBandFormat(name)) << name;
  for (const char* name : {"a.ply", "a.vdb.gz", "", "vdbx"})
    EXPECT_FALSE(levelset::isBandFormat(name)) << name;
}

}  // namespace band_file_test
