#include "levelset/deform/lattice_file.h"

#include <fmt/core.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/files/json_text.h"

namespace levelset {
namespace {

using Imath::V3d;
using Json = nlohmann::ordered_json;

constexpr const char* kLatticeFormat = "levelsmith lattice";
constexpr int kLatticeVersion = 1;

Json jsonOf(const V3d& p) {
  return {p.x, p.y, p.z};
}

/// Reads the members of the JSON document of a lattice.
class LatticeReader {
 public:
  [[noreturn]] void refuse(const std::string& what) const {
    throw InvalidInput(fmt::format("the file {}; write the lattice again", what));
  }

  [[nodiscard]] const Json& member(const Json& json, const char* name) const {
    if (!json.is_object() || !json.contains(name)) refuse(fmt::format("has no \"{}\"", name));
    return json.at(name);
  }

  [[nodiscard]] double number(const Json& value, const std::string& where) const {
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      refuse(fmt::format("has a {} that is not a finite number", where));
    return value.get<double>();
  }

  [[nodiscard]] std::vector<double> numbers(const Json& list, const std::string& where) const {
    if (!list.is_array()) refuse(fmt::format("has a {} that is not a list", where));
    std::vector<double> result;
    for (const Json& entry : list)
      result.push_back(number(entry, fmt::format("number {} of {}", result.size(), where)));
    return result;
  }

  [[nodiscard]] V3d point(const Json& value, const std::string& where) const {
    const std::vector<double> numbers = this->numbers(value, where);
    if (numbers.size() != 3) refuse(fmt::format("has a {} without three numbers", where));
    return {numbers[0], numbers[1], numbers[2]};
  }

  [[nodiscard]] std::array<std::size_t, 3> counts(const Json& json, const char* name,
                                                  double most) const {
    const V3d given = point(member(json, name), fmt::format("\"{}\"", name));
    std::array<std::size_t, 3> result{};
    for (int axis = 0; axis < 3; ++axis) {
      const double value = given[axis];
      if (!(value >= 1) || value > most || value != std::floor(value))
        refuse(fmt::format("has {} in \"{}\", not an integer from 1 to {}", value, name, most));
      result[static_cast<std::size_t>(axis)] = static_cast<std::size_t>(value);
    }
    return result;
  }

