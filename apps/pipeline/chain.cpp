#include "apps/pipeline/chain.h"

#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "apps/pipeline/invocation.h"
#include "apps/pipeline/script.h"
#include "apps/pipeline/units.h"
#include "levelset/error.h"
#include "levelset/file_target.h"

namespace pipeline {
namespace {

using levelset::UsageError;

/// `--name`, but not a negative number, a bare `-` or an operand.
bool isOption(const std::string& token) {
  return token.size() > 1 && token[0] == '-' &&
         !(token[1] == '.' || (token[1] >= '0' && token[1] <= '9'));
}

std::vector<std::string> namesOf(const std::vector<Param>& params) {
  std::vector<std::string> names;
  for (const Param& param : params) names.push_back(param.name);
  return names;
}

bool findIn(const std::vector<Param>& params, const std::string& name) {
  return std::any_of(params.begin(), params.end(), [&](const Param& p) { return p.name == name; });
}

/// By full name, or by a beginning that only one parameter has.
const Param& matchParam(const std::vector<Param>& params, const std::string& name,
                        const std::string& who) {
  std::vector<const Param*> begun;
  for (const Param& param : params) {
    if (param.name == name) return param;
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
  const Script* script = nullptr;  // that the tokens are from
  std::size_t next = 0;

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
          fmt::format("{}: '{}' is not an option; options begin with two dashes", who, token));
    }
    const std::size_t equals = token.find('=');
    const Param& param =
        matchParam(params, token.substr(2, equals == std::string::npos ? equals : equals - 2), who);
    const std::string where = who + ": --" + param.name;
    if (options.contains(param.name)) throw UsageError(where + ": is given twice");
    if (param.type == ParamType::Flag) {
      if (equals != std::string::npos) throw UsageError(where + ": is a flag and takes no value");
      options[param.name] = "true";
      return;
    }
    std::string value;
    if (equals != std::string::npos) {
      value = token.substr(equals + 1);
    } else {
      if (atEnd() || atBang() || tokens[next].starts_with("--")) {
        throw UsageError(
            fmt::format("{}: needs a value: --{} {}", where, param.name, valueForm(param)));
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
        "levelsmith: help stands alone: `levelsmith help` or `levelsmith help ACTION`");
  }
  if (name == runOperator().name)
    throw UsageError("run: stands alone, behind global options only: `levelsmith run FILE`");
  const std::string guess = didYouMean(name, names);
  throw UsageError(fmt::format("levelsmith: there is no action '{}'{}", name,
                               guess.empty() ? "; `levelsmith help` lists them"
                                             : fmt::format("; did you mean '{}'?", guess)));
}

std::string operandName(const std::string& token, const std::string& who) {
  if (token.size() < 2) throw UsageError(fmt::format("{}: '@' needs a name behind it", who));
  return token.substr(1);
}

Action readAction(Reader& reader) {
  Action action;
  action.op = &matchOperator(reader.tokens[reader.next++]);
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
      throw UsageError(
          fmt::format("{}: what is '{}' for? separate actions with a lone '!', name operands "
                      "with '@'",
                      op.name, positional[i]));
    }
    const std::string where = op.name + ": " + param->name;
    if (action.options.contains(param->name)) throw UsageError(where + ": is given twice");
    checkText(*param, positional[i], where);
    action.options[param->name] = positional[i];
  }
  for (const Param& param : op.params) {
    if (param.required && !action.options.contains(param.name)) {
      throw UsageError(fmt::format("{}: needs {}{} {}", op.name, param.position >= 0 ? "" : "--",
                                   param.name, valueForm(param)));
    }
  }
  for (const auto& [name, text] : action.options)
    if (const Param* param = op.find(name); param && namesValue(*param, text))
      action.named.emplace(name, text.substr(1));
  if (const auto it = action.options.find("as"); it != action.options.end()) {
    action.resultName = it->second.starts_with('@') ? it->second.substr(1) : it->second;
    action.options.erase(it);
  }
  return action;
}

