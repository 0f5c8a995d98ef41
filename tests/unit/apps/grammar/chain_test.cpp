#include "apps/pipeline/grammar/chain.h"

#include <gtest/gtest.h>

#include "levelset/error.h"

namespace chain_test {

using levelset::UsageError;
using pipeline::Graph;
using pipeline::parseChain;

/// Splits at blanks. Words in 'quotes' stay together.
Graph parse(const std::string& line) {
  std::vector<std::string> words;
  std::string word;
  bool quoted = false;
  for (char c : line + " ") {
    if (c == '\'')
      quoted = !quoted;
    else if (c != ' ' || quoted)
      word += c;
    else if (!word.empty())
      words.push_back(std::exchange(word, ""));
  }
  return parseChain(words);
}

std::string refusal(const std::string& line) {
  try {
    (void)parse(line);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "accepted";
}

#define EXPECT_REFUSAL(line_, part_) \
  EXPECT_NE(refusal(line_).find(part_), std::string::npos) << refusal(line_)

TEST(Chain, SplitsActionsOptionsAndGlobals) {
  const Graph graph =
      parse("--threads 2 -v sphere --radius 1 --voxel=0.1 --as ball ! offset -2vx ! write out.vdb");
  EXPECT_EQ(graph.globals.at("threads"), "2");
  EXPECT_TRUE(graph.globals.contains("verbose"));
  ASSERT_EQ(graph.nodes.size(), 3u);
  EXPECT_EQ(graph.nodes[0].options.at("voxel"), "0.1");
  EXPECT_EQ(graph.nodes[0].name, "ball");
  EXPECT_EQ(graph.nodes[1].options.at("distance"), "-2vx");
  EXPECT_EQ(graph.nodes[2].options.at("file"), "out.vdb");
}

TEST(Chain, AcceptsUniquePrefixesOfOptions) {
  EXPECT_EQ(parse("sphere --rad 1 --vox 0.1").nodes[0].options.at("radius"), "1");
  EXPECT_REFUSAL("sphere --r 1 --voxel 0.1", "may mean");
}

TEST(Chain, TakesOperandsByName) {
  const Graph graph = parse(
      "sphere --radius 1 --voxel 0.1 --as a ! sphere --radius 2 --voxel 0.1 --as b ! union @a @b ! "
      "difference @a");
  EXPECT_EQ(graph.nodes[2].inputs, (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(graph.nodes[3].inputs, (std::vector<std::size_t>{2, 0}));
}

TEST(Chain, RefusesUnknownWords) {
  EXPECT_REFUSAL("spere --radius 1", "did you mean 'sphere'");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 0.1 ! run chain.txt", "run: must be the only action");
  EXPECT_REFUSAL("sphere --raduis 1 --voxel 0.1", "did you mean --radius");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 0.1 --threads 2", "before the first action");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 0.1 ! offset 1 2", "unexpected argument '2'");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 0.1 ! union @nobody @else",
                 "no result is named '@nobody'");
}

TEST(Chain, RefusesMalformedChains) {
  EXPECT_REFUSAL("", "nothing to do");
  EXPECT_REFUSAL("! sphere --radius 1", "no action");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 0.1 !", "an action must follow");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 0.1 ! ! measure", "no action");
  EXPECT_REFUSAL("sphere --radius --voxel 0.1", "needs a value");
  EXPECT_REFUSAL("sphere --radius 1 --radius 2 --voxel 0.1", "given twice");
  EXPECT_REFUSAL("sphere --voxel 0.1", "needs --radius");
}

TEST(Chain, RefusesInvalidNumbersBeforeTheRun) {
  for (const char* bad : {"nan", "inf", "-1", "0", "abc", "1e999", "1,5", "", "0x10"})
    EXPECT_NE(refusal(std::string("sphere --voxel 0.1 --radius=") + bad), "accepted") << bad;
  EXPECT_REFUSAL("sphere --radius 1 --voxel 2vx", "cannot be given in voxels");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 1 ! offset 2cm", "unknown unit");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 1 ! render a.png --size 0x0", "is empty");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 1 --center 1,2", "not a point");
}

TEST(Chain, ChecksTheMethodOfAMesh) {
  const std::string ball = "sphere --radius 1 --voxel 0.1 ! ";
  EXPECT_REFUSAL(ball + "mesh --method cubes", "is not one of marching-cubes, dual, extended");
  EXPECT_REFUSAL(ball + "mesh --sharp --method extended", "--sharp is --method dual");
  EXPECT_REFUSAL(ball + "mesh --sharp --method marching-cubes", "--sharp is --method dual");
  EXPECT_REFUSAL(ball + "mesh --adaptivity 0.1 --method extended", "--adaptivity is for");
  EXPECT_REFUSAL(ball + "mesh --edge-length 1", "are for --method advancing-front");
  EXPECT_REFUSAL(ball + "mesh --method dual --angle 10", "are for --method advancing-front");
  EXPECT_REFUSAL(ball + "mesh --method advancing-front --angle 60", "at most 57 degrees");
  EXPECT_REFUSAL(ball + "mesh --method advancing-front --sharp", "--sharp is --method dual");
  EXPECT_REFUSAL("read a.ply --as a ! level-set --voxel 1 ! mesh --original @a",
                 "--original is for --method extended");
  EXPECT_REFUSAL(ball + "mesh --method extended --original a.ply", "is not the name of a mesh");
  EXPECT_REFUSAL(ball + "mesh --method extended --original @", "a name must follow '@'");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 0.1 --as b ! mesh --method extended --original @b",
                 "'@b' is a level set, but a mesh is needed");
  EXPECT_REFUSAL(ball + "patch --at 0,0,1 --size 1,1 --height 1 ! mesh --method dual",
                 "--method applies to a level set");
}

