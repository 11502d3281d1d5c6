#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What `echorama align` and `echorama stitch` cost for many volumes: a probe is swept over invented tissue in rows of 32, 23% of its
width further with each view and 47% with each row, and what a tracker said of each view is some 3 mm and 2 degrees off. For 10 to 1,000
volumes of one size, and 10 of 32^3 to 256^3: seconds, memory and error, as rows of tables, and the line through the counts.

    python3 Testing/many_volumes.py build/release/bin/echorama FOLDER [--counts 10 32 100 320 1000] [--edge 128] [--edges 32 64 128 256]

FOLDER gets the volumes and the results; some 3 GB, which may be removed afterwards.
"""
import argparse
import collections
import json
import multiprocessing
import os
import pathlib
import re
import subprocess
import time

import numpy as np

WIDTH, ROW, STEP, ROW_STEP = 64.0, 32, 15.0, 30.0  # mm, but for the number of views in a row
WAVES = 64


def write_metaimage(path, voxels, pose, spacing):
    """Unsigned bytes, indexed z, y, x; pose is 4 x 4, of the centre of the first voxel."""
    axes = " ".join(f"{value:.17g}" for value in pose[:3, :3].T.ravel())
    origin = " ".join(f"{value:.17g}" for value in pose[:3, 3])
    header = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
              f"TransformMatrix = {axes}\nOffset = {origin}\nElementSpacing = {spacing} {spacing} {spacing}\n"
              f"DimSize = {' '.join(map(str, voxels.shape[::-1]))}\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n")
    path.write_bytes(header.encode() + voxels.tobytes())


def rotation(axis_degrees):
    angle = np.linalg.norm(axis_degrees)
    x, y, z = axis_degrees / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.deg2rad(angle)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def about_centre(turn, shift):
    """Turns about the middle of the volume."""
    motion = np.eye(4)
    centre = np.full(3, WIDTH / 2)
    motion[:3, :3] = turn
    motion[:3, 3] = centre - turn @ centre + shift
    return motion


def true_pose(number):
    random = np.random.default_rng([1, number])
    row, along = divmod(number, ROW)
    along = along if row % 2 == 0 else ROW - 1 - along  # back and forth
    return about_centre(rotation(random.normal(0, 2, 3)), np.array([STEP * along, ROW_STEP * row, 0.0]))


def view(number, edge):
    """What is seen of the tissue, a sum of plane waves of 5 to 25 mm, with speckle of the view's own; logarithmic, in bytes."""
    tissue = np.random.default_rng(17)
    directions = tissue.normal(size=(WAVES, 3))
    waves = directions / np.linalg.norm(directions, axis=1)[:, None] * 2 * np.pi / tissue.uniform(5, 25, WAVES)[:, None]
    phases = tissue.uniform(0, 2 * np.pi, WAVES)
    pose, at = true_pose(number), np.arange(edge) * (WIDTH / edge)
    local = waves @ pose[:3, :3]  # on a grid a plane wave is a product of three
    x, y, z = (np.exp(1j * np.outer(local[:, axis], at)) for axis in range(3))
    z *= np.exp(1j * (waves @ pose[:3, 3] + phases))[:, None]
    field = (z.T @ (y[:, :, None] * x[:, None, :]).reshape(WAVES, -1)).real.reshape(edge, edge, edge)
    decibels = 6.0 * field / np.sqrt(WAVES / 2)
    random = np.random.default_rng([2, number])
    speckle = random.standard_normal((2, edge, edge, edge), dtype=np.float32)
    for axis in (1, 2, 3):
        speckle += np.roll(speckle, 1, axis)  # grains of some two voxels
    decibels += 10 * np.log10(np.square(speckle).sum(0) / 16 + 1e-6)
    return np.clip(128 + 255 / 60 * decibels, 1, 255).astype(np.uint8)


def start_pose(number):
    random = np.random.default_rng([3, number])
    return true_pose(number) @ about_centre(rotation(random.normal(0, 2 / np.sqrt(3), 3)), random.normal(0, 3 / np.sqrt(3), 3))


def file_of(folder, edge, number):
    return folder / f"{edge}_{number:04d}.mha"


def make(task):
    path, number, edge = task
    if not path.exists():
        part = path.with_suffix(".part")
        write_metaimage(part, view(number, edge), start_pose(number), WIDTH / edge)
        part.rename(path)


def measure(command):
    """Seconds, processor time, GB at most, and what it printed."""
    start = time.time()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    printed = process.stdout.read()
    _, status, used = os.wait4(process.pid, 0)
    code = os.waitstatus_to_exitcode(status)
    if code not in (0, 3):  # 3: not every volume is aligned
        raise SystemExit(f"many_volumes: {' '.join(map(str, command[:2]))} ended with status {code}")
    return time.time() - start, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024e-9, printed


