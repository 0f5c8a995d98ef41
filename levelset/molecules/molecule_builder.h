#pragma once

// Private to the readers of molecules: collects atoms, and checks them.

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "levelset/molecules/molecule.h"
#include "levelset/molecules/molecule_file.h"

namespace levelset::molecules {

/// Atom as a file has it.
struct AtomRecord {
  std::string_view name, alternate, residue, chain, insertion, element;
  int number = 0;  ///< number of the residue
  Imath::V3d position{0};
  double occupancy = 1, bFactor = 0;
  bool isHetero = false;
  bool isElementGuessed = false;  ///< the element follows from the name
};

class MoleculeBuilder {
 public:
  MoleculeBuilder(std::string file, const ReadMoleculeOptions& options);

  [[nodiscard]] const std::string& file() const { return file_; }
  /// Begins a model. @return false if its atoms are not wanted
  bool beginModel(int number);
  /// Ends a chain: the next atom begins a residue, even if that has the key of an earlier one.
  void endChain();
  /// Adds an atom of a wanted model. @param line  for messages
  void add(const AtomRecord& record, std::size_t line);
  /// @throws InvalidInput without atoms, or if the model is missing
  [[nodiscard]] Molecule finish();
  /// @throws InvalidInput: "'x.pdb', line 12: <what>"
  [[noreturn]] void fail(std::size_t line, const std::string& what) const;
  /// Reads a number. @throws InvalidInput if the text is none, or outside ±1e8
  [[nodiscard]] double number(std::string_view text, const char* what, std::size_t line) const;
  [[nodiscard]] int integer(std::string_view text, const char* what, std::size_t line) const;

 private:
  std::string file_;
  const ReadMoleculeOptions& options_;
  Molecule molecule_;
  /// Removes all but one of several residues at one place of a chain: that of the largest
  /// occupancy.
  void chooseResidues();

  std::unordered_map<std::string, std::uint32_t> chains_;
  /// Residues by chain, number, insertion code and name. Numbers may be used again after others.
  std::unordered_map<std::string, std::uint32_t> residues_;
  std::string last_ = {};  ///< key of the residue of the last atom
  /// Atoms with alternate locations, by residue and name.
  std::unordered_map<std::string, std::size_t> alternates_;
  /// Residues of alternate locations, by chain, number and insertion code.
  std::map<std::string, std::vector<std::uint32_t>> places_;
  int model_ = 0;  ///< the wanted one; 0: not known yet
  bool hasModel_ = false;
  std::size_t dropped_ = 0, water_ = 0, hydrogens_ = 0, unknown_ = 0, guessed_ = 0;
};

/// Removes blanks at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);

void readPdb(std::string_view text, MoleculeBuilder& builder);
void readCif(std::string_view text, MoleculeBuilder& builder);

}  // namespace levelset::molecules
