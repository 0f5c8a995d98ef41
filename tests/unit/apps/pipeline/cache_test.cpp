// Results of earlier runs equal computed results, whatever happens to the cache folder.

#include "apps/pipeline/cache/cache.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "apps/pipeline/values/mesh_bytes.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/command_line.h"

namespace cache_test {

using support::Outcome;
using support::ShellTest;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

TEST(MeshBytes, RestoreTheMeshBitForBit) {
  levelset::TriMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0.1, -0.0}, {0, 1e-300, 1e300}};
  mesh.triangles = {{0, 1, 2}};
  mesh.spacing = 1e-7;
  mesh.precision = levelset::CoordinatePrecision::Float;
  mesh.attributes.uvs = {{0, 0}, {1, 0}, {0, 1}};
  mesh.attributes.hasAlpha = true;
  const std::string bytes = pipeline::bytesOf(mesh);
  levelset::TriMesh again;
  ASSERT_TRUE(pipeline::readMeshBytes(bytes, again));
  EXPECT_EQ(pipeline::bytesOf(again), bytes);
  EXPECT_TRUE(std::signbit(again.positions[1].z));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 4);
    EXPECT_FALSE(pipeline::readMeshBytes(damaged, again)) << i;
    EXPECT_FALSE(pipeline::readMeshBytes(bytes.substr(0, i), again)) << i;
  }
}

TEST(CacheEntry, IsIgnoredIfAnyByteIsDamaged) {
  const fs::path folder = fs::temp_directory_path() / ("cache-entry-" + std::to_string(::getpid()));
  const pipeline::Cache cache(folder);
  ASSERT_EQ(
      cache.put("key", {.action = "measure", .notes = {}, .output = "volume 4.19\n", .files = {}},
                nullptr),
      "");
  ASSERT_TRUE(cache.step("key"));
  EXPECT_EQ(cache.step("key")->output, "volume 4.19\n");
  const fs::path file = folder / "results" / "key.json";
  const std::string bytes = support::slurp(file);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 16);
    std::ofstream(file, std::ios::binary) << damaged;
    EXPECT_FALSE(cache.step("key")) << i;
  }
  fs::remove_all(folder);
}

class CacheRun : public ShellTest {
 protected:
  /// Chain with level sets, a mesh, a field and printed values.
  static std::string chain(const std::string& size = "1,1,3") {
    return "sphere --radius 1 --voxel 0.1 --as a ! box --size " + size +
           " --voxel 0.1 ! difference @a ! write o.vdb ! render o.exr --size 32x24 --samples 1 "
           "--renderer cpu ! mesh ! write o.ply ! measure --json";
  }
  /// All output of a run.
  std::string left(const Outcome& outcome) {
    std::string all = outcome.out;
    for (const char* file : {"o.vdb", "o.exr", "o.ply"}) all += support::slurp(folder_ / file);
    return all;
  }
  void clear() {
    for (const char* file : {"o.vdb", "o.exr", "o.ply"}) fs::remove(folder_ / file);
  }
  /// @return number of steps that ran
  std::size_t ran() {
    const Json report = Json::parse(support::slurp(folder_ / "r.json"));
    std::size_t count = 0;
    for (const Json& step : report["steps"]) count += !step.contains("known");
    return count;
  }
};

TEST_F(CacheRun, GivesTheSameResultsAndComputesNothingTwice) {
  const Outcome plain = levelsmith(chain());
  ASSERT_EQ(plain.code, 0) << plain.err;
  const std::string expected = left(plain);
  clear();
  const Outcome first = levelsmith("--cache c --report r.json " + chain());
  EXPECT_TRUE(left(first) == expected);
  EXPECT_EQ(ran(), 8u);
  const Outcome second = levelsmith("--cache c --report r.json " + chain());
  EXPECT_TRUE(left(second) == expected);
  EXPECT_EQ(ran(), 0u);
  EXPECT_NE(second.err.find("nothing was computed: all 8 results come from an earlier run"),
            std::string::npos)
      << second.err;
  // A missing or changed output file is written again from the cache.
  fs::remove(folder_ / "o.ply");
  std::ofstream(folder_ / "o.exr") << "other";
  EXPECT_TRUE(left(levelsmith("--cache c --report r.json " + chain())) == expected);
  EXPECT_EQ(ran(), 2u);
  // Results that do not depend on the changed parameter are kept.
  const Outcome changed = levelsmith("--cache c --report r.json " + chain("1,1,2.5"));
  EXPECT_EQ(ran(), 7u);
  EXPECT_TRUE(left(changed) == left(levelsmith(chain("1,1,2.5"))));
}

