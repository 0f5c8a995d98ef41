// Points in OpenVDB files, written and read by this library, and exchanged with OpenVDB.

#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/points/AttributeGroup.h>
#include <openvdb/points/PointDataGrid.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <tuple>

#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/files/vdb_writer.h"
#include "levelset/point_files/point_file.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace vdb_points_test {

using Imath::V3d;
using Imath::V3f;
using Imath::V4f;
using levelset::CoordinatePrecision;
using levelset::InvalidInput;
using levelset::PointCloud;
using levelset::readPoints;
using levelset::writePoints;
using openvdb::points::PointDataGrid;
using support::refusal;
using support::TemporaryFolder;

/// Points on a sphere and in a ball, with all attributes. The weights number them.
PointCloud someCloud(std::size_t count, const V3d& centre, double radius) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  PointCloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const V3d way = V3d(normal(random), normal(random), normal(random)).normalized();
    cloud.positions.push_back(centre + way * (i % 4 ? radius : radius * 0.1 * normal(random)));
    cloud.normals.emplace_back(way);
    cloud.colors.emplace_back(0.5f * static_cast<float>(way.x), 1.5f, 0.25f, i % 2 ? 1.0f : 0.5f);
    cloud.radii.push_back(0.5f + static_cast<float>(i));
    cloud.weights.push_back(static_cast<float>(i));
  }
  return cloud;
}

/// Sorts the points of a cloud by their weights.
PointCloud inOrder(const PointCloud& read) {
  PointCloud cloud = read;
  for (std::size_t i = 0; i < read.size(); ++i) {
    const auto to = static_cast<std::size_t>(read.weights[i]);
    cloud.positions[to] = read.positions[i];
    cloud.normals[to] = read.normals[i];
    cloud.colors[to] = read.colors[i];
    cloud.radii[to] = read.radii[i];
    cloud.weights[to] = read.weights[i];
  }
  return cloud;
}

double voxelOf(const std::filesystem::path& file) {
  return levelset::bandFileInfo(file).front().voxelSize;
}

