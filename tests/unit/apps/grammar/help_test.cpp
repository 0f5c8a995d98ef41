#include "apps/pipeline/help/help.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "apps/pipeline/values/units.h"
#include "tests/support/command_line.h"

namespace help_test {

using support::ShellTest;

class Help : public ShellTest {};

TEST_F(Help, ListsEveryAction) {
  const auto outcome = levelsmith("help");
  EXPECT_EQ(outcome.code, 0);
  for (const auto& op : pipeline::operators())
    EXPECT_NE(outcome.out.find("  " + op.name), std::string::npos) << op.name;
}

TEST_F(Help, EveryDeclarationIsComplete) {
  std::set<std::string> names;
  for (const auto& op : pipeline::operators()) {
    EXPECT_TRUE(names.insert(op.name).second) << op.name << " is declared twice";
    EXPECT_FALSE(op.summary.empty()) << op.name;
    EXPECT_FALSE(op.group.empty()) << op.name;
    EXPECT_FALSE(op.example.empty()) << op.name;
    EXPECT_TRUE(op.run) << op.name;
    std::set<std::string> params;
    for (const auto& param : op.params) {
      EXPECT_TRUE(params.insert(param.name).second) << op.name << " --" << param.name;
      EXPECT_FALSE(param.doc.empty()) << op.name << " --" << param.name;
      if (!param.fallback.empty()) {
        EXPECT_NO_THROW(pipeline::checkText(param, param.fallback, op.name));
      }
    }
  }
}

TEST_F(Help, ShowsOneActionAsTextAndJson) {
  const auto text = levelsmith("help offset");
  EXPECT_EQ(text.code, 0);
  EXPECT_NE(text.out.find("negative shrinks"), std::string::npos);
  const auto json = nlohmann::json::parse(levelsmith("help offset --json").out);
  EXPECT_EQ(json["name"], "offset");
  EXPECT_EQ(json["parameters"][0]["type"], "length");
}

TEST_F(Help, KnowsRun) {
  EXPECT_NE(levelsmith("help").out.find("  run "), std::string::npos);
  const auto page = levelsmith("help run");
  EXPECT_EQ(page.code, 0) << page.err;
  EXPECT_NE(page.out.find("one action a line"), std::string::npos) << page.out;
  EXPECT_EQ(nlohmann::json::parse(levelsmith("help run --json").out)["name"], "run");
  EXPECT_NE(levelsmith("help --search comment").out.find("run"), std::string::npos);
}

TEST_F(Help, FindsWordsAndSuggestsCorrections) {
  EXPECT_NE(levelsmith("help --search winding").out.find("level-set"), std::string::npos);
  EXPECT_REFUSED(levelsmith("help ofset"), 2, "did you mean 'offset'");
}

TEST_F(Help, MatchesTheReference) {
  const std::string page = levelsmith("help --markdown").out;
  EXPECT_TRUE(page == support::slurp(LEVELSMITH_REFERENCE))
      << "docs/reference.md differs from the registry; regenerate it with\n  '" << command()
      << "' help --markdown > '" << LEVELSMITH_REFERENCE << "'";
  for (const auto& op : pipeline::operators())
    EXPECT_NE(page.find("\n### " + op.name + "\n"), std::string::npos) << op.name;
  EXPECT_NE(page.find("| `--voxel` | length | world, % |"), std::string::npos);
  EXPECT_REFUSED(levelsmith("help offset --markdown"), 2, "alone");
}

/// True if the test golden_chains runs the example of an action up to its last action, and that is
/// another one, which prints or writes.
bool isGolden(const std::string& action, const std::string& example) {
  static const std::string chains = support::slurp(
      std::filesystem::path(LEVELSMITH_README).parent_path() / "tests/golden/chains.tsv");
  EXPECT_FALSE(chains.empty());
  const std::size_t last = example.rfind(" ! ");
  if (last == std::string::npos || example.substr(last + 3, action.size() + 1) == action + " ")
    return false;
  const std::string run = example.substr(0, last);
  for (std::size_t at = 0; (at = chains.find(run, at)) != std::string::npos; at += run.size()) {
    const std::string after = chains.substr(at + run.size(), 3);
    if (after.starts_with(" ! ") || after.starts_with("\t") || after.starts_with("\n")) return true;
  }
  return false;
}

/// True if the README contains the example, possibly on several lines.
bool isInReadme(const std::string& example) {
  const auto words = [](const std::string& text) {
    std::istringstream in(text);
    std::string all;
    for (std::string word; in >> word;)
      if (word != "\\") all += word + " ";
    return all;
  };
  return words(support::slurp(LEVELSMITH_README)).find(words(example)) != std::string::npos;
}

// The dragon's file is not in the tree; the main job runs its example.
bool needsModel(const std::string& example) {
  return example.find("dragon") != std::string::npos;
}

// The README test runs the examples that the README shows.
TEST_F(Help, ExamplesRun) {
  writeFile("protein.pdb", "ATOM      1  CA  GLY A   1       0.000   0.000   0.000\n");
  std::size_t count = 0;
  for (const auto& op : pipeline::operators()) {
    ASSERT_TRUE(op.example.starts_with("levelsmith ")) << op.name;
    if (needsModel(op.example) || isInReadme(op.example) || isGolden(op.name, op.example)) continue;
    const auto outcome = levelsmith("--quiet " + op.example.substr(11), 100);
    EXPECT_EQ(outcome.code, 0) << op.example << "\n" << outcome.err;
    ++count;
  }
  EXPECT_GT(count, 20u);
}

class SlowHelp : public Help {};

TEST_F(SlowHelp, AllExamplesRun) {
  for (const auto& op : pipeline::operators()) {
    if (needsModel(op.example)) continue;
    const auto outcome = levelsmith("--quiet " + op.example.substr(11), 100);
    EXPECT_EQ(outcome.code, 0) << op.example << "\n" << outcome.err;
  }
}

}  // namespace help_test
