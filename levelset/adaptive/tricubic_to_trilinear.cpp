#include "levelset/adaptive/tricubic_to_trilinear.h"

#include <vector>

#include "levelset/adaptive/build_adaptive.h"
#include "levelset/adaptive/field_distance.h"
#include "levelset/adaptive/octree/edge_crossings.h"
#include "levelset/geometry/search/point_search.h"

namespace levelset {
namespace {

using Imath::Box3d;
using Imath::V3d;

/// Distance of a field, with points of its zero set.
class FieldSurface final : public SignedDistance {
 public:
  explicit FieldSurface(const AdaptiveField& field) : field_(field) {
    std::vector<V3d> points;
    forEachEdgeCrossing(*field.shared(), [&](const V3d& world) { points.push_back(world); });
    crossings_ = makePointSearch(points);
  }

  [[nodiscard]] double at(const V3d& position, const Known& known) const override {
    return field_.at(position, known);
  }
  void visitSurface(const Box3d& box, const Visit& visit) const override {
    const V3d centre = (box.min + box.max) * 0.5;
    bool goesOn = true;
    crossings_.visit(centre, (box.max - centre).length2(), [&](const PointItem& item) {
      if (goesOn && box.intersects(item.position))
        goesOn = visit(item.position, at(item.position, {}));
    });
  }

 private:
  FieldDistance field_;
  PointSearch crossings_;
};

}  // namespace

AdaptiveField trilinearSurface(const AdaptiveField& field, std::size_t maxMemory,
                               const Progress& progress) {
  const FieldSurface surface(field);
  return withFinerTolerance(field.tolerance(), [&](double tolerance) {
    return buildAdaptive(surface, field.box(),
                         {.tolerance = tolerance,
                          .halfWidth = tolerance,
                          .maxMemory = maxMemory,
                          .progress = progress});
  });
}

}  // namespace levelset