TEST(VdbPoints, RoundTripsKeepAllAttributes) {
  const TemporaryFolder folder;
  for (const auto& [centre, radius] : {std::pair{V3d(0), 1.0}, std::pair{V3d(1e6, -2e6, 3e5), 1.0},
                                       std::pair{V3d(1, 2, 3), 1e-3}, std::pair{V3d(5), 1e9}}) {
    const PointCloud cloud = someCloud(5000, centre, radius);
    writePoints(folder / "a.vdb", cloud);
    const PointCloud read = inOrder(readPoints(folder / "a.vdb"));
    ASSERT_EQ(read.size(), cloud.size());
    EXPECT_EQ(read.normals, cloud.normals);
    EXPECT_EQ(read.colors, cloud.colors);
    EXPECT_EQ(read.radii, cloud.radii);
    EXPECT_EQ(read.weights, cloud.weights);
    EXPECT_EQ(read.precision, CoordinatePrecision::Double);
    // Rounding of the distance from the centre of a voxel, of type float.
    double largest = 0;
    for (std::size_t i = 0; i < cloud.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        largest = std::max(largest, std::abs(read.positions[i][axis] - cloud.positions[i][axis]));
    EXPECT_LE(largest, 0x1p-26 * voxelOf(folder / "a.vdb"));
    EXPECT_GT(largest, 0x1p-28 * voxelOf(folder / "a.vdb"));
  }
  EXPECT_EQ(levelset::unwritableAttributes("a.vdb", someCloud(2, V3d(0), 1)), "");
}

TEST(VdbPoints, FloatsComeBackExactly) {
  const TemporaryFolder folder;
  for (const double scale : {1e-6, 1.0, 1e6, 1e30})
    for (const V3d& centre : {V3d(0), V3d(1), V3d(-1e3, 1e6, 0.1)}) {
      PointCloud cloud = someCloud(500, centre, 1);
      for (V3d& p : cloud.positions) p = V3d(V3f(p * scale));
      cloud.positions.push_back(V3d(0));
      cloud.positions.push_back(V3d(static_cast<double>(1e-30f * static_cast<float>(scale)), 0, 0));
      cloud.normals = {};
      cloud.colors = {};
      cloud.radii = {};
      cloud.weights = {};
      writePoints(folder / "a.vdb", cloud);
      PointCloud read = readPoints(folder / "a.vdb");
      EXPECT_EQ(read.precision, CoordinatePrecision::Float);
      const auto isBefore = [](const V3d& a, const V3d& b) {
        return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
      };
      std::sort(read.positions.begin(), read.positions.end(), isBefore);
      std::sort(cloud.positions.begin(), cloud.positions.end(), isBefore);
      ASSERT_EQ(read.size(), cloud.size());
      for (std::size_t i = 0; i < cloud.size(); ++i)
        ASSERT_EQ(read.positions[i], cloud.positions[i]) << scale << ' ' << centre.x;
    }
}

TEST(VdbPoints, DuplicatesAndOnePointComeBack) {
  const TemporaryFolder folder;
  PointCloud cloud;
  cloud.positions = {V3d(1, 2, 3)};
  writePoints(folder / "a.vdb", cloud);
  EXPECT_EQ(readPoints(folder / "a.vdb").positions, cloud.positions);
  cloud.positions.assign(1000, V3d(0.5, -0.5, 0.25));
  writePoints(folder / "a.vdb", cloud);
  EXPECT_EQ(readPoints(folder / "a.vdb").positions, cloud.positions);
}

TEST(VdbPoints, AreTheSameBytesOnAnyNumberOfThreads) {
  const TemporaryFolder folder;
  const PointCloud cloud = someCloud(20000, V3d(0), 1);
  const auto written = [&] {
    writePoints(folder / "a.vdb", cloud);
    return support::readText(folder / "a.vdb");
  };
  const std::string one = support::onThreads(1, written);
  EXPECT_TRUE(one == support::onThreads(3, written));
}

PointDataGrid::Ptr readByOpenVdb(const std::filesystem::path& path) {
  openvdb::io::File file(path.string());
  file.open();
  return openvdb::gridPtrCast<PointDataGrid>(file.readGrid("points"));
}

TEST(VdbPoints, AreReadByOpenVdb) {
  openvdb::initialize();
  const TemporaryFolder folder;
  const PointCloud cloud = someCloud(20000, V3d(10, 0, 0), 3);
  writePoints(folder / "a.vdb", cloud);
  const PointDataGrid::Ptr grid = readByOpenVdb(folder / "a.vdb");
  ASSERT_TRUE(grid);
  // Three quarters of the points lie on a sphere.
  const double perVoxel =
      static_cast<double>(cloud.size()) / static_cast<double>(grid->activeVoxelCount());
  EXPECT_GT(perVoxel, 4);
  EXPECT_LT(perVoxel, 8 * std::sqrt(2.0));
  std::size_t points = 0;
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
    using openvdb::points::AttributeHandle;
    const AttributeHandle<openvdb::Vec3f> position(leaf->constAttributeArray("P")),
        normal(leaf->constAttributeArray("N")), color(leaf->constAttributeArray("Cd"));
    const AttributeHandle<float> alpha(leaf->constAttributeArray("Alpha")),
        radius(leaf->constAttributeArray("pscale")), weight(leaf->constAttributeArray("weight"));
    for (auto index = leaf->beginIndexOn(); index; ++index, ++points) {
      const openvdb::Vec3d at =
          grid->indexToWorld(index.getCoord().asVec3d() + openvdb::Vec3d(position.get(*index)));
      const auto i = static_cast<std::size_t>(weight.get(*index));
      ASSERT_LT((V3d(at[0], at[1], at[2]) - cloud.positions[i]).length(), 1e-7);
      const openvdb::Vec3f n = normal.get(*index), c = color.get(*index);
      ASSERT_EQ(V3f(n[0], n[1], n[2]), cloud.normals[i]);
      ASSERT_EQ(V4f(c[0], c[1], c[2], alpha.get(*index)), cloud.colors[i]);
      ASSERT_EQ(radius.get(*index), cloud.radii[i]);
    }
  }
  EXPECT_EQ(points, cloud.size());
}

