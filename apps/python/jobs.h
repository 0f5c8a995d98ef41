#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "apps/pipeline/graph/graph.h"
#include "apps/pipeline/values/value.h"

/// What is handed to other processes: pipelines with their parameters, and values.
namespace python {

/// A pipeline that was checked, for whatever folder it will run in.
struct Job {
  std::string graph;                           ///< JSON; its files have absolute names
  std::vector<std::string> places;             ///< by node: where a script wrote it
  std::map<std::string, std::string> globals;  ///< options of the run
};

/// @param text      of a script, or of a graph where the name is that of one (.json)
/// @param name      for what is said about it
/// @param settings  values of its variables; of a graph they stand in it already
/// @param folder    that the names of files are relative to
/// @throws levelset::UsageError also for standard streams, which other processes do not have
[[nodiscard]] Job makeJob(const std::string& text, const std::string& name,
                          const std::map<std::string, std::string>& settings,
                          const std::filesystem::path& folder);
[[nodiscard]] pipeline::Graph graphOf(const Job& job);

/// A level set, a field or a mesh as bytes, bit for bit, for this program on such machines.
/// @throws levelset::UsageError for values of other kinds
[[nodiscard]] std::string bytesOf(const pipeline::Value& value);
/// @throws levelset::InvalidInput for bytes that are damaged
[[nodiscard]] pipeline::Value valueOf(pipeline::Kind kind, const std::string& bytes);

}  // namespace python