/// Follows the kinds of values through the chain, as the run will follow the values.
class KindChecker {
 public:
  void visit(const Action& action) {
    const Operator& op = *action.op;
    const std::vector<Kind> operands = takeOperands(action);
    for (std::size_t i = 0; i < operands.size(); ++i) {
      const std::vector<Kind>& allowed = op.operands[std::min(i, op.operands.size() - 1)];
      if (std::find(allowed.begin(), allowed.end(), operands[i]) == allowed.end())
        throw UsageError(mismatch(op, i, operands[i], allowed));
    }
    for (const auto& [option, name] : action.named) {
      const Kind kind = kindOf(name, op);
      const bool isScalar = op.find(option)->type == ParamType::Scalar;
      if (kind == Kind::Field || (isScalar && kind == Kind::Band)) continue;
      throw UsageError(fmt::format("{}: --{}: '@{}' is a {}, a {} is needed", op.name, option, name,
                                   kindName(kind), isScalar ? "field or a level set" : "field"));
    }
    if (op.validate) op.validate(probe(action, operands));
    if (op.flow == Flow::PassesThrough) return;
    const Kind result = op.resultKind ? op.resultKind(probe(action, operands)) : Kind::Band;
    stack_.push_back(result);
    if (action.resultName.empty()) return;
    if (!names_.emplace(action.resultName, result).second) {
      throw UsageError(
          fmt::format("{}: the name '{}' is taken; values do not change, so choose another",
                      op.name, action.resultName));
    }
  }

 private:
  [[nodiscard]] Kind kindOf(const std::string& name, const Operator& op) const {
    const auto it = names_.find(name);
    if (it != names_.end()) return it->second;
    std::vector<std::string> known;
    for (const auto& entry : names_) known.push_back(entry.first);
    const std::string guess = didYouMean(name, known);
    throw UsageError(fmt::format("{}: nothing is named '@{}'{}", op.name, name,
                                 guess.empty() ? "; give an earlier result that name with --as"
                                               : fmt::format("; did you mean '@{}'?", guess)));
  }

  std::vector<Kind> takeOperands(const Action& action) {
    const Operator& op = *action.op;
    std::vector<Kind> named;
    for (const std::string& name : action.operandNames) named.push_back(kindOf(name, op));
    if (named.size() > op.operands.size() && !op.takesMore) {
      throw UsageError(fmt::format("{}: takes {} operand{}, not {}", op.name, op.operands.size(),
                                   op.operands.size() == 1 ? "" : "s", named.size()));
    }
    if (named.size() >= op.operands.size()) return named;
    const std::size_t missing = op.operands.size() - named.size();
    if (stack_.size() < missing) {
      if (op.operandsOptional) return named;
      throw UsageError(
          fmt::format("{}: needs {} operand{} and finds {}; read or make {} first, or name {} with "
                      "'@'",
                      op.name, op.operands.size(), op.operands.size() == 1 ? "" : "s",
                      stack_.size() + named.size(), missing == 1 ? "one" : "them",
                      missing == 1 ? "it" : "them"));
    }
    std::vector<Kind> operands(stack_.end() - static_cast<std::ptrdiff_t>(missing), stack_.end());
    if (op.flow == Flow::Makes) stack_.resize(stack_.size() - missing);
    operands.insert(operands.end(), named.begin(), named.end());
    return operands;
  }

  static std::string mismatch(const Operator& op, std::size_t index, Kind found,
                              const std::vector<Kind>& allowed) {
    const char* remedy = "";
    if (found == Kind::Mesh && allowed == std::vector{Kind::Band})
      remedy = "; put 'level-set' before it";
    if (found == Kind::Band && allowed == std::vector{Kind::Mesh})
      remedy = "; put 'mesh' before it";
    if (found == Kind::Surface)
      remedy = "; it has no inside, and is the base of patches and of 'texture --alone' only";
    if (found == Kind::Patch) remedy = "; 'texture' makes a level set with it";
    if (found == Kind::Scene) remedy = "; 'render' draws it, 'write' saves it as .json";
    std::string kinds;
    for (std::size_t i = 0; i < allowed.size(); ++i)
      kinds += fmt::format("{}a {}",
                           i == 0                    ? ""
                           : i + 1 == allowed.size() ? " or "
                                                     : ", ",
                           kindName(allowed[i]));
    return fmt::format("{}: operand {} is a {}, {} is needed{}", op.name, index + 1,
                       kindName(found), kinds, remedy);
  }

  static Invocation probe(const Action& action, const std::vector<Kind>& kinds) {
    Invocation invocation(*action.op, action.options);
    for (Kind kind : kinds) invocation.operands.emplace_back(Plan{.kind = kind});
    return invocation;
  }

