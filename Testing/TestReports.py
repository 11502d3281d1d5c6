#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The tables that ./run bench --report fills: those of the pages are as new as their kernels, and a filled table is what was measured."""
import os
import pathlib
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "Testing"))
import report_benchmarks

PAGE = """Before.

<!-- bench some other
kernels: Core/Imaging/DistanceMap.cxx
only: bench == "some"
row: {case} | {ours.seconds:.2f} | {theirs.seconds / ours.seconds:.1f}
by: method
only: bench == "other"
row: {method} | {seconds:.0f} | -
-->
| mask | s | ratio |
| --- | --- | --- |
| stale | 1 | 1 |
<!-- end bench 000000000000 -->

After.
"""
LINES = [{"bench": "some", "case": "a", "method": "ours", "seconds": 0.5}, {"bench": "some", "case": "a", "method": "theirs, old", "seconds": 4.0},
         {"bench": "some", "case": "b", "method": "ours", "seconds": 0.25}, {"bench": "some", "case": "b", "method": "theirs, old", "seconds": 1.0},
         {"bench": "other", "case": "c", "method": "third", "seconds": 7.0}]


class Reports(unittest.TestCase):
    def table(self, text):
        page = pathlib.Path(tempfile.mkdtemp()) / "page.md"
        self.addCleanup(lambda: (page.unlink(), page.parent.rmdir()))
        page.write_text(text)
        return report_benchmarks.Table(page, report_benchmarks.TABLE.search(text))

    def test_no_table_is_older_than_what_it_measures(self):
        self.assertTrue(report_benchmarks.tables())
        old = [str(table) for table in report_benchmarks.tables() if table.stamp != table.digest()]
        self.assertEqual(old, [], "./run bench --report fills them")

    def test_rows_are_what_was_measured(self):
        table = self.table(PAGE)
        self.assertNotEqual(table.stamp, table.digest())
        text = PAGE[:table.begin] + table.filled(LINES, "Commit 1") + PAGE[table.end:]
        self.assertIn("| a | 0.50 | 8.0 |\n| b | 0.25 | 4.0 |\n| third | 7 | - |\n\n*Commit 1: `./run bench --report some other`*\n", text)
        self.assertNotIn("stale", text)
        self.assertTrue(text.startswith("Before.") and text.endswith("After.\n"))
        again = self.table(text)
        self.assertEqual(again.stamp, again.digest())

    def test_what_cannot_be_filled_is_said(self):
        for page, lines in ((PAGE, LINES[:2]), (PAGE.replace("{ours.", "{nobody."), LINES)):
            with self.assertRaises(SystemExit) as told:
                self.table(page).filled(lines, "")
            self.assertIn("page.md", str(told.exception))
        with self.assertRaises(SystemExit):
            self.table(PAGE.replace("DistanceMap.cxx", "NoSuchKernel.cxx")).digest()


if __name__ == "__main__":
    unittest.main()
