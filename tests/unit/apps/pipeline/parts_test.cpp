// Results that exceed --max-memory are computed in parts, with the bits of the complete result.

#include <gtest/gtest.h>

#include <string>

#include "tests/support/command_line.h"

namespace parts_test {

class Parts : public support::ShellTest {
 protected:
  /// Runs a chain without and with a memory limit and compares the files.
  void expectEqualFiles(const std::string& limit, const std::string& chain) {
    const auto whole = levelsmith(chain + " ! write whole.vdb");
    ASSERT_EQ(whole.code, 0) << whole.err;
    EXPECT_EQ(whole.err.find("parts"), std::string::npos) << whole.err;
    const auto parts = levelsmith("--max-memory " + limit + " " + chain + " ! write parts.vdb");
    ASSERT_EQ(parts.code, 0) << parts.err;
    EXPECT_NE(parts.err.find(" parts to stay within --max-memory"), std::string::npos) << parts.err;
    EXPECT_EQ(support::slurp(folder_ / "whole.vdb") == support::slurp(folder_ / "parts.vdb"), true)
        << chain;
  }
};

TEST_F(Parts, OffsetsHaveTheBitsOfTheWhole) {
  expectEqualFiles("160M", "torus --radius 4 --tube 1.3 --voxel 0.02 ! offset 4vx");
}

TEST_F(Parts, GaussiansOfMeshesHaveTheBitsOfTheWhole) {
  ASSERT_EQ(levelsmith("torus --radius 2 --tube 0.6 --voxel 0.1 ! mesh ! write t.ply").code, 0);
  expectEqualFiles("160M", "read t.ply ! level-set --voxel 0.01 ! smooth --sigma 1vx");
}

TEST_F(Parts, FilesAreReadInParts) {
  ASSERT_EQ(levelsmith("box --size 9,8,2 --voxel 0.025 ! write in.vdb").code, 0);
  // The inset leaves no surface in the outer parts.
  expectEqualFiles("160M", "read in.vdb ! offset -0.6");
}

TEST_F(Parts, OtherChainsAreRefusedAsBefore) {
  const std::string big = "sphere --radius 1 --voxel 0.004";
  const std::string limited = "--max-memory 130M ";
  EXPECT_EQ(levelsmith(limited + "--no-roi " + big + " ! write a.vdb").code, 4);
  EXPECT_EQ(levelsmith(limited + big + " ! " + big + " --center 1,0,0 ! union ! write a.vdb").code,
            4);
  EXPECT_EQ(levelsmith(limited + big + " ! write a.nvdb").code, 4);
  EXPECT_EQ(fileCount(), 0u);
}

TEST_F(Parts, AResultWithoutSurfaceIsRefused) {
  const auto outcome =
      levelsmith("--max-memory 130M sphere --radius 1 --voxel 0.005 ! offset -1.2 ! write a.vdb");
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_EQ(fileCount(), 0u);
}

}  // namespace parts_test
