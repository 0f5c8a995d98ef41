#pragma once

#include <functional>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "apps/pipeline/operators/option_params.h"
#include "apps/pipeline/registry/operator.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"

/// Builds an action of the pipeline from the description of an operator of the library levelset
/// (levelset/operator/description.h).
namespace pipeline {

/// Parameters and functions that the pipeline adds to an operator of the library, for example an
/// option that names files to write.
template <class Op>
struct OperatorExtension {
  std::vector<Param> params = {};  ///< further parameters, listed after those of Op::Options
  std::function<void(const Invocation&)> validate = {};
  std::function<std::vector<std::string>(const Invocation&)> targets = {};
  /// Changes the options before the operator runs.
  std::function<void(typename Op::Options&, Invocation&)> prepare = {};
};

namespace detail {

using levelset::FieldGrid;
using levelset::NarrowBand;
using levelset::OperatorRun;
using levelset::RegionOfInterest;
using levelset::TriMesh;
using levelset::ValuePlan;

template <class Op>
concept TakesBands = requires(std::vector<NarrowBand> bands, const typename Op::Options& options,
                              OperatorRun& run) {
  Op::run(std::move(bands), options, run);
};
template <class Op>
concept TakesMesh = requires(const TriMesh& mesh, const typename Op::Options& options,
                             OperatorRun& run) {
  Op::run(mesh, options, run);
};

template <class Op>
constexpr std::size_t operandCount() {
  if constexpr (requires { Op::operandCount; })
    return Op::operandCount;
  else
    return TakesBands<Op> || TakesMesh<Op> ? 1 : 0;
}

[[nodiscard]] levelset::GivenOptions givenIn(const Invocation& in);
[[nodiscard]] std::vector<ValuePlan> operandPlans(const Invocation& in);
[[nodiscard]] OperatorRun runOf(const Invocation& in);
/// Drops the references to the operands, and returns freed memory to the system.
void releaseOperands(Invocation& in);
/// Moves the messages and figures of an operator's run into the notes of its step in the report.
void fileNotes(OperatorRun& run, StepNotes& notes);

/// Reads all options, including the voxel size.
template <class Op>
typename Op::Options resolvedOptions(Invocation& in, OptionStage stage) {
  using Options = typename Op::Options;
  if (!hasVoxelSize<Options>()) return readOptions<Options>(in, stage);
  const std::vector<ValuePlan> operands = operandPlans(in);
  // Lengths in vx need --voxel: with --resolution, the voxel size depends on those lengths.
  if (operands.empty() && in.asksVoxelSize() && in.given("voxel"))
    in.setReference(in.length("voxel"), 0);
  Options options = readOptions<Options>(in, stage);
  if constexpr (requires { Op::longestSide(options, levelset::Plans()); }) {
    VoxelSizeSetter<Options> visit{&options, in.voxelSize(Op::longestSide(options, operands))};
    Options::describe(visit);
  }
  return options;
}

template <class Result>
Value valueOf(Result result) {
  if constexpr (std::is_same_v<Result, std::variant<NarrowBand, FieldGrid>>)
    return std::visit([](auto& one) { return Value(std::move(one)); }, result);
  else
    return Value(std::move(result));
}

template <class Op>
Value runOn(Invocation& in, const typename Op::Options& options, OperatorRun& run) {
  if constexpr (TakesMesh<Op>)
    if (!TakesBands<Op> || in.operands[0].kind() == Kind::Mesh) {
      if constexpr (std::is_same_v<decltype(Op::run(in.mesh(), options, run)), NarrowBand>)
        run.releaseOperands = [&in] { releaseOperands(in); };
      return valueOf(Op::run(in.mesh(), options, run));
    }
  if constexpr (TakesBands<Op>) {
    std::vector<NarrowBand> bands;
    for (const Value& operand : in.operands) bands.push_back(operand.band());
    using Result = decltype(Op::run(std::move(bands), options, run));
    // Drop the references in `in.operands`: an operator changes a band in place if it holds the
    // only reference.
    if constexpr (std::is_same_v<Result, NarrowBand>) in.operands.clear();
    return valueOf(Op::run(std::move(bands), options, run));
  } else if constexpr (!TakesMesh<Op>) {
    return valueOf(Op::run(options, run));
  } else {
    return Value(in.mesh());  // not reached
  }
}

/// Runs the operator on the operands and options of an action. The messages of the run go to
/// `in.notes`, also if it throws.
template <class Op>
Value runOperator(Invocation& in, const OperatorExtension<Op>& extension) {
  typename Op::Options options = resolvedOptions<Op>(in, OptionStage::Run);
  if (extension.prepare) extension.prepare(options, in);
  OperatorRun run = runOf(in);
  try {
    Value result = runOn<Op>(in, options, run);
    fileNotes(run, in.notes);
    return result;
  } catch (...) {
    fileNotes(run, in.notes);
    throw;
  }
}

template <class Op>
Kind resultKind(const Invocation& in) {
  if constexpr (requires(const typename Op::Options& options) { Op::makesField(options); }) {
    Invocation probe = in;
    return Op::makesField(readOptions<typename Op::Options>(probe, OptionStage::Syntax))
               ? Kind::Field
               : Kind::Band;
  } else if constexpr (TakesBands<Op>) {
    using Result = decltype(Op::run(std::declval<std::vector<NarrowBand>>(),
                                    std::declval<const typename Op::Options&>(),
                                    std::declval<OperatorRun&>()));
    if constexpr (std::is_same_v<Result, FieldGrid>) return Kind::Field;
    if constexpr (std::is_same_v<Result, TriMesh>) return Kind::Mesh;
    if constexpr (TakesMesh<Op>) return in.operands.empty() ? Kind::Band : in.operands[0].kind();
    return Kind::Band;
  } else if constexpr (requires { Op::makesSurface; }) {
    return Op::makesSurface ? Kind::Surface : Kind::Band;
  } else {
    return Kind::Band;
  }
}

template <class Op>
Plan planOperator(Invocation& in) {
  const std::vector<ValuePlan> operands = operandPlans(in);
  const auto options = resolvedOptions<Op>(in, OptionStage::Plan);
  Plan plan;
  if (!in.operands.empty()) plan = in.operands[0].plan();
  plan.kind = resultKind<Op>(in);
  if constexpr (requires { Op::plan(options, levelset::Plans(), std::declval<OperatorRun&>()); })
    plan.set(Op::plan(options, operands, runOf(in)));
  return plan;
}

template <class Op>
void validateOperator(const Invocation& in) {
  using Options = typename Op::Options;
  if (hasVoxelSize<Options>()) in.requireVoxelSize();
  Invocation probe = in;
  [[maybe_unused]] const Options options = readOptions<Options>(probe, OptionStage::Syntax);
  if constexpr (requires { Op::check(options, levelset::GivenOptions()); })
    Op::check(options, givenIn(in));
}

template <class Op>
RegionOfInterest regionOfInterest(Invocation& in, std::size_t operand,
                                  const RegionOfInterest& ofResult) {
  if (in.operands[0].kind() != Kind::Band) return {};
  // --resolution counts voxels along the longest side of the complete operand, so a region of
  // interest would change the voxel size.
  if (hasVoxelSize<typename Op::Options>() && in.given("resolution")) return {};
  const std::vector<ValuePlan> operands = operandPlans(in);
  const auto options = resolvedOptions<Op>(in, OptionStage::Plan);
  const levelset::OperatorPlans plans{operands, in.planned ? in.planned->estimate() : ValuePlan{}};
  return Op::regionOfInterest(options, plans, operand, ofResult);
}

template <class Op>
std::optional<Cost> costOf(Invocation& in) {
  const std::vector<ValuePlan> operands = operandPlans(in);
  const auto options = resolvedOptions<Op>(in, OptionStage::Plan);
  return Op::cost(options, {operands, in.planned ? in.planned->estimate() : ValuePlan{}});
}

template <class Op>
void addEstimates(Operator& op) {
  using Options = typename Op::Options;
  using levelset::OperatorPlans;
  if constexpr (requires { Op::slope; }) op.slope = Op::slope;
  if constexpr (requires { Op::partTolerance; }) op.partTolerance = Op::partTolerance;
  if constexpr (requires { Op::distancePasses; }) op.distancePasses = Op::distancePasses;
  if constexpr (requires { Op::makesPart; }) op.makesParts = Op::makesPart;
  if constexpr (requires { Op::errorModel; }) op.errorModel = Op::errorModel;
  if constexpr (requires(const Options& options) { Op::cost(options, OperatorPlans()); })
    op.cost = costOf<Op>;
  if constexpr (requires(const Options& options) {
                  Op::regionOfInterest(options, OperatorPlans(), std::size_t(), RegionOfInterest());
                })
    op.regionOfInterest = regionOfInterest<Op>;
  if constexpr (requires(const Options& options) { Op::leastRadius(options); })
    op.leastRadius = [](Invocation& in) {
      return Op::leastRadius(readOptions<Options>(in, OptionStage::Partial));
    };
}

}  // namespace detail

template <class Op>
Operator levelSetOperator(OperatorExtension<Op> extension = {}) {
  const levelset::OperatorText& text = Op::text;
  Operator op{.name = text.name,
              .group = text.group,
              .summary = text.summary,
              .details = text.details,
              .example = text.example,
              .params = paramsOf<typename Op::Options>()};
  if (text.formerName) op.formerName = text.formerName;
  op.params.insert(op.params.end(), extension.params.begin(), extension.params.end());
  std::vector<Kind> kinds;
  if constexpr (detail::TakesBands<Op>) kinds.push_back(Kind::Band);
  if constexpr (detail::TakesMesh<Op>) kinds.push_back(Kind::Mesh);
  op.operands.assign(detail::operandCount<Op>(), kinds);
  if constexpr (requires { Op::takesMore; }) op.takesMore = Op::takesMore;
  op.resultKind = detail::resultKind<Op>;
  op.plan = detail::planOperator<Op>;
  op.validate = [more = extension.validate](const Invocation& in) {
    detail::validateOperator<Op>(in);
    if (more) more(in);
  };
  op.targets = extension.targets;
  op.run = [extension = std::move(extension)](Invocation& in) {
    return detail::runOperator<Op>(in, extension);
  };
  detail::addEstimates<Op>(op);
  return op;
}

}  // namespace pipeline
