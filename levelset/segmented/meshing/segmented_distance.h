#pragma once

#include <Imath/ImathVec.h>

#include <memory>
#include <optional>

#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"

namespace levelset {

struct SegmentedDistanceOptions {
  /// Region whose boundary counts, without the sheets inside it. Empty: all interfaces and sheets.
  std::optional<RegionLabel> region = {};
  bool onlySheets = false;  ///< sheets count, interfaces do not
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Distances from the interfaces or sheets of a segmented field, at any position. The distance is
/// exact to the triangles of segmentedToMesh(), so its error is of second order in the voxel size
/// at any distance. SegmentedSampler interpolates stored distances; they end at the half width, and
/// sheets have none. Threads may share an object.
class SegmentedDistance {
 public:
  /// @throws UsageError for a region that the field does not have; for a region and `onlySheets`
  /// @throws ResourceLimit, Cancelled
  explicit SegmentedDistance(const SegmentedField& field,
                             const SegmentedDistanceOptions& options = {});
  ~SegmentedDistance();
  SegmentedDistance(SegmentedDistance&&) noexcept;
  SegmentedDistance& operator=(SegmentedDistance&&) noexcept;

  /// Distance in world units; with a region negative inside it, by the label of the position.
  /// Infinite if no surface counts, NaN for a position that is not finite.
  [[nodiscard]] double value(const Imath::V3d& world) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace levelset
