#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/pipeline/grammar/chain.h"
#include "apps/pipeline/graph/graph_file.h"
#include "apps/pipeline/help/help.h"
#include "apps/pipeline/registry/operator.h"
#include "tests/support/command_line.h"
#include "tests/support/files.h"
#include "tests/support/tolerance_runs.h"

namespace former_words_test {

using support::ShellTest;

class FormerWords : public ShellTest {};

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t found = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1))
    ++found;
  return found;
}

const std::string kBall = "sphere --radius 1 --voxel 0.2 ! ";

TEST_F(FormerWords, AliasesOfActionsNameTheNewWordOnce) {
  const std::pair<const char*, const char*> renamed[] = {
      {"march", "fast-marching"}, {"sweep", "fast-sweeping"}, {"widen", "rebuild-band"}};
  for (const auto& [former, name] : renamed) {
    const std::string arguments = std::string(former) == "widen" ? " --half-width 4" : " --to 4vx";
    const auto outcome = levelsmith(kBall + former + arguments + " ! " + former + arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const std::string sentence = "levelsmith: '" + std::string(former) + "' is now '" + name +
                                 "'; the old word keeps working\n";
    EXPECT_EQ(count(outcome.err, sentence), 1u) << outcome.err;
    EXPECT_EQ(levelsmith("--quiet " + kBall + former + arguments).err.find("is now"),
              std::string::npos);
  }
}

TEST_F(FormerWords, AliasesOfOptionsMeanTheSame) {
  const pipeline::Graph graph = pipeline::parseChain(support::wordsOf(
      "--whole read a.ply --bare ! level-set --voxel 1 --sign-anyway --trust-mesh --as a ! patch "
      "@a "
      "--at 0,0,1 --size 1,1 --height 1 --levels 3 --as p ! texture @a @a @p --sink 1 --unfold"));
  EXPECT_TRUE(graph.globals.contains("no-roi"));
  EXPECT_TRUE(graph.nodes[0].options.contains("no-attributes"));
  EXPECT_TRUE(graph.nodes[1].options.contains("accept-sign"));
  EXPECT_TRUE(graph.nodes[1].options.contains("skip-intersection-test"));
  EXPECT_EQ(graph.nodes[2].options.at("layers"), "3");
  EXPECT_EQ(graph.nodes[3].options.at("embed"), "1");
  EXPECT_TRUE(graph.nodes[3].options.contains("untangle"));
  ASSERT_EQ(graph.renamed.size(), 7u);
  EXPECT_EQ(graph.renamed[0], "'--whole' is now '--no-roi'; the old word keeps working");
}

TEST_F(FormerWords, WorkInScriptsAndSavedGraphs) {
  support::writeText(folder_ / "old.txt", "sphere --radius 1 --voxel 0.2\nwiden --half-width 4\n");
  const auto script = levelsmith("run old.txt");
  EXPECT_EQ(script.code, 0) << script.err;
  EXPECT_EQ(count(script.err, "'widen' is now 'rebuild-band'"), 1u) << script.err;

  const pipeline::Graph graph = pipeline::graphFromJson(
      R"({"format": "levelsmith graph", "version": 1, "nodes": [
          {"op": "sphere", "options": {"radius": 1, "voxel": 0.2}},
          {"op": "patch", "inputs": [0],
           "options": {"at": "0,0,1", "size": "1,1", "height": 1, "levels": 3}},
          {"op": "march", "inputs": [0]}]})",
      "old.json");
  EXPECT_EQ(graph.nodes[1].options.at("layers"), "3");
  EXPECT_EQ(graph.nodes[2].op->name, "fast-marching");
  EXPECT_EQ(graph.renamed.size(), 2u);
  const std::string json = pipeline::graphJson(graph);
  EXPECT_NE(json.find("fast-marching"), std::string::npos);
  EXPECT_EQ(json.find("levels\""), std::string::npos);
}

TEST_F(FormerWords, StayOutOfHelp) {
  for (const auto& op : pipeline::operators()) {
    EXPECT_TRUE(op.formerName.empty() || op.formerName != op.name);
    const std::string page = pipeline::help({op.name});
    for (const auto& param : op.params) {
      if (param.formerName.empty()) continue;
      EXPECT_EQ(page.find("--" + param.formerName + " "), std::string::npos) << op.name;
    }
    if (op.formerName.empty()) continue;
    EXPECT_EQ(pipeline::help({op.formerName}), page);
  }
  for (const char* shell : {"bash", "zsh"}) {
    const std::string script = pipeline::help({"--completion", shell});
    for (const char* word :
         {"widen", "'march:", " march ", "--sink", "--unfold", "--sign-anyway", "--whole"})
      EXPECT_EQ(script.find(word), std::string::npos) << word;
  }
}

TEST_F(FormerWords, AreNoOptionsTwice) {
  const auto outcome = levelsmith("read a.ply --bare --no-attributes");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("--no-attributes is given twice"), std::string::npos) << outcome.err;
}

class HelpInChains : public ShellTest {};

TEST_F(HelpInChains, PrintsTheActionAndRunsNothing) {
  const std::string page = pipeline::help({"offset"});
  for (const char* chain :
       {"offset --help", "offset -h", "--threads 2 offset 1 --help",
        "sphere --radius 1 --voxel 0.2 ! write a.vdb ! offset --help ! write b.vdb",
        "sphere --radius 1 --voxel 0.2 ! write a.vdb ! offset --no-such-option -h"}) {
    const auto outcome = levelsmith(chain);
    EXPECT_EQ(outcome.code, 0) << chain << outcome.err;
    EXPECT_EQ(outcome.out, page) << chain;
    EXPECT_EQ(outcome.err, "") << chain;
  }
  EXPECT_FALSE(exists("a.vdb"));
  EXPECT_EQ(levelsmith("march --help").out, pipeline::help({"fast-marching"}));
  EXPECT_EQ(levelsmith("run some.txt --help").out, pipeline::help({"run"}));
  EXPECT_EQ(levelsmith("--threads 2 --help").out, pipeline::helpOverview());
  const auto unknown = levelsmith("ofset --help");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_NE(unknown.err.find("did you mean 'offset'?"), std::string::npos) << unknown.err;
}

}  // namespace former_words_test
