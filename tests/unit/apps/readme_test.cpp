// The examples of the README are what people try first.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/shell.h"

namespace readme_test {

class Readme : public support::ShellTest {};

/// The command lines of the ```sh chain blocks, one block after the other.
std::vector<std::string> chainBlocks() {
  std::istringstream text(support::slurp(LEVELSMITH_README));
  std::vector<std::string> blocks;
  bool inside = false;
  for (std::string line; std::getline(text, line);) {
    if (line == "```sh chain") {
      inside = true;
      blocks.emplace_back();
    } else if (line == "```") {
      inside = false;
    } else if (inside) {
      blocks.back() += line + "\n";
    }
  }
  return blocks;
}

TEST_F(Readme, ExamplesRun) {
  const std::vector<std::string> blocks = chainBlocks();
  ASSERT_EQ(blocks.size(), 3u);
  for (const std::string& block : blocks) {
    const auto outcome =
        shell("set -e\nlevelsmith() { '" + command() + "' --quiet \"$@\"; }\n" + block, 110);
    EXPECT_EQ(outcome.code, 0) << block << outcome.err;
  }
  for (const char* file : {"plate.ply", "ring.ply", "ring.vdb", "out.vdb", "out.ply", "out.png"})
    EXPECT_TRUE(exists(file)) << file;
  // The rings on the base, as the README maps them.
  const auto outcome = levelsmith("read out.ply ! measure --json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto m = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(m["closed_manifold"], true);
  EXPECT_EQ(m["shells"], 1);
  EXPECT_EQ(m["components"], 1);
  EXPECT_GT(m["volume"], 40 * 40 * 10);
  EXPECT_NEAR(m["bounds"]["max"][2], 5 + 8 - 0.5, 0.05);  // sunk by a voxel of the base
}

}  // namespace readme_test
