#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "levelset/molecules/molecule.h"
#include "levelset/progress.h"

/// Reads molecules from PDB files (`.pdb`, `.ent`) and mmCIF files (`.cif`, `.mmcif`), each also
/// compressed as `.gz`.
///
/// An atom with alternate locations has that with the largest occupancy, and among equal ones
/// the first. PDB: records ATOM and HETATM of 54 columns or more; a missing element follows from
/// the name. mmCIF: the loop `_atom_site` of the first data block that has one. Author names of
/// chains and residues are preferred.
namespace levelset {

struct ReadMoleculeOptions {
  std::string format =
      {};  ///< "pdb" or "cif", with ".gz" appended if compressed; empty: by extension
  /// Number of the model, from 1, as the file numbers it. 0: the first one.
  int model = 0;
  bool solvent = false;   ///< true: keeps water
  bool hydrogens = true;  ///< false: leaves hydrogen atoms out
  std::size_t maxMemory = kNoMemoryLimit;
  std::vector<std::string>* notes = nullptr;  ///< receives remarks about the file; may be null
  Progress progress = {};
};

/// @param path  a file, or "-" for standard input (requires options.format)
/// @throws UsageError for an unknown format
/// @throws IoError when the file cannot be opened or read
/// @throws ResourceLimit when the molecule exceeds options.maxMemory or the machine's memory
/// @throws InvalidInput when the file is empty, damaged or without atoms, or lacks the model
[[nodiscard]] Molecule readMolecule(const std::filesystem::path& path,
                                    const ReadMoleculeOptions& options = {});

/// Returns true for a file name or format that readMolecule() supports.
[[nodiscard]] bool holdsMolecule(const std::filesystem::path& nameOrFormat);

}  // namespace levelset
