#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "levelset/molecules/molecule_builder.h"

// The syntax of CIF 1.1 [Hall91].

namespace levelset::molecules {
namespace {

bool isBlank(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

bool isWord(std::string_view text, std::string_view word) {
  return text.size() == word.size() &&
         std::equal(text.begin(), text.end(), word.begin(), [](char a, char b) {
           return (a >= 'A' && a <= 'Z' ? static_cast<char>(a | 0x20) : a) == b;
         });
}

/// Splits a CIF text into words.
class Words {
 public:
  Words(std::string_view text, const MoleculeBuilder& builder) : text_(text), builder_(builder) {}

  /// Moves to the next word. Returns false at the end of the text.
  bool next() {
    while (at_ < text_.size()) {
      if (text_[at_] == '#' && (at_ == 0 || isBlank(text_[at_ - 1]))) {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (isBlank(text_[at_])) {
        line_ += text_[at_] == '\n';
        ++at_;
      } else {
        break;
      }
    }
    if (at_ >= text_.size()) return false;
    const char c = text_[at_];
    isQuoted_ = true;
    if (c == '\0') builder_.fail(line_, "the line has a byte 0, so this is no text file");
    if (c == ';' && (at_ == 0 || text_[at_ - 1] == '\n')) {
      const std::size_t end = text_.find("\n;", at_);
      if (end == std::string_view::npos)
        builder_.fail(line_, "the text that begins with ; does not end");
      take(at_ + 1, end, end + 2);
    } else if (c == '\'' || c == '"') {
      std::size_t end = at_ + 1;
      while (end < text_.size() && text_[end] != '\n' &&
             !(text_[end] == c && (end + 1 == text_.size() || isBlank(text_[end + 1]))))
        ++end;
      if (end == text_.size() || text_[end] == '\n') builder_.fail(line_, "a quote does not end");
      take(at_ + 1, end, end + 1);
    } else {
      isQuoted_ = false;
      std::size_t end = at_;
      while (end < text_.size() && !isBlank(text_[end])) ++end;
      take(at_, end, end);
    }
    return true;
  }
  [[nodiscard]] std::string_view word() const { return word_; }
  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] bool isQuoted() const { return isQuoted_; }
  [[nodiscard]] bool isName() const { return !isQuoted_ && word_[0] == '_'; }
  /// Returns true for a word that begins another part of the file.
  [[nodiscard]] bool isKeyword() const {
    return !isQuoted_ && (isWord(word_, "loop_") || isWord(word_.substr(0, 5), "data_") ||
                          isWord(word_.substr(0, 5), "save_") || isWord(word_, "stop_"));
  }
  /// Returns the value, or nothing for the signs of a missing one.
  [[nodiscard]] std::string_view value() const {
    return !isQuoted_ && (word_ == "." || word_ == "?") ? std::string_view{} : word_;
  }

 private:
  void take(std::size_t begin, std::size_t end, std::size_t after) {
    word_ = text_.substr(begin, end - begin);
    line_ += static_cast<std::size_t>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(at_),
                                                 text_.begin() + static_cast<std::ptrdiff_t>(after),
                                                 '\n'));
    at_ = after;
  }

