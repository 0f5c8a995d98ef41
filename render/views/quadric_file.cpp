#include "render/views/quadric_file.h"

#include <fmt/core.h>

#include <cmath>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/files/json_text.h"
#include "render/views/shape_document.h"

namespace render {
namespace {

using Imath::V3d;

constexpr ShapeDocument kQuadricDocument{"levelsmith quadrics", "a file of quadrics",
                                         "docs/quadrics.md describes the format of quadrics"};

V3d readVector(const ShapeJson& json, const char* name) {
  const std::vector<double> list = kQuadricDocument.numbers(json, name);
  if (list.size() != 3)
    kQuadricDocument.refuse(fmt::format("has {} numbers in \"{}\", not 3", list.size(), name));
  return {list[0], list[1], list[2]};
}

V3d vectorMember(const ShapeJson& json, const char* name) {
  return readVector(kQuadricDocument.member(json, name), name);
}

float radiusMember(const ShapeJson& json) {
  return static_cast<float>(
      kQuadricDocument.number(kQuadricDocument.member(json, "radius"), "radius"));
}

/// List of a fixed number of positions or vectors.
std::vector<V3d> vectorsMember(const ShapeJson& json, const char* name, std::size_t count) {
  const ShapeJson& list = kQuadricDocument.member(json, name);
  if (!list.is_array() || list.size() != count)
    kQuadricDocument.refuse(fmt::format("has \"{}\" that are not {} lists", name, count));
  std::vector<V3d> result;
  for (const ShapeJson& entry : list) result.push_back(readVector(entry, name));
  return result;
}

Imath::C3f readQuadricColour(const ShapeJson& json) {
  if (!json.contains("colour")) return Quadric().colour;
  const V3d colour = vectorMember(json, "colour");
  for (int c = 0; c < 3; ++c)
    if (!(colour[c] >= 0 && colour[c] <= 1))
      kQuadricDocument.refuse("has a \"colour\" with a number outside 0 … 1");
  return Imath::C3f(V3d(colour));
}

QuadricKind kindNamed(const std::string& name) {
  for (int n = 0; n < kQuadricKinds; ++n)
    if (name == nameOf(static_cast<QuadricKind>(n))) return static_cast<QuadricKind>(n);
  std::string known = "sphere";
  for (int n = 0; n < kQuadricKinds; ++n)
    known += std::string(", ") + nameOf(static_cast<QuadricKind>(n));
  kQuadricDocument.refuse(
      fmt::format("has the unknown kind \"{}\"; the kinds are {}", name, known));
}

/// Checks a primitive and appends it. @param noun  for messages
template <typename Primitive>
void append(std::vector<Primitive>& list, const Primitive& primitive, const char* noun) {
  try {
    requireQuadric(primitive);
  } catch (const levelset::InvalidInput& error) {
    throw levelset::InvalidInput(fmt::format("{} {}", noun, error.what()));
  }
  list.push_back(primitive);
}

void addQuadric(const ShapeJson& json, QuadricModel& model) {
  const ShapeJson& kind = kQuadricDocument.member(json, "kind");
  if (!kind.is_string()) kQuadricDocument.refuse("has a \"kind\" that is not a text");
  const auto name = kind.get<std::string>();
  const Imath::C3f colour = readQuadricColour(json);
  if (name == "sphere") {
    kQuadricDocument.requireKnown(json, {"kind", "centre", "radius", "colour"}, "a sphere");
    append(model.balls,
           Ball{vectorMember(json, "centre"), radiusMember(json), packedColour(colour)},
           "a sphere");
    return;
  }
  if (name == "cylinder" && json.contains("ends")) {
    kQuadricDocument.requireKnown(json, {"kind", "ends", "radius", "colour"}, "a cylinder");
    const std::vector<V3d> ends = vectorsMember(json, "ends", 2);
    append(model.sticks, Stick{ends[0], ends[1], radiusMember(json), packedColour(colour)},
           "a cylinder");
    return;
  }
  Quadric quadric;
  quadric.kind = kindNamed(name);
  const bool hasEnds = quadric.kind != QuadricKind::Ellipsoid;
  std::vector<std::string> known = {"kind", "position", "axes", "colour"};
  if (hasEnds) known.insert(known.end(), {"range", "capped"});
  kQuadricDocument.requireKnown(json, known, "a quadric");
  quadric.position = vectorMember(json, "position");
  const std::vector<V3d> axes = vectorsMember(json, "axes", 3);
  quadric.axes = {axes[0], axes[1], axes[2]};
  quadric.range = defaultRange(quadric.kind);
  quadric.colour = colour;
  if (json.contains("range")) {
    const std::vector<double> range = kQuadricDocument.numbers(json.at("range"), "range");
    if (range.size() != 2)
      kQuadricDocument.refuse(fmt::format("has {} numbers in \"range\", not 2", range.size()));
    quadric.range = {range[0], range[1]};
  }
  if (json.contains("capped")) {
    if (!json.at("capped").is_boolean())
      kQuadricDocument.refuse("has a \"capped\" that is neither true nor false");
    quadric.isCapped = json.at("capped").get<bool>();
  }
  append(model.quadrics, quadric, "a quadric");
}

QuadricModel modelOfText(const std::string& text) {
  const ShapeJson json = kQuadricDocument.parsed(text);
  kQuadricDocument.requireKnown(json, {"format", "version", "quadrics"}, "a document");
  const ShapeJson& list = kQuadricDocument.member(json, "quadrics");
  if (!list.is_array()) kQuadricDocument.refuse("has \"quadrics\" that are not a list");
  QuadricModel model;
  for (std::size_t n = 0; n < list.size(); ++n)
    levelset::withContext(fmt::format("entry {} of \"quadrics\"", n + 1),
                          [&] { addQuadric(list[n], model); });
  if (model.size() == 0)
    kQuadricDocument.refuse("has no quadric; list at least one in \"quadrics\"");
  return model;
}

ShapeJson jsonOf(const V3d& v) {
  return {v.x, v.y, v.z};
}

ShapeJson jsonOf(const Imath::C3f& colour) {
  return {colour.x, colour.y, colour.z};
}

}  // namespace

bool isQuadricFile(const std::filesystem::path& file) {
  return kQuadricDocument.isIn(file);
}

QuadricModel parseQuadrics(const std::string& text, const std::string& name) {
  return levelset::withContext(name, [&] { return modelOfText(text); });
}

QuadricModel readQuadrics(const std::filesystem::path& file, std::size_t maxMemory) {
  const std::string text = levelset::readJsonText(file, "a file of quadrics", maxMemory);
  return levelset::withContext(file.string(), [&] { return modelOfText(text); });
}

void writeQuadrics(const std::filesystem::path& file, const QuadricModel& model) {
  ShapeJson json;
  json["format"] = kQuadricDocument.format;
  json["version"] = ShapeDocument::kVersion;
  ShapeJson list = ShapeJson::array();
  for (const Ball& ball : model.balls)
    list.push_back({{"kind", "sphere"},
                    {"centre", jsonOf(ball.centre)},
                    {"radius", ball.radius},
                    {"colour", jsonOf(unpackedColour(ball.colour))}});
  for (const Stick& stick : model.sticks)
    list.push_back({{"kind", "cylinder"},
                    {"ends", {jsonOf(stick.a), jsonOf(stick.b)}},
                    {"radius", stick.radius},
                    {"colour", jsonOf(unpackedColour(stick.colour))}});
  for (const Quadric& quadric : model.quadrics) {
    ShapeJson entry = {
        {"kind", nameOf(quadric.kind)},
        {"position", jsonOf(quadric.position)},
        {"axes", {jsonOf(quadric.axes[0]), jsonOf(quadric.axes[1]), jsonOf(quadric.axes[2])}}};
    if (quadric.kind != QuadricKind::Ellipsoid) {
      entry["range"] = {quadric.range.low, quadric.range.high};
      entry["capped"] = quadric.isCapped;
    }
    entry["colour"] = jsonOf(quadric.colour);
    list.push_back(std::move(entry));
  }
  json["quadrics"] = std::move(list);
  writeShapeJson(file, json);
}

}  // namespace render
