"""Runs one graph with many parameter sets, in this process or on the workers of a Dask cluster."""

import collections
import hashlib
import json
import numbers
import os
import re
import warnings

import numpy

from . import _core, _values

# Global options of a pipeline that apply to its jobs, and those that jobs ignore because they do not
# change results. All other global options are refused.
FOLLOWED = {"cache", "report", "max-memory", "verbose"}
IGNORED = {"quiet", "progress", "threads"}


def map(graph, parameters, client=None, *, cache=None):
    """Run a graph once for each set of parameters. Returns the results, in their order.

    graph: a pipeline with ${variables}, as a text of several lines or as a file (.pipeline, or a
        graph as .json with variables in its options). Or a function that is called with the
        parameters and returns values, or other objects that can be pickled, also in lists, tuples
        and dictionaries.
    parameters: dictionaries; keys are variables of the pipeline, or arguments of the function.
    client: a dask.distributed.Client whose workers run the jobs; None: this process runs them one by one.
        If a worker dies, another one runs its job again.
    cache: cache folder of all jobs; None: the folder of set_cache().

    The result of a pipeline is its report, with the printed text under "printed". File names are
    relative to the caller's folder. All pipelines are checked before the first one runs. Errors are
    raised in this process and name the parameters; of several errors, the first in order is raised.
    """
    sets = _sets(parameters)
    folder = os.path.abspath(cache) if cache else _values.cache_folder()
    jobs = _functions(graph, sets) if callable(graph) else _pipelines(graph, sets)
    outcomes = _here(jobs, folder) if client is None else _there(jobs, folder, client)
    results = []
    for number, outcome in enumerate(outcomes):
        result, messages, error = outcome
        about = _about(number, sets[number])
        for text in messages:
            warnings.warn(f"{text} ({about})", _values.Warning, stacklevel=2)
        if error is not None:
            outcomes.close()  # do not wait for the other jobs
            raise _named(error, about)
        results.append(result)
    return results


def _sets(parameters):
    if isinstance(parameters, (str, bytes, dict)):
        raise _core.UsageError(
            f"map: parameters is a {type(parameters).__name__}; give a list of dictionaries"
        )
    sets = list(parameters)
    for number, each in enumerate(sets):
        if not isinstance(each, collections.abc.Mapping) or not all(isinstance(name, str) for name in each):
            raise _core.UsageError(
                f"map: parameters[{number}] is a {type(each).__name__}; give a dictionary of names and values"
            )
    return [dict(each) for each in sets]


def _about(number, parameters):
    def short(value):
        text = " ".join(repr(value).split())
        return text if len(text) <= 60 else text[:57] + "..."

    return f"parameters[{number}]" + "".join(f", {name} = {short(value)}" for name, value in parameters.items())


def _named(error, about):
    if isinstance(error, _core.Error):
        return type(error)(f"{error} ({about})")
    if hasattr(error, "add_note"):
        error.add_note(about)
    return error


class _Function:
    """A job that calls a function with its parameters."""

    def __init__(self, function, parameters):
        self.function, self.parameters = function, parameters

    def run(self, job):
        result = self.function(**self.parameters)
        values = list(_values_in(result))
        for value in values:
            kind = type(value).__name__
            if kind not in ("Solid", "Mesh", "Field"):
                raise _core.UsageError(
                    f"map: the function returns a {kind}, which cannot be sent to another process; return values computed from it"
                )
        if values:
            _values.run([value._node for value in values])
        return result

    def key(self):
        from dask.base import tokenize

        return tokenize(self.function, self.parameters)


def _values_in(result):
    if isinstance(result, _values.Value):
        yield result
    elif isinstance(result, (list, tuple, dict)):
        for item in result.values() if isinstance(result, dict) else result:
            yield from _values_in(item)


def _functions(function, sets):
    return [_Function(function, each) for each in sets]


