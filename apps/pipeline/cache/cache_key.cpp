#include "apps/pipeline/cache/cache_key.h"

#include <dlfcn.h>
#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "apps/pipeline/values/digest.h"
#include "apps/pipeline/values/mesh_bytes.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/files/band_file.h"
#include "levelset/segmented/files/segmented_file.h"
#include "levelset/terrain/files/height_field_file.h"
#include "levelset/terrain/tiles/tiled_ground.h"

namespace pipeline {
namespace {

/// Appends a labelled text with its length, so that different lists of texts give different keys.
void add(std::string& to, const std::string& what, const std::string& text) {
  to += fmt::format("{}:{}:{}\n", what, text.size(), text);
}

std::string lowerExtension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

/// Returns true for files that may keep their data in another file: scenes and other documents,
/// and headers of volumes.
bool refersToFiles(const std::string& extension) {
  return extension == ".json" || extension == ".mhd" || extension == ".nhdr" ||
         extension == ".hdr" || extension == ".img";
}

std::optional<std::string> digestOfFile(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return {};
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) return {};
  return digestOf(bytes);
}

std::string stampText(const FileStamp& stamp) {
  return fmt::format("{} {} {} {}", stamp.size, stamp.inode, stamp.device, stamp.changed);
}

/// Executable, or shared library of the Python module, that contains this code. Its digest is part
/// of each key, because another version of the program may compute other results.
std::filesystem::path programFile() {
  Dl_info about;
  const bool isKnown =
      dladdr(reinterpret_cast<const void*>(&findOperator), &about) != 0 && about.dli_fname;
  const std::filesystem::path file = isKnown ? about.dli_fname : "";
  std::error_code ignored;
  return std::filesystem::is_regular_file(file, ignored) ? file : "/proc/self/exe";
}

/// Adds what a terrain takes from outside its file: a tile its place from the name, and a grid the
/// files beside it.
void addTerrainFiles(std::string& text, const std::filesystem::path& file, const Node& node) {
  const auto format = node.options.find("format");
  if (!levelset::isHeightFormat(format == node.options.end() ? file.string() : format->second))
    return;
  add(text, "name", file.stem().string());
  // Headers and coordinate systems; GDAL also reads places, statistics and masks.
  for (const char* extension : {".hdr", ".prj", ".tfw", ".tifw", ".wld"}) {
    std::filesystem::path beside = file;
    beside.replace_extension(extension);
    add(text, extension, digestOfFile(beside).value_or(""));
  }
  for (const char* ending : {".aux.xml", ".msk"})
    add(text, ending, digestOfFile(file.string() + ending).value_or(""));
}

/// Content of a tiled terrain, from its header: the file may be larger than the memory.
std::optional<std::string> contentOfTiles(const std::filesystem::path& file) {
  try {
    return fmt::format("tiles {:016x}", levelset::tiledGroundHash(file));
  } catch (const levelset::Error&) {
    return {};  // not cached: the action that reads the file will report the error
  }
}

}  // namespace

CacheKeys::CacheKeys(const Cache& cache, std::size_t maxMemory)
    : cache_(cache), maxMemory_(maxMemory) {
  const std::filesystem::path file = programFile();
  const std::optional<FileStamp> stamp = stampOf(file);
  const std::string name = stamp ? "program-" + digestOf(stampText(*stamp)) : "";
  if (stamp)
    if (const auto known = cache.memo(name)) program_ = *known;
  if (!program_.empty()) return;
  program_ = digestOfFile(file).value_or(LEVELSMITH_VERSION);
  if (stamp) cache.remember(name, program_);
}

