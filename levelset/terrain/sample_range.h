#pragma once

namespace levelset {

/// A rectangle of samples of a terrain, borders included. It is empty if a last number is below the
/// first one.
struct SampleRange {
  int firstColumn = 0, firstRow = 0, lastColumn = -1, lastRow = -1;

  [[nodiscard]] bool isEmpty() const { return lastColumn < firstColumn || lastRow < firstRow; }
  [[nodiscard]] int columns() const { return lastColumn - firstColumn + 1; }
  [[nodiscard]] int rows() const { return lastRow - firstRow + 1; }
};

}  // namespace levelset
