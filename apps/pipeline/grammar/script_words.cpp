#include "apps/pipeline/grammar/script_words.h"

#include <fmt/core.h>

#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::UsageError;

class Splitter {
 public:
  Splitter(const std::string& text, const std::string& name) : text_(text), name_(name) {}

  /// Reads the next line that has words; returns a line without words at the end of the text.
  ScriptLine nextLine() {
    ScriptLine line;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '\n') {
        ++at_;
        ++line_;
        if (!line.words.empty()) return line;
      } else if (c == ' ' || c == '\t' || c == '\r') {
        ++at_;
      } else if (c == '#') {
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
      } else if (isJoin()) {
        at_ = text_.find('\n', at_) + 1;
        ++line_;
      } else {
        if (line.words.empty()) line.number = line_;
        word_.clear();
        readWord();
        line.words.push_back(word_);
      }
    }
    return line;
  }

 private:
  /// Recognizes a backslash before the end of a line.
  [[nodiscard]] bool isJoin() const { return isAt("\\\n") || isAt("\\\r\n"); }
  [[nodiscard]] bool isAt(std::string_view part) const {
    return text_.compare(at_, part.size(), part) == 0;
  }

  void readWord() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == ' ' || c == '\t' || c == '\r' || c == '\n' || isJoin()) break;
      if (c == '\'' || c == '"') {
        readQuoted(c);
      } else if (c == '\\' && at_ + 1 < text_.size()) {
        add(text_[at_ + 1], true);
        at_ += 2;
      } else {
        readCharacter(false);
      }
    }
  }

  void readQuoted(char quote) {
    const std::size_t begin = line_;
    word_.push_back({.isQuoted = true});  // so that '' is an empty word
    for (++at_; at_ < text_.size() && text_[at_] != quote;) {
      if (quote == '"' && text_[at_] == '\\' && at_ + 1 < text_.size())
        ++at_;
      else if (quote == '"' && text_[at_] == '$') {
        readCharacter(true);
        continue;
      }
      if (text_[at_] == '\n') ++line_;
      add(text_[at_++], true);
    }
    if (at_ >= text_.size())
      fail(begin, fmt::format("the quote {} is not closed; add the closing quote", quote));
    ++at_;
  }

  /// Reads a variable ${NAME}, a literal $${, or one character.
  void readCharacter(bool quoted) {
    if (isAt("$${")) {
      ++at_;
      add(text_[at_++], true);
      add(text_[at_++], true);
    } else if (isAt("${")) {
      const std::size_t end = text_.find_first_of("}\n", at_);
      if (end == std::string::npos || text_[end] == '\n')
        fail(line_, "a ${ is not closed; write ${NAME}, or $${ for a literal ${");
      word_.push_back({text_.substr(at_ + 2, end - at_ - 2), true, quoted});
      at_ = end + 1;
    } else {
      add(text_[at_++], quoted);
    }
  }

  void add(char c, bool quoted) {
    if (word_.empty() || word_.back().isVariable || word_.back().isQuoted != quoted)
      word_.push_back({.isQuoted = quoted});
    word_.back().text += c;
  }

  [[noreturn]] void fail(std::size_t line, const std::string& sentence) const {
    throw UsageError(fmt::format("run: {}, line {}: {}", name_, line, sentence));
  }

  const std::string &text_, &name_;
  ScriptWord word_;  // word being read
  std::size_t at_ = 0, line_ = 1;
};

}  // namespace

std::vector<ScriptLine> splitScript(const std::string& text, const std::string& name) {
  Splitter splitter(text, name);
  std::vector<ScriptLine> lines;
  for (;;) {
    ScriptLine line = splitter.nextLine();
    if (line.words.empty()) return lines;
    lines.push_back(std::move(line));
  }
}

}  // namespace pipeline
