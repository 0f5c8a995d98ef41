#pragma once

// Internal header of levelset: public headers must not include it.

#include <vector>

#include "levelset/terrain/height_pyramid.h"
#include "levelset/terrain/sample_range.h"

namespace levelset::terrain {

/// A pyramid of a ground that changes, with the errors of all coarse cells. They let an update
/// measure again only the cells below the change. They take 4/3 bytes for each sample, and at
/// most 4 for narrow fields.
class FollowedPyramid {
 public:
  /// @throws as heightPyramid()
  FollowedPyramid(const HeightField& field, const PyramidOptions& options);

  /// Equals heightPyramid() of the field to the bit.
  [[nodiscard]] const HeightPyramid& pyramid() const { return pyramid_; }

  /// Measures the patches again that have samples of a range. The work is that of the cells that
  /// the range meets at each level.
  void update(const HeightField& field, const SampleRange& changed);

 private:
  struct CellLevel {
    int columns = 0, rows = 0;
    std::vector<float> errors;
  };
  void measureCells(const HeightField& field, std::size_t level, const SampleRange& cells);
  void measurePatches(const HeightField& field, std::size_t level, const SampleRange& patches);

  HeightPyramid pyramid_;
  std::vector<CellLevel> cells_;  // by level; level 0 has no errors
};

}  // namespace levelset::terrain
