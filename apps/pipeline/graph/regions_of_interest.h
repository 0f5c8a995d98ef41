#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "apps/pipeline/graph/graph.h"
#include "levelset/region_of_interest.h"

namespace pipeline {

using levelset::RegionOfInterest;

/// Finds the region of interest of each node's value, from the last node that runs to the first.
/// @param runs   one flag per node: true if the node runs
/// @param plans  one plan of the complete value per node; empty: unknown, so the complete value is
///        needed
/// @param leastHalfWidth  smallest half width that is computed of any band, voxels; at least 1
/// @param part  box of the requested results, world units. In a smaller box than kEverywhere, the
///        regions are so large that the results in it have the bits of complete results.
/// @return       one region of interest per node; the complete value for nodes that do not run and
///               for values that are no bands
[[nodiscard]] std::vector<RegionOfInterest> regionsOfInterest(
    const Graph& graph, const std::vector<char>& runs,
    const std::vector<std::optional<Plan>>& plans, double leastHalfWidth = 1,
    const Imath::Box3d& part = levelset::kEverywhere);

/// Restricts the plan of a band to a region of interest: reduces its half width and its area.
[[nodiscard]] Plan restricted(Plan plan, const RegionOfInterest& roi);

}  // namespace pipeline
