#include "render/views/bezier_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/files/json_text.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress.h"
#include "render/scene/csg_expression.h"
#include "render/views/shape_document.h"

namespace render {
namespace {

using levelset::InvalidInput;
constexpr std::size_t kMostAttributes = 64;
constexpr ShapeDocument kBezierDocument{"levelsmith bezier volume", "a Bézier volume",
                                        "docs/bezier.md describes the format of Bézier volumes"};

/// Integers from 1 to `most`, one for each of two or three axes. @param axes  0: either
[[nodiscard]] std::vector<int> axisIntegers(const ShapeJson& json, const char* name, int most,
                                            std::size_t axes) {
  const std::vector<double> given =
      kBezierDocument.numbers(kBezierDocument.member(json, name), name);
  if (axes == 0 && given.size() != 2 && given.size() != 3)
    kBezierDocument.refuse(fmt::format("has a \"{}\" without two or three numbers", name));
  if (axes != 0 && given.size() != axes)
    kBezierDocument.refuse(
        fmt::format("has {} numbers in \"{}\", not {}", given.size(), name, axes));
  std::vector<int> result(given.size());
  for (std::size_t axis = 0; axis < given.size(); ++axis) {
    if (!(given[axis] >= 1) || given[axis] > most || given[axis] != std::floor(given[axis]))
      kBezierDocument.refuse(
          fmt::format("has {} in \"{}\", not an integer from 1 to {}", given[axis], name, most));
    result[axis] = static_cast<int>(given[axis]);
  }
  return result;
}

/// Points of a trimming curve.
std::vector<Imath::V2d> trimPoints(const ShapeJson& list) {
  if (!list.is_array()) kBezierDocument.refuse("has a trimming curve whose points are not a list");
  std::vector<Imath::V2d> points;
  for (const ShapeJson& entry : list) {
    const std::vector<double> row = kBezierDocument.numbers(entry, "trims");
    if (row.size() != 2)
      kBezierDocument.refuse(
          fmt::format("has a point of {} numbers in \"trims\", not two parameters", row.size()));
    points.emplace_back(row[0], row[1]);
  }
  return points;
}

/// Loop of trimming curves: {"polyline": points}, or {"curves": [{"points", "weights"}, …]}.
TrimLoop trimLoop(const ShapeJson& json) {
  kBezierDocument.requireKnown(json, {"polyline", "curves"}, "a trimming loop");
  if (json.contains("polyline") == json.contains("curves"))
    kBezierDocument.refuse("has a trimming loop without one of \"polyline\" and \"curves\"");
  if (json.contains("polyline")) {
    const std::vector<Imath::V2d> points = trimPoints(json.at("polyline"));
    if (points.size() < 3) kBezierDocument.refuse("has a \"polyline\" of fewer than three points");
    return polylineLoop(points);
  }
  if (!json.at("curves").is_array()) kBezierDocument.refuse("has \"curves\" that are not a list");
  TrimLoop loop;
  for (const ShapeJson& entry : json.at("curves")) {
    kBezierDocument.requireKnown(entry, {"points", "weights"}, "a trimming curve");
    loop.push_back({trimPoints(kBezierDocument.member(entry, "points")), {}});
    if (entry.contains("weights"))
      loop.back().weights = kBezierDocument.numbers(entry.at("weights"), "weights");
  }
  return loop;
}

/// Cuts the patches of an entry by its "trims".
/// @param volume  the patches before them
void addTrims(const ShapeJson& json, bool isSurface, const SplineVolume& spline,
              const BezierVolume& volume, std::vector<BezierPatch>& patches) {
  if (!json.contains("trims")) {
    if (json.contains("domain")) kBezierDocument.refuse("has a \"domain\" without \"trims\"");
    return;
  }
  // A surface that was written has two layers, and the box of its parameters.
  if (!isSurface && !json.contains("domain"))
    kBezierDocument.refuse("has \"trims\" of a volume; give them to a surface");
  const ShapeJson& list = json.at("trims");
  if (!list.is_array() || list.empty())
    kBezierDocument.refuse("has \"trims\" that are not a list of loops");
  std::vector<TrimLoop> loops;
  for (const ShapeJson& loop : list) loops.push_back(trimLoop(loop));
  // The patches of a spline surface that was written share their loops.
  const PatchTrim* const last = volume.patches.empty() ? nullptr : volume.patches.back().trim.get();
  const auto region = last && last->region->loops() == loops
                          ? last->region
                          : std::make_shared<const TrimRegion>(std::move(loops));
  std::vector<double> domain{0, 0, 1, 1};
  if (json.contains("domain")) {
    domain = kBezierDocument.numbers(json.at("domain"), "domain");
    if (domain.size() != 4 || !(domain[0] < domain[2]) || !(domain[1] < domain[3]))
      kBezierDocument.refuse("has a \"domain\" that is not [u0, v0, u1, v1] with u0 < u1, v0 < v1");
  }
  trimPatches(spline, region, patches, {{domain[0], domain[1]}, {domain[2], domain[3]}});
}

ShapeJson trimsJson(const TrimRegion& region) {
  const auto pair = [](const Imath::V2d& p) { return ShapeJson{p.x, p.y}; };
  ShapeJson list = ShapeJson::array();
  for (const TrimLoop& loop : region.loops()) {
    const bool isPolyline = std::all_of(loop.begin(), loop.end(), [](const TrimCurve& curve) {
      return curve.points.size() == 2 && curve.weights.empty();
    });
    ShapeJson members = ShapeJson::array();
    for (const TrimCurve& curve : loop) {
      if (isPolyline && loop.size() > 2) {
        members.push_back(pair(curve.points[0]));
        continue;
      }
      ShapeJson entry;
      for (const Imath::V2d& p : curve.points) entry["points"].push_back(pair(p));
      if (!curve.weights.empty()) entry["weights"] = curve.weights;
      members.push_back(std::move(entry));
    }
    list.push_back({{isPolyline && loop.size() > 2 ? "polyline" : "curves", std::move(members)}});
  }
  return list;
}

/// Adds the patches of one entry of the list.
void addPatches(const ShapeJson& json, std::size_t attributes, std::size_t maxMemory,
                BezierVolume& volume) {
  kBezierDocument.requireKnown(
      json, {"degree", "count", "points", "weights", "knots", "trims", "domain"}, "a patch");
  std::vector<int> degree = axisIntegers(json, "degree", levelset::kMostDegree, 0);
  const bool isSurface = degree.size() == 2;
  std::vector<int> count;
  for (const int of : degree) count.push_back(of + 1);
  if (json.contains("count")) count = axisIntegers(json, "count", 1'000'000, degree.size());
  if (isSurface && attributes != 1)
    kBezierDocument.refuse("has a surface beside several attributes");
  const std::size_t numbers = isSurface ? 3 : 3 + attributes;
  if (isSurface) {  // two equal layers
    degree.push_back(1);
    count.push_back(2);
  }
  const ShapeJson& points = kBezierDocument.member(json, "points");
  // Before any list of that length is built.
  const double listed = 1.0 * count[0] * count[1] * (isSurface ? 1 : count[2]);
  if (!points.is_array() || static_cast<double>(points.size()) != listed)
    kBezierDocument.refuse(
        fmt::format("has {} control points, but its \"count\" or \"degree\" needs {}",
                    points.is_array() ? points.size() : 0, listed));
  SplineVolume spline;
  for (std::size_t axis = 0; axis < 3; ++axis)
    spline.axes[axis] = levelset::uniformAxis(degree[axis], static_cast<std::size_t>(count[axis]));
  if (json.contains("knots")) {
    const ShapeJson& knots = json.at("knots");
    const std::size_t axes = isSurface ? 2 : 3;
    if (!knots.is_array() || knots.size() != axes)
      kBezierDocument.refuse(fmt::format("has \"knots\" that are not {} lists", axes));
    for (std::size_t axis = 0; axis < axes; ++axis) {
      std::vector<double> list = kBezierDocument.numbers(knots[axis], "knots");
      const std::size_t wanted = spline.axes[axis].knots.size();
      if (list.size() != wanted)
        kBezierDocument.refuse(fmt::format("has {} knots instead of {} in list {} of \"knots\"",
                                           list.size(), wanted, axis));
      spline.axes[axis].knots = std::move(list);
    }
  }
  spline.attributes.resize(attributes);
  for (const ShapeJson& entry : points) {
    const std::vector<double> row = kBezierDocument.numbers(entry, "points");
    if (row.size() != numbers)
      kBezierDocument.refuse(
          fmt::format("has a point of {} numbers, not {}: three coordinates and "
                      "{} attribute{}",
                      row.size(), numbers, numbers - 3, numbers == 4 ? "" : "s"));
    spline.points.emplace_back(row[0], row[1], row[2]);
    for (std::size_t a = 0; a + 3 < numbers; ++a) spline.attributes[a].push_back(row[3 + a]);
  }
  if (json.contains("weights")) {
    spline.weights = kBezierDocument.numbers(json.at("weights"), "weights");
    if (spline.weights.size() != spline.points.size())
      kBezierDocument.refuse(fmt::format("has {} weights for {} control points",
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
    addTrims(json, isSurface, spline, volume, patch);
    volume.patches.push_back(std::move(patch[0]));
    return;
  }
  double converted = 4 + static_cast<double>(spline.attributes.size());
  for (std::size_t axis = 0; axis < 3; ++axis)
    converted *= (degree[axis] + 1.0) * (1.0 * count[axis] - degree[axis]);
  levelset::requireMemory(2 * sizeof(double) * converted, levelset::memoryLeft(maxMemory));
  std::vector<BezierPatch> patches = bezierPatches(spline);
  addTrims(json, isSurface, spline, volume, patches);
  for (BezierPatch& patch : patches) volume.patches.push_back(std::move(patch));
}

BezierVolume volumeOfText(const std::string& text, std::size_t maxMemory) {
  const ShapeJson json = kBezierDocument.parsed(text);
  kBezierDocument.requireKnown(
      json, {"format", "version", "isovalue", "attributes", "expression", "patches"}, "a document");
  BezierVolume volume;
  if (json.contains("isovalue"))
    volume.isovalue = kBezierDocument.number(json.at("isovalue"), "isovalue");
  std::vector<std::string> names{"a"};
  if (json.contains("attributes")) {
    const ShapeJson& list = json.at("attributes");
    if (!list.is_array() || list.empty() || list.size() > kMostAttributes)
      kBezierDocument.refuse(
          fmt::format("has \"attributes\" that are not a list of 1 to {} names", kMostAttributes));
    names.clear();
    for (const ShapeJson& name : list) {
      if (!name.is_string())
        kBezierDocument.refuse("has a name in \"attributes\" that is not a text");
      names.push_back(name.get<std::string>());
    }
  }
  if (json.contains("expression")) {
    const ShapeJson& expression = json.at("expression");
    if (!expression.is_string()) kBezierDocument.refuse("has an \"expression\" that is no text");
    volume.expression = CsgExpression(expression.get<std::string>(), names).postfix();
  }
  const ShapeJson& patches = kBezierDocument.member(json, "patches");
  if (!patches.is_array()) kBezierDocument.refuse("has \"patches\" that are not a list");
  for (std::size_t n = 0; n < patches.size(); ++n)
    levelset::withContext(fmt::format("entry {} of \"patches\"", n + 1),
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
  return kBezierDocument.isIn(file);
}

BezierVolume parseBezierVolume(const std::string& text, const std::string& name) {
  return levelset::withContext(name, [&] { return volumeOfText(text, levelset::kNoMemoryLimit); });
}

BezierVolume readBezierVolume(const std::filesystem::path& file, std::size_t maxMemory) {
  const std::string text = levelset::readJsonText(file, "the file of a Bézier volume", maxMemory);
  return levelset::withContext(file.string(), [&] { return volumeOfText(text, maxMemory); });
}

void writeBezierVolume(const std::filesystem::path& file, const BezierVolume& volume) {
  ShapeJson json;
  json["format"] = kBezierDocument.format;
  json["version"] = ShapeDocument::kVersion;
  json["isovalue"] = volume.isovalue;
  json["attributes"] = ShapeJson::array();
  for (std::size_t a = 0; a < volume.attributeCount(); ++a)
    json["attributes"].push_back(fmt::format("a{}", a));
  if (!volume.expression.empty()) json["expression"] = textOf(volume.expression);
  json["patches"] = ShapeJson::array();
  for (const BezierPatch& patch : volume.patches) {
    ShapeJson entry;
    entry["degree"] = patch.degree;
    ShapeJson points = ShapeJson::array();
    for (std::size_t n = 0; n < patch.points.size(); ++n) {
      const Imath::V3d& p = patch.points[n];
      ShapeJson row = {p.x, p.y, p.z};
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
  writeShapeJson(file, json);
}

}  // namespace render
