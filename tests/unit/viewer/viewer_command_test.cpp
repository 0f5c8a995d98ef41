// Runs the viewer from the command line, in a window of a virtual display.

#include <Imath/ImathVec.h>
#include <fmt/core.h>
#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "levelset/deform/lattice_file.h"
#include "render/camera.h"
#include "tests/support/command_line.h"

namespace viewer_command_test {

using support::Outcome;
using Json = nlohmann::json;
using Pixel = std::array<int, 4>;

struct Picture {
  int width = 0, height = 0;
  std::vector<png_byte> bytes;
  [[nodiscard]] Pixel at(int x, int y) const {
    Pixel pixel;
    for (std::size_t c = 0; c < 4; ++c)
      pixel[c] = bytes[4 * static_cast<std::size_t>(y * width + x) + c];
    return pixel;
  }
  [[nodiscard]] Pixel middle() const { return at(width / 2, height / 2); }
};

Picture readPng(const std::filesystem::path& file) {
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  Picture picture;
  if (!png_image_begin_read_from_file(&png, file.c_str())) return picture;
  png.format = PNG_FORMAT_RGBA;
  picture.width = static_cast<int>(png.width);
  picture.height = static_cast<int>(png.height);
  picture.bytes.resize(PNG_IMAGE_SIZE(png));
  if (!png_image_finish_read(&png, nullptr, picture.bytes.data(), 0, nullptr)) return {};
  return picture;
}

int brightness(const Pixel& p) {
  return p[0] + p[1] + p[2];
}

/// Lines of a text.
std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

class ViewerCommand : public support::ShellTest {
 protected:
  void SetUp() override {
    ShellTest::SetUp();
    if (std::system("command -v xvfb-run >/dev/null 2>&1") == 0) return;
    const char* ci = std::getenv("CI");
    if (ci && std::string(ci) == "true")
      FAIL() << "xvfb-run is missing, and the viewer must be tested: install xvfb and xauth";
    GTEST_SKIP() << "the viewer needs a display: install xvfb and xauth";
  }

  void makeBall() {
    const Outcome made = levelsmith("sphere --radius 1 --voxel 0.05 ! write ball.vdb");
    ASSERT_EQ(made.code, 0) << made.err;
  }

  /// Runs all lines on one display. `view` stands for the viewer.
  Outcome onDisplay(const std::string& lines) {
    writeFile("lines.sh", "view() { '" LEVELSMITH_VIEWER_COMMAND "' \"$@\"; }\n" + lines);
    return shell("xvfb-run -a bash lines.sh");
  }

