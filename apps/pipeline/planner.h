#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/demand.h"
#include "apps/pipeline/graph.h"
#include "apps/pipeline/invocation.h"

namespace pipeline {

/// What the operator would make of operands that are plans.
/// @throws levelset::Error for what it would refuse
[[nodiscard]] Plan planOf(Invocation& invocation);

/// Plans of the values that those which run would make, as far as they can be told.
/// @param runs  by node
/// @param mesh  plans a node that reads or makes a mesh of nothing, which may take a while
[[nodiscard]] std::vector<std::optional<Plan>> plansOf(
    const Graph& graph, const std::vector<char>& runs, std::size_t maxMemory,
    const std::function<std::optional<Plan>(std::size_t)>& mesh);

/// Refuses what would take more than there is, before anything is made.
/// @throws levelset::ResourceLimit, with the action
void requireMemoryFor(const Graph& graph, const std::vector<std::optional<Plan>>& plans,
                      const std::vector<Demand>& demands, std::size_t maxMemory);

/// What would run, and what is left out and why; how much of each value is needed; what it would
/// take. Reads meshes, and makes and writes nothing.
/// @throws as requireMemoryFor, and for what an operator would refuse
[[nodiscard]] std::string explain(const Graph& graph, std::size_t maxMemory, bool wholeValues);

}  // namespace pipeline
