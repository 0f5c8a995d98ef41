#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "render/images/image.h"
#include "tests/support/command_line.h"
#include "tests/support/measured.h"
#include "tests/support/volume_files.h"

namespace volume_actions_test {

using Json = nlohmann::json;

class VolumeActions : public support::ShellTest {
 protected:
  Json json(const std::string& arguments) {
    const support::Outcome outcome = levelsmith(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.code == 0 ? Json::parse(outcome.out) : Json();
  }
};

TEST_F(VolumeActions, ReadDescribeAndConvertAFile) {
  const support::SformRows sform = {{{2, 0, 0, -2}, {0, 3, 0, -1.5}, {0, 0, 4, -2}}};
  writeFile("a.nii", support::nifti1(4, 16, true, sform).bytes +
                         support::numberBytes<std::int16_t>(support::smallNumbers(true), true));
  for (const char* command : {"info a.nii --json", "read a.nii ! info --json"}) {
    const Json info = json(command);
    EXPECT_EQ(info["size"], Json({3, 2, 2}));
    EXPECT_EQ(info["spacing"], Json({2.0, 3.0, 4.0}));
    EXPECT_EQ(info["orientation"], "RAS");
    EXPECT_EQ(info["type"], "i16");
  }
  EXPECT_EQ(json("read a.nii ! info --json")["range"], Json({-40.0, 37.0}));
  writeFile("a.raw", support::numberBytes<std::uint8_t>(support::smallNumbers(false), false));
  EXPECT_EQ(json("read a.raw --size 3,2,2 --type u8 ! info --json")["range"], Json({5.0, 82.0}));
}

TEST_F(VolumeActions, IsosurfaceIsASolidLikeOthers) {
  const Json ball = json("volume sphere --size 41 --radius 0.7 ! isosurface 0 ! measure --json");
  EXPECT_NEAR(ball["volume"], 4 * M_PI / 3 * 0.343, support::measured(5e-3));
  const Json shell = json(
      "volume sphere --size 41 --radius 0.7 ! threshold 0 0.2 ! fill-cavities ! measure --json");
  EXPECT_NEAR(shell["volume"], ball["volume"], support::measured(1e-5));
  const Json torus = json("volume torus --size 41 ! isosurface 0 ! measure --json");
  EXPECT_EQ(torus["euler"], 0);
  EXPECT_EQ(levelsmith("volume marschner-lobb ! isosurface 0.5 ! check").code, 0);
}

TEST_F(VolumeActions, ReportStatesWhatWasClosed) {
  const support::Outcome outcome = levelsmith(
      "--report run.json volume sphere --size 21 ! isosurface 0 --inside below ! measure");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("closed there, on an area of 24 "), std::string::npos) << outcome.err;
  EXPECT_NE(support::slurp(folder_ / "run.json").find("\"closed_area\""), std::string::npos);
  EXPECT_REFUSED(
      levelsmith("volume sphere --size 21 ! isosurface 0 --inside below --border refuse ! info"), 3,
      "reaches the border");
}

TEST_F(VolumeActions, IsosurfaceMeshIsAMeshLikeOthers) {
  const Json mesh = json(
      "volume sphere --size 41 --radius 0.7 ! isosurface-mesh 0 --filter tricubic ! measure "
      "--json");
  EXPECT_NEAR(mesh["volume"], 4 * M_PI / 3 * 0.343, support::measured(3e-3));
  EXPECT_EQ(levelsmith("volume sphere ! isosurface-mesh 0 ! write ball.ply").code, 0);
  EXPECT_NE(support::slurp(folder_ / "ball.ply").find("property float nx"), std::string::npos);
  const std::string below = "volume sphere --size 21 ! isosurface-mesh 0 --inside below ";
  EXPECT_NE(levelsmith(below + "! info").err.find("border of the volume at 2402 grid points"),
            std::string::npos);
  EXPECT_REFUSED(levelsmith(below + "--border refuse ! info"), 3, "reaches the border");
  EXPECT_REFUSED(levelsmith("volume sphere ! isosurface-mesh 7 ! info"), 3, "no value");
}

TEST_F(VolumeActions, RenderDrawsVolumesByTheirTransferFunction) {
  const std::string ball = "volume sphere --size 30 --radius 0.7 ! render a.exr --size 60x45 ";
  const support::Outcome suggested = levelsmith(ball + "--transfer auto --renderer both");
  EXPECT_EQ(suggested.code, 0) << suggested.err;
  EXPECT_NE(suggested.err.find("render: --transfer \""), std::string::npos) << suggested.err;
  EXPECT_EQ(levelsmith(ball + "--transfer '0:0 0.2:0.1/1,0,0' --isovalue 0.4 --renderer both").code,
            0);
  EXPECT_NE(levelsmith(ball + "--transfer 5:0").err.find("no value of the volume has an opacity"),
            std::string::npos);
  EXPECT_REFUSED(levelsmith(ball + "--transfer 0:1"), 2, "less than 1");
  EXPECT_REFUSED(levelsmith("--dry-run " + ball + "--transfer '0:0.1 0:0.2'"), 2, "two points");
  EXPECT_REFUSED(levelsmith(ball + "--transfer 0:0.1 --inside below"), 2, "--isovalue");
  EXPECT_REFUSED(levelsmith(ball + "--transfer 0:0.1 --filter tricubic"), 2, "--isovalue");
  // A PNG in a style without light shows the surface behind the light, too.
  const std::string tone = "volume sphere --size 30 --radius 0.7 ! render ";
  const std::string how =
      " --size 60x45 --isovalue 0.4 --style tone --transfer '0:0 0.5:0.3/1,0,0'";
  EXPECT_EQ(levelsmith(tone + "a.exr --png beside.png" + how).code, 0);
  EXPECT_EQ(levelsmith(tone + "alone.png" + how).code, 0);
  EXPECT_EQ(support::slurp(folder_ / "beside.png"), support::slurp(folder_ / "alone.png"));
  EXPECT_REFUSED(levelsmith(ball + "--transfer 0"), 2, "VALUE:OPACITY");
  EXPECT_REFUSED(levelsmith(ball), 2, "--transfer");
  EXPECT_REFUSED(levelsmith(ball + "--isovalue 0 --no-shading"), 2, "--transfer");
  EXPECT_REFUSED(levelsmith("sphere --radius 1 --voxel 0.1 ! render a.png --transfer 0:0.1"), 2,
                 "volumes");
}

TEST_F(VolumeActions, ScenesDrawAVolumeAmongSurfaces) {
  const std::string ball = "volume sphere --size 30 --radius 0.7 --as ball ! ";
  const std::string core = "sphere --radius 0.3 --voxel 0.03 --as core ! ";
  const std::string scene = ball + core + "scene @ball @core ";
  const std::string transfer = "--transfer '0:0 0.2:0.1/1,0,0' ";
  EXPECT_EQ(levelsmith(scene + transfer + "! render a.exr --size 60x45 --renderer both").code, 0);
  EXPECT_EQ(levelsmith(scene + transfer +
                       "! render a.exr --size 60x45 --renderer cpu ! render b.exr --size 60x45 "
                       "--renderer gpu ! compare-images a.exr b.exr --exact")
                .code,
            0);
  EXPECT_EQ(json(scene + transfer + "! info --json")["volumes"][0]["name"], "ball");
  EXPECT_NE(levelsmith(scene + "--transfer auto ! info").err.find("scene: --transfer \""),
            std::string::npos);
  // A scene of the volume alone.
  EXPECT_EQ(levelsmith(ball + "scene @ball --size 30x20 " + transfer + "! render a.png").code, 0);
  EXPECT_EQ(levelsmith(ball + "scene @ball " + transfer + "! render a.png --from 3,2,1").code, 0);
  EXPECT_REFUSED(levelsmith("--dry-run " + scene + "! info"), 2, "--transfer");
  EXPECT_REFUSED(levelsmith(ball + core + "scene @core " + transfer + "! info"), 2, "volumes");
  EXPECT_REFUSED(levelsmith(ball + "scene @ball @ball " + transfer + "! info"), 2, "can have one");
  EXPECT_REFUSED(levelsmith(scene + "--no-shading ! info"), 2, "--transfer");
  EXPECT_REFUSED(levelsmith(scene + "--transfer 0:1 ! info"), 2, "less than 1");
  EXPECT_REFUSED(levelsmith(scene + transfer + "! render a.exr --ground"), 2, "no shadow");
  EXPECT_REFUSED(levelsmith(scene + transfer + "! write scene.json"), 2, "\"volumes\"");
  EXPECT_REFUSED(levelsmith(scene + transfer + "--csg ball ! info"), 2, "ball");

  // From a file, in which the mesh stands in the way of the right half of the volume.
  writeFile("grey.mha",
            "ObjectType = Image\nNDims = 3\nBinaryData = False\nDimSize = 2 2 2\n"
            "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n9 9 9 9 9 9 9 9\n");
  writeFile("wall.obj", "v 0.5 -9 2\nv 9 -9 2\nv 9 9 2\nv 0.5 9 2\nf 1 2 3 4\n");
  writeFile("scene.json",
            R"({"format": "levelsmith scene", "version": 1,
                "camera": {"from": [0.5, 0.5, 9], "to": [0.5, 0.5, 0], "ortho": 0.8, "size": [40, 40]},
                "meshes": [{"name": "wall", "file": "wall.obj"}],
                "volumes": [{"name": "grey", "file": "grey.mha", "transfer": "0:0.75/0,1,0",
                             "transform": [-1,0,0,0, 0,-1,0,0, 0,0,1,0, 0,0,0,1]}]})");
  const support::Outcome drawn = levelsmith("read scene.json ! render wall.exr --renderer both");
  EXPECT_EQ(drawn.code, 0) << drawn.err;
  const render::Image image = render::readExr(folder_ / "wall.exr");
  const auto at = [&](const char* name, int x) {
    return static_cast<double>(image.channels.at(name)[static_cast<std::size_t>(20 * 40 + x)]);
  };
  EXPECT_NEAR(at("A", 10), 0.75, 1e-6);
  EXPECT_NEAR(at("G", 10), 0.75, 1e-6);
  EXPECT_EQ(at("volume.A", 30), 0);
  EXPECT_GT(at("R", 30), 0.1);
}

