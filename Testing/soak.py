#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Watches the resident memory and the open files of a program that runs for long (./run soak): whether they grow.

The program is the simulator's window, led by a tracker of 60 poses a second, whose images are drawn as they come. Its process is
looked at from outside (/proc), every few seconds. The first third of the time, 20 minutes at most, is for warming up; what is there
afterwards must not grow.
"""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy

SOURCE = pathlib.Path(__file__).resolve().parents[1]
LARGEST_SLOPE = 20.0  # MB an hour; one image in a thousand that is not freed is 60
SLACK = 8.0  # MB: what a heap that is not growing may do in a short run
LARGEST_WARM_UP = 20.0  # minutes


def look(process):
    """Resident MB and open files of a process; nothing when it has ended."""
    try:
        pages = int(pathlib.Path(f"/proc/{process}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGESIZE") / 2**20, len(os.listdir(f"/proc/{process}/fd"))
    except (OSError, IndexError):
        return None


def watch(child, minutes, interval):
    """Rows of (minutes, MB, open files) until the program ends; it is ended when its time is up."""
    rows, begin = [], time.monotonic()
    while child.poll() is None and time.monotonic() - begin < 60 * minutes:
        if seen := look(child.pid):
            rows.append(((time.monotonic() - begin) / 60, *seen))
        time.sleep(interval)
    return numpy.array(rows).reshape(-1, 3)


def judge(rows, minutes, slope_limit=LARGEST_SLOPE, slack=SLACK):
    """What is wrong, as a list, and what was measured, as text."""
    warm = rows[rows[:, 0] >= min(minutes / 3, LARGEST_WARM_UP)]
    if len(warm) < 10 or warm[-1, 0] < 0.9 * minutes:
        return [f"it ended after {rows[-1, 0] if len(rows) else 0:.1f} of {minutes:g} minutes"], ""
    hours = (warm[:, 0] - warm[0, 0]) / 60
    slope = numpy.polyfit(hours, warm[:, 1], 1)[0]
    tenth = max(len(warm) // 10, 3)
    ends = [(numpy.median(part[:, 1]), int(numpy.median(part[:, 2]))) for part in (warm[:tenth], warm[-tenth:])]
    (first, files), (last, files_last) = ends
    wrong = []
    if slope > slope_limit and last - first > slack:
        wrong.append(f"memory grows by {slope:.1f} MB an hour; {slope_limit:g} are allowed")
    if files_last > files:
        wrong.append(f"{files_last - files} files that were opened are open still")
    return wrong, (f"after {warm[0, 0]:.1f} minutes: {first:.1f} MB, {files} open files; after {warm[-1, 0]:.1f} minutes: {last:.1f} MB, "
                   f"{files_last} open files; {slope:+.1f} MB an hour")


def main():
    parser = argparse.ArgumentParser(prog="soak", description=__doc__.splitlines()[0])
    parser.add_argument("minutes", type=float, nargs="?", default=120.0, help="how long (default 120)")
    parser.add_argument("--build", type=pathlib.Path, default=SOURCE / "build" / "release")
    parser.add_argument("--interval", type=float, default=2.0, help="seconds between looks (default 2)")
    parser.add_argument("--command", nargs=argparse.REMAINDER, help="another program instead of the simulator")
    options = parser.parse_args()
    command = options.command or [options.build / "bin" / "SimulatorPaceWindowTests", "poseToPixelsAndMemory"]
    with tempfile.TemporaryDirectory(prefix="soak-") as folder:
        # It would run on: that it is there to the end is part of what is judged.
        environment = {**os.environ, "ECHORAMA_PACE_SECONDS": f"{60 * options.minutes + 600:.0f}", "XDG_CONFIG_HOME": folder,
                       "LIBGL_ALWAYS_SOFTWARE": "1", "ECHORAMA_BUILD_DIR": str(options.build)}
        with open(pathlib.Path(folder) / "output", "w+") as output:
            child = subprocess.Popen(command, env=environment, stdout=output, stderr=subprocess.STDOUT)
            try:
                rows = watch(child, options.minutes, options.interval)
            finally:
                child.kill()
                child.wait()
            wrong, told = judge(rows, options.minutes)
            if told:
                print(told)
            elif output.seek(0) == 0:
                print(output.read()[-4000:])
    print("\n".join(wrong) or "neither grows")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