class _Pipeline:
    """A job that runs a pipeline: a checked graph with absolute file names and values of its variables."""

    def __init__(self, text, name, settings, folder):
        if name.lower().endswith(".json"):
            text, settings = _filled(text, name, settings), {}
        self.graph, self.places, self.options = _core.job(text, name, settings, folder)
        for option in self.options:
            if option not in FOLLOWED | IGNORED:
                raise _core.UsageError(f"map: jobs do not support --{option}; remove it from '{name}'")

    def run(self, job):
        outcome = _core.run_job(self.graph, self.places, self.options, job.cache)
        printed = _values.settle(outcome)
        return {**json.loads(outcome[0]), "printed": printed}

    def key(self):
        text = json.dumps([self.graph, self.places, self.options], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def _pipelines(graph, sets):
    if isinstance(graph, str) and "\n" in graph:
        text, name = graph, "pipeline"
    else:
        try:
            name = os.fspath(graph)
        except TypeError:
            raise _core.UsageError(
                f"map: graph is a {type(graph).__name__}; give a pipeline, its file or a function"
            ) from None
        try:
            with open(name, encoding="utf-8", errors="surrogateescape") as file:
                text = file.read()
        except OSError as error:
            raise _core.FileError(
                f"map: '{name}' cannot be read: {error.strerror}; give a file name, or the text of a pipeline in several lines"
            ) from None
    folder = os.getcwd()
    jobs = []
    for number, each in enumerate(sets):
        settings = {key: _text(value, f"map: {key}") for key, value in each.items()}
        try:
            jobs.append(_Pipeline(text, name, settings, folder))
        except _core.Error as error:
            sentence = re.sub(r"^run: --set ", "map: ", str(error))
            raise _named(type(error)(sentence), _about(number, each)) from None
    return jobs


def _text(value, where):
    """Text that replaces a variable of a pipeline, for a Python value."""
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if isinstance(value, numpy.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, numpy.bool_)):
        return "true" if value else "false"
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        number = float(value)
        return str(int(number)) if number.is_integer() and abs(number) < 1e16 else repr(number)
    if isinstance(value, (list, tuple, numpy.ndarray)):
        rows = any(isinstance(item, (list, tuple, numpy.ndarray)) for item in value)
        return (" " if rows else ",").join(_text(item, where) for item in value)
    raise _core.UsageError(f"{where}: a value of type {type(value).__name__} is not supported in a pipeline")


def _filled(text, name, settings):
    """Replaces the variables in the options of a graph. text: the graph as JSON."""
    try:
        graph = json.loads(text)
        options = [node["options"] for node in graph["nodes"] if "options" in node]
    except (ValueError, TypeError, KeyError):
        return text  # not a graph: _core.job() reports the error
    found = set()

    def value_of(match):
        variable = match[1]
        found.add(variable)
        if variable not in settings:
            raise _core.UsageError(f"map: ${{{variable}}} in '{name}' has no value; give it in parameters")
        return settings[variable]

    for each in options:
        for option, value in each.items():
            if isinstance(value, str):
                each[option] = re.sub(r"\$\{([^}]*)\}", value_of, value)
    for variable in settings:
        if variable not in found:
            known = f"its variables are {', '.join(sorted(found))}" if found else "it has no variables"
            raise _core.UsageError(f"map: '{name}' has no variable '{variable}'; {known}")
    return json.dumps(graph)


def _run(job, folder):
    """Runs a job in this process. Returns (result, warnings, exception or None)."""
    with _values.Job(folder) as context:
        try:
            return job.run(context), context.messages, None
        except Exception as error:
            return None, context.messages, error


def _here(jobs, folder):
    for job in jobs:
        yield _run(job, folder)


def _on_worker(job, folder, processes):
    """Runs a job on a worker."""
    from distributed import get_worker

    worker = get_worker()
    host = worker.address.rpartition(":")[0]
    if host in processes:
        # The processes of a machine share its cores. Results do not depend on the number of threads.
        _values.share_machine(processes[host], _memory_of(worker))
    result, messages, error = _run(job, folder)
    if error is not None:
        error._messages = messages  # Dask sends the warnings with the exception
        raise error
    return result, messages


def _memory_of(worker):
    """Memory use, in bytes, at which Dask pauses the worker; 0: no limit is known."""
    limit = getattr(getattr(worker, "memory_manager", None), "memory_limit", None)
    return int(0.8 * limit) if limit else 0


def _there(jobs, folder, client):
    if not hasattr(client, "scheduler_info") or getattr(client, "asynchronous", False):
        raise _core.UsageError(
            f"map: client is a {type(client).__name__}; give a dask.distributed.Client that is not asynchronous "
            "(Debian: python3-distributed), or None to run here"
        )
    from distributed import KilledWorker

    addresses = client.scheduler_info()["workers"]
    processes = collections.Counter(
        address.rpartition(":")[0] for address in addresses if not address.startswith("inproc:")
    )
    keys = [f"levelsmith-{hashlib.sha256(f'{job.key()} {folder}'.encode()).hexdigest()}" for job in jobs]
    once = dict(zip(keys, jobs))  # equal jobs run once
    futures = dict(
        zip(once, client.map(_on_worker, list(once.values()), key=list(once), folder=folder, processes=dict(processes)))
    )
    try:
        for key in keys:
            try:
                yield (*futures[key].result(), None)
            except KilledWorker:
                yield None, [], _core.ResourceError(
                    "map: every worker that took this job died, perhaps because memory ran out; use larger voxels, "
                    "or fewer workers with more memory each"
                )
            except Exception as error:
                yield None, getattr(error, "_messages", []), error
    finally:
        for future in futures.values():
            future.release()  # cancel the remaining jobs
