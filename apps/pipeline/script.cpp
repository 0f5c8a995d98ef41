#include "apps/pipeline/script.h"

#include <fmt/core.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <sstream>
#include <system_error>

#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::IoError;
using levelset::UsageError;

std::string textOf(const std::filesystem::path& file) {
  std::ostringstream text;
  if (file == "-") {
    text << std::cin.rdbuf();
    return text.str();
  }
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    throw IoError(fmt::format("run: '{}' is a directory; name a file", file.string()));
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    throw IoError(fmt::format("run: '{}' cannot be read: {}; check the name and its permissions",
                              file.string(), std::strerror(errno)));
  }
  text << in.rdbuf();
  return text.str();
}

/// Splits a text into lines of words as a shell would.
class Splitter {
 public:
  Splitter(std::string text, std::string name) : text_(std::move(text)), name_(std::move(name)) {}

  /// The words of the next line that has any; empty at the end.
  std::vector<std::string> nextLine() {
    std::vector<std::string> words;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '\n') {
        ++at_;
        ++line_;
        if (!words.empty()) return words;
      } else if (c == ' ' || c == '\t' || c == '\r') {
        ++at_;
      } else if (c == '#') {
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
      } else if (isJoin()) {
        at_ = text_.find('\n', at_) + 1;
        ++line_;
      } else {
        if (words.empty()) first_ = line_;
        words.push_back(word());
      }
    }
    return words;
  }
  /// Where the line that nextLine() gave begins.
  [[nodiscard]] std::size_t line() const { return first_; }

 private:
  /// A backslash before the end of the line.
  [[nodiscard]] bool isJoin() const {
    return text_.compare(at_, 2, "\\\n") == 0 || text_.compare(at_, 3, "\\\r\n") == 0;
  }

  std::string word() {
    std::string result;
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == ' ' || c == '\t' || c == '\r' || c == '\n' || isJoin()) break;
      if (c == '\'' || c == '"') {
        quoted(c, result);
      } else if (c == '\\' && at_ + 1 < text_.size()) {
        result += text_[++at_];
      } else {
        result += c;
      }
    }
    return result;
  }

  void quoted(char quote, std::string& result) {
    const std::size_t begin = line_;
    for (++at_; at_ < text_.size() && text_[at_] != quote; ++at_) {
      if (quote == '"' && text_[at_] == '\\' && at_ + 1 < text_.size()) ++at_;
      if (text_[at_] == '\n') ++line_;
      result += text_[at_];
    }
    if (at_ >= text_.size()) {
      throw UsageError(fmt::format("run: {}, line {}: the quote {} is not closed; close it", name_,
                                   begin, quote));
    }
  }

  std::string text_, name_;
  std::size_t at_ = 0, line_ = 1, first_ = 1;
};

}  // namespace

Script readScript(const std::filesystem::path& file) {
  Splitter splitter(textOf(file), file.string());
  Script script;
  bool begun = false;  // an action has been seen
  for (;;) {
    const std::vector<std::string> words = splitter.nextLine();
    if (words.empty()) break;
    const auto add = [&](const std::string& word) {
      script.words.push_back(word);
      script.lines.push_back(splitter.line());
    };
    if (begun && words[0] != "!" && script.words.back() != "!") add("!");
    for (const std::string& word : words) add(word);
    begun |= !words[0].starts_with("-");
  }
  if (!begun) {
    throw UsageError(
        fmt::format("run: '{}' holds no action; write one on each line", file.string()));
  }
  return script;
}

}  // namespace pipeline
