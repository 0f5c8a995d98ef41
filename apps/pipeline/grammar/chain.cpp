#include "apps/pipeline/grammar/chain.h"

#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "apps/pipeline/grammar/script.h"
#include "apps/pipeline/graph/graph_file.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/units.h"
#include "levelset/error.h"
#include "levelset/file_target.h"

namespace pipeline {
namespace {

using levelset::UsageError;

/// Recognizes an option `--name`, as opposed to a negative number, a bare `-` or an operand.
bool isOption(const std::string& token) {
  return token.size() > 1 && token[0] == '-' &&
         !(token[1] == '.' || (token[1] >= '0' && token[1] <= '9'));
}

std::vector<std::string> namesOf(const std::vector<Param>& params) {
  std::vector<std::string> names;
  names.reserve(params.size());
  for (const Param& param : params) names.push_back(param.name);
  return names;
}

bool findIn(const std::vector<Param>& params, const std::string& name) {
  return std::any_of(params.begin(), params.end(), [&](const Param& p) { return p.name == name; });
}

/// Finds a parameter by its full name, its former name or a unique prefix of its name.
const Param& matchParam(const std::vector<Param>& params, const std::string& name,
                        const std::string& who) {
  if (const Param* param = findParam(params, name)) return *param;
  std::vector<const Param*> begun;
  for (const Param& param : params) {
    if (!name.empty() && param.name.starts_with(name)) begun.push_back(&param);
  }
  if (begun.size() == 1) return *begun[0];
  std::string hint;
  if (begun.size() > 1) {
    hint = fmt::format("; it may mean --{} or --{}", begun[0]->name, begun[1]->name);
  } else if (const std::string guess = didYouMean(name, namesOf(params)); !guess.empty()) {
    hint = fmt::format("; did you mean --{}?", guess);
  } else if (who != "levelsmith" && findIn(globalParams(), name)) {
    hint = fmt::format("; --{} belongs before the first action", name);
  } else if (who != "levelsmith") {
    hint = fmt::format("; `levelsmith help {}` lists its options", who);
  } else {
    hint = "; `levelsmith help` lists the options";
  }
  throw UsageError(fmt::format("{}: there is no option --{}{}", who, name, hint));
}

struct Reader {
  const std::vector<std::string>& tokens;
  const Script* script = nullptr;  // script that contains the tokens; null: command line
  bool isStandardInput = false;    // the script came from standard input
  std::size_t next = 0;
  Graph graph = {};  // graph built so far

  [[nodiscard]] bool atEnd() const { return next >= tokens.size(); }
  [[nodiscard]] bool atBang() const { return !atEnd() && tokens[next] == "!"; }

