// Chains in text files: `levelsmith run FILE`.

#include "apps/pipeline/grammar/script.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "apps/pipeline/registry/operator.h"
#include "levelset/error.h"
#include "tests/support/command_line.h"

namespace script_test {

class Script : public support::ShellTest {
 protected:
  using Settings = std::map<std::string, std::string>;

  std::vector<std::string> words(const std::string& text, const Settings& settings = {}) {
    writeFile("chain.txt", text);
    return pipeline::readScript(folder_ / "chain.txt", settings).words;
  }

  /// The words except `!`, separated by blanks.
  std::string line(const std::string& text, const Settings& settings = {}) {
    std::string all;
    for (const std::string& word : words(text, settings))
      if (word != "!") all += (all.empty() ? "" : " ") + word;
    return all;
  }

  std::string refusal(const std::string& text, const Settings& settings = {}) {
    try {
      (void)words(text, settings);
    } catch (const levelset::Error& error) {
      return error.what();
    }
    return "accepted";
  }
};

using Words = std::vector<std::string>;

TEST_F(Script, HasOneActionPerLine) {
  EXPECT_EQ(words("sphere --radius 1\n\n  measure  # volume\n# nothing\nwrite a.vdb"),
            (Words{"sphere", "--radius", "1", "!", "measure", "!", "write", "a.vdb"}));
  EXPECT_EQ(words("sphere --radius \\\n 1\r\nmeasure\r\n"),
            (Words{"sphere", "--radius", "1", "!", "measure"}));
  EXPECT_EQ(words("--threads 2\n-v\nsphere"), (Words{"--threads", "2", "-v", "sphere"}));
  EXPECT_EQ(words("sphere ! offset 1\n! measure"),
            (Words{"sphere", "!", "offset", "1", "!", "measure"}));
}

TEST_F(Script, QuotesLikeAShell) {
  EXPECT_EQ(words("clip --plane \"0,0,0 0,0,1\" 'a b' c\\ d \"x\\\"y\" e#f ''"),
            (Words{"clip", "--plane", "0,0,0 0,0,1", "a b", "c d", "x\"y", "e#f", ""}));
}

TEST_F(Script, RunsLikeTheCommandLine) {
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

TEST_F(Script, ReportsTheLineOfAnError) {
  writeFile("bad.txt", "# a ball\nsphere --radius 1 --voxel 0.1\n\noffset much\nmeasure\n");
  EXPECT_REFUSED(levelsmith("run bad.txt"), 2, "(bad.txt, line 4)");
  writeFile("open.txt", "sphere --radius 1 --voxel 0.1\nwrite 'a.vdb\n");
  EXPECT_REFUSED(levelsmith("run open.txt"), 2, "line 2: the quote");
  writeFile("empty.txt", "# nothing here\n");
  EXPECT_REFUSED(levelsmith("run empty.txt"), 2, "no action");
  writeFile("nested.txt", "run bad.txt\n");
  EXPECT_REFUSED(levelsmith("run nested.txt"), 2, "cannot run another");
  EXPECT_REFUSED(levelsmith("run bad.txt ! measure"), 2, "may follow the file");
  EXPECT_REFUSED(levelsmith("run"), 2, "takes one file");
  EXPECT_REFUSED(levelsmith("run missing.txt"), 6, "missing.txt");
  EXPECT_REFUSED(levelsmith("run ."), 6, "directory");
  writeFile("stdin.txt", "read - --format ply\nmeasure\n");
  EXPECT_REFUSED(shell(command() + " run - < stdin.txt"), 2, "standard input is already used");
}

#define EXPECT_TOLD(sentence_, part_) \
  EXPECT_NE((sentence_).find(part_), std::string::npos) << (sentence_)

TEST_F(Script, ReplacesVariables) {
  EXPECT_EQ(
      words("set v 0.5\nbox --voxel=${v} a${v}b \"${v} ${v}\" '${v}' $${v} \\${v} \"$${v}\" $v"),
      (Words{"box", "--voxel=0.5", "a0.5b", "0.5 0.5", "${v}", "${v}", "${v}", "${v}", "$v"}));
  EXPECT_EQ(
      line("set v 0.5\nset out ${v}.vdb\n--threads ${n}\nwrite ${out}", {{"v", "2"}, {"n", "3"}}),
      "--threads 3 write 2.vdb");
  EXPECT_EQ(words("set v 'a b'\nread ${v} ${w}", {{"w", ""}}), (Words{"read", "a b", ""}));
  EXPECT_EQ(line("set v 1\na ${v}\nset v 2\nb ${v}"), "a 1 b 2");
  EXPECT_EQ(
      line("set f x/y.ply.gz\nset g z.vdb\na ${f:name} ${f:stem} ${f:dir} ${g:stem} ${g:dir}"),
      "a y.ply.gz y x z .");
}

TEST_F(Script, RefusesVariablesWithoutAValue) {
  EXPECT_TOLD(refusal("set voxel 1\n\nbox ${voxle}"),
              "chain.txt, line 3: ${voxle} has no value; did "
              "you mean ${voxel}?");
  EXPECT_TOLD(refusal("box ${h}"), "give it with --set h=VALUE, or a line `set h VALUE`");
  EXPECT_TOLD(refusal("box ${h}\nset h 1"), "is further down");
  EXPECT_TOLD(refusal("box ${1}"), "write ${NAME}");
  EXPECT_TOLD(refusal("box ${a:base}", {{"a", "1"}}), "there is no part 'base'");
  EXPECT_TOLD(refusal("box 1\nbox ${a\n}"), "line 2: a ${ is not closed");
  EXPECT_TOLD(refusal("set voxel 1\nbox", {{"voxl", "2"}}), "has no variable voxl");
  EXPECT_TOLD(refusal("set voxel 1\nbox", {{"voxl", "2"}}), "did you mean 'voxel'?");
  EXPECT_TOLD(refusal("box", {{"voxl", "2"}}), "it has no variables");
  EXPECT_TOLD(refusal("for i in 1\nbox ${i}\nend", {{"i", "2"}}),
              "has no variable i");  // it belongs to the loop
  EXPECT_EQ(line("repeat 0\nbox ${v}\nend\nball", {{"v", "2"}}), "ball");
}

TEST_F(Script, ExpandsLoops) {
  EXPECT_EQ(line("repeat 3\nbox ${i}\nend"), "box 0 box 1 box 2");
  EXPECT_EQ(line("repeat 2 as n\nrepeat 2\nbox ${n}${i} --as p${n}${i}\nend\nend\nunion @p00"),
            "box 00 --as p00 box 01 --as p01 box 10 --as p10 box 11 --as p11 union @p00");
}

TEST_F(Script, CountsWithoutRounding) {
  const auto list = [&](const std::string& words, const Settings& settings = {}) {
    return line("box\nfor x in " + words + "\n${x}\nend", settings).substr(4);
  };
  EXPECT_EQ(list("0..3"), "0 1 2 3");
  EXPECT_EQ(list("0..1 step 0.25"), "0 0.25 0.5 0.75 1");
  EXPECT_EQ(list("0..0.5 step 0.1"), "0 0.1 0.2 0.3 0.4 0.5");
  EXPECT_EQ(list("-.5..1.0 step 0.50"), "-0.5 0 0.5 1");
  EXPECT_EQ(list("0..1 step 0.3"), "0 0.3 0.6 0.9");
  EXPECT_EQ(list("3..1 step -1"), "3 2 1");
  EXPECT_EQ(list("08..11"), "08 09 10 11");
  EXPECT_EQ(list("2..2 a '0..2' 1..${n} b", {{"n", "2"}}), "2 a 0..2 1 2 b");
  EXPECT_EQ(list("${all} \"${all}\"", {{"all", " p  q "}}), "p q  p  q ");
  EXPECT_TOLD(refusal("for x in 3..1\nbox\nend"), "as in 10..0 step -1");
  EXPECT_TOLD(refusal("for x in 1..3 step -1\nbox\nend"), "never reaches its end");
  EXPECT_TOLD(refusal("for x in 1..3 step 0\nbox\nend"), "never ends");
  EXPECT_TOLD(refusal("for x in 1..3 step\nbox\nend"), "not a range");
  EXPECT_TOLD(refusal("for x in 1..b\nbox\nend"), "not a range");
  EXPECT_TOLD(refusal("for x in 1e3..2e3\nbox ${x}\nend"), "accepted");  // a word
  EXPECT_TOLD(refusal("for x in 0..1 step 0.0000000000000000001\nbox\nend"), "at most 18 digits");
  EXPECT_TOLD(refusal("for x in 0..1000000 step 0.0000000000001\nbox\nend"), "more than 18 digits");
  EXPECT_TOLD(refusal("for x in 0..100000\nbox\nend"), "more than 100000 numbers");
}

TEST_F(Script, ExpandsFilePatterns) {
  for (const char* file : {"b.ply", "a.ply", "a b.ply", "c.obj", "x[1].ply"}) writeFile(file, "");
  const auto list = [&](const std::string& words) {
    const std::string in = folder_.string() + "/";
    return line("set d '" + in + "'\nbox\nfor f in " + words + "\n<${f:name}>\nend").substr(4);
  };
  EXPECT_EQ(list("${d}*.ply"), "<a b.ply> <a.ply> <b.ply> <x[1].ply>");
  EXPECT_EQ(list("${d}?.[op]*"), "<a.ply> <b.ply> <c.obj>");
  EXPECT_EQ(list("\"${d}\"x'[1]'*"), "<x[1].ply>");
  EXPECT_EQ(list("'*.ply' ../a.ply"), "<*.ply> <a.ply>");
  writeFile("none.txt", "sphere --radius 1 --voxel 0.2\nfor f in scans/*.ply\nread ${f}\nend\n");
  EXPECT_REFUSED(levelsmith("run none.txt"), 6,
                 "none.txt, line 2: for: no file matches 'scans/*.ply'");
}

TEST_F(Script, RefusesMalformedLoops) {
  EXPECT_TOLD(refusal("box\nrepeat 2\nball"), "line 2: repeat: its `end` is missing");
  EXPECT_TOLD(refusal("box\nend"), "line 2: end: there is no loop");
  EXPECT_TOLD(refusal("repeat 2\nbox\nend loop"), "must be alone");
  EXPECT_TOLD(refusal("repeat\nbox\nend"), "`repeat COUNT as NAME`");
  EXPECT_TOLD(refusal("repeat 2.5\nbox\nend"), "not a whole number");
  EXPECT_TOLD(refusal("repeat -1\nbox\nend"), "not a count");
  EXPECT_TOLD(refusal("for x of 1 2\nbox\nend"), "`for NAME in LIST`");
  EXPECT_TOLD(refusal("for 1 in 1 2\nbox\nend"), "'1' is not a name");
  EXPECT_TOLD(refusal("set a=1 2\nbox"), "'a=1' is not a name");
  EXPECT_TOLD(refusal("set a 1 2\nbox"), "quote a value with blanks");
  EXPECT_TOLD(refusal("repeat 2\nset i 3\nbox\nend"), "the variable of a loop");
}

// Any file yields words or an error.
TEST_F(Script, SurvivesArbitraryFiles) {
  const std::vector<std::string> parts = {
      "repeat", "for",  "end", "set",  "in",  "as", "step", "x",    "i",       "2",  "0..2", "..",
      "${",     "${x}", "$${", "${i:", "}",   "'",  "\"",   "\\",   "\n",      "\n", "\n",   " ",
      " ",      " ",    "!",   "#",    "-.5", "@",  "?[",   "\r\n", "--voxel", ":",  "-",    "9e9"};
  std::mt19937 random(1);
  std::size_t accepted = 0;
  for (int i = 0; i < 1000; ++i) {
    std::string text = i % 2 ? "box\n" : "for x in 1 2\n";
    for (auto n = random() % 24; n > 0; --n) text += parts[random() % parts.size()];
    if (i % 2 == 0) text += "\nbox ${x}\nend\n";
    const std::string sentence = refusal(text);
    accepted += sentence == "accepted";
    EXPECT_FALSE(sentence.empty()) << text;
  }
  EXPECT_GT(accepted, 20u);
}

TEST_F(Script, LimitsTheExpansionOfLoops) {
  EXPECT_TOLD(refusal("repeat 900\nrepeat 90\nbox\nball\nend\nend"), "more than 100000 actions");
  EXPECT_TOLD(refusal("box\nrepeat 1000\nrepeat 1000\nend\nend"), "more than 100000 iterations");
  EXPECT_TOLD(refusal("repeat 100001\nbox\nend"), "not a count from 0 to 100000");
  EXPECT_EQ(words("repeat 1000\nrepeat 90\nbox\nend\nend").size(), 2u * 90'000 - 1);
  EXPECT_TOLD(refusal("set a xxxxxxxx\nrepeat 40\nset a ${a}${a}\nend\nread ${a}"),
              "more than 64 MB of text");
  std::string deep;
  for (int i = 0; i < 65; ++i) deep = "repeat 1\n" + deep + "end\n";
  EXPECT_TOLD(refusal("box\n" + deep), "more than 64 deep");
}

TEST_F(Script, LimitsTheSearchOfPatterns) {
  for (const char* name : {"a", "b", "c", "d"}) std::filesystem::create_directory(folder_ / name);
  std::string pattern = folder_.string();
  for (int i = 0; i < 10; ++i) pattern += "/*/..";
  EXPECT_TOLD(refusal("for f in " + pattern + "/*\nread ${f}\nend"), "too many folders");
  EXPECT_EQ(words("for f in " + folder_.string() + "/*/../[ab]\nread ${f}\nend").size(),
            8 * 3 - 1u);
}

TEST_F(Script, ReportsTheIterationOfAnError) {
  writeFile(
      "loop.txt",
      "for r in 1 2\n  repeat 2\n    sphere --radius ${r} --voxel 0.5 --as p${i}\n  end\nend\n");
  EXPECT_REFUSED(levelsmith("run loop.txt"), 2, "'p0' is taken");
  EXPECT_REFUSED(levelsmith("run loop.txt"), 2, "(loop.txt, line 3, r = 2, i = 0)");
  // Errors that appear during the run only.
  writeFile("run.txt", "for f in a.ply b.ply\n  read ${f}\nend\n");
  writeFile("a.ply", "ply\n");
  EXPECT_REFUSED(levelsmith("run run.txt"), 3, "(run.txt, line 2, f = a.ply)");
  EXPECT_EQ(levelsmith("read a.ply").err.find("("), std::string::npos);
  // Errors that appear before the run.
  writeFile("to.txt", "sphere --radius 1 --voxel 0.5\nfor d in . no\nwrite ${d}/a.vdb\nend\n");
  EXPECT_REFUSED(levelsmith("run to.txt"), 6, "(to.txt, line 3, d = no)");
  EXPECT_FALSE(exists("a.vdb"));
  writeFile("over.txt", "sphere --radius 1 --voxel 0.5\nrepeat 2\nwrite a.vdb\nend\n");
  const auto over = levelsmith("run over.txt");
  EXPECT_NE(
      over.err.find("only the later content remains; use another file (over.txt, line 3, i = 1)"),
      std::string::npos)
      << over.err;
}

TEST_F(Script, ReportsTheIterationInReportsAndChecks) {
  writeFile("loop.txt",
            "for r in 1 2\n  sphere --radius ${r} --voxel 0.2 --as ball${r}\n"
            "  offset ${r}vx\n  compare @ball${r} --tolerance 0.3\nend\n");
  const auto outcome = levelsmith("--report r.json run loop.txt");
  EXPECT_EQ(outcome.code, 5);
  EXPECT_NE(outcome.err.find("(loop.txt, line 4, r = 2)"), std::string::npos) << outcome.err;
  const auto report = nlohmann::json::parse(support::slurp(folder_ / "r.json"));
  EXPECT_EQ(report["steps"][1]["place"], "loop.txt, line 3, r = 1");
}

TEST_F(Script, GivesNoVariablesToGraphs) {
  ASSERT_EQ(levelsmith("--dry-run --save-graph g.json sphere --radius 1 --voxel 0.2").code, 0);
  EXPECT_REFUSED(levelsmith("run g.json --set voxel=1"), 2, "a graph has no variables");
}

// Each iteration takes the result of the previous one.
TEST_F(Script, RunsLoopsAndSettings) {
  writeFile("grow.txt",
            "set radius 1\nsphere --radius ${radius} --voxel 0.1\nrepeat 3\n  offset 0.25\nend\n"
            "write ${out}.vdb\n");
  ASSERT_EQ(levelsmith("--quiet run grow.txt --set out=grown --set=radius=0.5").code, 0);
  ASSERT_EQ(levelsmith("sphere --radius 0.5 --voxel 0.1 ! offset 0.25 ! offset 0.25 ! offset 0.25 "
                       "! write line.vdb")
                .code,
            0);
  EXPECT_EQ(support::slurp(folder_ / "grown.vdb"), support::slurp(folder_ / "line.vdb"));
  EXPECT_REFUSED(levelsmith("run grow.txt --set out=a --set out=b"), 2, "'out' is given twice");
  EXPECT_REFUSED(levelsmith("run grow.txt --set out"), 2, "'out' is not of the form NAME=VALUE");
  EXPECT_REFUSED(levelsmith("run grow.txt --get out=1"), 2, "no option --get");
  EXPECT_REFUSED(levelsmith("run grow.txt --set out=a --threads 2"), 2, "before the first action");
}

TEST(ScriptWords, AreNoActions) {
  for (const char* word : {"set", "repeat", "for", "end"})
    EXPECT_EQ(pipeline::findOperator(word), nullptr) << word;
}

}  // namespace script_test