/// Writes points by OpenVDB, with positions in a codec, numbers, equal radii and a group.
template <class Codec>
void writeByOpenVdb(const std::filesystem::path& path, const std::vector<openvdb::Vec3d>& points,
                    double voxel, bool isCompressed = true) {
  openvdb::initialize();
  using namespace openvdb::points;
  using Leaf = PointDataTree::LeafNodeType;
  const auto grid = PointDataGrid::create();
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
  transform->postTranslate(openvdb::Vec3d(0.1, 0.2, 0.3));
  grid->setTransform(transform);
  grid->setName("particles");
  std::map<openvdb::Coord, std::map<openvdb::Index, std::vector<openvdb::Vec3f>>> leaves;
  for (const openvdb::Vec3d& p : points) {
    const openvdb::Vec3d at = grid->worldToIndex(p);
    const openvdb::Coord ijk = openvdb::Coord::round(at);
    leaves[ijk & ~7][Leaf::coordToOffset(ijk)].emplace_back(at - ijk.asVec3d());
  }
  using Position = TypedAttributeArray<openvdb::Vec3f, Codec>;
  auto descriptor = AttributeSet::Descriptor::create(Position::attributeType());
  descriptor =
      descriptor->duplicateAppend("id", TypedAttributeArray<std::int32_t>::attributeType());
  descriptor = descriptor->duplicateAppend("pscale", TypedAttributeArray<float>::attributeType());
  descriptor = descriptor->duplicateAppend("__group1", GroupAttributeArray::attributeType());
  descriptor->setGroup("chosen", 0);
  for (const auto& [origin, voxels] : leaves) {
    auto* leaf = new Leaf(origin);
    std::vector<openvdb::Vec3f> local;
    std::vector<Leaf::ValueType> ends(Leaf::SIZE);
    for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
      if (const auto found = voxels.find(n); found != voxels.end())
        local.insert(local.end(), found->second.begin(), found->second.end());
      ends[n] = static_cast<std::uint32_t>(local.size());
    }
    leaf->replaceAttributeSet(
        new AttributeSet(descriptor, static_cast<openvdb::Index>(local.size())), true);
    leaf->setOffsets(ends);
    AttributeWriteHandle<openvdb::Vec3f> position(leaf->attributeArray("P"));
    for (std::size_t i = 0; i < local.size(); ++i)
      position.set(static_cast<openvdb::Index>(i), local[i]);
    AttributeWriteHandle<float>(leaf->attributeArray("pscale")).collapse(0.25f);
    grid->tree().addLeaf(leaf);
  }
  openvdb::io::File file(path.string());
  if (!isCompressed) file.setCompression(openvdb::io::COMPRESS_NONE);
  file.write({grid});
}

TEST(VdbPoints, OfOpenVdbAreRead) {
  const TemporaryFolder folder;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> in(-5, 5);
  std::vector<openvdb::Vec3d> points;
  for (int i = 0; i < 20000; ++i) points.emplace_back(in(random), in(random), in(random) + 1e3);
  const double voxel = 0.4;
  using openvdb::points::FixedPointCodec;
  using openvdb::points::NullCodec;
  using openvdb::points::TruncateCodec;
  const auto check = [&](const char* name, double error) {
    std::vector<std::string> notes;
    const PointCloud read = readPoints(folder / name, {.notes = &notes});
    ASSERT_EQ(read.size(), points.size());
    EXPECT_EQ(read.radii, std::vector<float>(points.size(), 0.25f));
    const auto isBefore = [](const V3d& a, const V3d& b) { return a.x < b.x; };
    std::vector<V3d> expected;
    for (const openvdb::Vec3d& p : points) expected.emplace_back(p[0], p[1], p[2]);
    std::sort(expected.begin(), expected.end(), isBefore);
    std::vector<V3d> found = read.positions;
    std::sort(found.begin(), found.end(), isBefore);
    // Sorted coordinates differ by at most the error of one.
    double largest = 0;
    for (std::size_t i = 0; i < found.size(); ++i)
      largest = std::max(largest, std::abs(found[i].x - expected[i].x));
    EXPECT_LE(largest, error * voxel * 1.0001 + 1e-12) << name;
    EXPECT_GT(largest, error * voxel / 3) << name;
    std::string all;
    for (const std::string& note : notes) all += note + "\n";
    EXPECT_NE(all.find("'id' (int32, null)"), std::string::npos) << all;
    EXPECT_NE(all.find("groups"), std::string::npos) << all;
    EXPECT_EQ(all.find("rounded") == std::string::npos, error < 1e-6) << all;
  };
  writeByOpenVdb<NullCodec>(folder / "null.vdb", points, voxel);
  check("null.vdb", 0x1p-26);
  writeByOpenVdb<NullCodec>(folder / "plain.vdb", points, voxel, false);
  check("plain.vdb", 0x1p-26);
  writeByOpenVdb<FixedPointCodec<false>>(folder / "16.vdb", points, voxel);
  check("16.vdb", 1.0 / 0xffff);
  writeByOpenVdb<FixedPointCodec<true>>(folder / "8.vdb", points, voxel);
  check("8.vdb", 1.0 / 0xff);
  writeByOpenVdb<TruncateCodec>(folder / "half.vdb", points, voxel);
  check("half.vdb", 0x1p-13);
}

