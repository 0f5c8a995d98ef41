#include "apps/python/python_arguments.h"

#include <fmt/core.h>

#include <algorithm>
#include <unordered_map>

#include "apps/pipeline/values/units.h"
#include "levelset/error.h"

namespace py = pybind11;

namespace python {
namespace {

using levelset::UsageError;
using pipeline::Node;
using pipeline::Operator;
using pipeline::Param;
using pipeline::ParamType;

/// Returns the lazy value of a Python object, if it has one.
LazyPtr lazyOf(py::handle object) {
  static PyObject* const name = PyUnicode_InternFromString("_node");
  if (py::isinstance<Handle>(object)) return object.cast<const Handle&>().lazy();
  if (PyFloat_Check(object.ptr()) || PyUnicode_Check(object.ptr()) || PyTuple_Check(object.ptr()))
    return nullptr;
  PyObject* node = PyObject_GetAttr(object.ptr(), name);
  if (!node) {
    PyErr_Clear();
    return nullptr;
  }
  const auto held = py::reinterpret_steal<py::object>(node);
  return py::isinstance<Handle>(held) ? held.cast<const Handle&>().lazy() : nullptr;
}

/// Text of a number as on the command line; empty if the object is not a number.
std::optional<std::string> numberText(py::handle value) {
  PyObject* object = value.ptr();
  if (PyBool_Check(object)) return std::nullopt;
  if (PyFloat_Check(object)) return fmt::format("{}", PyFloat_AS_DOUBLE(object));
  if (PyIndex_Check(object)) {
    const auto whole = py::reinterpret_steal<py::object>(PyNumber_Index(object));
    if (whole) return py::str(whole).cast<std::string>();
    PyErr_Clear();  // an array is an index only when it holds a single number
  }
  // A 0-dimensional array is a number, too.
  const bool isRow = PySequence_Check(object) && PySequence_Size(object) >= 0;
  PyErr_Clear();
  if (!isRow && PyNumber_Check(object)) {
    const double number = PyFloat_AsDouble(object);
    if (!PyErr_Occurred()) return fmt::format("{}", number);
    PyErr_Clear();
  }
  return std::nullopt;
}

[[noreturn]] void refuse(py::handle value, const std::string& where) {
  const std::string type = py::str(py::type::of(value).attr("__name__"));
  throw UsageError(fmt::format(
      "{}: a value of type {} is not supported here; see the help of the function", where, type));
}

/// Text of rows of numbers or lengths, with `inner` between columns and `outer` between rows.
std::string rowsText(py::handle value, const char* inner, const char* outer,
                     const std::string& where) {
  std::string text;
  for (const py::handle item : value) {
    const bool isRow =
        !py::isinstance<py::str>(item) && !numberText(item) && PySequence_Check(item.ptr());
    text += text.empty() ? "" : isRow ? outer : inner;
    if (isRow)
      text += rowsText(item, inner, outer, where);
    else if (py::isinstance<py::str>(item))
      text += item.cast<std::string>();
    else if (const auto number = numberText(item))
      text += *number;
    else
      refuse(item, where);
  }
  return text;
}

bool ofWords(py::handle sequence) {
  for (const py::handle item : sequence)
    if (PyUnicode_Check(item.ptr())) return true;
  return false;
}

/// Text of a parameter's value as on the command line.
std::string textOf(const Param& param, py::handle value, const std::string& where) {
  if (PyUnicode_Check(value.ptr())) return value.cast<std::string>();
  if (param.type == ParamType::Path) {
    const auto path = py::reinterpret_steal<py::object>(PyOS_FSPath(value.ptr()));
    if (path) return path.cast<std::string>();
    PyErr_Clear();
    refuse(value, where);
  }
  if (auto number = numberText(value)) return *std::move(number);
  if (!PySequence_Check(value.ptr()) || PyBytes_Check(value.ptr())) refuse(value, where);
  switch (param.type) {
    case ParamType::ImageSize:
      return rowsText(value, "x", "x", where);
    case ParamType::Matrix:
      return rowsText(value, ",", ",", where);
    case ParamType::Text:
      return rowsText(value, ofWords(value) ? " " : ",", " ", where);
    case ParamType::Flag:
    case ParamType::Number:
    case ParamType::Integer:
    case ParamType::Length:
    case ParamType::Degrees:
    case ParamType::Choice:
    case ParamType::Bytes:
      refuse(value, where);
    default:
      return rowsText(value, ",", " ", where);
  }
}

using ParamsByName = std::unordered_map<std::string, const Param*>;

const ParamsByName& paramsOf(std::size_t action) {
  static const std::vector<ParamsByName> all = [] {
    std::vector<ParamsByName> list;
    for (const Operator& op : pipeline::operators()) {
      ParamsByName& names = list.emplace_back();
      for (const Param& param : op.params) {
        names.emplace(pythonName(param.name), &param);
        if (!param.formerName.empty()) names.emplace(pythonName(param.formerName), &param);
      }
    }
    return list;
  }();
  return all.at(action);
}

const Param& paramNamed(const Operator& op, const ParamsByName& params, const std::string& name) {
  if (const auto it = params.find(name); it != params.end()) return *it->second;
  std::vector<std::string> names;
  for (const Param& param : op.params) names.push_back(pythonName(param.name));
  const std::string guess = pipeline::didYouMean(name, names);
  throw UsageError(fmt::format("{}: there is no option {}{}", op.name, name,
                               guess.empty() ? "; the help of the function lists the options"
                                             : fmt::format("; did you mean {}?", guess)));
}

/// Collects the arguments of a call of an operator.
class Call {
 public:
  explicit Call(std::size_t action)
      : op_(pipeline::operators().at(action)), params_(paramsOf(action)) {
    node_.op = &op_;
  }