  /// Reads `--name value`, `--name=value` or a flag into `options`.
  void readOption(const std::vector<Param>& params, const std::string& who,
                  std::map<std::string, std::string>& options) {
    std::string token = tokens[next++];
    if (token == "-v") token = "--verbose";
    if (token == "-q") token = "--quiet";
    if (!token.starts_with("--")) {
      throw UsageError(
          fmt::format("{}: '{}' is not an option; an option begins with two dashes", who, token));
    }
    const std::size_t equals = token.find('=');
    const std::string name = token.substr(2, equals == std::string::npos ? equals : equals - 2);
    const Param& param = matchParam(params, name, who);
    if (param.formerName == name) graph.addRenamed("--" + name, "--" + param.name);
    const std::string where = who + ": --" + param.name;
    if (options.contains(param.name)) throw UsageError(where + " is given twice; leave one out");
    if (param.type == ParamType::Flag) {
      if (equals != std::string::npos) throw UsageError(where + " is a flag and takes no value");
      options[param.name] = "true";
      return;
    }
    std::string value;
    if (equals != std::string::npos) {
      value = token.substr(equals + 1);
    } else {
      if (atEnd() || atBang() || tokens[next].starts_with("--")) {
        throw UsageError(
            fmt::format("{} needs a value; write --{} {}", where, param.name, valueForm(param)));
      }
      value = tokens[next++];
    }
    checkText(param, value, where);
    options[param.name] = value;
  }
};

const Operator& matchOperator(const std::string& name) {
  if (const Operator* op = findOperator(name)) return *op;
  std::vector<std::string> names{"help", "run"};
  for (const Operator& op : operators()) names.push_back(op.name);
  if (name == "help") {
    throw UsageError(
        "levelsmith: help must be the only action: `levelsmith help` or `levelsmith help ACTION`");
  }
  if (name == runOperator().name)
    throw UsageError(
        "run: must be the only action; only global options may precede it: `levelsmith run FILE`");
  const std::string guess = didYouMean(name, names);
  throw UsageError(fmt::format("levelsmith: there is no action '{}'{}", name,
                               guess.empty() ? "; `levelsmith help` lists them"
                                             : fmt::format("; did you mean '{}'?", guess)));
}

std::string operandName(const std::string& token, const std::string& who) {
  if (token.size() < 2) throw UsageError(fmt::format("{}: a name must follow '@'", who));
  return token.substr(1);
}

/// An action and its arguments, as the user wrote them.
struct Action {
  const Operator* op = nullptr;
  // Values by full option name; a flag has the value "true".
  std::map<std::string, std::string> options;
  std::vector<std::string> operandNames;  // operands `@NAME`, without the @
  std::string resultName;                 // name that --as gives; empty: none
  std::string location;  // line of the script, for messages; empty: not from a script
};

Action readAction(Reader& reader) {
  Action action;
  const std::string& word = reader.tokens[reader.next++];
  action.op = &matchOperator(word);
  reader.graph.addRenamed(word, action.op->name);
  const Operator& op = *action.op;
  std::vector<Param> params = op.params;
  if (op.flow == Flow::Makes)
    params.push_back({.name = "as", .type = ParamType::Text, .doc = "name the result"});
  std::vector<std::string> positional;
  while (!reader.atEnd() && !reader.atBang()) {
    const std::string& token = reader.tokens[reader.next];
    if (token.starts_with('@')) {
      action.operandNames.push_back(operandName(token, op.name));
      ++reader.next;
    } else if (isOption(token)) {
      reader.readOption(params, op.name, action.options);
    } else {
      positional.push_back(token);
      ++reader.next;
    }
  }
  for (std::size_t i = 0; i < positional.size(); ++i) {
    const auto param = std::find_if(op.params.begin(), op.params.end(), [&](const Param& p) {
      return p.position == static_cast<int>(i);
    });
    if (param == op.params.end()) {
      throw UsageError(fmt::format(
          "{}: unexpected argument '{}'; separate actions with a lone '!', name operands "
          "with '@'",
          op.name, positional[i]));
    }
    const std::string where = op.name + ": " + param->name;
    if (action.options.contains(param->name))
      throw UsageError(where + " is given twice; leave one out");
    checkText(*param, positional[i], where);
    action.options[param->name] = positional[i];
  }
  for (const Param& param : op.params) {
    if (param.required && !action.options.contains(param.name)) {
      throw UsageError(fmt::format("{}: needs {}{} {}", op.name, param.position >= 0 ? "" : "--",
                                   param.name, valueForm(param)));
    }
  }
  if (const auto it = action.options.find("as"); it != action.options.end()) {
    action.resultName = it->second.starts_with('@') ? it->second.substr(1) : it->second;
    action.options.erase(it);
  }
  return action;
}

/// Builds the nodes of a chain. Each result is pushed on a stack, from which actions take their
/// operands. A named result can also be taken by its name, any number of times.
class ChainBuilder {
 public:
  /// @param voxelsFollow  --tolerance chooses the voxel sizes that are not given
  ChainBuilder(std::vector<Node>& nodes, bool voxelsFollow)
      : nodes_(nodes), voxelsFollow_(voxelsFollow) {}

  void add(const Action& action) {
    Node node;
    node.op = action.op;
    node.options = action.options;
    node.name = action.resultName;
    node.location = action.location;
    node.inputs = takeOperands(action);
    for (const auto& [option, text] : action.options)
      if (const Param* param = action.op->find(option); param && namesValue(*param, text))
        node.named.emplace(option, nodeOf(text.substr(1), *action.op));
    if (voxelsFollow_) leaveVoxelOpen(node, nodes_);
    node.kind = checkNode(node, nodes_);
    if (node.makes()) {
      stack_.push_back(nodes_.size());
      if (!node.name.empty() && !names_.emplace(node.name, nodes_.size()).second) {
        throw UsageError(
            fmt::format("{}: the name '{}' is taken; choose another", node.op->name, node.name));
      }
    }
    nodes_.push_back(std::move(node));
  }

