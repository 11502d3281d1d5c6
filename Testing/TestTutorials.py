#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The tutorials, as their readers type them: the blocks of a page are run in the order of the page, in a folder of their own.

A block `sh` is run; a block `text` behind it is what it prints (numbers may differ by a tenth, or 0.3); a block after a line that ends with
`NAME`: is the file NAME; a block `py` is for a program that is not here, and only compiled. ./run does what it does when everything is built;
ECHORAMA is the clone.
"""
import csv
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import numpy

source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
build = pathlib.Path(os.environ["ECHORAMA_BUILD_DIR"])
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def blocks(page):
    """[(language, text, NAME or nothing)] of the fenced blocks that begin a line."""
    text = (source / "Documentation" / "tutorials" / page).read_text()
    return [(language, body, name) for name, language, body in re.findall(r"(?:`([\w./]+)`:\n\n)?^```(\w+)\n(.*?)^```$", text, re.M | re.S)]


def same_text(wanted, printed):
    """Whether each line that is wanted was printed, in this order, but for small differences of numbers."""
    lines = iter(printed.splitlines())
    for line in wanted.splitlines():
        numbers = [float(each) for each in NUMBER.findall(line)]
        for other in lines:
            found = [float(each) for each in NUMBER.findall(other)]
            if NUMBER.sub("#", other) == NUMBER.sub("#", line) and all(abs(a - b) <= max(0.3, 0.1 * abs(a)) for a, b in zip(numbers, found)):
                break
        else:
            return False
    return True


class Tutorials(unittest.TestCase):
    def run_page(self, page):
        """Runs a page; gives the folder in which it was run, and what it printed."""
        folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("TMPDIR")))
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        (folder / "run").write_text(f'#!/bin/sh\n[ "$1" = study ] || exit 2\nshift\nexec /usr/bin/python3 {source}/Applications/study/study.py "$@"\n')
        (folder / "run").chmod(0o755)
        environment = {**os.environ, "ECHORAMA": str(source), "PATH": f"{build}/bin:{os.environ['PATH']}"}
        printed, everything, ran = "", "", 0
        for language, body, name in blocks(page):
            if name:
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).write_text(body)
            elif language == "sh":
                # Whatever the clone's build tree is called here; exports hold for the blocks that follow.
                body = body.replace("$ECHORAMA/build/release", str(build))
                done = subprocess.run(["bash", "-e", "-u", "-c", f". ./exports 2>/dev/null || true\n{body}\nexport -p > exports"], cwd=folder, env=environment,
                                      stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=600)
                printed, ran = done.stdout, ran + 1
                everything += printed
                self.assertEqual(done.returncode, 0, f"{page}:\n{body}{printed}")
            elif language == "text":
                self.assertTrue(same_text(body, printed), f"{page} promises\n{body}and this was printed:\n{printed}")
            elif language == "py":
                compile(body, page, "exec")
            else:
                self.fail(f"{page}: a block of {language} that is neither run nor a file")
        self.assertGreaterEqual(ran, 2, page)
        return folder, everything

    def test_comparison_of_texts(self):
        self.assertTrue(same_text("a 1.00 b\n", "x\na 1.05 b\n"))
        self.assertFalse(same_text("a 10.0 b\n", "a 12.0 b\n"))
        self.assertFalse(same_text("aligned 1\n", "ambiguous 1\n"))
        self.assertFalse(same_text("b\na\n", "a\nb\n"))

    def test_clinician(self):
        folder, _ = self.run_page("clinician.md")
        for name in ("one.mha", "one.nii.gz", "embedded.mha", "embedded.Embedding.mha"):
            self.assertGreater((folder / name).stat().st_size, 50_000, name)

    def test_researcher(self):
        folder, printed = self.run_page("researcher.md")
        with open(folder / "pairs" / "results.csv") as stream:
            rows = {row["method"]: row for row in csv.DictReader(stream)}
        self.assertEqual(set(rows), {"start", "echorama", "rank"})
        self.assertGreater(float(rows["start"]["tre_voxels"]), 1.5)
        self.assertLess(float(rows["rank"]["tre_voxels"]), 1.0)
        self.assertNotIn("error", [key for key, value in rows["rank"].items() if value])
        self.assertIn("| rank |", printed)
        self.assertTrue((folder / "pairs" / "results.png").is_file())
        # The metric in C++, with the declaration that the page asks for where it asks for it: the same values for greys under a rising curve,
        # of mean 0 and deviation 1, and none where nothing is real.
        room = folder / "Filters" / "Registration"
        declared = (source / "Filters" / "Registration" / "Metric.h").read_text()
        self.assertEqual(declared.count("extern const Metric LocalNccMetric, NccMetric, "), 1)
        (room / "Metric.h").write_text(declared.replace("extern const Metric ", "extern const Metric RankMetric, "))
        (room / "main.cxx").write_text("""
          #include "Metric.h"
          #include <cmath>
          #include <iostream>
          #include <limits>
          int main()
          {
            std::vector<float> greys(1000), curved(1000);
            for (int i = 0; i < 1000; ++i) {
              greys[i] = i % 7 == 0 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(i * 389 % 251);
              curved[i] = std::exp(0.02f * greys[i]);
            }
            echorama::MetricLevel levels[2];
            for (int n = 0; n < 2; ++n) {
              echorama::MetricSource source;
              source.intensity = echorama::VolumeView<const float>((n ? curved : greys).data(), {10, 10, 10});
              echorama::RankMetric.see(source, levels[n]);
            }
            double sum = 0.0, squares = 0.0, real = 0.0;
            for (int i = 0; i < 1000; ++i) {
              const auto &a = levels[0].seen[i], &b = levels[1].seen[i];
              if (a.value != b.value || a.weight != b.weight || a.IsReal() == (i % 7 == 0))
                return 1;
              real += a.IsReal();
              sum += a.Value();
              squares += a.Value() * a.Value();
            }
            std::cout << sum / real << " " << std::sqrt(squares / real) << std::endl;
          }
        """)
        built = subprocess.run(["c++", "-std=c++17", "-Wall", "-Wextra", "-Werror", f"-I{source}", f"-I{source}/Filters/Registration", "-isystem", "/usr/include/eigen3",
                                room / "MetricRank.cxx", room / "main.cxx", "-o", room / "ranks"], capture_output=True, text=True)
        self.assertEqual(built.returncode, 0, built.stderr)
        ranks = subprocess.run([room / "ranks"], capture_output=True, text=True)
        self.assertEqual(ranks.returncode, 0)
        mean, deviation = map(float, ranks.stdout.split())
        self.assertAlmostEqual(mean, 0, delta=0.01)
        self.assertAlmostEqual(deviation, 1, delta=0.01)
        self.assertIn("metrics{&LocalNccMetric, ", (source / "Filters" / "Registration" / "Metric.cxx").read_text())

    def test_integrator(self):
        folder, _ = self.run_page("integrator.md")
        mosaic = numpy.load(folder / "mosaic.npy")
        self.assertGreater((mosaic > 0).mean(), 0.2)


if __name__ == "__main__":
    unittest.main()
