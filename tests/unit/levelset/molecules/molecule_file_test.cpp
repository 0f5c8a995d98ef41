#include "levelset/molecules/molecule_file.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>
#include <string>

#include "levelset/error.h"
#include "levelset/molecules/molecule_builder.h"
#include "levelset/molecules/molecule_model.h"
#include "tests/support/files.h"

namespace molecule_file_test {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::Molecule;
using levelset::readMolecule;
using levelset::ReadMoleculeOptions;
using support::refusal;
using support::TemporaryFolder;

constexpr const char* kPdb =
    "HEADER    TEST\n"
    "ATOM      1  N   ALA A   1      11.104   6.134  -6.504  1.00 10.00           N  \n"
    "ATOM      2  CA AALA A   1      11.639   6.071  -5.147  0.40 11.50           C  \n"
    "ATOM      3  CA BALA A   1      11.700   6.100  -5.200  0.60 12.50           C  \n"
    "ATOM      4  HB1 ALA A   1      12.000   7.000  -5.000  1.00 10.00\n"
    "ATOM      5  N   GLY A   2A     13.559   6.000  -4.000\r\n"
    "TER\n"
    "HETATM    6 CA    CA B 101       1.000   2.000   3.000  1.00 20.00          CA2+\n"
    "HETATM    7  O   HOH B 201       4.000   5.000   6.000  1.00 30.00           O  \n"
    "END\n"
    "ATOM      8  N   ALA A   9      broken\n";

constexpr const char* kCif =
    "data_TEST\n"
    "# a comment with 'a quote\n"
    "_entry.id TEST\n"
    "loop_\n_entity.id\n_entity.details\n1 'it''s one' 2\n;text\nloop_\n;\n"
    "loop_\n"
    "_atom_site.group_PDB\n_atom_site.type_symbol\n_atom_site.label_atom_id\n"
    "_atom_site.label_alt_id\n_atom_site.label_comp_id\n_atom_site.label_asym_id\n"
    "_atom_site.auth_asym_id\n_atom_site.auth_seq_id\n_atom_site.pdbx_PDB_ins_code\n"
    "_atom_site.Cartn_x\n_atom_site.Cartn_y\n_atom_site.Cartn_z\n_atom_site.occupancy\n"
    "_atom_site.B_iso_or_equiv\n_atom_site.pdbx_PDB_model_num\n"
    "ATOM N N . ALA A A 1 ? 11.104 6.134 -6.504 1.0 10.0 1\n"
    "ATOM C CA A ALA A A 1 ? 11.639 6.071 -5.147 0.4 11.5 1\n"
    "ATOM C CA B ALA A A 1 ? 11.700 6.100 -5.200 0.6 12.5 1\n"
    "ATOM H \"HB1\" . ALA A A 1 ? 12.0 7.0 -5.0 1 10 1\n"
    "ATOM N N . GLY A A 2 A 13.559 6 -4 . . 1\n"
    "HETATM CA CA . CA B B 101 ? 1 2 3 1 20 1\n"
    "HETATM O O . HOH C B 201 ? 4 5 6 1 30 1\n"
    "ATOM N N . ALA A A 1 ? 0 0 0 1 10 2\n"
    "_other.item 5\n";

/// Reads a text as a file of a format.
Molecule molecule(const std::string& text, const std::string& extension,
                  ReadMoleculeOptions options = {}) {
  const TemporaryFolder folder;
  const auto path = folder / ("molecule." + extension);
  std::ofstream(path, std::ios::binary) << text;
  return readMolecule(path, options);
}

void expectTheTest(const Molecule& read) {
  ASSERT_EQ(read.atoms.size(), 5u);
  ASSERT_EQ(read.residues.size(), 3u);
  EXPECT_EQ(read.chains, (std::vector<std::string>{"A", "B"}));
  EXPECT_EQ(read.residueName(0), "A/ALA 1");
  EXPECT_EQ(read.residueName(1), "A/GLY 2A");
  EXPECT_EQ(read.residueName(2), "B/CA 101");
  EXPECT_EQ(read.atoms[0].position, V3d(11.104, 6.134, -6.504));
  EXPECT_EQ(read.atoms[1].position, V3d(11.7, 6.1, -5.2));  // the larger occupancy
  EXPECT_EQ(read.atoms[1].bFactor, 12.5f);
  const int elements[] = {7, 6, 1, 7, 20};
  for (std::size_t n = 0; n < 5; ++n) EXPECT_EQ(read.atoms[n].element, elements[n]) << n;
  EXPECT_EQ(read.atoms[4].name, "CA");
  EXPECT_TRUE(read.atoms[4].isHetero);
  EXPECT_EQ(read.atoms[3].occupancy, 1.0f);
}

TEST(MoleculeFile, ReadsPdbAndCif) {
  std::vector<std::string> notes;
  expectTheTest(molecule(kPdb, "pdb", {.notes = &notes}));
  EXPECT_EQ(notes.size(), 3u);
  expectTheTest(molecule(kCif, "cif"));
  EXPECT_EQ(molecule(kPdb, "ent", {.solvent = true}).atoms.size(), 6u);
  EXPECT_EQ(molecule(kCif, "mmcif", {.hydrogens = false}).atoms.size(), 4u);
}

TEST(MoleculeFile, ReadsOneModel) {
  EXPECT_EQ(molecule(kCif, "cif", {.model = 2}).atoms.size(), 1u);
  const std::string models =
      "MODEL        3\n"
      "ATOM      1  C   UNK A   1       1.000   0.000   0.000\nENDMDL\n"
      "MODEL        4\n"
      "ATOM      1  C   UNK A   1       2.000   0.000   0.000\n"
      "ATOM      2  C2  UNK A   1       3.000   0.000   0.000\nENDMDL\nEND\n";
  EXPECT_EQ(molecule(models, "pdb").atoms.size(), 1u);
  EXPECT_EQ(molecule(models, "pdb", {.model = 4}).atoms.size(), 2u);
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)molecule(models, "pdb", {.model = 1}); }),
              "no model 1");
}