TEST(Chain, ChecksOperandsAndTheirKinds) {
  EXPECT_REFUSAL("offset 1", "needs 1 operand");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 0.1 ! union", "needs 2 operands but has 1");
  EXPECT_REFUSAL("read a.ply ! offset 1", "put 'level-set' before it");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 0.1 ! level-set --voxel 1", "put 'mesh' before it");
  EXPECT_REFUSAL(
      "sphere --radius 1 --voxel 0.1 ! patch --at 0,0,1 --size 1,1 --height 1 ! write p.vdb",
      "a patch cannot be written as 'p.vdb'; write .patch, or put 'mesh' before it");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 0.1 ! write p.patch", "cannot be written as 'p.patch'");
  EXPECT_REFUSAL(
      "sphere --radius 1 --voxel 0.1 ! patch --at 0,0,1 --size 1,1 --height 1 ! offset 1",
      "is a patch, but a level set, an adaptive field or a segmentation is needed; 'texture' "
      "builds");
  const std::string onto =
      "sphere --radius 3 --voxel 0.2 --as b ! patch @b --at 0,0,3 --size 2,2 --height 1 --as p ! ";
  EXPECT_REFUSAL(onto + "read a.ply --as t ! texture @b @t @p", "with `level-set`, or move its");
  EXPECT_REFUSAL(onto + "box --size 1,1,1 --voxel 0.2 --as t ! texture @b @t @p --map mesh",
                 "needs a mesh as texture");
  EXPECT_REFUSAL(onto + "read a.ply --as t ! texture @b @t @p --map mesh --blend 1",
                 "has no effect with --map mesh");
  EXPECT_REFUSAL(onto + "read a.ply --as t ! texture @b @t @p --map shell --carve",
                 "--carve has no effect with --map shell and a mesh");
  EXPECT_REFUSAL(onto + "read a.ply --as t ! texture @b @t @p --map shell ! write a.vdb", "mesh");
  EXPECT_EQ(refusal(onto + "read a.ply --as t ! texture @b @t @p --map shell ! write b.ply"),
            "accepted");
  EXPECT_REFUSAL(onto + "box --size 1,1,1 --voxel 0.2 --as t ! texture @b @t @p --map-tolerance -1",
                 "map-tolerance");
  EXPECT_REFUSAL(onto + "box --size 1,1,1 --voxel 0.2 --as t ! texture @b @t @p --kernel cubic",
                 "thin-plate");
  EXPECT_REFUSAL(onto + "box --size 1,1,1 --voxel 0.2 --as t ! texture @b @t @p --support 3",
                 "--support has no effect with --kernel biharmonic");
  EXPECT_REFUSAL(
      onto + "box --size 1,1,1 --voxel 0.2 --as t ! texture @b @t @p --kernel wendland --support 0",
      "support");
  EXPECT_REFUSAL(onto + "folds @b @p --map shell --support 3", "has no effect with --map shell");
  EXPECT_REFUSAL(
      onto + "box --size 1,1,1 --voxel 0.2 --as t ! texture @b @t @p --map shell --kernel sum",
      "--kernel has no effect with --map shell");
  EXPECT_REFUSAL(onto + "box --size 1,1,1 --voxel 0.2 --as t ! texture @b @t @p --sides free",
                 "needs --untangle or --relax");
  EXPECT_REFUSAL(onto + "folds @b @p --relax texture", "needs a texture");
  EXPECT_REFUSAL(onto + "folds @b @p --map mesh --lambda-near 1", "has no effect with --map mesh");
  EXPECT_REFUSAL("sphere --radius 1 --voxel 0.1 --as a ! sphere --radius 1 --voxel 0.1 --as a",
                 "is taken");
}

TEST(Chain, GivesStandardStreamsToOneActionOnly) {
  EXPECT_REFUSAL("sphere --radius 1 --voxel 1 ! write - --format vdb ! measure --json",
                 "standard output is already used");
  EXPECT_REFUSAL("--report - sphere --radius 1 --voxel 1 ! measure --json", "--report");
  EXPECT_REFUSAL("read - --format ply ! read - --format ply", "standard input is already used");
  EXPECT_REFUSAL("info -", "info: '-' has no extension that gives the format; give --format");
  EXPECT_REFUSAL("info a.txt", "no known format");
  EXPECT_EQ(refusal("sphere --radius 1 --voxel 1 ! measure ! check"), "accepted");
}

}  // namespace chain_test
