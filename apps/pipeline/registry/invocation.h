#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/registry/operator.h"
#include "apps/pipeline/values/value.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"
#include "levelset/region_of_interest.h"

namespace pipeline {

/// Lengths as they were resolved, for the report.
struct Resolved {
  std::string param;
  std::string written;
  double world = 0;
  std::optional<double> voxels = {};
};

using levelset::ErrorEstimate;

/// What an operator left behind beside its value.
struct StepNotes {
  std::vector<Resolved> lengths;
  std::vector<std::string> warnings;
  std::vector<std::string> notes;
  std::vector<ErrorEstimate> errors;
  /// A numeric check that the value does not pass: the chain goes on with it and then ends with
  /// exit code 5.
  std::string failure;
  std::string certificateJson;  ///< of level-set
  std::string detailsJson;      ///< operator's own figures, an object
};

/// One action of a chain as its operator sees it: typed parameters, operands, and where to report
/// to.
class Invocation {
 public:
  Invocation(const Operator& op, std::map<std::string, std::string> options)
      : op_(&op), options_(std::move(options)) {}

  // Operands, oldest first.
  std::vector<Value> operands;
  /// What --as called them; empty where nobody did. As many, when it runs.
  std::vector<std::string> operandNames;
  [[nodiscard]] const levelset::NarrowBand& band(std::size_t index = 0) const {
    return operands.at(index).band();
  }
  [[nodiscard]] const levelset::TriMesh& mesh(std::size_t index = 0) const {
    return operands.at(index).mesh();
  }

  /// The values that parameters name ("--mask @NAME"), by parameter.
  std::map<std::string, Value> named;

  // Parameters. A parameter that was not given answers with its default; asking for one that has
  // neither is a programming error.
  [[nodiscard]] bool given(const std::string& name) const { return options_.contains(name); }
  [[nodiscard]] bool flag(const std::string& name) const { return given(name); }
  [[nodiscard]] std::string text(const std::string& name) const;
  [[nodiscard]] double number(const std::string& name) const;
  [[nodiscard]] long integer(const std::string& name) const;
  [[nodiscard]] double radians(const std::string& name) const;
  [[nodiscard]] std::vector<double> numbers(const std::string& name) const;
  [[nodiscard]] Imath::V3d point(const std::string& name) const;
  [[nodiscard]] std::vector<Imath::V3d> points(const std::string& name) const;
  [[nodiscard]] Imath::Box3d box(const std::string& name) const;
  [[nodiscard]] Imath::M44d matrix(const std::string& name) const;
  [[nodiscard]] std::pair<int, int> imageSize(const std::string& name) const;
  /// World units. `vx` and `%` refer to the first operand, or to setReference().
  [[nodiscard]] double length(const std::string& name);
  /// The number of a length as it was written, whatever its unit.
  [[nodiscard]] double writtenLength(const std::string& name) const;
  /// As many as its parameter counts.
  [[nodiscard]] std::vector<double> lengths(const std::string& name);
  /// The voxel size asked by --voxel or --resolution; the latter needs the object's longest side.
  [[nodiscard]] double voxelSize(double longestSide);
  /// Refuses a call that gives both --voxel and --resolution, or neither where it does not follow.
  void requireVoxelSize() const;
  /// True when --voxel or --resolution was given; both, or a `vx` beside --resolution, are refused.
  [[nodiscard]] bool asksVoxelSize() const;
  void setReference(double voxelSize, double diagonal);
  /// Every length that was given or has a default, for a dry run's report.
  void resolveLengths();

  [[nodiscard]] const Operator& op() const { return *op_; }
  [[nodiscard]] std::string where(const std::string& param) const {
    return op_->name + ": --" + param;
  }

  // What is needed of the result: run() may make no more than that.
  levelset::RegionOfInterest roi = {};
  /// Of the whole result, where that was told before.
  std::optional<Plan> planned = {};
  bool isPartial = false;  ///< the first operand is narrower than its whole
  /// The half width of what is made, where the whole has `whole`; voxels.
  [[nodiscard]] double neededHalfWidth(double whole) const {
    return std::min(whole, roi.halfWidth);
  }

  // What comes from the run as a whole.
  levelset::Progress progress = {};
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  bool dryRun = false;
  bool voxelFollows = false;  ///< the voxel size is told later (Node::voxelFollows)
  StepNotes notes;
  std::string output;  ///< text for people, printed when the operator is done

 private:
  /// @param label  what the report calls it
  [[nodiscard]] double toWorld(const std::string& name, const std::string& text,
                               const std::string& label);
  void note(const Resolved& length);
  [[nodiscard]] double countIn(double voxel);

  const Operator* op_;
  std::map<std::string, std::string> options_;
  std::optional<double> referenceVoxel_, referenceDiagonal_;
};

}  // namespace pipeline
