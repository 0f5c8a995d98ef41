#pragma once

#include <functional>
#include <vector>

#include "levelset/terrain/height_field.h"

/// Contour lines of a ground by marching squares.
namespace levelset {

struct ContourLine {
  double height = 0;
  bool isClosed = false;                ///< the last point is joined to the first one
  std::vector<Imath::V2d> points = {};  ///< at least 2, no two equal ones in a row
};

struct ContourOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Heights base + n × interval between the lowest and the highest sample, in ascending order.
/// @throws UsageError for an interval that is not positive, or more than 100,000 heights
[[nodiscard]] std::vector<double> contourHeights(const HeightField& field, double interval,
                                                 double base = 0);

/// Finds the lines of equal height, and passes each one on when it is complete. So memory is that
/// of the lines that are open in a row of cells.
/// @param take  receives the lines, in the same order for any number of threads
/// @throws as contourLines(), and what `take` throws
void forEachContourLine(const HeightField& field, const std::vector<double>& heights,
                        const std::function<void(ContourLine)>& take,
                        const ContourOptions& options = {});

/// Finds the lines of equal height, with higher ground on their left. A line crosses the edges of
/// cells where linear interpolation gives its height. Cells on both sides of an edge share that
/// point, so lines are closed or end at the border of the data. A sample at the height of the line
/// counts as above it. Where a cell has two lines, the height of the bilinear surface at its saddle
/// point decides which edges they join. Cells with a missing corner have no lines, and lines of
/// a single point are left out.
/// @param heights  finite, ascending
/// @return the lines of the first height, then those of the next; with any number of threads in the
///         same order
/// @throws UsageError for heights that are not finite and ascending
/// @throws InvalidInput for a field that requireHeights() refuses
/// @throws ResourceLimit, Cancelled
[[nodiscard]] std::vector<ContourLine> contourLines(const HeightField& field,
                                                    const std::vector<double>& heights,
                                                    const ContourOptions& options = {});

}  // namespace levelset
