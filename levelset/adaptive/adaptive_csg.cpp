#include "levelset/adaptive/adaptive_csg.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/adaptive/adaptive_to_mesh.h"
#include "levelset/adaptive/field_distance.h"
#include "levelset/adaptive/mesh_distance.h"
#include "levelset/adaptive/tricubic_to_trilinear.h"
#include "levelset/error.h"
#include "levelset/geometry/disjoint_sets.h"
#include "levelset/geometry/search/point_search.h"

namespace levelset {
namespace {

using Imath::Box3d;
using Imath::V3d;

/// Minimum or maximum of the distances to solids, less a shift. Its zero set is the surface of the
/// result; elsewhere its magnitude is a lower bound of the distance.
class CsgBound final : public SignedDistance {
 public:
  /// @param shift  distance by which the surface moves outwards, world units
  CsgBound(CsgOperation operation, std::span<const AdaptiveField> solids, double shift,
           const AdaptiveCsgOptions& options)
      : operation_(operation), solids_(solids.begin(), solids.end()), shift_(shift) {
    std::vector<V3d> points;
    for (std::size_t i = 0; i < solids.size(); ++i) {
      const TriMesh mesh = adaptiveToMesh(solids[i], {.maxMemory = options.maxMemory});
      for (const V3d& p : mesh.positions)
        points.push_back(shift == 0 ? p : p + solids_[i].gradient(p).normalized() * shift);
    }
    points_ = makePointSearch(points);
  }

  [[nodiscard]] double at(const V3d& position, const Known& /*known*/) const override {
    return active(position).value - shift_;
  }
  [[nodiscard]] V3d gradient(const V3d& position) const {
    const Active found = active(position);
    return solids_[found.solid].gradient(position) * found.sign;
  }
  /// Number of the solid that determines the value.
  [[nodiscard]] std::size_t solidAt(const V3d& position) const { return active(position).solid; }
  /// Visits the vertices of the meshes of the solids, moved by the shift.
  void visitSurface(const Box3d& box, const Visit& visit) const override {
    const V3d centre = (box.min + box.max) * 0.5;
    bool goesOn = true;
    points_.visit(centre, (box.max - centre).length2(), [&](const PointItem& item) {
      if (goesOn && box.intersects(item.position))
        goesOn = visit(item.position, at(item.position, {}));
    });
  }

 private:
  /// Operand that has the minimum or maximum.
  struct Active {
    double value;
    std::size_t solid;
    double sign;
  };
  [[nodiscard]] Active active(const V3d& position) const {
    Active found{solids_[0].at(position, {}), 0, 1};
    for (std::size_t i = 1; i < solids_.size(); ++i) {
      const double other = solids_[i].at(position, {});
      if (operation_ == CsgOperation::Union          ? other < found.value
          : operation_ == CsgOperation::Intersection ? other > found.value
                                                     : -other > found.value)
        found =
            operation_ == CsgOperation::Difference ? Active{-other, i, -1} : Active{other, i, 1};
    }
    return found;
  }

  CsgOperation operation_;
  std::vector<FieldDistance> solids_;
  double shift_;
  PointSearch points_;
};

/// Distance to the zero set of a bound. Where the bound is the distance, its own value; elsewhere
/// the distance to the mesh of the zero set, which has facets.
class RepairedDistance final : public SignedDistance {
 public:
  /// @param mesh  mesh of the zero set
  /// @param accepted  error of a value of the bound that is accepted as the distance, world units.
  ///        Within four times this value of the zero set, the mesh decides: the bound has spurious
  ///        signs there.
  RepairedDistance(const CsgBound& bound, const TriMesh& mesh, double voxel, double accepted,
                   const AdaptiveCsgOptions& options)
      : bound_(bound),
        mesh_(mesh, voxel,
              {.sign = SignMode::Closed,
               .searchSelfIntersections = false,
               .maxMemory = options.maxMemory}),
        accepted_(accepted) {}

  [[nodiscard]] double at(const V3d& position, const Known& known) const override {
    const auto foot = footOf(position);
    return foot ? foot->value : mesh_.at(position, known);
  }
  [[nodiscard]] V3d gradient(const V3d& position, double value, double step) const override {
    const auto foot = footOf(position);
    return foot ? foot->gradient : mesh_.gradient(position, value, step);
  }
  void visitSurface(const Box3d& box, const Visit& visit) const override {
    bound_.visitSurface(box, [&](const V3d& point, double) { return visit(point, at(point, {})); });
  }

 private:
  /// Figures of a position at which the bound is the distance.
  struct Exact {
    double value;
    V3d gradient;
  };
  [[nodiscard]] std::optional<Exact> footOf(const V3d& position) const {
    const double value = bound_.at(position, {});
    if (std::abs(value) < 4 * accepted_) return {};
    const std::size_t solid = bound_.solidAt(position);
    // A point of the zero set at this distance shows that the lower bound is the distance.
    V3d foot = position;
    double left = value;
    constexpr int kSteps = 5;
    for (int step = 0; step < kSteps; ++step) {
      const V3d slope = bound_.gradient(foot);
      if (!(slope.length2() > 0.25)) break;
      foot -= slope * (left / slope.length2());
      left = bound_.at(foot, {});
      if (bound_.solidAt(foot) != solid) break;  // beyond a rim the bound is far below the distance
      const double gap = (foot - position).length() + std::abs(left) - std::abs(value);
      if (gap <= accepted_) return Exact{value, bound_.gradient(position).normalized()};
      if (step == 0) continue;
      // Along the surface to the perpendicular. Half of the way converges beside curved surfaces.
      const V3d normal = bound_.gradient(foot).normalized(), back = position - foot;
      foot += (back - normal * back.dot(normal)) * 0.5;
      left = bound_.at(foot, {});
    }
    return {};
  }

