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

  /// Computes one key per node; empty for unneeded nodes and for nodes that cannot be cached. These
  /// nodes cannot be cached:
  /// - nodes that read standard input, a file that an earlier node writes, or a file that refers to
  ///   other files
  /// - nodes that write to something other than a file, or that write files beside their value
  /// - nodes whose result is not repeatable (Operator::isRepeatable)
  /// - nodes that depend on a node that cannot be cached
  [[nodiscard]] std::vector<std::optional<std::string>> of(const Graph& graph,
                                                           const std::vector<char>& needed) const;

 private:
  /// Key of one node; empty: not cached.
  /// @param before  keys of the earlier nodes, by index
  [[nodiscard]] std::optional<std::string> keyOf(
      const Graph& graph, const Node& node,
      const std::vector<std::optional<std::string>>& before) const;
  /// Key of a value from outside the graph: a hash of its content.
  [[nodiscard]] std::optional<std::string> keyOf(const Value& given) const;
  /// Digest of the content of an input file of `node`; empty: the node cannot be cached.
  [[nodiscard]] std::optional<std::string> contentOf(const std::filesystem::path& file,
                                                     const Node& node) const;

  const Cache& cache_;
  std::size_t maxMemory_;
  std::string program_;  // digest of the executable or library that contains the operators; part of
                         // each key
};

}  // namespace pipeline
