#!/usr/bin/env python3
"""Mutation check: do the fast tests fail when a constant or a sign of the numerics is wrong?

run.py WORK [--only WORD] [--list]

Copies the sources to WORK/tree, builds the tests there, and applies the mutants of mutants.tsv to the copy one at a
time. For each it rebuilds and runs, up to the first failure, the suites that should fail, the other fast tests of the
module, and the quick regression suite. Exit code 1 unless at least 27 of the 30 are caught. A second run in the same
WORK is incremental.
"""

import argparse
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
SOURCE = HERE.parent.parent
NEEDED = 27  # of 30
CPU_LIMIT = 1200  # seconds of CPU, three times what the slowest module takes: a mutant that never ends is caught
LEFT_OUT = {"build", "demo", ".git", "__pycache__"}


def read_mutants():
    mutants = []
    for line in (HERE / "mutants.tsv").read_text().splitlines():
        if line.startswith("#"):
            continue
        file, old, new, tests, meaning = line.split("\t")
        executable, suites = tests.split(":")
        count = (SOURCE / file).read_text().count(old) if (SOURCE / file).exists() else 0
        if count != 1:
            sys.exit(f"{file}: '{old}' occurs {count} times; correct mutants.tsv")
        mutants.append((file, old, new, executable, suites.split(","), meaning))
    return mutants


def synchronise(tree):
    """Copies what differs, so that the build sees no change in the rest."""
    kept = set()
    for folder, folders, files in os.walk(SOURCE):
        folders[:] = [name for name in folders if name not in LEFT_OUT]
        for name in files:
            source = Path(folder) / name
            target = tree / source.relative_to(SOURCE)
            kept.add(target)
            if not source.exists() or (target.exists() and target.read_bytes() == source.read_bytes()):
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target)
    for folder, _, files in os.walk(tree):
        for name in files:
            if Path(folder) / name not in kept:
                (Path(folder) / name).unlink()


def run(command, limit=None):
    """Returns the exit code and the output. `limit`: seconds of CPU, so that a busy machine changes no result."""
    def restrict():
        if limit:
            resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 10))

    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, preexec_fn=restrict)
    return done.returncode, done.stdout.decode(errors="replace")


def configure(tree, build, mutants):
    files = sorted({mutant[0] for mutant in mutants if mutant[0].endswith(".cpp")})
    command = ["cmake", "-G", "Ninja", "-S", tree, "-B", build, "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_UNITY_BUILD=ON",
               "-DCMAKE_UNITY_BUILD_BATCH_SIZE=16", "-DLEVELSMITH_APPS=ON", "-DLEVELSMITH_PYTHON=OFF",
               "-DLEVELSMITH_VIEWER=OFF", "-DLEVELSMITH_MUTATED=" + ";".join(files),
               f"-DCMAKE_PROJECT_Levelsmith_INCLUDE={tree}/tests/mutation/alone.cmake"]
    if shutil.which("ccache"):
        command.append("-DCMAKE_CXX_COMPILER_LAUNCHER=ccache")
    code, output = run(command)
    if code != 0:
        sys.exit(output)


def compile_tests(build, executables):
    code, output = run(["cmake", "--build", build, "-j2", "--target", *executables])
    return code == 0, output


def failure(build, executable, suites, others):
    """Name of the first test that fails, or an empty string. `others`: all fast tests but those of `suites`."""
    names = ":".join(f"{suite}.*:*/{suite}.*" for suite in suites)
    chosen = f"-Slow*:{names}" if others else names
    code, output = run([build / "tests" / executable, "--gtest_brief=1", "--gtest_fail_fast", f"--gtest_filter={chosen}"],
                       CPU_LIMIT)
    if code == 0:
        return ""
    if code == -signal.SIGXCPU:
        return "CPU limit"
    found = re.search(r"\[  FAILED  \] ([\w/.]+)", output)
    return found.group(1) if found else f"exit code {code}"


def regression_failure(build):
    """Bound of the quick regression suite that is missed, or an empty string."""
    code, output = run([build / "apps/levelsmith", "--quiet", "regress", "--budget", "quick", "--no-plots", "--out",
                        build / "regression"], CPU_LIMIT)
    return "" if code == 0 else "regress: " + (output.strip().splitlines() or [f"exit code {code}"])[-1][:100]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("work", type=Path)
    parser.add_argument("--only", action="append", default=[], help="mutants whose line contains this text")
    parser.add_argument("--list", action="store_true", help="check mutants.tsv against the sources only")
    arguments = parser.parse_args()
    mutants = read_mutants()
    if arguments.list:
        print(len(mutants), "mutants, each matches once")
        return 0
    work = arguments.work.resolve()
    tree, build = work / "tree", work / "build"
    os.environ.setdefault("CCACHE_BASEDIR", str(work))
    begin = time.time()
    synchronise(tree)
    configure(tree, build, mutants)
    if arguments.only:
        mutants = [mutant for mutant in mutants if any(text in "\t".join(map(str, mutant)) for text in arguments.only)]
    executables = sorted({mutant[3] for mutant in mutants})
    built, output = compile_tests(build, [*executables, "levelsmith"])
    if not built:
        sys.exit(output)
    print(f"built in {time.time() - begin:.0f} s", flush=True)
    for executable in executables:
        suites = sorted({suite for mutant in mutants if mutant[3] == executable for suite in mutant[4]})
        name = failure(build, executable, suites, False)
        if name:
            sys.exit(f"{name} fails without a mutant; correct that first")
    name = regression_failure(build)
    if name:
        sys.exit(f"{name} without a mutant; correct that first")
    caught = 0
    for number, (file, old, new, executable, suites, meaning) in enumerate(mutants, 1):
        path = tree / file
        original = path.read_text()
        begin = time.time()
        try:
            path.write_text(original.replace(old, new))
            built, output = compile_tests(build, [executable])
            if not built:
                sys.exit(f"{file}: '{new}' does not compile\n{output}")
            middle = time.time()
            name = failure(build, executable, suites, False) or failure(build, executable, suites, True)
            if not name and not executable.startswith("render"):
                built, output = compile_tests(build, ["levelsmith"])
                name = regression_failure(build) if built else sys.exit(output)
        finally:
            path.write_text(original)
        caught += bool(name)
        print(f"{number:2}/{len(mutants)} {'caught  ' if name else 'SURVIVED'} build {middle - begin:3.0f} s "
              f"tests {time.time() - middle:4.0f} s  {file}: {meaning}{' [' + name + ']' if name else ''}", flush=True)
    needed = NEEDED if not arguments.only else len(mutants)
    print(f"{caught} of {len(mutants)} mutants caught, {needed} needed")
    return 0 if caught >= needed else 1


if __name__ == "__main__":
    sys.exit(main())
