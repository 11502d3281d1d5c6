#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The tables that ./run bench --report fills: those of the pages are as new as their kernels, and a filled table is what was measured."""
import os
import pathlib
import sys
import tempfile
import unittest
import unittest.mock

SOURCE = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "Testing"))
import compare_benchmarks
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

    def test_memory_gets_a_column_of_its_own_once(self):
        lines = [{**line, "peak_mb": 1000.0 * (number + 1)} for number, line in enumerate(LINES)]
        table = self.table(PAGE)
        once = PAGE[:table.begin] + table.filled(lines, "") + PAGE[table.end:]
        self.assertIn("| mask | s | ratio | peak, MB |\n| --- | --- | --- | --- |\n| a | 0.50 | 8.0 | 1,000 |\n| b | 0.25 | 4.0 | 3,000 |\n| third | 7 | - | 5,000 |\n", once)
        table = self.table(once)
        self.assertEqual(once[:table.begin] + table.filled(lines, "") + once[table.end:], once)
        telling = self.table(PAGE.replace("{seconds:.0f}", "{peak_mb:.0f}"))  # for itself
        self.assertIn("| mask | s | ratio |\n| --- | --- | --- |\n| a | 0.50 | 8.0 |\n", telling.filled(lines, ""))

    def test_columns_of_cpus(self):
        lines = LINES[:2]
        faster = [{**line, "seconds": line["seconds"] / (2 + number)} for number, line in enumerate(lines)]
        self.assertEqual(compare_benchmarks.table({"v2": lines, "v3": faster}),
                         [["case", "method", "v2", "v3"], ["a", "ours", "0.5 s", "0.25 s (2.00)"], ["a", "theirs, old", "4 s", "1.33 s (3.00)"]])
        with self.assertRaises(SystemExit):
            compare_benchmarks.table({"v2": lines, "v3": lines[::-1]})
        with self.assertRaises(SystemExit):
            compare_benchmarks.table({"v2": lines, "v3": lines[:1]})

    def test_the_fastest_run_of_each_row_counts(self):
        def run(*seconds):
            return [{"case": f"row {row}", "method": "ours", "seconds": value} for row, value in enumerate(seconds)]
        columns = compare_benchmarks.fastest([("v2", run(3.0, 5.0)), ("v4", run(2.0, 2.0)), ("v2", run(4.0, 4.0)), ("v4", run(1.0, 3.0))])
        self.assertEqual(columns, {"v2": run(3.0, 4.0), "v4": run(1.0, 2.0)})
        with self.assertRaises(SystemExit):
            compare_benchmarks.fastest([("v2", run(3.0, 5.0)), ("v2", run(3.0))])

    def test_kernels_of_packages_beside_those_for_this_machine(self):
        times = ((9.0, 9.0, 9.0, 9.0), (3.0, 2.1, 9.0, 1.0), (2.0, 2.0, 10.0, 0.0))
        columns = [[{"case": f"row {row}", "method": "ours", "seconds": value} for row, value in enumerate(seconds)] for seconds in times]
        self.assertEqual(compare_benchmarks.packaged(columns),
                         "kernels of packages take 1.05 times as long as those tuned for this machine (median), at most 1.50 times "
                         "(row 0 ours); 1 of 3 rows more than 1.1 times")
        self.assertIn("nothing was timed", compare_benchmarks.packaged([[], []]))

    def test_what_makes_a_table_old(self):
        with tempfile.TemporaryDirectory() as name, unittest.mock.patch.object(report_benchmarks, "source", pathlib.Path(name)):
            kernel, header = (pathlib.Path(name) / "Core/Imaging" / f"DistanceMap{end}" for end in (".cxx", ".h"))
            kernel.parent.mkdir(parents=True)
            kernel.write_text("int a = 1; // one\n")
            table = self.table(PAGE)
            digests = [table.digest()]
            for file, text in ((kernel, "int a = 2; // one\n"), (header, "constexpr int b = 1;\n"), (header, "constexpr int b = 2;\n")):
                file.write_text(text)
                digests.append(table.digest())
            self.assertEqual(len(set(digests)), len(digests))
            kernel.write_text("// two\n#include \"Core/Elsewhere/Other.h\"\nint a =\n  2;")  # a file that moved, and the same to a compiler
            self.assertEqual(table.digest(), digests[-1])

    def test_a_program_is_run_again_when_it_has_changed(self):
        with tempfile.TemporaryDirectory() as name, unittest.mock.patch.object(report_benchmarks, "wait_until_quiet", lambda limit: True), \
                unittest.mock.patch.object(report_benchmarks, "identity", lambda program: program.read_text()):
            program = pathlib.Path(name) / "BenchmarkSome"

            def write(case):
                program.write_text(f"#!/bin/sh\necho '{{\"case\": \"{case}\"}}'; date +%N >> {name}/runs\n")
                program.chmod(0o755)

            def case(again=False):
                return report_benchmarks.measured(program, 0, again)["lines"][0]["case"], len((pathlib.Path(name) / "runs").read_text().split())
            write("a")
            self.assertEqual([case(), case(), case(again=True)], [("a", 1), ("a", 1), ("a", 2)])
            write("b")
            self.assertEqual(case(), ("b", 3))
            with unittest.mock.patch.object(report_benchmarks, "wait_until_quiet", lambda limit: False):
                case(again=True)
            self.assertEqual(case(), ("b", 5))  # what was measured beside other work is measured again

    def test_what_cannot_be_filled_is_said(self):
        for page, lines in ((PAGE, LINES[:2]), (PAGE.replace("{ours.", "{nobody."), LINES)):
            with self.assertRaises(SystemExit) as told:
                self.table(page).filled(lines, "")
            self.assertIn("page.md", str(told.exception))
        with self.assertRaises(SystemExit):
            self.table(PAGE.replace("DistanceMap.cxx", "NoSuchKernel.cxx")).digest()


if __name__ == "__main__":
    unittest.main()
