#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "levelset/molecules/molecule_builder.h"

namespace levelset::molecules {
namespace {

/// Columns of a line, numbered from 1 as the format does; shorter lines end with blanks.
std::string_view columns(std::string_view line, std::size_t first, std::size_t last) {
  if (line.size() < first) return {};
  return line.substr(first - 1, last - first + 1);
}

/// Element of an atom without one in its columns. The name begins at column 14 for symbols of one
/// letter, and at column 13 for those of two. @param name  columns 13 to 16
std::string_view elementOfName(std::string_view name) {
  const auto isLetter = [&](std::size_t n) {
    return n < name.size() && std::isalpha(static_cast<unsigned char>(name[n]));
  };
  // Names of hydrogen atoms with four letters begin at column 13.
  if (isLetter(0) && name[0] == 'H' && trimmed(name).size() == 4) return name.substr(0, 1);
  if (isLetter(0) && isLetter(1) && atomicNumber(name.substr(0, 2))) return name.substr(0, 2);
  for (std::size_t n = 0; n < name.size(); ++n)
    if (isLetter(n)) return name.substr(n, 1);
  return {};
}

int residueNumber(std::string_view text, const MoleculeBuilder& builder, std::size_t line) {
  if (const auto hybrid = hybridNumber(trimmed(text), 4)) return static_cast<int>(*hybrid);
  return builder.integer(text, "number of a residue", line);
}

/// Serial number of an atom. -1 for stars and other texts, which programs write above 99,999.
std::int64_t serialNumber(std::string_view text) {
  text = trimmed(text);
  if (const auto hybrid = hybridNumber(text, 5)) return *hybrid;
  std::int64_t value = -1;
  const auto [next, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && next == text.data() + text.size() ? value : -1;
}

bool isBlank(std::string_view text) {
  return trimmed(text).empty();
}

/// Number of columns of a serial number in a record CONECT. It is 5, or 6 in files of programs that
/// write six digits; 0 if both may be. @param text  all serial numbers
std::size_t widthOfSerials(std::string_view text) {
  while (!text.empty() && isBlank(text.substr(text.size() - 1))) text.remove_suffix(1);
  const bool isDense = text.find(' ') == std::string_view::npos;
  const bool fitsFive = text.size() % 5 == 0, fitsSix = text.size() % 6 == 0;
  if (fitsSix && !fitsFive) {
    bool areNumbers = true;
    for (std::size_t at = 0; at < text.size(); at += 6) {
      const std::string_view serial = text.substr(at, 6);
      areNumbers = areNumbers && (isBlank(serial) || serialNumber(serial) >= 0);
    }
    if (areNumbers) return 6;
  }
  return isDense && fitsFive == fitsSix && !text.empty() ? 0 : 5;
}

/// Adds the bonds of a record CONECT, which has a bond of a higher order several times.
void addBondsOf(std::string_view line, MoleculeBuilder& builder) {
  const std::size_t width = widthOfSerials(columns(line, 7, 80));
  if (width == 0) return builder.addBond(-1, -1);
  const std::int64_t first = serialNumber(columns(line, 7, 6 + width));
  for (std::size_t n = 1; n <= 4; ++n) {
    const std::string_view other = columns(line, 7 + n * width, 6 + (n + 1) * width);
    if (!isBlank(other)) builder.addBond(first, serialNumber(other));
  }
}

}  // namespace

void readPdb(std::string_view text, MoleculeBuilder& builder) {
  std::size_t number = 0;
  bool isWanted = true, isInModel = false, hasAtom = false;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    ++number;
    if (line.find('\0') != std::string_view::npos)
      builder.fail(number, "the line has a byte 0, so this is no text file");
    const std::string_view record = trimmed(columns(line, 1, 6));
    if (record == "MODEL") {
      isWanted =
          builder.beginModel(builder.integer(columns(line, 7, 20), "number of a model", number));
      isInModel = true;
      continue;
    }
    if (record == "ENDMDL") {
      isWanted = false;
      continue;
    }
    if (record == "END") break;
    if (record == "TER") builder.endChain();
    if (record == "CONECT") addBondsOf(line, builder);
    if (record != "ATOM" && record != "HETATM") continue;
    if (!isInModel && !hasAtom) isWanted = builder.beginModel(1);
    hasAtom = true;
    if (!isWanted) continue;
    if (line.size() < 54)
      builder.fail(
          number,
          fmt::format("the atom has {} columns, and its position ends at column 54", line.size()));
    AtomRecord atom;
    atom.serial = serialNumber(columns(line, 7, 12));  // six digits reach one column farther
    atom.isHetero = record == "HETATM";
    atom.name = trimmed(columns(line, 13, 16));
    atom.alternate = trimmed(columns(line, 17, 17));
    atom.residue = trimmed(columns(line, 18, 20));
    // Some programs write residue names of four letters.
    if (!isBlank(columns(line, 21, 21))) atom.residue = trimmed(columns(line, 18, 21));
    atom.chain = trimmed(columns(line, 22, 22));
    atom.number =
        isBlank(columns(line, 23, 26)) ? 0 : residueNumber(columns(line, 23, 26), builder, number);
    atom.insertion = trimmed(columns(line, 27, 27));
    atom.position = {
        builder.number(columns(line, 31, 38), "coordinate (columns 31 to 38)", number),
        builder.number(columns(line, 39, 46), "coordinate (columns 39 to 46)", number),
        builder.number(columns(line, 47, 54), "coordinate (columns 47 to 54)", number)};
    if (!isBlank(columns(line, 55, 60)))
      atom.occupancy =
          builder.number(columns(line, 55, 60), "occupancy (columns 55 to 60)", number);
    if (!isBlank(columns(line, 61, 66)))
      atom.bFactor =
          builder.number(columns(line, 61, 66), "temperature factor (columns 61 to 66)", number);
    atom.element = trimmed(columns(line, 77, 78));
    if (!atomicNumber(atom.element)) {
      // In a polymer, CA at the left is not calcium but the alpha carbon.
      atom.element =
          !atom.isHetero && atom.name == "CA" ? "C" : elementOfName(columns(line, 13, 16));
      atom.isElementGuessed = true;
    }
    builder.add(atom, number);
  }
}

}  // namespace levelset::molecules
