#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The demo of surface tracking, coarse: a skin is made, calibrated and tracked, and the report tells what the recordings hold."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
sys.path.insert(0, str(source / "Applications" / "demo"))
from surface import TOOLS, read_paths  # noqa: E402


def check(truth, what):
    if not truth:
        sys.exit(f"TestDemoSurface: {what}")


with tempfile.TemporaryDirectory() as folder:
    out = pathlib.Path(folder) / "a belly"
    made = subprocess.run(["/usr/bin/python3", source / "Applications" / "demo" / "demo.py", "--program",
                           pathlib.Path(os.environ["ECHORAMA_BUILD_DIR"]) / "bin" / "echorama", "--out", out, "--quick", "--surface"],
                          capture_output=True, text=True)
    check(made.returncode == 0, f"the demo failed:\n{made.stderr}")
    told = re.search(r"map +([\d.]+) mm off in the median at left-out points, ([\d.]+) mm in 95%\n"
                     r"tools +([\d.]+) mm off in the median, ([\d.]+) mm in 95%; at 200 mm/s ([\d.]+) mm in 95%\n"
                     r"claims +(\d+) places of a light that was not there; ([\d.]+)% ", made.stdout)
    check(told, f"no figures in {made.stdout!r}")
    map_median, map_95, median, most, fast, claims, missed = (float(number) for number in told.groups())
    check(map_median < 0.2 and map_95 < 0.5, f"the map: {told[0]}")
    check(median < 0.2 and most < 0.5 and fast < 1.0, f"the tools: {told[0]}")

    check(missed < 15, f"{missed}% of the places are missing")

    # The figures are those of the recordings, and places and truth are not the same numbers.
    paths = read_paths(out / "wander.igs.mha")
    errors = np.concatenate([path.errors()[path.both()] for path in paths.values()])
    check(len(errors) > 1000 and abs(np.median(errors) - median) < 0.006, f"{np.median(errors)} of {len(errors)} places, {median} were told")
    check(0.001 < errors.min() + errors.max() and len(np.unique(errors)) > 0.9 * len(errors), "places are the truth itself")
    lifted = read_paths(out / "fast.igs.mha")
    check(all(np.count_nonzero(~np.isfinite(lifted[tool].truth[:, 0])) > 20 for tool in TOOLS), "no tool was lifted off")
    check(claims <= 3 * sum(np.count_nonzero(np.diff(np.isfinite(lifted[tool].truth[:, 0]).astype(int)) < 0) for tool in TOOLS),
          f"{claims} places were told of lights that were not there")

    report = (out / "surface.html").read_text()
    check(report.count('src="data:image/png;base64,') == 4, "the report does not hold its four pictures")
    check("$" not in re.sub(r"base64,[^\"]*", "", report), "a place of the template was not filled")
    check(f"{told[2]}&nbsp;mm in 95%" in report, "the report does not tell the map's error")
    for name in ("skin.stl", "base.stl", "shell.3mf", "points.csv", "points.html"):
        check((out / "prints" / name).stat().st_size > 500, f"{name} is missing or empty")

    refused = subprocess.run(["/usr/bin/python3", source / "Applications" / "demo" / "demo.py", "--program", "echorama", "--out", out, "--surface",
                              "--synthetic"], capture_output=True, text=True)
    check(refused.returncode == 2 and "--surface stands alone" in refused.stderr, f"--synthetic beside --surface: {refused.stderr!r}")
