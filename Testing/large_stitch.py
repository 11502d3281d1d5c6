#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Stitches many small volumes that are far apart into one that is larger than the memory, and embeds it, with the option --memory of
`echorama stitch` and `echorama embed`, and prints time and peak memory of each: 200 volumes of 128^3 in ten rows over 2,000 x 2,000 x
1,000 voxels, or a part of these.

    python3 Testing/large_stitch.py build/release/bin/echorama FOLDER [--size 2000 2000 1000] [--memory 2.4] [--embed 4]

FOLDER gets the volumes and the results; some 0.8 GB in the full size, and 3 more where it is embedded.
"""
import argparse
import os
import pathlib
import subprocess
import time

import numpy
from many_volumes import write_metaimage

EDGE, COUNT, ROWS, SPACING = 128, 200, 10, 0.2


def make_volumes(folder, size):
    """Speckle on a slowly varying echo. Each is turned a little about z, so that it has to be interpolated."""
    random = numpy.random.default_rng(1)
    z, y, x = numpy.meshgrid(*[numpy.linspace(0, 1, EDGE)] * 3, indexing="ij")
    echo = 100 + 40 * numpy.sin(9 * x) * numpy.cos(7 * y) * numpy.sin(5 * z + 1)
    files = []
    for number in range(COUNT):
        row, column = divmod(number, COUNT // ROWS)
        voxels = numpy.clip(echo * random.rayleigh(0.8, echo.shape), 1, 255).astype(numpy.uint8)
        angle = numpy.deg2rad(random.uniform(-1.5, 1.5))
        cosine, sine = numpy.cos(angle), numpy.sin(angle)
        along = numpy.array([column / (COUNT // ROWS - 1), row / (ROWS - 1), row / (ROWS - 1)])
        offset = (numpy.array(size) - EDGE) * along * SPACING
        pose = numpy.eye(4)
        pose[:2, :2] = [[cosine, -sine], [sine, cosine]]
        pose[:3, 3] = offset
        files.append(folder / f"volume{number:03d}.mha")
        write_metaimage(files[-1], voxels, pose, SPACING)
    return files


def run(command):
    start = time.time()
    process = subprocess.Popen(command)
    _, status, used = os.wait4(process.pid, 0)
    if os.waitstatus_to_exitcode(status) != 0:
        raise SystemExit(f"large_stitch: {command[1]} failed")
    print(f"{command[1]}: {time.time() - start:.0f} s, {used.ru_utime + used.ru_stime:.0f} s of processor time, "
          f"{used.ru_maxrss * 1024e-9:.2f} GB at most", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--size", type=int, nargs=3, default=[2000, 2000, 1000], help="voxels of the result, about")
    parser.add_argument("--memory", default="2.4", help="that stitch may use beside the volumes, GB")
    parser.add_argument("--embed", help="also embed the result; that may be used for it, GB")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    files = make_volumes(options.folder, options.size)
    stitched = options.folder / "stitched.mha"
    run([options.program, "stitch", *files, "-o", stitched, "--memory", options.memory])
    if options.embed:
        run([options.program, "embed", stitched, "-o", options.folder / "embedded.mha", "--memory", options.embed])


if __name__ == "__main__":
    main()
