#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/registry/operator.h"
#include "apps/pipeline/values/value.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"
#include "levelset/region_of_interest.h"

namespace pipeline {

/// A length option converted to world units, for the report.
struct Resolved {
  std::string param;                  ///< name of the option, without dashes
  std::string written;                ///< text as the user wrote it
  double world = 0;                   ///< world units
  std::optional<double> voxels = {};  ///< the same length in voxels; empty: voxel size unknown
};

using levelset::ErrorEstimate;

/// Messages and figures that an operator reports beside its result.
struct StepNotes {
  std::vector<Resolved> lengths;
  std::vector<std::string> warnings;
  std::vector<std::string> notes;
  std::vector<ErrorEstimate> errors;
  /// Message of a numeric check that the result fails; empty: none. The chain continues, and ends
  /// with exit code 5.
  std::string failure;
  /// levelset::SignCertificate as a JSON object, from the action level-set: the properties of the
  /// mesh and the method that decided inside and outside. Empty: none.
  std::string certificateJson;
  std::string detailsJson;  ///< figures of the operator, a JSON object; empty: none
};

/// One action of a chain as its operator sees it: typed parameters, operands and notes.
class Invocation {
 public:
  Invocation(const Operator& op, std::map<std::string, std::string> options)
      : op_(&op), options_(std::move(options)) {}

  // Operands in the order in which they were pushed on the stack.
  std::vector<Value> operands;
  /// Names that --as gave to the operands; empty: none. Set when the action runs, one for each
  /// operand.
  std::vector<std::string> operandNames;
  [[nodiscard]] const levelset::NarrowBand& band(std::size_t index = 0) const {
    return operands.at(index).band();
  }
  [[nodiscard]] const levelset::TriMesh& mesh(std::size_t index = 0) const {
    return operands.at(index).mesh();
  }

  /// Values that parameters refer to ("--mask @NAME"), by name of the parameter.
  std::map<std::string, Value> named;

  // Parameters. A parameter that was not given has its default. Reading a parameter that has
  // neither a value nor a default is a programming error.
  [[nodiscard]] bool given(const std::string& name) const { return options_.contains(name); }
  [[nodiscard]] bool flag(const std::string& name) const { return given(name); }
  /// Sets an option that is not given, as a preset does. given() is true for it then.
  void assume(const std::string& name, const std::string& value) {
    if (options_.emplace(name, value).second) assumed_.insert(name);
  }
  /// Returns true for an option that assume() has set.
  [[nodiscard]] bool isAssumed(const std::string& name) const { return assumed_.contains(name); }
  /// Removes an option that assume() has set; keeps a given one.
  void dropAssumed(const std::string& name) {
    if (assumed_.erase(name) > 0) options_.erase(name);
  }
  [[nodiscard]] std::string text(const std::string& name) const;
  [[nodiscard]] double number(const std::string& name) const;
  [[nodiscard]] long integer(const std::string& name) const;
  /// Returns an integer parameter as type `T`.
  /// @throws UsageError when the value does not fit into `T`
  template <class T>
  [[nodiscard]] T integerAs(const std::string& name) const {
    const long value = integer(name);
    if (!std::in_range<T>(value)) refuseInteger(name, value);
    return static_cast<T>(value);
  }
  [[nodiscard]] double radians(const std::string& name) const;
  [[nodiscard]] std::vector<double> numbers(const std::string& name) const;
  [[nodiscard]] Imath::V3d point(const std::string& name) const;
  [[nodiscard]] std::vector<Imath::V3d> points(const std::string& name) const;
  [[nodiscard]] Imath::Box3d box(const std::string& name) const;
  [[nodiscard]] Imath::M44d matrix(const std::string& name) const;
  [[nodiscard]] std::pair<int, int> imageSize(const std::string& name) const;
  /// Returns a length in world units. `vx` and `%` refer to the voxel size and the diagonal of the
  /// first operand, or to those of setReference().
  [[nodiscard]] double length(const std::string& name);
  /// Returns the number in the text of a length, without conversion of its unit.
  [[nodiscard]] double writtenLength(const std::string& name) const;
  /// Returns Param::count lengths in world units.
  [[nodiscard]] std::vector<double> lengths(const std::string& name);
  /// Returns the voxel size in world units: --voxel, or `longestSide` of the object divided by
  /// --resolution.
  [[nodiscard]] double voxelSize(double longestSide);
  /// Throws UsageError unless exactly one of --voxel and --resolution is given, or the voxel size
  /// follows from --tolerance.
  void requireVoxelSize() const;
  /// Returns whether --voxel or --resolution is given. Throws UsageError for both.
  [[nodiscard]] bool asksVoxelSize() const;
  /// Sets the voxel size and the diagonal, world units, to which `vx` and `%` refer; 0: unknown.
  void setReference(double voxelSize, double diagonal);
  /// Resolves every length that is given or has a default, for the report of a dry run.
  void resolveLengths();

  [[nodiscard]] const Operator& op() const { return *op_; }
  [[nodiscard]] std::string where(const std::string& param) const {
    return op_->name + ": --" + param;
  }

  // Region of interest of the result. Operator::run may compute only this part of it.
  levelset::RegionOfInterest roi = {};
  /// Plan of the complete result; empty: unknown. For Operator::cost it is the plan of the part
  /// that is computed.
  std::optional<Plan> planned = {};
  /// True if the half width of the first operand is smaller than that of its complete value.
  bool isPartial = false;
  /// Half width to compute, voxels.
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
  std::string output;  ///< text for the user, printed when the operator has finished

 private:
  /// @param label  name of the length in the report
  [[nodiscard]] double toWorld(const std::string& name, const std::string& text,
                               const std::string& label);
  void note(const Resolved& length);
  [[noreturn]] void refuseInteger(const std::string& name, long value) const;
  [[nodiscard]] double countIn(double voxel);

  const Operator* op_;
  std::map<std::string, std::string> options_;
  std::set<std::string> assumed_;
  std::optional<double> referenceVoxel_, referenceDiagonal_;
};

}  // namespace pipeline
