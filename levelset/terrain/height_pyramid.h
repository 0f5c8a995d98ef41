#pragma once

#include <vector>

#include "levelset/terrain/height_field.h"

/// Coarser and coarser approximations of a ground, with exact errors.
namespace levelset {

/// A square part of a ground at one level of a pyramid.
struct PyramidPatch {
  float lowest = 0, highest = 0;  ///< heights of known samples in the patch; NaN without any
  /// Largest vertical distance between the ground and the triangles of the patch, over all their
  /// points. It is rounded up. Infinite where a coarser level covers a missing sample.
  float error = 0;
  /// Largest error of this patch and of all finer patches in it.
  float bound = 0;
};

/// Patches of one level: patch (i, j) has cells of 2^level samples, and covers the samples from
/// (i, j) × cells × 2^level to the same of (i + 1, j + 1), borders included.
struct PyramidLevel {
  int columns = 0, rows = 0;  ///< numbers of patches along x and y
  std::vector<PyramidPatch> patches;

  [[nodiscard]] const PyramidPatch& at(int column, int row) const {
    return patches[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(column)];
  }
};

/// A quadtree of patches. Level 0 has the full data. Four patches of a level are one of the next,
/// with every second sample, until one patch covers the field. At the border of the field, the last
/// cells of a patch are cut, and end at the last samples.
struct HeightPyramid {
  int cells = 0;  ///< cells along a side of a patch, a power of two
  std::vector<PyramidLevel> levels;
};

struct PyramidOptions {
  int cells = 16;  ///< cells along a side of a patch: a power of two from 2 to 128
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Builds the pyramid of a field. The same bits for any number of threads.
/// @throws UsageError for a number of cells out of range
/// @throws InvalidInput for a field of less than 2x2 samples, or one that requireHeights() refuses
/// @throws ResourceLimit, Cancelled
[[nodiscard]] HeightPyramid heightPyramid(const HeightField& field,
                                          const PyramidOptions& options = {});

/// Rounds up to float, so that a bound stays one.
[[nodiscard]] float heightRoundedUp(double bound);

/// Largest vertical distance between the ground and two triangles over a rectangle of cells, with
/// the diagonal from the corner of least x and y. The difference of the surfaces is linear between
/// their edges, so it is greatest at a sample or where the diagonal crosses an edge of a cell.
/// @pre firstColumn < lastColumn, firstRow < lastRow, both in the field
/// @return infinite if a sample of the rectangle is missing
[[nodiscard]] double coarseCellError(const HeightField& field, int firstColumn, int firstRow,
                                     int lastColumn, int lastRow);

}  // namespace levelset
