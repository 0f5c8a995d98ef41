#include "apps/pipeline/help/completion.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include "apps/pipeline/help/help.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

/// Returns `--name` for a flag, `--name=KIND` for an option with a value, and `0=KIND` for a
/// positional value. KIND is FILE, ACTION, VALUE, or the accepted words with commas between them,
/// such as `auto`.
std::string paramWord(const Param& param) {
  std::string kind = "VALUE";
  if (param.type == ParamType::Path) kind = "FILE";
  if (param.allowsAuto) kind = "auto";
  if (!param.choices.empty()) kind = fmt::format("{}", fmt::join(param.choices, ","));
  if (param.type == ParamType::Flag) return "--" + param.name;
  return param.position >= 0 ? fmt::format("{}={}", param.position, kind)
                             : fmt::format("--{}={}", param.name, kind);
}

/// Shell function `_levelsmith_params ACTION`. It sets the shell variable `params` to the words of
/// paramWord() for an action; '' stands for the global options.
std::string completionTable() {
  std::string text = "_levelsmith_params() {\n  case $1 in\n";
  const auto add = [&](const std::string& action, const std::vector<Param>& params,
                       const std::string& more) {
    std::string words;
    for (const Param& param : params) words += paramWord(param) + " ";
    text += fmt::format("  {}) params='{}{}' ;;\n", action.empty() ? "''" : action, words, more);
  };
  add("", globalParams(), "--version");
  for (const HelpGroup& group : helpGroups())
    for (const Operator* op : group.actions)
      add(op->name, op->params, op->flow == Flow::Makes ? "--as=VALUE" : "");
  add("help", {}, "0=ACTION --json --search=VALUE --markdown --schema --completion=bash,zsh");
  return text + "  *) params='' ;;\n  esac\n}\n";
}

/// Shell function that is part of both the bash and the zsh script.
constexpr const char* kVariables = R"sh(
# Prints `NAME=` for each variable that a `set` line of a script sets.
_levelsmith_variables() {
  sed -n 's/^[[:blank:]]*set[[:blank:]]\{1,\}\([A-Za-z_][A-Za-z0-9_-]*\)[[:blank:]].*/\1=/p' "$1"
}
)sh";

constexpr const char* kBash = R"sh(
# Sets `kind` to the kind of value that an option, or a positional argument given by its index,
# takes; empty for a flag.
_levelsmith_kind() {
  local each begun=''
  kind=''
  for each in $params; do
    if [[ $each == "$1="* ]]; then kind=${each#*=}; return; fi
    [[ $each == "$1" ]] && return
    [[ $1 == --* && $each == "$1"*=* ]] && begun=${each#*=}
  done
  kind=$begun
}

# Completes `$1` as a value of the kind in `kind`.
_levelsmith_value() {
  local list=''
  case $kind in
  FILE)
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "$1")
    return ;;
  ACTION) list="$_levelsmith_actions run" ;;
  VALUE) return ;;
  *) list=${kind//,/ } ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$list" -- "$1")
}

