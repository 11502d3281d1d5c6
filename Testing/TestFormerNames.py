#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Former names of renamed parameters: on the command line, of a command that is a stand-in, and in what is generated."""
import json
import os
import pathlib
import sys
import unittest

from program_under_test import SOURCE, run

sys.path.append(str(SOURCE / "Plugin"))
import generate_parameters

RENAMED = pathlib.Path(os.environ["ECHORAMA_BUILD_DIR"]) / "Testing" / "renamed"


def renamed(*words):
    return run("noise", *words, env={**os.environ, "LD_LIBRARY_PATH": str(RENAMED)})


class CommandLine(unittest.TestCase):
    def value(self, *words):
        done = renamed("--json", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout), done.stderr

    def test_former_names_set_and_warn(self):
        for words, key, wanted, warning in (
                (["--size-mm", "7.5"], "lengthMm", 7.5, "--size-mm is now --length-mm; the former name goes in version 9.1"),
                (["--size_mm=7.5"], "lengthMm", 7.5, "--size-mm is now --length-mm; the former name goes in version 9.1"),
                (["--position", "1", "2", "3"], "place", [1, 2, 3], "--position is now --place; the former name goes in version 9.2"),
                (["--quick"], "isFast", True, "--quick is now --is-fast; the former name goes in version 9.3"),
                (["--no-secure"], "isSafe", False, "--no-secure is now --no-is-safe; the former name goes in version 9.4")):
            values, told = self.value(*words)
            self.assertEqual((values[key], told), (wanted, f"echorama: warning: {warning}\n"), words)
        for words, key, wanted in ((["--length-mm", "7.5"], "lengthMm", 7.5), (["--is-fast"], "isFast", True), (["--no-is-safe"], "isSafe", False)):
            values, told = self.value(*words)
            self.assertEqual((values[key], told), (wanted, ""), words)
        self.assertEqual(self.value()[0]["isSafe"], True)

    def test_what_is_refused(self):
        for words, reason in ((["--size-mm", "70"], "SizeMm is 70 mm"), (["--size-mm", "1", "--length-mm", "2"], "--length-mm"),
                              (["--edge-mm", "2"], "--edge-mm")):  # its flag was --spacing all the time
            done = renamed(*words)
            self.assertEqual(done.returncode, 2, (words, done.stderr))
            self.assertIn(reason, done.stderr)

    def test_nothing_lists_them(self):
        for word in ("--help", "--man", "--xml"):
            text = renamed(word).stdout.replace("\\-", "-")
            self.assertRegex(text, "length[-_]mm")
            self.assertNotRegex(text, "size[-_]mm|position|quick|secure")


class Generated(unittest.TestCase):
    ONE = {"name": "LengthMm", "label": "Length Mm", "type": "number", "value": 1.5, "help": "How long.", "formerly": [{"name": "SizeMm", "until": "9.1"}]}

    def test_setters_of_both_names(self):
        text = generate_parameters.setters(self.ONE)
        self.assertIn("  vtkUltrasoundNumberMacro(LengthMm);\n", text)
        self.assertIn("  /** \\deprecated LengthMm now; goes in version 9.1. */\n  vtkUltrasoundNumberMacro(SizeMm);", text)
        choice = {**self.ONE, "type": "choice", "value": 0, "choices": ["a", "b"]}
        self.assertIn("vtkUltrasoundChoiceMacro(SizeMm);", generate_parameters.setters(choice))
        for made in (generate_parameters.property_of(self.ONE, [self.ONE]), generate_parameters.table_of([self.ONE])):
            self.assertNotIn("SizeMm", made)

    def test_they_go_in_the_version_that_was_told(self):
        kept = generate_parameters.described
        try:
            generate_parameters.described = lambda name: [self.ONE]
            self.assertEqual(generate_parameters.overdue("vtkUltrasoundThing", "9.0.12"), [])
            for version in ("9.1", "9.1.0", "9.10", "10.0"):
                told = generate_parameters.overdue("vtkUltrasoundThing", version)
                self.assertEqual(len(told), 1, version)
                self.assertIn("LengthMm is no longer to be called SizeMm", told[0])
        finally:
            generate_parameters.described = kept


if __name__ == "__main__":
    unittest.main()