 private:
  [[nodiscard]] std::size_t nodeOf(const std::string& name, const Operator& op) const {
    const auto it = names_.find(name);
    if (it != names_.end()) return it->second;
    std::vector<std::string> known;
    for (const auto& entry : names_) known.push_back(entry.first);
    const std::string guess = didYouMean(name, known);
    throw UsageError(fmt::format("{}: no result is named '@{}'{}", op.name, name,
                                 guess.empty() ? "; give an earlier result that name with --as"
                                               : fmt::format("; did you mean '@{}'?", guess)));
  }

  /// Collects the operands of an action. Operands given as @NAME are the last ones; those before
  /// them are taken off the stack. An action that passes its operand through leaves it on the
  /// stack.
  std::vector<std::size_t> takeOperands(const Action& action) {
    std::vector<std::size_t> named;
    for (const std::string& name : action.operandNames) named.push_back(nodeOf(name, *action.op));
    const std::size_t wanted = action.op->operandCount(action.options);
    if (named.size() >= wanted) return named;
    const std::size_t missing = wanted - named.size();
    if (stack_.size() < missing && action.op->operandsOptional) return named;
    const std::size_t taken = named.empty() && action.op->takesStack
                                  ? std::max(std::min(missing, stack_.size()), bandsOnTop())
                                  : std::min(missing, stack_.size());
    std::vector<std::size_t> operands(stack_.end() - static_cast<std::ptrdiff_t>(taken),
                                      stack_.end());
    if (action.op->flow == Flow::Makes) stack_.resize(stack_.size() - taken);
    operands.insert(operands.end(), named.begin(), named.end());
    return operands;
  }

  /// Number of level sets on top of the stack.
  [[nodiscard]] std::size_t bandsOnTop() const {
    const auto end = std::find_if(stack_.rbegin(), stack_.rend(), [&](std::size_t node) {
      return nodes_[node].kind != Kind::Band;
    });
    return static_cast<std::size_t>(end - stack_.rbegin());
  }

