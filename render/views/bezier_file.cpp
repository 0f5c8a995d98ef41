#include "render/views/bezier_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
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
#include "levelset/memory_limit.h"
#include "levelset/progress.h"
#include "render/scene/csg_expression.h"

namespace render {
namespace {

using levelset::InvalidInput;
using BezierJson = nlohmann::ordered_json;

constexpr const char* kBezierFormat = "levelsmith bezier volume";
constexpr int kBezierVersion = 1;
constexpr std::size_t kMostAttributes = 64;

/// Reads the members of a document.
class BezierReader {
 public:
  [[noreturn]] static void refuse(const std::string& what) {
    throw InvalidInput(
        fmt::format("the file {}; docs/bezier.md describes the format of Bézier volumes", what));
  }

  [[nodiscard]] static const BezierJson& member(const BezierJson& json, const char* name) {
    if (!json.is_object() || !json.contains(name)) refuse(fmt::format("has no \"{}\"", name));
    return json.at(name);
  }

  static void requireKnown(const BezierJson& json, const std::vector<std::string>& known) {
    if (!json.is_object()) refuse("has a patch that is not an object");
    for (const auto& [name, value] : json.items())
      if (std::find(known.begin(), known.end(), name) == known.end())
        refuse(fmt::format("has an unknown \"{}\"", name));
  }

  [[nodiscard]] static double number(const BezierJson& value, const char* where) {
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      refuse(fmt::format("has a number in \"{}\" that is not finite", where));
    return value.get<double>();
  }

  [[nodiscard]] static std::vector<double> numbers(const BezierJson& list, const char* where) {
    if (!list.is_array()) refuse(fmt::format("has a \"{}\" that is not a list", where));
    std::vector<double> result;
    result.reserve(list.size());
    for (const BezierJson& entry : list) result.push_back(number(entry, where));
    return result;
  }

