#pragma once

#include <filesystem>
#include <string>

#include "apps/pipeline/graph/graph.h"

namespace pipeline {

/// A graph as JSON: `{"format": "levelsmith graph", "version": 1, "nodes": […]}`, each node
/// `{"op": NAME, "options": {…}, "inputs": [numbers of nodes], "named": {option: number of a node},
/// "as": NAME}`, of which all but the first may be left out. Of the options of the run
/// `"tolerance"` is in it, beside the nodes: voxel sizes follow from it.
[[nodiscard]] std::string graphJson(const Graph& graph);

/// Options may be texts as one would write them, numbers, or true for a flag.
/// @param name     of the file, for what is said about it
/// @param globals  options of the run, which win over what the text says
/// @throws levelset::InvalidInput for what is no such text; levelset::UsageError, with the number
/// of
///         the node, for actions and options that are none, or that cannot be taken together
[[nodiscard]] Graph graphFromJson(const std::string& text, const std::string& name,
                                  const std::map<std::string, std::string>& globals = {});

/// Does the name say that a file holds a graph?
[[nodiscard]] bool isGraphFile(const std::filesystem::path& file);

/// @throws as graphFromJson(), and levelset::IoError when it cannot be read
[[nodiscard]] Graph readGraph(const std::filesystem::path& file,
                              const std::map<std::string, std::string>& globals = {});
/// @throws levelset::IoError
void writeGraph(const std::filesystem::path& file, const Graph& graph);

}  // namespace pipeline
