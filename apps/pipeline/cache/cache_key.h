#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/cache/cache.h"
#include "apps/pipeline/graph/graph.h"

namespace pipeline {

/// What a node's result follows from, in short: the program, the action, its options, the content
/// of the files that it reads, and the same of the nodes that it takes.
class CacheKeys {
 public:
  /// @param cache      knows the contents of files that were read before
  /// @param maxMemory  for grids that must be read to be known
  CacheKeys(const Cache& cache, std::size_t maxMemory);

  /// Of each node that is needed. None for what may be another one the next time: it reads standard
  /// input or files that name others, writes to what is no file, or measures time; and for what
  /// takes such a result.
  [[nodiscard]] std::vector<std::optional<std::string>> of(const Graph& graph,
                                                           const std::vector<char>& needed) const;

 private:
  [[nodiscard]] std::optional<std::string> keyOf(
      const Graph& graph, const Node& node,
      const std::vector<std::optional<std::string>>& before) const;
  /// Of a value that was made elsewhere: by what it holds.
  [[nodiscard]] std::optional<std::string> keyOf(const Value& given) const;
  [[nodiscard]] std::optional<std::string> contentOf(const std::filesystem::path& file,
                                                     const Node& node) const;

  const Cache& cache_;
  std::size_t maxMemory_;
  std::string program_;
};

}  // namespace pipeline
