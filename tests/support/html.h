#pragma once

// Strict parser for test pages: every open element must be closed, and every quote must end.

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace support {

struct HtmlTag {
  std::string name;
  std::map<std::string, std::string> attributes;  ///< attribute values, decoded
};

/// Parsed page. After a fault it contains the part before the fault.
class HtmlPage {
 public:
  explicit HtmlPage(const std::string& source) : source_(source) { read(); }

  /// Empty if the page is well-formed.
  [[nodiscard]] const std::string& fault() const { return fault_; }
  /// Text between the tags, decoded.
  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] std::vector<HtmlTag> all(const std::string& name) const {
    std::vector<HtmlTag> found;
    for (const HtmlTag& tag : tags_)
      if (tag.name == name) found.push_back(tag);
    return found;
  }
  [[nodiscard]] bool says(const std::string& words) const {
    return text_.find(words) != std::string::npos;
  }
  [[nodiscard]] std::size_t countOf(const std::string& words) const {
    std::size_t count = 0;
    for (std::size_t i = text_.find(words); i != std::string::npos;
         i = text_.find(words, i + words.size()))
      ++count;
    return count;
  }

 private:
  void read() {
    const std::string doctype = "<!DOCTYPE html>";
    if (!source_.starts_with(doctype)) return refuse("no doctype");
    at_ = doctype.size();
    while (at_ < source_.size() && fault_.empty()) {
      if (source_[at_] == '<')
        readTag();
      else
        readText();
    }
    if (fault_.empty() && !open_.empty()) refuse("open at the end: " + open_.back());
  }

  void refuse(const std::string& what) {
    fault_ = what + " at '" + source_.substr(std::min(at_, source_.size()), 60) + "'";
  }

  void readText() {
    const std::size_t end = std::min(source_.find('<', at_), source_.size());
    text_ += decoded(source_.substr(at_, end - at_));
    at_ = end;
  }

  std::string decoded(const std::string& raw) {
    static const std::map<std::string, std::string> kEntities = {
        {"lt", "<"}, {"gt", ">"}, {"amp", "&"}, {"quot", "\""}, {"#39", "'"}, {"nbsp", " "}};
    std::string result;
    for (std::size_t i = 0; i < raw.size(); ++i) {
      if (raw[i] == '<' || raw[i] == '>') refuse("a bare bracket in text");
      if (raw[i] != '&') {
        result += raw[i];
        continue;
      }
      const std::size_t end = raw.find(';', i);
      const auto entity = end == std::string::npos ? kEntities.end()
                                                   : kEntities.find(raw.substr(i + 1, end - i - 1));
      if (entity == kEntities.end()) {
        refuse("a bare ampersand");
        return result;
      }
      result += entity->second;
      i = end;
    }
    return result;
  }

  std::string readName() {
    const std::size_t begin = at_;
    while (at_ < source_.size() &&
           (std::isalnum(static_cast<unsigned char>(source_[at_])) || source_[at_] == '-'))
      ++at_;
    return source_.substr(begin, at_ - begin);
  }

  bool skip(char c) {
    if (at_ >= source_.size() || source_[at_] != c) return false;
    ++at_;
    return true;
  }

  void readTag() {
    ++at_;
    if (skip('/')) {
      const std::string name = readName();
      if (!skip('>') || open_.empty() || open_.back() != name) return refuse("closes " + name);
      open_.pop_back();
      return;
    }
    HtmlTag tag{.name = readName(), .attributes = {}};
    if (tag.name.empty()) return refuse("no name of a tag");
    while (skip(' '))
      if (!readAttribute(tag)) return refuse("no attribute of " + tag.name);
    if (!skip('>')) return refuse("no end of " + tag.name);
    static const std::set<std::string> kVoid = {"meta", "br", "img"};
    if (!kVoid.contains(tag.name)) open_.push_back(tag.name);
    if (tag.name == "style") at_ = std::min(source_.find("</style>", at_), source_.size());
    tags_.push_back(std::move(tag));
  }

  bool readAttribute(HtmlTag& tag) {
    const std::string name = readName();
    if (name.empty() || tag.attributes.contains(name) || !skip('=') || !skip('"')) return false;
    const std::size_t end = source_.find('"', at_);
    if (end == std::string::npos) return false;
    tag.attributes[name] = decoded(source_.substr(at_, end - at_));
    at_ = end + 1;
    return true;
  }

  const std::string& source_;
  std::size_t at_ = 0;
  std::vector<std::string> open_;
  std::vector<HtmlTag> tags_;
  std::string text_, fault_;
};

}  // namespace support
