// Completion in shells: `levelsmith help --completion bash
// zsh`.

#include "apps/pipeline/help/completion.h"

#include <gtest/gtest.h>

#include <sstream>

#include "apps/pipeline/registry/operator.h"
#include "levelset/error.h"
#include "tests/support/command_line.h"

namespace completion_test {

class Completion : public support::ShellTest {
 protected:
  void SetUp() override {
    ShellTest::SetUp();
    writeFile("complete.bash", pipeline::completionScript("bash"));
  }

  /// Completions that bash offers for the last word, sorted and separated by blanks. The words are
  /// split as in bash, at = and @ too.
  std::string offered(const std::string& words) {
    const auto outcome = shell("source ./complete.bash\nCOMP_WORDS=(levelsmith " + words +
                               ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n_levelsmith levelsmith\n"
                               "printf '%s\\n' \"${COMPREPLY[@]}\" | LC_ALL=C sort | tr '\\n' ' '");
    EXPECT_EQ(outcome.err, "") << words;
    return outcome.out.substr(0, outcome.out.find_last_not_of(' ') + 1);
  }

  bool offers(const std::string& words, const std::string& word) {
    return (" " + offered(words) + " ").find(" " + word + " ") != std::string::npos;
  }
};

TEST_F(Completion, OffersActions) {
  EXPECT_EQ(offered("sp"), "sphere");
  EXPECT_EQ(offered("sphere --radius 1 ! dif"), "difference");
  EXPECT_EQ(offered("hel"), "help");
  EXPECT_EQ(offered("sphere ! hel"), "");
  EXPECT_EQ(offered("sphere ! hei"), "heightmap");
  EXPECT_EQ(offered("help off"), "offset");
  EXPECT_EQ(offered("--threads 2 ru"), "run");
  std::istringstream all(offered("''"));
  std::size_t count = 0;
  for (std::string word; all >> word;) ++count;
  EXPECT_EQ(count, pipeline::operators().size() + 2);
}

TEST_F(Completion, OffersOptionsOfTheAction) {
  EXPECT_EQ(offered("sphere --ra"), "--radius");
  EXPECT_EQ(offered("sphere --radius 1 ! box --si"), "--size");
  EXPECT_EQ(offered("--th"), "--threads");
  EXPECT_EQ(offered("sphere --th"), "");  // global options only before the first action
  EXPECT_EQ(offered("sphere ! --th"), "");
  EXPECT_EQ(offered("sphere --a"), "--as");
  EXPECT_EQ(offered("measure --as"), "");  // it makes no value
  EXPECT_TRUE(offers("sphere --radius 1 ''", "!"));
  for (const auto& op : pipeline::operators())
    if (!op.params.empty() && op.params.back().position < 0) {
      EXPECT_TRUE(offers(op.name + " --", "--" + op.params.back().name)) << op.name;
    }
}

TEST_F(Completion, OffersChoices) {
  EXPECT_EQ(offered("--progress o"), "off");
  EXPECT_EQ(offered("level-set --sign ''"), "auto closed winding");
  EXPECT_EQ(offered("level-set --sign = w"), "winding");
  EXPECT_EQ(offered("level-set --sign ="), "auto closed winding");
  EXPECT_EQ(offered("level-set --sig w"), "winding");  // prefix of its name
  EXPECT_EQ(offered("sphere --radius ''"), "");
  EXPECT_EQ(offered("sphere --radius --"), "");  // the word is a value
  EXPECT_EQ(offered("measure --json --"), offered("measure --"));
  EXPECT_EQ(offered("help --completion ''"), "bash zsh");
}

TEST_F(Completion, OffersFilesAndNames) {
  writeFile("bunny.ply", "");
  writeFile("a bunny.ply", "");
  EXPECT_EQ(offered("read bu"), "bunny.ply");
  EXPECT_EQ(offered("--report bu"), "bunny.ply");
  EXPECT_EQ(offered("--report = bu"), "bunny.ply");
  EXPECT_EQ(offered("read 'a b'"), "a bunny.ply");
  EXPECT_EQ(offered("run bu"), "bunny.ply");
  EXPECT_EQ(offered("sphere --as ball ! box --as = bay ! union @"), "ball bay");
  EXPECT_EQ(offered("sphere --as ball ! box --as bay ! union @ ball @ bal"), "ball");
  EXPECT_EQ(offered("sphere --as ball ! smooth --mask @ b"), "ball");
  EXPECT_EQ(offered("sphere --as ball ! smooth --mask =@ b"), "ball");
  EXPECT_EQ(offered("sphere --as ball ! smooth --mask =@"), "ball");
}

TEST_F(Completion, OffersVariablesOfScripts) {
  writeFile("a.pipeline", "# set of things\nset voxel 0.5\n  set out 'a b'\nsphere\n");
  EXPECT_EQ(offered("run a.pipeline --set ''"), "out= voxel=");
  EXPECT_EQ(offered("run a.pipeline --set out=1 --set v"), "voxel=");
  EXPECT_EQ(offered("run a.pipeline --s"), "--set");
}

TEST_F(Completion, IsLoadedByBash) {
  const auto outcome = shell("set -eu\neval \"$('" + command() +
                             "' help --completion bash)\"\ncomplete -p levelsmith");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "complete -F _levelsmith levelsmith\n");
  EXPECT_REFUSED(levelsmith("help --completion fish"), 2, "'fish' is not one of bash, zsh");
  EXPECT_REFUSED(levelsmith("help --completion"), 2, "needs a shell");
}

TEST_F(Completion, OffersTheSameInZsh) {
  const std::string zsh = pipeline::completionScript("zsh"),
                    bash = pipeline::completionScript("bash");
  EXPECT_TRUE(zsh.starts_with("#compdef levelsmith\n"));
  const auto table = [](const std::string& script) {
    const std::size_t begin = script.find("_levelsmith_params() {");
    return script.substr(begin, script.find("\n}\n", begin) - begin);
  };
  EXPECT_EQ(table(zsh), table(bash));
  for (const auto& op : pipeline::operators())
    EXPECT_NE(zsh.find("\n  '" + op.name + ":"), std::string::npos) << op.name;
  if (shell("command -v zsh").code != 0) GTEST_SKIP() << "zsh is missing";
  writeFile("_levelsmith", zsh);
  const auto outcome = shell("zsh -n _levelsmith");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
}

// The tables are words of a shell and contain no special characters.
TEST(CompletionWords, NeedNoQuotes) {
  for (const auto& op : pipeline::operators())
    for (const auto& param : op.params)
      for (const std::string& choice : param.choices)
        EXPECT_EQ(choice.find_first_of(" ,'\"\\$`*?[:;|&<>()"), std::string::npos) << choice;
}

}  // namespace completion_test
