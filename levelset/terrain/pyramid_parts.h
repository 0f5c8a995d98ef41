#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/terrain/height_field.h"
#include "levelset/terrain/height_pyramid.h"

namespace levelset::terrain {

/// Refuses sizes of which no pyramid is made.
/// @throws UsageError, InvalidInput as heightPyramid()
void requirePyramid(int columns, int rows, int cells);

/// Number of patches of all levels.
[[nodiscard]] double patchCount(int columns, int rows, int cells);

/// Makes all levels, with patches that hold no heights yet.
[[nodiscard]] HeightPyramid emptyPyramid(int columns, int rows, int cells);

/// Raises the bounds of a level to those of the finer level.
void takeBounds(PyramidLevel& level, const PyramidLevel& finer);

/// Two triangles over a rectangle of cells, with the diagonal from the corner of least x and y.
/// Compares them with the ground, part by part: the parts may come in any order.
class CoarseCell {
 public:
  /// Heights of the corners: of least x and y, beside it along x, beside it along y, opposite.
  struct Corners {
    double low = 0, alongX = 0, alongY = 0, high = 0;
  };
  /// Largest distance found so far, and the largest height, which bounds the rounding.
  struct Deviation {
    double error = 0, magnitude = 0;
    void raiseTo(const Deviation& other);
  };

  /// @param width, height  sides of the rectangle in cells of the ground, > 0
  CoarseCell(int width, int height, const Corners& corners);

  /// Returns true if the diagonal runs along those of the cells. Then distances need no rounding
  /// bound.
  [[nodiscard]] bool isAligned() const { return isAligned_; }

  /// Raises a deviation to that of the part of the ground in a window. Each cell of the ground must
  /// be in one window at least.
  /// @param column, row  sample of the window that is the corner of least x and y of the
  ///                     rectangle; may be outside the window
  void compare(const HeightField& window, int column, int row, Deviation& deviation) const;

  /// Bound of the distance, from the deviations of all parts.
  [[nodiscard]] double bound(const Deviation& deviation) const;

 private:
  template <bool kAligned>
  void compareSamples(const HeightField& window, int column, int row, Deviation& deviation) const;
  void compareCrossings(const HeightField& window, int column, int row, Deviation& deviation) const;

  int width_, height_;
  Corners corners_;
  bool isAligned_;
};

}  // namespace levelset::terrain
