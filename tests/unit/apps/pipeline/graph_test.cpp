// Graphs: equal from a chain and from a file, evaluated only where needed, and invalid files are
// refused.

#include "apps/pipeline/graph/graph.h"

#include <gtest/gtest.h>

#include <cctype>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "apps/pipeline/grammar/chain.h"
#include "apps/pipeline/graph/graph_file.h"
#include "apps/pipeline/run/runner.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/command_line.h"
#include "tests/support/measured.h"

namespace graph_test {

using pipeline::Graph;
using pipeline::graphFromJson;
using pipeline::graphJson;
using pipeline::parseChain;
using support::ShellTest;
using Json = nlohmann::ordered_json;

const std::vector<std::string> kFork = {
    "sphere", "--radius", "1",  "--voxel", "0.1",    "--as",  "a",       "!",
    "sphere", "--radius", "2",  "--voxel", "0.1",    "--as",  "unused",  "!",
    "offset", "0.2",      "!",  "box",     "--size", "1,1,1", "--voxel", "0.1",
    "!",      "union",    "@a", "!",       "write",  "o.vdb"};

TEST(Graph, RecordsOperandsFromTheStackAndByName) {
  const Graph graph = parseChain(kFork);
  ASSERT_EQ(graph.nodes.size(), 6u);
  EXPECT_EQ(graph.nodes[2].inputs, (std::vector<std::size_t>{1}));
  EXPECT_EQ(graph.nodes[4].inputs, (std::vector<std::size_t>{3, 0}));
  EXPECT_EQ(graph.nodes[5].inputs, (std::vector<std::size_t>{4}));
  EXPECT_EQ(neededNodes(graph), (std::vector<char>{1, 0, 0, 1, 1, 1}));
  EXPECT_EQ(countUses(graph, neededNodes(graph)), (std::vector<std::size_t>{1, 0, 0, 1, 1, 0}));
}

TEST(Graph, NeedsTheEntireChainThatEndsInAValue) {
  const Graph graph = parseChain({"sphere", "--radius", "1", "--voxel", "0.1", "!", "offset", "1"});
  EXPECT_EQ(neededNodes(graph), (std::vector<char>{1, 1}));
}

TEST(Graph, NeedsResultsAndActionsWithSideEffects) {
  Graph graph = parseChain(kFork);
  graph.results = {1};
  EXPECT_EQ(neededNodes(graph), (std::vector<char>{1, 1, 0, 1, 1, 1}));
  graph = parseChain({"sphere", "--radius", "1", "--voxel", "0.1", "!", "offset", "1"});
  graph.results = {0};
  EXPECT_EQ(neededNodes(graph), (std::vector<char>{1, 0}));
}

TEST(Graph, TakesGivenValuesAndReturnsResults) {
  Graph graph =
      parseChain({"sphere", "--radius", "9", "--voxel", "0.1", "!", "offset", "0.5", "!", "mesh"});
  graph.nodes[0].op = &pipeline::givenOperator();
  graph.given.emplace(0, pipeline::Value(levelset::makeSphere(1, {0, 0, 0}, 0.1)));
  graph.results = {1};
  std::map<std::size_t, pipeline::Value> made;
  std::vector<std::string> told;
  pipeline::RunSettings settings;
  settings.onValue = [&](std::size_t node, const pipeline::Value& value) {
    made.emplace(node, value);
  };
  settings.warn = settings.note = [&](const std::string& text) { told.push_back(text); };
  pipeline::RunReport report;
  run(graph, settings, report);
  ASSERT_EQ(report.steps.size(), 1u);
  ASSERT_EQ(made.size(), 1u);
  EXPECT_NEAR(made.at(1).plan().bounds.max.x, 1.5, support::rounding(1.5));
}

TEST(Graph, CancelsAnAction) {
  const Graph graph = parseChain({"sphere", "--radius", "1", "--voxel", "0.02"});
  pipeline::RunSettings settings;
  settings.shouldContinue = [] { return false; };
  pipeline::RunReport report;
  EXPECT_THROW(run(graph, settings, report), levelset::Cancelled);
  EXPECT_EQ(report.exitCode, 130);
}

TEST(Graph, IsUnchangedThroughJson) {
  const Graph graph = parseChain(kFork);
  const std::string text = graphJson(graph);
  const Graph again = graphFromJson(text, "g.json");
  EXPECT_EQ(graphJson(again), text);
  ASSERT_EQ(again.nodes.size(), graph.nodes.size());
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    EXPECT_EQ(again.nodes[i].op, graph.nodes[i].op);
    EXPECT_EQ(again.nodes[i].options, graph.nodes[i].options);
    EXPECT_EQ(again.nodes[i].inputs, graph.nodes[i].inputs);
    EXPECT_EQ(again.nodes[i].name, graph.nodes[i].name);
    EXPECT_EQ(again.nodes[i].kind, graph.nodes[i].kind);
  }
}

