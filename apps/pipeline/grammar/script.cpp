#include "apps/pipeline/grammar/script.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "apps/pipeline/grammar/script_list.h"
#include "apps/pipeline/grammar/script_words.h"
#include "apps/pipeline/values/text_file.h"
#include "apps/pipeline/values/units.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::UsageError;

/// Limit for the actions of a script, and for the iterations of its loops. The complete chain is
/// held in memory.
constexpr std::size_t kMostActions = 100'000;
constexpr std::size_t kMostScriptBytes = 1 << 24;
/// Limit for the text after the expansion of variables and loops, bytes. In a loop, `set` can
/// double the length of a variable in each iteration.
constexpr std::size_t kMostExpandedBytes = 1 << 26;
constexpr std::size_t kMostNested = 64;

bool isName(const std::string& text) {
  constexpr const char* kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_";
  constexpr const char* kDigits = "0123456789-";
  return text.find_first_of(kLetters) == 0 &&
         text.find_first_not_of(std::string(kLetters) + kDigits) == std::string::npos;
}

/// Text inside ${…}, such as "file:stem": name of a variable, and the part of a file name to take
/// from its value. Empty part: the complete value.
struct Reference {
  std::string name, part;
};

Reference referenceOf(const std::string& text) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  return {text.substr(0, colon), text.substr(std::min(colon + 1, text.size()))};
}

/// Text of a word that has no quotes and no variables; empty for other words.
std::string plainText(const ScriptWord& word) {
  return word.size() == 1 && !word[0].isVariable && !word[0].isQuoted ? word[0].text : "";
}

bool beginsLoop(const ScriptLine& line) {
  const std::string word = plainText(line.words[0]);
  return word == "repeat" || word == "for";
}

/// Name of the variable of a loop: NAME in `for NAME in …` and `repeat COUNT as NAME`, i in `repeat
/// COUNT`.
std::string loopVariable(const ScriptLine& line) {
  const bool isFor = plainText(line.words[0]) == "for";
  if (!isFor && line.words.size() < 4) return "i";
  return plainText(line.words[isFor ? 1 : 3]);
}

/// A loop variable and its current value.
struct Round {
  std::string name, value;
};

class Expander {
 public:
  Expander(std::vector<ScriptLine> lines, std::string file,
           const std::map<std::string, std::string>& settings)
      : lines_(std::move(lines)), file_(std::move(file)), settings_(settings) {
    matchEnds();
    checkSettings();
  }

  Script expand() {
    expand(0, lines_.size());
    if (!hasAction_)
      throw UsageError(fmt::format("run: '{}' contains no action; write one on each line", file_));
    return std::move(script_);
  }

 private:
  // === Checks before any variable is replaced