  const CsgBound& bound_;
  MeshDistance mesh_;
  double accepted_;
};

void requireAdaptive(const AdaptiveField& solid, std::size_t number) {
  if (solid.isEmpty() || solid.zeroSetBounds().isEmpty())
    throw InvalidInput(fmt::format(
        "operand {} is empty: it has no surface; leave it out, or lower its --tolerance", number));
}

void requireLength(double length, const char* name) {
  if (!(length >= 0) || !std::isfinite(length))
    throw UsageError(fmt::format("the {} {} is not positive; give a positive one", name, length));
}

/// Removes shells that are smaller than the tolerance, unless no other would be left.
TriMesh withoutCrumbs(const TriMesh& mesh, double tolerance) {
  DisjointSets shells(mesh.positions.size());
  for (const auto& t : mesh.triangles) {
    shells.join(t[0], t[1]);
    shells.join(t[0], t[2]);
  }
  std::vector<Box3d> boxes(mesh.positions.size());
  for (std::uint32_t v = 0; v < mesh.positions.size(); ++v)
    boxes[shells.find(v)].extendBy(mesh.positions[v]);
  TriMesh kept;
  kept.positions = mesh.positions;
  for (const auto& t : mesh.triangles)
    if (boxes[shells.find(t[0])].size().length() >= tolerance) kept.triangles.push_back(t);
  return kept.isEmpty() ? mesh : kept;
}

/// Samples a bound near its zero set. Half of the tolerance is for the surface, where the octree is
/// deep enough for it.
AdaptiveField surfaceOf(const CsgBound& bound, const Box3d& box, double tolerance,
                        const AdaptiveCsgOptions& options) {
  return withFinerTolerance(tolerance, [&](double finer) {
    return buildAdaptive(bound, box,
                         {.tolerance = finer,
                          .halfWidth = tolerance / 2,
                          .maxMemory = options.maxMemory,
                          .progress = subProgress(options.progress, 0, 0.3)});
  });
}

/// Samples the distance of the zero set of a bound.
/// @param how  tolerance, half width and interpolation of the result
AdaptiveField withDistances(const CsgBound& bound, const Box3d& box, AdaptiveOptions how,
                            const AdaptiveCsgOptions& options) {
  const double tolerance = how.tolerance;
  const TriMesh mesh = withoutCrumbs(
      adaptiveToMesh(
          surfaceOf(bound, box, tolerance, options),
          {.maxMemory = options.maxMemory, .progress = subProgress(options.progress, 0.3, 0.4)}),
      tolerance);
  if (mesh.isEmpty())
    throw NoSurface("the result is empty: no point lies inside; check sizes and positions");
  constexpr double kAcceptedShare = 1.0 / 4;
  const RepairedDistance distance(bound, mesh, tolerance, kAcceptedShare * tolerance, options);
  how.maxMemory = options.maxMemory;
  how.progress = subProgress(options.progress, 0.4, 1);
  return buildAdaptive(distance, box, how);
}

}  // namespace

AdaptiveField combineAdaptive(CsgOperation operation, std::span<const AdaptiveField> solids,
                              const AdaptiveCsgOptions& options) {
  if (solids.size() < 2) throw UsageError("at least two solids are needed");
  requireLength(options.tolerance, "tolerance");
  requireLength(options.halfWidth, "half width");
  double tolerance = 0, halfWidth = INFINITY;
  bool isTricubic = true;
  Box3d box;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    requireAdaptive(solids[i], i + 1);
    tolerance = std::max(tolerance, solids[i].tolerance());
    halfWidth = std::min(halfWidth, solids[i].halfWidth());
    isTricubic = isTricubic && solids[i].isTricubic();
    const Box3d own = solids[i].zeroSetBounds();
    if (i == 0 || operation == CsgOperation::Union) {
      box.extendBy(own);
    } else if (operation == CsgOperation::Intersection) {
      for (int axis = 0; axis < 3; ++axis) {
        box.min[axis] = std::max(box.min[axis], own.min[axis]);
        box.max[axis] = std::min(box.max[axis], own.max[axis]);
      }
    }
  }
  if (box.isEmpty())
    throw NoSurface("the result is empty: the solids are apart; check sizes and positions");
  return withDistances(CsgBound(operation, solids, 0, options), box,
                       {.tolerance = options.tolerance > 0 ? options.tolerance : tolerance,
                        .halfWidth = options.halfWidth > 0 ? options.halfWidth : halfWidth,
                        .isTricubic = isTricubic},
                       options);
}

AdaptiveField offsetAdaptive(const AdaptiveField& solid, double distance,
                             const AdaptiveCsgOptions& options) {
  requireAdaptive(solid, 1);
  requireLength(options.tolerance, "tolerance");
  requireLength(options.halfWidth, "half width");
  if (!(solid.halfWidth() - std::abs(distance) >= solid.tolerance()))
    throw UsageError(fmt::format(
        "the distance {:.6g} is too large for an adaptive field with distances up to {:.6g} from "
        "the surface; make the field with a larger --width, or put 'to-band' before the offset",
        distance, solid.halfWidth()));
  Box3d box = solid.zeroSetBounds();
  box.min -= V3d(std::max(distance, 0.0));
  box.max += V3d(std::max(distance, 0.0));
  return withDistances(CsgBound(CsgOperation::Union, {&solid, 1}, distance, options), box,
                       {.tolerance = options.tolerance > 0 ? options.tolerance : solid.tolerance(),
                        .halfWidth = options.halfWidth > 0 ? options.halfWidth : solid.halfWidth(),
                        .isTricubic = solid.isTricubic()},
                       options);
}

}  // namespace levelset