def errors(moves):
    """Of the middles of the volumes, in the frame of the first: the farthest off, and neighbours beside each other (RMS), in mm."""
    centre = np.array([WIDTH / 2, WIDTH / 2, WIDTH / 2, 1.0])
    found = [np.array(move) @ start_pose(number) for number, move in enumerate(moves)]
    true = [true_pose(number) for number in range(len(found))]

    def beside(poses, one, other):
        return np.linalg.inv(poses[one]) @ poses[other] @ centre

    def apart(one, other):
        return np.linalg.norm(beside(found, one, other) - beside(true, one, other))

    numbers = range(1, len(found))
    return max(apart(0, number) for number in numbers), np.sqrt(np.mean([apart(number - 1, number) ** 2 for number in numbers]))


def cost(program, folder, edge, count):
    """What aligning and stitching so many took, and how good it was."""
    files = [file_of(folder, edge, number) for number in range(count)]
    poses, stitched = folder / "poses.json", folder / "stitched.mha"
    poses.unlink(missing_ok=True)
    stitched.unlink(missing_ok=True)
    align = [program, "align", *files, "--start", "tracked", "--sound-speed-error", "0", "--maximum-error-mm", "1000", "--json"]
    plan = json.loads(measure([*align, "--dry-run"])[3])["plan"]
    aligned = measure([*align, "-o", poses])
    told = json.loads(aligned[3])
    stitching = measure([program, "stitch", *files, "--poses", poses, "-o", stitched, "--json"])
    voxels = np.prod(json.loads(stitching[3])["dimensions"])
    farthest, neighbours = errors([volume["VolumeToWorld"] for volume in json.loads(poses.read_text())["volumes"]])
    right = sum(volume["verdict"] == "aligned" for volume in told["volumes"])
    row = [f"{count:,}", f"{edge}^3", f"{len(plan['pairs']):,}", f"{aligned[0]:.3g}", f"{plan['seconds']:.3g}", f"{aligned[1]:.3g}", f"{aligned[2]:.2f}",
           f"{right:,}", f"{farthest:.2f}", f"{neighbours:.3f}", f"{stitching[0]:.3g}", f"{stitching[1]:.3g}", f"{stitching[2]:.2f}",
           f"{voxels / 1e6:,.2g}"]
    print("| " + " | ".join(row) + " |", flush=True)
    reasons = collections.Counter(re.sub(r"\d[\d_.]*", "N", volume["reason"])[:200] for volume in told["volumes"] if volume["verdict"] != "aligned")
    for reason, times in reasons.most_common(5):
        print(f"{times} of them not aligned: {reason}", flush=True)
    return {"processor seconds of align": aligned[1], "GB of align": aligned[2], "processor seconds of stitch": stitching[1], "GB of stitch": stitching[2]}


HEAD = ["volumes", "voxels", "pairs", "align, s", "foretold, s", "processor, s", "GB", "aligned", "farthest off, mm", "neighbours, mm", "stitch, s",
        "processor, s", "GB", "output, million voxels"]


def extrapolate(counts, costs):
    """The straight line through the two largest counts, and what it says of 10^5 volumes."""
    for name in costs[0]:
        low, high = costs[-2][name], costs[-1][name]
        slope = (high - low) / (counts[-1] - counts[-2])
        print(f"{name}: {low - slope * counts[-2]:.3g} + {slope:.3g} a volume; 100,000 volumes: {low + slope * (1e5 - counts[-2]):,.0f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--counts", type=int, nargs="*", default=[10, 32, 100, 320, 1000], help="numbers of volumes")
    parser.add_argument("--edge", type=int, default=128, help="voxels along an edge of those")
    parser.add_argument("--edges", type=int, nargs="*", default=[32, 64, 128, 256], help="voxels along an edge, of ten volumes each")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    wanted = [(edge, 10) for edge in options.edges] + [(options.edge, count) for count in options.counts]
    tasks = sorted({(file_of(options.folder, edge, number), number, edge) for edge, count in wanted for number in range(count)})
    with multiprocessing.Pool() as pool:
        for done, _ in enumerate(pool.imap_unordered(make, tasks), 1):
            if done % 100 == 0:
                print(f"{done} of {len(tasks)} volumes made", flush=True)
    print("| " + " | ".join(HEAD) + " |\n" + "| --- " * len(HEAD) + "|")
    for edge in options.edges:
        cost(options.program, options.folder, edge, 10)
    costs = [cost(options.program, options.folder, options.edge, count) for count in options.counts]
    if len(costs) > 1:
        extrapolate(options.counts, costs)


if __name__ == "__main__":
    main()
