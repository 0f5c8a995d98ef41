#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/cache/cache.h"
#include "apps/pipeline/graph/graph.h"

namespace pipeline {

/// Computes the cache key of each node. The key hashes everything that determines the result: the
/// program, the action, its options, the content of its input files, and the keys of its operands.
class CacheKeys {
 public:
  /// @param cache      remembers digests of files, so that unchanged files are not read again
  /// @param maxMemory  limit for grids that must be read to compute their digest, bytes
  CacheKeys(const Cache& cache, std::size_t maxMemory);

  /// Computes one key per node; empty for unneeded nodes and for nodes that cannot be cached. Not
  /// cached: nodes that read standard input or a file that refers to other files, that write to
  /// something other than a file, or that measure time. The same holds for nodes that depend on
  /// them.
  [[nodiscard]] std::vector<std::optional<std::string>> of(const Graph& graph,
                                                           const std::vector<char>& needed) const;

 private:
  [[nodiscard]] std::optional<std::string> keyOf(
      const Graph& graph, const Node& node,
      const std::vector<std::optional<std::string>>& before) const;
  /// Key of a value from outside the graph: a hash of its content.
  [[nodiscard]] std::optional<std::string> keyOf(const Value& given) const;
  [[nodiscard]] std::optional<std::string> contentOf(const std::filesystem::path& file,
                                                     const Node& node) const;

  const Cache& cache_;
  std::size_t maxMemory_;
  std::string program_;
};

}  // namespace pipeline