std::optional<std::string> CacheKeys::contentOf(const std::filesystem::path& file,
                                                const Node& node) const {
  const std::optional<FileStamp> stamp = stampOf(file);
  const std::string extension = lowerExtension(file);
  // Not cached: the file is no regular file, or one that refers to further files.
  if (!stamp || refersToFiles(extension)) return {};
  const auto format = node.options.find("format");
  if (levelset::isTiledGroundFormat(format == node.options.end() ? file.string() : format->second))
    return contentOfTiles(file);
  std::string about = stampText(*stamp);
  const auto grid = node.options.find("grid");
  const bool isNamed = extension == ".vdb" && grid != node.options.end();
  if (isNamed) about += " " + grid->second;
  const std::string name = digestOf(about);
  if (auto known = cache_.memo(name)) return known;
  const bool isGrid = isNamed || (extension == ".vdb" && !levelset::holdsSegmented(file));
  std::optional<std::string> content;
  if (isGrid) {
    // Two OpenVDB files of the same grid can differ in their bytes, so the content of the grid is
    // hashed.
    try {
      const levelset::BandOrField read = levelset::readGrid(
          file, {.grid = grid == node.options.end() ? "" : grid->second, .maxMemory = maxMemory_});
      content = std::visit(
          [](const auto& of) { return fmt::format("grid {:016x}", of.contentHash()); }, read);
    } catch (const levelset::Cancelled&) {
      throw;
    } catch (const levelset::Error&) {
      return {};  // not cached: the action that reads the file will report the error
    }
  } else {
    content = digestOfFile(file);
  }
  if (content) cache_.remember(name, *content);
  return content;
}

std::optional<std::string> CacheKeys::keyOf(
    const Graph& graph, const Node& node,
    const std::vector<std::optional<std::string>>& before) const {
  const Operator& op = *node.op;
  if (!op.isRepeatable) return {};
  const Invocation probe(op, node.options);
  if (op.usesStandardInput && op.usesStandardInput(probe)) return {};
  std::string text;
  add(text, "program", program_);
  add(text, "action", op.name);
  std::vector<std::string> targets;
  if (op.targets) targets = op.targets(probe);
  if (node.makes() && !targets.empty()) return {};
  for (const Param& param : op.params) {
    const auto given = node.options.find(param.name);
    if (given == node.options.end() || node.named.contains(param.name)) continue;
    const std::string& value = given->second;
    if (param.type != ParamType::Path) {
      add(text, param.name, value);
      continue;
    }
    if (std::find(targets.begin(), targets.end(), value) != targets.end()) {
      const std::filesystem::path file = levelset::canonicalFile(value);
      if (file.empty() || lowerExtension(file) == ".json") return {};
      add(text, param.name, file.string());
      continue;
    }
    const std::optional<std::string> content = contentOf(value, node);
    if (!content) return {};
    add(text, param.name, *content);
    add(text, "of", lowerExtension(value));
    addTerrainFiles(text, value, node);
  }
  for (const std::size_t input : node.inputs) {
    if (!before[input]) return {};
    add(text, "takes", *before[input]);
    if (op.readsNames) add(text, "named", graph.nodes[input].name);
  }
  for (const auto& [option, input] : node.named) {
    if (!before[input]) return {};
    add(text, option + " takes", *before[input]);
  }
  return digestOf(text);
}

std::optional<std::string> CacheKeys::keyOf(const Value& given) const {
  std::string text;
  add(text, "program", program_);
  add(text, "given", kindName(given.kind()));
  if (given.kind() == Kind::Mesh) {
    add(text, "mesh", digestOf(bytesOf(given.mesh())));
  } else if (given.kind() == Kind::Points) {
    add(text, "points", digestOf(bytesOf(given.cloud())));
  } else if (given.kind() == Kind::Field) {
    add(text, "field", fmt::format("{:016x}", given.field().contentHash()));
  } else if (given.kind() == Kind::Band) {
    add(text, "band", fmt::format("{:016x}", given.band().contentHash()));
  } else {
    return {};
  }
  return digestOf(text);
}

std::vector<std::optional<std::string>> CacheKeys::of(const Graph& graph,
                                                      const std::vector<char>& needed) const {
  std::vector<std::optional<std::string>> keys(graph.nodes.size());
  const auto writers = findWritersRead(graph, needed);
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (!needed[i] || writers[i]) continue;
    const auto given = graph.given.find(i);
    keys[i] =
        given == graph.given.end() ? keyOf(graph, graph.nodes[i], keys) : keyOf(given->second);
  }
  return keys;
}

}  // namespace pipeline
