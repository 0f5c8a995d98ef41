// Runs the examples of the README and of docs/, because users try them first.

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/pipeline/grammar/chain.h"
#include "apps/pipeline/grammar/script_words.h"
#include "apps/pipeline/registry/operator.h"
#include "levelset/error.h"
#include "tests/support/command_line.h"
#include "tests/support/measured.h"

namespace readme_test {

/// Text between ``` and ```, and the words after the first ```.
struct Block {
  std::string kind, text;
};

std::vector<Block> blocksOf(const std::filesystem::path& page) {
  std::istringstream text(support::slurp(page));
  std::vector<Block> blocks;
  bool inside = false;
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("```")) {
      inside = !inside;
      if (inside) blocks.push_back({line.substr(3), {}});
    } else if (inside) {
      blocks.back().text += line + "\n";
    }
  }
  return blocks;
}

class Readme : public support::ShellTest {
 protected:
  /// Runs the blocks of `sh chain`.
  /// @return number of blocks
  std::size_t runChains(const std::filesystem::path& page) {
    std::size_t count = 0;
    for (const Block& block : blocksOf(page)) {
      if (block.kind != "sh chain") continue;
      const auto outcome =
          shell("set -e\nlevelsmith() { '" + command() + "' --quiet \"$@\"; }\n" + block.text, 110);
      EXPECT_EQ(outcome.code, 0) << page << "\n" << block.text << outcome.err;
      ++count;
    }
    return count;
  }
};

class Docs : public Readme {
 protected:
  static std::filesystem::path folder() {
    return std::filesystem::path(LEVELSMITH_README).parent_path() / "docs";
  }

  static std::vector<std::filesystem::path> files(const std::string& extension) {
    std::vector<std::filesystem::path> found;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder()))
      if (entry.path().extension() == extension) found.push_back(entry.path());
    std::sort(found.begin(), found.end());
    return found;
  }
};

TEST_F(Readme, ExamplesRun) {
  ASSERT_EQ(runChains(LEVELSMITH_README), 3u);
  for (const char* file : {"plate.ply", "ring.ply", "ring.vdb", "out.vdb", "out.ply", "out.png"})
    EXPECT_TRUE(exists(file)) << file;
  // The rings on the base, as in the README.
  const auto outcome = levelsmith("read out.ply ! measure --json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto m = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(m["closed_manifold"], true);
  EXPECT_EQ(m["shells"], 1);
  EXPECT_EQ(m["components"], 1);
  EXPECT_GT(m["volume"], 40 * 40 * 10);
  EXPECT_NEAR(m["bounds"]["max"][2], 5 + 8 - 0.5,
              support::measured(1.14e-12));  // embedded by a voxel of the base
}

TEST_F(Docs, ExamplesRun) {
  ASSERT_EQ(levelsmith("--quiet box --size 4,4,2 --voxel 0.2 ! write part.vdb "
                       "! cylinder --radius 1 --height 3 --voxel 0.2 ! write tool.vdb "
                       "! render a.exr --size 64x48 ! render b.exr --size 64x48 --renderer cpu")
                .code,
            0);
  std::size_t count = 0;
  for (const auto& page : files(".md")) count += runChains(page);
  EXPECT_GE(count, 7u);
}

// Includes examples that need a model or a display.
TEST_F(Docs, ExamplesAreChains) {
  std::size_t count = 0;
  for (const auto& page : files(".md")) {
    for (const Block& block : blocksOf(page)) {
      for (const auto& line : pipeline::splitScript(block.text, page.string())) {
        std::vector<std::string> words;
        for (const pipeline::ScriptWord& word : line.words)
          for (std::string& text = words.emplace_back(); const pipeline::WordPart& part : word)
            text += part.text;
        // <(…) is syntax of the shell.
        const bool isChain = words[0] == "levelsmith" &&
                             block.text.find("<(") == std::string::npos && words.size() > 1 &&
                             words[1] != "help" &&
                             std::find(words.begin(), words.end(), "run") == words.end();
        if (!isChain) continue;
        words.erase(words.begin());
        try {
          (void)pipeline::parseChain(words);
        } catch (const levelset::Error& error) {
          ADD_FAILURE() << page << ": " << error.what();
        }
        ++count;
      }
    }
  }
  EXPECT_GE(count, 10u);
}

TEST_F(Docs, PipelinesRun) {
  EXPECT_EQ(files(".pipeline").size(), 2u);
  for (const auto& file : files(".pipeline"))
    std::filesystem::copy_file(file, folder_ / file.filename());
  const auto holes = levelsmith("--quiet " + pipeline::runOperator().example.substr(11));
  EXPECT_EQ(holes.code, 0) << holes.err;
  for (const char* file : {"holes.vdb", "holes.ply", "holes.png"})
    EXPECT_TRUE(exists(file)) << file;
  const auto measured = levelsmith("read holes.vdb ! measure --json");
  ASSERT_EQ(measured.code, 0) << measured.err;
  const auto m = nlohmann::json::parse(measured.out);
  EXPECT_EQ(m["euler"], 2 - 2 * 10);  // ten holes

  std::filesystem::copy_file(folder_ / "holes.ply", folder_ / "other.ply");
  const auto convert = levelsmith("--quiet run convert.pipeline --set resolution=64");
  EXPECT_EQ(convert.code, 0) << convert.err;
  EXPECT_TRUE(exists("other.vdb"));
}

}  // namespace readme_test
