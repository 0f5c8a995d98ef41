#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstddef>
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

/// A row of the loop of atoms.
void addRow(const std::array<std::string_view, Item::Count>& row, std::size_t line,
            MoleculeBuilder& builder) {
  const auto either = [&](Item::Value first, Item::Value second) {
    return row[first].empty() ? row[second] : row[first];
  };
  if (!builder.beginModel(row[Item::Model].empty()
                              ? 1
                              : builder.integer(row[Item::Model], "number of a model", line)))
    return;
  AtomRecord atom;
  atom.isHetero = row[Item::Group] == "HETATM";
  atom.name = either(Item::Atom, Item::LabelAtom);
  atom.alternate = row[Item::Alternate];
  atom.residue = either(Item::Residue, Item::LabelResidue);
  atom.chain = either(Item::Chain, Item::LabelChain);
  const std::string_view number = either(Item::Number, Item::LabelNumber);
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

}  // namespace

void readCif(std::string_view text, MoleculeBuilder& builder) {
  Words words(text, builder);
  bool hasWord = words.next();
  std::array<std::string_view, Item::Count> single{};  // an atom without a loop
  std::size_t singleLine = 0;
  while (hasWord) {
    if (words.isQuoted() || !isWord(words.word(), "loop_")) {
      const auto* const found =
          words.isName() ? std::find_if(kItemNames.begin(), kItemNames.end(),
                                        [&](auto name) { return isWord(words.word(), name); })
                         : kItemNames.end();
      hasWord = words.next();
      if (found == kItemNames.end() || !hasWord) continue;
      single[static_cast<std::size_t>(found - kItemNames.begin())] = words.value();
      singleLine = words.line();
      hasWord = words.next();
      continue;
    }
    const std::size_t start = words.line();
    std::vector<std::size_t> items;  // for each column its item, or Item::Count
    bool isAtoms = false;
    bool isFractional = false;
    while ((hasWord = words.next()) && words.isName()) {
      isFractional = isFractional || isWord(words.word(), "_atom_site_fract_x");
      const auto* const found = std::find_if(kItemNames.begin(), kItemNames.end(),
                                             [&](auto name) { return isWord(words.word(), name); });
      items.push_back(static_cast<std::size_t>(found - kItemNames.begin()));
      isAtoms = isAtoms || isWord(words.word().substr(0, 11), "_atom_site.");
    }
    if (isFractional)
      builder.fail(start, "the atoms have fractional coordinates; convert them to ångström first");
    if (!isAtoms) continue;
    for (const Item::Value needed : {Item::X, Item::Y, Item::Z})
      if (std::find(items.begin(), items.end(), needed) == items.end())
        builder.fail(start, "the loop of atoms lacks a coordinate (_atom_site.Cartn_x, _y or _z)");
    std::array<std::string_view, Item::Count> row{};
    std::size_t column = 0, line = words.line();
    while (hasWord && !words.isName() && !words.isKeyword()) {
      if (column == 0) line = words.line();
      if (items[column] < Item::Count) row[items[column]] = words.value();
      if (++column == items.size()) {
        addRow(row, line, builder);
        column = 0;
      }
      hasWord = words.next();
    }
    if (column != 0)
      builder.fail(line,
                   fmt::format("the last atom has {} values, and the loop {} columns; the file "
                               "may be truncated",
                               column, items.size()));
    return;
  }
  if (singleLine > 0) addRow(single, singleLine, builder);
}

}  // namespace levelset::molecules
