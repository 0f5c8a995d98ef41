#include "levelset/molecules/molecule_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <new>
#include <optional>
#include <unordered_set>
#include <utility>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/mesh_files/mesh_parts.h"
#include "levelset/molecules/molecule_builder.h"

namespace levelset {
namespace molecules {
namespace {

constexpr double kLargestCoordinate = 1e8;
constexpr std::array<std::string_view, 6> kWater = {"HOH", "WAT", "DOD", "H2O", "SOL", "TIP3"};

bool isWater(std::string_view residue) {
  return std::find(kWater.begin(), kWater.end(), residue) != kWater.end();
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  const auto isBlank = [](char c) { return static_cast<unsigned char>(c) <= ' '; };
  while (!text.empty() && isBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && isBlank(text.back())) text.remove_suffix(1);
  return text;
}

MoleculeBuilder::MoleculeBuilder(std::string file, const ReadMoleculeOptions& options)
    : file_(std::move(file)), options_(options), model_(options.model) {}

std::optional<std::int64_t> hybridNumber(std::string_view text, std::size_t width) {
  if (text.size() != width || !std::isalpha(static_cast<unsigned char>(text[0]))) return {};
  const bool isLower = text[0] >= 'a';
  std::int64_t value = 0, highest = 1, decimal = 10;
  for (std::size_t n = 1; n < width; ++n) {
    highest *= 36;
    decimal *= 10;
  }
  for (const char c : text) {
    const bool isLetter = isLower ? c >= 'a' && c <= 'z' : c >= 'A' && c <= 'Z';
    if (!isLetter && !(c >= '0' && c <= '9')) return {};
    value = 36 * value + (isLetter ? c - (isLower ? 'a' : 'A') + 10 : c - '0');
  }
  return value - 10 * highest + decimal + (isLower ? 26 * highest : 0);
}

bool MoleculeBuilder::beginModel(int number) {
  if (model_ == 0) model_ = number;
  hasModel_ = hasModel_ || number == model_;
  return number == model_;
}

void MoleculeBuilder::fail(std::size_t line, const std::string& what) const {
  failAt(file_, {"line", line}, what + "; repair the line or download the file again");
}

double MoleculeBuilder::number(std::string_view text, const char* what, std::size_t line) const {
  text = trimmed(text);
  const char* begin = text.data();
  const char* end = begin + text.size();
  if (begin != end && *begin == '+') ++begin;
  double value = 0;
  const auto [next, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || next != end || !(std::abs(value) <= kLargestCoordinate))
    fail(line, fmt::format("'{}' is no {}", text, what));
  return value;
}

int MoleculeBuilder::integer(std::string_view text, const char* what, std::size_t line) const {
  text = trimmed(text);
  int value = 0;
  const auto [next, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || next != text.data() + text.size())
    fail(line, fmt::format("'{}' is no {}", text, what));
  return value;
}

void MoleculeBuilder::add(const AtomRecord& record, std::size_t line) {
  if (!options_.solvent && isWater(record.residue)) {
    ++water_;
    return;
  }
  Atom atom;
  atom.element = static_cast<std::uint8_t>(atomicNumber(record.element));
  if (!options_.hydrogens && atom.element == 1) {
    ++hydrogens_;
    return;
  }
  const auto chain = chains_.try_emplace(std::string(record.chain),
                                         static_cast<std::uint32_t>(molecule_.chains.size()));
  if (chain.second) molecule_.chains.emplace_back(record.chain);
  const std::string place =
      fmt::format("{}\n{}\n{}", chain.first->second, record.number, record.insertion);
  std::string key = fmt::format("{}\n{}", place, record.residue);
  auto residue = residues_.find(key);
  // Alternate locations of a residue may follow each other in turns. Any other atom continues the
  // residue of the last one, or begins a new one.
  if (residue == residues_.end() || (key != last_ && record.alternate.empty())) {
    const auto next = static_cast<std::uint32_t>(molecule_.residues.size());
    residue = residues_.insert_or_assign(key, next).first;
    molecule_.residues.push_back({std::string(record.residue), record.number,
                                  std::string(record.insertion), chain.first->second});
  }
  last_ = std::move(key);
  atom.residue = residue->second;
  if (!record.alternate.empty()) {
    isAtPlace_.resize(molecule_.residues.size(), 0);
    if (!std::exchange(isAtPlace_[atom.residue], 1)) places_[place].push_back(atom.residue);
  }
  atom.name = record.name;
  atom.position = record.position;
  atom.occupancy = static_cast<float>(record.occupancy);
  atom.bFactor = static_cast<float>(record.bFactor);
  atom.isHetero = record.isHetero;
  if (!record.alternate.empty()) {
    atom.alternate = record.alternate[0];
    const auto known = alternates_.try_emplace(fmt::format("{}\n{}", atom.residue, atom.name),
                                               molecule_.atoms.size());
    if (!known.second) {
      ++dropped_;
      Atom& other = molecule_.atoms[known.first->second];
      if (atom.occupancy > other.occupancy) {
        other = atom;
        serials_[known.first->second] = record.serial;
      }
      return;
    }
  }
  if (atom.element == 0)
    ++unknown_;
  else if (record.isElementGuessed)
    ++guessed_;
  if (molecule_.atoms.size() >= (std::size_t{1} << 31))
    fail(line, "the file has more than 2^31 atoms");
  if (molecule_.atoms.size() == molecule_.atoms.capacity())
    requireMemory(3.0 * static_cast<double>(molecule_.bytes()), options_.maxMemory);
  molecule_.atoms.push_back(std::move(atom));
  serials_.push_back(record.serial);
}

void MoleculeBuilder::endChain() {
  last_.clear();
  residues_.clear();
}

void MoleculeBuilder::chooseResidues() {
  std::vector<float> occupancy(molecule_.residues.size(), 0);  // the largest of an alternate atom
  for (const auto& [key, atom] : alternates_) {
    const Atom& of = molecule_.atoms[atom];
    occupancy[of.residue] = std::max(occupancy[of.residue], of.occupancy);
    ++steps_;
  }
  std::vector<char> isLeftOut(molecule_.residues.size(), 0);
  bool isAny = false;
  for (const auto& [place, alternatives] : places_) {
    if (alternatives.size() < 2) continue;
    const std::uint32_t best =
        *std::max_element(alternatives.begin(), alternatives.end(),
                          [&](auto a, auto b) { return occupancy[a] < occupancy[b]; });
    for (const std::uint32_t residue : alternatives) isLeftOut[residue] = residue != best;
    steps_ += alternatives.size();
    isAny = true;
  }
  if (!isAny) return;
  std::size_t keptAtoms = 0;
  for (std::size_t n = 0; n < molecule_.atoms.size(); ++n) {
    if (isLeftOut[molecule_.atoms[n].residue]) continue;
    if (keptAtoms != n) molecule_.atoms[keptAtoms] = std::move(molecule_.atoms[n]);
    serials_[keptAtoms++] = serials_[n];
  }
  dropped_ += molecule_.atoms.size() - keptAtoms;
  molecule_.atoms.resize(keptAtoms);
  serials_.resize(keptAtoms);
  std::vector<std::uint32_t> numbers;
  std::vector<Residue> kept;
  for (std::size_t n = 0; n < molecule_.residues.size(); ++n) {
    numbers.push_back(static_cast<std::uint32_t>(kept.size()));
    if (!isLeftOut[n]) kept.push_back(std::move(molecule_.residues[n]));
  }
  molecule_.residues = std::move(kept);
  for (Atom& atom : molecule_.atoms) atom.residue = numbers[atom.residue];
}

void MoleculeBuilder::removeBonds() {
  serialBonds_.clear();
  placeBonds_.clear();
  residueBonds_.clear();
}

void MoleculeBuilder::keepBond(std::size_t first, std::size_t second) {
  const char a = molecule_.atoms[first].alternate, b = molecule_.atoms[second].alternate;
  if (first == second || (a && b && a != b)) {
    ++lostBonds_;
    return;
  }
  molecule_.bonds.push_back({static_cast<std::uint32_t>(std::min(first, second)),
                             static_cast<std::uint32_t>(std::max(first, second))});
}

void MoleculeBuilder::resolveSerialBonds() {
  if (serialBonds_.empty()) return;
  constexpr std::size_t kSeveral = ~std::size_t{0};
  std::unordered_map<std::int64_t, std::size_t> atoms;
  for (std::size_t n = 0; n < serials_.size(); ++n) {
    const auto known = atoms.try_emplace(serials_[n], n);
    if (!known.second) known.first->second = kSeveral;
  }
  for (const auto& [first, second] : serialBonds_) {
    const auto a = atoms.find(first), b = atoms.find(second);
    if (first < 0 || second < 0 || a == atoms.end() || b == atoms.end() || a->second == kSeveral ||
        b->second == kSeveral)
      ++lostBonds_;
    else
      keepBond(a->second, b->second);
  }
}

void MoleculeBuilder::resolvePlaceBonds() {
  if (placeBonds_.empty()) return;
  const auto atomKey = [](const std::string& residue, std::string_view atom) {
    return fmt::format("{}\n{}", residue, atom);
  };
  const auto residueOf = [](const AtomPlace& place) {
    return fmt::format("{}/{} {}{}", place.chain, place.residue, place.number, place.insertion);
  };
  // The first atom in each alternate location, by residue and name. Few residues have any.
  std::unordered_map<std::string, std::vector<std::size_t>> atoms;
  std::unordered_set<std::string> residues;
  for (const auto& bond : placeBonds_)
    for (const AtomPlace& place : bond) {
      const std::string residue = residueOf(place);
      atoms.try_emplace(atomKey(residue, place.atom));
      residues.insert(residue);
    }
  std::vector<char> hasBond(molecule_.residues.size(), 0);
  for (std::size_t n = 0; n < hasBond.size(); ++n)
    hasBond[n] = residues.contains(molecule_.residueName(n));
  for (std::size_t n = 0; n < molecule_.atoms.size(); ++n) {
    const Atom& atom = molecule_.atoms[n];
    if (!hasBond[atom.residue]) continue;
    const auto found = atoms.find(atomKey(molecule_.residueName(atom.residue), atom.name));
    if (found == atoms.end()) continue;
    const auto isSame = [&](std::size_t other) {
      ++steps_;
      return molecule_.atoms[other].alternate == atom.alternate;
    };
    if (std::none_of(found->second.begin(), found->second.end(), isSame))
      found->second.push_back(n);
  }
  constexpr std::size_t kNone = ~std::size_t{0};
  const auto atomAt = [&](const AtomPlace& place) {
    for (const std::size_t n : atoms.at(atomKey(residueOf(place), place.atom))) {
      ++steps_;
      const char alternate = molecule_.atoms[n].alternate;
      if (place.alternate.empty() || alternate == 0 || place.alternate[0] == alternate) return n;
    }
    return kNone;
  };
  for (const auto& [first, second] : placeBonds_) {
    const std::size_t a = atomAt(first), b = atomAt(second);
    if (a == kNone || b == kNone)
      ++lostBonds_;
    else
      keepBond(a, b);
  }
}

void MoleculeBuilder::addResidueBond(std::string_view residue, std::string_view first,
                                     std::string_view second, std::size_t line) {
  std::vector<std::string_view>& partners = residueBonds_[residue][first];
  if (std::find(partners.begin(), partners.end(), second) != partners.end()) return;
  if (partners.size() == kMostPartners)
    fail(line, fmt::format("atom '{}' of the residue '{}' has bonds to more than {} atoms", first,
                           residue, kMostPartners));
  partners.push_back(second);
}

void MoleculeBuilder::resolveResidueBonds() {
  if (residueBonds_.empty()) return;
  std::vector<std::vector<std::size_t>> atoms(molecule_.residues.size());
  for (std::size_t n = 0; n < molecule_.atoms.size(); ++n)
    atoms[molecule_.atoms[n].residue].push_back(n);
  for (std::size_t residue = 0; residue < atoms.size(); ++residue) {
    const auto bonds = residueBonds_.find(molecule_.residues[residue].name);
    if (bonds == residueBonds_.end()) continue;
    std::unordered_map<std::string_view, std::size_t> named;  // the first atom of each name
    for (const std::size_t atom : atoms[residue])
      named.try_emplace(molecule_.atoms[atom].name, atom);
    for (const auto& [name, atom] : named) {
      ++steps_;
      const auto partners = bonds->second.find(name);
      if (partners == bonds->second.end()) continue;
      for (const std::string_view partner : partners->second) {
        ++steps_;
        if (const auto other = named.find(partner); other != named.end())
          keepBond(atom, other->second);
      }
    }
  }
}

void MoleculeBuilder::resolveBonds() {
  resolveSerialBonds();
  resolvePlaceBonds();
  resolveResidueBonds();
  std::vector<Bond>& bonds = molecule_.bonds;
  std::sort(bonds.begin(), bonds.end());
  bonds.erase(std::unique(bonds.begin(), bonds.end()), bonds.end());
}

Molecule MoleculeBuilder::finish() {
  chooseResidues();
  resolveBonds();
  if (options_.model != 0 && !hasModel_)
    failFile(file_, fmt::format("has no model {}; choose one of its models", options_.model));
  if (molecule_.atoms.empty()) {
    failFile(
        file_,
        water_ + hydrogens_ > 0
            ? "has only water and hydrogen atoms, which are left out; give --solvent, or leave "
              "--no-hydrogens out"
            : "has no atoms; check that it is a molecule");
  }
  if (options_.notes) {
    const auto note = [&](std::size_t count, const char* what) {
      if (count > 0) options_.notes->push_back(fmt::format(fmt::runtime(what), count));
    };
    note(water_, "{} atoms of water were left out");
    note(hydrogens_, "{} hydrogen atoms were left out");
    note(dropped_, "{} alternate locations of atoms were left out");
    note(guessed_, "the elements of {} atoms follow from their names");
    note(lostBonds_,
         "{} records of bonds were ignored: one of their atoms is missing, not unique or left out");
    note(unknown_, "{} atoms have no known element and count as carbon");
  }
  return std::move(molecule_);
}

}  // namespace molecules

namespace {

namespace fs = std::filesystem;

struct MoleculeFormat {
  const char* extension;
  void (*read)(std::string_view, molecules::MoleculeBuilder&);
};
constexpr MoleculeFormat kMoleculeFormats[] = {{"pdb", molecules::readPdb},
                                               {"ent", molecules::readPdb},
                                               {"cif", molecules::readCif},
                                               {"mmcif", molecules::readCif}};

const MoleculeFormat* findMoleculeFormat(const fs::path& nameOrFormat) {
  std::string text = nameOrFormat.filename().string();
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c | 0x20);
  if (text.ends_with(".gz")) text.resize(text.size() - 3);
  const std::string extension = text.substr(text.rfind('.') + 1);
  for (const MoleculeFormat& format : kMoleculeFormats)
    if (extension == format.extension) return &format;
  return nullptr;
}

}  // namespace

Molecule readMolecule(const fs::path& path, const ReadMoleculeOptions& options) {
  const fs::path name = options.format.empty() ? path : fs::path(options.format);
  const MoleculeFormat* format = findMoleculeFormat(name);
  if (!format)
    throw UsageError(
        fmt::format("'{}' names no format of molecules; use pdb or cif, with .gz "
                    "appended if compressed",
                    name.string()));
  report(options.progress, 0);
  try {
    const Bytes bytes = readBytes(path, options.maxMemory);
    molecules::MoleculeBuilder builder(inputName(path), options);
    format->read(bytes.view(), builder);
    Molecule molecule = builder.finish();
    report(options.progress, 1);
    return molecule;
  } catch (const std::bad_alloc&) {
    throw ResourceLimit(fmt::format("{} does not fit into memory; free memory", inputName(path)));
  }
}

bool holdsMolecule(const fs::path& nameOrFormat) {
  return findMoleculeFormat(nameOrFormat);
}

}  // namespace levelset