  std::string_view text_, word_;
  const MoleculeBuilder& builder_;
  std::size_t at_ = 0, line_ = 1;
  bool isQuoted_ = false;
};

/// Columns of the loop of atoms that are read.
struct Item {
  enum Value : std::size_t {
    Group,
    Symbol,
    Atom,
    LabelAtom,
    Alternate,
    Residue,
    LabelResidue,
    Chain,
    LabelChain,
    Number,
    LabelNumber,
    Insertion,
    X,
    Y,
    Z,
    Occupancy,
    BFactor,
    Model,
    Count
  };
};
constexpr std::array<std::string_view, Item::Count> kItemNames = {
    "_atom_site.group_pdb",     "_atom_site.type_symbol",    "_atom_site.auth_atom_id",
    "_atom_site.label_atom_id", "_atom_site.label_alt_id",   "_atom_site.auth_comp_id",
    "_atom_site.label_comp_id", "_atom_site.auth_asym_id",   "_atom_site.label_asym_id",
    "_atom_site.auth_seq_id",   "_atom_site.label_seq_id",   "_atom_site.pdbx_pdb_ins_code",
    "_atom_site.cartn_x",       "_atom_site.cartn_y",        "_atom_site.cartn_z",
    "_atom_site.occupancy",     "_atom_site.b_iso_or_equiv", "_atom_site.pdbx_pdb_model_num"};

using Row = std::vector<std::string_view>;  ///< a value for each item of a category

std::string_view either(const Row& row, std::size_t first, std::size_t second) {
  return row[first].empty() ? row[second] : row[first];
}

void addAtom(const Row& row, std::size_t line, MoleculeBuilder& builder) {
  if (!builder.beginModel(row[Item::Model].empty()
                              ? 1
                              : builder.integer(row[Item::Model], "number of a model", line)))
    return;
  AtomRecord atom;
  atom.isHetero = row[Item::Group] == "HETATM";
  atom.name = either(row, Item::Atom, Item::LabelAtom);
  atom.alternate = row[Item::Alternate];
  atom.residue = either(row, Item::Residue, Item::LabelResidue);
  atom.chain = either(row, Item::Chain, Item::LabelChain);
  const std::string_view number = either(row, Item::Number, Item::LabelNumber);
  atom.number = number.empty() ? 0 : builder.integer(number, "number of a residue", line);
  atom.insertion = row[Item::Insertion];
  atom.element = row[Item::Symbol];
  atom.position = {builder.number(row[Item::X], "coordinate (Cartn_x)", line),
                   builder.number(row[Item::Y], "coordinate (Cartn_y)", line),
                   builder.number(row[Item::Z], "coordinate (Cartn_z)", line)};
  if (!row[Item::Occupancy].empty())
    atom.occupancy = builder.number(row[Item::Occupancy], "occupancy", line);
  if (!row[Item::BFactor].empty())
    atom.bFactor = builder.number(row[Item::BFactor], "temperature factor", line);
  builder.add(atom, line);
}

/// Columns of the loop of bonds between residues, for each of both ends. The type follows.
struct EndItem {
  enum Value : std::size_t {
    Chain,
    LabelChain,
    Number,
    LabelNumber,
    Insertion,
    Residue,
    LabelResidue,
    Atom,
    Alternate,
    Symmetry,
    Count
  };
};
constexpr std::array<std::string_view, 2 * EndItem::Count + 1> kConnectionNames = {
    "_struct_conn.ptnr1_auth_asym_id",
    "_struct_conn.ptnr1_label_asym_id",
    "_struct_conn.ptnr1_auth_seq_id",
    "_struct_conn.ptnr1_label_seq_id",
    "_struct_conn.pdbx_ptnr1_pdb_ins_code",
    "_struct_conn.ptnr1_auth_comp_id",
    "_struct_conn.ptnr1_label_comp_id",
    "_struct_conn.ptnr1_label_atom_id",
    "_struct_conn.pdbx_ptnr1_label_alt_id",
    "_struct_conn.ptnr1_symmetry",
    "_struct_conn.ptnr2_auth_asym_id",
    "_struct_conn.ptnr2_label_asym_id",
    "_struct_conn.ptnr2_auth_seq_id",
    "_struct_conn.ptnr2_label_seq_id",
    "_struct_conn.pdbx_ptnr2_pdb_ins_code",
    "_struct_conn.ptnr2_auth_comp_id",
    "_struct_conn.ptnr2_label_comp_id",
    "_struct_conn.ptnr2_label_atom_id",
    "_struct_conn.pdbx_ptnr2_label_alt_id",
    "_struct_conn.ptnr2_symmetry",
    "_struct_conn.conn_type_id"};

AtomPlace placeOf(const Row& row, std::size_t end, std::size_t line,
                  const MoleculeBuilder& builder) {
  const std::size_t at = end * EndItem::Count;
  AtomPlace place;
  place.chain = either(row, at + EndItem::Chain, at + EndItem::LabelChain);
  place.residue = either(row, at + EndItem::Residue, at + EndItem::LabelResidue);
  place.insertion = row[at + EndItem::Insertion];
  place.atom = row[at + EndItem::Atom];
  place.alternate = row[at + EndItem::Alternate];
  const std::string_view number = either(row, at + EndItem::Number, at + EndItem::LabelNumber);
  place.number = number.empty() ? 0 : builder.integer(number, "number of a residue", line);
  return place;
}

/// Adds a bond, unless it is a hydrogen bond or leads to a copy of the molecule in the crystal.
void addConnection(const Row& row, std::size_t line, MoleculeBuilder& builder) {
  const std::string_view type = row[2 * EndItem::Count];
  const bool isBond = isWord(type, "disulf") || isWord(type, "metalc") ||
                      isWord(type.substr(0, 6), "covale") || type.empty();
  if (isBond && row[EndItem::Symmetry] == row[EndItem::Count + EndItem::Symmetry])
    builder.addBond(placeOf(row, 0, line, builder), placeOf(row, 1, line, builder));
}

constexpr std::array<std::string_view, 3> kComponentNames = {
    "_chem_comp_bond.comp_id", "_chem_comp_bond.atom_id_1", "_chem_comp_bond.atom_id_2"};

void addComponentBond(const Row& row, std::size_t line, MoleculeBuilder& builder) {
  builder.addResidueBond(row[0], row[1], row[2], line);
}

/// A part of a file that is read: rows of values.
struct Category {
  std::string_view prefix;
  std::span<const std::string_view> items;
  void (*add)(const Row& row, std::size_t line, MoleculeBuilder& builder);
};
constexpr std::array<Category, 3> kCategories = {
    {{"_atom_site.", kItemNames, addAtom},
     {"_struct_conn.", kConnectionNames, addConnection},
     {"_chem_comp_bond.", kComponentNames, addComponentBond}}};
constexpr std::size_t kAtoms = 0;  // index of the category of atoms

/// Index of the category of a name; kCategories.size(): none that is read.
std::size_t categoryOf(std::string_view name) {
  for (std::size_t n = 0; n < kCategories.size(); ++n)
    if (isWord(name.substr(0, kCategories[n].prefix.size()), kCategories[n].prefix)) return n;
  return kCategories.size();
}

/// Index of an item in its category.
std::size_t itemOf(const Category& category, std::string_view name) {
  return static_cast<std::size_t>(std::find_if(category.items.begin(), category.items.end(),
                                               [&](auto item) { return isWord(name, item); }) -
                                  category.items.begin());
}

/// Reads the atoms and bonds of the first data block that has atoms.
class CifReader {
 public:
  CifReader(std::string_view text, MoleculeBuilder& builder)
      : words_(text, builder), builder_(builder) {}

