#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""python_test.py REPORT FILE [args...]: runs a Python test and reports its single tests, as run_tests.py reads them.

FILE is a unittest, or a script that is one test (exit status 77: skipped). It works in a folder of its own that is gone afterwards.
"""
import os
import runpy
import sys
import tempfile
import unittest
import xml.etree.ElementTree as tree

results = None  # of a unittest: {name: (outcome, message)}


class Recorder(unittest.TextTestResult):
    def startTestRun(self):
        global results
        results = {}
        super().startTestRun()

    def record(self, test, outcome, message=""):
        name = test.id().replace("__main__.", "")
        if results.get(name, ("passed",))[0] != "failure":  # of one test several parts may fail
            results[name] = (outcome, message)

    def addSuccess(self, test):
        self.record(test, "passed")
        super().addSuccess(test)

    def addExpectedFailure(self, test, error):
        self.record(test, "passed")
        super().addExpectedFailure(test, error)

    def addFailure(self, test, error):
        self.record(test, "failure", str(error[1]))
        super().addFailure(test, error)

    def addError(self, test, error):
        self.record(test, "failure", repr(error[1]))
        super().addError(test, error)

    def addUnexpectedSuccess(self, test):
        self.record(test, "failure", "it was expected to fail")
        super().addUnexpectedSuccess(test)

    def addSubTest(self, test, part, error):
        if error is not None:
            self.record(test, "failure", f"{part}: {error[1]}")
        super().addSubTest(test, part, error)

    def addSkip(self, test, reason):
        self.record(test, "skipped", reason)
        super().addSkip(test, reason)


def write(path, cases):
    suite = tree.Element("testsuite")
    for name, (outcome, message) in cases.items():
        case = tree.SubElement(suite, "testcase", name=name)
        if outcome != "passed":
            # XML knows no control characters.
            tree.SubElement(case, outcome, message="".join(c if c.isprintable() or c == "\n" else "?" for c in message))
    tree.ElementTree(suite).write(path)


def main(report, file, *arguments):
    unittest.TextTestRunner.resultclass = Recorder
    sys.argv = [file, *arguments]
    sys.path[0] = os.path.dirname(file)
    status, why = 1, ""
    with tempfile.TemporaryDirectory(prefix="echorama-", ignore_cleanup_errors=True) as folder:
        os.environ["TMPDIR"] = tempfile.tempdir = folder
        os.chdir(folder)
        try:
            runpy.run_path(file, run_name="__main__")
            status = 0
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
            why = f"exit status {status}" if status == end.code else str(end.code)
            raise
        except BaseException as error:
            why = repr(error)
            raise
        finally:
            os.chdir("/")
            tempfile.tempdir = None
            outcome = {0: "passed", 77: "skipped"}.get(status, "failure")
            write(report, {"": (outcome, why if outcome == "failure" else "")} if results is None else results)


if __name__ == "__main__":
    main(*sys.argv[1:])