_levelsmith() {
  COMPREPLY=()
  # Bash splits words at =, @ and =@. Join the pieces again.
  local -a words=()
  local word joins='' i
  for ((i = 1; i <= COMP_CWORD; ++i)); do
    word=${COMP_WORDS[i]}
    if ((${#words[@]} > 0)) && [[ -n $joins || $word == =?(@) ]]; then
      words[-1]+=$word
    else
      words+=("$word")
    fi
    [[ $word == =?(@) || $word == @ ]] && joins=1 || joins=''
  done
  local full=${words[-1]} action='' begun='' option='' place=0 names='' script='' params kind
  _levelsmith_params ''
  for word in "${words[@]:0:${#words[@]}-1}"; do
    if [[ -n $option ]]; then
      [[ $option == --as ]] && names+=" @${word#@}"
      option=''
    elif [[ $word == '!' ]]; then
      action='' begun=1 params=''
    elif [[ $word == --as=* ]]; then
      names+=" @${word#--as=}"
    elif [[ $word == --*=* || $word == @* || $word == -[vq] ]]; then
      :
    elif [[ $word == --* ]]; then
      _levelsmith_kind "$word"
      [[ -n $kind ]] && option=$word
    elif [[ -z $action ]]; then
      action=$word begun=1 place=0
      _levelsmith_params "$action"
    else
      [[ $action == run ]] && script=$word
      place=$((place + 1))
    fi
  done

  local value=$full list=''
  if [[ -z $option && $full == --*=* ]]; then
    option=${full%%=*}
    value=${full#*=}
  fi
  if [[ $value == @* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$names" -- "$value")
    [[ $COMP_WORDBREAKS == *@* ]] && COMPREPLY=("${COMPREPLY[@]#@}")
  elif [[ $option == --set && $value != *=* && -f $script ]]; then
    compopt -o nospace 2>/dev/null
    kind=$(_levelsmith_variables "$script")
    kind=${kind//$'\n'/,}
    _levelsmith_value "$value"
  elif [[ -n $option ]]; then
    _levelsmith_kind "$option"
    _levelsmith_value "$value"
  elif [[ -z $action && $full != -* ]]; then
    list=$_levelsmith_actions
    [[ -n $begun ]] || list+=' run help'
    mapfile -t COMPREPLY < <(compgen -W "$list" -- "$full")
  else
    _levelsmith_kind "$place"
    if [[ -n $kind && $full != -* ]]; then
      _levelsmith_value "$full"
    else
      for word in $params; do [[ $word == -* ]] && list+=" ${word%%=*}"; done
      [[ -n $action && $action != help && $action != run ]] && list+=" ! $names"
      mapfile -t COMPREPLY < <(compgen -W "$list" -- "$full")
    fi
  fi
  # If bash does not split words at =, a completion must repeat the text before the value.
  if [[ $full == --*=* && $COMP_WORDBREAKS != *=* ]]; then
    COMPREPLY=("${COMPREPLY[@]/#/${full%%=*}=}")
  fi
  return 0
}

complete -F _levelsmith levelsmith
)sh";

constexpr const char* kZsh = R"sh(
# Sets `kind` to the kind of value that an option, or a positional argument given by its index,
# takes; empty for a flag.
_levelsmith_kind() {
  local each begun=''
  kind=''
  for each in ${=params}; do
    if [[ $each == "$1="* ]]; then kind=${each#*=}; return; fi
    [[ $each == "$1" ]] && return
    [[ $1 == --* && $each == "$1"*=* ]] && begun=${each#*=}
  done
  kind=$begun
}

_levelsmith_value() {
  case $kind in
  FILE) _files ;;
  ACTION) compadd -- ${=_levelsmith_actions} run ;;
  VALUE) return 1 ;;
  *) compadd -- ${(s:,:)kind} ;;
  esac
}

_levelsmith() {
  local full=$words[CURRENT] word action='' begun='' option='' script='' params='' kind=''
  local -i place=0
  local -a names list
  _levelsmith_params ''
  for word in "${(@)words[2,CURRENT-1]}"; do
    if [[ -n $option ]]; then
      [[ $option == --as ]] && names+=("@${word#@}")
      option=''
    elif [[ $word == ('!'|'\!') ]]; then
      action='' begun=1 params=''
    elif [[ $word == --as=* ]]; then
      names+=("@${word#--as=}")
    elif [[ $word == --*=* || $word == @* || $word == -[vq] ]]; then
      :
    elif [[ $word == --* ]]; then
      _levelsmith_kind "$word"
      [[ -n $kind ]] && option=$word
    elif [[ -z $action ]]; then
      action=$word begun=1 place=0
      _levelsmith_params "$action"
    else
      [[ $action == run ]] && script=$word
      place+=1
    fi
  done

  if [[ -z $option && $full == --*=* ]]; then
    option=${full%%=*}
    compset -P '*='
  fi
  if [[ ${full#--*=} == @* ]]; then
    compadd -- $names
  elif [[ $option == --set && -f $script ]]; then
    list=(${(f)"$(_levelsmith_variables $script)"})
    compadd -S '' -- $list
  elif [[ -n $option ]]; then
    _levelsmith_kind "$option"
    _levelsmith_value
  elif [[ -z $action && $full != -* ]]; then
    list=($_levelsmith_summaries)
    [[ -n $begun ]] || list+=($_levelsmith_alone)
    _describe action list
  else
    _levelsmith_kind "$place"
    if [[ -n $kind && $full != -* ]]; then
      _levelsmith_value
    else
      for word in ${=params}; do [[ $word == -* ]] && list+=(${word%%=*}); done
      [[ -n $action && $action != (help|run) ]] && compadd -Q -- '!' $names
      compadd -- $list
    fi
  fi
}

# If zsh loads this text as the file _levelsmith in $fpath, the text is the body of the completion
# function. If the text is evaluated, it registers that function.
if [[ $funcstack[1] == _levelsmith ]]; then
  _levelsmith
else
  compdef _levelsmith levelsmith
fi
)sh";

/// Returns an action and its summary as an entry for zsh's _describe, in single quotes.
std::string summaryWord(const Operator& op) {
  std::string text;
  for (char c : op.name + ":" + op.summary) {
    if (c == ':' && text.size() > op.name.size()) text += '\\';
    text += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return "'" + text + "'";
}

}  // namespace

std::string completionScript(const std::string& shell) {
  std::vector<std::string> names, summaries;
  for (const Operator& op : operators()) {
    names.push_back(op.name);
    summaries.push_back("  " + summaryWord(op));
  }
  const std::string head = fmt::format(
      "# Completes levelsmith in {0}: eval \"$(levelsmith help --completion {0})\"\n"
      "_levelsmith_actions='{1}'\n",
      shell, fmt::join(names, " "));
  if (shell == "bash") return head + completionTable() + kVariables + kBash;
  if (shell == "zsh") {
    return "#compdef levelsmith\n" + head +
           fmt::format("_levelsmith_summaries=(\n{}\n)\n_levelsmith_alone=({} {})\n",
                       fmt::join(summaries, "\n"), summaryWord(runOperator()),
                       "'help:explain an action, or list them'") +
           completionTable() + kVariables + kZsh;
  }
  throw levelset::UsageError(
      fmt::format("help: --completion: '{}' is not one of bash, zsh", shell));
}

}  // namespace pipeline
