#include "apps/pipeline/operators/volume_params.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "apps/pipeline/operators/common.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::UsageError;

constexpr const char* kRawOptions[] = {"size", "type", "big-endian", "skip", "spacing", "origin"};

/// Three whole numbers of an option.
Imath::V3i wholeNumbers(const Invocation& in, const std::string& name) {
  const Imath::V3d numbers = in.point(name);
  Imath::V3i whole;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(numbers[axis] >= 1 && numbers[axis] <= 2147483647 &&
          std::floor(numbers[axis]) == numbers[axis]))
      throw UsageError(fmt::format("{}: '{}' must be three whole numbers of at least 1",
                                   in.where(name), in.text(name)));
    whole[axis] = static_cast<int>(numbers[axis]);
  }
  return whole;
}

}  // namespace

std::vector<Param> volumeFileParams() {
  return {{.name = "size",
           .type = ParamType::Point,
           .doc = "for .raw: number of grid points along i (fastest), j and k"},
          {.name = "type",
           .type = ParamType::Choice,
           .doc = "for .raw: type of the numbers",
           .choices = {"u8", "i8", "u16", "i16", "u32", "i32", "f16", "f32", "f64"}},
          {.name = "big-endian",
           .type = ParamType::Flag,
           .doc = "for .raw: the most significant byte of a number is the first"},
          {.name = "skip",
           .type = ParamType::Integer,
           .doc = "for .raw: number of bytes before the first number; default: 0",
           .range = Range::NonNegative},
          {.name = "spacing",
           .type = ParamType::Point,
           .doc = "for .raw: distances between grid points, world units; default: 1,1,1",
           .range = Range::Positive},
          {.name = "origin",
           .type = ParamType::Point,
           .doc = "for .raw: position of the first grid point; default: 0,0,0"},
          {.name = "frame",
           .type = ParamType::Integer,
           .doc = "for NIfTI: number of the volume in a file with several, from 0; default: 0",
           .range = Range::NonNegative}};
}

levelset::ReadVolumeOptions volumeOptions(const Invocation& in) {
  levelset::ReadVolumeOptions options{
      .format = in.given("format") ? in.text("format") : std::string(),
      .maxMemory = in.maxMemory,
      .progress = in.progress};
  if (in.given("frame")) options.frame = in.integerAs<int>("frame");
  if (!levelset::isRawFormat(formatName(in))) return options;
  levelset::RawLayout raw;
  raw.size = wholeNumbers(in, "size");
  raw.type = in.text("type");
  raw.isBigEndian = in.flag("big-endian");
  if (in.given("skip")) raw.skip = in.integerAs<std::size_t>("skip");
  if (in.given("spacing")) raw.spacing = in.point("spacing");
  if (in.given("origin")) raw.origin = in.point("origin");
  options.raw = raw;
  return options;
}

void checkVolumeOptions(const Invocation& in, bool isVolume) {
  const bool isRaw = isVolume && levelset::isRawFormat(formatName(in));
  for (const char* option : kRawOptions)
    if (in.given(option) && !isRaw)
      throw UsageError(fmt::format(
          "read: --{} describes a .raw file, and this one has a header; leave it out", option));
  if (in.given("frame") && !isVolume)
    throw UsageError("read: --frame chooses a volume of a NIfTI file; leave it out");
  if (isRaw && (!in.given("size") || !in.given("type")))
    throw UsageError("read: a .raw file has no header; give --size and --type");
  if (isVolume && in.text("file") == "-")
    throw UsageError("read: a volume cannot be read from standard input; give a file, not -");
  if (isRaw) static_cast<void>(volumeOptions(in));
}

levelset::Volume volumeIn(const Invocation& in, std::size_t operand) {
  const Value& value = in.operands[operand];
  return value.kind() == Kind::Field ? levelset::volumeOf(value.field(), in.maxMemory)
                                     : value.volume();
}

Param insideParam(std::string doc) {
  return {.name = "inside",
          .type = ParamType::Choice,
          .doc = std::move(doc),
          .fallback = "above",
          .choices = {"above", "below"}};
}

void addVolumeGrid(Json& json, const levelset::VolumeGrid& grid) {
  const auto vector = [](const auto& v) { return Json::array({v.x, v.y, v.z}); };
  const Imath::M44d& m = grid.indexToWorld;
  json["size"] = vector(grid.size);
  json["spacing"] = vector(grid.spacing());
  json["origin"] = Json::array({m[3][0], m[3][1], m[3][2]});
  json["orientation"] = grid.orientation();
  // As rows of the matrix that multiplies column vectors, as in NIfTI's sform.
  json["index_to_world"] = Json::array();
  for (int row = 0; row < 3; ++row)
    json["index_to_world"].push_back(Json::array({m[0][row], m[1][row], m[2][row], m[3][row]}));
}

}  // namespace pipeline
