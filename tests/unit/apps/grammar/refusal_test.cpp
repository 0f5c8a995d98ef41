// Tests every row of the exit-code table, and inputs that break other tools. Each run ends with its
// code and a message, and leaves no file.

#include <gtest/gtest.h>

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "tests/support/command_line.h"

namespace refusal_test {

class Refusal : public support::ShellTest {
 protected:
  /// Writes a tetrahedron of edge about 1 as ascii PLY, with one vertex replaced.
  void writeTetrahedron(const std::string& name, const std::string& apex = "0 0 1",
                        const std::string& type = "float") {
    writeFile(name, "ply\nformat ascii 1.0\nelement vertex 4\nproperty " + type + " x\nproperty " +
                        type + " y\nproperty " + type +
                        " z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n0 "
                        "0 0\n1 0 0\n0 1 0\n" +
                        apex + "\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n");
  }
  /// Writes a Möbius strip.
  void writeMoebius(const std::string& name) {
    std::string text;
    constexpr int kSteps = 48;
    for (int i = 0; i < kSteps; ++i)
      for (double side : {-0.3, 0.3}) {
        const double a = 2 * 3.14159265358979 * i / kSteps, r = 1 + side * std::cos(a / 2);
        text += "v " + std::to_string(r * std::cos(a)) + " " + std::to_string(r * std::sin(a)) +
                " " + std::to_string(side * std::sin(a / 2)) + "\n";
      }
    for (int i = 0; i < kSteps; ++i) {
      const int a = 2 * i + 1, b = a + 1;
      int c = 2 * ((i + 1) % kSteps) + 1, d = c + 1;
      if (i + 1 == kSteps) std::swap(c, d);
      text += "f " + std::to_string(a) + " " + std::to_string(c) + " " + std::to_string(d) + " " +
              std::to_string(b) + "\n";
    }
    writeFile(name, text);
  }
  static std::string toBand(const std::string& file, const std::string& rest = "--voxel 0.05") {
    return "read " + file + " ! level-set " + rest + " ! write out.vdb";
  }
  void expectNothingWritten(std::size_t inputs) { EXPECT_EQ(fileCount(), inputs); }
};

TEST_F(Refusal, UsageErrorsExitWithTwo) {
  EXPECT_REFUSED(levelsmith("spere --radius 1"), 2, "did you mean");
  EXPECT_REFUSED(levelsmith("sphere --colour red"), 2, "no option");
  EXPECT_REFUSED(levelsmith("sphere --radius 1 --voxel 0.1 ! union"), 2, "operand");
  for (const char* bad : {"0", "-0.1", "nan", "inf", "x", "2vx"})
    EXPECT_REFUSED(levelsmith(std::string("sphere --radius 1 --voxel ") + bad), 2, "voxel");
  EXPECT_REFUSED(levelsmith("sphere --radius -1 --voxel 0.1"), 2, "positive");
  EXPECT_REFUSED(levelsmith("sphere --radius 1 --voxel 0.1 ! offset nan"), 2, "finite");
  EXPECT_REFUSED(levelsmith("sphere --radius 1 --voxel 0.1 ! render a.png --size 0x0"), 2,
                 "is empty");
  EXPECT_REFUSED(levelsmith("sphere --radius 1 --voxel 0.1 ! write a.txt"), 2, "format");
  EXPECT_REFUSED(levelsmith("sphere --radius 1"), 2, "--voxel");
  EXPECT_REFUSED(levelsmith("-v help"), 2, "help must be the only action");
  writeTetrahedron("tetra.ply");
  for (const char* bad : {"0", "-0.1", "nan", "inf", "2vx"})
    EXPECT_REFUSED(levelsmith(toBand("tetra.ply", std::string("--voxel ") + bad)), 2,
                   "level-set: --voxel");
  expectNothingWritten(1);
}

TEST_F(Refusal, PatchesLargerThanTheirSolidReportItsCurvature) {
  const std::string ball = "sphere --radius 1 --voxel 0.1 --as ball ! ";
  for (const char* rest :
       {"patch @ball --at 1,0,0 --size 4,4 --height 0.2 ! mesh ! write a.ply",
        "patch-grid @ball --at 1,0,0 --size 4,4 --count 2,2 --height 0.2 ! mesh ! write a.ply"})
    EXPECT_REFUSED(levelsmith(ball + rest), 3, "around 1,0,0 bends too much");
  // Its diagonals go around the ball more than once and end in the right orientation again.
  EXPECT_REFUSED(levelsmith(ball + "patch @ball --at 0,0,1 --size 10,10 --height 0.1 ! mesh ! "
                                   "write a.ply"),
                 3, "bends too much for a patch of size 10,10");
  EXPECT_REFUSED(levelsmith(ball + "scatter @ball --count 3 --size 10,10 --height 0.1 ! mesh ! "
                                   "write a.ply"),
                 3, "no patch could be built");
}

TEST_F(Refusal, TexturesEmbeddedThroughTheirBaseEndAtOnce) {
  EXPECT_REFUSED(
      levelsmith("sphere --radius 1 --voxel 0.1 --as ball ! sphere --radius 1 --voxel 0.1 "
                 "--as t ! patch @ball --at 1,0,0 --size 1,1 --height 0.2 --as p ! "
                 "texture @ball @t @p --sink 1e6 ! write a.vdb",
                 10),
      3, "exceeds the diagonal of the base");
}

/// A chain with an invalid end is refused within a second, before the sphere at its beginning,
/// which would take many seconds.
TEST_F(Refusal, DetectableErrorsPrecedeTheRun) {
  const std::string large = "sphere --radius 1 --voxel 0.001 ! ";
  const auto soon = [&](const std::string& rest, int code, const char* part) {
    EXPECT_REFUSED(levelsmith(large + rest, 5), code, part);
  };
  soon("write a.txt", 2, "no known format");
  soon("write a.ply", 2, "put 'mesh' before it");
  soon("mesh ! write a.ply --name x", 2, "--name");
  soon("mesh --adaptivity 2 ! write a.ply", 2, "between 0 and 1");
  soon("render a.jpg", 2, "no known format");
  soon("render a.png --samples 4294967297", 2, "too many");
  soon("render - --format exr --png -", 2, "cannot share standard output");
  soon("render - --format exr ! write - --format vdb", 2, "already used");
  soon("render a.exr --png - ! write - --format vdb", 2, "already used");
  soon("write /dev/stdout --format vdb ! measure --json", 2, "already used");
  soon("render a.exr --png ./a.exr", 2, "named twice");
  soon("clip --box \"0,0,0 1,1,1\" --plane \"0,0,0 0,0,1\"", 2, "give either");
  soon("resample", 2, "needs a voxel size");
  soon("transform --mirror x", 2, "add --bake");
  soon("patch --at 0,0,1 --height 0.1", 2, "needs --size");
  soon("patch --corners \"0,0,1 0,1,1\" --height 0.1", 2, "four points");
  soon("patch --at 0,0,1 --size 0.1,0.1 --height 0.1 --levels 1000000", 2, "out of range");
  soon("patch --at 0,0,1 --size 1,1 --side0 \"0,0,1\" --height 0.1", 2, "needs --corners");
  soon("decal --at 0,0,1 --direction 1,0,0 --height 0.1", 2, "--radius");
  soon("decal --at 0,0,1 --direction 1,0,0 --radius -1 --height 0.1", 2, "--radius");
  soon("patch-grid --count 3,2 --height 0.1", 2, "give one of --corners");
  soon("patch-grid --count 3 --around \"0,0,0 0,0,1\" --height 0.1", 2, "as 12,3");
  soon("patch-grid --count 3,0 --around \"0,0,0 0,0,1\" --height 0.1", 2, "as 12,3");
  soon("patch-grid --count 3,2 --around \"0,0,0\" --height 0.1", 2, "needs two points");
  soon("patch-grid --count 3,2 --around \"0,0,0 0,0,1\" --twist 5 --height 0.1", 2, "--twist");
  soon("patch-grid --count 3,2 --at 0,0,1 --size 1,1 --shift 1 --height 0.1", 2, "--shift");
  soon("mesh --sheets", 2, "for a patch");
  soon("march --order 3", 2, "--order");
  soon("sweep --extend x --speed 2", 2, "cannot be combined with --speed");
  soon("march --extend x --order 1", 2, "cannot be combined with --order");
  soon("march --speed \"1 + t\"", 2, "fast-marching: --speed: the formula '1 + t'");
  soon("offset --by \"0.3*t\"", 2, "use x, y, z, r, numbers");
  soon("advect --field vortex --time 1 --factor \"1 +\"", 2, "advect: --factor");
  soon("advect --field vortex --time 1 --factor \"x*t\"", 2, "use t, numbers");
  soon("advect --field vortex --time 1 --factor \"1,2\"", 2, "'1,2' holds 2 formulas; give one");
  soon("evolve --time 1", 2, "--speed");
  soon("evolve --time 1 --speed \"1 +\"", 2, "evolve: --speed: the formula '1 +'");
  soon("evolve --time 1 --speed \"q\"", 2, "use x, y, z, r, t, nx, ny, nz, k, numbers");
  soon("evolve --time -1 --speed 1", 2, "must not be negative");
  soon("evolve --time 1 --speed 1 --order 4", 2, "'4' is not one of 1, 2, 3, 5");
  soon("evolve --time 1 --speed 1 --cfl 1.5", 2, "at most 1");
  soon("evolve --time 1 --speed 1 --points 0,0,1", 2, "give both or neither");
  const std::string target = "sphere --radius 1.2 --voxel 0.1 ! morph ";
  soon(target + "--steps 4294967297", 2, "is too large");
  soon("ring --radius 1 --voxel 0.1 --columns 4294967297", 2, "is too large");
  soon(target + "--steps 2147483647", 2, "too many");
  soon(target + "--until 1.5", 2, "up to 1");
  soon(target + "--steps 3 --keep-steps step.vdb", 2, "write # for the number");
  soon(target + "--steps 3 --keep-steps nowhere/step_#.vdb", 6, "no folder");
  soon("write nowhere/a.vdb", 6, "no folder");
  soon("render nowhere/a.png", 6, "render: ");
  writeFile("there.vdb", "kept");
  EXPECT_REFUSED(levelsmith("--no-clobber " + large + "write there.vdb", 5), 6, "no-clobber");
  EXPECT_EQ(support::slurp(folder_ / "there.vdb"), "kept");
  writeFile("step_3.vdb", "kept");
  EXPECT_REFUSED(
      levelsmith("--no-clobber " + large + target + "--steps 4 --keep-steps step_#.vdb", 5), 6,
      "step_3.vdb");
  expectNothingWritten(2);
}

TEST_F(Refusal, AnUnwritableReportIsRefusedBeforeTheRun) {
  const std::string large = "sphere --radius 1 --voxel 0.001 ! write out.vdb";
  writeFile("there.json", "kept");
  for (const char* globals : {"--report . ", "--report /dev/full ", "--report nowhere/r.json ",
                              "--no-clobber --report there.json "}) {
    const auto outcome = levelsmith(globals + large, 5);
    EXPECT_REFUSED(outcome, 6, "levelsmith: --report: '");
    EXPECT_EQ(outcome.err.find("write:"), std::string::npos) << outcome.err;
  }
  EXPECT_REFUSED(levelsmith("--report ./out.vdb " + large, 5), 2, "--report");
  EXPECT_REFUSED(levelsmith("--report /dev/stdout " + large + " ! measure --json", 5), 2,
                 "already used");
  EXPECT_EQ(support::slurp(folder_ / "there.json"), "kept");
  expectNothingWritten(1);
}

TEST_F(Refusal, InvalidBandsExitWithThree) {
  const auto save = [&](const char* name, const std::function<void(openvdb::FloatGrid&)>& spoil) {
    openvdb::initialize();
    auto grid =
        openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, openvdb::Vec3f(0), 0.1f);
    grid->setName("surface");
    spoil(*grid);
    openvdb::io::File file((folder_ / name).string());
    file.write({grid});
  };
  save("nan.vdb", [](auto& grid) { grid.tree().setValueOn(openvdb::Coord(10, 0, 0), NAN); });
  save("fog.vdb", [](auto& grid) { grid.setGridClass(openvdb::GRID_FOG_VOLUME); });
  save("sheared.vdb", [](auto& grid) {
    openvdb::Mat4d matrix = openvdb::Mat4d::identity();
    matrix[1][0] = 0.5;
    grid.setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  });
  EXPECT_REFUSED(levelsmith("read nan.vdb ! measure"), 3, "nan.vdb");
  EXPECT_REFUSED(levelsmith("read fog.vdb ! measure"), 3, "fog.vdb");
  EXPECT_REFUSED(levelsmith("read sheared.vdb ! measure"), 3, "sheared.vdb");
}

