#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "tests/support/action_test.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"

namespace molecule_actions_test {

using Json = nlohmann::json;
using support::measured;

// Two carbon atoms 3 Å apart, a chlorine atom far away, and water.
constexpr const char* kAtoms =
    "ATOM      1  CA  GLY A   7      -1.500   0.000   0.000  1.00  5.00           C\n"
    "ATOM      2  CB  GLY A   7       1.500   0.000   0.000  1.00  5.00           C\n"
    "HETATM    3 CL    CL B   8      20.000   0.000   0.000  1.00  5.00          CL\n"
    "HETATM    4  O   HOH B   9       0.000  10.000   0.000  1.00  5.00           O\n"
    "END\n";

class MoleculeActions : public support::ActionTest {
 protected:
  void SetUp() override {
    ActionTest::SetUp();
    writeFile("a.pdb", kAtoms);
  }
};

TEST_F(MoleculeActions, ReadDescribesAMolecule) {
  const Json info = json("read a.pdb ! info --json");
  EXPECT_EQ(info["kind"], "molecule");
  EXPECT_EQ(info["atoms"], 3);
  EXPECT_EQ(info["residues"], 2);
  EXPECT_EQ(info["chains"], (Json{"A", "B"}));
  EXPECT_EQ(info["elements"], (Json{{"C", 2}, {"Cl", 1}}));
  EXPECT_EQ(json("read a.pdb --solvent ! info --json")["atoms"], 4);
  EXPECT_EQ(json("info a.pdb --json")["atoms"], 4);  // with water
  EXPECT_EQ(json("read - --format pdb <a.pdb ! info --json")["atoms"], 3);
}

/// A carbon and an oxygen atom with a bond.
TEST_F(MoleculeActions, RenderDrawsAtomsAndBonds) {
  writeFile("co.pdb",
            "ATOM      1  C   GLY A   1       0.000   0.000   0.000  1.00  5.00           C\n"
            "ATOM      2  O   GLY A   1       1.200   0.000   0.000  1.00 25.00           O\n"
            "END\n");
  const std::string view = " --size 64x48 --from 0.6,-6,0 --to 0.6,0,0 --fov 30 --up 0,0,1";
  for (const char* style : {"balls", "sticks", "ball-and-stick", "van-der-waals"}) {
    const support::Outcome drawn =
        levelsmith("read co.pdb ! render a.exr --renderer both" + view + " --atoms " + style);
    EXPECT_EQ(drawn.code, 0) << style << drawn.err;
  }
  const auto draw = [&](const std::string& file, const std::string& colours) {
    EXPECT_EQ(levelsmith("read co.pdb ! render " + file + view + " --colour-by " + colours).code,
              0);
    return support::readText(folder_ / file);
  };
  EXPECT_NE(draw("element.png", "element"), draw("factor.png", "b-factor"));
  EXPECT_EQ(draw("chain.png", "chain"), draw("again.png", "chain"));
  EXPECT_NE(draw("factor.png", "b-factor"), draw("wide.png", "b-factor --blue-at 0 --red-at 100"));
  EXPECT_NE(draw("element.png", "element"), draw("thick.png", "element --stick-radius 0.3"));
  expectRefusal("read co.pdb ! render a.png --blue-at 0", 2, "--colour-by b-factor");
  expectRefusal("read co.pdb ! render a.png --colour-by b-factor --red-at 5", 2,
                "give --blue-at and --red-at");
  expectRefusal("read co.pdb ! render a.png --atoms van-der-waals --ball-scale 0.5", 2,
                "does not apply to --atoms van-der-waals");
  expectRefusal("sphere --radius 1 --voxel 0.2 ! render a.png --stick-radius 1", 2,
                "--stick-radius is for molecules");
  expectRefusal("sphere --radius 1 --voxel 0.2 ! render a.png --atoms balls", 2,
                "--atoms is for molecules");
}

TEST_F(MoleculeActions, MoleculeSurfaceMakesASolid) {
  const double pi = std::numbers::pi;
  // Balls of 1.7 Å that meet in a circle at 1.5 Å, and one of 1.75 Å.
  const double cap = 0.2, lens = 2 * pi * cap * cap * (3 * 1.7 - cap) / 3;
  const double volume = 4 * pi / 3 * (2 * std::pow(1.7, 3) + std::pow(1.75, 3)) - lens;
  const Json vdw =
      json("--report r.json read a.pdb ! molecule-surface --kind vdw --voxel 0.1 ! measure --json");
  EXPECT_NEAR(vdw["volume"].get<double>() / volume, 1, measured(7e-4));
  EXPECT_EQ(vdw["components"], 2);
  const Json report = Json::parse(support::readText(folder_ / "r.json"));
  const Json& details = report["steps"][1]["details"];
  EXPECT_NEAR(details["vdw_volume"].get<double>(), volume, 1e-9);
  EXPECT_EQ(details["cavities"], 0);
  // The probe does not enter the neck, so its volume is larger. A chlorine ion stays a ball.
  const Json excluded = json("read a.pdb ! molecule-surface --voxel 0.1 ! measure --json");
  EXPECT_GT(excluded["volume"].get<double>(), volume + 1);
  const Json grown =
      json("read a.pdb ! molecule-surface --kind accessible --voxel 0.2 ! measure --json");
  EXPECT_GT(grown["volume"].get<double>(), 300);
}

TEST_F(MoleculeActions, AreasAreWrittenByAtomAndResidue) {
  ASSERT_EQ(
      levelsmith("read a.pdb ! molecule-surface --voxel 0.5 --areas a.csv --residue-areas r.csv")
          .code,
      0);
  const double pi = std::numbers::pi;
  std::istringstream atoms(support::readText(folder_ / "a.csv"));
  std::string line;
  std::getline(atoms, line);
  EXPECT_EQ(line, "chain,residue,number,atom,element,x,y,z,area");
  std::getline(atoms, line);
  EXPECT_EQ(line.substr(0, 24), "A,GLY,7,CA,C,-1.5,0,0,89") << line;
  // A sphere of 3.1 Å without a cap of the height 1.6.
  EXPECT_NEAR(std::stod(line.substr(line.rfind(',') + 1)), 2 * pi * 3.1 * (6.2 - 1.6), 1e-3);
  std::istringstream residues(support::readText(folder_ / "r.csv"));
  std::getline(residues, line);
  EXPECT_EQ(line, "chain,residue,number,area");
  std::getline(residues, line);
  EXPECT_NEAR(std::stod(line.substr(line.rfind(',') + 1)), 4 * pi * 3.1 * (6.2 - 1.6), 1e-3);
  std::getline(residues, line);
  EXPECT_NEAR(std::stod(line.substr(line.rfind(',') + 1)), 4 * pi * 3.15 * 3.15, 1e-3);
}

TEST_F(MoleculeActions, VolumesAndCavitiesAreWritten) {
  ASSERT_EQ(levelsmith("--report r.json read a.pdb ! molecule-surface --kind vdw --voxel 0.4 "
                       "--volumes v.csv --residue-volumes rv.csv --cavities c.csv")
                .code,
            0);
  const Json report = Json::parse(support::readText(folder_ / "r.json"));
  double sum = 0;
  std::istringstream atoms(support::readText(folder_ / "v.csv"));
  std::string line;
  std::getline(atoms, line);
  EXPECT_EQ(line, "chain,residue,number,atom,element,x,y,z,volume");
  while (std::getline(atoms, line)) sum += std::stod(line.substr(line.rfind(',') + 1));
  EXPECT_NEAR(sum, report["steps"][1]["details"]["vdw_volume"].get<double>(), 3e-4);
  EXPECT_EQ(report["steps"][1]["details"]["cavity_list"], Json::array());
  EXPECT_EQ(support::readText(folder_ / "c.csv"), "cavity,volume,area,atoms\n");
  std::istringstream residues(support::readText(folder_ / "rv.csv"));
  std::getline(residues, line);
  EXPECT_EQ(line, "chain,residue,number,volume");
}

TEST_F(MoleculeActions, MoleculeModelMakesBallsAndSticks) {
  writeFile("b.pdb",
            "ATOM      1  C1  LIG A   1       0.000   0.000   0.000  1.00  5.00           C\n"
            "ATOM      2  C2  LIG A   1       1.500   0.000   0.000  1.00  5.00           C\n"
            "ATOM      3  C3  LIG A   1       5.500   0.000   0.000  1.00  5.00           C\n"
            "CONECT    2    3\n");
  const auto components = [&](const std::string& options) {
    const std::string voxel = options.find("voxel") == std::string::npos ? " --voxel 0.05 " : " ";
    return json("read b.pdb ! molecule-model" + voxel + options +
                " ! measure --json")["components"];
  };
  EXPECT_EQ(components(""), 1);
  EXPECT_EQ(components("--file-bonds"), 2);
  EXPECT_EQ(components("--style balls"), 3);
  EXPECT_EQ(components("--style van-der-waals --voxel 0.2"), 2);
  EXPECT_EQ(json("read b.pdb ! info --json")["file_bonds"], 1);
  ASSERT_EQ(
      levelsmith("--report r.json read b.pdb ! molecule-model --style sticks --voxel 0.05").code,
      0);
  const Json details = Json::parse(support::readText(folder_ / "r.json"))["steps"][1]["details"];
  EXPECT_EQ(details, (Json{{"balls", 3}, {"bonds", 2}}));
  expectRefusal("read b.pdb ! molecule-model", 2, "voxel");
  expectRefusal("read b.pdb ! molecule-model --voxel 0.1 --ball-scale 2", 2, "scale");
  expectRefusal("read b.pdb ! molecule-model --voxel 0.1 --style balls --stick-radius 1", 2,
                "--stick-radius");
}

TEST_F(MoleculeActions, OtherActionsRefuseMolecules) {
  expectRefusal("read a.pdb ! measure", 2, "molecule");
  expectRefusal("read a.pdb ! write b.ply", 2, "molecule-surface");
  expectRefusal("read a.pdb ! molecule-surface", 2, "voxel");
  expectRefusal("read a.pdb ! molecule-surface --voxel 0.5 --probe 0", 2, "probe");
  expectRefusal("read a.pdb ! molecule-surface --kind vdw --probe 1 --voxel 0.5", 2, "--probe");
  expectRefusal("read a.pdb --points ! info", 2, "--points");
  expectRefusal("read a.pdb --model 2 ! info", 3, "model 2");
  writeFile("b.pdb", "ATOM      1  CA  GLY A   7      -1.5x0   0.000   0.000\n");
  expectRefusal("read b.pdb ! info", 3, "line 1");
  writeFile("c.ply", "ply\n");
  expectRefusal("read c.ply --solvent ! info", 2, "--solvent");
}

}  // namespace molecule_actions_test
