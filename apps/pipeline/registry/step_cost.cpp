#include "apps/pipeline/registry/step_cost.h"

#include <algorithm>

#include "apps/pipeline/registry/invocation.h"

namespace pipeline {

CostOf costPerVoxel(double nanoseconds, double bytes, double perTriangle) {
  return [=](Invocation& in) -> std::optional<Cost> {
    struct Size {
      double voxels = 0, triangles = 0;
      bool isKnown = true;
      void add(const Plan& plan, bool countsTriangles) {
        const bool isBand = plan.kind == Kind::Band || plan.kind == Kind::Surface;
        voxels += isBand ? plan.activeVoxels() : 0;
        triangles += plan.triangles;
        isKnown = isKnown && (isBand || (countsTriangles && plan.triangles > 0));
      }
    } read, made;
    for (const Value& operand : in.operands) read.add(operand.plan(), perTriangle > 0);
    if (in.planned) made.add(*in.planned, perTriangle > 0);
    if (!read.isKnown || !made.isKnown) return {};
    const double voxels = std::max(read.voxels, made.voxels),
                 triangles = std::max(read.triangles, made.triangles);
    return Cost{1e-9 * (nanoseconds * voxels + perTriangle * triangles), bytes * voxels};
  };
}

}  // namespace pipeline
