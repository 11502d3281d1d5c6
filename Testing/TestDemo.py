#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The demo from end to end at a coarse size: what it makes, what its report says, and how it fails."""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

import echorama

source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
program = pathlib.Path(os.environ["ECHORAMA_BUILD_DIR"]) / "bin" / "echorama"


def demo(out, *arguments):
    return subprocess.run(["/usr/bin/python3", source / "Applications" / "demo" / "demo.py", "--program", program,
                           "--out", out, "--quick", *arguments], capture_output=True, text=True)


def check(truth, what):
    if not truth:
        sys.exit(f"TestDemo: {what}")


sys.path.insert(0, str(source / "Applications" / "demo"))
from volumes import Displacement, xml_image  # noqa: E402


def check_report(out, count=5):
    for name in ("stitched.mha", "poses.json", "slices.png", "overlays.png", "edges.png", "embedded.png", "rendering.png",
                 "embedded.mha", "embedded.Embedding.mha"):
        check((out / name).stat().st_size > 500, f"{name} is missing or empty")
    report = (out / "report.html").read_text()
    outside = re.findall(r"""(?:src|href)\s*=\s*["'](?!data:)[^"']*|url\([^)]*\)|@import[^;]*|<script[^>]*|<link[^>]*""", report)
    check(not outside, f"the report needs more than itself: {outside}")
    check(report.count('src="data:image/png;base64,') == count, f"the report does not hold its {count} pictures")
    check("$" not in re.sub(r"base64,[^\"]*", "", report), "a place of the template was not filled")
    return report


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)

    made = demo(folder / "phantom volumes")
    check(made.returncode == 0, f"the demo failed:\n{made.stderr}")
    report = check_report(folder / "phantom volumes")
    off = re.search(r"off +([\d.]+) mm before, ([\d.]+) mm after", made.stdout)
    check(off, f"no score in {made.stdout!r}")
    before, after = float(off[1]), float(off[2])
    check(before > 5.0, f"the volumes lay only {before} mm off")
    check(after < 2.0, f"the volumes still lie {after} mm off")
    check("no voxel of the data is altered" in made.stdout, f"embedding altered the data: {made.stdout!r}")
    check("How far off" in report and f"{off[2]}" in report, "the report does not tell the score")
    check(str((folder / "phantom volumes" / "report.html").resolve()) in made.stdout, "the demo does not say where its report is")

    made = demo(folder / "synthetic", "--synthetic")
    check(made.returncode == 0, f"the demo of a synthesised scene failed:\n{made.stderr}")
    report = check_report(folder / "synthetic", 7)
    check("did not succeed" not in report, "the report itself calls the alignment a failure")
    off = re.search(r"off +([\d.]+) mm before, ([\d.]+) mm after", made.stdout)
    check(off and float(off[1]) > 5.0 and float(off[2]) < 4.0, f"synthetic volumes: {made.stdout!r}")

    # The probe that presses: how far landmarks lie apart is told, and the report tells the same.
    apart = re.search(r"landmarks ([\d.]+) mm apart after rigid, ([\d.]+) mm after deformable", made.stdout)
    check(apart and float(apart[1]) < 6.0 and float(apart[2]) < 1.2 * float(apart[1]), f"pressed volumes: {made.stdout!r}")
    rows = dict(re.findall(r'<tr><td>([a-z ]+)</td><td class="n">([\d.]+)</td>', report.split("Under a probe that presses")[1]))
    check(float(rows["where they lay"]) > float(rows["aligned rigidly"]) and rows["aligned rigidly"] == apart[1]
          and rows["aligned deformably"] == apart[2] and float(rows["the truth"]) < float(rows["where they lay"]), f"landmarks in the report: {rows}")
    poses = {name: json.loads((folder / "synthetic" / f"pressed{name}.json").read_text())["volumes"] for name in ("", ".rigid")}
    check(all("displacement" not in volume for volume in poses[".rigid"]), "the rigid poses name displacements")
    check([v["VolumeToWorld"] for v in poses[""]] == [v["VolumeToWorld"] for v in poses[".rigid"]], "the rigid poses are others")

    # The pictures read volumes through the displacement that the program means.
    path = folder / "synthetic" / "pressed" / "displacement_2.vti"
    image, field, value = xml_image(path), Displacement(path), [0.0, 0.0, 0.0]
    bounds = np.reshape(image.GetBounds(), (3, 2))
    for point in np.random.default_rng(1).uniform(bounds[:, 0] - 15, bounds[:, 1] + 15, (50, 3)):
        echorama.vtkUltrasoundDisplacement.Evaluate(image, point.tolist(), value)
        check(np.allclose(field.at(point), value, atol=1e-5), f"the displacement at {point} is {field.at(point)}, not {value}")

    volumes = [folder / "phantom volumes" / "phantom" / f"volume_{number}.mha" for number in (1, 2)]
    own = demo(folder / "own", "--", *volumes)
    check(own.returncode == 0, f"the demo with volumes of one's own failed:\n{own.stderr}")
    check("Nobody knows" in check_report(folder / "own"), "the report claims a truth that nobody gave")

    missing = demo(folder / "missing", "--", volumes[0], folder / "no such.mha")
    check(missing.returncode == 1 and "aligning" in missing.stderr and "no such.mha" in missing.stderr,
          f"a missing file: status {missing.returncode}, {missing.stderr!r}")
    check(not (folder / "missing" / "report.html").exists(), "a report in spite of a failure")
    again = demo(folder / "own", "--", folder / "own" / "stitched.mha", volumes[0])
    check(again.returncode == 1 and "copy it elsewhere" in again.stderr, f"a result as input: status {again.returncode}, {again.stderr!r}")
    check((folder / "own" / "stitched.mha").exists() and (folder / "own" / "report.html").exists(), "a result was deleted that was an input")
    one = demo(folder / "one", "--", volumes[0])
    check(one.returncode == 2, f"one volume alone: status {one.returncode}")

print(made.stdout)