TEST_F(VolumeActions, ResampleTakesVolumesAndSolids) {
  const std::string ball = "volume sphere --size 41 --radius 0.7 ";
  const Json info = json(ball + "! resample --voxel 0.04 --filter bspline-qi ! info --json");
  EXPECT_EQ(info["size"], Json({51, 51, 51}));
  EXPECT_NEAR(info["spacing"][0].get<double>(), 0.04, 1e-12);
  const Json measured = json(ball + "! resample --resolution 50 ! isosurface 0 ! measure --json");
  EXPECT_NEAR(measured["volume"], 4 * M_PI / 3 * 0.343, support::measured(2e-3));
  EXPECT_NE(levelsmith(ball + "! resample --voxel 0.1 ! info").err.find("false detail"),
            std::string::npos);
  EXPECT_EQ(levelsmith(ball + "! resample --voxel 0.02 --filter box ! info").err, "");
  EXPECT_REFUSED(levelsmith(ball + "! resample --voxel 0.1 --half-width 3 ! info"), 2, "solids");
  EXPECT_REFUSED(
      levelsmith("sphere --radius 1 --voxel 0.1 ! resample --voxel 0.2 --filter box ! info"), 2,
      "volumes");
  EXPECT_REFUSED(levelsmith(ball + "! resample ! info"), 2, "--voxel");
  EXPECT_REFUSED(levelsmith(ball + "! resample --voxel 1e-9 ! info"), 4, "voxel");
  EXPECT_REFUSED(levelsmith("--max-memory 1M " + ball + "! resample --voxel 0.005 ! info"), 4, "");
}

