#pragma once

#include <Imath/ImathVec.h>

#include <memory>
#include <span>
#include <string>

#include "levelset/terrain/height_field.h"
#include "levelset/terrain/height_pyramid.h"

/// Heights of single patches of a pyramid, from memory or from a file.
namespace levelset {

/// Grid of a ground and the errors of its patches, without the heights.
struct GroundLayout {
  int columns = 0, rows = 0;           ///< numbers of samples along x and y
  Imath::V2d origin = Imath::V2d(0);   ///< position of the sample of least x and y
  Imath::V2d spacing = Imath::V2d(1);  ///< distances between samples along x and y, > 0
  std::string coordinateSystem = {};   ///< name of the coordinate system; empty: unknown
  bool isGeographic = false;           ///< x and y are longitude and latitude in degrees
  HeightPyramid pyramid = {};
};

/// Source of the heights of patches. All functions may be called by several threads at once.
class PatchStore {
 public:
  PatchStore() = default;
  PatchStore(const PatchStore&) = delete;
  PatchStore& operator=(const PatchStore&) = delete;
  virtual ~PatchStore() = default;

  [[nodiscard]] virtual const GroundLayout& layout() const = 0;

  /// Reads the heights of patch (column, row) of a level, row by row from the south. Height (i, j)
  /// of the patch is that of sample (min((column × cells + i) × 2^level, columns - 1), likewise for
  /// rows). Missing samples are NaN.
  /// @param heights  (cells + 1)² floats
  /// @throws FileError, InvalidInput when the source cannot be read or is damaged
  virtual void readPatch(int level, int column, int row, std::span<float> heights) const = 0;
};

/// Gives access to the patches of a field in memory.
/// @param field    not null; with the grid of the pyramid
/// @param pyramid  made by heightPyramid() of the field
[[nodiscard]] std::unique_ptr<PatchStore> patchStoreOf(std::shared_ptr<const HeightField> field,
                                                       HeightPyramid pyramid);

}  // namespace levelset
