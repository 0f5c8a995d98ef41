#include <gtest/gtest.h>
#include <oneapi/tbb/parallel_for.h>
#include <openvdb/io/File.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <random>

#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "levelset/files/band_file.h"
#include "tests/support/bands.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"

namespace field_grid_test {

using Imath::V3d;
using levelset::FieldGrid;
using levelset::InvalidInput;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3SGrid;
using support::refusal;
using support::TemporaryFolder;

constexpr int kReach = 12;

/// Values a + b·x at voxel centres, which trilinear interpolation reproduces exactly.
FloatGrid::Ptr linearGrid() {
  const auto grid = FloatGrid::create(0);
  grid->setName("density");
  grid->setTransform(levelset::uniformTransform(0.5));
  grid->transform().postTranslate(openvdb::Vec3d(1, 2, 3));
  auto accessor = grid->getAccessor();
  for (int x = -kReach; x <= kReach; ++x)
    for (int y = -kReach; y <= kReach; ++y)
      for (int z = -kReach; z <= kReach; ++z) {
        const openvdb::Vec3d p = grid->indexToWorld(Coord(x, y, z));
        accessor.setValue(Coord(x, y, z), static_cast<float>(1 + p.x() - 2 * p.y() + 0.25 * p.z()));
      }
  return grid;
}

V3d linearVelocity(const V3d& p) {
  return {1 + p.x - 2 * p.y + p.z, 3 * p.x + p.z, 2 - p.x + 4 * p.y - p.z};
}

Vec3SGrid::Ptr velocityGrid(bool staggered) {
  const auto grid = Vec3SGrid::create(openvdb::Vec3s(0.0f));
  grid->setName("velocity");
  grid->setTransform(levelset::uniformTransform(0.25));
  if (staggered) grid->setGridClass(openvdb::GRID_STAGGERED);
  auto accessor = grid->getAccessor();
  for (int x = -kReach; x <= kReach; ++x)
    for (int y = -kReach; y <= kReach; ++y)
      for (int z = -kReach; z <= kReach; ++z) {
        openvdb::Vec3s value;
        for (int i = 0; i < 3; ++i) {
          openvdb::Vec3d place(x, y, z);
          if (staggered) place[i] -= 0.5;
          value[i] =
              static_cast<float>(linearVelocity(levelset::toImath(grid->indexToWorld(place)))[i]);
        }
        accessor.setValue(Coord(x, y, z), value);
      }
  return grid;
}

void writeForeign(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
                  std::uint32_t compression) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.setCompression(compression);
  file.write(grids);
}

TEST(FieldGrid, InterpolatesNumbersThroughItsTransform) {
  const FieldGrid grid = levelset::importField(linearGrid());
  EXPECT_FALSE(grid.isVector());
  EXPECT_EQ(grid.voxelSize(), 0.5);
  const levelset::ScalarField field = levelset::asScalarField(grid);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> inside(-5, 5);
  for (int i = 0; i < 1000; ++i) {
    const V3d p(1 + inside(random), 2 + inside(random), 3 + inside(random));
    ASSERT_NEAR(field(p), 1 + p.x - 2 * p.y + 0.25 * p.z, support::doubleRounding(12.5));
  }
  EXPECT_EQ(field(V3d(1e300, 0, 0)), 0);
  EXPECT_EQ(field(V3d(100, -1e12, 0)), 0);
  EXPECT_TRUE(std::isfinite(field(V3d(std::nan("")))));
  EXPECT_EQ(grid.bounds().min, V3d(1 - 6, 2 - 6, 3 - 6));
}

TEST(FieldGrid, ReadsStaggeredComponentsAtFaces) {
  for (const bool staggered : {false, true}) {
    const FieldGrid grid = levelset::importField(velocityGrid(staggered));
    EXPECT_EQ(grid.isStaggered(), staggered);
    const levelset::VectorField field = levelset::asVectorField(grid);
    std::mt19937 random(2);
    std::uniform_real_distribution<double> inside(-2.5, 2.5);
    for (int i = 0; i < 1000; ++i) {
      const V3d p(inside(random), inside(random), inside(random));
      ASSERT_LT((field(p, 7) - linearVelocity(p)).length(), support::doubleRounding(20))
          << staggered;
    }
  }
}

