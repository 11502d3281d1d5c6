#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""samples.py FOLDER: sample data, some tens of megabytes, synthesised from the example scenes (see Documentation/scenes.md).

Each scene gets a folder: overlapping volumes that lie a little wrong, their beams, the geometry, and truth.json, which puts them
right. Scenes whose meshes are not on this machine are left out. ./run samples FOLDER calls it.
"""
import argparse
import pathlib
import subprocess
import sys

SCENES = pathlib.Path(__file__).resolve().parents[2] / "Examples" / "scenes"


def main():
    parser = argparse.ArgumentParser(prog="samples", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--scenes", nargs="+", type=pathlib.Path, metavar="FILE", help="these scenes (default: the examples)")
    parser.add_argument("--program", default="echorama", help="the program echorama")
    options = parser.parse_args()
    scenes = options.scenes or sorted(path for path in SCENES.glob("*.json") if not path.name.endswith(".schema.json"))
    made = 0
    for scene in scenes:
        folder = options.folder / scene.stem
        print(f"{scene.stem} ...", flush=True)
        done = subprocess.run([options.program, "synthesize", scene, "-o", folder, "--landmarks", "50"], stdin=subprocess.DEVNULL,
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            print(f"{scene.stem}: left out: {done.stderr.strip()}", file=sys.stderr)
            continue
        size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
        print(f"{folder}: {size / 1e6:.1f} MB; align it: echorama align {folder}/volume_*.mha -o aligned.json", flush=True)
        made += 1
    if made == 0:
        sys.exit("samples: no scene could be synthesised")


if __name__ == "__main__":
    try:
        main()
    except OSError as problem:
        sys.exit(f"samples: {problem}")
