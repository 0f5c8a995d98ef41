// Pictures from the command line, and the relations between them.

#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/support/command_line.h"

namespace pictures_test {

using support::Outcome;
using Json = nlohmann::json;

class Pictures : public support::ShellTest {
 protected:
  void draw(const std::string& solid, const std::string& options) {
    const Outcome drawn = levelsmith(solid + " --voxel 0.1 ! render " + options + " --size 48x48");
    ASSERT_EQ(drawn.code, 0) << drawn.err;
  }
};

TEST_F(Pictures, OfTheSameSolidAgreeExceptForTheColour) {
  draw("sphere --radius 1", "a.exr --samples 1");
  draw("sphere --radius 1", "b.exr --samples 2");
  const Outcome same = levelsmith("compare-images a.exr b.exr --json --difference d.exr");
  EXPECT_EQ(same.code, 0) << same.err;
  const Json json = Json::parse(same.out);
  EXPECT_TRUE(json["agrees"]);
  EXPECT_EQ(json["unlike_elsewhere"], 0);
  EXPECT_GT(json["both_hit"], 500);
  for (const Json& layer : json["layers"]) {
    if (layer["layer"] == "colour") continue;
    EXPECT_EQ(layer["largest"], 0) << layer["layer"];
  }
  EXPECT_TRUE(exists("d.exr"));
  EXPECT_EQ(levelsmith("compare-images a.exr b.exr --exact").code, 5);
  EXPECT_EQ(levelsmith("compare-images a.exr a.exr --exact").code, 0);
}

TEST_F(Pictures, HaveEqualBitsOnGpuAndProcessorAndAgreeWithEmbree) {
  draw("torus --radius 1 --tube 0.4", "g.exr --samples 2 --renderer gpu");
  draw("torus --radius 1 --tube 0.4", "c.exr --samples 2 --renderer cpu");
  draw("torus --radius 1 --tube 0.4", "e.exr --renderer embree");
  const Outcome same = levelsmith("compare-images g.exr c.exr --exact");
  EXPECT_EQ(same.code, 0) << same.err;
  const Outcome judged = levelsmith("compare-images g.exr e.exr");
  EXPECT_EQ(judged.code, 0) << judged.err;
  draw("torus --radius 1 --tube 0.4", "b.exr --png b.png --renderer both");
  EXPECT_TRUE(exists("b.png"));
  EXPECT_EQ(levelsmith("compare-images g.exr b.exr").code, 0);
}

TEST_F(Pictures, OfVolumesAreProvenWithAllFilters) {
  for (const char* filter : {"trilinear", "tricubic", "bspline", "bspline-qi", "super-quadratic",
                             "cubic-c1", "bcc-quadratic"}) {
    const Outcome drawn = levelsmith(
        std::string("volume marschner-lobb ! render v.exr --isovalue 0.5 --size 64x48 --samples 1 "
                    "--renderer both --filter ") +
        filter);
    EXPECT_EQ(drawn.code, 0) << filter << drawn.err;
  }
}

TEST_F(Pictures, ShowPrincipalDirections) {
  const std::string torus = "torus --radius 1 --tube 0.4 --voxel 0.1 ! render ",
                    small = " --size 48x48 ";
  for (const char* style : {"directions", "curvature-lines --line 3", "directions --along k2"})
    EXPECT_EQ(levelsmith(torus + "d.exr --renderer both --style " + style + small).code, 0)
        << style;
  // The styles show the layers that --directions adds to any picture.
  EXPECT_EQ(levelsmith(torus + "l.exr --directions" + small).code, 0);
  EXPECT_EQ(levelsmith(torus + "c.exr --directions --style curvature-lines" + small).code, 0);
  const Outcome same = levelsmith("compare-images l.exr c.exr --json");
  EXPECT_EQ(same.code, 0) << same.err;
  EXPECT_NE(same.out.find("direction2"), std::string::npos);
  EXPECT_EQ(Json::parse(same.out)["only_one"], Json::array());
  EXPECT_EQ(levelsmith(torus + "p.exr" + small).code, 0);
  EXPECT_EQ(levelsmith("compare-images p.exr l.exr --json").out.find("radians times"),
            std::string::npos);
  EXPECT_REFUSED(levelsmith(torus + "a.png --directions"), 2, "--directions is lost");
  EXPECT_REFUSED(levelsmith(torus + "a.png --along k2"), 2, "leave --along out");
  EXPECT_REFUSED(levelsmith(torus + "a.png --line 3"), 2, "leave --line out");
  EXPECT_REFUSED(levelsmith(torus + "a.png --style curvature-lines --line 17"), 2, "at most 16");
  EXPECT_REFUSED(levelsmith("volume sphere ! render a.png --isovalue 0 --transfer auto --style "
                            "curvature-lines"),
                 2, "transfer function");
}

TEST_F(Pictures, OfVolumesNeedAnIsovalue) {
  const std::string chain = "volume sphere --size 12 ! render v.exr --size 16x12 ";
  EXPECT_EQ(levelsmith(chain).code, 2);
  EXPECT_EQ(levelsmith(chain + "--isovalue nan").code, 2);
  EXPECT_EQ(levelsmith(chain + "--isovalue 0 --value-bits 8").code, 2);
  EXPECT_EQ(levelsmith("sphere --radius 1 --voxel 0.2 ! render v.exr --isovalue 0").code, 2);
  const Outcome empty = levelsmith(chain + "--isovalue 9");
  EXPECT_EQ(empty.code, 0) << empty.err;
  EXPECT_NE(empty.err.find("the picture is empty"), std::string::npos) << empty.err;
  EXPECT_EQ(levelsmith(chain + "--isovalue 0 --inside below").code, 0);
}

TEST_F(Pictures, OfTheNanoVdbGridHaveEqualBits) {
  draw("torus --radius 1 --tube 0.4", "n.exr --renderer both --tables nanovdb --samples 1");
  draw("torus --radius 1 --tube 0.4", "c.exr --renderer cpu --samples 1");
  EXPECT_EQ(levelsmith("compare-images n.exr c.exr --exact").code, 0);
  const std::string chain = "sphere --radius 1 --voxel 0.05 ! render r.exr --tables nanovdb ";
  EXPECT_EQ(levelsmith(chain + "--renderer cpu").code, 2);
  EXPECT_EQ(levelsmith(chain + "--renderer gpu --filter bspline").code, 2);
  EXPECT_EQ(levelsmith(chain + "--renderer gpu --value-bits 8").code, 2);
}

TEST_F(Pictures, OfValuesInFewBitsReportTheShiftOfTheSurface) {
  const std::string chain = "sphere --radius 1 --voxel 0.05 ! render v.exr --size 64x48 ";
  for (const char* bits : {"16", "8"}) {
    const Outcome drawn = levelsmith("-v " + chain + "--renderer both --value-bits " + bits);
    EXPECT_EQ(drawn.code, 0) << drawn.err;
    EXPECT_NE(drawn.err.find(std::string("values of ") + bits + " bits displace the surface by "),
              std::string::npos)
        << drawn.err;
  }
  EXPECT_EQ(levelsmith(chain + "--value-bits 12").code, 2);
  EXPECT_EQ(levelsmith(chain + "--value-bits 16 --filter bspline-qi").code, 2);
  EXPECT_EQ(levelsmith(chain + "--value-bits 16 --filter bspline --renderer both").code, 0);
}

TEST_F(Pictures, WithoutOpenGlAreRefusedOrDrawnByTheProcessor) {
  const std::string chain = "sphere --radius 1 --voxel 0.1 ! render o.exr --size 32x32 --renderer ";
  setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json", 1);
  const Outcome refused = levelsmith(chain + "gpu"), both = levelsmith(chain + "both");
  unsetenv("__EGL_VENDOR_LIBRARY_FILENAMES");
  EXPECT_EQ(refused.code, 4) << refused.err;
  EXPECT_NE(refused.err.find("--renderer cpu"), std::string::npos) << refused.err;
  EXPECT_EQ(both.code, 0) << both.err;
  EXPECT_NE(both.err.find("uses the processor"), std::string::npos) << both.err;
  EXPECT_TRUE(exists("o.exr"));
}

TEST_F(Pictures, OfDifferentSolidsDifferAndAllOutputsAreWritten) {
  const std::string view = " --from 0,0,6 --to 0,0,0";
  draw("sphere --radius 1", "a.exr" + view);
  draw("sphere --radius 1.02", "b.exr" + view);
  const Outcome unlike =
      levelsmith("--report r.json compare-images a.exr b.exr --difference d.exr");
  EXPECT_EQ(unlike.code, 5);
  EXPECT_NE(unlike.err.find("compare-images: the pictures differ"), std::string::npos);
  EXPECT_NE(unlike.out.find("curvature.mean"), std::string::npos);
  EXPECT_TRUE(exists("d.exr"));
  EXPECT_TRUE(exists("r.json"));
  // The picture of the difference can be read again.
  EXPECT_EQ(levelsmith("compare-images d.exr a.exr").code, 5);
}

TEST_F(Pictures, AreRefusedBeforeAnyFileIsWritten) {
  draw("sphere --radius 1", "a.exr");
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 ! render small.exr --size 32x48").code, 0);
  writeFile("broken.exr", "no picture");
  const std::size_t files = fileCount();
  const std::pair<const char*, int> lines[] = {
      {"compare-images a.exr", 2},
      {"compare-images a.exr nothing.exr --difference d.exr", 6},
      {"compare-images a.exr broken.exr --difference d.exr", 3},
      {"compare-images a.exr small.exr --difference d.exr", 3},
      {"compare-images a.exr a.exr --difference d.png", 2},
      {"compare-images a.exr a.exr --difference ./a.exr", 2},
      {"compare-images a.exr a.exr --tolerance Z=1", 2},
      {"compare-images a.exr a.exr --tolerance Z=1,-1", 2},
      {"compare-images a.exr a.exr --tolerance depth=1,1 --difference d.exr", 2},
      {"compare-images a.exr a.exr --tolerance Z=1,1 --exact", 2}};
  for (const auto& [line, code] : lines) {
    const Outcome refused = levelsmith(line);
    EXPECT_EQ(refused.code, code) << line;
    EXPECT_NE(refused.err.find("compare-images"), std::string::npos) << refused.err;
    EXPECT_EQ(fileCount(), files) << line;
  }
}

}  // namespace pictures_test