TEST_F(Refusal, AFailureIsNotHiddenByItsReport) {
  writeFile("words.ply", "this is not a mesh\n");
  const auto outcome = shell("( sleep 0.3; " + command() +
                             " --report /dev/stdout read words.ply ! measure ) | true; "
                             "exit ${PIPESTATUS[0]}");
  EXPECT_REFUSED(outcome, 3, "words.ply");
  EXPECT_NE(outcome.err.find("--report: '/dev/stdout' could not be written"), std::string::npos);
  EXPECT_REFUSED(levelsmith("--report r.json read words.ply ! measure"), 3, "words.ply");
  EXPECT_NE(support::slurp(folder_ / "r.json").find("\"exit_code\": 3"), std::string::npos);
}

TEST_F(Refusal, CorruptMeshFilesExitWithThree) {
  writeFile("empty.ply", "");
  writeFile("empty.obj", "");
  writeFile("empty.stl", "");
  writeFile("words.ply", "this is not a mesh\n");
  writeTetrahedron("nan.ply", "nan 0 1");
  writeTetrahedron("inf.ply", "0 inf 1");
  writeFile("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
  writeFile("zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n");
  writeFile(
      "claims.ply",
      "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty "
      "float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n");
  ASSERT_EQ(
      levelsmith("sphere --radius 1 --voxel 0.2 ! mesh ! write whole.ply ! write whole.stl").code,
      0);
  const std::string ply = support::slurp(folder_ / "whole.ply"),
                    stl = support::slurp(folder_ / "whole.stl");
  writeFile("cut.ply", ply.substr(0, ply.size() / 2));
  writeFile("cut.stl", stl.substr(0, stl.size() / 2));
  for (const char* file : {"empty.ply", "empty.obj", "empty.stl", "words.ply", "nan.ply", "inf.ply",
                           "range.obj", "zero.obj", "claims.ply", "cut.ply", "cut.stl"})
    EXPECT_REFUSED(levelsmith(toBand(file), 10), 3, file);
  // `info` reports it too if the size of the file reveals it.
  writeFile("faces.ply", ply.substr(0, ply.find("face ") + 5) + "3000000000" +
                             ply.substr(ply.find("\nproperty list")));
  std::string claims = stl;
  claims.replace(80, 4, "\xFF\xFF\xFF\xEE");
  writeFile("claims.stl", claims);
  writeFile("claims.off", "OFF\n3000000000 1 0\n0 0 0\n");
  for (const char* file :
       {"claims.ply", "cut.ply", "faces.ply", "cut.stl", "claims.stl", "claims.off"})
    EXPECT_REFUSED(levelsmith(std::string("info ") + file, 10), 3,
                   std::string("info: '") + file + "'");
  EXPECT_FALSE(exists("out.vdb"));
}

TEST_F(Refusal, CorruptBandFilesExitWithThree) {
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 ! write whole.vdb").code, 0);
  const std::string vdb = support::slurp(folder_ / "whole.vdb");
  for (int part = 0; part < 10; ++part) {
    writeFile("cut.vdb", vdb.substr(0, vdb.size() * static_cast<std::size_t>(part) / 10));
    EXPECT_REFUSED(levelsmith("read cut.vdb ! write out.ply --format vdb", 20), 3, "cut.vdb");
  }
  writeFile("words.vdb", "not a vdb at all");
  EXPECT_REFUSED(levelsmith("read words.vdb ! measure"), 3, "words.vdb");
  EXPECT_REFUSED(levelsmith("read whole.vdb --grid density ! measure"), 3, "density");
}

TEST_F(Refusal, UnusableMeshesExitWithThree) {
  writeFile("triangle.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_REFUSED(levelsmith(toBand("triangle.obj")), 3, "the mesh encloses no volume");
  writeFile("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n");
  EXPECT_REFUSED(levelsmith(toBand("open.obj", "--voxel 0.05 --sign closed")), 3,
                 "edges have one face");
  writeMoebius("moebius.obj");
  EXPECT_REFUSED(levelsmith(toBand("moebius.obj", "--voxel 0.05 --sign closed")), 3,
                 "96 edges have one face");
  EXPECT_REFUSED(levelsmith(toBand("moebius.obj", "--voxel 0.05 --sign winding")), 3,
                 "inside and outside are a guess at");
  writeTetrahedron("tetra.ply");
  EXPECT_REFUSED(levelsmith(toBand("tetra.ply", "--voxel 5")), 3, "voxel");
  EXPECT_FALSE(exists("out.vdb"));
}

TEST_F(Refusal, CoordinatesTooCoarseForTheVoxelExitWithThree) {
  std::string obj;
  writeFile("far.ply",
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty "
            "float z\nelement face 4\n"
            "property list uchar int vertex_indices\nend_header\n10000000 0 0\n10000004 0 "
            "0\n10000000 4 0\n10000000 0 4\n"
            "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n");
  EXPECT_REFUSED(levelsmith(toBand("far.ply", "--voxel 0.02")), 3,
                 "are 1 apart, coarser than an eighth of the voxel size");
  EXPECT_FALSE(exists("out.vdb"));
}

TEST_F(Refusal, ResourceLimitsExitWithFour) {
  writeTetrahedron("tetra.ply");
  EXPECT_REFUSED(levelsmith(toBand("tetra.ply", "--voxel 1e-9"), 10), 4,
                 "level-set: needs about 1.7e+11 GB");
  EXPECT_REFUSED(levelsmith("sphere --radius 1 --voxel 1e-9 ! write out.vdb", 10), 4,
                 "sphere: needs about");
  EXPECT_REFUSED(levelsmith("--max-memory 50M sphere --radius 1 --voxel 0.002 ! write out.vdb", 30),
                 4, "emory");
  EXPECT_REFUSED(levelsmith("sphere --radius 1 --voxel 0.1 ! offset 1e6 ! write out.vdb", 10), 4,
                 "offset");
  EXPECT_REFUSED(
      levelsmith("sphere --radius 1 --voxel 0.1 ! render a.png --size 1000000x1000000", 10), 4,
      "image");
  expectNothingWritten(1);
}

TEST_F(Refusal, OneDistantVertexIsRefusedAtOnce) {
  writeTetrahedron("far.ply", "0 0 1e30");
  const auto outcome = levelsmith(toBand("far.ply"), 10);
  EXPECT_REFUSED(outcome, 4,
                 "level-set: vertex 3 at (0, 0, 1e+30) is 2e+31 voxels from the origin");
  EXPECT_FALSE(exists("out.vdb"));
}

/// A use of memory that no estimate predicts ends the run when it occurs.
TEST_F(Refusal, MemoryUseAboveTheLimitExitsWithFour) {
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.005 ! write in.vdb").code, 0);
  EXPECT_REFUSED(levelsmith("--max-memory 110M read in.vdb ! mesh ! write out.ply"), 4,
                 "memory in use exceeds --max-memory");
  expectNothingWritten(1);
}

// If the system refuses a thread, the exception is thrown where no caller can catch it.
TEST_F(Refusal, UnavailableThreadsExitWithFour) {
  EXPECT_REFUSED(levelsmith("--threads 100000 sphere --radius 1 --voxel 0.1 ! measure"), 2,
                 "--threads: 100000");
  const std::string chain = " sphere --radius 1 --voxel 0.02 ! measure";
  bool isRefused = false, isTried = false;
  for (int kilobytes = 140'000; kilobytes < 280'000; kilobytes += 5'000) {
    const std::string under = "ulimit -v " + std::to_string(kilobytes) + "; " + command();
    if (shell(under + " --version").code != 0) continue;  // its libraries alone exceed the limit
    isTried = true;
    const auto outcome = shell(under + chain);
    EXPECT_TRUE(outcome.code == 0 || outcome.code == 4) << kilobytes << outcome.err;
    if (outcome.code != 0) {
      isRefused |= outcome.err.find("no more threads") != std::string::npos;
      EXPECT_NE(outcome.err.find("levelsmith: "), std::string::npos) << outcome.err;
      EXPECT_EQ(outcome.err.find("terminate"), std::string::npos) << outcome.err;
    }
  }
  if (!isTried) GTEST_SKIP() << "the command does not start within these limits";
  EXPECT_TRUE(isRefused);
}

TEST_F(Refusal, ReportingTheContentsOfAFileReadsLittleOfIt) {
  // A sparse file: 3 GB of zeros that occupy no disk space.
  ASSERT_EQ(shell("truncate -s 3G z.vdb").code, 0);
  EXPECT_REFUSED(levelsmith("--max-memory 300M info z.vdb"), 3, "not an OpenVDB file");
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 ! write a.vdb").code, 0);
  ASSERT_EQ(shell("truncate -s 3G a.vdb").code, 0);
  const auto outcome = levelsmith("--max-memory 300M info a.vdb");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.1 ! write b.vdb").code, 0);
  EXPECT_EQ(shell("mkfifo p.vdb; cat b.vdb > p.vdb & " + command() + " info p.vdb", 20).code, 0);
  EXPECT_REFUSED(levelsmith("sphere --radius 1 --voxel 0.1 ! write q.nvdb ! info q.nvdb"), 2,
                 "info");
  EXPECT_REFUSED(levelsmith("--report r.txt sphere --radius 1 --voxel 0.1 ! measure"), 2,
                 "--report");
}

TEST_F(Refusal, MissingPermissionsExitWithSix) {
  // Root may read and write every file.
  const std::string drop = getuid() == 0 ? "setpriv --reuid=65534 --clear-groups " : "";
  const std::string sphere = " sphere --radius 1 --voxel 0.2 ! ";
  ASSERT_EQ(levelsmith(sphere + "write in.vdb ! mesh ! write in.ply").code, 0);
  ASSERT_EQ(
      shell("chmod 755 . && chmod 000 in.ply in.vdb && mkdir locked && chmod 555 locked").code, 0);
  if (shell(drop + command() + " --version").code != 0) GTEST_SKIP() << "root cannot be dropped";
  for (const char* chain : {"read in.ply ! measure", "read in.vdb ! measure", "info in.ply"})
    EXPECT_REFUSED(shell(drop + command() + " " + chain), 6, "Permission denied");
  EXPECT_REFUSED(shell(drop + command() + sphere + "write locked/out.vdb"), 6, "Permission denied");
  EXPECT_REFUSED(shell(drop + command() + " --report locked/r.json" + sphere + "measure"), 6,
                 "--report: 'locked/r.json'");
  expectNothingWritten(3);
}

TEST_F(Refusal, FileErrorsExitWithSix) {
  EXPECT_REFUSED(levelsmith("read missing.ply ! measure"), 6, "missing.ply");
  ASSERT_EQ(shell("mkdir folder.ply").code, 0);
  EXPECT_REFUSED(levelsmith("read folder.ply ! measure"), 6, "folder.ply");
  const std::string sphere = "sphere --radius 1 --voxel 0.2 ! mesh ! ";
  EXPECT_REFUSED(levelsmith(sphere + "write nowhere/out.ply"), 6, "nowhere");
  EXPECT_REFUSED(levelsmith(sphere + "write folder.ply"), 6, "folder.ply");
  EXPECT_REFUSED(levelsmith(sphere + "write /dev/full --format ply"), 6, "/dev/full");
  EXPECT_REFUSED(levelsmith("sphere --radius 1 --voxel 0.2 ! write /dev/full --format vdb"), 6,
                 "/dev/full");
  EXPECT_REFUSED(
      levelsmith("sphere --radius 1 --voxel 0.2 ! render /dev/full --format png --size 32x32"), 6,
      "/dev/full");
  EXPECT_EQ(shell(command() + " help > /dev/full").code, 6);
  EXPECT_EQ(levelsmith(sphere + "write out.ply").code, 0);
  const std::string before = support::slurp(folder_ / "out.ply");
  EXPECT_REFUSED(levelsmith("--no-clobber sphere --radius 2 --voxel 0.2 ! mesh ! write out.ply"), 6,
                 "out.ply");
  EXPECT_EQ(support::slurp(folder_ / "out.ply"), before);
  expectNothingWritten(2);
}

/// Shell commands that run a chain and interrupt it `delay` seconds later. The exit code is 99
/// where the chain then takes more than half a CPU second on each core. Job control is on, since a
/// shell without it starts background jobs that ignore the signal.
/// @param isListening  true: the delay begins when the command handles the signal, which it does by
///                     blocking it for all threads but one
std::string interrupted(const std::string& command, const std::string& delay, bool isListening) {
  // SIGINT is bit 1 of the blocked signals.
  const std::string listen =
      isListening
          ? "n=0; until [ $n -eq 1000 ] || ! kill -0 $pid || grep -q '^SigBlk:.*[2367abef]$' "
            "/proc/$pid/status; do n=$((n + 1)); sleep 0.01; done; "
          : "";
  return "set -m; " + command + " & pid=$!; " + listen + "sleep " + delay +
         "; before=$(awk '{ print $14 + $15 }' /proc/$pid/stat 2>/dev/null); kill -INT $pid; "
         "wait $pid; code=$?; after=$(awk '{ print $16 + $17 }' /proc/$$/stat); "
         "[ $(( (after - ${before:-0}) * 1000 / $(getconf CLK_TCK) )) -lt "
         "$(( 500 * $(nproc) )) ] || exit 99; exit $code";
}

TEST_F(Refusal, InterruptionExitsWithOneHundredAndThirty) {
  writeFile("out.vdb", "what was there");
  for (const char* delay : {"0", "0.2", "0.7"}) {
    const auto outcome = shell(interrupted(
        command() + " --quiet sphere --radius 1 --voxel 0.004 ! offset 3vx ! write out.vdb", delay,
        std::string(delay) >= "0.7"));
    EXPECT_EQ(outcome.code, 130) << delay << outcome.err;
    // Before the command handles the signal, it ends without a message.
    if (std::string(delay) >= "0.7") {
      EXPECT_NE(outcome.err.find("interrupted"), std::string::npos) << delay;
    }
    EXPECT_TRUE(support::slurp(folder_ / "out.vdb") == "what was there") << delay;
    expectNothingWritten(1);
  }
}

TEST_F(Refusal, EveryLongActionEndsWithinHalfASecond) {
  ASSERT_EQ(
      levelsmith("torus --radius 2 --tube 0.8 --voxel 0.02 ! write in.vdb ! mesh ! write in.ply")
          .code,
      0);
  const std::size_t inputs = fileCount();
  for (const char* chain : {
           "read in.ply ! level-set --voxel 0.004 ! write out.vdb",
           "read in.vdb ! mesh --adaptivity 1 ! write out.ply",
           "box --size 16,16,16 --voxel 0.02 ! mesh --sharp ! write out.ply",
           "read in.vdb ! resample --voxel 0.005 ! write out.vdb",
           "read in.vdb ! render out.exr --size 2000x2000 --samples 64",
           "box --size 20,20,8 --voxel 0.1 --as b ! read in.vdb --as t ! patch @b --at 0,0,4 "
           "--size 10,10 --height 5 --as p ! texture @b @t @p --voxel 0.02 ! write out.vdb",
           "box --size 20,20,8 --voxel 0.1 --as b ! read in.vdb --as t ! patch @b --at 0,0,4 "
           "--size 10,10 --height 5 --as p ! texture @b @t @p --voxel 0.02 --map shell "
           "! write out.vdb",
       }) {
    const auto outcome = shell(interrupted(command() + " --quiet " + chain, "1", true));
    EXPECT_EQ(outcome.code, 130) << chain << outcome.err;
    expectNothingWritten(inputs);
  }
}

TEST_F(Refusal, NestedComponentsKeepTheirCavity) {
  ASSERT_EQ(levelsmith("box --size 3,3,3 --voxel 0.1 ! sphere --radius 1 --voxel 0.1 ! difference "
                       "! mesh ! write nested.ply")
                .code,
            0);
  const auto outcome = levelsmith("read nested.ply ! level-set --voxel 0.1 ! measure --json");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("\"cavities\": 1"), std::string::npos) << outcome.out;
}

}  // namespace refusal_test