  std::vector<Node>& nodes_;
  bool voxelsFollow_;
  std::vector<std::size_t> stack_;
  std::map<std::string, std::size_t> names_;
};

using StreamUse = std::function<bool(const Invocation&)> Operator::*;

/// Checks that at most one action uses a standard stream for data.
void checkStandardStream(const Graph& graph, StreamUse use, const char* stream,
                         std::string firstUser) {
  for (const Node& node : graph.nodes) {
    const auto& claims = node.op->*use;
    if (!claims || !claims(Invocation(*node.op, node.options))) continue;
    if (!firstUser.empty()) {
      throw UsageError(
          fmt::format("{}: standard {} is already used by {}; use a file for one of them",
                      node.op->name, stream, firstUser));
    }
    firstUser = "'" + node.op->name + "'";
  }
}

void checkStandardStreams(const Graph& graph, bool isScriptFromInput) {
  const auto report = graph.globals.find("report");
  const bool reportsThere =
      report != graph.globals.end() && levelset::isStandardOutput(report->second);
  checkStandardStream(graph, &Operator::usesStandardOutput, "output",
                      reportsThere ? "--report" : "");
  checkStandardStream(graph, &Operator::usesStandardInput, "input",
                      isScriptFromInput ? "'run'" : "");
}

}  // namespace

namespace {

/// Parses global options and actions.
/// @param mayRun  `run FILE` is allowed
/// @param outer   global options before `run`; they override those of the script
Graph parse(Reader& reader, bool mayRun, const std::map<std::string, std::string>& outer);

/// Arguments of `run`.
struct ScriptCall {
  std::string file;
  std::map<std::string, std::string> settings;
};

ScriptCall readCall(Reader& reader) {
  ScriptCall call;
  for (++reader.next; !reader.atEnd();) {
    const std::string& token = reader.tokens[reader.next];
    if (isOption(token)) {
      std::map<std::string, std::string> option;
      reader.readOption(runOperator().params, "run", option);
      const std::string text = option.at("set");
      const std::size_t equals = std::min(text.find('='), text.size());
      if (equals == 0 || equals == text.size())
        throw UsageError(fmt::format("run: --set: '{}' is not of the form NAME=VALUE", text));
      if (!call.settings.emplace(text.substr(0, equals), text.substr(equals + 1)).second)
        throw UsageError(fmt::format("run: --set: '{}' is given twice", text.substr(0, equals)));
    } else if (call.file.empty() && token != "!") {
      call.file = token;
      ++reader.next;
    } else {
      throw UsageError(
          "run: only --set NAME=VALUE may follow the file; write further actions into the file");
    }
  }
  if (call.file.empty())
    throw UsageError("run: takes one file: `levelsmith run FILE`, or - for standard input");
  return call;
}

Graph parseLines(const Script& script, const std::map<std::string, std::string>& outer) {
  Reader reader{script.words, &script};
  try {
    return parse(reader, false, outer);
  } catch (const UsageError& error) {
    // The error is in the line of the last word that was read, the word before `reader.next`.
    const std::size_t word = std::min(reader.next, script.words.size());
    throw UsageError(
        fmt::format("{} ({})", error.what(), script.location(word > 0 ? word - 1 : 0)));
  }
}

/// Parses `run FILE` into the graph of the file. Global options of the command line override those
/// of the file.
Graph parseFile(Reader& reader, const Graph& before) {
  const ScriptCall call = readCall(reader);
  if (isGraphFile(call.file)) {
    if (!call.settings.empty())
      throw UsageError(
          fmt::format("run: --set has no effect on '{}': a graph has no variables; leave out --set",
                      call.file));
    Graph graph = readGraph(call.file, before.globals);
    graph.renamed.insert(graph.renamed.begin(), before.renamed.begin(), before.renamed.end());
    return graph;
  }
  Graph graph = parseLines(readScript(call.file, call.settings), before.globals);
  graph.renamed.insert(graph.renamed.begin(), before.renamed.begin(), before.renamed.end());
  reader.isStandardInput = call.file == "-";
  return graph;
}

Graph parse(Reader& reader, bool mayRun, const std::map<std::string, std::string>& outer) {
  const std::vector<std::string>& tokens = reader.tokens;
  Graph& graph = reader.graph;
  while (!reader.atEnd() && isOption(tokens[reader.next]))
    reader.readOption(globalParams(), "levelsmith", graph.globals);
  if (!reader.atEnd() && tokens[reader.next] == runOperator().name) {
    if (mayRun) return parseFile(reader, graph);
    throw UsageError("run: a script cannot run another one; copy its actions into this script");
  }
  for (const auto& [name, value] : outer) graph.globals[name] = value;
  ChainBuilder builder(graph.nodes, graph.globals.contains("tolerance"));
  while (!reader.atEnd()) {
    if (reader.atBang()) {
      throw UsageError(fmt::format(
          "levelsmith: there is no action {} the '!' at word {}; write one there, or leave out the "
          "'!'",
          reader.next == 0 || graph.nodes.empty() ? "before" : "between an earlier '!' and",
          reader.next + 1));
    }
    const std::size_t first = reader.next;
    Action action = readAction(reader);
    if (reader.script) action.location = reader.script->location(first);
    builder.add(action);
    if (reader.atBang()) {
      ++reader.next;
      if (reader.atEnd()) throw UsageError("levelsmith: an action must follow the last '!'");
    }
  }
  if (graph.nodes.empty())
    throw UsageError("levelsmith: nothing to do; `levelsmith help` shows how to begin");
  return std::move(graph);
}

}  // namespace

std::optional<std::string> helpRequest(const std::vector<std::string>& tokens) {
  std::string action;
  bool isAtAction = true;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const std::string& token = tokens[i];
    if (token == "--help" || token == "-h") return action;
    if (token == "!") {
      isAtAction = true;
      action.clear();
    } else if (isAtAction && isOption(token)) {  // a global option; its value is skipped
      const Param* param =
          token.starts_with("--") ? findParam(globalParams(), token.substr(2)) : nullptr;
      if (param && param->type != ParamType::Flag) ++i;
    } else if (isAtAction) {
      action = token;
      isAtAction = false;
    }
  }
  return std::nullopt;
}

Graph parseChain(const std::vector<std::string>& tokens) {
  Reader reader{tokens};
  Graph graph = parse(reader, true, {});
  checkStandardStreams(graph, reader.isStandardInput);
  return graph;
}

Graph parseScript(const Script& script) {
  Graph graph = parseLines(script, {});
  checkStandardStreams(graph, false);
  return graph;
}

}  // namespace pipeline
