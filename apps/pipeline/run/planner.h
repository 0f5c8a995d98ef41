#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"
#include "apps/pipeline/graph/region_of_interest.h"
#include "apps/pipeline/registry/invocation.h"

namespace pipeline {

/// What the operator would make of operands that are plans.
/// @throws levelset::Error for what it would refuse
[[nodiscard]] Plan planOf(Invocation& invocation);

/// What can be told of values before they are made.
struct ValuePlans {
  std::vector<std::optional<Plan>> plans;    ///< by node; empty: its size cannot be told
  std::vector<std::exception_ptr> refusals;  ///< by node: why there is no plan, if that was refused
};

/// Plans of the values that those which run would make, as far as they can be told.
/// @param runs       by node
/// @param maxMemory  for what has to be read to be planned
/// @param mesh  plans a node that reads or makes a mesh of nothing, which may take a while
[[nodiscard]] ValuePlans plansOf(const Graph& graph, const std::vector<char>& runs,
                                 std::size_t maxMemory,
                                 const std::function<std::optional<Plan>(std::size_t)>& mesh);

/// Refuses what would take more than there is, before anything is made: one value, or those that
/// are held at once where they run one after another.
/// @throws levelset::ResourceLimit, with the action
void requireMemoryFor(const Graph& graph, const std::vector<char>& runs,
                      const std::vector<std::optional<Plan>>& plans,
                      const std::vector<RegionOfInterest>& regions, std::size_t maxMemory);

/// Tells what would run, and what is left out and why; how much of each value is needed; what it
/// would take. Reads meshes, and makes and writes nothing.
/// @param tell  gets the text, also where a refusal follows
/// @throws as requireMemoryFor, and for what an operator would refuse
void explain(const Graph& graph, std::size_t maxMemory, bool wholeValues,
             const std::function<void(const std::string&)>& tell);

}  // namespace pipeline
