#pragma once

#include <fmt/core.h>

#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/fields.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/advection/velocity.h"
#include "levelset/error.h"
#include "levelset/fields/mask.h"
#include "levelset/operator/options.h"

/// Derives the parameters of the command line from the members that an options struct of the
/// library levelset describes (levelset/operator/options.h), and reads their values into such a
/// struct.
namespace pipeline {

/// Type of the value of a member: T for a member of type T or std::optional<T>.
template <class T>
struct OptionValue {
  using Type = T;
  static constexpr bool isOptional = false;
};
template <class T>
struct OptionValue<std::optional<T>> {
  using Type = T;
  static constexpr bool isOptional = true;
};
template <class T>
using OptionValueType = typename OptionValue<T>::Type;

template <class T>
using OptionTable = std::initializer_list<std::pair<const char*, OptionValueType<T>>>;

/// Returns the parameter type for a member of type T. Empty if the member stands for several
/// parameters, as a mask does, or needs a table of words.
template <class T>
constexpr std::optional<ParamType> paramTypeOf(levelset::OptionUnit unit) {
  const bool isLength = unit == levelset::OptionUnit::Length;
  if constexpr (std::is_same_v<T, bool>) return ParamType::Flag;
  if constexpr (std::is_same_v<T, double>) return isLength ? ParamType::Length : ParamType::Number;
  if constexpr (std::is_same_v<T, levelset::Length>) return ParamType::Length;
  if constexpr (std::is_integral_v<T>) return ParamType::Integer;
  if constexpr (std::is_same_v<T, Imath::V3d>)
    return isLength ? ParamType::Lengths : ParamType::Point;
  if constexpr (std::is_same_v<T, std::vector<Imath::V3d>>) return ParamType::Points;
  if constexpr (std::is_same_v<T, std::vector<double>>) return ParamType::Numbers;
  if constexpr (std::is_same_v<T, Imath::Box3d>) return ParamType::Box;
  if constexpr (std::is_same_v<T, Imath::M44d>) return ParamType::Matrix;
  if constexpr (std::is_same_v<T, std::string>) return ParamType::Text;
  if constexpr (std::is_same_v<T, levelset::ScalarField>) return ParamType::Scalar;
  if constexpr (std::is_same_v<T, levelset::Attribute>) return ParamType::Scalar;
  if constexpr (std::is_same_v<T, levelset::NamedVelocity>) return ParamType::Velocity;
  if constexpr (std::is_same_v<T, levelset::NormalSpeed>) return ParamType::Speed;
  return {};
}

/// Visitor for `describe` of an options struct: builds one command-line parameter for each member.
template <class Options>
class ParamCollector {
 public:
  template <class T, class Owner>
  void operator()(const char* name, T Owner::*member, const levelset::OptionInfo& info) {
    using Bare = OptionValueType<T>;
    if constexpr (std::is_same_v<Bare, levelset::Mask>) {
      params = withMask(std::move(params));
    } else if constexpr (std::is_same_v<Bare, levelset::VoxelSize>) {
      params.push_back(voxelParam());
      params.push_back(resolutionParam());
    } else {
      static_assert(paramTypeOf<Bare>({}).has_value(),
                    "a member of this type needs a table of words");
      Param param = makeParam(name, *paramTypeOf<Bare>(info.unit), info);
      if (param.type == ParamType::Lengths) param.count = 3;
      if constexpr (std::is_same_v<Bare, levelset::NamedVelocity>)
        param.choices = levelset::velocityNames();
      if constexpr (!OptionValue<T>::isOptional)
        if (!info.required) param.fallback = textOf(defaults_.*member);
      params.push_back(std::move(param));
    }
  }

  template <class T, class Owner>
  void operator()(const char* name, T Owner::*member, OptionTable<T> table,
                  const levelset::OptionInfo& info) {
    Param param = makeParam(name, ParamType::Choice, info);
    for (const auto& [word, value] : table) {
      param.choices.emplace_back(word);
      if constexpr (!OptionValue<T>::isOptional)
        if (!info.required && value == defaults_.*member) param.fallback = word;
    }
    params.push_back(std::move(param));
  }

  std::vector<Param> params;

 private:
  static Param makeParam(const char* name, ParamType type, const levelset::OptionInfo& info) {
    return {.name = name,
            .type = type,
            .doc = info.help,
            .range = info.range,
            .required = info.required,
            .position = info.position,
            .allowsVoxels = info.allowsVoxels,
            .formerName = info.formerName ? info.formerName : ""};
  }

  template <class T>
  static std::string textOf(const T& value) {
    if constexpr (std::is_same_v<T, bool>) return "";
    if constexpr (std::is_same_v<T, std::string>) return value;
    if constexpr (std::is_same_v<T, levelset::Length>)
      return fmt::format("{}{}", value.number, value.isVoxels ? "vx" : "");
    if constexpr (std::is_same_v<T, Imath::V3d>)
      return fmt::format("{},{},{}", value.x, value.y, value.z);
    if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>)
      return fmt::format("{}", value);
    return "";
  }

  const Options defaults_ = {};
};

template <class Options>
std::vector<Param> paramsOf() {
  ParamCollector<Options> collector;
  Options::describe(collector);
  return std::move(collector.params);
}

/// Stage of a run in which options are read. It decides which values are known.
enum class OptionStage {
  Syntax,   ///< before anything runs: a length is the number as written, without its unit; fields
            ///< are zero everywhere
  Partial,  ///< like Syntax, but a length is in world units, or NaN if `vx` or `%` has no operand
            ///< to refer to
  Plan,     ///< operands are plans: lengths are in world units; fields are zero everywhere
  Run       ///< all values are known
};

