#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// Molecules: atoms in residues and chains, and their bonds.
namespace levelset {

struct Atom {
  Imath::V3d position{0};    ///< ångström
  std::string name = {};     ///< such as CA
  std::uint8_t element = 0;  ///< atomic number; 0: unknown
  bool isHetero = false;     ///< true in a ligand, an ion or a solvent
  char alternate = 0;        ///< alternate location, such as A; 0: none
  float occupancy = 1;
  float bFactor = 0;  ///< temperature factor, Å²
  std::uint32_t residue = 0;
};

struct Residue {
  std::string name = {};  ///< such as ALA
  int number = 0;
  std::string insertion = {};  ///< insertion code, empty for most
  std::uint32_t chain = 0;
};

/// A bond between two atoms.
struct Bond {
  std::uint32_t first = 0, second = 0;  ///< indices of the atoms, `first` < `second`

  friend auto operator<=>(const Bond&, const Bond&) = default;
};

struct Molecule {
  std::vector<Atom> atoms = {};
  std::vector<Residue> residues = {};
  std::vector<std::string> chains = {};
  /// Bonds that the file gives, each once, sorted. moleculeBonds() adds those by distance.
  std::vector<Bond> bonds = {};

  /// Box of the van der Waals balls of the atoms, Å.
  [[nodiscard]] Imath::Box3d bounds() const;
  [[nodiscard]] std::size_t bytes() const;
  /// Name of a residue with its chain: "A/ALA 17".
  [[nodiscard]] std::string residueName(std::size_t residue) const;
};

/// Van der Waals radius, Å: [Bondi64] and, for the other main-group elements, [Mantina09]. 2 Å for
/// elements without a value there. @param element  atomic number; 0: that of carbon
[[nodiscard]] double vanDerWaalsRadius(int element);
/// Covalent radius, Å [Cordero08]: that of sp³ carbon and of low spin; 1.69 Å above curium.
/// @param element  atomic number; 0: that of carbon
[[nodiscard]] double covalentRadius(int element);
/// Colour of an element in Jmol [Jmol], sRGB from 0 to 1. @param element  0: that of carbon
[[nodiscard]] Imath::C3f elementColour(int element);
/// Returns the atomic number of a chemical symbol in any case, 0 for other texts. D is hydrogen.
[[nodiscard]] int atomicNumber(std::string_view symbol);
[[nodiscard]] std::string_view elementSymbol(int element);

}  // namespace levelset
