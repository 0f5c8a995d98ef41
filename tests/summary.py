#!/usr/bin/env python3
"""Counts the test cases of a ctest run and lists those that were skipped, with the reason.

summary.py BUILD JUNIT-FILE [--complete]

The last line is `N passed, M failed, K skipped`. A skip is an error in CI (CI=true). --complete: also counts as
skipped the executables and modules that are missing, for example since a package was not found.
"""

import os
import re
import sys
import xml.etree.ElementTree as ElementTree

EXPECTED = ("levelset_tests.", "mapping_tests.", "render_tests.", "apps_tests.", "viewer_tests.", "fuzz_tests.",
            "convert_cgal_tests.", "geodesic_cgal_tests.", "python.", "fuzz.", "golden_chains", "consumer")


def outputs(log):
    """Output of each test, by name, from LastTest.log."""
    parts = re.split(r"^\d+/\d+ Testing: (.*)$", log, flags=re.M)
    return dict(zip(parts[1::2], parts[2::2]))


def skips_in(name, text):
    """(case, reason) of each skip that Googletest or pytest report inside one ctest test."""
    cases = re.split(r"^\[ RUN +\] (\S+)", text, flags=re.M)
    for case, body in zip(cases[1::2], cases[2::2]):
        if re.search(r"^\[  SKIPPED \] " + re.escape(case) + r"(?: \(|$)", body, re.M):
            reason = re.search(r": Skipped\n(.*)", body)
            yield case, reason.group(1) if reason else "no reason given"
    for line in re.findall(r"^SKIPPED (.*)$", text, re.M):
        yield name, line


def cases_in(text):
    """Numbers of passed and failed cases inside one ctest test."""
    def number(pattern):
        return sum(int(n) for n in re.findall(pattern, text, re.M))

    passed = number(r"^\[  PASSED  \] (\d+) tests?\.$") + number(r"^(?:.*, )?(\d+) passed.* in [\d.]+s")
    failed = number(r"^\[  FAILED  \] (\d+) tests?, listed") + number(r"^(?:.*, )?(\d+) (?:failed|errors?).* in [\d.]+s")
    return passed, failed


def main():
    build, junit = sys.argv[1:3]
    with open(os.path.join(build, "Testing/Temporary/LastTest.log"), encoding="utf-8", errors="replace") as log:
        texts = outputs(log.read())
    passed, failed, skipped, names = 0, 0, [], []
    for test in ElementTree.parse(junit).getroot().iter("testcase"):
        name, status = test.get("name"), test.get("status")
        names.append(name)
        text = texts.get(name, "")
        if status == "notrun":
            reason = test.find("skipped")
            skipped.append((name, reason.get("message", "") if reason is not None else "not run"))
            continue
        inside = list(skips_in(name, text))
        skipped += inside
        good, bad = cases_in(text)
        if status == "run":
            passed += good or (0 if inside else 1)
            failed += bad
        else:
            passed += good
            failed += bad or 1
    if "--complete" in sys.argv:
        skipped += [(group + "*", "not built") for group in EXPECTED
                    if not any(name.startswith(group) for name in names)]
    for name, reason in skipped:
        print(f"skipped: {name}: {reason}")
    print(f"{passed} passed, {failed} failed, {len(skipped)} skipped")
    return 1 if failed or (skipped and os.environ.get("CI") == "true") else 0


sys.exit(main())
