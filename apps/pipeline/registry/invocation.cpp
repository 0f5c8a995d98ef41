#include "apps/pipeline/registry/invocation.h"

#include <fmt/core.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "apps/pipeline/values/units.h"
#include "levelset/error.h"

namespace pipeline {

using levelset::InvalidInput;
using levelset::UsageError;

std::string Invocation::text(const std::string& name) const {
  if (const auto it = options_.find(name); it != options_.end()) return it->second;
  const Param* param = op_->find(name);
  assert(param && "an operator reads a parameter that it does not declare");
  return param->fallback;
}

double Invocation::number(const std::string& name) const {
  return parseNumber(text(name), where(name));
}
long Invocation::integer(const std::string& name) const {
  return parseInteger(text(name), where(name));
}
void Invocation::refuseInteger(const std::string& name, long value) const {
  throw UsageError(
      value < 0 ? fmt::format("{}: {} is too small; give a larger number", where(name), value)
                : fmt::format("{}: {} is too large; give a smaller number", where(name), value));
}
double Invocation::radians(const std::string& name) const {
  return number(name) * 3.14159265358979323846 / 180;
}
std::vector<double> Invocation::numbers(const std::string& name) const {
  return parseNumbers(text(name), where(name));
}
Imath::V3d Invocation::point(const std::string& name) const {
  return parsePoint(text(name), where(name));
}
std::vector<Imath::V3d> Invocation::points(const std::string& name) const {
  return parsePoints(text(name), where(name));
}
Imath::Box3d Invocation::box(const std::string& name) const {
  return parseBox(text(name), where(name));
}
Imath::M44d Invocation::matrix(const std::string& name) const {
  return parseMatrix(text(name), where(name));
}
std::pair<int, int> Invocation::imageSize(const std::string& name) const {
  return parseImageSize(text(name), where(name));
}

void Invocation::setReference(double voxelSize, double diagonal) {
  referenceVoxel_ = voxelSize > 0 ? std::optional(voxelSize) : std::nullopt;
  referenceDiagonal_ = diagonal > 0 ? std::optional(diagonal) : std::nullopt;
}

double Invocation::toWorld(const std::string& name, const std::string& text,
                           const std::string& label) {
  const Length length = parseLength(text, where(name));
  if (!referenceVoxel_ && !referenceDiagonal_ && !operands.empty())
    setReference(operands[0].plan().voxelSize, operands[0].diagonal());
  double world = length.number;
  if (length.unit == Unit::Voxels) {
    if (!referenceVoxel_) {
      throw UsageError(
          fmt::format("{}: '{}' is a length in voxels, but no voxel size is known yet; write "
                      "it in world units",
                      where(name), text));
    }
    world *= *referenceVoxel_;
  } else if (length.unit == Unit::Percent) {
    if (!referenceDiagonal_) {
      throw UsageError(
          fmt::format("{}: '{}' is a share of the first operand's diagonal, but there is no "
                      "operand; write it in world units",
                      where(name), text));
    }
    world *= *referenceDiagonal_ / 100;
  }
  Resolved resolved{.param = label, .written = text, .world = world};
  if (referenceVoxel_) resolved.voxels = world / *referenceVoxel_;
  note(resolved);
  return world;
}

/// Adds a resolved length to the notes. An earlier entry of the same parameter is replaced.
void Invocation::note(const Resolved& length) {
  const auto known =
      std::find_if(notes.lengths.begin(), notes.lengths.end(),
                   [&](const Resolved& other) { return other.param == length.param; });
  if (known == notes.lengths.end())
    notes.lengths.push_back(length);
  else
    *known = length;
}

double Invocation::writtenLength(const std::string& name) const {
  return parseLength(text(name), where(name)).number;
}

double Invocation::length(const std::string& name) {
  return toWorld(name, text(name), name);
}

void Invocation::resolveLengths() {
  const auto isKnown = [&](const std::string& name) {
    return std::any_of(notes.lengths.begin(), notes.lengths.end(), [&](const Resolved& length) {
      return length.param == name || length.param.starts_with(name + "[");
    });
  };
  for (const Param& param : op_->params) {
    const bool isLength = param.type == ParamType::Length || param.type == ParamType::Lengths;
    if (!isLength || isKnown(param.name)) continue;
    const std::string written = text(param.name);
    if (written.empty() || written == "auto") continue;
    if (param.type == ParamType::Length)
      (void)length(param.name);
    else
      (void)lengths(param.name);
  }
}

std::vector<double> Invocation::lengths(const std::string& name) {
  std::vector<double> result;
  const std::string all = text(name);
  for (std::size_t begin = 0; begin <= all.size();) {
    const std::size_t end = std::min(all.find(',', begin), all.size());
    result.push_back(
        toWorld(name, all.substr(begin, end - begin), fmt::format("{}[{}]", name, result.size())));
    begin = end + 1;
  }
  return result;
}

bool Invocation::asksVoxelSize() const {
  if (given("voxel") && given("resolution")) {
    throw UsageError(fmt::format(
        "{}: --voxel and --resolution both set the voxel size; give only one", op_->name));
  }
  return given("voxel") || given("resolution");
}

void Invocation::requireVoxelSize() const {
  if (!asksVoxelSize() && !voxelFollows)
    throw UsageError(
        fmt::format("{}: needs a voxel size; give --voxel L or --resolution N, or --tolerance L "
                    "before the first action",
                    op_->name));
}

double Invocation::voxelSize(double longestSide) {
  requireVoxelSize();
  if (given("voxel")) return countIn(length("voxel"));
  const long resolution = integer("resolution");
  if (!(longestSide > 0)) {
    throw InvalidInput(fmt::format(
        "{}: --resolution {} divides the object's longest side, which is {}; give --voxel",
        op_->name, resolution, longestSide));
  }
  const double voxel = longestSide / static_cast<double>(resolution);
  note({.param = "voxel",
        .written = fmt::format("--resolution {}", resolution),
        .world = voxel,
        .voxels = 1});
  return countIn(voxel);
}

/// Adds the value in voxels to lengths that were resolved before the voxel size was known.
/// @return the voxel size
double Invocation::countIn(double voxel) {
  for (Resolved& length : notes.lengths)
    if (!length.voxels) length.voxels = length.world / voxel;
  return voxel;
}

}  // namespace pipeline