  void addPlaced(const py::args& args) {
    std::size_t next = 0;
    for (; next < args.size(); ++next) {
      LazyPtr input = lazyOf(args[next]);
      if (!input) break;
      inputs_.push_back(std::move(input));
    }
    for (int place = 0; next < args.size(); ++next, ++place) {
      const auto param = std::find_if(op_.params.begin(), op_.params.end(),
                                      [&](const Param& p) { return p.position == place; });
      if (param == op_.params.end()) refuse(args[next], op_.name);
      give(*param, args[next], op_.name + ": " + param->name);
    }
  }

  void addNamed(const py::kwargs& kwargs) {
    for (const auto& [key, value] : kwargs) {
      const Param& param = paramNamed(op_, params_, key.cast<std::string>());
      give(param, value, op_.name + ": --" + param.name);
    }
  }

  LazyPtr make() {
    for (const Param& param : op_.params)
      if (param.required && !node_.options.contains(param.name))
        throw UsageError(fmt::format("{}: needs {}{} {}", op_.name, param.position >= 0 ? "" : "--",
                                     param.name, valueForm(param)));
    check();
    return std::make_shared<Lazy>(std::move(node_), std::move(inputs_), std::move(named_));
  }

 private:
  void give(const Param& param, py::handle value, const std::string& where) {
    if (value.is_none()) return;
    if (node_.options.contains(param.name))
      throw UsageError(where + ": the parameter is given twice");
    if (param.type == ParamType::Flag) {
      if (!PyNumber_Check(value.ptr())) refuse(value, where);
      if (PyObject_IsTrue(value.ptr()) == 1) node_.options[param.name] = "true";
      return;
    }
    if (LazyPtr field = lazyOf(value)) {
      if (!pipeline::namesValue(param, "@" + param.name)) refuse(value, where);
      node_.options[param.name] = "@" + pythonName(param.name);
      named_.emplace(param.name, std::move(field));
      return;
    }
    std::string text = textOf(param, value, where);
    if (pipeline::namesValue(param, text))
      throw UsageError(fmt::format(
          "{}: '{}' refers to a value by name, as on the command line; pass the value itself",
          where, text));
    pipeline::checkText(param, text, where);
    node_.options[param.name] = std::move(text);
  }

  /// Checks this node and its inputs with checkNode().
  void check() {
    std::vector<Node> before;
    const auto addBefore = [&](const Lazy& lazy, std::string name) {
      Node& node = before.emplace_back();
      node.op = lazy.node().op;
      node.name = std::move(name);
      node.kind = lazy.kind();
      return before.size() - 1;
    };
    for (const LazyPtr& input : inputs_) node_.inputs.push_back(addBefore(*input, {}));
    for (const auto& [option, input] : named_)
      node_.named.emplace(option, addBefore(*input, pythonName(option)));
    node_.kind = checkNode(node_, before);
    node_.inputs.clear();
    node_.named.clear();
  }

  const Operator& op_;
  const ParamsByName& params_;
  Node node_;
  std::vector<LazyPtr> inputs_;
  std::map<std::string, LazyPtr> named_;
};

}  // namespace

std::string pythonName(const std::string& param) {
  std::string name = param;
  std::replace(name.begin(), name.end(), '-', '_');
  for (const char* word : {"from", "as", "in", "is", "not", "with", "lambda", "global"})
    if (name == word) return name + "_";
  return name;
}

LazyPtr makeNode(std::size_t action, const py::args& args, const py::kwargs& kwargs) {
  Call call(action);
  call.addPlaced(args);
  call.addNamed(kwargs);
  return call.make();
}

}  // namespace python
