#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the tests of a build tree with ctest and counts single tests. What did not run has failed, whatever kept it from running.

Tests labelled `reports` leave a report of their single tests, NAME.xml in Testing/reports of the tree: GoogleTest's, QtTest's, or
that of python_test.py. Any other test counts as one. A skip that expected_skips.txt does not name is a failure. Tests labelled
`window` or `live` that fail beside others run once more by themselves, which is said at the end.
"""
import argparse
import collections
import fnmatch
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as tree

SOURCE = pathlib.Path(__file__).resolve().parents[1]
MOST_AGAIN = 5  # more than these do not fail for want of time
Case = collections.namedtuple("Case", "name outcome message")  # passed, failed or skipped, and why


class Entry:
    """One test of ctest's list."""

    def __init__(self, description):
        properties = {each["name"]: each["value"] for each in description.get("properties", [])}
        self.name = description["name"]
        self.program = description.get("command", [None])[0]
        self.labels = properties.get("LABELS", [])
        # The shards of a GoogleTest program: Room.shard1, Room.shard2 ... hold the tests Room.Suite.Test.
        self.folder = properties.get("WORKING_DIRECTORY", "")
        self.room = self.name.split(".shard")[0] if any(each.startswith("GTEST_TOTAL_SHARDS=") for each in properties.get("ENVIRONMENT", [])) else None


def told_by_sources(entry, tree, regex):
    """Whether the regular expression matches a test in the sources of a GoogleTest program, which need not be built."""
    for path in (SOURCE / pathlib.Path(entry.folder).relative_to(tree) / "Testing").glob("Test*.cxx"):
        for suite, name in re.findall(r"^(?:TYPED_)?TEST(?:_[FP])?\((\w+),\s*(\w+)\)", path.read_text(), re.MULTILINE):
            if re.search(regex, f"{entry.room}.{suite}.{name}"):
                return True
    return False


def matching(entries, options):
    """The entries that may hold a test of that name. When the sources know none, it may be made by a parameter: all programs do."""
    if not options.regex:
        return entries
    found = [entry for entry in entries
             if (told_by_sources(entry, options.tree, options.regex) if entry.room else re.search(options.regex, entry.name))]
    return found or [entry for entry in entries if entry.room]


def targets_of(entries):
    """What must be built for them."""
    targets = set()
    for entry in entries:
        if entry.room:
            targets.add(entry.room + "Tests")
        elif "benchmark" in entry.labels:
            targets.add(entry.name.replace(".", ""))
        elif "fuzz" in entry.labels:
            targets.add(entry.name.split(".")[1])
        elif "window" in entry.labels:
            targets.add(entry.name.split(".")[1] + "WindowTests")
        else:
            targets.add("all")  # scripts may start any program
    return sorted(targets)


