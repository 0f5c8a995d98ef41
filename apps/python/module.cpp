#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <new>
#include <set>

#include "apps/pipeline/graph/graph_file.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "apps/pipeline/values/units.h"
#include "apps/python/arrays.h"
#include "apps/python/compute.h"
#include "apps/python/jobs.h"
#include "apps/python/python_arguments.h"
#include "levelset/error.h"

/// levelsmith._core: the extension module below the package levelsmith.

namespace py = pybind11;

namespace {

using levelset::ExitCode;
using pipeline::Kind;
using pipeline::Operator;
using pipeline::Param;
using pipeline::ParamType;
using python::Handle;
using python::LazyPtr;

/// Name of the Python class for a kind of value.
const char* className(Kind kind) {
  switch (kind) {
    case Kind::Mesh:
      return "Mesh";
    case Kind::Band:
      return "Solid";
    case Kind::Patch:
      return "Patch";
    case Kind::Field:
      return "Field";
    case Kind::Surface:
      return "Surface";
    case Kind::Scene:
      return "Scene";
    case Kind::Volume:
      return "Scan";
    case Kind::Points:
      return "PointCloud";
    case Kind::Adaptive:
      return "AdaptiveField";
    case Kind::Segmentation:
      return "Segmentation";
    case Kind::Molecule:
      return "Molecule";
    case Kind::Terrain:
      return "Terrain";
    case Kind::Deformation:
      return "Deformation";
  }
  return "";
}

const char* hintOf(ParamType type) {
  switch (type) {
    case ParamType::Flag:
      return "bool";
    case ParamType::Number:
    case ParamType::Degrees:
      return "float";
    case ParamType::Integer:
      return "int";
    case ParamType::Length:
      return "Length";
    case ParamType::Lengths:
      return "Lengths";
    case ParamType::Numbers:
      return "Numbers";
    case ParamType::Point:
      return "Point";
    case ParamType::Points:
      return "Points";
    case ParamType::Box:
      return "Box";
    case ParamType::Matrix:
      return "Matrix";
    case ParamType::Choice:
      return "str";
    case ParamType::Text:
      return "Text";
    case ParamType::Path:
      return "Path";
    case ParamType::ImageSize:
      return "ImageSize";
    case ParamType::Bytes:
      return "Bytes";
    case ParamType::Scalar:
      return "Scalar";
    case ParamType::Velocity:
      return "Velocity";
    case ParamType::Speed:
      return "Speed";
    case ParamType::Mesh:
      return "Mesh";
    case ParamType::Solid:
      return "Solid";
  }
  return "";
}

/// Finds the kinds of results that an operator can have, by trying each option alone.
/// @param first  kind of the first operand; null: the first kind that the operator accepts
std::set<Kind> resultKinds(const Operator& op, const Kind* first) {
  if (!op.resultKind) return {Kind::Band};
  std::set<Kind> kinds;
  const auto probe = [&](std::map<std::string, std::string> options) {
    pipeline::Invocation invocation(op, std::move(options));
    for (std::size_t i = 0; i < op.operands.size(); ++i)
      invocation.operands.emplace_back(
          pipeline::Plan{.kind = i == 0 && first ? *first : op.operands[i][0]});
    try {
      kinds.insert(op.resultKind(invocation));
    } catch (const levelset::Error&) {  // the option is not valid alone
    }
  };
  probe({});
  for (const Param& param : op.params) {
    if (param.choices.empty()) probe({{param.name, "1"}});
    for (const std::string& choice : param.choices) probe({{param.name, choice}});
  }
  return kinds;
}

/// Lists the Python classes of results for each class of the first operand ("" without operands).
/// Returns None if the operator has no result.
py::object resultClasses(const Operator& op) {
  if (op.flow != pipeline::Flow::Makes) return py::none();
  py::dict result;
  const auto add = [&](const char* operand, const Kind* first) {
    py::list names;
    for (const Kind kind : resultKinds(op, first)) names.append(className(kind));
    if (names.empty()) names.append("Value");
    result[operand] = names;
  };
  if (op.operands.empty()) add("", nullptr);
  for (std::size_t i = 0; !op.operands.empty() && i < op.operands[0].size(); ++i)
    add(className(op.operands[0][i]), &op.operands[0][i]);
  return result;
}

py::dict describe(const Param& param) {
  py::dict result;
  result["name"] = python::pythonName(param.name);
  result["hint"] = hintOf(param.type);
  result["doc"] = param.doc;
  result["default"] = param.fallback;
  result["choices"] = param.choices;
  result["required"] = param.required;
  result["position"] = param.position;
  return result;
}

py::list describeOperators() {
  py::list all;
  for (const Operator& op : pipeline::operators()) {
    py::dict result;
    result["name"] = op.name;
    result["former_name"] = op.formerName;
    result["group"] = op.group;
    result["summary"] = op.summary;
    result["details"] = op.details;
    result["example"] = op.example;
    result["takes_more"] = op.takesMore;
    result["operands_optional"] = op.operandsOptional;
    result["first_alone"] = !op.aloneWith.empty();
    result["may_take_none"] = !op.noneWith.empty();
    result["result"] = resultClasses(op);
    py::list operands, params;
    for (const std::vector<Kind>& kinds : op.operands) {
      py::list names;
      for (const Kind kind : kinds) names.append(className(kind));
      operands.append(names);
    }
    for (const Param& param : op.params) params.append(describe(param));
    result["operands"] = operands;
    result["params"] = params;
    all.append(result);
  }
  return all;
}

/// The Python exception classes, one for each exit code.
class Exceptions {
 public:
  explicit Exceptions(py::module_& module) {
    error_ = add(module, "Error", 1, {PyExc_Exception}, "Base class of all errors of levelsmith.");
    usage_ = add(module, "UsageError", 2, {error_, PyExc_ValueError},
                 "The arguments of the call are wrong.");
    input_ = add(module, "InputError", 3, {error_}, "The input data cannot be used.");
    resource_ =
        add(module, "ResourceError", 4, {error_}, "A limit of memory or size would be exceeded.");
    numeric_ = add(module, "NumericalError", 5, {error_}, "A numerical check failed.");
    file_ =
        add(module, "FileError", 6, {error_, PyExc_OSError}, "A file cannot be read or written.");
    cancelled_ = add(module, "Cancelled", 130, {error_}, "The progress callback ended the run.");
  }

