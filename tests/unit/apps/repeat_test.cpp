// Same bits with 1, 2 and 4 threads, each action ten times.

#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "tests/support/shell.h"

namespace repeat_test {

struct Case {
  const char* name;
  const char* chain;  ///< what is repeated; writes `out` + extension
  const char* output;
};

// Named in full by the tests' output, rather than as bytes.
void PrintTo(const Case& c, std::ostream* out) {
  *out << c.chain;
}

class Repeat : public support::ShellTest, public ::testing::WithParamInterface<Case> {};

TEST_P(Repeat, GivesTheSameBits) {
  const Case& c = GetParam();
  ASSERT_EQ(levelsmith("torus --radius 2 --tube 0.8 --axis 1,2,3 --voxel 0.2 ! write in.vdb ! mesh "
                       "! write in.ply "
                       "! sphere --radius 1.4 --center 1,0.5,0.2 --voxel 0.16 ! write tool.vdb "
                       "! torus --radius 2 --tube 0.8 --axis 1,2,3 --voxel 0.3 ! write coarse.vdb")
                .code,
            0);
  std::string first;
  for (int i = 0; i < 10; ++i) {
    const int threads = 1 << (i % 3);
    const auto outcome =
        levelsmith("--quiet --threads " + std::to_string(threads) + " " + c.chain, 100);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const std::string bytes = support::slurp(folder_ / c.output);
    ASSERT_FALSE(bytes.empty());
    if (i == 0) first = bytes;
    ASSERT_EQ(bytes, first) << "run " << i << " with " << threads << " threads";
  }
}

INSTANTIATE_TEST_SUITE_P(
    Actions, Repeat,
    ::testing::Values(
        Case{"shapes",
             "sphere --radius 1 --voxel 0.05 ! box --size 1,2,3 --voxel 0.05 ! union "
             "! torus --radius 1 --tube 0.4 --axis 1,1,0 --voxel 0.05 ! union "
             "! cylinder --radius 1 --height 2 --axis 1,1,1 --voxel 0.05 ! union "
             "! capsule --from 0,0,0 --to 1,1,1 --radius 0.4 --voxel 0.05 ! union ! write out.vdb",
             "out.vdb"},
        Case{"read", "read in.vdb ! write out.nvdb", "out.nvdb"},
        Case{"closed", "read in.ply ! level-set --voxel 0.14 --sign closed ! write out.vdb",
             "out.vdb"},
        Case{"winding", "read in.ply ! level-set --voxel 0.14 --sign winding ! write out.vdb",
             "out.vdb"},
        Case{"auto", "read in.ply ! level-set --voxel 0.2 ! write out.vdb", "out.vdb"},
        Case{"mesh", "read in.vdb ! mesh ! write out.ply", "out.ply"},
        Case{"adaptive", "read in.vdb ! mesh --adaptivity 0.5 ! write out.ply", "out.ply"},
        Case{"sharp",
             "box --size 2,2,2 --voxel 0.2 ! transform --rotate 10,20,30 --bake ! mesh --sharp "
             "! write out.ply",
             "out.ply"},
        Case{"union", "read in.vdb ! read tool.vdb ! union ! write out.vdb", "out.vdb"},
        Case{"intersection", "read in.vdb ! read tool.vdb ! intersection ! write out.vdb",
             "out.vdb"},
        Case{"difference", "read in.vdb ! read tool.vdb ! difference ! write out.vdb", "out.vdb"},
        Case{"blend",
             "read coarse.vdb ! sphere --radius 1.4 --center 1,0.5,0.2 --voxel 0.3 "
             "! blend --radius 0.8 ! write out.vdb",
             "out.vdb"},
        Case{"fillet",
             "read coarse.vdb ! sphere --radius 1.4 --center 1,0.5,0.2 --voxel 0.3 "
             "! blend --radius 0.9 --method fillet ! write out.vdb",
             "out.vdb"},
        Case{"offset", "read in.vdb ! offset 3vx ! write out.vdb", "out.vdb"},
        Case{"offset_by", "read coarse.vdb ! offset --by \"0.3+0.2*x\" ! write out.vdb", "out.vdb"},
        // At voxels of 0.07 and 0.3 three of them are no float.
        Case{"open", "sphere --radius 0.5 --voxel 0.07 ! open 0.2 ! write out.vdb", "out.vdb"},
        Case{"close", "read coarse.vdb ! close 2vx ! write out.vdb", "out.vdb"},
        Case{"shell", "read coarse.vdb ! shell --thickness 0.4 ! write out.vdb", "out.vdb"},
        Case{"reinitialize", "read coarse.vdb ! reinitialize ! write out.vdb", "out.vdb"},
        Case{"widen", "read coarse.vdb ! widen --half-width 9 ! write out.vdb", "out.vdb"},
        Case{"closest_point", "read coarse.vdb ! closest-point ! write out.vdb", "out.vdb"},
        Case{"march", "read coarse.vdb ! march --speed \"2+sin(x)\" --to 1 ! write out.vdb",
             "out.vdb"},
        Case{"sweep", "read coarse.vdb ! sweep --speed \"2+sin(x)\" --to 1 ! write out.vdb",
             "out.vdb"},
        Case{"advect_front",
             "read coarse.vdb ! advect --field \"-y,x,0.2*z\" --time 0.3 ! write out.vdb",
             "out.vdb"},
        Case{"advect_semi_lagrangian",
             "read coarse.vdb ! advect --field \"-y,x,0.2*z\" --time 0.3 --scheme "
             "semi-lagrangian ! write out.vdb",
             "out.vdb"},
        Case{"advect_upwind",
             "read coarse.vdb ! advect --field \"-y,x,0.2*z\" --time 0.1 --scheme upwind "
             "! write out.vdb",
             "out.vdb"},
        Case{"curvature_flow", "read coarse.vdb ! curvature-flow --time 0.05 ! write out.vdb",
             "out.vdb"},
        Case{"smooth", "read coarse.vdb ! smooth --kind gaussian --sigma 1vx ! write out.vdb",
             "out.vdb"},
        Case{"median", "read coarse.vdb ! smooth --kind median --sigma 1vx ! write out.vdb",
             "out.vdb"},
        Case{"morph",
             "read coarse.vdb --as a ! sphere --radius 2 --voxel 0.3 --as b ! morph @a @b --steps "
             "3 ! write out.vdb",
             "out.vdb"},
        Case{"compare",
             "read coarse.vdb ! sphere --radius 2 --voxel 0.3 ! compare --json > out.json",
             "out.json"},
        Case{"keep",
             "read in.vdb ! sphere --radius 0.3 --voxel 0.2 --center 5,5,5 ! union ! keep "
             "--largest 1 ! write out.vdb",
             "out.vdb"},
        Case{"fill",
             "read in.vdb ! sphere --radius 0.4 --voxel 0.2 --center 1.7,-0.9,0 ! difference ! "
             "fill-cavities ! write out.vdb",
             "out.vdb"},
        Case{"clip", "read in.vdb ! clip --plane \"0,0,0 1,2,0\" ! write out.vdb", "out.vdb"},
        Case{"transform", "read in.vdb ! transform --rotate 30 --scale 1.5 ! write out.vdb",
             "out.vdb"},
        Case{"bake",
             "read in.vdb ! transform --rotate 10,20,30 --scale 1,1,2 --bake ! write out.vdb",
             "out.vdb"},
        Case{"resample", "read in.vdb ! resample --voxel 0.14 ! write out.vdb", "out.vdb"},
        Case{"texture",
             "box --size 8,8,3 --voxel 0.4 --as b ! torus --radius 1 --tube 0.5 --voxel 0.2 --as t "
             "! patch @b --corners "
             "\"-2,-2,1.5 2,-2,1.5 2,2,1.5 -2,2,1.5\" --height 1.5 --as p ! texture @b @t @p "
             "--blend 0.8 ! write out.vdb",
             "out.vdb"},
        Case{"carve",
             "box --size 8,8,3 --voxel 0.4 --as b ! torus --radius 1 --tube 0.5 --voxel 0.2 --as t "
             "! patch @b --corners "
             "\"-2,-2,1.5 2,-2,1.5 2,2,1.5 -2,2,1.5\" --height 1.5 --as p ! texture @b @t @p "
             "--carve ! write out.vdb",
             "out.vdb"},
        Case{"render", "read in.vdb ! render out.exr --size 96x64", "out.exr"},
        Case{"png", "read coarse.vdb ! render out.exr --size 48x32 --png out.png", "out.png"},
        Case{"info", "info in.ply --json > out.json", "out.json"},
        Case{"patch",
             "read in.vdb ! patch --at 0,0,3 --size 1,1 --height 0.4 ! info --json > out.json",
             "out.json"},
        Case{"measure", "read in.vdb ! measure --json > out.json", "out.json"},
        Case{"check", "read in.vdb ! check --json > out.json", "out.json"}),
    [](const ::testing::TestParamInfo<Case>& param_info) {
      return std::string(param_info.param.name);
    });

}  // namespace repeat_test
