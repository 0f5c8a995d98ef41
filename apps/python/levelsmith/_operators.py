"""Functions and methods, generated from the registry of operators."""

import inspect
import json
import re
import textwrap

from . import _core, _values

names = []
registry = _core.operators()


def python_name(operator):
    return operator["name"].replace("-", "_")


def default_of(param):
    """Default of a parameter, as a Python value."""
    text = param["default"]
    if not text:
        return False if param["hint"] == "bool" else None
    if param["hint"] in ("str", "Text") or param["choices"]:
        return text
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        return text
    numbers = tuple(int(n) if n.is_integer() else n for n in numbers)
    return numbers if len(numbers) > 1 else numbers[0]


def hidden(param):
    """Returns True for the option --json, because functions always return measured values as a dictionary."""
    return param["name"] == "json"


def operand_names(operator):
    """Names of the operands: solid, mesh, patch, …; with a number if a kind occurs more than once."""
    kinds = [kinds[0].lower() for kinds in operator["operands"]]
    count = {kind: kinds.count(kind) for kind in kinds}
    return [
        kind if count[kind] == 1 else f"{kind}_{kinds[: i + 1].count(kind)}"
        for i, kind in enumerate(kinds)
    ]


def signature_of(operator):
    Parameter = inspect.Parameter
    params = []
    for number, name in enumerate(operand_names(operator)):
        is_optional = operator["operands_optional"] or operator["may_take_none"]
        is_optional = is_optional or (number > 0 and operator["first_alone"])
        default = None if is_optional else Parameter.empty
        params.append(Parameter(name, Parameter.POSITIONAL_ONLY, default=default))
    if operator["takes_more"]:
        kind = operator["operands"][-1][0].lower()
        plural = kind + ("es" if kind.endswith("ch") else "s")
        params.append(Parameter("more_" + plural, Parameter.VAR_POSITIONAL))
    placed = sorted((p for p in operator["params"] if p["position"] >= 0), key=lambda p: p["position"])
    named = [p for p in operator["params"] if p["position"] < 0 and not hidden(p)]
    optional = operator["operands_optional"]
    for param in placed:
        empty = param["required"] and not optional
        optional = optional or not empty
        default = Parameter.empty if empty else default_of(param)
        params.append(Parameter(param["name"], Parameter.POSITIONAL_OR_KEYWORD, default=default))
    for param in named:
        default = Parameter.empty if param["required"] else default_of(param)
        params.append(Parameter(param["name"], Parameter.KEYWORD_ONLY, default=default))
    return inspect.Signature(params)


FORMS = {
    "bool": "True or False",
    "float": "number",
    "int": "integer",
    "str": "text",
    "Text": "text",
    "Length": "length",
    "Lengths": "lengths",
    "Numbers": "number, or three numbers",
    "Point": "three numbers",
    "Points": "points",
    "Box": "two points",
    "Matrix": "4 x 4 numbers, for row vectors",
    "Path": "file",
    "ImageSize": "width, height",
    "Bytes": "size",
    "Scalar": "number, formula in x, y, z, r, Field or Solid",
    "Velocity": "three formulas, or a Field",
    "Speed": "number, formula in x, y, z, r, t, nx, ny, nz, k, Field or Solid",
    "Mesh": "Mesh",
    "Solid": "Solid",
}


def form_of(param):
    choices = " ".join(repr(choice) for choice in param["choices"])
    if param["hint"] == "Velocity":
        return f"{choices}, {FORMS['Velocity']}"
    return choices or FORMS[param["hint"]]


def in_python(text):
    """Replaces names of options by those of Python parameters."""
    return re.sub(r"--([a-z][a-z0-9-]*)", lambda m: m[1].replace("-", "_"), text)


def doc_of(operator):
    lines = [operator["summary"][0].upper() + operator["summary"][1:] + "."]
    if operator["details"]:
        lines += ["", *textwrap.wrap(in_python(operator["details"]), 96)]
    params = [p for p in operator["params"] if not hidden(p)]
    if params:
        lines += [""]
    for param in params:
        needed = ", required" if param["required"] else ""
        line = f"  {param['name']}: {in_python(param['doc'])} ({form_of(param)}{needed})"
        lines += textwrap.wrap(line, 96, subsequent_indent="      ")
    if operator["example"]:
        lines += ["", "On the command line:", "  " + operator["example"]]
    return "\n".join(lines)


def figures_of(printed):
    return json.loads(printed) if printed else None


def make(number, operator):
    """Creates the function of an operator."""
    node, wrap, run = _core.node, _values.wrap, _values.run
    if operator["result"]:

        def call(*operands, **options):
            return wrap(node(number, operands, options))

    elif any(hidden(param) for param in operator["params"]):

        def call(*operands, **options):
            options["json"] = True
            return figures_of(run([node(number, operands, options)]))

    else:

        def call(*operands, **options):
            run([node(number, operands, options)])

    call.__name__ = call.__qualname__ = python_name(operator)
    call.__module__ = "levelsmith"
    call.__doc__ = doc_of(operator)
    call.__signature__ = signature_of(operator)
    return call


def install(package):
    """Adds the functions to the package, and as methods to the classes of their first operands."""
    for number, operator in enumerate(registry):
        name, call = python_name(operator), make(number, operator)
        package[name] = _values.operators[name] = call
        names.append(name)
        former = operator["former_name"].replace("-", "_")
        if former:
            package[former] = _values.operators[former] = call
        for kind in operator["operands"][0] if operator["operands"] else ():
            for word in filter(None, (name, former)):
                if word not in vars(_values.classes[kind]):
                    setattr(_values.classes[kind], word, call)
            if name == "write":
                _values.classes[kind].save = call
