#pragma once

// Internal header of levelset: public headers must not include it.

#include <map>
#include <vector>

#include "levelset/segmented/segment_solids.h"

namespace levelset {

/// Counts of thin parts of regions, by label.
class ThinTally {
 public:
  struct Place {
    std::size_t places;
    bool isLost;
    double thickness;
    Imath::V3d position;
  };

  /// Adds places. Of equally thin ones, the first counts.
  void add(RegionLabel label, const Place& place);
  void add(const ThinTally& other);
  [[nodiscard]] std::vector<ThinPart> list() const;

 private:
  std::map<RegionLabel, ThinPart> parts_;
};

/// Finds grid points whose region is thinner than a voxel along a line of the grid.
[[nodiscard]] ThinTally thinParts(const SegmentedField& field);

}  // namespace levelset