TEST(MoleculeFile, ChoosesOneOfTheResiduesAtAPlace) {
  // Alternate locations in turns, as of residue 22 of crambin.
  const std::string text =
      "ATOM      1  N  APRO A  22       0.000   0.000   0.000  0.60  5.00           N\n"
      "ATOM      2  N  BSER A  22       0.100   0.000   0.000  0.40  5.00           N\n"
      "ATOM      3  CA APRO A  22       1.500   0.000   0.000  0.60  5.00           C\n"
      "ATOM      4  CA BSER A  22       1.600   0.000   0.000  0.40  5.00           C\n"
      "ATOM      5  OG BSER A  22       2.600   0.000   0.000  0.40  5.00           O\n"
      "ATOM      6  N   GLU A  23       4.000   0.000   0.000  1.00  5.00           N\n";
  const Molecule read = molecule(text, "pdb");
  ASSERT_EQ(read.atoms.size(), 3u);
  ASSERT_EQ(read.residues.size(), 2u);
  EXPECT_EQ(read.residueName(0), "A/PRO 22");
  EXPECT_EQ(read.residueName(read.atoms[2].residue), "A/GLU 23");
}

TEST(MoleculeFile, KeepsResiduesApartWhoseNumbersReturn) {
  const auto line = [](const char* number) {
    return "ATOM      1  O   SOD A" + std::string(number) + "       1.000   0.000   0.000\n";
  };
  const Molecule read = molecule(line("9999") + line("   0") + line("9999") + "TER\n" +
                                     line("9999") + line("A000") + line("a001"),
                                 "pdb");
  ASSERT_EQ(read.residues.size(), 6u);
  EXPECT_EQ(read.residues[4].number, 10'000);
  EXPECT_EQ(read.residues[5].number, 1'223'057);
}

TEST(MoleculeFile, ReadsOneAtomWithoutALoop) {
  const Molecule read = molecule(
      "data_x\n_atom_site.type_symbol Cl\n_atom_site.Cartn_x 1\n_atom_site.Cartn_y 2\n"
      "_atom_site.Cartn_z 3\n",
      "cif");
  ASSERT_EQ(read.atoms.size(), 1u);
  EXPECT_EQ(read.atoms[0].position, V3d(1, 2, 3));
}

TEST(MoleculeFile, FindsElementsByTheirColumns) {
  const auto element = [](const std::string& name) {
    return int{molecule("ATOM      1 " + name + " UNK A   1       1.000   0.000   0.000\n", "pdb")
                   .atoms[0]
                   .element};
  };
  EXPECT_EQ(element(" CA "), 6);
  EXPECT_EQ(element("CA  "), 6);
  EXPECT_EQ(element("ZN  "), 30);
  EXPECT_EQ(element("FE  "), 26);
  EXPECT_EQ(element("1HB "), 1);
  EXPECT_EQ(element("HE21"), 1);
  EXPECT_EQ(element(" OXT"), 8);
}

TEST(MoleculeFile, RefusesDamage) {
  const auto says = [](const std::string& text, const char* extension = "pdb") {
    return refusal<InvalidInput>([&] { (void)molecule(text, extension); });
  };
  EXPECT_SAYS(says("nothing\n"), "no atoms");
  EXPECT_SAYS(says("ATOM      1  N   ALA A   1      11.104   6.134"), "column 54");
  EXPECT_SAYS(says("ATOM      1  N   ALA A   1      11.1o4   6.134  -6.504\n"), "columns 31 to 38");
  EXPECT_SAYS(says("ATOM      1  N   ALA A   1         nan   6.134  -6.504\n"), "line 1");
  EXPECT_SAYS(says("\nATOM      1  N   ALA A   x      11.104   6.134  -6.504\n"), "line 2");
  EXPECT_SAYS(says("HETATM    7  O   HOH B 201       4.000   5.000   6.000\n"), "water");
  EXPECT_SAYS(says(std::string("ATOM\0x\n", 7)), "byte 0");
  const std::string cif = kCif;
  EXPECT_SAYS(says(cif.substr(0, cif.find("GLY")), "cif"), "truncated");
  EXPECT_SAYS(says("data_x\nloop_\n_atom_site.Cartn_x\n1 2\n", "cif"), "coordinate");
  EXPECT_SAYS(says("data_x\nloop_\n_entity.id\n'open\n", "cif"), "quote");
  EXPECT_SAYS(says("data_x\n;open\n", "cif"), "does not end");
  EXPECT_SAYS(says("data_x\nloop_\n_a.b\n", "cif"), "no atoms");
  EXPECT_SAYS(says("data_x\nloop_\n_atom_site_label\n_atom_site_fract_x\nC 0.1\n", "cif"),
              "fractional");
  EXPECT_FALSE(refusal<levelset::UsageError>([] { (void)molecule(kPdb, "xyz"); }).empty());
}

// Bonds, for mutations.
constexpr const char* kPdbBonds =
    "CONECT    1    2    4    5\nCONECT    2    1\nCONECT    6A0000    7*****\nEND\n";
constexpr const char* kCifBonds =
    "loop_\n_struct_conn.conn_type_id\n_struct_conn.ptnr1_auth_asym_id\n"
    "_struct_conn.ptnr1_auth_comp_id\n_struct_conn.ptnr1_auth_seq_id\n"
    "_struct_conn.ptnr1_label_atom_id\n_struct_conn.ptnr2_auth_asym_id\n"
    "_struct_conn.ptnr2_auth_comp_id\n_struct_conn.ptnr2_auth_seq_id\n"
    "_struct_conn.ptnr2_label_atom_id\ncovale A ALA 1 N B CA 101 CA\n"
    "loop_\n_chem_comp_bond.comp_id\n_chem_comp_bond.atom_id_1\n_chem_comp_bond.atom_id_2\n"
    "ALA N CA\nALA CA HB1\n";

/// Changes a text in one or two places.
void mutate(std::string& text, std::mt19937& random) {
  for (unsigned change = random() % 2 + 1; change > 0; --change) {
    const std::size_t at = random() % text.size();
    switch (random() % 6) {
      case 0:
        text[at] = static_cast<char>(random());
        break;
      case 1:
        text.erase(at, random() % 20);
        break;
      case 2:
        text.insert(at, text.substr(random() % text.size(), random() % 80));
        break;
      case 3:  // columns move
        text.insert(at, random() % 3 + 1, ' ');
        break;
      case 4: {  // no atoms
        for (const char* word : {"ATOM", "HETATM"})
          for (std::size_t n = 0; (n = text.find(word, n)) != std::string::npos; ++n)
            text[n] = random() % 4 ? 'X' : text[n];
        break;
      }
      default:
        text.resize(at + 1);
    }
  }
}

/// An mmCIF file with many atoms at one place, and as many bonds of all kinds between them.
/// @param residues  number of residues at the place, in turns
std::string crowdedCif(int count, int residues) {
  std::string text =
      "data_x\nloop_\n_atom_site.type_symbol\n_atom_site.label_atom_id\n"
      "_atom_site.label_comp_id\n_atom_site.label_alt_id\n_atom_site.auth_seq_id\n"
      "_atom_site.Cartn_x\n_atom_site.Cartn_y\n_atom_site.Cartn_z\n";
  for (int n = 0; n < count; ++n)
    text += fmt::format("C A{} R{} {} 1 {} 0 0\n", n, n % residues, residues > 1 ? "A" : ".", n);
  text += "loop_\n_chem_comp_bond.comp_id\n_chem_comp_bond.atom_id_1\n_chem_comp_bond.atom_id_2\n";
  for (int n = 1; n < count; ++n) text += fmt::format("R0 A{} A{}\n", n - 1, n);
  text +=
      "loop_\n_struct_conn.ptnr1_auth_comp_id\n_struct_conn.ptnr1_auth_seq_id\n"
      "_struct_conn.ptnr1_label_atom_id\n_struct_conn.ptnr2_auth_comp_id\n"
      "_struct_conn.ptnr2_auth_seq_id\n_struct_conn.ptnr2_label_atom_id\n";
  for (int n = 2; n < count; ++n) text += fmt::format("R0 1 A{} R0 1 A{}\n", n - 2, n);
  return text;
}

TEST(MoleculeFile, FindsTheBondsOfACrowdInLinearTime) {
  const auto stepsFor = [](int count, int residues) {
    const ReadMoleculeOptions options;
    const std::string text = crowdedCif(count, residues);  // the names of atoms refer to it
    levelset::molecules::MoleculeBuilder builder("x.cif", options);
    levelset::molecules::readCif(text, builder);
    const Molecule read = builder.finish();
    if (residues == 1) {
      EXPECT_EQ(read.atoms.size(), static_cast<std::size_t>(count));
      EXPECT_EQ(read.bonds.size(), static_cast<std::size_t>(2 * count - 3));
    } else {
      EXPECT_EQ(read.residues.size(), 1U);
    }
    return builder.steps();
  };
  EXPECT_LE(stepsFor(4000, 1), 4 * stepsFor(1000, 1) + 16);
  EXPECT_LE(stepsFor(4000, 4000), 4 * stepsFor(1000, 1000) + 16);
  EXPECT_GT(stepsFor(1000, 1), 3000U);
}

TEST(MoleculeFile, RefusesAnAtomWithTooManyBonds) {
  std::string text = crowdedCif(70, 1);
  text += "loop_\n_chem_comp_bond.comp_id\n_chem_comp_bond.atom_id_1\n_chem_comp_bond.atom_id_2\n";
  for (int n = 1; n < 65; ++n) text += fmt::format("R0 A0 A{}\n", n);
  EXPECT_EQ(molecule(text, "cif").bonds.size(), 2 * 70U - 3 + 62);
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)molecule(text + "R0 A0 A65\n", "cif"); }),
              "more than 64 atoms");
}

