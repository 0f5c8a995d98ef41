#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"
#include "apps/pipeline/values/value.h"

/// Encodes data for other processes: pipelines with their parameters, and values.
namespace python {

/// A checked pipeline. It does not depend on the current folder.
struct Job {
  std::string graph;                           ///< JSON, with absolute file names
  std::vector<std::string> places;             ///< for each node, its position in the script
  std::map<std::string, std::string> globals;  ///< global options of the run, by name
};

/// Parses and checks a pipeline.
/// @param text  text of a script, or of a graph if the name ends in .json
/// @param name  name for error messages
/// @param settings  values of the script's variables; ignored for graphs
/// @param folder  folder to which file names are relative
/// @throws levelset::UsageError if the pipeline is wrong, or uses a standard stream, which other
///         processes do not have
[[nodiscard]] Job makeJob(const std::string& text, const std::string& name,
                          const std::map<std::string, std::string>& settings,
                          const std::filesystem::path& folder);
/// Parses the graph of a job again.
[[nodiscard]] pipeline::Graph graphOf(const Job& job);

/// Encodes a level set, a field or a mesh without loss, for the same version of this program on the
/// same kind of machine.
/// @throws levelset::UsageError for values of other kinds
[[nodiscard]] std::string bytesOf(const pipeline::Value& value);
/// Decodes the bytes of bytesOf().
/// @throws levelset::InvalidInput for damaged bytes
[[nodiscard]] pipeline::Value valueOf(pipeline::Kind kind, const std::string& bytes);

}  // namespace python
