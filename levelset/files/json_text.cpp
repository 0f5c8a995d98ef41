#include "levelset/files/json_text.h"

#include <fmt/core.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <tuple>
#include <vector>

#include "levelset/error.h"

namespace levelset {
namespace {

/// Visits the parts of a JSON text without keeping them.
class JsonVisitor : public nlohmann::json_sax<nlohmann::json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_array(std::size_t) override { return true; }
  bool end_array() override { return true; }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override {
    return false;
  }
};

/// Stops at a repeated key.
class KeyVisitor : public JsonVisitor {
 public:
  std::optional<std::string> repeated;

  bool start_object(std::size_t) override {
    open_.emplace_back();
    return true;
  }
  bool end_object() override {
    open_.pop_back();
    return true;
  }
  bool key(string_t& name) override {
    if (!open_.back().insert(name).second) repeated = name;
    return !repeated;
  }

 private:
  std::vector<std::set<std::string>> open_;  ///< keys of the objects that are not closed
};

/// Stops at the text of the key "format" of the document.
class FormatVisitor : public JsonVisitor {
 public:
  std::optional<std::string> format;

  bool start_object(std::size_t) override { return open(); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    isFormat_ = depth_ == 1 && name == "format";
    return true;
  }
  bool string(string_t& text) override {
    if (isFormat_ && depth_ == 1) format = text;
    return !format;
  }

 private:
  bool open() { return ++depth_ > 0; }
  bool close() { return --depth_ >= 0; }

  int depth_ = 0;
  bool isFormat_ = false;
};

}  // namespace

std::optional<std::string> repeatedKey(const std::string& text) {
  KeyVisitor visitor;
  std::ignore = nlohmann::json::sax_parse(text, &visitor);
  return visitor.repeated;
}

std::optional<std::string> jsonFormat(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return std::nullopt;
  std::ifstream stream(file, std::ios::binary);
  FormatVisitor visitor;
  std::ignore = nlohmann::json::sax_parse(stream, &visitor);
  return visitor.format;
}

std::string readJsonText(const std::filesystem::path& file, const char* wanted,
                         std::size_t maxMemory) {
  std::error_code failed;
  if (std::filesystem::is_directory(file, failed))
    throw IoError(fmt::format("{} is a folder; give {}", file.string(), wanted));
  const auto size = std::filesystem::file_size(file, failed);
  if (!failed) requireMemory(kJsonBytesPerCharacter * static_cast<double>(size), maxMemory);
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream)
    throw IoError(fmt::format("{} cannot be read; check its name and permissions", file.string()));
  return text;
}

}  // namespace levelset
