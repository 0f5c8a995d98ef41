#include "apps/python/jobs.h"

#include <fmt/core.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "apps/pipeline/grammar/chain.h"
#include "apps/pipeline/grammar/script.h"
#include "apps/pipeline/graph/graph_file.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/mesh_bytes.h"
#include "apps/pipeline/values/refusal.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/files/band_file.h"

namespace python {
namespace {

namespace fs = std::filesystem;
using levelset::UsageError;
using pipeline::Graph;
using pipeline::Kind;
using pipeline::Node;
using pipeline::Param;
using pipeline::ParamType;
using pipeline::Value;

void refuseStandardStreams(const Node& node) {
  const pipeline::Invocation probe(*node.op, node.options);
  for (const auto use :
       {&pipeline::Operator::usesStandardInput, &pipeline::Operator::usesStandardOutput}) {
    const auto& uses = node.op->*use;
    if (uses && !node.options.contains("json") && uses(probe))
      throw UsageError(pipeline::sentenceOf(
          node.op->name,
          "'-' is a standard stream, which the jobs of map() do not have; give a file"));
  }
}

std::string absolute(const std::string& file, const fs::path& folder) {
  return (folder / file).lexically_normal().string();
}

/// A temporary folder. The destructor removes it with its contents.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "levelsmith-XXXXXX").string();
    if (!::mkdtemp(name.data()))
      throw levelset::IoError(
          fmt::format("pickle: a folder cannot be created in '{}'; set TMPDIR to another folder",
                      fs::temp_directory_path().string()));
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] fs::path file() const { return path_ / "value.vdb"; }

 private:
  fs::path path_;
};

}  // namespace

Job makeJob(const std::string& text, const std::string& name,
            const std::map<std::string, std::string>& settings, const fs::path& folder) {
  Graph graph = pipeline::isGraphFile(name)
                    ? pipeline::graphFromJson(text, name)
                    : pipeline::parseScript(pipeline::expandScript(text, name, settings));
  Job job;
  for (Node& node : graph.nodes) {
    refuseStandardStreams(node);
    for (const Param& param : node.op->params) {
      const auto option = node.options.find(param.name);
      if (param.type == ParamType::Path && option != node.options.end() && !option->second.empty())
        option->second = absolute(option->second, folder);
    }
    job.places.push_back(node.location);
  }
  for (const char* option : {"cache", "report"})
    if (const auto it = graph.globals.find(option); it != graph.globals.end())
      it->second = absolute(it->second, folder);
  job.graph = graphJson(graph);
  job.globals = std::move(graph.globals);
  return job;
}

Graph graphOf(const Job& job) {
  Graph graph = pipeline::graphFromJson(job.graph, "the job");
  for (std::size_t i = 0; i < graph.nodes.size() && i < job.places.size(); ++i)
    graph.nodes[i].location = job.places[i];
  graph.globals = job.globals;
  return graph;
}

std::string bytesOf(const Value& value) {
  if (value.kind() == Kind::Mesh) return pipeline::bytesOf(value.mesh());
  if (value.kind() == Kind::Points) return pipeline::bytesOf(value.cloud());
  if (value.kind() != Kind::Band && value.kind() != Kind::Field)
    throw UsageError(fmt::format(
        "pickle: {} cannot be sent to another process; send the values computed from it, "
        "or its inputs",
        kindPhrase(value.kind())));
  const TemporaryFolder folder;
  if (value.kind() == Kind::Band)
    levelset::writeBand(folder.file(), value.band(), {.name = value.band().name()});
  else
    levelset::writeField(folder.file(), value.field(), {.name = value.field().name()});
  std::ifstream in(folder.file(), std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

Value valueOf(Kind kind, const std::string& bytes) {
  if (kind == Kind::Mesh) {
    levelset::TriMesh mesh;
    if (!pipeline::readMeshBytes(bytes, mesh))
      throw levelset::InvalidInput(
          "pickle: the bytes of a mesh are damaged or from another version; pickle the mesh again");
    return Value(std::move(mesh));
  }
  if (kind == Kind::Points) {
    levelset::PointCloud cloud;
    if (!pipeline::readCloudBytes(bytes, cloud))
      throw levelset::InvalidInput(
          "pickle: the bytes of a point cloud are damaged or from another version; pickle it "
          "again");
    return Value(std::move(cloud));
  }
  const TemporaryFolder folder;
  std::ofstream out(folder.file(), std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out)
    throw levelset::IoError(
        fmt::format("pickle: '{}' cannot be written; free some space, or set TMPDIR to "
                    "another folder",
                    folder.file().string()));
  if (kind == Kind::Field)
    return Value(levelset::readField(folder.file(),
                                     {.grid = levelset::bandFileInfo(folder.file()).at(0).name}));
  return Value(levelset::readBand(folder.file()));
}

}  // namespace python