TEST(VdbPoints, AreChosenByName) {
  openvdb::initialize();
  const TemporaryFolder folder;
  const auto gridOf = [&](double x, const char* name) {
    PointCloud cloud;
    cloud.positions = {V3d(x)};
    writePoints(folder / "one.vdb", cloud, {.name = name});
    openvdb::io::File file((folder / "one.vdb").string());
    file.open();
    return file.readGrid(name);
  };
  const auto first = gridOf(1, "first"), second = gridOf(2, "second");
  const levelset::NarrowBand ball = levelset::makeSphere(5, V3d(0), 1);
  levelset::writeBand(folder / "band.vdb", ball);
  openvdb::io::File bandFile((folder / "band.vdb").string());
  bandFile.open();
  const auto band = bandFile.readGrid("surface");

  openvdb::io::File((folder / "two.vdb").string()).write({first, second});
  EXPECT_EQ(readPoints(folder / "two.vdb", {.grid = "second"}).positions, std::vector{V3d(2)});
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)readPoints(folder / "two.vdb"); }),
              "more than one grid of points");
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)readPoints(folder / "two.vdb", {.grid = "x"}); }),
              "no grid of points 'x'");
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)readPoints(folder / "band.vdb"); }),
              "but no grid of points");
  EXPECT_TRUE(levelset::holdsPointGrid(folder / "two.vdb"));
  EXPECT_FALSE(levelset::holdsPointGrid(folder / "band.vdb"));
  EXPECT_FALSE(levelset::holdsPointGrid(folder / "none.vdb"));

  openvdb::io::File((folder / "both.vdb").string()).write({first, band});
  EXPECT_FALSE(levelset::holdsPointGrid(folder / "both.vdb"));
  EXPECT_TRUE(levelset::holdsPointGrid(folder / "both.vdb", "first"));
  EXPECT_FALSE(levelset::holdsPointGrid(folder / "both.vdb", "surface"));
  EXPECT_EQ(readPoints(folder / "both.vdb").positions, std::vector{V3d(1)});
  EXPECT_EQ(levelset::readBand(folder / "both.vdb").voxelSize(), 1);
}

TEST(VdbPoints, OfUnknownTypesAndEmptyGridsAreRefused) {
  openvdb::initialize();
  const TemporaryFolder folder;
  const auto empty = PointDataGrid::create();
  empty->setName("points");
  openvdb::io::File((folder / "empty.vdb").string()).write({empty});
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)readPoints(folder / "empty.vdb"); }),
              "holds no points");
  EXPECT_SAYS(refusal<InvalidInput>([&] { writePoints(folder / "a.vdb", PointCloud()); }),
              "no points");
  // Names of types in the descriptor of the attributes.
  PointCloud cloud = someCloud(3, V3d(0), 1);
  cloud.normals = {};
  cloud.colors = {};
  writePoints(folder / "a.vdb", cloud);
  const std::string text = support::readText(folder / "a.vdb");
  const auto replaced = [&](const char* from, const char* to) {
    std::string changed = text;
    changed.replace(changed.find(from), std::string(from).size(), to);
    support::writeText(folder / "changed.vdb", changed);
  };
  replaced("vec3s", "vec3i");
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)readPoints(folder / "changed.vdb"); }),
              "positions (P) of type vec3i with codec null");
  replaced("float", "int32");
  std::vector<std::string> notes;
  const PointCloud read = readPoints(folder / "changed.vdb", {.notes = &notes});
  EXPECT_EQ(read.size(), 3u);
  EXPECT_TRUE(read.radii.empty());
  EXPECT_EQ(read.weights.size(), 3u);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("left out: 'pscale' (int32, null)"), std::string::npos) << notes[0];
  EXPECT_SAYS(refusal<levelset::UsageError>(
                  [&] { writePoints(folder / "a.vdb.gz", someCloud(3, V3d(0), 1)); }),
              "without .gz");
}

TEST(VdbPoints, DamagedFilesAreRefusedOrRead) {
  const TemporaryFolder folder;
  writePoints(folder / "a.vdb", someCloud(300, V3d(0), 1));
  const std::string seed = support::readText(folder / "a.vdb");
  std::mt19937 random(1);
  int refusals = 0;
  for (int round = 0; round < 300; ++round) {
    std::string text = support::mutated(seed, random);
    if (round % 3 == 0) text = seed.substr(0, random() % seed.size());
    support::writeText(folder / "a.vdb", text);
    (void)levelset::holdsPointGrid(folder / "a.vdb");
    try {
      requirePoints(readPoints(folder / "a.vdb", {.maxMemory = std::size_t{64} << 20}));
    } catch (const levelset::Error& error) {
      EXPECT_TRUE(error.exitCode() == levelset::ExitCode::Input ||
                  error.exitCode() == levelset::ExitCode::Resource)
          << error.what();
      ++refusals;
    }
  }
  EXPECT_GT(refusals, 150);
}

TEST(VdbPoints, MemoryIsLimited) {
  const TemporaryFolder folder;
  writePoints(folder / "a.vdb", someCloud(100000, V3d(0), 1));
  (void)refusal<levelset::ResourceLimit>(
      [&] { (void)readPoints(folder / "a.vdb", {.maxMemory = std::size_t{4} << 20}); });
  EXPECT_EQ(readPoints(folder / "a.vdb", {.maxMemory = std::size_t{40} << 20}).size(), 100000u);
}

}  // namespace vdb_points_test