TEST_F(VolumeActions, HistogramSuggestsIsovalues) {
  const Json found = json("volume sphere --size 21 ! histogram --classes 2 --json");
  EXPECT_EQ(found["otsu"].size(), 1u);
  EXPECT_EQ(found["counts"].size(), 256u);
  EXPECT_NE(levelsmith("volume sphere ! histogram").out.find("steepest"), std::string::npos);
}

TEST_F(VolumeActions, RefusalsNameTheFileAndHaveCode3) {
  const std::string header = support::nifti1(16, 32, false, support::kOblique).bytes;
  writeFile("short.nii", header + "12");
  EXPECT_REFUSED(levelsmith("read short.nii ! info"), 3, "short.nii' has 2 bytes");
  support::ByteText nan{header};
  for (int n = 0; n < 12; ++n) nan.append<float>(NAN);
  writeFile("nan.nii", nan.bytes);
  EXPECT_REFUSED(levelsmith("read nan.nii ! info"), 3, "nan.nii': the value at the grid point");
  support::ByteText wide = support::nifti2(2, false, support::kOblique);
  for (std::size_t axis = 0; axis < 3; ++axis) wide.put<std::int64_t>(24 + 8 * axis, 2147483647);
  writeFile("wide.nii", wide.bytes);
  EXPECT_REFUSED(levelsmith("read wide.nii ! info"), 3, "wide.nii' states the size");
  EXPECT_REFUSED(levelsmith("volume sphere ! isosurface 7 ! info"), 3, "no value");
  writeFile("a.raw", "123");
  EXPECT_REFUSED(levelsmith("read a.raw ! info"), 2, "--size and --type");
  EXPECT_REFUSED(levelsmith("read a.raw --size 2,1,1 --type u8 ! info"), 3, "check --size");
  EXPECT_REFUSED(levelsmith("read a.vdb --size 2,1,1 ! info"), 2, "--size describes a .raw");
}

}  // namespace volume_actions_test
