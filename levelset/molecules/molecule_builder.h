#pragma once

// Private to the readers of molecules: collects atoms, and checks them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "levelset/molecules/molecule.h"
#include "levelset/molecules/molecule_file.h"

namespace levelset::molecules {

/// Atom as a file has it.
struct AtomRecord {
  std::int64_t serial = -1;  ///< number that other records use; -1: none
  std::string_view name, alternate, residue, chain, insertion, element;
  int number = 0;  ///< number of the residue
  Imath::V3d position{0};
  double occupancy = 1, bFactor = 0;
  bool isHetero = false;
  bool isElementGuessed = false;  ///< the element follows from the name
};

/// Place of an atom in a record of a bond.
struct AtomPlace {
  std::string_view chain, residue, insertion, atom, alternate;
  int number = 0;  ///< number of the residue
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
  /// Adds a bond between two atoms by their serial numbers.
  void addBond(std::int64_t first, std::int64_t second) { serialBonds_.push_back({first, second}); }
  /// Adds a bond between two atoms by their places.
  void addBond(const AtomPlace& first, const AtomPlace& second) {
    placeBonds_.push_back({first, second});
  }
  /// Adds a bond to each residue of a name. @param residue, first, second  outlive the builder
  /// @throws InvalidInput if an atom has more than kMostPartners of them
  void addResidueBond(std::string_view residue, std::string_view first, std::string_view second,
                      std::size_t line);
  static constexpr std::size_t kMostPartners = 64;
  /// Removes the bonds of a part of the file that has no atoms.
  void removeBonds();
  /// @throws InvalidInput without atoms, or if the model is missing
  [[nodiscard]] Molecule finish();
  /// @throws InvalidInput: "'x.pdb', line 12: <what>"
  [[noreturn]] void fail(std::size_t line, const std::string& what) const;
  /// Reads a number. @throws InvalidInput if the text is none, or outside ±1e8
  [[nodiscard]] double number(std::string_view text, const char* what, std::size_t line) const;
  [[nodiscard]] int integer(std::string_view text, const char* what, std::size_t line) const;
  /// Number of atoms and ends of bonds that finish() visited to choose residues and to find the
  /// atoms of bonds. It grows linearly with the file, whatever that has.
  [[nodiscard]] std::size_t steps() const { return steps_; }

 private:
  std::string file_;
  const ReadMoleculeOptions& options_;
  Molecule molecule_;
  /// Removes all but one of several residues at one place of a chain: that of the largest
  /// occupancy.
  void chooseResidues();
  /// Finds the atoms of the bonds that the file gives.
  void resolveBonds();
  void resolveSerialBonds();
  void resolvePlaceBonds();
  void resolveResidueBonds();
  void keepBond(std::size_t first, std::size_t second);

  std::unordered_map<std::string, std::uint32_t> chains_;
  /// Residues by chain, number, insertion code and name. Numbers may be used again after others.
  std::unordered_map<std::string, std::uint32_t> residues_;
  std::string last_ = {};  ///< key of the residue of the last atom
  /// Atoms with alternate locations, by residue and name.
  std::unordered_map<std::string, std::size_t> alternates_;
  /// Residues of alternate locations, by chain, number and insertion code.
  std::map<std::string, std::vector<std::uint32_t>> places_;
  std::vector<char> isAtPlace_;        ///< by residue: true if places_ has it
  std::vector<std::int64_t> serials_;  ///< by atom
  std::vector<std::array<std::int64_t, 2>> serialBonds_;
  std::vector<std::array<AtomPlace, 2>> placeBonds_;
  /// Names of the second atoms by those of the residue and of the first atom.
  std::unordered_map<std::string_view,
                     std::unordered_map<std::string_view, std::vector<std::string_view>>>
      residueBonds_;
  int model_ = 0;  ///< the wanted one; 0: not known yet
  bool hasModel_ = false;
  std::size_t dropped_ = 0, water_ = 0, hydrogens_ = 0, unknown_ = 0, guessed_ = 0, lostBonds_ = 0;
  std::size_t steps_ = 0;
};

/// Removes blanks at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);

/// Number in base 36, as files have it where decimal digits do not suffice: A000 is 10,000 and a000
/// 1,223,056. @return nothing for other texts @param width  number of its letters and digits
[[nodiscard]] std::optional<std::int64_t> hybridNumber(std::string_view text, std::size_t width);

void readPdb(std::string_view text, MoleculeBuilder& builder);
void readCif(std::string_view text, MoleculeBuilder& builder);

}  // namespace levelset::molecules