/// Reads the values of an invocation into an options struct. Members whose option is not given keep
/// their initial value.
template <class Options>
class OptionReader {
 public:
  OptionReader(Invocation& in, OptionStage stage, Options& options)
      : in_(in), stage_(stage), options_(options) {}

  template <class T, class Owner>
  void operator()(const char* name, T Owner::*member, const levelset::OptionInfo& info) {
    using Bare = OptionValueType<T>;
    if constexpr (std::is_same_v<Bare, levelset::Mask>) {
      if (stage_ == OptionStage::Run)
        options_.*member = maskOf(in_);
      else if (in_.given("mask"))
        options_.*member = levelset::Mask{.field = anyField()};
    } else if constexpr (std::is_same_v<Bare, levelset::VoxelSize>) {
      // Left to the caller, since with --resolution the voxel size depends on the size of the
      // object.
    } else if constexpr (std::is_same_v<T, levelset::Length>) {
      options_.*member = levelset::Length::world(length(name));
    } else {
      const bool isLengthWithDefault = info.unit == levelset::OptionUnit::Length &&
                                       !OptionValue<T>::isOptional && !info.required;
      if (in_.given(name) || isLengthWithDefault) options_.*member = valueOf<Bare>(name, info);
    }
  }

  template <class T, class Owner>
  void operator()(const char* name, T Owner::*member, OptionTable<T> table,
                  const levelset::OptionInfo&) {
    if (!in_.given(name)) return;
    const std::string text = in_.text(name);
    for (const auto& [word, value] : table)
      if (text == word) options_.*member = value;
  }

 private:
  static levelset::ScalarField anyField() {
    return [](const Imath::V3d&) { return 0.0; };
  }

  double length(const char* name) {
    if (stage_ == OptionStage::Syntax) return in_.writtenLength(name);
    if (stage_ != OptionStage::Partial) return in_.length(name);
    try {
      return in_.length(name);
    } catch (const levelset::UsageError&) {  // the length is in `%` or `vx`, and there is no
                                             // operand to which they refer
      return std::numeric_limits<double>::quiet_NaN();
    }
  }

  template <class T>
  T valueOf(const char* name, const levelset::OptionInfo& info) {
    const bool isLength = info.unit == levelset::OptionUnit::Length;
    if constexpr (std::is_same_v<T, bool>) {
      return in_.flag(name);
    } else if constexpr (std::is_same_v<T, double>) {
      return isLength ? length(name) : in_.number(name);
    } else if constexpr (std::is_integral_v<T>) {
      return in_.integerAs<T>(name);
    } else if constexpr (std::is_same_v<T, Imath::V3d>) {
      if (!isLength) return in_.point(name);
      if (stage_ == OptionStage::Syntax || stage_ == OptionStage::Partial) return Imath::V3d(0);
      const std::vector<double> sides = in_.lengths(name);
      return {sides[0], sides[1], sides[2]};
    } else if constexpr (std::is_same_v<T, std::vector<Imath::V3d>>) {
      return in_.points(name);
    } else if constexpr (std::is_same_v<T, std::vector<double>>) {
      return in_.numbers(name);
    } else if constexpr (std::is_same_v<T, Imath::Box3d>) {
      return in_.box(name);
    } else if constexpr (std::is_same_v<T, Imath::M44d>) {
      return in_.matrix(name);
    } else if constexpr (std::is_same_v<T, std::string>) {
      return in_.text(name);
    } else if constexpr (std::is_same_v<T, levelset::ScalarField>) {
      return stage_ == OptionStage::Run ? scalarField(in_, name) : anyField();
    } else if constexpr (std::is_same_v<T, levelset::Attribute>) {
      return stage_ == OptionStage::Run ? attribute(in_, name)
                                        : levelset::Attribute{anyField(), {}};
    } else if constexpr (std::is_same_v<T, levelset::NormalSpeed>) {
      return stage_ == OptionStage::Run ? normalSpeed(in_, name) : levelset::speedOf(anyField());
    } else {
      static_assert(std::is_same_v<T, levelset::NamedVelocity>);
      const std::string text = in_.text(name);
      for (const std::string& known : levelset::velocityNames())
        if (text == known) return {.name = known};
      if (stage_ == OptionStage::Run) return {.field = vectorField(in_, name)};
      return {.field = [](const Imath::V3d&, double) { return Imath::V3d(0); }};
    }
  }

  Invocation& in_;
  OptionStage stage_;
  Options& options_;
};

/// Visitor that finds a member of type VoxelSize in an options struct, and sets it to `edge` unless
/// `options` is null.
template <class Options>
struct VoxelSizeSetter {
  Options* options = nullptr;
  double edge = 0;
  bool hasOne = false;

  template <class T, class Owner>
  void operator()(const char*, T Owner::*member, const levelset::OptionInfo&) {
    if constexpr (std::is_same_v<T, levelset::VoxelSize>) {
      hasOne = true;
      if (options) (options->*member).edge = edge;
    }
  }
  template <class T, class Owner>
  void operator()(const char*, T Owner::*, OptionTable<T>, const levelset::OptionInfo&) {}
};

template <class Options>
bool hasVoxelSize() {
  VoxelSizeSetter<Options> visit;
  Options::describe(visit);
  return visit.hasOne;
}

/// Reads all options except a member of type VoxelSize.
template <class Options>
Options readOptions(Invocation& in, OptionStage stage) {
  Options options;
  OptionReader<Options> reader(in, stage, options);
  Options::describe(reader);
  return options;
}

}  // namespace pipeline
