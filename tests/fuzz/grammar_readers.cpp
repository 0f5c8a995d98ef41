#include <algorithm>
#include <string>

#include "apps/pipeline/grammar/chain.h"
#include "apps/pipeline/grammar/script.h"
#include "apps/pipeline/graph/graph_file.h"
#include "levelset/fields/expression.h"
#include "render/scene/csg_expression.h"
#include "tests/fuzz/readers.h"

namespace fuzz {
namespace {

/// Requires that a graph, written and read back, is unchanged.
void requireWritable(const pipeline::Graph& graph) {
  constexpr std::size_t kMostNodes = 100;  // loops create many nodes of one kind
  if (graph.nodes.size() > kMostNodes) return;
  const std::string text = pipeline::graphJson(graph);
  std::string again;
  const bool isRead =
      accepts([&] { again = pipeline::graphJson(pipeline::graphFromJson(text, "written.json")); });
  require(isRead, "a graph that was written can be read");
  require(again == text, "a graph that is read again is the same");
}

void readGraph(std::string_view bytes) {
  accepts([&] { requireWritable(pipeline::graphFromJson(std::string(bytes), "graph.json")); });
}

/// Parses text into a graph, with variables and loops. Runs nothing.
void readScript(std::string_view bytes) {
  const std::filesystem::path file = scratchFile("chain.pipeline", bytes);
  constexpr std::size_t kMostLines =
      1000;  // 100000 are checked in a second, or in ten under sanitizers
  std::size_t lines = 0;
  accepts([&] { lines = pipeline::readScript(file).begins.size(); });
  if (lines <= kMostLines)
    accepts([&] { requireWritable(pipeline::parseChain({"run", file.string()})); });
}

/// Parses a chain with one word on each line.
void readChain(std::string_view bytes) {
  std::vector<std::string> words(1);
  for (const char c : bytes) {
    if (c == '\n')
      words.emplace_back();
    else if (c != '\0')  // a command line cannot contain it in a word
      words.back() += c;
  }
  if (words[0] == "run") return;  // it would read any file that it names
  accepts([&] { requireWritable(pipeline::parseChain(words)); });
}

void readFormula(std::string_view bytes) {
  const std::string text(bytes);
  const Imath::V3d place(0.25, -1, 3);
  accepts([&] { static_cast<void>(levelset::scalarExpression(text)(place)); });
  accepts([&] { static_cast<void>(levelset::vectorExpression(text)(place, 0.5)); });
  accepts([&] { static_cast<void>(levelset::timeExpression(text)(0.5)); });
  accepts([&] {
    const render::CsgExpression solid(text, {"a", "b", "c"});
    const double phi[3] = {-1, 0.5, 2};
    const char inside[3] = {1, 0, 0};
    require(solid.holds(inside) == (solid.phi(phi) < 0), "an expression has one inside");
  });
}

}  // namespace

std::vector<Reader> grammarReaders() {
  return {
      {"graph", readGraph}, {"script", readScript}, {"chain", readChain}, {"formula", readFormula}};
}

}  // namespace fuzz
