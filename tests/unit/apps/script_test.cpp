// Chains in text files: `levelsmith run FILE`.

#include "apps/pipeline/script.h"

#include <gtest/gtest.h>

#include "tests/support/shell.h"

namespace script_test {

class Script : public support::ShellTest {
 protected:
  std::vector<std::string> words(const std::string& text) {
    writeFile("chain.txt", text);
    return pipeline::readScript(folder_ / "chain.txt").words;
  }
};

using Words = std::vector<std::string>;

TEST_F(Script, OneActionALine) {
  EXPECT_EQ(words("sphere --radius 1\n\n  measure  # volume\n# nothing\nwrite a.vdb"),
            (Words{"sphere", "--radius", "1", "!", "measure", "!", "write", "a.vdb"}));
  EXPECT_EQ(words("sphere --radius \\\n 1\r\nmeasure\r\n"),
            (Words{"sphere", "--radius", "1", "!", "measure"}));
  EXPECT_EQ(words("--threads 2\n-v\nsphere"), (Words{"--threads", "2", "-v", "sphere"}));
  EXPECT_EQ(words("sphere ! offset 1\n! measure"),
            (Words{"sphere", "!", "offset", "1", "!", "measure"}));
}

TEST_F(Script, QuotesAsAShellDoes) {
  EXPECT_EQ(words("clip --plane \"0,0,0 0,0,1\" 'a b' c\\ d \"x\\\"y\" e#f ''"),
            (Words{"clip", "--plane", "0,0,0 0,0,1", "a b", "c d", "x\"y", "e#f", ""}));
}

TEST_F(Script, RunsAsTheCommandLineDoes) {
  writeFile("make.txt",
            "--quiet\nsphere --radius 1 --voxel 0.1 --as ball\nbox --size 1,1,3 --voxel 0.1\n"
            "difference @ball  # the stack's comes first\nwrite 'of script.vdb'\n");
  ASSERT_EQ(levelsmith("run make.txt").code, 0);
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 --as ball ! box --size 1,1,3 --voxel 0.1 ! "
                       "difference @ball ! write line.vdb")
                .code,
            0);
  EXPECT_EQ(support::slurp(folder_ / "of script.vdb"), support::slurp(folder_ / "line.vdb"));
  EXPECT_EQ(shell(command() + " --threads 1 run - < make.txt").code, 0);
}

TEST_F(Script, TellsTheLineOfAMistake) {
  writeFile("bad.txt", "# a ball\nsphere --radius 1 --voxel 0.1\n\noffset much\nmeasure\n");
  EXPECT_REFUSED(levelsmith("run bad.txt"), 2, "(bad.txt, line 4)");
  writeFile("open.txt", "sphere --radius 1 --voxel 0.1\nwrite 'a.vdb\n");
  EXPECT_REFUSED(levelsmith("run open.txt"), 2, "line 2: the quote");
  writeFile("empty.txt", "# nothing here\n");
  EXPECT_REFUSED(levelsmith("run empty.txt"), 2, "no action");
  writeFile("nested.txt", "run bad.txt\n");
  EXPECT_REFUSED(levelsmith("run nested.txt"), 2, "cannot run another");
  EXPECT_REFUSED(levelsmith("run bad.txt ! measure"), 2, "takes one file");
  EXPECT_REFUSED(levelsmith("run"), 2, "takes one file");
  EXPECT_REFUSED(levelsmith("run missing.txt"), 6, "missing.txt");
  EXPECT_REFUSED(levelsmith("run ."), 6, "directory");
  writeFile("stdin.txt", "read - --format ply\nmeasure\n");
  EXPECT_REFUSED(shell(command() + " run - < stdin.txt"), 2, "standard input is used already");
}

}  // namespace script_test
