#pragma once

#include <filesystem>
#include <string>

#include "apps/pipeline/graph/graph.h"

namespace pipeline {

/// Returns a graph as JSON: `{"format": "levelsmith graph", "version": 1, "nodes": […]}`. Each node
/// is `{"op": NAME, "options": {…}, "inputs": [node indices], "named": {OPTION: node index}, "as":
/// NAME}`; all members except "op" are optional. The only global option in the file is
/// `"tolerance"`, beside `"nodes"`, because it determines voxel sizes.
[[nodiscard]] std::string graphJson(const Graph& graph);

/// Reads a graph from JSON. The value of an option is a text as on the command line, a number, or
/// true for a flag.
/// @param name     name of the file, for error messages
/// @param globals  global options of the run; they override the tolerance in the text
/// @throws levelset::InvalidInput if the text is not a graph
/// @throws levelset::UsageError if an action or option is unknown or does not fit; the message
///         names the node
[[nodiscard]] Graph graphFromJson(const std::string& text, const std::string& name,
                                  const std::map<std::string, std::string>& globals = {});

/// Decides by extension if a file contains a graph.
[[nodiscard]] bool isGraphFile(const std::filesystem::path& file);

/// Reads a graph from a file.
/// @throws levelset::IoError if the file cannot be read; further errors as graphFromJson()
[[nodiscard]] Graph readGraph(const std::filesystem::path& file,
                              const std::map<std::string, std::string>& globals = {});
/// Writes a graph to a file.
/// @throws levelset::IoError
void writeGraph(const std::filesystem::path& file, const Graph& graph);

}  // namespace pipeline