  void read() {
    hasWord_ = words_.next();
    while (hasWord_) {
      if (!words_.isQuoted() && isWord(words_.word(), "loop_")) {
        readLoop();
      } else if (words_.isName()) {
        readItem();
      } else {
        if (!words_.isQuoted() && isWord(words_.word().substr(0, 5), "data_")) {
          endBlock();
          if (hasAtoms_) return;
          builder_.removeBonds();
        }
        hasWord_ = words_.next();
      }
    }
    endBlock();
  }

 private:
  /// Rows whose items stand alone, without a loop.
  struct Single {
    Row row;
    std::size_t line = 0;
  };

  void readItem() {
    const std::size_t number = categoryOf(words_.word());
    const std::string_view name = words_.word();
    hasWord_ = words_.next();
    if (number == kCategories.size() || !hasWord_) return;
    const Category& category = kCategories[number];
    const std::size_t item = itemOf(category, name);
    if (item == category.items.size()) return;
    Single& single = singles_[number];
    single.row.resize(category.items.size());
    single.row[item] = words_.value();
    single.line = words_.line();
    hasWord_ = words_.next();
  }

  /// Adds the rows without a loop. Those of a category with a loop do not count.
  void endBlock() {
    for (std::size_t n = 0; n < kCategories.size(); ++n) {
      Single& single = singles_[n];
      if (single.line == 0 || (n == kAtoms && hasAtoms_)) continue;
      kCategories[n].add(single.row, single.line, builder_);
      hasAtoms_ = hasAtoms_ || n == kAtoms;
      single = {};
    }
  }

  void readLoop() {
    const std::size_t start = words_.line();
    std::vector<std::string_view> names;
    std::size_t number = kCategories.size();
    while ((hasWord_ = words_.next()) && words_.isName()) {
      if (isWord(words_.word(), "_atom_site_fract_x") && !hasAtoms_)
        builder_.fail(start,
                      "the atoms have fractional coordinates; convert them to ångström first");
      names.push_back(words_.word());
      number = std::min(number, categoryOf(words_.word()));
    }
    if (number == kCategories.size() || (number == kAtoms && hasAtoms_)) return;
    const Category& category = kCategories[number];
    std::vector<std::size_t> items;  // for each column its item
    items.reserve(names.size());
    for (const std::string_view name : names) items.push_back(itemOf(category, name));
    if (number == kAtoms) {
      for (const Item::Value needed : {Item::X, Item::Y, Item::Z})
        if (std::find(items.begin(), items.end(), needed) == items.end())
          builder_.fail(start,
                        "the loop of atoms lacks a coordinate (_atom_site.Cartn_x, _y or _z)");
      hasAtoms_ = true;
    }
    readRows(category, items);
  }

  void readRows(const Category& category, const std::vector<std::size_t>& items) {
    Row row(category.items.size());
    std::size_t column = 0, line = words_.line();
    while (hasWord_ && !words_.isName() && !words_.isKeyword()) {
      if (column == 0) line = words_.line();
      if (items[column] < row.size()) row[items[column]] = words_.value();
      if (++column == items.size()) {
        category.add(row, line, builder_);
        column = 0;
      }
      hasWord_ = words_.next();
    }
    if (column != 0)
      builder_.fail(line, fmt::format("the last row has {} values, and the loop {} columns; the "
                                      "file may be truncated",
                                      column, items.size()));
  }

  Words words_;
  MoleculeBuilder& builder_;
  bool hasWord_ = false, hasAtoms_ = false;
  std::array<Single, kCategories.size()> singles_;
};

}  // namespace

void readCif(std::string_view text, MoleculeBuilder& builder) {
  CifReader(text, builder).read();
}

}  // namespace levelset::molecules
