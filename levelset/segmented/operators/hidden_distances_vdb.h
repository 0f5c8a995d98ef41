#pragma once

// Distances that vanished interfaces hid. Includes OpenVDB: for .cpp files only.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "levelset/progress.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {

/// Finds the region with the nearest grid point, up to two grid points away.
/// @param others   labels, ascending, not empty
/// @param labelAt  RegionLabel(Coord)
/// @return index in `others`
template <typename LabelAt>
[[nodiscard]] std::size_t nearestOwner(const openvdb::Coord& at,
                                       const std::vector<RegionLabel>& others,
                                       const LabelAt& labelAt) {
  std::size_t best = 0;
  int least = 13;  // above that of the corners
  for (int x = -2; x <= 2; ++x)
    for (int y = -2; y <= 2; ++y)
      for (int z = -2; z <= 2; ++z) {
        const int squared = x * x + y * y + z * z;
        if (squared >= least) continue;
        const RegionLabel label = labelAt(at.offsetBy(x, y, z));
        const auto found = std::lower_bound(others.begin(), others.end(), label);
        if (found == others.end() || *found != label) continue;
        least = squared;
        best = static_cast<std::size_t>(found - others.begin());
      }
  return best;
}

/// Stores distances of grid points of a region that have none, although its boundary is near. A
/// grid point stores the nearest interface only. When that vanishes, the next one is not known.
/// @param blocks  numbers of the blocks that may have such grid points
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SegmentedField withHiddenDistances(const SegmentedField& field, RegionLabel region,
                                                 const std::vector<openvdb::Coord>& blocks,
                                                 std::size_t maxMemory);

}  // namespace levelset