TEST_F(CacheRun, DependsOnTheContentsOfFiles) {
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 ! write s.vdb ! mesh ! write s.ply").code, 0);
  const std::string both =
      "--cache c --report r.json read s.vdb ! offset 0.1 ! write a.vdb ! read s.ply ! level-set "
      "--voxel 0.1 ! write b.vdb";
  ASSERT_EQ(levelsmith(both).code, 0);
  EXPECT_EQ(ran(), 6u);
  ASSERT_EQ(shell("touch s.vdb s.ply").code, 0);
  ASSERT_EQ(levelsmith(both).code, 0);
  EXPECT_EQ(ran(), 0u);
  // Another tree and another mesh.
  ASSERT_EQ(levelsmith("sphere --radius 1.1 --voxel 0.1 ! write s.vdb").code, 0);
  ASSERT_EQ(levelsmith(both).code, 0);
  EXPECT_EQ(ran(), 3u);
  ASSERT_EQ(shell("sed -i 's/comment.*/comment other/' s.ply").code, 0);
  ASSERT_EQ(levelsmith(both).code, 0);
  EXPECT_LE(ran(), 3u);
}

TEST_F(CacheRun, KnowsThatAHeaderHasItsNumbersInAnotherFile) {
  ASSERT_EQ(
      shell("printf 'NDims = 3\\nDimSize = 2 2 2\\nElementType = MET_UCHAR\\n"
            "ElementDataFile = a.raw\\n' > a.mhd && printf '\\1\\2\\3\\4\\5\\6\\7\\10' > a.raw")
          .code,
      0);
  const std::string info = "--cache c read a.mhd ! info --json";
  const Outcome first = levelsmith(info);
  ASSERT_EQ(first.code, 0) << first.err;
  ASSERT_EQ(shell("printf '\\11\\2\\3\\4\\5\\6\\7\\10' > a.raw").code, 0);
  const Outcome second = levelsmith(info);
  EXPECT_EQ(second.code, 0) << second.err;
  EXPECT_NE(second.out, first.out);
  EXPECT_EQ(second.out, levelsmith("read a.mhd ! info --json").out);
}

TEST_F(CacheRun, DistinguishesAFileFromItsLaterContents) {
  const std::string ball = "sphere --radius 1 --voxel 0.1 ! write a.vdb",
                    box = "box --size 1,2,3 --voxel 0.1 ! write a.vdb",
                    rest = " ! read a.vdb ! offset 0.1 ! measure --json";
  ASSERT_EQ(levelsmith(ball).code, 0);
  const auto ofBox = levelsmith("--cache c " + box + rest);  // the file contains a ball at first
  ASSERT_EQ(ofBox.code, 0) << ofBox.err;
  ASSERT_EQ(levelsmith(ball).code, 0);
  const auto ofBall = levelsmith("--cache c " + rest.substr(3));
  ASSERT_EQ(ofBall.code, 0) << ofBall.err;
  EXPECT_NE(ofBall.out, ofBox.out);
  EXPECT_EQ(ofBall.out, levelsmith(ball + rest).out);
}

TEST_F(CacheRun, KeepsFieldsNotesAndWarnings) {
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 ! mesh ! write s.ply").code, 0);
  const std::string line =
      "--cache c --report r.json read s.ply ! level-set --voxel 0.1 ! smooth --sigma 1vx ! check";
  const Outcome first = levelsmith(line), second = levelsmith(line);
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_EQ(second.out, first.out);
  EXPECT_EQ(ran(), 0u);
  // Notes are repeated, with one more.
  EXPECT_EQ(second.err.find(first.err), 0u) << second.err;
}