  [[nodiscard]] Imath::M44d frame(const Json& json) const {
    if (json.contains("min")) {
      if (json.contains("origin")) refuse("has both \"min\" and \"origin\"");
      return frameOf({point(json.at("min"), "\"min\""), point(member(json, "max"), "\"max\"")});
    }
    const V3d origin = point(member(json, "origin"), "\"origin\"");
    const Json& edges = member(json, "edges");
    if (!edges.is_array() || edges.size() != 3) refuse("has \"edges\" that are not three");
    Imath::M44d frame;
    for (int axis = 0; axis < 3; ++axis) {
      const V3d edge = point(edges[static_cast<std::size_t>(axis)], "edge");
      for (int c = 0; c < 3; ++c) frame[axis][c] = edge[c];
      frame[3][axis] = origin[axis];
    }
    return frame;
  }
};

ControlLattice latticeOfText(const std::string& text) {
  const LatticeReader reader;
  if (isJsonTooDeep(text)) reader.refuse("has too deeply nested lists");
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded())
    reader.refuse("is not a JSON document, is truncated, or has a number that is not finite");
  if (const auto key = repeatedKey(text))
    reader.refuse(fmt::format("lists \"{}\" twice in one object", *key));
  if (reader.member(json, "format") != kLatticeFormat) reader.refuse("is not a lattice file");
  if (reader.number(reader.member(json, "version"), "\"version\"") != kLatticeVersion)
    reader.refuse(fmt::format("does not have version {}", kLatticeVersion));
  const auto counts = reader.counts(json, "count", static_cast<double>(kMostControlPoints));
  const V3d degrees = reader.point(reader.member(json, "degree"), "\"degree\"");
  const Json& points = reader.member(json, "points");
  if (!points.is_array()) reader.refuse("has \"points\" that are not a list");
  // Before any list of that length is built.
  const double listed = static_cast<double>(counts[0]) * static_cast<double>(counts[1]) *
                        static_cast<double>(counts[2]);
  if (static_cast<double>(points.size()) != listed)
    reader.refuse(
        fmt::format("has {} control points, but its \"count\" needs {}", points.size(), listed));
  LatticeData data;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double degree = degrees[static_cast<int>(axis)];
    if (degree != std::floor(degree) || !(std::abs(degree) <= 1000))
      throw InvalidInput(fmt::format(
          "the degree of the lattice is {}; give an integer from 1 to {}", degree, kMostDegree));
    data.axes[axis] = uniformAxis(static_cast<int>(degree), counts[axis]);
  }
  if (json.contains("knots")) {
    const Json& knots = json.at("knots");
    if (!knots.is_array() || knots.size() != 3)
      reader.refuse("has \"knots\" that are not three lists");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::vector<double> list =
          reader.numbers(knots[axis], fmt::format("list {} of \"knots\"", axis));
      const std::size_t wanted = data.axes[axis].knots.size();
      if (list.size() != wanted)
        reader.refuse(fmt::format("has {} knots instead of {} in list {} of \"knots\"", list.size(),
                                  wanted, axis));
      data.axes[axis].knots = std::move(list);
    }
  }
  data.boxToWorld = reader.frame(json);
  for (const Json& entry : points)
    data.points.push_back(reader.point(entry, fmt::format("point {}", data.points.size())));
  if (json.contains("weights")) data.weights = reader.numbers(json.at("weights"), "\"weights\"");
  if (json.contains("weights") && data.weights.empty())
    reader.refuse("has no weights in \"weights\"");
  return ControlLattice(std::move(data));
}

}  // namespace

bool isLatticeFile(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return false;
  std::ifstream stream(file, std::ios::binary);
  bool isFormat = false, result = false;
  const auto visit = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (depth == 1 && event == Json::parse_event_t::key)
      isFormat = parsed == "format";
    else if (depth == 1 && event == Json::parse_event_t::value && isFormat)
      result = parsed == kLatticeFormat;
    return depth < 2;  // keeps no nested list
  };
  std::ignore = Json::parse(stream, visit, /*allow_exceptions=*/false);
  return result;
}

void writeLattice(const std::filesystem::path& file, const ControlLattice& lattice) {
  const LatticeData& data = lattice.data();
  Json json;
  json["format"] = kLatticeFormat;
  json["version"] = kLatticeVersion;
  json["degree"] = {data.axes[0].degree, data.axes[1].degree, data.axes[2].degree};
  json["count"] = {data.axes[0].count(), data.axes[1].count(), data.axes[2].count()};
  const Imath::M44d& m = data.boxToWorld;
  json["origin"] = jsonOf(V3d(m[3][0], m[3][1], m[3][2]));
  json["edges"] = Json::array();
  for (int axis = 0; axis < 3; ++axis)
    json["edges"].push_back(jsonOf(V3d(m[axis][0], m[axis][1], m[axis][2])));
  json["knots"] = Json::array();
  for (const LatticeAxis& axis : data.axes) json["knots"].push_back(axis.knots);
  json["points"] = Json::array();
  for (const V3d& p : data.points) json["points"].push_back(jsonOf(p));
  if (!data.weights.empty()) json["weights"] = data.weights;
  FileTarget target(file);
  {
    std::ofstream stream(target.path(), std::ios::binary);
    stream << json.dump() << '\n';
    stream.flush();
    if (!stream)
      throw IoError(fmt::format("{} cannot be written; check the free disk space", file.string()));
  }
  target.commit();
}

ControlLattice parseLattice(const std::string& text, const std::string& name) {
  return withContext(name, [&] { return latticeOfText(text); });
}

ControlLattice readLattice(const std::filesystem::path& file, std::size_t maxMemory) {
  return parseLattice(readJsonText(file, "a lattice file", maxMemory), file.string());
}

}  // namespace levelset
