#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "levelset/volumes/filters/volume_filter.h"
#include "levelset/volumes/volume.h"

namespace levelset {

/// Values of a volume that belong to a solid: those above `low` and below `high`. A value that
/// equals a limit does not belong to it.
struct ValueRange {
  std::optional<double> low = {}, high = {};  ///< at least one is set; low < high
};

/// Treatment of a solid that reaches the border of the volume, beyond which nothing is known.
enum class VolumeBorder {
  Close,  ///< the faces of the volume's box close the solid
  Refuse  ///< the solid is refused
};

struct IsosurfaceOptions {
  VolumeFilter filter = VolumeFilter::Trilinear;
  VolumeBorder border = VolumeBorder::Close;
  double voxelSize = 0;  ///< world units; 0: the smallest spacing of the volume
  double halfWidth = 3;  ///< half width of the band, voxels, more than 1
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Facts about the surface that was found in a volume.
struct IsosurfaceReport {
  double closedArea = 0;    ///< area of the surface on the volume's border, world units²
  std::uint64_t cells = 0;  ///< cells of the volume that hold a part of the surface
  /// Number of trilinear pieces that the distances were measured to. Cells in which the surface
  /// bends strongly are split into several.
  std::uint64_t pieces = 0;
};

struct IsosurfaceResult {
  NarrowBand band;
  IsosurfaceReport report;
};

/// Builds the solid of all points whose interpolated value lies in a range. The distances are
/// those to the boundary of that solid itself, not to triangles: each grid point finds the closest
/// point of the trilinear pieces in world space by Newton's method on the condition for a closest
/// point, also along the creases between cells. Their error is that of single precision. The
/// volume may be anisotropic, oblique or sheared. Grid points lie at integer multiples of the voxel
/// size. The result does not depend on the number of threads.
/// @throws UsageError for limits that are not finite or not in order, or for a half width of 1 or
///         less
/// @throws NoSurface when no value, or every value, of the filtered volume lies in the range
/// @throws InvalidInput for a volume with one grid point along an axis, or with
///         VolumeBorder::Refuse when the solid reaches the border
/// @throws ResourceLimit before the memory exceeds its limit
/// @throws Cancelled
[[nodiscard]] IsosurfaceResult isosurface(const Volume& volume, const ValueRange& range,
                                          const IsosurfaceOptions& options = {});

}  // namespace levelset
