#include "levelset/segmented/meshing/segmented_distance.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "levelset/error.h"
#include "levelset/geometry/search/triangle_search.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress.h"
#include "levelset/segmented/meshing/segmented_to_mesh.h"

namespace levelset {

struct SegmentedDistance::Impl {
  SegmentedField field;
  std::optional<RegionLabel> region;
  TriangleSearch search;
};

SegmentedDistance::SegmentedDistance(const SegmentedField& field,
                                     const SegmentedDistanceOptions& options) {
  if (options.region && options.onlySheets)
    throw UsageError("a region has no sheets in its boundary; give a region or sheets only");
  if (options.region && *options.region != kVoid) {
    const std::vector<RegionLabel> labels = field.labels();
    if (!std::binary_search(labels.begin(), labels.end(), *options.region))
      throw UsageError(fmt::format("the segmentation has no region {}; give a label that it has",
                                   *options.region));
  }
  TriMesh triangles;
  if (!field.isEmpty()) {
    SegmentedMesh mesh =
        segmentedToMesh(field, {.maxMemory = options.maxMemory, .progress = options.progress});
    for (std::size_t t = 0; t < mesh.sides.size(); ++t) {
      const auto [behind, front] = mesh.sides[t];
      const bool counts = options.region ? (behind == *options.region) != (front == *options.region)
                                         : !options.onlySheets || behind == front;
      if (counts) triangles.triangles.push_back(mesh.mesh.triangles[t]);
    }
    triangles.positions = std::move(mesh.mesh.positions);
  }
  // Nine doubles for the corners, a node and an index.
  constexpr double kBytesPerTriangle = 160;
  requireMemory(kBytesPerTriangle * static_cast<double>(triangles.triangles.size()),
                memoryLeft(options.maxMemory));
  impl_ = std::make_unique<Impl>(Impl{field, options.region, makeTriangleSearch(triangles)});
}
SegmentedDistance::~SegmentedDistance() = default;
SegmentedDistance::SegmentedDistance(SegmentedDistance&&) noexcept = default;
SegmentedDistance& SegmentedDistance::operator=(SegmentedDistance&&) noexcept = default;

double SegmentedDistance::value(const Imath::V3d& world) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (!std::isfinite(world.length())) return std::numeric_limits<double>::quiet_NaN();
  if (impl_->search.isEmpty()) return kInfinity;
  const double distance = std::sqrt(impl_->search.closest(world, kInfinity).squared);
  const bool isInside =
      impl_->region && SegmentedSampler(impl_->field).label(world) == *impl_->region;
  return isInside ? -distance : distance;
}

}  // namespace levelset
