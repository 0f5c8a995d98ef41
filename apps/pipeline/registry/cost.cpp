#include "apps/pipeline/registry/cost.h"

#include <algorithm>
#include <cmath>

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

double layerOf(const Plan& band) {
  return band.voxelSize > 0 ? band.area / (band.voxelSize * band.voxelSize) : 0;
}

Cost costOfDistances(double layer, double halfWidth) {
  // To find the surface, and then for each grid point to find its nearest point there. More than
  // smooth surfaces take, and less than meshes of facets, with edges everywhere.
  return {1e-9 * layer * (1250 + 1060 * 2 * halfWidth), layer * (540 + 6 * 2 * halfWidth)};
}

Cost costOfOffset(double before, double after, double way, double halfWidth) {
  constexpr double kShell = 3;  // of distances beside the moved surface, which are made again
  Cost cost = costOfDistances(std::max(before, after), kShell);
  cost.seconds += 1e-9 * before * 700 * std::abs(way);
  cost.bytes += 15 * before * std::abs(way);
  return cost += costOfDistances(after, halfWidth);
}

}  // namespace pipeline
