// Results that exceed the memory limit are computed in parts, with the bytes of the complete
// result.

#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "apps/pipeline/grammar/chain.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "apps/pipeline/run/runner.h"
#include "levelset/error.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/command_line.h"

namespace parts_test {

class Parts : public support::ShellTest {
 protected:
  /// Runs a chain in this process.
  /// @param chain  words separated by spaces
  /// @return notes of the run
  static std::string run(const std::string& chain, std::size_t maxMemory, bool fullValues = false) {
    std::istringstream text(chain);
    std::vector<std::string> words;
    for (std::string word; text >> word;) {
      std::replace(word.begin(), word.end(), '~', ' ');  // blank within a word
      words.push_back(word);
    }
    std::string notes;
    const auto silent = [](const std::string&) {};
    pipeline::RunReport report;
    pipeline::run(pipeline::parseChain(words),
                  {.maxMemory = maxMemory,
                   .fullValues = fullValues,
                   .print = silent,
                   .warn = silent,
                   .note = [&](const std::string& note) { notes += note + "\n"; }},
                  report);
    return notes;
  }

  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }

  /// Number of parts that a note names, 0 without one.
  static int partsIn(const std::string& notes) {
    std::smatch found;
    const std::regex parts("computed in ([0-9]+) parts? to stay within --max-memory");
    return std::regex_search(notes, found, parts) ? std::stoi(found[1]) : 0;
  }

  /// Runs a chain with and without a memory limit, bytes, and compares the files.
  void expectEqualFiles(std::size_t limit, const std::string& chain) {
    const std::string whole = path("whole.vdb"), parts = path("parts.vdb");
    const std::string unlimited = run(chain + " ! write " + whole, levelset::kNoMemoryLimit);
    EXPECT_EQ(unlimited.find(" parts "), std::string::npos) << unlimited;
    const std::string notes = run(chain + " ! write " + parts, limit);
    EXPECT_GE(partsIn(notes), 2) << notes;
    EXPECT_EQ(support::slurp(whole) == support::slurp(parts), true) << chain;
  }
};

TEST_F(Parts, OffsetsHaveTheBytesOfTheWhole) {
  expectEqualFiles(8'000'000, "torus --radius 4.5 --tube 1.5 --voxel 0.1 ! offset 3vx");
}

TEST_F(Parts, GaussiansOfMeshesHaveTheBytesOfTheWhole) {
  run("torus --radius 2 --tube 0.6 --voxel 0.1 ! mesh ! write " + path("t.ply"),
      levelset::kNoMemoryLimit);
  expectEqualFiles(12'000'000,
                   "read " + path("t.ply") + " ! level-set --voxel 0.04 ! smooth --sigma 1vx");
}

TEST_F(Parts, FilesAreReadInParts) {
  run("box --size 25.8,3,3 --voxel 0.1 ! write " + path("in.vdb"), levelset::kNoMemoryLimit);
  // The inset leaves no surface in the outer parts.
  expectEqualFiles(12'000'000, "read " + path("in.vdb") + " ! offset -0.6");
}

TEST_F(Parts, PartsThatAClipEmptiesAreEmpty) {
  // Nothing is left in the cells beyond x = 0.
  expectEqualFiles(
      5'000'000,
      "torus --radius 4.5 --tube 1.5 --voxel 0.1 ! clip --plane -1,0,0~1,0,0 ! offset 3vx");
}

TEST_F(Parts, TheMemoryOfTheProgramCounts) {
  // The program takes about 50 MB without any value.
  const std::string in = path("in.vdb"), whole = path("whole.vdb"), parts = path("parts.vdb");
  run("box --size 0.7,4,0.7 --voxel 0.01 ! write " + in, levelset::kNoMemoryLimit);
  run("read " + in + " ! offset 5vx ! write " + whole, levelset::kNoMemoryLimit);
  const auto told = levelsmith("--max-memory 150M read " + in + " ! offset 5vx ! write " + parts);
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_GE(partsIn(told.err), 2) << told.err;
  EXPECT_TRUE(support::slurp(whole) == support::slurp(parts));
}

TEST_F(Parts, ConversionsReleaseTheirMesh) {
  const pipeline::Operator& op = *pipeline::findOperator("level-set");
  pipeline::Invocation conversion(op, {{"voxel", "0.05"}});
  conversion.operands.emplace_back(
      levelset::bandToMesh(levelset::makeSphere(1, Imath::V3d(0), 0.05), {}));
  double released = 1;
  conversion.progress = [&](double done) {
    if (conversion.operands.empty()) released = std::min(released, done);
    return true;
  };
  EXPECT_FALSE(op.run(conversion).band().isEmpty());
  EXPECT_LT(released, 0.7);
}

TEST_F(Parts, AResultWithoutSurfaceIsRefused) {
  EXPECT_THROW(
      run("box --size 26,5,0.8 --voxel 0.1 ! offset -0.6 ! write " + path("a.vdb"), 10'000'000),
      levelset::InvalidInput);
  EXPECT_EQ(fileCount(), 0u);
}

TEST_F(Parts, OtherChainsAreRefused) {
  const std::string big = "sphere --radius 10 --voxel 0.1";
  constexpr std::size_t kLimit = 6'000'000;
  const std::string target = path("a.vdb");
  EXPECT_THROW(run(big + " ! write " + target, kLimit, true), levelset::ResourceLimit);
  EXPECT_THROW(run(big + " ! " + big + " --center 1,0,0 ! union ! write " + target, kLimit),
               levelset::ResourceLimit);
  EXPECT_THROW(run(big + " ! write " + path("a.nvdb"), kLimit), levelset::ResourceLimit);
  EXPECT_THROW(run(big + " ! write " + path("A.NVDB"), kLimit), levelset::ResourceLimit);
  EXPECT_THROW(run(big + " ! reinitialize --method pde ! write " + target, kLimit),
               levelset::ResourceLimit);
  EXPECT_THROW(
      run(big + " ! emboss --points 0,0,10 --height 0.3 --width 1 ! write " + target, kLimit),
      levelset::ResourceLimit);
  EXPECT_THROW(run(big + " ! mesh ! write " + path("a.ply"), kLimit), levelset::ResourceLimit);
  EXPECT_EQ(fileCount(), 0u);
}

TEST_F(Parts, AreAnnouncedByExplain) {
  const auto told = levelsmith(
      "--max-memory 150M --explain sphere --radius 1 --voxel 0.002 ! write "
      "a.vdb");
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_NE(told.out.find("the result would be computed in parts"), std::string::npos) << told.out;
}

}  // namespace parts_test