TEST(Graph, KeepsValuesNamedByOptions) {
  const Graph graph =
      parseChain({"sphere", "--radius", "1", "--voxel", "0.1", "--as", "s", "!", "box", "--size",
                  "1,1,1", "--voxel", "0.1", "!", "smooth", "--sigma", "1vx", "--mask", "@s"});
  ASSERT_EQ(graph.nodes[2].named.at("mask"), 0u);
  const Graph again = graphFromJson(graphJson(graph), "g.json");
  EXPECT_EQ(again.nodes[2].named.at("mask"), 0u);
  EXPECT_EQ(again.nodes[2].options, graph.nodes[2].options);
}

/// @return exit code for a text, or 0
int refusalOf(const std::string& text) {
  try {
    (void)graphFromJson(text, "g.json");
  } catch (const levelset::Error& error) {
    EXPECT_NE(std::string(error.what()).find("g.json"), std::string::npos) << error.what();
    return static_cast<int>(error.exitCode());
  }
  return 0;
}

std::string withNodes(const std::string& nodes) {
  return R"({"format": "levelsmith graph", "version": 1, "nodes": [)" + nodes + "]}";
}

TEST(Graph, TakesNumbersAndFlags) {
  const Graph graph =
      graphFromJson(withNodes(R"({"op": "sphere", "options": {"radius": 1.5, "voxel": "0.1"}},
                   {"op": "measure", "options": {"json": true}, "inputs": [0]})"),
                    "g.json");
  EXPECT_EQ(graph.nodes[0].options.at("radius"), "1.5");
  EXPECT_EQ(graph.nodes[1].options.at("json"), "true");
}

