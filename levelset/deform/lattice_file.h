#pragma once

#include <filesystem>
#include <string>

#include "levelset/deform/control_lattice.h"
#include "levelset/progress.h"

/// Lattice files: JSON with the numbers of a lattice, exact to the last bit.
///
/// {"format": "levelsmith lattice", "version": 1, "degree": [3, 3, 3], "count": [4, 4, 4],
///  "origin": [0, 0, 0], "edges": [[2, 0, 0], [0, 2, 0], [0, 0, 2]],
///  "points": [[0, 0, 0], …], "weights": [1, …], "knots": [[0, 0, 0, 0, 1, 1, 1, 1], …]}
///
/// The box may also be given by "min" and "max". The last index of the points is the fastest.
/// "weights" and "knots" may be left out: all weights are then 1, and the knots are uniform.
namespace levelset {

/// Returns true if a file is a JSON document whose member "format" names lattices.
[[nodiscard]] bool isLatticeFile(const std::filesystem::path& file);

/// Writes a lattice to a file.
/// @throws IoError if the file cannot be written
void writeLattice(const std::filesystem::path& file, const ControlLattice& lattice);

/// Reads a lattice from a file. Errors name the file and the member.
/// @throws IoError if the file cannot be read
/// @throws InvalidInput if the file is no lattice file, or its numbers are not those of a lattice
/// @throws ResourceLimit if reading the file needs more than `maxMemory` bytes
[[nodiscard]] ControlLattice readLattice(const std::filesystem::path& file,
                                         std::size_t maxMemory = kNoMemoryLimit);

/// Reads a lattice from the text of a file.
/// @param name  name of the file, for messages
[[nodiscard]] ControlLattice parseLattice(const std::string& text, const std::string& name);

}  // namespace levelset