TEST(MoleculeFile, SurvivesThreeHundredMutationsWithBonds) {
  std::mt19937 random(2);
  int read = 0, refused = 0;
  for (int n = 0; n < 300; ++n) {
    const bool isCif = n % 2;
    std::string text = kPdb;
    text = isCif ? std::string(kCif) + kCifBonds : text.substr(0, text.find("END\n")) + kPdbBonds;
    mutate(text, random);
    try {
      const Molecule result = molecule(text, isCif ? "cif" : "pdb");
      ASSERT_FALSE(result.atoms.empty());
      for (const levelset::Atom& atom : result.atoms) {
        ASSERT_LT(atom.residue, result.residues.size());
        ASSERT_LT(result.residues[atom.residue].chain, result.chains.size());
        EXPECT_TRUE(std::isfinite(atom.position.length()));
      }
      for (const auto& [first, second] : result.bonds) {
        EXPECT_LT(first, second);
        ASSERT_LT(second, result.atoms.size());
      }
      const levelset::MoleculeModel model = levelset::moleculeModel(result);
      EXPECT_EQ(model.balls.size(), result.atoms.size());
      EXPECT_GE(model.sticks.size(), 2 * result.bonds.size());
      ++read;
    } catch (const levelset::Error& error) {
      // A sentence that names the file.
      EXPECT_NE(std::string(error.what()).find("molecule."), std::string::npos) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(read, 100);
  EXPECT_GT(refused, 60);
}

TEST(MoleculeFile, SurvivesThreeHundredMutations) {
  std::mt19937 random(1);
  int read = 0, refused = 0;
  for (int n = 0; n < 300; ++n) {
    const bool isCif = n % 2;
    std::string text = isCif ? kCif : kPdb;
    for (unsigned change = random() % 2 + 1; change > 0; --change) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, random() % 20);
          break;
        case 2:
          text.insert(at, text.substr(random() % text.size(), random() % 80));
          break;
        default:
          text.resize(at + 1);
      }
    }
    try {
      const Molecule result = molecule(text, isCif ? "cif" : "pdb");
      for (const levelset::Atom& atom : result.atoms) {
        EXPECT_LT(atom.residue, result.residues.size());
        EXPECT_LE(std::abs(atom.position.x), 1e8);
      }
      ++read;
    } catch (const levelset::Error&) {
      ++refused;
    }
  }
  EXPECT_GT(read, 50);
  EXPECT_GT(refused, 50);
}

}  // namespace molecule_file_test