  /// Integers from 1 to `most`, one for each of two or three axes. @param axes  0: either
  [[nodiscard]] static std::vector<int> integers(const BezierJson& json, const char* name, int most,
                                                 std::size_t axes) {
    const std::vector<double> given = numbers(member(json, name), name);
    if (axes == 0 && given.size() != 2 && given.size() != 3)
      refuse(fmt::format("has a \"{}\" without two or three numbers", name));
    if (axes != 0 && given.size() != axes)
      refuse(fmt::format("has {} numbers in \"{}\", not {}", given.size(), name, axes));
    std::vector<int> result(given.size());
    for (std::size_t axis = 0; axis < given.size(); ++axis) {
      if (!(given[axis] >= 1) || given[axis] > most || given[axis] != std::floor(given[axis]))
        refuse(
            fmt::format("has {} in \"{}\", not an integer from 1 to {}", given[axis], name, most));
      result[axis] = static_cast<int>(given[axis]);
    }
    return result;
  }
};

/// Points of a trimming curve.
std::vector<Imath::V2d> trimPoints(const BezierJson& list) {
  if (!list.is_array()) BezierReader::refuse("has a trimming curve whose points are not a list");
  std::vector<Imath::V2d> points;
  for (const BezierJson& entry : list) {
    const std::vector<double> row = BezierReader::numbers(entry, "trims");
    if (row.size() != 2)
      BezierReader::refuse(
          fmt::format("has a point of {} numbers in \"trims\", not two parameters", row.size()));
    points.emplace_back(row[0], row[1]);
  }
  return points;
}

/// Loop of trimming curves: {"polyline": points}, or {"curves": [{"points", "weights"}, …]}.
TrimLoop trimLoop(const BezierJson& json) {
  BezierReader::requireKnown(json, {"polyline", "curves"});
  if (json.contains("polyline") == json.contains("curves"))
    BezierReader::refuse("has a trimming loop without one of \"polyline\" and \"curves\"");
  if (json.contains("polyline")) {
    const std::vector<Imath::V2d> points = trimPoints(json.at("polyline"));
    if (points.size() < 3) BezierReader::refuse("has a \"polyline\" of fewer than three points");
    return polylineLoop(points);
  }
  if (!json.at("curves").is_array()) BezierReader::refuse("has \"curves\" that are not a list");
  TrimLoop loop;
  for (const BezierJson& entry : json.at("curves")) {
    BezierReader::requireKnown(entry, {"points", "weights"});
    loop.push_back({trimPoints(BezierReader::member(entry, "points")), {}});
    if (entry.contains("weights"))
      loop.back().weights = BezierReader::numbers(entry.at("weights"), "weights");
  }
  return loop;
}

/// Cuts the patches of an entry by its "trims".
void addTrims(const BezierJson& json, bool isSurface, const SplineVolume& spline,
              std::vector<BezierPatch>& patches) {
  if (!json.contains("trims")) {
    if (json.contains("domain")) BezierReader::refuse("has a \"domain\" without \"trims\"");
    return;
  }
  // A surface that was written has two layers, and the box of its parameters.
  if (!isSurface && !json.contains("domain"))
    BezierReader::refuse("has \"trims\" of a volume; give them to a surface");
  const BezierJson& list = json.at("trims");
  if (!list.is_array() || list.empty())
    BezierReader::refuse("has \"trims\" that are not a list of loops");
  std::vector<TrimLoop> loops;
  for (const BezierJson& loop : list) loops.push_back(trimLoop(loop));
  const auto region = std::make_shared<const TrimRegion>(std::move(loops));
  std::vector<double> domain{0, 0, 1, 1};
  if (json.contains("domain")) {
    domain = BezierReader::numbers(json.at("domain"), "domain");
    if (domain.size() != 4 || !(domain[0] < domain[2]) || !(domain[1] < domain[3]))
      BezierReader::refuse("has a \"domain\" that is not [u0, v0, u1, v1] with u0 < u1, v0 < v1");
  }
  const auto placed = [&](const Imath::V2d& p) {
    return Imath::V2d(domain[0] * (1 - p.x) + domain[2] * p.x,
                      domain[1] * (1 - p.y) + domain[3] * p.y);
  };
  trimPatches(spline, region, patches);
  for (BezierPatch& patch : patches) {
    const Imath::Box2d box = patch.trim->box;
    patch.trim =
        std::make_shared<const PatchTrim>(PatchTrim{region, {placed(box.min), placed(box.max)}});
  }
}

BezierJson trimsJson(const TrimRegion& region) {
  const auto pair = [](const Imath::V2d& p) { return BezierJson{p.x, p.y}; };
  BezierJson list = BezierJson::array();
  for (const TrimLoop& loop : region.loops()) {
    const bool isPolyline = std::all_of(loop.begin(), loop.end(), [](const TrimCurve& curve) {
      return curve.points.size() == 2 && curve.weights.empty();
    });
    BezierJson members = BezierJson::array();
    for (const TrimCurve& curve : loop) {
      if (isPolyline && loop.size() > 2) {
        members.push_back(pair(curve.points[0]));
        continue;
      }
      BezierJson entry;
      for (const Imath::V2d& p : curve.points) entry["points"].push_back(pair(p));
      if (!curve.weights.empty()) entry["weights"] = curve.weights;
      members.push_back(std::move(entry));
    }
    list.push_back({{isPolyline && loop.size() > 2 ? "polyline" : "curves", std::move(members)}});
  }
  return list;
}

/// Adds the patches of one entry of the list.
void addPatches(const BezierJson& json, std::size_t attributes, std::size_t maxMemory,
                BezierVolume& volume) {
  BezierReader::requireKnown(json,
                             {"degree", "count", "points", "weights", "knots", "trims", "domain"});
  std::vector<int> degree = BezierReader::integers(json, "degree", levelset::kMostDegree, 0);
  const bool isSurface = degree.size() == 2;
  std::vector<int> count;
  for (const int of : degree) count.push_back(of + 1);
  if (json.contains("count"))
    count = BezierReader::integers(json, "count", 1'000'000, degree.size());
  if (isSurface && attributes != 1) BezierReader::refuse("has a surface beside several attributes");
  const std::size_t numbers = isSurface ? 3 : 3 + attributes;
  if (isSurface) {  // two equal layers
    degree.push_back(1);
    count.push_back(2);
  }
  const BezierJson& points = BezierReader::member(json, "points");
  // Before any list of that length is built.
  const double listed = 1.0 * count[0] * count[1] * (isSurface ? 1 : count[2]);
  if (!points.is_array() || static_cast<double>(points.size()) != listed)
    BezierReader::refuse(
        fmt::format("has {} control points, but its \"count\" or \"degree\" needs {}",
                    points.is_array() ? points.size() : 0, listed));
  SplineVolume spline;
  for (std::size_t axis = 0; axis < 3; ++axis)
    spline.axes[axis] = levelset::uniformAxis(degree[axis], static_cast<std::size_t>(count[axis]));
  if (json.contains("knots")) {
    const BezierJson& knots = json.at("knots");
    const std::size_t axes = isSurface ? 2 : 3;
    if (!knots.is_array() || knots.size() != axes)
      BezierReader::refuse(fmt::format("has \"knots\" that are not {} lists", axes));
    for (std::size_t axis = 0; axis < axes; ++axis) {
      std::vector<double> list = BezierReader::numbers(knots[axis], "knots");
      const std::size_t wanted = spline.axes[axis].knots.size();
      if (list.size() != wanted)
        BezierReader::refuse(fmt::format("has {} knots instead of {} in list {} of \"knots\"",
                                         list.size(), wanted, axis));
      spline.axes[axis].knots = std::move(list);
    }
  }
  spline.attributes.resize(attributes);
  for (const BezierJson& entry : points) {
    const std::vector<double> row = BezierReader::numbers(entry, "points");
    if (row.size() != numbers)
      BezierReader::refuse(
          fmt::format("has a point of {} numbers, not {}: three coordinates and "
                      "{} attribute{}",
                      row.size(), numbers, numbers - 3, numbers == 4 ? "" : "s"));
    spline.points.emplace_back(row[0], row[1], row[2]);
    for (std::size_t a = 0; a + 3 < numbers; ++a) spline.attributes[a].push_back(row[3 + a]);
  }
  if (json.contains("weights")) {
    spline.weights = BezierReader::numbers(json.at("weights"), "weights");
    if (spline.weights.size() != spline.points.size())
      BezierReader::refuse(fmt::format("has {} weights for {} control points",
                                       spline.weights.size(), spline.points.size()));
  }
  if (isSurface) {
    BezierPatch layers =
        surfacePatch(count[0] - 1, count[1] - 1, spline.points, spline.weights, volume.isovalue);
    spline.points = std::move(layers.points);
    spline.attributes = std::move(layers.attributes);
    spline.weights = std::move(layers.weights);
  }
  const bool isOnePatch =
      count[0] == degree[0] + 1 && count[1] == degree[1] + 1 && count[2] == degree[2] + 1;
  if (isOnePatch && !json.contains("knots")) {  // the numbers themselves, without rounding
    std::vector<BezierPatch> patch{{{degree[0], degree[1], degree[2]},
                                    std::move(spline.points),
                                    std::move(spline.attributes),
                                    std::move(spline.weights)}};
    addTrims(json, isSurface, spline, patch);
    volume.patches.push_back(std::move(patch[0]));
    return;
  }
  double converted = 4 + static_cast<double>(spline.attributes.size());
  for (std::size_t axis = 0; axis < 3; ++axis)
    converted *= (degree[axis] + 1.0) * (1.0 * count[axis] - degree[axis]);
  levelset::requireMemory(2 * sizeof(double) * converted, levelset::memoryLeft(maxMemory));
  std::vector<BezierPatch> patches = bezierPatches(spline);
  addTrims(json, isSurface, spline, patches);
  for (BezierPatch& patch : patches) volume.patches.push_back(std::move(patch));
}

BezierVolume volumeOfText(const std::string& text, std::size_t maxMemory) {
  if (levelset::isJsonTooDeep(text)) BezierReader::refuse("has too deeply nested lists");
  const BezierJson json = BezierJson::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded())
    BezierReader::refuse(
        "is not a JSON document, is truncated, or has a number that is not finite");
  if (const auto key = levelset::repeatedKey(text))
    BezierReader::refuse(fmt::format("lists \"{}\" twice in one object", *key));
  if (BezierReader::member(json, "format") != kBezierFormat)
    BezierReader::refuse("is not a Bézier volume");
  if (BezierReader::number(BezierReader::member(json, "version"), "version") != kBezierVersion)
    BezierReader::refuse(fmt::format("does not have version {}", kBezierVersion));
  BezierReader::requireKnown(
      json, {"format", "version", "isovalue", "attributes", "expression", "patches"});
  BezierVolume volume;
  if (json.contains("isovalue"))
    volume.isovalue = BezierReader::number(json.at("isovalue"), "isovalue");
  std::vector<std::string> names{"a"};
  if (json.contains("attributes")) {
    const BezierJson& list = json.at("attributes");
    if (!list.is_array() || list.empty() || list.size() > kMostAttributes)
      BezierReader::refuse(
          fmt::format("has \"attributes\" that are not a list of 1 to {} names", kMostAttributes));
    names.clear();
    for (const BezierJson& name : list) {
      if (!name.is_string()) BezierReader::refuse("has a name in \"attributes\" that is no text");
      names.push_back(name.get<std::string>());
    }
  }
  if (json.contains("expression")) {
    const BezierJson& expression = json.at("expression");
    if (!expression.is_string()) BezierReader::refuse("has an \"expression\" that is no text");
    volume.expression = CsgExpression(expression.get<std::string>(), names).postfix();
  }
  const BezierJson& patches = BezierReader::member(json, "patches");
  if (!patches.is_array()) BezierReader::refuse("has \"patches\" that are not a list");
  for (std::size_t n = 0; n < patches.size(); ++n)
    levelset::withContext(fmt::format("entry {} of \"patches\"", n),
                          [&] { addPatches(patches[n], names.size(), maxMemory, volume); });
  requireBezierVolume(volume);
  return volume;
}

/// Text of an expression in postfix notation, with the attributes a0, a1 and so on.
std::string textOf(const std::vector<int>& expression) {
  std::vector<std::string> stack;
  for (const int step : expression) {
    if (step >= 0) {
      stack.push_back(fmt::format("a{}", step));
      continue;
    }
    const std::string right = std::move(stack.back());
    stack.pop_back();
    stack.back() = fmt::format("({} {} {})", stack.back(),
                               step == CsgExpression::Union          ? "|"
                               : step == CsgExpression::Intersection ? "&"
                                                                     : "-",
                               right);
  }
  return stack.back();
}

}  // namespace