TEST(FieldGrid, IsSampledByManyThreads) {
  const levelset::ScalarField field = levelset::asScalarField(levelset::importField(linearGrid()));
  std::atomic<int> wrong = 0;
  tbb::parallel_for(0, 200000, [&](int i) {
    const double x = 1 + (i % 997) * 0.004;
    if (std::abs(field(V3d(x, 2, 3)) - (x - 2.25)) > 1e-5) ++wrong;
  });
  EXPECT_EQ(wrong, 0);
}

TEST(FieldGrid, OfABandIsItsDistance) {
  const Imath::Box3d box(V3d(-2), V3d(2));
  const auto band = support::sampleBand([](const V3d& p) { return p.length() - 1.5; }, box, 0.25);
  const levelset::ScalarField field = levelset::asScalarField(band);
  EXPECT_NEAR(field(V3d(1.5, 0, 0)), 0, support::rounding(1));
  EXPECT_NEAR(field(V3d(0, 1.25, 0)), -0.25, support::rounding(1));
  EXPECT_FLOAT_EQ(static_cast<float>(field(V3d(50, 0, 0))), 0.75f);
}

TEST(FieldGrid, RefusesTheWrongKindAndNan) {
  const FieldGrid numbers = levelset::importField(linearGrid());
  const FieldGrid vectors = levelset::importField(velocityGrid(true));
  EXPECT_THROW((void)levelset::asVectorField(numbers), InvalidInput);
  EXPECT_THROW((void)levelset::asScalarField(vectors), InvalidInput);
  const auto broken = linearGrid();
  broken->tree().setValue(Coord(1, 2, 3), std::numeric_limits<float>::quiet_NaN());
  EXPECT_NE(refusal<InvalidInput>([&] { (void)levelset::importField(broken); }).find("[1, 2, 3]"),
            std::string::npos);
  const auto tile = velocityGrid(false);
  tile->tree().addTile(1, Coord(800, 0, 0),
                       openvdb::Vec3s(0, std::numeric_limits<float>::infinity(), 0), true);
  EXPECT_THROW((void)levelset::importField(tile), InvalidInput);
}

TEST(FieldGrid, KeepsEveryBitInFiles) {
  const TemporaryFolder folder;
  const FieldGrid numbers = levelset::importField(linearGrid());
  const FieldGrid vectors = levelset::importField(velocityGrid(true));
  for (const FieldGrid& field : {numbers, vectors}) {
    levelset::writeField(folder / "a.vdb", field, {.name = "it"});
    const FieldGrid again = levelset::readField(folder / "a.vdb", {.grid = "it"});
    EXPECT_EQ(again.contentHash(), field.contentHash());
    EXPECT_EQ(again.isStaggered(), field.isStaggered());
    EXPECT_EQ(again.name(), "it");
    levelset::writeField(folder / "b.vdb", again, {.name = "it"});
    EXPECT_EQ(support::readText(folder / "a.vdb"), support::readText(folder / "b.vdb"));
  }
  EXPECT_THROW(levelset::writeField(folder / "a.nvdb", numbers), levelset::UsageError);
}