TEST_F(CacheRun, DoesNotKeepFailures) {
  const std::string line =
      "--cache c --report r.json sphere --radius 1 --voxel 0.2 ! render a.exr --size 0x0";
  EXPECT_EQ(levelsmith(line).code, 2);
  const std::string clash = "--cache c sphere --radius 1 --voxel 0.2 ! write nowhere/a.vdb";
  EXPECT_EQ(levelsmith(clash).code, 6);
  EXPECT_EQ(levelsmith(clash).code, 6);
  std::ofstream(folder_ / "file") << "";
  EXPECT_EQ(levelsmith("--cache file sphere --radius 1 --voxel 0.2 ! measure").code, 6);
}

TEST_F(CacheRun, IgnoresDamagedEntries) {
  const std::string expected = left(levelsmith("--cache c " + chain()));
  std::mt19937 random(3);
  std::size_t files = 0;
  for (int round = 0; round < 6; ++round) {
    for (const fs::directory_entry& item : fs::recursive_directory_iterator(folder_ / "c")) {
      if (!item.is_regular_file()) continue;
      ++files;
      std::string bytes = support::slurp(item.path());
      if (bytes.empty()) continue;
      if (round % 3 == 0)
        bytes.resize(random() % bytes.size());
      else if (round % 3 == 1)
        bytes[random() % bytes.size()] ^= 16;
      else if (random() % 2 == 0)
        bytes.clear();
      std::ofstream(item.path(), std::ios::binary) << bytes;
    }
    if (round % 2 == 0) clear();
    const Outcome again = levelsmith("--cache c " + chain());
    EXPECT_EQ(again.code, 0) << again.err;
    EXPECT_TRUE(left(again) == expected) << round;
  }
  EXPECT_GT(files, 60u);
}

TEST_F(CacheRun, SurvivesBeingKilledAtAnyTime) {
  const std::string expected = left(levelsmith(chain()));
  std::mt19937 random(11);
  int killed = 0;
  for (int i = 0; i < 25; ++i) {
    if (i % 5 == 0) fs::remove_all(folder_ / "c");
    clear();
    const double moment = 0.005 + 0.12 * static_cast<double>(random() % 1000) / 1000;
    killed += shell("timeout -s KILL " + std::to_string(moment) + " " + command() + " --cache c " +
                    chain())
                  .code == 137;
    const Outcome next = levelsmith("--cache c " + chain());
    ASSERT_EQ(next.code, 0) << next.err;
    ASSERT_TRUE(left(next) == expected) << "killed after " << moment << " s";
  }
  EXPECT_GT(killed, 5);
}

TEST_F(CacheRun, IsSharedByConcurrentRuns) {
  const std::string expected = left(levelsmith(chain()));
  std::string line;
  for (const char* part : {"a", "b", "c", "d"})
    line += std::string("(mkdir ") + part + " && cd " + part + " && " + command() +
            " --quiet --cache ../kept " + chain() + " > out || touch ../failed) & ";
  ASSERT_EQ(shell(line + "wait").code, 0);
  EXPECT_FALSE(exists("failed"));
  for (const char* part : {"a", "b", "c", "d"}) {
    std::string all = support::slurp(folder_ / part / "out");
    for (const char* file : {"o.vdb", "o.exr", "o.ply"})
      all += support::slurp(folder_ / part / file);
    EXPECT_TRUE(all == expected) << part;
  }
}

TEST_F(CacheRun, CanBeListedAndReduced) {
  ASSERT_EQ(levelsmith("--cache c " + chain()).code, 0);
  const Json all = Json::parse(levelsmith("cache list c --json").out);
  EXPECT_EQ(all["entries"], 8);
  EXPECT_GT(all["bytes"], 30000);
  const Json less = Json::parse(levelsmith("cache gc c --max-size 20K --json").out);
  EXPECT_LE(less["bytes"], 20 * 1024);
  EXPECT_EQ(less["removed"].get<int>() + less["entries"].get<int>(), 8);
  EXPECT_EQ(levelsmith("--cache c " + chain()).code, 0);
  EXPECT_EQ(levelsmith("cache gc c").code, 2);
  EXPECT_EQ(levelsmith("cache list c --max-size 1K").code, 2);
  EXPECT_EQ(levelsmith("cache list nowhere").code, 6);
  EXPECT_EQ(levelsmith("cache list .").code, 6);
  // Without a name no folder is created.
  EXPECT_FALSE(exists("results"));
}

}  // namespace cache_test
