// Equal bits with one thread and, twice, with three. Several actions share a process, because
// start-up takes longer than most of them.

#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

#include "tests/support/command_line.h"

namespace repeat_test {

struct Case {
  const char* name;
  const char* chain;
  std::vector<const char*> outputs;  ///< output files of the action
};

// The test output shows the name instead of bytes.
void PrintTo(const Case& c, std::ostream* out) {
  *out << c.chain;
}

class Repeat : public support::ShellTest, public ::testing::WithParamInterface<Case> {};

TEST_P(Repeat, GivesTheSameBits) {
  const Case& c = GetParam();
  ASSERT_EQ(levelsmith("torus --radius 2 --tube 0.8 --axis 1,2,3 --voxel 0.2 ! write in.vdb ! mesh "
                       "! write in.ply "
                       "! sphere --radius 1.4 --center 1,0.5,0.2 --voxel 0.16 ! write tool.vdb "
                       "! torus --radius 2 --tube 0.8 --axis 1,2,3 --voxel 0.3 ! write coarse.vdb "
                       "! sphere --radius 1.4 --center 1,0.5,0.2 --voxel 0.3 ! write ball.vdb")
                .code,
            0);
  std::vector<std::string> first;
  for (int i = 0; i < 3; ++i) {
    const int threads = i == 0 ? 1 : 3;
    const auto outcome =
        levelsmith("--quiet --threads " + std::to_string(threads) + " " + c.chain, 100);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    for (std::size_t k = 0; k < c.outputs.size(); ++k) {
      const std::string bytes = support::slurp(folder_ / c.outputs[k]);
      ASSERT_FALSE(bytes.empty()) << c.outputs[k];
      if (i == 0) first.push_back(bytes);
      ASSERT_EQ(bytes, first[k]) << c.outputs[k] << ", run " << i << " with " << threads
                                 << " threads";
      std::filesystem::remove(folder_ / c.outputs[k]);
    }
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
             {"out.vdb"}},
        Case{"read",
             "read in.vdb ! write out.nvdb ! read in.ply ! write out.obj",
             {"out.nvdb", "out.obj"}},
        Case{"level_set",
             "read in.ply --as m ! level-set @m --voxel 0.14 --sign closed ! write closed.vdb "
             "! level-set @m --voxel 0.14 --sign winding ! write winding.vdb "
             "! level-set @m --voxel 0.2 ! write auto.vdb",
             {"closed.vdb", "winding.vdb", "auto.vdb"}},
        Case{"mesh",
             "read in.vdb --as a ! mesh @a ! write mesh.ply "
             "! mesh @a --adaptivity 0.5 ! write adaptive.ply "
             "! box --size 2,2,2 --voxel 0.2 ! transform --rotate 10,20,30 --bake ! mesh --sharp "
             "! write sharp.ply",
             {"mesh.ply", "adaptive.ply", "sharp.ply"}},
        Case{"csg",
             "read in.vdb --as a ! read tool.vdb --as b ! union @a @b ! write union.vdb "
             "! read coarse.vdb --as c ! read ball.vdb --as d "
             "! intersection @c @d ! write intersection.vdb "
             "! difference @c @d ! write difference.vdb",
             {"union.vdb", "intersection.vdb", "difference.vdb"}},
        Case{"blend",
             "read coarse.vdb --as a ! read ball.vdb --as b ! blend @a @b --radius 0.8 "
             "! write blend.vdb "
             "! blend @a @b --radius 0.9 --method fillet ! write fillet.vdb",
             {"blend.vdb", "fillet.vdb"}},
        // At voxels of 0.07 and 0.3 three voxels are no float.
        Case{"offset",
             "read in.vdb ! offset 3vx ! write offset.vdb "
             "! read coarse.vdb --as a ! offset @a --by \"0.3+0.2*x\" ! write offset_by.vdb "
             "! sphere --radius 0.5 --voxel 0.07 ! open 0.2 ! write open.vdb "
             "! close @a 2vx ! write close.vdb ! shell @a --thickness 0.4 ! write shell.vdb",
             {"offset.vdb", "offset_by.vdb", "open.vdb", "close.vdb", "shell.vdb"}},
        Case{"distance",
             "read coarse.vdb --as a ! reinitialize @a ! write reinitialize.vdb "
             "! widen @a --half-width 9 ! write widen.vdb ! closest-point @a ! write closest.vdb "
             "! march @a --speed \"2+sin(x)\" --to 1 ! write march.vdb "
             "! sweep @a --speed \"2+sin(x)\" --to 1 ! write sweep.vdb",
             {"reinitialize.vdb", "widen.vdb", "closest.vdb", "march.vdb", "sweep.vdb"}},
        Case{"advect",
             "read coarse.vdb --as a ! advect @a --field \"-y,x,0.2*z\" --time 0.3 "
             "! write front.vdb "
             "! advect @a --field \"-y,x,0.2*z\" --time 0.3 --scheme semi-lagrangian "
             "! write semi_lagrangian.vdb "
             "! advect @a --field \"-y,x,0.2*z\" --time 0.1 --scheme upwind ! write upwind.vdb",
             {"front.vdb", "semi_lagrangian.vdb", "upwind.vdb"}},
        Case{"evolve",
             "read coarse.vdb --as a ! evolve @a --speed \"0.3*abs(nz) + x - 0.1*k\" --time 0.1 "
             "! write evolve.vdb",
             {"evolve.vdb"}},
        Case{"flow",
             "read coarse.vdb --as a ! curvature-flow @a --time 0.05 ! write curvature_flow.vdb "
             "! smooth @a --kind gaussian --sigma 1vx ! write gaussian.vdb "
             "! smooth @a --kind median --sigma 1vx ! write median.vdb "
             "! sphere --radius 2 --voxel 0.3 --as b ! morph @a @b --steps 3 ! write morph.vdb",
             {"curvature_flow.vdb", "gaussian.vdb", "median.vdb", "morph.vdb"}},
        Case{"parts",
             "read in.vdb --as a ! sphere --radius 0.3 --voxel 0.2 --center 5,5,5 ! union @a "
             "! keep --largest 1 ! write keep.vdb "
             "! sphere --radius 0.4 --voxel 0.2 --center 1.7,-0.9,0 --as hole "
             "! difference @a @hole ! fill-cavities ! write fill.vdb "
             "! clip @a --plane \"0,0,0 1,2,0\" ! write clip.vdb",
             {"keep.vdb", "fill.vdb", "clip.vdb"}},
        Case{
            "placement",
            "read in.vdb --as a ! transform @a --rotate 30 --scale 1.5 ! write transform.vdb "
            "! read coarse.vdb ! transform --rotate 10,20,30 --scale 1,1,2 --bake ! write bake.vdb "
            "! resample @a --voxel 0.14 ! write resample.vdb",
            {"transform.vdb", "bake.vdb", "resample.vdb"}},
        Case{
            "texture",
            "box --size 8,8,3 --voxel 0.5 --as b ! torus --radius 1 --tube 0.5 --voxel 0.25 --as t "
            "! patch @b --corners "
            "\"-2,-2,1.5 2,-2,1.5 2,2,1.5 -2,2,1.5\" --height 1.5 --as p ! texture @b @t @p "
            "--blend 0.8 ! write texture.vdb ! texture @b @t @p --carve ! write carve.vdb "
            "! texture @b @t @p --map shell ! write shell.vdb "
            "! mesh @t --as m ! texture @b @m @p --map mesh ! write moved.ply",
            {"texture.vdb", "carve.vdb", "shell.vdb", "moved.ply"}},
        Case{
            "folds",
            "box --size 8,8,3 --voxel 0.5 --as b ! torus --radius 1 --tube 0.5 --voxel 0.25 --as t "
            "! patch @b --at 0,0,1.5 --size 4,4 --height 1.5 --spacing 0.8 --as p "
            "! folds @b @p ! write rbf.vdb ! folds @b @p --map mesh --relax patch ! write mesh.vdb "
            "! texture @b @t @p --map shell --unfold --relax texture --sides free ! write out.vdb",
            {"rbf.vdb", "mesh.vdb", "out.vdb"}},
        Case{"render",
             "read in.vdb ! render out.exr --size 96x64 ! read coarse.vdb "
             "! render png.exr --size 48x32 --png out.png",
             {"out.exr", "out.png"}},
        // One action per process, because standard output takes one document.
        Case{"info", "info in.ply --json > out.json", {"out.json"}},
        Case{"patch",
             "read in.vdb ! patch --at 0,0,3 --size 1,1 --height 0.4 ! info --json > out.json",
             {"out.json"}},
        Case{"measure", "read in.vdb ! measure --json > out.json", {"out.json"}},
        Case{"check", "read in.vdb ! check --json > out.json", {"out.json"}},
        Case{"compare",
             "read coarse.vdb ! sphere --radius 2 --voxel 0.3 ! compare --json > out.json",
             {"out.json"}}),
    [](const ::testing::TestParamInfo<Case>& param_info) {
      return std::string(param_info.param.name);
    });

}  // namespace repeat_test