TEST(Graph, RefusesInvalidGraphs) {
  const std::string sphere = R"({"op": "sphere", "options": {"radius": "1", "voxel": "0.1"}})";
  EXPECT_EQ(refusalOf(withNodes(sphere)), 0);
  for (const char* text : {"", "{", "[]", "null", "7", "{}", R"({"format": "levelsmith scene"})"})
    EXPECT_EQ(refusalOf(text), 3) << text;
  EXPECT_EQ(refusalOf(R"({"format": "levelsmith graph", "version": 2, "nodes": []})"), 3);
  for (const char* nodes :
       {"", "3", R"({"op": 3})", R"({"operator": "sphere"})", R"({"op": "sphere", "options": []})",
        R"({"op": "sphere", "options": {"radius": []}})", R"({"op": "mesh", "inputs": 0})",
        R"({"op": "mesh", "inputs": [0]})", R"({"op": "mesh", "inputs": [-1]})",
        R"({"op": "mesh", "inputs": [1e30]})"})
    EXPECT_EQ(refusalOf(withNodes(nodes)), 3) << nodes;
  for (const std::string& nodes :
       {std::string(R"({"op": "spere"})"), std::string(R"({"op": "sphere"})"),
        std::string(R"({"op": "sphere", "options": {"radius": "-1", "voxel": "0.1"}})"),
        std::string(R"({"op": "sphere", "options": {"weight": "1"}})"),
        std::string(R"({"op": "mesh"})"), sphere + R"(, {"op": "level-set", "inputs": [0]})",
        sphere + R"(, {"op": "mesh", "inputs": [0, 0]})",
        sphere + R"(, {"op": "smooth", "inputs": [0], "named": {"nobody": 0}})",
        sphere + R"(, {"op": "smooth", "inputs": [0], "options": {"mask": "@a"}})",
        sphere + R"(, {"op": "measure", "inputs": [0], "as": "m"})"})
    EXPECT_EQ(refusalOf(withNodes(nodes)), 2) << nodes;
  EXPECT_EQ(refusalOf(withNodes(sphere + R"(, {"op": "measure", "inputs": [0]},
                                          {"op": "mesh", "inputs": [1]})")),
            3);
}

TEST(Graph, SurvivesArbitraryFiles) {
  const std::string whole = graphJson(parseChain(kFork));
  std::mt19937 random(7);
  int taken = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string text = whole;
    if (i % 2 == 0) {  // a digit replaces a digit, so that a readable text remains
      std::size_t place = random() % text.size();
      while (!std::isdigit(static_cast<unsigned char>(text[place]))) place = random() % text.size();
      text[place] = static_cast<char>('0' + random() % 10);
    } else {
      for (int n = 0; n < 3; ++n) text[random() % text.size()] = static_cast<char>(random() & 127);
    }
    if (i % 4 == 1) text.resize(random() % text.size());
    try {
      const std::string written = graphJson(graphFromJson(text, "g.json"));
      EXPECT_EQ(graphJson(graphFromJson(written, "g.json")), written) << text;
      ++taken;
    } catch (const levelset::Error& error) {  // an error message is the only accepted exception
      EXPECT_NE(std::string(error.what()).find("g.json"), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(taken, 10);
  EXPECT_LT(taken, 1500);
}

class GraphRun : public ShellTest {};

TEST_F(GraphRun, RunsAFileLikeTheChain) {
  const std::string chain =
      "sphere --radius 1 --voxel 0.1 --as a ! box --size 1,1,3 --voxel 0.1 ! difference @a ! ";
  const auto direct = levelsmith("--save-graph g.json " + chain + "write a.vdb ! measure --json");
  ASSERT_EQ(direct.code, 0) << direct.err;
  const auto saved = levelsmith("run g.json");
  ASSERT_EQ(saved.code, 0) << saved.err;
  EXPECT_EQ(saved.out, direct.out);
  const auto dry = levelsmith("--dry-run --save-graph d.json " + chain + "write d.vdb");
  EXPECT_EQ(dry.code, 0) << dry.err;
  EXPECT_TRUE(exists("d.json"));
  EXPECT_FALSE(exists("d.vdb"));
  EXPECT_EQ(levelsmith("run missing.json").code, 6);
  EXPECT_EQ(levelsmith("--save-graph a.txt " + chain + "write a.vdb").code, 2);
  EXPECT_EQ(levelsmith("--save-graph g.json --report g.json " + chain + "write a.vdb").code, 2);
}

TEST_F(GraphRun, RunsNeededNodesOnly) {
  std::string chain = "--report r.json ";
  for (int i = 0; i < 9; ++i)
    chain += "sphere --radius 1 --voxel 0.1 --as s" + std::to_string(i) + " ! offset 0.1 ! ";
  chain += "sphere --radius 1 --voxel 0.1 ! offset 0.1 ! write o.vdb";
  const auto outcome = levelsmith(chain);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json report = Json::parse(support::slurp(folder_ / "r.json"));
  EXPECT_EQ(report["steps"].size(), 3u);
  EXPECT_EQ(report["left_out"].size(), 18u);
  EXPECT_EQ(report["graph"]["nodes"].size(), 21u);
  EXPECT_NE(outcome.err.find("is not used; write it, or leave out its action"), std::string::npos);
}

}  // namespace graph_test
