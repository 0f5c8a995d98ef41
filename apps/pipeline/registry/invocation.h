#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/registry/operator.h"
#include "apps/pipeline/values/value.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"
#include "levelset/region_of_interest.h"

namespace pipeline {

/// A resolved length, for the report.
struct Resolved {
  std::string param;
  std::string written;
  double world = 0;
  std::optional<double> voxels = {};
};

using levelset::ErrorEstimate;

/// Notes and figures that an operator leaves beside its result.
struct StepNotes {
  std::vector<Resolved> lengths;
  std::vector<std::string> warnings;
  std::vector<std::string> notes;
  std::vector<ErrorEstimate> errors;
  /// A numeric check that the result fails. The chain continues, and ends with exit code 5.
  std::string failure;
  std::string certificateJson;  ///< sign certificate of level-set
  std::string detailsJson;      ///< figures of the operator, a JSON object
};

/// One action of a chain as its operator sees it: typed parameters, operands and notes.
class Invocation {
 public:
  Invocation(const Operator& op, std::map<std::string, std::string> options)
      : op_(&op), options_(std::move(options)) {}

  // Operands; the oldest is first.
  std::vector<Value> operands;
  /// Names of the operands by --as; empty: none. Set when the action runs, one for each operand.
  std::vector<std::string> operandNames;
  [[nodiscard]] const levelset::NarrowBand& band(std::size_t index = 0) const {
    return operands.at(index).band();
  }
  [[nodiscard]] const levelset::TriMesh& mesh(std::size_t index = 0) const {
    return operands.at(index).mesh();
  }

  /// Values that parameters name ("--mask @NAME"), by parameter.
  std::map<std::string, Value> named;

  // Parameters. A parameter that was not given has its default. To read a parameter that has
  // neither a value nor a default is a programming error.
  [[nodiscard]] bool given(const std::string& name) const { return options_.contains(name); }
  [[nodiscard]] bool flag(const std::string& name) const { return given(name); }
  [[nodiscard]] std::string text(const std::string& name) const;
  [[nodiscard]] double number(const std::string& name) const;
  [[nodiscard]] long integer(const std::string& name) const;
  /// @throws UsageError when the value does not fit into `T`
  template <class T>
  [[nodiscard]] T integerAs(const std::string& name) const {
    const long value = integer(name);
    if (!std::in_range<T>(value)) refuseInteger(name, value, std::numeric_limits<T>::max());
    return static_cast<T>(value);
  }
  [[nodiscard]] double radians(const std::string& name) const;
  [[nodiscard]] std::vector<double> numbers(const std::string& name) const;
  [[nodiscard]] Imath::V3d point(const std::string& name) const;
  [[nodiscard]] std::vector<Imath::V3d> points(const std::string& name) const;
  [[nodiscard]] Imath::Box3d box(const std::string& name) const;
  [[nodiscard]] Imath::M44d matrix(const std::string& name) const;
  [[nodiscard]] std::pair<int, int> imageSize(const std::string& name) const;
  /// Returns a length in world units. `vx` and `%` refer to the first operand, or to
  /// setReference().
  [[nodiscard]] double length(const std::string& name);
  /// Returns the number of a length as written, whatever its unit.
  [[nodiscard]] double writtenLength(const std::string& name) const;
  /// Returns as many lengths as Param::count.
  [[nodiscard]] std::vector<double> lengths(const std::string& name);
  /// Returns the voxel size of --voxel, or of --resolution and the object's longest side.
  [[nodiscard]] double voxelSize(double longestSide);
  /// Throws UsageError unless exactly one of --voxel and --resolution is given, or the voxel size
  /// follows from --tolerance.
  void requireVoxelSize() const;
  /// Returns whether --voxel or --resolution is given. Throws UsageError for both.
  [[nodiscard]] bool asksVoxelSize() const;
  void setReference(double voxelSize, double diagonal);
  /// Resolves every length that is given or has a default, for the report of a dry run.
  void resolveLengths();

  [[nodiscard]] const Operator& op() const { return *op_; }
  [[nodiscard]] std::string where(const std::string& param) const {
    return op_->name + ": --" + param;
  }

  // Part of the result that is needed; run() may make no more than that.
  levelset::RegionOfInterest roi = {};
  /// Plan of the complete result, where it is known.
  std::optional<Plan> planned = {};
  bool isPartial = false;  ///< the first operand is narrower than the complete band
  /// Half width to make, voxels.
  /// @param whole  half width of the complete result
  [[nodiscard]] double neededHalfWidth(double whole) const {
    return std::min(whole, roi.halfWidth);
  }

  // Settings of the run.
  levelset::Progress progress = {};
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  bool dryRun = false;
  bool voxelFollows = false;  ///< the voxel size follows from --tolerance (Node::voxelFollows)
  StepNotes notes;
  std::string output;  ///< text for people, printed when the operator is done

 private:
  /// @param label  name of the length in the report
  [[nodiscard]] double toWorld(const std::string& name, const std::string& text,
                               const std::string& label);
  void note(const Resolved& length);
  [[noreturn]] void refuseInteger(const std::string& name, long value, std::uint64_t most) const;
  [[nodiscard]] double countIn(double voxel);

  const Operator* op_;
  std::map<std::string, std::string> options_;
  std::optional<double> referenceVoxel_, referenceDiagonal_;
};

}  // namespace pipeline
