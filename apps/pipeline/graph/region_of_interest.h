#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "apps/pipeline/graph/graph.h"
#include "levelset/placement/crop.h"

namespace pipeline {

/// What those who take a value read of it: all of it, unless the part says less.
struct Demand {
  levelset::BandPart part = {};

  [[nodiscard]] bool isWhole() const { return part.isAll(); }
  /// What either of two reads.
  void join(const Demand& other);
};

/// What is read of each node's value, going backwards through those that run.
/// @param runs   by node
/// @param plans  of whole values; empty where nothing is known, and all is asked for
/// @param leastHalfWidth  voxels, at least 1: what is read of each band in any case
/// @return       whole for what runs not, and for what is no band
[[nodiscard]] std::vector<Demand> demandsOf(const Graph& graph, const std::vector<char>& runs,
                                            const std::vector<std::optional<Plan>>& plans,
                                            double leastHalfWidth = 1);

/// What a band of that plan is, as far as it is asked for.
[[nodiscard]] Plan demanded(Plan plan, const Demand& demand);

}  // namespace pipeline
