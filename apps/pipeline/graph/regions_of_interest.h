#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "apps/pipeline/graph/graph.h"
#include "levelset/region_of_interest.h"

namespace pipeline {

using levelset::RegionOfInterest;

/// Finds the region of interest of each node's value, going backwards through the nodes that run.
/// @param runs   one flag per node
/// @param plans  of whole values; an empty one means that all of the value is read
/// @param leastHalfWidth  voxels, at least 1: read of each band in any case
/// @return       one per node; the whole for nodes that do not run and for values that are no bands
[[nodiscard]] std::vector<RegionOfInterest> regionsOfInterest(
    const Graph& graph, const std::vector<char>& runs,
    const std::vector<std::optional<Plan>>& plans, double leastHalfWidth = 1);

/// The plan of a band that is restricted to a region of interest.
[[nodiscard]] Plan restricted(Plan plan, const RegionOfInterest& roi);

}  // namespace pipeline