  /// Finds the `end` line of each loop. Checks the syntax of the lines `repeat`, `for`, `end` and
  /// `set`.
  void matchEnds() {
    ends_.resize(lines_.size());
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      const ScriptLine& line = lines_[i];
      const std::string word = plainText(line.words[0]);
      if (beginsLoop(line)) {
        checkLoop(line);
        open.push_back(i);
        if (open.size() > kMostNested)
          fail(line, fmt::format("{}: loops are nested more than {} deep; split the script", word,
                                 kMostNested));
      } else if (word == "end") {
        if (line.words.size() > 1) fail(line, "end: must be alone on its line");
        if (open.empty()) fail(line, "end: there is no loop to end; leave it out");
        ends_[open.back()] = i;
        open.pop_back();
      } else if (word == "set") {
        if (line.words.size() != 3)
          fail(line, "set: takes a name and one word: set NAME VALUE; quote a value with blanks");
        checkName(line, "set", plainText(line.words[1]));
        set_.insert(plainText(line.words[1]));
      }
    }
    if (!open.empty()) {
      const ScriptLine& line = lines_[open.back()];
      fail(line, fmt::format("{}: its `end` is missing; write it after the last action of the loop",
                             plainText(line.words[0])));
    }
  }

  void checkLoop(const ScriptLine& line) const {
    const std::size_t count = line.words.size();
    if (plainText(line.words[0]) == "for") {
      if (count < 4 || plainText(line.words[2]) != "in")
        fail(line, "for: the line is not `for NAME in LIST`; the list is words, 0..10 or *.ply");
      checkName(line, "for", loopVariable(line));
    } else {
      if (count != 2 && (count != 4 || plainText(line.words[2]) != "as"))
        fail(line,
             "repeat: the line is neither `repeat COUNT` nor `repeat COUNT as NAME`; write one of "
             "these");
      checkName(line, "repeat", loopVariable(line));
    }
  }

  void checkName(const ScriptLine& line, const std::string& who, const std::string& name) const {
    if (!isName(name)) {
      fail(line,
           fmt::format("{}: '{}' is not a name; names have letters, digits, _ and -, and begin "
                       "with a letter",
                       who, name));
    }
  }

  /// Checks that the script uses each variable that --set gives: the name of an unused one is
  /// probably misspelt.
  void checkSettings() const {
    std::set<std::string> taken = set_;
    // Open loops: variable, and index of the `end` line.
    std::vector<std::pair<std::string, std::size_t>> loops;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      std::erase_if(loops, [&](const auto& loop) { return loop.second == i; });
      for (const ScriptWord& word : lines_[i].words) {
        for (const WordPart& part : word) {
          const std::string name = part.isVariable ? referenceOf(part.text).name : "";
          const bool isLooped = std::any_of(loops.begin(), loops.end(),
                                            [&](const auto& loop) { return loop.first == name; });
          if (isName(name) && !isLooped) taken.insert(name);
        }
      }
      if (beginsLoop(lines_[i])) loops.emplace_back(loopVariable(lines_[i]), ends_[i]);
    }
    const std::vector<std::string> names(taken.begin(), taken.end());
    for (const auto& [name, value] : settings_) {
      if (taken.contains(name)) continue;
      const std::string guess = didYouMean(name, names);
      throw UsageError(
          fmt::format("run: --set {0}={1}: '{2}' has no variable {0}; {3}", name, value, file_,
                      !guess.empty()  ? fmt::format("did you mean '{}'?", guess)
                      : names.empty() ? "it has no variables"
                                      : fmt::format("it has {}", fmt::join(names, ", "))));
    }
  }

  // === Loops

  void expand(std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const ScriptLine& line = lines_[i];
      if (beginsLoop(line)) {
        expandLoop(i);
        i = ends_[i];
      } else if (plainText(line.words[0]) == "set") {
        assign(line);
      } else {
        addLine(line);
      }
    }
  }

  void expandLoop(std::size_t index) {
    const ScriptLine& line = lines_[index];
    const std::vector<std::string> values =
        plainText(line.words[0]) == "for" ? listOf(line) : countsOf(line);
    rounds_.push_back({loopVariable(line), {}});
    for (const std::string& value : values) {
      rounds_.back().value = value;
      if (++roundCount_ > kMostActions)
        fail(line,
             fmt::format("the loops have more than {} iterations; split the script", kMostActions));
      expand(index + 1, ends_[index]);
    }
    rounds_.pop_back();
  }

  [[nodiscard]] std::vector<std::string> countsOf(const ScriptLine& line) const {
    const std::string text = replaced(line, line.words[1]);
    const long count = parseInteger(text, placed(line, "repeat"));
    if (count < 0 || static_cast<std::size_t>(count) > kMostActions) {
      fail(line, fmt::format("repeat: '{}' is not a count from 0 to {}", text, kMostActions));
    }
    std::vector<std::string> values;
    for (long i = 0; i < count; ++i) values.push_back(std::to_string(i));
    spend(line, values.size());
    return values;
  }

  [[nodiscard]] std::vector<std::string> listOf(const ScriptLine& line) {
    std::vector<ListWord> words;
    for (std::size_t i = 3; i < line.words.size(); ++i) addListWords(line, line.words[i], words);
    return loopValues(words, {kMostActions, &budget_}, placed(line, "for"));
  }

  /// Appends the list entries that one word of a `for` line expands to. Splits unquoted variables
  /// at blanks, as a shell does.
  void addListWords(const ScriptLine& line, const ScriptWord& word,
                    std::vector<ListWord>& words) const {
    bool inWord = false, isPattern = false;
    std::string pattern;
    const auto finish = [&] {
      if (inWord && isPattern) words.back().pattern = pattern;
      pattern.clear();
      inWord = isPattern = false;
    };
    for (const WordPart& part : word) {
      const std::string text = part.isVariable ? valueOf(line, part.text) : part.text;
      spend(line, text.size());
      if (part.isQuoted && !inWord) words.emplace_back(), inWord = true;
      for (char c : text) {
        if (!part.isQuoted && (c == ' ' || c == '\t' || c == '\n')) {
          finish();
          continue;
        }
        if (!inWord) words.emplace_back(), inWord = true;
        const bool isSpecial = c == '*' || c == '?' || c == '[' || c == '\\';
        if (isSpecial && part.isQuoted) pattern += '\\';
        isPattern |= isSpecial && !part.isQuoted && c != '\\';
        pattern += c;
        words.back().text += c;
      }
      if (part.isQuoted) words.back().isBare = false;
    }
    finish();
  }

  // === Variables

  void assign(const ScriptLine& line) {
    const std::string name = plainText(line.words[1]);
    for (const Round& round : rounds_) {
      if (round.name == name)
        fail(line, fmt::format("set: '{}' is the variable of a loop; choose another name", name));
    }
    if (!settings_.contains(name)) values_[name] = replaced(line, line.words[2]);
  }

  [[nodiscard]] std::string replaced(const ScriptLine& line, const ScriptWord& word) const {
    std::string text;
    for (const WordPart& part : word) {
      const std::string more = part.isVariable ? valueOf(line, part.text) : part.text;
      spend(line, more.size());
      text += more;
    }
    return text;
  }

  /// Adds `bytes` to the size of the expanded text. Called before the text is stored, so that the
  /// limit also bounds the memory.
  void spend(const ScriptLine& line, std::size_t bytes) const {
    expandedBytes_ += bytes;
    if (expandedBytes_ > kMostExpandedBytes)
      fail(line, fmt::format("the variables and loops expand to more than {} MB of "
                             "text; split the script",
                             kMostExpandedBytes >> 20));
  }

  [[nodiscard]] std::string valueOf(const ScriptLine& line, const std::string& variable) const {
    const auto [name, part] = referenceOf(variable);
    const std::string& value = valueNamed(line, name);
    if (variable.size() == name.size()) return value;
    const std::filesystem::path path = value;
    if (part == "name") return path.filename().string();
    if (part == "dir") return path.has_parent_path() ? path.parent_path().string() : ".";
    if (part == "stem")
      return (path.extension() == ".gz" ? path.stem().stem() : path.stem()).string();
    fail(line, fmt::format("${{{}}}: there is no part '{}'; use stem, name or dir of a file name",
                           variable, part));
  }

  [[nodiscard]] const std::string& valueNamed(const ScriptLine& line,
                                              const std::string& name) const {
    const auto round = std::find_if(rounds_.rbegin(), rounds_.rend(),
                                    [&](const Round& r) { return r.name == name; });
    if (round != rounds_.rend()) return round->value;
    if (const auto it = settings_.find(name); it != settings_.end()) return it->second;
    if (const auto it = values_.find(name); it != values_.end()) return it->second;
    std::string hint = fmt::format("give it with --set {0}=VALUE, or a line `set {0} VALUE`", name);
    std::vector<std::string> known(set_.begin(), set_.end());
    for (const auto& entry : settings_) known.push_back(entry.first);
    for (const Round& each : rounds_) known.push_back(each.name);
    if (!isName(name)) {
      hint = "write ${NAME}, or $${ for a literal ${";
    } else if (set_.contains(name)) {
      hint = "the line that sets it is further down; move it up";
    } else if (const std::string guess = didYouMean(name, known); !guess.empty()) {
      hint = fmt::format("did you mean ${{{}}}?", guess);
    }
    fail(line, fmt::format("${{{}}} has no value; {}", name, hint));
  }

  // === Expanded lines

  void addLine(const ScriptLine& line) {
    std::vector<std::string>& words = script_.words;
    const std::size_t first = words.size();
    if (hasAction_ && plainText(line.words[0]) != "!" && words.back() != "!") words.push_back("!");
    for (const ScriptWord& word : line.words) {
      spend(line, sizeof(std::string));
      words.push_back(replaced(line, word));
    }
    hasAction_ |= !words[first].starts_with("-");
    script_.begins.push_back(first);
    script_.locations.push_back(locationOf(line));
    spend(line, script_.locations.back().size());
    if (script_.begins.size() > kMostActions)
      fail(line, fmt::format("the script expands to more than {} actions; split it", kMostActions));
  }

  [[nodiscard]] std::string locationOf(const ScriptLine& line) const {
    std::string location = fmt::format("{}, line {}", file_, line.number);
    for (const Round& round : rounds_)
      location += fmt::format(", {} = {}", round.name, round.value);
    return location;
  }
  [[nodiscard]] std::string placed(const ScriptLine& line, const std::string& who) const {
    return fmt::format("run: {}: {}", locationOf(line), who);
  }
  [[noreturn]] void fail(const ScriptLine& line, const std::string& sentence) const {
    throw UsageError(placed(line, sentence));
  }

  const std::vector<ScriptLine> lines_;
  const std::string file_;
  const std::map<std::string, std::string>& settings_;
  std::vector<std::size_t> ends_;  // for each line that begins a loop: index of its `end` line
  std::set<std::string> set_;      // names in all `set` lines of the script
  std::map<std::string, std::string> values_;  // values from the `set` lines expanded so far
  std::vector<Round> rounds_;                  // open loops, outermost first
  std::size_t roundCount_ = 0;
  FolderBudget budget_;
  mutable std::size_t expandedBytes_ = 0;
  bool hasAction_ = false;
  Script script_;
};

}  // namespace

const std::string& Script::location(std::size_t word) const {
  const auto after = std::upper_bound(begins.begin(), begins.end(), word);
  return locations[static_cast<std::size_t>(std::max(after - begins.begin(), std::ptrdiff_t{1})) -
                   1];
}

Script readScript(const std::filesystem::path& file,
                  const std::map<std::string, std::string>& settings) {
  return expandScript(readText(file, "run", kMostScriptBytes), file.string(), settings);
}

Script expandScript(const std::string& text, const std::string& name,
                    const std::map<std::string, std::string>& settings) {
  return Expander(splitScript(text, name), name, settings).expand();
}

}  // namespace pipeline
