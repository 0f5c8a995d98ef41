#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "levelset/progress.h"
#include "levelset/volumes/volume.h"

namespace levelset {

/// Height of a sample without data.
inline constexpr float kMissingHeight = std::numeric_limits<float>::quiet_NaN();

/// Heights of a ground on a regular grid of positions (x, y), z upwards. Samples without data are
/// NaN; no function gives them a height unless it is asked to.
///
/// Between the samples the ground is a triangle mesh. A diagonal from the corner of least x and y
/// to the corner of greatest x and y divides each cell of four samples. A triangle with a missing
/// corner is not part of the ground.
struct HeightField {
  int columns = 0, rows = 0;           ///< numbers of samples along x and y
  Imath::V2d origin = Imath::V2d(0);   ///< position of the sample of least x and y
  Imath::V2d spacing = Imath::V2d(1);  ///< distances between samples along x and y, > 0
  std::vector<float> heights = {};     ///< rows × columns; the first row has the least y
  std::optional<double> noData = {};   ///< number that marks missing samples in files
  std::string coordinateSystem = {};   ///< name of the coordinate system; empty: unknown
  bool isGeographic = false;           ///< x and y are longitude and latitude in degrees

  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  [[nodiscard]] float at(int column, int row) const { return heights[index(column, row)]; }
  [[nodiscard]] bool isMissing(int column, int row) const { return std::isnan(at(column, row)); }
  /// Position of a sample, world units.
  [[nodiscard]] Imath::V2d position(int column, int row) const {
    return {origin.x + column * spacing.x, origin.y + row * spacing.y};
  }
  [[nodiscard]] Imath::V3d point(int column, int row) const {
    const Imath::V2d p = position(column, row);
    return {p.x, p.y, static_cast<double>(at(column, row))};
  }
  [[nodiscard]] std::size_t missingCount() const;
  /// Bounds of the known samples, world units; empty if there are none.
  [[nodiscard]] Imath::Box3d bounds() const;
  /// Memory of the heights, bytes.
  [[nodiscard]] std::size_t memoryUse() const { return heights.size() * sizeof(float); }
  /// Hash of the grid, its place and the heights.
  [[nodiscard]] std::uint64_t contentHash() const;
};

/// Checks the size and the place of a height field, but not its heights.
/// @throws InvalidInput for sizes below 1 or above 2^30, a spacing that is not positive, or a
///         position that is not finite
void requireGrid(const HeightField& field);

/// Checks a height field. Readers and operators call it.
/// @throws InvalidInput as requireGrid(), and for an infinite height, or another number of heights
///         than rows × columns
void requireHeights(const HeightField& field);

/// Refuses a field in degrees, where lengths along x, y and z have different units.
/// @throws InvalidInput: "x and y are degrees, but …"
void requireLengths(bool isGeographic);
inline void requireLengths(const HeightField& field) {
  requireLengths(field.isGeographic);
}

/// Makes a height field of a volume with one layer, such as a raw file of heights. Row j of the
/// volume is row j of the field, so the first row has the least y.
/// @throws InvalidInput for more than one layer, or axes that are not those of x and y
/// @throws ResourceLimit
[[nodiscard]] HeightField heightsOf(const Volume& volume, std::optional<double> noData = {},
                                    std::size_t maxMemory = kNoMemoryLimit);

/// Range of the samples of an axis in an interval: the first and the last. None: first > last.
/// Borders within 1e-9 spacings of a sample contain it.
/// @param origin  position of the first sample
[[nodiscard]] std::pair<int, int> samplesBetween(double origin, double spacing, int count,
                                                 double low, double high);

/// Keeps the samples in a box of positions, borders included. The height of the box does not count.
/// @throws InvalidInput when the box has no sample
[[nodiscard]] HeightField croppedHeights(const HeightField& field, const Imath::Box3d& box);

/// Reverses the order of the rows: the first row becomes the one of greatest y.
[[nodiscard]] HeightField flippedHeights(HeightField field);

/// Multiplies the heights, for files in other units.
/// @throws UsageError for a factor that is zero or not finite
/// @throws InvalidInput when a height exceeds the range of float
[[nodiscard]] HeightField scaledHeights(HeightField field, double factor);

/// Turns degrees into metres about the middle of the field, which becomes (0, 0). A degree of
/// latitude is as long as the meridian's radius of curvature there says, and a degree of longitude
/// as that of the prime vertical, on the ellipsoid of WGS 84. Away from the middle latitude the
/// widths have a relative error of tan(latitude) times the difference in radians.
/// @throws InvalidInput for a field that is not in degrees, or that contains a pole
[[nodiscard]] HeightField metricHeights(HeightField field);

}  // namespace levelset