bool isBezierFile(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return false;
  std::ifstream stream(file, std::ios::binary);
  bool isFormat = false, result = false;
  const auto visit = [&](int depth, BezierJson::parse_event_t event, BezierJson& parsed) {
    if (depth == 1 && event == BezierJson::parse_event_t::key)
      isFormat = parsed == "format";
    else if (depth == 1 && event == BezierJson::parse_event_t::value && isFormat)
      result = parsed == kBezierFormat;
    return depth < 2;  // keeps no nested list
  };
  std::ignore = BezierJson::parse(stream, visit, /*allow_exceptions=*/false);
  return result;
}

BezierVolume parseBezierVolume(const std::string& text, const std::string& name) {
  return levelset::withContext(name, [&] { return volumeOfText(text, levelset::kNoMemoryLimit); });
}

BezierVolume readBezierVolume(const std::filesystem::path& file, std::size_t maxMemory) {
  const std::string text = levelset::readJsonText(file, "the file of a Bézier volume", maxMemory);
  return levelset::withContext(file.string(), [&] { return volumeOfText(text, maxMemory); });
}

void writeBezierVolume(const std::filesystem::path& file, const BezierVolume& volume) {
  BezierJson json;
  json["format"] = kBezierFormat;
  json["version"] = kBezierVersion;
  json["isovalue"] = volume.isovalue;
  json["attributes"] = BezierJson::array();
  for (std::size_t a = 0; a < volume.attributeCount(); ++a)
    json["attributes"].push_back(fmt::format("a{}", a));
  if (!volume.expression.empty()) json["expression"] = textOf(volume.expression);
  json["patches"] = BezierJson::array();
  for (const BezierPatch& patch : volume.patches) {
    BezierJson entry;
    entry["degree"] = patch.degree;
    BezierJson points = BezierJson::array();
    for (std::size_t n = 0; n < patch.points.size(); ++n) {
      const Imath::V3d& p = patch.points[n];
      BezierJson row = {p.x, p.y, p.z};
      for (const std::vector<double>& attribute : patch.attributes) row.push_back(attribute[n]);
      points.push_back(std::move(row));
    }
    entry["points"] = std::move(points);
    if (!patch.weights.empty()) entry["weights"] = patch.weights;
    if (patch.trim) {
      const Imath::Box2d& box = patch.trim->box;
      entry["trims"] = trimsJson(*patch.trim->region);
      entry["domain"] = {box.min.x, box.min.y, box.max.x, box.max.y};
    }
    json["patches"].push_back(std::move(entry));
  }
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