  std::vector<Kind> stack_;
  std::map<std::string, Kind> names_;
};

using StreamUse = std::function<bool(const Invocation&)> Operator::*;

/// Two actions that claim the same standard stream for data would garble each other.
void checkStandardStream(const Chain& chain, StreamUse use, const char* stream,
                         std::string firstUser) {
  for (const Action& action : chain.actions) {
    const auto& claims = action.op->*use;
    if (!claims || !claims(Invocation(*action.op, action.options))) continue;
    if (!firstUser.empty()) {
      throw UsageError(
          fmt::format("{}: standard {} is used already, by {}; use a file for one of them",
                      action.op->name, stream, firstUser));
    }
    firstUser = "'" + action.op->name + "'";
  }
}

}  // namespace

namespace {

Chain parse(Reader& reader, bool mayRun);

/// What stands behind `run`.
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
        throw UsageError(fmt::format("run: --set: '{}' is not NAME=VALUE", text));
      if (!call.settings.emplace(text.substr(0, equals), text.substr(equals + 1)).second)
        throw UsageError(fmt::format("run: --set: '{}' is given twice", text.substr(0, equals)));
    } else if (call.file.empty() && token != "!") {
      call.file = token;
      ++reader.next;
    } else {
      throw UsageError(
          "run: takes one file, and nothing behind it but --set NAME=VALUE; write the further "
          "actions into the file");
    }
  }
  if (call.file.empty())
    throw UsageError("run: takes one file: `levelsmith run FILE`, or - for standard input");
  return call;
}

/// `run FILE`: the chain that the file holds. Global options of the command line come first.
Chain parseScript(Reader& reader, const Chain& before) {
  const ScriptCall call = readCall(reader);
  const Script script = readScript(call.file, call.settings);
  Reader inner{script.words, &script};
  try {
    Chain chain = parse(inner, false);
    for (const auto& [name, value] : before.globals) chain.globals[name] = value;
    chain.isFromStandardInput = call.file == "-";
    return chain;
  } catch (const UsageError& error) {
    // The reader stands behind the action that failed.
    const std::size_t word = std::min(inner.next, script.words.size());
    throw UsageError(fmt::format("{} ({})", error.what(), script.place(word > 0 ? word - 1 : 0)));
  }
}

Chain parse(Reader& reader, bool mayRun) {
  const std::vector<std::string>& tokens = reader.tokens;
  Chain chain;
  while (!reader.atEnd() && isOption(tokens[reader.next]))
    reader.readOption(globalParams(), "levelsmith", chain.globals);
  if (!reader.atEnd() && tokens[reader.next] == runOperator().name) {
    if (mayRun) return parseScript(reader, chain);
    throw UsageError("run: a file of actions cannot run another one; put its actions here");
  }
  KindChecker kinds;
  while (!reader.atEnd()) {
    if (reader.atBang()) {
      throw UsageError(
          fmt::format("levelsmith: there is no action {} the '!' at word {}",
                      reader.next == 0 || chain.actions.empty() ? "before" : "between this and",
                      reader.next + 1));
    }
    const std::size_t first = reader.next;
    chain.actions.push_back(readAction(reader));
    if (reader.script) chain.actions.back().place = reader.script->place(first);
    kinds.visit(chain.actions.back());
    if (reader.atBang()) {
      ++reader.next;
      if (reader.atEnd()) throw UsageError("levelsmith: an action must follow the last '!'");
    }
  }
  if (chain.actions.empty())
    throw UsageError("levelsmith: nothing to do; `levelsmith help` shows how to begin");
  return chain;
}

}  // namespace

Chain parseChain(const std::vector<std::string>& tokens) {
  Reader reader{tokens};
  const Chain chain = parse(reader, true);
  const auto report = chain.globals.find("report");
  const bool reportsThere =
      report != chain.globals.end() && levelset::isStandardOutput(report->second);
  checkStandardStream(chain, &Operator::usesStandardOutput, "output",
                      reportsThere ? "--report" : "");
  checkStandardStream(chain, &Operator::usesStandardInput, "input",
                      chain.isFromStandardInput ? "'run'" : "");
  return chain;
}

}  // namespace pipeline