  [[nodiscard]] Picture png(const std::string& name) const { return readPng(folder_ / name); }
};

TEST_F(ViewerCommand, DrawsPicksAndWritesTheCommandsPicture) {
  makeBall();
  const std::string camera = "--from 0.5,1,5 --to 0,0,0 --fov 30 --size 200x150";
  const Outcome seen = onDisplay("set -e; view ball.vdb " + camera +
                                 " --screenshot a.png --pick 100,75\n"
                                 "view ball.vdb " +
                                 camera +
                                 " --screenshot w.png --interface\n"
                                 "view ball.vdb --pick 0,0");
  ASSERT_EQ(seen.code, 0) << seen.err;

  const Picture picture = png("a.png");
  ASSERT_EQ(picture.width, 200);
  ASSERT_EQ(picture.height, 150);
  EXPECT_GT(brightness(picture.middle()), 250);
  EXPECT_EQ(picture.middle()[3], 255);
  for (const int x : {0, 199})
    for (const int y : {0, 149}) EXPECT_EQ(picture.at(x, y)[3], 0);
  const Outcome drawn = levelsmith("read ball.vdb ! render b.png --renderer cpu " + camera);
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_EQ(picture.bytes, png("b.png").bytes);

  // The ray through the middle points towards the origin.
  const std::size_t end = seen.out.find('\n');
  const Json json = Json::parse(seen.out.substr(0, end));
  const double distance = std::sqrt(0.5 * 0.5 + 1 + 25);
  const std::array<double, 3> truth = {0.5 / distance, 1 / distance, 5 / distance};
  for (std::size_t a = 0; a < 3; ++a) {
    EXPECT_NEAR(json["position"][a].get<double>(), truth[a], 0.01);
    EXPECT_NEAR(json["normal"][a].get<double>(), truth[a], 0.01);
  }
  EXPECT_EQ(json["solid"], "ball");
  EXPECT_EQ(seen.out.substr(end + 1), "null\n");

  const Picture window = png("w.png");
  ASSERT_EQ(window.bytes.size(), picture.bytes.size());
  EXPECT_EQ(window.at(190, 10)[3], 255);
  EXPECT_NE(window.bytes, picture.bytes);
}

TEST_F(ViewerCommand, ShowsLayersAndClipPlanes) {
  makeBall();
  const Outcome seen = onDisplay(
      "set -e; camera='--from 0,0,5 --to 0,0,0 --size 120x90'\n"
      "view ball.vdb $camera --layer normal --screenshot n.png\n"
      "view ball.vdb $camera --layer mean --screenshot m.exr\n"
      "view ball.vdb $camera --clip z=0.2 --screenshot c.png --pick 60,45");
  ASSERT_EQ(seen.code, 0) << seen.err;
  const Pixel normal = png("n.png").middle();
  EXPECT_NEAR(normal[0], 128, 2);
  EXPECT_NEAR(normal[1], 128, 2);
  EXPECT_GE(normal[2], 254);
  EXPECT_TRUE(exists("m.exr"));
  const Pixel inside = png("c.png").middle();
  EXPECT_GT(inside[2], inside[0] + 20);
  EXPECT_NEAR(Json::parse(seen.out)["position"][2].get<double>(), 0.2, 1e-4);
}

TEST_F(ViewerCommand, OpensMeshesScenesAndPatches) {
  const Outcome made = levelsmith(
      "box --size 2,2,2 --voxel 0.1 --as b ! sphere --radius 1.2 --voxel 0.1 --as s "
      "! mesh @s --as m ! scene @b @s @m --csg 'b - s' --from 0,0,6 --size 80x60 ! write cut.json "
      "! scene @m --from 0,0,6 --size 80x60 ! write mesh.json ! mesh @b ! write b.ply "
      "! patch @b --corners '-0.5,-0.5,1 0.5,-0.5,1 0.5,0.5,1 -0.5,0.5,1' --height 0.3 --levels 3 "
      "! write p.patch");
  ASSERT_EQ(made.code, 0) << made.err;
  const Outcome seen = onDisplay(
      "set -e; view cut.json --screenshot s.png --clip z=0.9 --pick 40,30\n"
      "view mesh.json --pick 40,30\n"
      "view b.ply --resolution 40 --from 0,0,6 --size 80x60 --screenshot m.png\n"
      "view p.patch b.ply --resolution 40 --from 0,0,6 --size 80x60 --screenshot p.png\n"
      "view p.patch --from 0,0,6 --size 80x60 --screenshot alone.png --pick 40,30");
  ASSERT_EQ(seen.code, 0) << seen.err;
  EXPECT_EQ(png("s.png").width, 80);  // size of the scene file
  EXPECT_GT(brightness(png("m.png").middle()), 250);
  EXPECT_NE(png("p.png").bytes, png("m.png").bytes);
  EXPECT_GT(png("alone.png").middle()[3], 0);
  // The mesh extends beyond the plane, which cuts solids only.
  EXPECT_EQ(seen.out.find("\"solid\":\"m\"") != std::string::npos, true) << seen.out;
  EXPECT_TRUE(seen.out.ends_with("\"solid\":\"m\"}\nnull\n")) << seen.out;
}

TEST_F(ViewerCommand, RefusesInvalidRequests) {
  makeBall();
  writeFile("broken.vdb", "no grid");
  writeFile("broken.ply", "ply\n");
  const Outcome seen = onDisplay(
      "view missing.vdb --pick 1,1; echo $?; view missing.vdb; echo $?\n"
      "view broken.vdb --pick 1,1; echo $?; view broken.ply --pick 1,1; echo $?\n"
      "view '' --pick 1,1; echo $?; view ball.txt --pick 1,1; echo $?\n"
      "view ball.vdb ball.vdb; echo $?\n"
      "view ball.vdb --layer colours --pick 1,1; echo $?\n"
      "view ball.vdb --isovalue 3 --pick 1,1; echo $?\n"
      "view ball.vdb --pick 9,9 --size 9x9; echo $?\n"
      "view ball.vdb --screenshot no/such/folder.png; echo $?\n"
      "view ball.vdb --size 100000x100000 --screenshot a.png; echo $?\n"
      "view ball.vdb --from 0,0,0 --to 0,0,0 --pick 1,1; echo $?\n");
  EXPECT_EQ(seen.out, "6\n6\n3\n3\n2\n2\n2\n2\n2\n2\n6\n4\n2\n") << seen.err;
  std::size_t sentences = 0;
  for (std::size_t at = 0; (at = seen.err.find("levelsmith-view: ", at)) != std::string::npos; ++at)
    ++sentences;
  EXPECT_EQ(sentences, 13u) << seen.err;
  EXPECT_FALSE(exists("a.png"));
}

TEST_F(ViewerCommand, ShowsIsosurfacesAndSlicesOfVolumes) {
  // Values x + 10 y + 100 z at 3 x 3 x 3 points, as text.
  std::string numbers;
  for (int n = 0; n < 27; ++n)
    numbers += std::to_string(n % 3 + 10 * (n / 3 % 3) + 100 * (n / 9)) + " ";
  writeFile("steps.nrrd",
            "NRRD0004\ntype: float\ndimension: 3\nsizes: 3 3 3\nencoding: ascii\n\n" + numbers);
  writeFile("drag.play",
            "wait\n"
            "drag 60,350 135,350 # the middle of the histogram\n"
            "wait\nclick 60,591\ncopied\n"
            "click 26,492\nwait\nclick 180,492\ncopied\n");
  const std::string camera = "--from 9,7,5 --to 1,1,1 --up 0,0,1 --size 120x90";
  const Outcome seen =
      onDisplay("set -e; camera='" + camera +
                "'\n"
                "view steps.nrrd $camera --isovalue 111 --filter cubic-c1 --screenshot s.png\n"
                "view steps.nrrd $camera --isovalue none --slices i=1.5 --grey 0,222 --pick 60,45\n"
                "view steps.nrrd --size 700x700 --play drag.play\n"
                "view steps.nrrd $camera --slices i=2.5 --pick 1,1 || echo $?\n"
                "view steps.nrrd $camera --clip x=1 --pick 1,1 || echo $?\n"
                "view steps.nrrd --filter cubic --pick 1,1 || echo $?\n"
                "view steps.nrrd --grey 5,5 --pick 1,1 || echo $?\n");
  ASSERT_EQ(seen.code, 0) << seen.err;
  const Outcome drawn =
      levelsmith("read steps.nrrd ! render d.png --isovalue 111 --filter cubic-c1 " + camera);
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_EQ(png("s.png").bytes, png("d.png").bytes);
  const std::vector<std::string> lines = linesOf(seen.out);
  ASSERT_EQ(lines.size(), 7u) << seen.out;
  const Json slice = Json::parse(lines[0]);
  EXPECT_NEAR(slice["position"][0].get<double>(), 1.5, 1e-12);
  EXPECT_NEAR(
      slice["value"].get<double>(),
      1.5 + 10 * slice["position"][1].get<double>() + 100 * slice["position"][2].get<double>(),
      1e-4);
  ASSERT_EQ(lines[1].find("isosurface "), 0u) << lines[1];
  EXPECT_NEAR(std::stod(lines[1].substr(11)), 111, 6);
  EXPECT_EQ(lines[2].find("--transfer \""), 0u) << lines[2];
  EXPECT_EQ(lines[3] + lines[4] + lines[5] + lines[6], "2322");
}

TEST_F(ViewerCommand, ReportsAMissingDisplay) {
  makeBall();
  const Outcome seen =
      shell("unset DISPLAY WAYLAND_DISPLAY; '" LEVELSMITH_VIEWER_COMMAND "' ball.vdb");
  EXPECT_REFUSED(seen, 4, "levelsmith render");
}

TEST_F(ViewerCommand, StaysOpenUntilItIsClosed) {
  makeBall();
  // A window without a file, one whose file disappears, and one that is interrupted.
  const Outcome seen = onDisplay("timeout --preserve-status -s INT 2 '" LEVELSMITH_VIEWER_COMMAND
                                 "'; echo $?\n"
                                 "(sleep 1; rm ball.vdb; sleep 1; echo garbage >ball.vdb) &\n"
                                 "timeout --preserve-status -s INT 4 '" LEVELSMITH_VIEWER_COMMAND
                                 "' ball.vdb --size 300x200; echo $?\n");
  EXPECT_EQ(seen.out, "130\n130\n") << seen.err;
  EXPECT_NE(seen.err.find("interrupted"), std::string::npos);
}

TEST_F(ViewerCommand, MakesAPatchWithTheMouseAndWritesItsCommand) {
  const Outcome ball = levelsmith("sphere --radius 1 --voxel 0.04 ! write ball.vdb");
  ASSERT_EQ(ball.code, 0) << ball.err;
  writeFile("patch.play",
            "key e\n"
            "drag 305,150 300,140   # in clockwise order\n"
            "drag 395,150 400,140\n"
            "drag 395,250 400,240\n"
            "drag 305,250 300,240\n"
            "wait\npicture textured.png\n"
            "drag 400,140 406,135   # moves a corner\n"
            "wait\nkey ctrl+c\ncopied\nkey ctrl+k\ncopied\n"
            "key ctrl+s\nkey enter\n"
            "key backspace\nwait\npicture three.png\n");
  const Outcome seen = onDisplay(
      "view ball.vdb --from 0,0,5 --to -0.45,0,0 --size 560x400 --renderer cpu --style tone --play "
      "patch.play");
  ASSERT_EQ(seen.code, 0) << seen.err;
  const std::vector<std::string> lines = linesOf(seen.out);
  ASSERT_EQ(lines.size(), 2u) << seen.out;
  EXPECT_EQ(lines[0].find("patch --corners \""), 0u) << lines[0];
  EXPECT_NE(lines[1].find(lines[0]), std::string::npos) << lines[1];
  EXPECT_NE(png("textured.png").bytes, png("three.png").bytes);

  // The actions make the same bits as the viewer.
  ASSERT_EQ(shell("mv textured.vdb viewer.vdb").code, 0);
  ASSERT_EQ(lines[1].find("levelsmith "), 0u);
  const Outcome made = levelsmith(lines[1].substr(std::string("levelsmith ").size()));
  ASSERT_EQ(made.code, 0) << made.err;
  const Outcome same = shell("cmp viewer.vdb textured.vdb");
  EXPECT_EQ(same.code, 0) << same.out << same.err;
}

/// Position in the picture of a point, as a script has it.
std::string pixelOf(const render::Camera& camera, const Imath::V3d& point,
                    const Imath::V2d& way = {0, 0}) {
  const Imath::V3d at = point * camera.worldToNdc();
  return fmt::format("{:.2f},{:.2f}", at.x * camera.width + way.x, at.y * camera.height + way.y);
}

TEST_F(ViewerCommand, DeformsByALatticeWithTheMouse) {
  const Outcome ball = levelsmith("sphere --radius 1 --voxel 0.08 ! write ball.vdb");
  ASSERT_EQ(ball.code, 0) << ball.err;
  render::Camera camera;
  camera.from = {1, 1.5, 5};
  camera.to = {-0.5, 0, 0};
  camera.width = 560;
  camera.height = 350;
  const std::string view =
      " --from 1,1.5,5 --to -0.5,0,0 --size 560x350 --renderer cpu --style tone";
  // Control points of 4 x 4 x 4 around the ball: the box is two voxels wider.
  const double half = 1.16;
  const Imath::V3d corner(half), below(half, half / 3, half), inner(half / 3, half, half);
  writeFile("lattice.play",
            "key d\nwait\n"
            "drag " +
                pixelOf(camera, corner) + " " + pixelOf(camera, corner, {60, -40}) +
                "\nkey ctrl+c\ncopied\n"
                // Two points along y.
                "click " +
                pixelOf(camera, below) + "\npress shift\nclick " + pixelOf(camera, inner) +
                "\nrelease shift\nmove " + pixelOf(camera, inner) + "\npress left\nkey y\nmove " +
                pixelOf(camera, inner, {5, -20}) + "\nmove " + pixelOf(camera, inner, {5, -40}) +
                "\nrelease left\nwait\n"
                // A fold, without the axis, which is undone.
                "move " +
                pixelOf(camera, Imath::V3d(half, -half, half)) + "\npress left\nkey y\nmove " +
                pixelOf(camera, Imath::V3d(-half * 3, -half, half)) + "\nrelease left" +
                "\nwait\npicture fold.png\nkey ctrl+z\nwait\npicture lattice.png\n"
                "key ctrl+z\nkey ctrl+y\nkey ctrl+s\nkey enter\nwait\nkey ctrl+k\ncopied\n");
  const Outcome seen =
      onDisplay("view ball.vdb" + view + " --play lattice.play --screenshot seen.png");
  ASSERT_EQ(seen.code, 0) << seen.err;
  const std::vector<std::string> lines = linesOf(seen.out);
  ASSERT_EQ(lines.size(), 2u) << seen.out;
  EXPECT_EQ(lines[0], "deform --lattice 'lattice.json'");
  EXPECT_EQ(lines[1],
            "levelsmith read 'ball.vdb' ! deform --lattice 'lattice.json' ! write deformed.vdb");
  EXPECT_NE(png("fold.png").bytes, png("lattice.png").bytes);

  const levelset::LatticeData data = levelset::readLattice(folder_ / "lattice.json").data();
  const auto pointAt = [&](std::size_t i, std::size_t j, std::size_t k) {
    return data.points[(i * 4 + j) * 4 + k];
  };
  const Imath::V3d atNdc = pointAt(3, 3, 3) * camera.worldToNdc(),
                   before = corner * camera.worldToNdc();
  // Positions in the script are rounded to hundredths of a pixel.
  EXPECT_NEAR((atNdc.x - before.x) * 560, 60, 0.02);
  EXPECT_NEAR((atNdc.y - before.y) * 350, -40, 0.02);
  const Imath::V3d first = pointAt(3, 2, 3) - below, second = pointAt(1 + 1, 3, 3) - inner;
  EXPECT_GT(first.y, 0.1);
  EXPECT_LT((first - second).length(), 1e-15);
  EXPECT_LT(std::abs(first.x) + std::abs(first.z), 1e-15);
  EXPECT_LT((pointAt(3, 0, 3) - Imath::V3d(half, -half, half)).length(), 1e-15);

  // The actions make the solid that the viewer shows.
  const Outcome made =
      levelsmith(lines[1].substr(std::string("levelsmith ").size()) + " ! render made.png" + view);
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(png("seen.png").bytes, png("made.png").bytes);
  const Outcome again = onDisplay("view ball.vdb --lattice lattice.json" + view +
                                  " --screenshot again.png; view ball.vdb --lattice ball.vdb "
                                  "--pick 1,1; echo $?; view ball.vdb --lattice lattice.json "
                                  "--cage x.ply --pick 1,1; echo $?");
  EXPECT_EQ(png("again.png").bytes, png("made.png").bytes);
  EXPECT_EQ(again.out, "3\n2\n") << again.err;
}

TEST_F(ViewerCommand, SculptsATerrainWithTheMouse) {
  std::string rows;
  for (int j = 0; j < 65; ++j) {
    for (int i = 0; i < 65; ++i)
      rows += fmt::format("{:.2f} ", 6 * std::sin(0.11 * i) * std::cos(0.13 * j));
    rows += "\n";
  }
  writeFile("hills.asc", "ncols 65\nnrows 65\nxllcenter 0\nyllcenter 0\ncellsize 1\n" + rows);
  // Strokes with all brushes, from the second half of the window: the panel is at the left. The
  // last stroke is undone, done again and undone.
  writeFile("sculpt.play",
            "wait\nkey s\nwait\npicture before.png\n"
            "drag 330,170 420,190\nkey 2\nclick 380,230\nkey 3\nclick 350,190\nkey 4\nkey ]\n"
            "click 420,160\nkey 5\ndrag 440,200 400,240\nkey 6\nclick 330,170\nwait\n"
            "picture six.png\nkey 1\nclick 400,200\nkey ctrl+z\nkey ctrl+y\nkey ctrl+z\nwait\n"
            "picture undone.png\nkey ctrl+c\ncopied\nkey ctrl+s\nkey enter\nwait\n"
            "key ctrl+k\ncopied\n");
  const std::string view = " --from 32,-50,60 --to 20,30,0 --up 0,0,1 --size 560x350 ";
  const Outcome seen = onDisplay("view hills.asc" + view + "--play sculpt.play");
  ASSERT_EQ(seen.code, 0) << seen.err;
  const std::vector<std::string> lines = linesOf(seen.out);
  ASSERT_EQ(lines.size(), 2u) << seen.out;
  for (const char* brush : {"raise", "smooth", "flatten", "noise", "erode"})
    EXPECT_NE(lines[0].find(std::string("sculpt --brush ") + brush), std::string::npos) << brush;
  EXPECT_EQ(lines[1],
            "levelsmith read 'hills.asc' ! terrain --edits 'hills.edits' ! write sculpted.asc");
  EXPECT_NE(png("before.png").bytes, png("six.png").bytes);

  // The actions and the file make the same bits as the viewer.
  const Outcome made = levelsmith("read hills.asc ! " + lines[0] + " ! write actions.asc");
  ASSERT_EQ(made.code, 0) << made.err;
  const Outcome file = levelsmith(lines[1].substr(std::string("levelsmith ").size()));
  ASSERT_EQ(file.code, 0) << file.err;
  EXPECT_EQ(shell("cmp actions.asc sculpted.asc").code, 0);
  EXPECT_NE(shell("cmp hills.asc sculpted.asc").code, 0);

  // Sculpting goes on from the file, and refuses one of another terrain.
  writeFile("again.play",
            "wait\nkey s\nwait\nclick 380,200\nkey ctrl+s\nkey enter\nwait\nkey ctrl+c\ncopied\n");
  const Outcome again =
      onDisplay("cp hills.edits first.edits; view hills.asc" + view + "--play again.play");
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(again.out, "terrain --edits 'hills.edits'\n");
  EXPECT_NE(shell("cmp hills.edits first.edits").code, 0);
  EXPECT_EQ(levelsmith("read hills.asc ! terrain --edits hills.edits ! info").code, 0);
}

TEST_F(ViewerCommand, RefusesInputScriptsThatItDoesNotKnow) {
  makeBall();
  writeFile("bad.play", "wait\njump 1,2\n");
  writeFile("key.play", "key nothing\n");
  const Outcome seen = onDisplay(
      "view ball.vdb --play bad.play; echo $?; view ball.vdb --play key.play; echo $?\n"
      "view ball.vdb --play no.play; echo $?; view --play bad.play; echo $?\n"
      "view ball.vdb --opacity 1.5 --pick 1,1; echo $?\n"
      "view ball.vdb --matcap no.png --style matcap --pick 1,1; echo $?\n");
  EXPECT_EQ(seen.out, "2\n2\n6\n2\n2\n6\n") << seen.err;
  EXPECT_NE(seen.err.find("bad.play:2"), std::string::npos) << seen.err;
}

TEST_F(ViewerCommand, DrawsStylesAsTheCommandDoes) {
  makeBall();
  const std::string camera = "--from 0.5,1,5 --to 0,0,0 --fov 30 --size 60x48";
  const std::string cpu = " --renderer cpu " + camera;
  const Outcome drawn = levelsmith("read ball.vdb --as b ! render m.png --style lit" + cpu +
                                   " ! render @b matcap.png --style matcap --matcap m.png" + cpu +
                                   " ! scene @b --opacities 0.5 ! render half.png" + cpu);
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  const Outcome seen = onDisplay("set -e; view ball.vdb " + cpu +
                                 " --style matcap --matcap m.png --screenshot a.png\n"
                                 "view ball.vdb " +
                                 cpu +
                                 " --opacity 0.5 --screenshot b.png\n"
                                 "view ball.vdb " +
                                 cpu + " --layer thickness --screenshot t.png");
  ASSERT_EQ(seen.code, 0) << seen.err;
  EXPECT_EQ(png("a.png").bytes, png("matcap.png").bytes);
  EXPECT_EQ(png("b.png").bytes, png("half.png").bytes);
  EXPECT_LT(brightness(png("t.png").middle()), brightness(png("t.png").at(30, 10)));
}

TEST_F(ViewerCommand, AppliesEffectsWithTheMouseAndCopiesTheirCommand) {
  const Outcome torus = levelsmith("torus --radius 1 --tube 0.4 --voxel 0.06 ! write torus.vdb");
  ASSERT_EQ(torus.code, 0) << torus.err;
  const std::string sliders =
      "wait\nclick 100,540\n"  // unfolds the part
      "drag 20,565 60,565\ndrag 20,590 90,590\ndrag 20,615 100,615\ndrag 20,640 140,640\n"
      "click 150,691\nwait\nclick 60,716\ncopied\n";
  writeFile("effects.play", sliders);
  writeFile("glasses.play", sliders + "click 30,691\nwait\nclick 60,716\ncopied\n");
  writeFile("none.play", sliders + "click 170,716\nwait\n");
  writeFile("ortho.play", "wait\nclick 100,540\nclick 150,691\nclick 30,691\nkey o\nwait\n");
  const std::string camera = " --from 2,8,21 --to 0,0,0 --size 180x800 --style tone";
  const Outcome seen =
      onDisplay("set -e; for name in effects glasses none ortho; do view torus.vdb --renderer cpu" +
                camera + " --play $name.play --screenshot $name.png; done");
  ASSERT_EQ(seen.code, 0) << seen.err;
  const std::vector<std::string> lines = linesOf(seen.out);
  ASSERT_EQ(lines.size(), 4u) << seen.out;
  for (const char* option : {"--style tone", "--outline ", "--halo ", "--depth-cue ",
                             "--occlusion ", "--background 1,1,1"})
    EXPECT_NE(lines[0].find(option), std::string::npos) << option << " " << lines[0];
  EXPECT_NE(lines[2].find("--stereo anaglyph"), std::string::npos) << lines[2];
  // The actions make the pictures that the viewer shows.
  for (const auto& [line, name] : {std::pair(0, "effects.png"), {2, "glasses.png"}}) {
    const Outcome made = levelsmith("read torus.vdb ! " + lines[static_cast<std::size_t>(line)]);
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_EQ(png("view.png").bytes, png(name).bytes) << name;
  }
  EXPECT_NE(png("effects.png").bytes, png("glasses.png").bytes);
  const Outcome plain = levelsmith("read torus.vdb ! render plain.png" + camera);
  ASSERT_EQ(plain.code, 0) << plain.err;
  EXPECT_NE(png("effects.png").bytes, png("plain.png").bytes);
  EXPECT_EQ(png("none.png").bytes, png("plain.png").bytes);
  // An orthographic view has no anaglyph, but the other effects: a white background.
  EXPECT_EQ(brightness(png("ortho.png").at(175, 5)), 3 * 255);
}

class SlowViewerCommand : public ViewerCommand {};

/// Four corners dragged on the bunny give a textured bunny: no number is typed.
TEST_F(SlowViewerCommand, TexturesTheBunny) {
  const std::filesystem::path bunny =
      std::filesystem::path(LEVELSMITH_DATA_DIR) / "models/bunny.obj";
  if (!std::filesystem::exists(bunny))
    GTEST_SKIP() << "no " << bunny << "; `./dev fetch` brings it";
  writeFile("bunny.play",
            "key e\n"
            "drag 560,300 540,280\ndrag 540,420 545,440\n"
            "drag 700,430 690,440\ndrag 690,300 690,285\n"
            "wait\npicture corners.png\n"
            "drag 615,270 615,255   # a point of a side\n"
            "wait\nkey ctrl+c\ncopied\nkey ctrl+s\nkey enter\n");
  const Outcome seen =
      onDisplay("view '" + bunny.string() +
                "' --resolution 128 --renderer cpu --size 960x600 --play bunny.play");
  ASSERT_EQ(seen.code, 0) << seen.err;
  EXPECT_NE(seen.out.find(" --side"), std::string::npos) << seen.out;
  const auto volumeOf = [&](const std::string& chain) {
    const Outcome measured = levelsmith(chain + " ! measure --json");
    EXPECT_EQ(measured.code, 0) << measured.err;
    return Json::parse(measured.out)["volume"].get<double>();
  };
  const double before = volumeOf("read '" + bunny.string() + "' ! level-set --resolution 128"),
               after = volumeOf("read textured.vdb");
  EXPECT_GT(after, 1.01 * before);
  EXPECT_LT(after, 1.06 * before);
}

}  // namespace viewer_command_test