  [[nodiscard]] PyObject* of(ExitCode code) const {
    switch (code) {
      case ExitCode::Usage:
        return usage_;
      case ExitCode::Input:
        return input_;
      case ExitCode::Resource:
        return resource_;
      case ExitCode::Numeric:
        return numeric_;
      case ExitCode::File:
        return file_;
      case ExitCode::Interrupted:
        return cancelled_;
      case ExitCode::Done:
        break;
    }
    return error_;
  }

 private:
  static PyObject* add(py::module_& module, const std::string& name, int code,
                       const std::vector<PyObject*>& bases, const char* doc) {
    py::tuple parents(bases.size());
    for (std::size_t i = 0; i < bases.size(); ++i)
      parents[i] = py::reinterpret_borrow<py::object>(bases[i]);
    py::dict members;
    members["exit_code"] = code;
    PyObject* type = PyErr_NewExceptionWithDoc(("levelsmith." + name).c_str(), doc, parents.ptr(),
                                               members.ptr());
    if (!type) throw py::error_already_set();
    module.add_object(name.c_str(), type);
    return type;
  }

  PyObject *error_, *usage_, *input_, *resource_, *numeric_, *file_, *cancelled_;
};

const Exceptions* exceptions = nullptr;

std::vector<LazyPtr> lazies(const py::iterable& nodes) {
  std::vector<LazyPtr> list;
  for (const py::handle node : nodes) list.push_back(node.cast<const Handle&>().lazy());
  return list;
}

/// Returns the value of a computed node.
const pipeline::Value& valueOf(const Handle& node) {
  if (node.lazy()->value()) return *node.lazy()->value();
  throw levelset::UsageError("levelsmith: the value is not yet computed; call compute()");
}

/// Returns (report, printed, warnings, notes, exception or None).
py::tuple tupleOf(const python::Outcome& outcome) {
  py::object failure = py::none();
  try {
    if (outcome.failure) std::rethrow_exception(outcome.failure);
  } catch (py::error_already_set& error) {
    failure = error.value();
  } catch (const levelset::Error& error) {
    failure = py::reinterpret_borrow<py::object>(exceptions->of(error.exitCode()))(error.what());
  } catch (const std::bad_alloc&) {
    failure = py::reinterpret_borrow<py::object>(exceptions->of(ExitCode::Resource))(
        "levelsmith: memory ran out; use larger voxels or a narrower band");
  }
  return py::make_tuple(outcome.report, outcome.printed, outcome.warnings, outcome.notes, failure);
}

py::tuple compute(const py::iterable& nodes, const py::object& progress, const std::string& cache,
                  bool isAgain) {
  return tupleOf(
      python::compute(lazies(nodes), {.progress = progress, .cache = cache, .isAgain = isAgain}));
}

using Texts = std::map<std::string, std::string>;

/// Returns (graph, locations, globals).
py::tuple makeJob(const std::string& text, const std::string& name, const Texts& settings,
                  const std::string& folder) {
  const python::Job job = python::makeJob(text, name, settings, folder);
  return py::make_tuple(job.graph, job.places, job.globals);
}

/// Runs a job. Returns (report, printed, warnings, notes, exception or None).
py::tuple runJob(const std::string& graph, const std::vector<std::string>& places,
                 const Texts& globals, const std::string& cache) {
  const pipeline::Graph whole = python::graphOf({graph, places, globals});
  const auto global = [&](const char* name) {
    const auto it = globals.find(name);
    return it == globals.end() ? std::string() : it->second;
  };
  const std::string memory = global("max-memory");
  return tupleOf(python::compute(
      whole, {.cache = cache.empty() ? global("cache") : cache,
              .isAgain = true,
              .report = global("report"),
              .measureErrors = globals.contains("report") || globals.contains("verbose"),
              .maxMemory = memory.empty() ? 0 : pipeline::parseBytes(memory, "--max-memory")}));
}

/// Returns the kind of a computed node, and its value as bytes.
py::tuple pack(const Handle& node) {
  const pipeline::Value value = valueOf(node);
  std::string bytes;
  {
    const py::gil_scoped_release release;
    bytes = python::bytesOf(value);
  }
  return py::make_tuple(static_cast<int>(value.kind()), py::bytes(bytes));
}

std::string graphText(const py::iterable& nodes) {
  const python::Request request(lazies(nodes), python::Request::Depth::Whole);
  for (const pipeline::Node& node : request.graph().nodes)
    if (node.op == &pipeline::givenOperator())
      throw levelset::UsageError(
          "graph: a value was built from arrays, which a graph cannot store; save that value to a "
          "file and read the file");
  return graphJson(request.graph());
}

std::optional<Imath::Box3d> boxOf(const py::object& box) {
  if (box.is_none()) return std::nullopt;
  const auto corners = py::array_t<double, py::array::c_style | py::array::forcecast>(box);
  if (corners.ndim() != 2 || corners.shape(0) != 2 || corners.shape(1) != 3)
    throw levelset::UsageError("array: a box needs two points, ((x, y, z), (x, y, z))");
  const double* c = corners.data();
  return Imath::Box3d({c[0], c[1], c[2]}, {c[3], c[4], c[5]});
}

using Point = std::array<double, 3>;

Imath::V3d toImath(const Point& p) {
  return {p[0], p[1], p[2]};
}

std::unique_ptr<Handle> given(pipeline::Value value) {
  return std::make_unique<Handle>(std::make_shared<python::Lazy>(std::move(value)));
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  exceptions = new Exceptions(module);  // NOLINT(bugprone-throw-keyword-missing)
  py::register_exception_translator([](std::exception_ptr failure) {
    try {
      if (failure) std::rethrow_exception(failure);
    } catch (const levelset::Error& error) {
      PyErr_SetString(exceptions->of(error.exitCode()), error.what());
    }
  });
  module.attr("version") = LEVELSMITH_VERSION;

  py::class_<Handle>(module, "Node")
      .def_property_readonly("kind",
                             [](const Handle& node) { return className(node.lazy()->kind()); })
      .def_property_readonly("is_computed",
                             [](const Handle& node) { return node.lazy()->value().has_value(); })
      .def_property_readonly("action",
                             [](const Handle& node) { return node.lazy()->node().op->name; })
      .def_property(
          "name", [](const Handle& node) { return node.lazy()->node().name; },
          [](const Handle& node, const std::string& name) { node.lazy()->setName(name); })
      .def_property_readonly("bounds",
                             [](const Handle& node) {
                               const pipeline::Value value = valueOf(node);
                               {
                                 const py::gil_scoped_release release;
                                 (void)value.plan();
                               }
                               const Imath::Box3d& box = value.plan().bounds;
                               return py::make_tuple(Point{box.min.x, box.min.y, box.min.z},
                                                     Point{box.max.x, box.max.y, box.max.z});
                             })
      .def_property_readonly("voxel",
                             [](const Handle& node) { return valueOf(node).band().voxelSize(); })
      .def("mesh_array",
           [](const py::object& self, const std::string& list) {
             // The capsule owns a reference to the mesh, because the node may release its value.
             const auto& value = valueOf(self.cast<const Handle&>());
             const py::capsule owner(new pipeline::Value(value), [](void* held) {
               delete static_cast<pipeline::Value*>(held);
             });
             return python::meshArray(owner, value.mesh(), list);
           })
      .def("cloud_array",
           [](const py::object& self, const std::string& list) {
             const auto& value = valueOf(self.cast<const Handle&>());
             const py::capsule owner(new pipeline::Value(value), [](void* held) {
               delete static_cast<pipeline::Value*>(held);
             });
             return python::cloudArray(owner, value.cloud(), list);
           })
      .def("terrain_array",
           [](const py::object& self) {
             const auto& value = valueOf(self.cast<const Handle&>());
             const py::capsule owner(new pipeline::Value(value), [](void* held) {
               delete static_cast<pipeline::Value*>(held);
             });
             return python::terrainArray(owner, value.terrain());
           })
      .def("lattice_array",
           [](const py::object& self) -> py::object {
             const auto& value = valueOf(self.cast<const Handle&>());
             if (!value.deformation().lattice()) return py::none();
             const py::capsule owner(new pipeline::Value(value), [](void* held) {
               delete static_cast<pipeline::Value*>(held);
             });
             return python::latticeArray(owner, *value.deformation().lattice());
           })
      .def("terrain_place",
           [](const Handle& node) {
             const pipeline::Value value = valueOf(node);
             const levelset::HeightField& terrain = value.terrain();
             return py::make_tuple(py::make_tuple(terrain.origin.x, terrain.origin.y),
                                   py::make_tuple(terrain.spacing.x, terrain.spacing.y));
           })
      .def("adaptive_figures",
           [](const Handle& node) {
             const pipeline::Value value = valueOf(node);
             return py::make_tuple(value.adaptive().tolerance(), value.adaptive().leafCount());
           })
      .def("distances",
           [](const Handle& node, const py::array& points) {
             const pipeline::Value value = valueOf(node);
             return python::distancesAt(value.adaptive(), points);
           })
      .def("region_labels",
           [](const Handle& node) {
             const pipeline::Value value = valueOf(node);
             return value.segmentation().labels();
           })
      .def("region_voxel",
           [](const Handle& node) {
             const pipeline::Value value = valueOf(node);
             return value.segmentation().voxelSize();
           })
      .def("labels_at",
           [](const Handle& node, const py::array& points) {
             const pipeline::Value value = valueOf(node);
             return python::labelsAt(value.segmentation(), points);
           })
      .def("sheet_labels",
           [](const Handle& node) {
             const pipeline::Value value = valueOf(node);
             return value.segmentation().sheetLabels();
           })
      .def("segmented_distances",
           [](const Handle& node, const py::array& points,
              std::optional<levelset::RegionLabel> region, bool onlySheets) {
             const pipeline::Value value = valueOf(node);
             return python::segmentedDistances(value.segmentation(), points, region, onlySheets,
                                               python::memoryLimit());
           })
      .def("band_array", [](const Handle& node, const py::object& box) {
        const pipeline::Value value = valueOf(node);
        const python::DenseBand dense =
            python::bandArray(value.band(), boxOf(box), python::memoryLimit());
        const Imath::V3d& o = dense.origin;
        return py::make_tuple(dense.values, Point{o.x, o.y, o.z}, value.band().voxelSize());
      });

  module.def("operators", describeOperators);
  module.def("node", [](std::size_t action, const py::tuple& args, const py::dict& options) {
    return std::make_unique<Handle>(python::makeNode(action, py::reinterpret_borrow<py::args>(args),
                                                     py::reinterpret_borrow<py::kwargs>(options)));
  });
  module.def("compute", compute);
  module.def("graph", graphText);
  module.def("mesh", [](const py::array& vertices, const py::array& faces) {
    return given(pipeline::Value(python::meshFromArrays(vertices, faces)));
  });
  module.def("cloud", [](const py::array& positions, const py::object& normals) {
    return given(pipeline::Value(python::cloudFromArrays(positions, normals)));
  });
  module.def("terrain", [](const py::array& heights, const std::array<double, 2>& spacing,
                           const std::array<double, 2>& origin) {
    return given(pipeline::Value(python::terrainFromArray(
        heights, Imath::V2d(spacing[0], spacing[1]), Imath::V2d(origin[0], origin[1]))));
  });
  module.def("lattice", [](const py::array& points, const Point& low, const Point& high,
                           const std::array<int, 3>& degree) {
    return given(
        pipeline::Value(pipeline::DeformationValue{std::make_shared<levelset::LatticeDeformation>(
            python::latticeFromArray(points, Imath::Box3d(toImath(low), toImath(high)), degree))}));
  });
  module.def("samples", [](const Point& origin, double voxel,
                           const py::array_t<std::int32_t, py::array::c_style>& blocks,
                           const py::array_t<float, py::array::c_style>& values,
                           const py::array_t<std::int32_t, py::array::c_style>& inside) {
    return given(
        pipeline::Value(python::bandOfSamples(toImath(origin), voxel, blocks, values, inside)));
  });
  module.def("job", makeJob);
  module.def("run_job", runJob);
  module.def("pack", pack);
  module.def("unpack", [](int kind, const std::string& bytes) {
    return given(python::valueOf(static_cast<Kind>(kind), bytes));
  });
  module.def("set_threads", python::setThreads);
  module.def("set_max_memory", [](const std::string& text) {
    python::setMaxMemory(text.empty() ? 0 : pipeline::parseBytes(text, "max_memory"));
  });
}
