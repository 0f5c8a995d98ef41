#pragma once

// Runs chains with --tolerance without files, and measures the errors of the results.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/grammar/chain.h"
#include "apps/pipeline/tolerance/tolerance.h"
#include "levelset/error.h"
#include "levelset/inspect/surface_difference.h"
#include "levelset/mesh_files/mesh_file.h"
#include "tests/support/files.h"

namespace support {

struct ToleranceRun {
  levelset::TriMesh mesh;  ///< mesh that the run writes
  pipeline::RunReport report;
  std::string refusal;  ///< message of the final error
  int exitCode = 0;
  [[nodiscard]] const pipeline::ToleranceReport& told() const { return *report.tolerance; }
  [[nodiscard]] const pipeline::ToleranceOutput& output() const { return told().outputs.at(0); }
};

inline std::vector<std::string> wordsOf(const std::string& text) {
  std::vector<std::string> words;
  std::string word;
  for (const char c : text + " ") {
    if (c != ' ')
      word += c;
    else if (!word.empty())
      words.push_back(std::exchange(word, ""));
  }
  return words;
}

/// Runs the words of a command line, none with blanks. Drops all messages.
inline pipeline::RunReport runWords(const std::string& line, pipeline::RunSettings settings = {}) {
  settings.warn = settings.note = settings.print = [](const std::string&) {};
  const pipeline::Graph graph = pipeline::parseChain(wordsOf(line));
  pipeline::RunReport report;
  if (graph.globals.contains("tolerance"))
    pipeline::runToTolerance(graph, settings, report);
  else
    pipeline::run(graph, settings, report);
  return report;
}

/// Runs `--tolerance TOLERANCE CHAIN ! write FILE`, the chain ending with a mesh.
inline ToleranceRun runToTolerance(const std::string& tolerance, const std::string& chain,
                                   pipeline::RunSettings settings = {}) {
  const TemporaryFolder folder;
  const std::string file = (folder / "result.ply").string();
  settings.warn = settings.note = settings.print = [](const std::string&) {};
  const pipeline::Graph graph =
      pipeline::parseChain(wordsOf("--tolerance " + tolerance + " " + chain + " ! write " + file));
  ToleranceRun run;
  try {
    pipeline::runToTolerance(graph, settings, run.report);
  } catch (const levelset::Error& error) {
    run.refusal = error.what();
    run.exitCode = static_cast<int>(error.exitCode());
  }
  if (std::filesystem::exists(file)) run.mesh = levelset::readMesh(file);
  return run;
}

/// Mesh at the end of a chain without --tolerance.
inline levelset::TriMesh meshOf(const std::string& chain) {
  const TemporaryFolder folder;
  const std::string file = (folder / "result.ply").string();
  (void)runWords(chain + " ! write " + file);
  return levelset::readMesh(file);
}

/// Difference of two meshes, with cells of half a voxel.
inline double differenceOf(const levelset::TriMesh& a, const levelset::TriMesh& b, double voxel) {
  return levelset::surfaceDifference(levelset::TriangleSurface(a), levelset::TriangleSurface(b),
                                     {.spacing = voxel / 2})
      .smooth;
}

}  // namespace support
