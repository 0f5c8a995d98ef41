#include "levelset/molecules/bonds.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <string>

#include "levelset/error.h"
#include "levelset/molecules/molecule_file.h"
#include "tests/support/files.h"
#include "tests/support/threads.h"

namespace bonds_test {

using Imath::V3d;
using levelset::Bond;
using levelset::InvalidInput;
using levelset::Molecule;
using levelset::moleculeBonds;
using support::refusal;

struct Place {
  int element;
  V3d at;
  char alternate = 0;
};

Molecule moleculeOf(const std::vector<Place>& places) {
  Molecule molecule{.residues = {{"UNK", 1, "", 0}}, .chains = {"A"}};
  for (const auto& [element, at, alternate] : places)
    molecule.atoms.push_back(
        {.position = at, .element = static_cast<std::uint8_t>(element), .alternate = alternate});
  return molecule;
}

/// Bonds as pairs of indices.
std::vector<std::array<unsigned, 2>> bondsOf(const Molecule& molecule) {
  std::vector<std::array<unsigned, 2>> pairs;
  for (const auto& [first, second] : moleculeBonds(molecule)) pairs.push_back({first, second});
  return pairs;
}

using Pairs = std::vector<std::array<unsigned, 2>>;

/// Points on a circle in the xy plane.
V3d onCircle(double radius, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  return {radius * std::cos(angle), radius * std::sin(angle), 0};
}

Molecule readText(const std::string& text, const std::string& extension,
                  std::vector<std::string>* notes = nullptr) {
  const support::TemporaryFolder folder;
  const auto path = folder / ("molecule." + extension);
  std::ofstream(path, std::ios::binary) << text;
  return levelset::readMolecule(path, {.notes = notes});
}

TEST(Bonds, OfSmallMoleculesAreTheKnownOnes) {
  // Water beside water, with a hydrogen bond of 1.9 Å.
  EXPECT_EQ(bondsOf(moleculeOf({{8, V3d(0)},
                                {1, onCircle(0.957, 0)},
                                {1, onCircle(0.957, 104.5)},
                                {8, V3d(2.857, 0, 0)},
                                {1, V3d(3.2, 0.9, 0)}})),
            (Pairs{{0, 1}, {0, 2}, {3, 4}}));
  // Benzene: six bonds of 1.39 Å, six of 1.09 Å, and none across.
  std::vector<Place> benzene;
  for (int n = 0; n < 6; ++n) benzene.push_back({6, onCircle(1.39, 60 * n)});
  for (int n = 0; n < 6; ++n) benzene.push_back({1, onCircle(2.48, 60 * n)});
  EXPECT_EQ(bondsOf(moleculeOf(benzene)), (Pairs{{0, 1},
                                                 {0, 5},
                                                 {0, 6},
                                                 {1, 2},
                                                 {1, 7},
                                                 {2, 3},
                                                 {2, 8},
                                                 {3, 4},
                                                 {3, 9},
                                                 {4, 5},
                                                 {4, 10},
                                                 {5, 11}}));
  // A disulfide: C–S 1.81 Å, S–S 2.05 Å.
  EXPECT_EQ(
      bondsOf(moleculeOf(
          {{6, V3d(0)}, {16, V3d(1.81, 0, 0)}, {16, V3d(1.81, 2.05, 0)}, {6, V3d(3.6, 2.1, 0)}})),
      (Pairs{{0, 1}, {1, 2}, {2, 3}}));
  // Zinc between four sulfur atoms at 2.35 Å, and a sodium ion beside oxygen.
  std::vector<Place> zinc = {{30, V3d(0)}};
  for (const V3d& p : {V3d(1, 1, 1), V3d(1, -1, -1), V3d(-1, 1, -1), V3d(-1, -1, 1)})
    zinc.push_back({16, p.normalized() * 2.35});
  zinc.push_back({11, V3d(20, 0, 0)});
  zinc.push_back({8, V3d(22.3, 0, 0)});
  EXPECT_EQ(bondsOf(moleculeOf(zinc)), (Pairs{{0, 1}, {0, 2}, {0, 3}, {0, 4}}));
}

TEST(Bonds, EndAtTheToleranceAndNotBetweenAlternates) {
  const double limit = 2 * 0.76 + 0.45;
  for (const double apart : {0.39, 0.41, limit - 1e-6, limit + 1e-6})
    EXPECT_EQ(bondsOf(moleculeOf({{6, V3d(0)}, {6, V3d(apart, 0, 0)}})).size(),
              apart > 0.4 && apart < limit ? 1u : 0u)
        << apart;
  EXPECT_TRUE(bondsOf(moleculeOf({{6, V3d(0), 'A'}, {6, V3d(1.5, 0, 0), 'B'}})).empty());
  EXPECT_EQ(bondsOf(moleculeOf({{6, V3d(0), 'A'}, {6, V3d(1.5, 0, 0)}})).size(), 1u);
}

TEST(Bonds, GiveAHydrogenAtMostOne) {
  // Between two oxygen atoms, to the nearer one; and to none if the file gives another bond.
  Molecule shared = moleculeOf({{8, V3d(0)}, {1, V3d(1.1, 0, 0)}, {8, V3d(2.25, 0, 0)}});
  EXPECT_EQ(bondsOf(shared), (Pairs{{0, 1}}));
  shared.bonds = {{1, 2}};
  EXPECT_EQ(bondsOf(shared), (Pairs{{1, 2}}));
  // Two hydrogen atoms close to each other, both bonded.
  EXPECT_EQ(bondsOf(moleculeOf(
                {{6, V3d(0)}, {1, V3d(0.98, 0, 0)}, {1, V3d(2.0, 0, 0)}, {6, V3d(2.98, 0, 0)}})),
            (Pairs{{0, 1}, {2, 3}}));
}

TEST(Bonds, AgreeWithASearchOfAllPairs) {
  std::mt19937 random(3);
  for (const double far : {0.0, 1e6}) {
    std::uniform_real_distribution<double> place(-9, 9);
    const int elements[] = {1, 6, 7, 8, 16, 26, 53, 87, 11};
    std::vector<Place> places;
    for (int n = 0; n < 600; ++n)
      places.push_back({elements[random() % 9],
                        V3d(place(random), place(random), place(random)) + V3d(far),
                        random() % 5 ? '\0' : static_cast<char>('A' + random() % 2)});
    const Molecule molecule = moleculeOf(places);
    // All pairs of heavy atoms. Those of hydrogen atoms: the nearest candidate of each.
    const auto isNear = [&](std::size_t a, std::size_t b) {
      const Place &p = places[a], &q = places[b];
      const double apart = (p.at - q.at).length();
      return p.element != 11 && q.element != 11 && apart >= 0.4 &&
             apart <=
                 levelset::covalentRadius(p.element) + levelset::covalentRadius(q.element) + 0.45 &&
             !(p.alternate && q.alternate && p.alternate != q.alternate);
    };
    const auto choice = [&](std::size_t a) {
      std::size_t best = places.size();
      for (std::size_t b = 0; b < places.size(); ++b)
        if (b != a && isNear(a, b) &&
            (best == places.size() ||
             (places[b].at - places[a].at).length() < (places[best].at - places[a].at).length()))
          best = b;
      return best;
    };
    Pairs expected;
    for (std::size_t a = 0; a < places.size(); ++a)
      for (std::size_t b = a + 1; b < places.size(); ++b)
        if (isNear(a, b) && (places[a].element != 1 || choice(a) == b) &&
            (places[b].element != 1 || choice(b) == a))
          expected.push_back({static_cast<unsigned>(a), static_cast<unsigned>(b)});
    EXPECT_GT(expected.size(), 300u);
    EXPECT_EQ(bondsOf(molecule), expected);
    const auto found = [&] { return bondsOf(molecule); };
    EXPECT_EQ(support::onThreads(1, found), support::onThreads(5, found));
  }
}

constexpr const char* kAtoms =
    "ATOM      1  SG  CYS A   1       0.000   0.000   0.000  1.00  5.00           S\n"
    "ATOM      2  SG  CYS A   2       3.500   0.000   0.000  1.00  5.00           S\n"
    "ATOM  A0000  CB ACYS A   2       9.000   0.000   0.000  0.60  5.00           C\n"
    "ATOM  A0001  CB BCYS A   2       9.200   0.000   0.000  0.40  5.00           C\n"
    "HETATM    7 ZN   ZN  B   3      15.000   0.000   0.000  1.00  5.00          ZN\n"
    "HETATM    8  O   HOH B   9      20.000  10.000   0.000  1.00  5.00           O\n";

TEST(Bonds, OfAPdbFileAreReadOnce) {
  std::vector<std::string> notes;
  const Molecule molecule = readText(std::string(kAtoms) +
                                         "CONECT    1    2    2    7\n"
                                         "CONECT    2    1    1\n"
                                         "CONECT    7A0000A0001    8   99\n"
                                         "CONECT*****    1\n"
                                         "END\n",
                                     "pdb", &notes);
  EXPECT_EQ(molecule.bonds, (std::vector<Bond>{{0, 1}, {0, 3}, {2, 3}}));
  EXPECT_EQ(bondsOf(molecule), (Pairs{{0, 1}, {0, 3}, {2, 3}}));
  // The atom B of CB, the water, atom 99, and the stars.
  EXPECT_EQ(std::count(notes.begin(), notes.end(),
                       "4 records of bonds were ignored: one of their atoms is missing, not unique "
                       "or left out"),
            1);
}

TEST(Bonds, OfSerialNumbersThatReturnAreLeftOut) {
  const auto atom = [](const char* serial, double x) {
    return fmt::format("ATOM  {:>5}  C   UNK A   1    {:8.3f}   0.000   0.000\n", serial, x);
  };
  const std::string records = "CONECT    1    2\nCONECT    2    3\n";
  EXPECT_EQ(
      readText(atom("1", 0) + atom("2", 5) + atom("3", 9) + atom("1", 12) + records, "pdb").bonds,
      (std::vector<Bond>{{1, 2}}));
  EXPECT_TRUE(
      readText(atom("*****", 0) + atom("*****", 5) + "CONECT**********\n", "pdb").bonds.empty());
  // Six digits.
  const Molecule large = readText("ATOM  100000 C   UNK A   1       0.000   0.000   0.000\n" +
                                      atom("10000", 5) + atom("3", 9) + "CONECT10000    3\n",
                                  "pdb");
  EXPECT_EQ(large.bonds, (std::vector<Bond>{{1, 2}}));
}

TEST(Bonds, OfSixDigitsHaveSixColumns) {
  const auto atom = [](int serial, double x) {
    return fmt::format("ATOM  {:>6}C    UNK A   1    {:8.3f}   0.000   0.000\n", serial, x);
  };
  const std::string atoms =
      atom(10000, 0) + atom(11000, 5) + atom(100001, 10) + atom(100002, 15) + atom(99999, 20);
  const auto bonds = [&](const std::string& record, std::vector<std::string>* notes = nullptr) {
    return readText(atoms + record + "\n", "pdb", notes).bonds;
  };
  EXPECT_EQ(bonds("CONECT100001100002"), (std::vector<Bond>{{2, 3}}));
  EXPECT_EQ(bonds("CONECT100001100002 99999   "), (std::vector<Bond>{{2, 3}, {2, 4}}));
  EXPECT_EQ(bonds("CONECT1000011000"), (std::vector<Bond>{{0, 1}}));
  // Thirty digits are five numbers of six digits or six of five.
  std::vector<std::string> notes;
  EXPECT_TRUE(bonds("CONECT100001100002100002100002100002", &notes).empty());
  EXPECT_EQ(std::count(notes.begin(), notes.end(),
                       "1 records of bonds were ignored: one of their atoms is missing, not unique "
                       "or left out"),
            1);
}

constexpr const char* kCifAtoms =
    "loop_\n_atom_site.group_PDB\n_atom_site.type_symbol\n_atom_site.label_atom_id\n"
    "_atom_site.label_alt_id\n_atom_site.label_comp_id\n_atom_site.auth_asym_id\n"
    "_atom_site.auth_seq_id\n_atom_site.pdbx_PDB_ins_code\n"
    "_atom_site.Cartn_x\n_atom_site.Cartn_y\n_atom_site.Cartn_z\n"
    "ATOM S SG . CYS A 1 ? 0 0 0\n"
    "ATOM C CB . CYS A 1 ? 9 0 0\n"
    "ATOM S SG . CYS A 2 B 20 0 0\n"
    "ATOM C CB . CYS A 2 B 29 0 0\n"
    "HETATM ZN ZN . ZN B 3 ? 40 0 0\n";

constexpr const char* kConnections =
    "loop_\n_struct_conn.id\n_struct_conn.conn_type_id\n_struct_conn.ptnr1_auth_asym_id\n"
    "_struct_conn.ptnr1_auth_comp_id\n_struct_conn.ptnr1_auth_seq_id\n"
    "_struct_conn.pdbx_ptnr1_PDB_ins_code\n_struct_conn.ptnr1_label_atom_id\n"
    "_struct_conn.ptnr1_symmetry\n_struct_conn.ptnr2_auth_asym_id\n"
    "_struct_conn.ptnr2_auth_comp_id\n_struct_conn.ptnr2_auth_seq_id\n"
    "_struct_conn.pdbx_ptnr2_PDB_ins_code\n_struct_conn.ptnr2_label_atom_id\n"
    "_struct_conn.ptnr2_symmetry\n"
    "d1 disulf A CYS 1 ? SG 1_555 A CYS 2 B SG 1_555\n"
    "m1 metalc A CYS 1 ? SG 1_555 B ZN 3 ? ZN 1_555\n"
    "m2 metalc A CYS 2 B SG 1_555 B ZN 3 ? ZN 2_655\n"
    "h1 hydrog A CYS 1 ? CB 1_555 B ZN 3 ? ZN 1_555\n"
    "c1 covale A CYS 1 ? CB 1_555 A GLY 8 ? N 1_555\n";

TEST(Bonds, OfACifFileAreReadBeforeAndAfterTheAtoms) {
  const std::string component =
      "loop_\n_chem_comp_bond.comp_id\n_chem_comp_bond.atom_id_1\n_chem_comp_bond.atom_id_2\n"
      "CYS CB SG\nCYS SG HG\nGLY N CA\n";
  const std::vector<Bond> expected = {{0, 1}, {0, 2}, {0, 4}, {2, 3}};
  std::vector<std::string> notes;
  EXPECT_EQ(readText("data_x\n" + component + kConnections + kCifAtoms, "cif").bonds, expected);
  EXPECT_EQ(readText(std::string("data_x\n") + kCifAtoms + kConnections + component + "data_y\n" +
                         kConnections + "loop_\n_a.b\n'open\n",
                     "cif", &notes)
                .bonds,
            expected);
  EXPECT_EQ(notes, (std::vector<std::string>{
                       "1 records of bonds were ignored: one of their atoms is missing, not unique "
                       "or left out"}));
  // A single bond without a loop, and bonds of a block without atoms.
  EXPECT_EQ(readText(std::string("data_a\n") + kConnections + "data_x\n" + kCifAtoms +
                         "_chem_comp_bond.comp_id CYS\n_chem_comp_bond.atom_id_1 SG\n"
                         "_chem_comp_bond.atom_id_2 CB\n",
                     "cif")
                .bonds,
            (std::vector<Bond>{{0, 1}, {2, 3}}));
}

TEST(Bonds, Refuse) {
  EXPECT_SAYS(refusal<InvalidInput>([] {
                (void)moleculeBonds(moleculeOf({{6, V3d(NAN, 0, 0)}}));
              }),
              "finite");
  EXPECT_SAYS(refusal<InvalidInput>([] {
                (void)moleculeBonds(moleculeOf(std::vector<Place>(20'001, Place{6, V3d(1)})));
              }),
              "in ångström");
  const std::string broken = std::string("data_x\n") + kCifAtoms +
                             "loop_\n_chem_comp_bond.comp_id\n_chem_comp_bond.atom_id_1\nCYS\n";
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)readText(broken, "cif"); }), "truncated");
}

}  // namespace bonds_test