def gtest_names(program):
    """Suite.Test of all tests in a GoogleTest program; None when it does not tell."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith("GTEST_")}
    try:
        done = subprocess.run([program, "--gtest_list_tests"], capture_output=True, text=True, timeout=120, env=clean)
    except (OSError, TypeError, subprocess.TimeoutExpired):
        return None
    names, suite = set(), None
    for line in done.stdout.splitlines():
        word = line.split("#")[0].rstrip()
        if line.startswith("  "):
            names.add(suite + word.strip())
        elif word.endswith("."):
            suite = word
    return names if done.returncode == 0 else None


def qt_cases(root):
    for function in root.iter("TestFunction"):
        rows = {}
        for event in function:
            if event.tag == "Incident" or event.get("type") == "skip":
                rows.setdefault(event.findtext("DataTag"), []).append((event.get("type"), event.findtext("Description") or ""))
        for row, events in (rows or {None: [("fail", "it did not end")]}).items():
            worst = min(events, key=lambda event: {"skip": 1, "pass": 2, "xfail": 2, "bpass": 2}.get(event[0], 0))
            outcome = {"skip": "skipped", "pass": "passed", "xfail": "passed", "bpass": "passed"}.get(worst[0], "failed")
            name = function.get("name")
            if name not in ("initTestCase", "cleanupTestCase") or outcome != "passed":  # no tests, as long as they succeed
                yield Case(f"{name}({row})" if row else name, outcome, worst[1])


def junit_cases(root):
    for case in root.iter("testcase"):
        name = ".".join(part for part in (case.get("classname"), case.get("name")) if part)
        failure, skip = case.find("failure"), case.find("skipped")
        if failure is None:
            failure = case.find("error")
        if failure is not None:
            yield Case(name, "failed", failure.get("message", ""))
        elif skip is not None or case.get("status") == "notrun":
            yield Case(name, "skipped", "disabled" if skip is None else skip.get("message", ""))
        else:
            yield Case(name, "passed", "")


def reported(path):
    """The single tests of a report; None when it is not there, or not whole."""
    try:
        root = tree.parse(path).getroot()
    except (OSError, tree.ParseError):
        return None
    return list(qt_cases(root) if root.tag == "TestCase" else junit_cases(root))


class ExpectedSkips:
    def __init__(self, path, build_tree, data):
        release = pathlib.Path("/etc/os-release")
        holds = {"always": True, "no-data": not data.is_dir(), "root": os.geteuid() == 0,
                 "not-bookworm": not (release.is_file() and "bookworm" in release.read_text())}
        self.lines = []
        for line in path.read_text().splitlines():
            if line.strip() and not line.startswith("#"):
                where, pattern, when, text = line.split(None, 3)
                if holds[when] and where in ("*", build_tree):
                    self.lines.append((pattern, text))

    def __contains__(self, case):
        return any(fnmatch.fnmatchcase(case.name, pattern) and text in case.message for pattern, text in self.lines)


class Count:
    def __init__(self, skips):
        self.skips = skips
        self.passed, self.failed, self.skipped = 0, [], []
        self.alone = []  # what failed beside others and passed by itself

    def add(self, case):
        if case.outcome == "passed":
            self.passed += 1
        elif case.outcome == "failed":
            self.fail(case.name, case.message)
        elif case in self.skips:
            self.skipped.append(case)
        else:
            self.fail(case.name, "skipped, and that is not expected: " + (case.message.strip() or "it does not say why"))

    def fail(self, name, why):
        self.failed.append(Case(name, "failed", why))


def of_ctest(case, name):
    """What ctest says of one test."""
    if case is None:
        return Case(name, "failed", "ctest did not run it")
    status = case.get("status")
    if status == "run":
        return Case(name, "passed", "")
    skip, failure = case.find("skipped"), case.find("failure")
    if status == "notrun" and skip is not None and skip.get("message", "").startswith("SKIP_RETURN_CODE"):
        return Case(name, "skipped", case.findtext("system-out") or "")
    if failure is not None:
        last = (case.findtext("system-out") or "").strip().splitlines()[-1:]
        return Case(name, "failed", " ".join([f"it ended badly after {float(case.get('time', 0)):.1f} s", *last]))
    return Case(name, "failed", (skip.get("message") if skip is not None else "") or f"ctest says: {status}")


def count_entry(entry, verdict, reports, filtered, count):
    """Adds the tests of one entry; gives the names of those reported."""
    if "reports" not in entry.labels:
        count.add(verdict)
        return set()
    cases = reported(reports / f"{entry.name}.xml")
    if cases is None:
        count.fail(entry.name, "it left no report of its tests" + (f"; {verdict.message}" if verdict.outcome == "failed" else ""))
        return set()
    before = len(count.failed)
    if not cases and not filtered:
        count.fail(entry.name, "it has no tests")  # later Pythons' unittest also fails then: that is not counted twice
    for case in cases:
        if not case.name:  # a script that is one test
            case = case._replace(name=entry.name, message=case.message or verdict.message)
        else:
            case = case._replace(name=f"{entry.room or entry.name}.{case.name}")
        count.add(case)
    if verdict.outcome == "failed" and len(count.failed) == before:
        count.fail(entry.name, f"no test of it failed, but the program did; {verdict.message}")
    return {case.name for case in cases}


def listed_by_ctest(tree):
    """The entries of a build tree; raises ValueError where there is none."""
    listed = subprocess.run(["ctest", "--test-dir", str(tree), "--show-only=json-v1"], capture_output=True, text=True)
    try:
        return [Entry(each) for each in json.loads(listed.stdout)["tests"]]
    except (ValueError, KeyError):
        raise ValueError(f"ctest lists no tests; {listed.stderr.strip()}") from None


def run_ctest(options, entries, environment, jobs):
    """What ctest says of each test, by name, and its exit status."""
    with tempfile.TemporaryDirectory(prefix="echorama-tests-", ignore_cleanup_errors=True) as folder:
        junit = pathlib.Path(folder, "ctest.xml")
        only = "^(" + "|".join(re.escape(entry.name) for entry in entries) + ")$"
        status = subprocess.run(["ctest", "--test-dir", str(options.tree), "-j", str(jobs), "--output-on-failure", "--no-tests=error",
                                 "--output-junit", str(junit), "--test-output-size-passed", "100000", "-R", only],
                                env={**environment, "TMPDIR": folder}).returncode  # what a killed test leaves goes with it
        try:
            return {case.get("name"): case for case in tree.parse(junit).getroot().iter("testcase")}, status
        except (OSError, tree.ParseError):
            return {}, status


def run(options, count):
    try:
        entries = listed_by_ctest(options.tree)
    except ValueError as problem:
        return count.fail(options.tree.name, str(problem))
    if len({entry.name for entry in entries}) != len(entries):
        count.fail(options.tree.name, "two tests have the same name")
    entries = [entry for entry in entries if not set(options.without) & set(entry.labels)]
    if not entries:
        return count.fail(options.tree.name, "there are no tests")
    entries = matching(entries, options)

    # The GoogleTest programs tell what they hold, so that what did not run shows.
    wanted = {}
    for room, program in {entry.room: entry.program for entry in entries if entry.room}.items():
        names = gtest_names(program)
        if names is None:
            count.fail(room, f"{program} does not list its tests" if program else "its test program is not there")
        wanted[room] = {name for name in names or () if not options.regex or re.search(options.regex, f"{room}.{name}")}
    environment = dict(os.environ)
    environment.pop("GTEST_FILTER", None)
    if options.regex:
        entries = [entry for entry in entries if (wanted[entry.room] if entry.room else re.search(options.regex, entry.name))]
        environment["GTEST_FILTER"] = ":".join(name for names in wanted.values() for name in names)
    if not entries:
        return None  # the caller asks other trees, too

    reports = options.tree / "Testing" / "reports"
    reports.mkdir(parents=True, exist_ok=True)
    for old in reports.glob("*.xml"):
        old.unlink()
    told, status = run_ctest(options, entries, environment, options.jobs)

    # What a window or a live device waits for comes late where much else runs: those tests have a second try, alone, and the list says so.
    failed = [entry for entry in entries if of_ctest(told.get(entry.name), entry.name).outcome == "failed"]
    again = [entry for entry in failed if {"window", "live"} & set(entry.labels) and entry.name in told]
    if 0 < len(again) <= MOST_AGAIN:
        for entry in again:
            (reports / f"{entry.name}.xml").unlink(missing_ok=True)
        print(f"\n{options.tree.name}: once more, by themselves: {', '.join(entry.name for entry in again)}", flush=True)
        told_again, status_again = run_ctest(options, again, environment, 1)
        told.update(told_again)
        count.alone = [entry.name for entry in again if of_ctest(told_again.get(entry.name), entry.name).outcome != "failed"]
        if len(again) == len(failed):
            status = status_again

    ran = collections.defaultdict(set)
    for entry in entries:
        verdict = of_ctest(told.get(entry.name), entry.name)
        ran[entry.room] |= count_entry(entry, verdict, reports, options.regex, count)
    for room, names in wanted.items():
        for name in sorted(names - ran[room]):
            count.fail(f"{room}.{name}", "it did not run")
    if status != 0 and not count.failed:
        count.fail(options.tree.name, f"ctest ended with status {status}")
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tree", type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("-R", dest="regex", help="only tests whose name matches, those inside the GoogleTest programs by theirs (Room.Suite.Test)")
    parser.add_argument("-j", dest="jobs", type=int, default=len(os.sched_getaffinity(0)) + 1)  # many wait for a window, a device or the clock
    parser.add_argument("--without", action="append", default=[], metavar="LABEL")
    parser.add_argument("--counts", type=pathlib.Path, metavar="FILE", help="write the three numbers there, too")
    parser.add_argument("--skips", type=pathlib.Path, default=SOURCE / "Testing" / "expected_skips.txt")
    parser.add_argument("--data", type=pathlib.Path, default=SOURCE.parent / "shared" / "data", help="where real data would be")
    parser.add_argument("--targets", action="store_true", help="run nothing; say what must be built for the tests that match")
    options = parser.parse_args()

    if options.targets:
        entries = [entry for entry in listed_by_ctest(options.tree) if not set(options.without) & set(entry.labels)]
        print(*targets_of(matching(entries, options)), sep="\n")
        return 0
    count = Count(ExpectedSkips(options.skips, options.tree.name, options.data))
    run(options, count)
    for title, cases in (("skipped, as expected", count.skipped), ("failed", count.failed)):
        if cases:
            print(f"\n{options.tree.name}: {title}:")
            for case in cases:
                print(f"  {case.name}: {' '.join(case.message.split())[:300]}")
    if count.alone:
        print(f"\n{options.tree.name}: passed by themselves only: {', '.join(count.alone)}")
    print(f"{options.tree.name}: {count.passed} passed, {len(count.failed)} failed, {len(count.skipped)} skipped", flush=True)
    if options.counts:
        options.counts.write_text(f"{count.passed} {len(count.failed)} {len(count.skipped)}\n")
    return 1 if count.failed else 0


if __name__ == "__main__":
    sys.exit(main())