TEST(FieldGrid, ReadsEveryStorageOfOpenVdb) {
  const TemporaryFolder folder;
  const FieldGrid vectors = levelset::importField(velocityGrid(true));
  const auto half = velocityGrid(true);
  half->setName("half");
  half->setSaveFloatAsHalf(true);
  const auto wide = openvdb::Vec3DGrid::create(openvdb::Vec3d(0.0));
  const Vec3SGrid::Ptr narrow = velocityGrid(true);
  for (auto it = narrow->cbeginValueOn(); it; ++it)
    wide->tree().setValueOn(it.getCoord(), openvdb::Vec3d(*it));
  wide->setName("wide");
  wide->setTransform(levelset::uniformTransform(0.25));
  wide->setGridClass(openvdb::GRID_STAGGERED);
  for (const std::uint32_t compression : {0u, 1u, 2u, 3u, 4u, 6u}) {
    writeForeign(folder / "a.vdb", {velocityGrid(true), half, wide}, compression);
    const auto read = [&](const char* grid) {
      return levelset::readField(folder / "a.vdb", {.grid = grid});
    };
    EXPECT_EQ(read("velocity").contentHash(), vectors.contentHash()) << compression;
    EXPECT_EQ(read("wide").contentHash(), vectors.contentHash()) << compression;
    const V3d place(0.3, -0.4, 0.9);
    const V3d coarse = levelset::asVectorField(read("half"))(place, 0);
    // Half floats hold the components here exactly.
    EXPECT_LT((coarse - linearVelocity(place)).length(), support::doubleRounding(1));
  }
}

TEST(FieldGrid, KeepsActiveTilesAsTiles) {
  const TemporaryFolder folder;
  const auto grid = FloatGrid::create(0);
  grid->setName("fog");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->tree().addTile(3, Coord(0), 2.0f, true);  // 4096³ voxels
  writeForeign(folder / "a.vdb", {grid}, 3);
  const FieldGrid field =
      levelset::readField(folder / "a.vdb", {.grid = "fog", .maxMemory = 100 << 20});
  EXPECT_EQ(field.gridClass(), "fog volume");
  EXPECT_EQ(levelset::asScalarField(field)(V3d(1000.5, 7, 7)), 2);
}

TEST(FieldGrid, DistinguishesBandsFromFields) {
  const TemporaryFolder folder;
  const Imath::Box3d box(V3d(-2), V3d(2));
  const auto band = support::sampleBand([](const V3d& p) { return p.length() - 1.5; }, box, 0.25);
  const auto ball = levelset::vdb(band).deepCopy();
  ball->setName("ball");
  writeForeign(folder / "a.vdb", {ball, linearGrid(), velocityGrid(true)}, 3);
  const auto index = [&](const char* grid) {
    return levelset::readGrid(folder / "a.vdb", {.grid = grid}).index();
  };
  EXPECT_EQ(index("ball"), 0u);
  EXPECT_EQ(index("density"), 1u);
  EXPECT_EQ(index("velocity"), 1u);
  EXPECT_EQ(index(""), 0u);
  const auto grids = levelset::bandFileInfo(folder / "a.vdb");
  EXPECT_TRUE(grids[0].isLevelSet);
  EXPECT_FALSE(grids[1].isLevelSet);
  EXPECT_EQ(grids[2].type, "vec3s");
  EXPECT_NE(refusal<InvalidInput>([&] {
              (void)levelset::readBand(folder / "a.vdb", {.grid = "velocity"});
            }).find("vec3s"),
            std::string::npos);
}

TEST(FieldGrid, SurvivesDamagedFiles) {
  const TemporaryFolder folder;
  std::mt19937 random(20261121);
  int taken = 0, refused = 0;
  for (const std::uint32_t compression : {0u, 3u, 6u}) {
    writeForeign(folder / "a.vdb", {velocityGrid(true)}, compression);
    const std::string whole = support::readText(folder / "a.vdb");
    for (int i = 0; i < 80; ++i) {
      std::string damaged = i % 10 ? whole : whole.substr(0, random() % whole.size());
      const std::size_t reach =
          i % 2 ? damaged.size() : std::min<std::size_t>(2000, damaged.size());
      for (int k = 0; k <= i % 3 && reach > 0; ++k)
        damaged[random() % reach] = static_cast<char>(i % 5 ? random() & 0xFF : 0xFF);
      support::writeText(folder / "damaged.vdb", damaged);
      try {
        (void)levelset::readField(folder / "damaged.vdb",
                                  {.grid = "velocity", .maxMemory = std::size_t{1} << 28});
        ++taken;
      } catch (const levelset::Error&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(taken, 20);
  EXPECT_GT(refused, 20);
}

}  // namespace field_grid_test
