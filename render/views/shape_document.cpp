#include "render/views/shape_document.h"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <system_error>
#include <tuple>

#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/files/json_text.h"

namespace render {

void ShapeDocument::refuse(const std::string& what) const {
  throw levelset::InvalidInput(fmt::format("the file {}; {}", what, help));
}

const ShapeJson& ShapeDocument::member(const ShapeJson& json, const char* name) const {
  if (!json.is_object() || !json.contains(name)) refuse(fmt::format("has no \"{}\"", name));
  return json.at(name);
}

void ShapeDocument::requireKnown(const ShapeJson& json, const std::vector<std::string>& known,
                                 const char* object) const {
  if (!json.is_object()) refuse(fmt::format("has {} that is not an object", object));
  for (const auto& [name, value] : json.items())
    if (std::find(known.begin(), known.end(), name) == known.end())
      refuse(fmt::format("has an unknown \"{}\"", name));
}

double ShapeDocument::number(const ShapeJson& value, const char* where) const {
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    refuse(fmt::format("has a number in \"{}\" that is not finite", where));
  return value.get<double>();
}

std::vector<double> ShapeDocument::numbers(const ShapeJson& list, const char* where) const {
  if (!list.is_array()) refuse(fmt::format("has a \"{}\" that is not a list", where));
  std::vector<double> result;
  result.reserve(list.size());
  for (const ShapeJson& entry : list) result.push_back(number(entry, where));
  return result;
}

ShapeJson ShapeDocument::parsed(const std::string& text) const {
  if (levelset::isJsonTooDeep(text)) refuse("has too deeply nested lists");
  ShapeJson json = ShapeJson::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded())
    refuse("is not a JSON document, is truncated, or has a number that is not finite");
  if (const auto key = levelset::repeatedKey(text))
    refuse(fmt::format("lists \"{}\" twice in one object", *key));
  if (member(json, "format") != format) refuse(fmt::format("is not {}", noun));
  if (number(member(json, "version"), "version") != kVersion)
    refuse(fmt::format("does not have version {}", kVersion));
  return json;
}

bool ShapeDocument::isIn(const std::filesystem::path& file) const {
  return levelset::jsonFormat(file) == format;
}

void writeShapeJson(const std::filesystem::path& file, const ShapeJson& json) {
  levelset::FileTarget target(file);
  {
    std::ofstream stream(target.path(), std::ios::binary);
    stream << json.dump() << '\n';
    stream.flush();
    if (!stream)
      throw levelset::IoError(
          fmt::format("{} cannot be written; check the free disk space", file.string()));
  }
  target.commit();
}

}  // namespace render
