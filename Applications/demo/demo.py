#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The demo: overlapping volumes in, one stitched volume and a report that a person understands out.

demo.py --program ECHORAMA --out FOLDER [-- VOLUME...]

Without volumes it makes three of a phantom, or (--synthetic) of an invented abdomen by simulating ultrasound, knocked out of place
by a known amount, so that the alignment can be scored; then three more of an abdomen that the probe presses, to be aligned deformably.
With --surface it prints, calibrates and tracks a skin in simulation instead (surface.py). ./run demo calls it. It needs the Python package echorama, and a screen (xvfb-run provides one).
"""
import argparse
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys

import numpy as np

from pressed import press


RESULTS = ["report.html", "stitched.mha", "stitched.ValidRegion.mha", "embedded.mha", "embedded.ValidRegion.mha",
           "embedded.Embedding.mha", "poses.json", "start.json", "slices.png", "overlays.png", "edges.png", "rendering.png",
           "embedded.png"]


class StepFailed(Exception):
    """A step of the demo could not be done; says which and why."""


class Steps:
    """Runs subcommands of the program, one after the other, and keeps what they said."""

    def __init__(self, program):
        self.program = program
        self.done = []  # (what it did, command line, seconds)

    def run(self, what, *arguments):
        arguments = [str(argument) for argument in arguments]
        print(f"  {what} ...", file=sys.stderr, flush=True)
        try:
            # Progress and messages of the program go to our own standard error as they come.
            answer = subprocess.run([self.program, *arguments, "--json"], stdout=subprocess.PIPE, text=True)
        except OSError as problem:
            raise StepFailed(f"{what}: {self.program} does not start: {problem.strerror}") from problem
        try:
            result = json.loads(answer.stdout)
        except ValueError:
            result = {}
        doubtful = answer.returncode == 3 and "error" not in result  # the result is there, and the report tells of it
        if (answer.returncode != 0 and not doubtful) or not result:
            reason = result.get("error", f"echorama {arguments[0]} ended with status {answer.returncode}")
            raise StepFailed(f"{what}: {reason}")
        if doubtful:
            for volume in result.get("volumes", []):
                if volume.get("reason"):
                    print(f"  {volume['file']}: {volume['verdict']} ({volume['reason']})")
            print("  look at the report before you use the result: " + "; ".join(result.get("notes") or ["not every volume is aligned"]))
        self.done.append((what, shlex.join(["echorama", *arguments]), float(result.get("seconds", 0))))
        return result


def short(path):
    """The path from here when it lies below, else as it is."""
    relative = os.path.relpath(path)
    return pathlib.Path(path if relative.startswith("..") else relative)


def files_of(pose_file):
    return [short(pose_file.parent / volume["file"]) for volume in json.loads(pose_file.read_text())["volumes"]]


def scores(result, files):
    """The score of each file in mm, from what the subcommand score printed."""
    of_file = {pathlib.Path(volume["file"]).resolve(): volume["mean_mm"] for volume in result["volumes"]}
    return [of_file[file.resolve()] for file in files]


def scene_file(out, quick):
    """The example scene of an abdomen; coarse, for tests."""
    path = pathlib.Path(__file__).resolve().parents[2] / "Examples" / "scenes" / "anatomy.json"
    if not quick:
        return path
    scene = json.loads(path.read_text())
    scene.pop("$schema", None)
    scene["probe"].update(elements=48, sweepSteps=32, samples=160)
    scene["transport"] = {"subRays": 1}
    scene["volume"]["spacingMm"] = 2
    coarse = out / "scene.json"
    coarse.write_text(json.dumps(scene))
    return coarse


def write_identities(path, files):
    volumes = [{"file": os.path.relpath(file, path.parent), "VolumeToWorld": np.eye(4).tolist()} for file in files]
    path.write_text(json.dumps({"schema": "echorama-poses-1", "unit": "mm", "frame": "LPS", "volumes": volumes}, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser(description="Align, score, stitch and show three volumes of a phantom, or your own.")
    parser.add_argument("--program", required=True, help="the program echorama")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder for the results")
    parser.add_argument("--quick", action="store_true", help="a coarse phantom and small pictures, for tests")
    parser.add_argument("--synthetic", action="store_true", help="three volumes of an invented abdomen in simulated ultrasound")
    parser.add_argument("--surface", action="store_true", help="a skin to print, its camera and two tools on it, in simulation")
    parser.add_argument("volumes", nargs="*", help="overlapping volumes (default: three of a phantom)")
    options = parser.parse_args()
    if len(options.volumes) == 1:
        parser.error("one volume cannot be aligned: name two or more, or none for the phantom")
    if options.synthetic and options.volumes:
        parser.error("--synthetic makes volumes: name none")
    if options.surface and (options.synthetic or options.volumes):
        parser.error("--surface stands alone")
    try:
        surface_demo(options) if options.surface else demo(options)
    except (StepFailed, OSError) as failure:
        print(f"demo: {failure}", file=sys.stderr)
        return 1
    return 0


def begin(options):
    if not os.environ.get("DISPLAY"):
        raise StepFailed("there is no screen (DISPLAY is not set); start the demo under xvfb-run")
    out = short(options.out)
    out.mkdir(parents=True, exist_ok=True)
    return Steps(options.program), out


def surface_demo(options):
    steps, out = begin(options)
    try:
        from surface import survey

        path, summary = survey(steps, out, options.quick)
    except (ImportError, ValueError, KeyError, RuntimeError, MemoryError) as problem:
        raise StepFailed(f"surface tracking: {problem}") from problem
    print(summary)
    print(f"report    {path.resolve()}")


def demo(options):
    steps, out = begin(options)
    for volume in options.volumes:
        if pathlib.Path(volume).resolve() in [(out / old).resolve() for old in RESULTS]:
            raise StepFailed(f"{volume}: it is a result of an earlier run, which this one replaces; copy it elsewhere first")
    for old in RESULTS:  # a step that fails must not leave the report of an earlier run
        (out / old).unlink(missing_ok=True)
    truth_file, straight = None, []
    if options.volumes:
        # A shell's * finds the companions NAME.ValidRegion.EXT too; they are parts of NAME.EXT.
        named = {str(short(volume)) for volume in options.volumes}
        files = [short(volume) for volume in options.volumes
                 if re.sub(r"\.(ValidRegion|Provenance|Coverage|Spread|Embedding)(?=\.(nii\.gz|\w+)$)", "", str(short(volume))) not in named - {str(short(volume))}]
    elif options.synthetic:
        steps.run("making three volumes of an invented abdomen by simulated ultrasound, knocked out of place", "synthesize",
                  scene_file(out, options.quick), "-o", out / "synthetic")
        truth_file = out / "synthetic" / "truth.json"
        files = files_of(truth_file)
    else:
        straight = ["--sound-speed-error", "0"]  # sound in a phantom is as fast as the scanner takes it to be
        steps.run("making three volumes of a phantom, knocked out of place", "phantom", "-o", out / "phantom",
                  *(["--spacing", 2] if options.quick else []))
        truth_file = out / "phantom" / "truth.json"
        files = files_of(truth_file)

    steps.run("aligning", "align", *files, *straight, "-o", out / "poses.json")
    before = after = None
    if truth_file:
        write_identities(out / "start.json", files)
        before = scores(steps.run("scoring where they lay", "score", out / "start.json", "--truth", truth_file), files)
        after = scores(steps.run("scoring where they lie now", "score", out / "poses.json", "--truth", truth_file), files)
    steps.run("stitching", "stitch", *files, "--poses", out / "poses.json", "-o", out / "stitched.mha")
    steps.run("embedding", "embed", out / "stitched.mha", "-o", out / "embedded.mha")

    pressed = press(Steps(options.program), out, options.quick, files_of, write_identities) if options.synthetic else None

    print("  drawing ...", file=sys.stderr, flush=True)
    try:
        from report import write_report

        report = write_report(out, steps, files, truth_file, before, after, options.quick, pressed)
    except (ImportError, OSError, ValueError, RuntimeError, MemoryError) as problem:
        raise StepFailed(f"drawing: {problem}") from problem
    print(report.summary)
    print(f"report    {report.path.resolve()}")


if __name__ == "__main__":
    sys.exit(main())
