#pragma once

#include <memory>

#include "render/segmented/interface_caster.h"

namespace render {

class SheetJudge;

/// The judge of InterfaceCaster. It shares no traversal, no root finding and no derivatives with
/// the kernel, and reads the field by levelset's own code, without tables and skipped blocks. It
/// cuts the ray at the planes of the grid. Within a cell it halves intervals until bounds of slopes
/// show that the label does not change. Sheets are tested in world space, by exact predicates.
/// Correctness has priority over speed. Thread-safe.
class InterfaceJudge {
 public:
  /// @param caster  field and hidden regions; its tables are not used
  explicit InterfaceJudge(const InterfaceCaster& caster);

  /// First crossing of a ray with a surface, as InterfaceCaster::firstHit().
  [[nodiscard]] InterfaceHit firstHit(const InterfaceRay& ray) const;
  [[nodiscard]] const InterfaceCaster& caster() const { return caster_; }

 private:
  InterfaceCaster caster_;
  std::shared_ptr<const SheetJudge> sheets_;  ///< null for a field without sheets
};

}  // namespace render
