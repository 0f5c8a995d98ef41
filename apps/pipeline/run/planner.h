#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"
#include "apps/pipeline/graph/regions_of_interest.h"
#include "apps/pipeline/registry/invocation.h"

namespace pipeline {

/// Predicts the result of an operator whose operands are plans.
/// @throws levelset::Error if the operator would reject its operands or options
[[nodiscard]] Plan planOf(Invocation& invocation);

/// Predicted sizes of values, known before the values are computed.
struct ValuePlans {
  std::vector<std::optional<Plan>> plans;  ///< one per node; empty: unknown size
  /// One per node: error that prevented the plan; null: none.
  std::vector<std::exception_ptr> failures;
};

/// Plans the values of all nodes that run.
/// @param runs       one flag per node
/// @param maxMemory  limit for files that planning must read, bytes
/// @param mesh       plans a node, given by its index, that makes a mesh and has no operands; may
///        take long, because it may compute the mesh
[[nodiscard]] ValuePlans planValues(const Graph& graph, const std::vector<char>& runs,
                                    std::size_t maxMemory,
                                    const std::function<std::optional<Plan>(std::size_t)>& mesh);

/// Checks the memory estimates of all planned values: each value alone, and the values that a run
/// in graph order holds at once.
/// @throws levelset::ResourceLimit if the estimate exceeds the limit; names the action
void checkMemoryFor(const Graph& graph, const std::vector<char>& runs,
                    const std::vector<std::optional<Plan>>& plans,
                    const std::vector<RegionOfInterest>& regions, std::size_t maxMemory);

/// Estimates the largest memory of a run in graph order, with the working memory of each action,
/// bytes. Values and actions of unknown size count nothing.
[[nodiscard]] double estimatePeak(const Graph& graph, const std::vector<char>& runs,
                                  const std::vector<std::optional<Plan>>& plans,
                                  const std::vector<RegionOfInterest>& regions);

/// Estimates the memory that the blocks of a band take while it is written in parts, bytes.
[[nodiscard]] double bytesForWriting(const Plan& plan);

/// Finds the action that writes the only result of a graph, if the estimated memory exceeds the
/// limit and the result can be computed in parts: a chain of actions on single bands that pass on a
/// region of interest, then `write` to a `.vdb` file.
/// @param runs   one flag per node that runs
/// @param plans  one plan of the complete value per node; empty: unknown size
/// @return index of the action; empty: the result is not computed in parts
[[nodiscard]] std::optional<std::size_t> findPartedWrite(
    const Graph& graph, const std::vector<char>& runs,
    const std::vector<std::optional<Plan>>& plans, const std::vector<RegionOfInterest>& regions,
    std::size_t maxMemory);

/// Describes a run without running it: which actions run and why, the region of interest of each
/// value, and the estimated time and memory. Reads meshes, but computes and writes nothing.
/// @param fullValues  ignore regions of interest
/// @param print       receives the text, even if an error follows
/// @throws levelset::ResourceLimit as checkMemoryFor()
/// @throws levelset::Error if an operator would reject its operands or options
void explain(const Graph& graph, std::size_t maxMemory, bool fullValues,
             const std::function<void(const std::string&)>& print);

}  // namespace pipeline
