#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Which wrong kernel would still pass? mutate.py FILE [--count N] [--seed S] [--tests FILTER] [--json OUT]

Makes N small changes to a kernel, one at a time: another sign, another comparison, another constant. Each is compiled and goes through
the kernel tests of its room. A mutant that no test notices survives, and is listed: either the tests leave a gap there, or the
change makes no difference (a constant of speed, a bound that no input reaches). Works on a copy of the sources in build/mutate.
"""
import argparse
import json
import pathlib
import random
import re
import subprocess
import sys
import time

source = pathlib.Path(__file__).resolve().parents[1]
build = source / "build" / "mutate"
copy = build / "source"

SWAPS = {" + ": " - ", " - ": " + ", " * ": " / ", " / ": " * ", " < ": " <= ", " <= ": " < ", " > ": " >= ", " >= ": " > ",
         " == ": " != ", " != ": " == ", " && ": " || ", " || ": " && ", " += ": " -= ", " -= ": " += ", "std::min": "std::max",
         "std::max": "std::min", "std::fmin": "std::fmax", "std::fmax": "std::fmin", "std::floor": "std::ceil", "std::ceil": "std::floor",
         " true": " false", " false": " true", "++": "--"}
NUMBER = re.compile(r"(?<![\w.])(\d+\.\d*(?:e-?\d+)?|\d+)(?![\w.'])")


def mutated(number):
    """Another constant: a whole number one more, another half as large again, zero becomes one."""
    if "." not in number and "e" not in number:
        return str(int(number) + 1)
    return repr(1.5 * float(number)) if float(number) else "1.0"


def mutations(text):
    """(line, column, old, new) of all that could be changed: in code, not in comments, texts, includes and assertions of types."""
    found = []
    for line, whole in enumerate(text.splitlines()):
        code = re.sub(r'"(?:\\.|[^"\\])*"', lambda string: "_" * len(string[0]), whole).split("//")[0]
        if re.match(r"\s*(#|template|using|static_assert|namespace)", code):
            continue
        for old, new in SWAPS.items():
            found += [(line, match.start(), old, new) for match in re.finditer(re.escape(old), code)]
        code = re.sub(r"<[\w:, *&]*>", lambda arguments: "_" * len(arguments[0]), code)  # of templates
        found += [(line, match.start(), match[0], mutated(match[0])) for match in NUMBER.finditer(code)]
    return sorted(found)


def room_of(file):
    parts = file.parts
    return parts[0] + parts[1] if parts[0] == "Filters" else parts[0]


def run(*command, seconds=None):
    return subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=seconds)


def prepare(room):
    files = subprocess.run(["git", "ls-files", "-z"], cwd=source, stdout=subprocess.PIPE, text=True, check=True).stdout
    for name in filter(None, files.split("\0")):
        content = (source / name).read_bytes()
        if not (copy / name).exists() or (copy / name).read_bytes() != content:  # what is the same is not compiled again
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            (copy / name).write_bytes(content)
    if not (build / "tree" / "build.ninja").exists():
        done = run("cmake", "-S", copy, "-B", build / "tree", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DECHORAMA_STACK=kernels",
                   "-DECHORAMA_CPU=native", "-DECHORAMA_BENCHMARKS=OFF", "-DECHORAMA_UNITY=OFF")
        if done.returncode:
            sys.exit(done.stdout)
    done = run("ninja", "-C", build / "tree", f"{room}Tests")
    if done.returncode:
        sys.exit(done.stdout)


def outcome(room, tests, seconds):
    """killed, survived, or not compiled."""
    if run("ninja", "-C", build / "tree", f"{room}Tests").returncode:
        return "not compiled"
    try:
        done = run("env", "GTEST_FAIL_FAST=1", build / "tree" / "bin" / f"{room}Tests", f"--gtest_filter={tests}", seconds=seconds)
    except subprocess.TimeoutExpired:
        return "killed"
    return "killed" if done.returncode else "survived"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=pathlib.Path, help="a kernel: Core/Imaging/DistanceMap.cxx")
    parser.add_argument("--count", type=int, default=20, help="mutants (default 20)")
    parser.add_argument("--seed", type=int, default=1, help="which ones (default 1)")
    parser.add_argument("--tests", default="*", help="filter of GoogleTest (default: all of the room)")
    parser.add_argument("--json", type=pathlib.Path, help="also write the outcome here")
    options = parser.parse_args()
    file = options.file.resolve().relative_to(source)
    if not (source / file).exists() or file.suffix not in (".cxx", ".h") or file.name.startswith("vtk"):
        sys.exit(f"mutate: {file} is no kernel")
    room = room_of(file)
    print(f"building {room}Tests in build/mutate", file=sys.stderr)
    prepare(room)
    begin = time.monotonic()
    if outcome(room, options.tests, None) != "survived":
        sys.exit(f"mutate: the tests of {room} fail without any change")
    limit = 5 * (time.monotonic() - begin) + 10  # a mutant that never ends is noticed
    original = (source / file).read_text()
    candidates = mutations(original)
    chosen = sorted(random.Random(options.seed).sample(candidates, min(options.count, len(candidates))))
    counts, survivors = {"killed": 0, "survived": 0, "not compiled": 0}, []
    try:
        for line, column, old, new in chosen:
            lines = original.splitlines(keepends=True)
            lines[line] = lines[line][:column] + new + lines[line][column + len(old):]
            (copy / file).write_text("".join(lines))
            told = outcome(room, options.tests, limit)
            counts[told] += 1
            if told == "survived":
                survivors.append(f"{file}:{line + 1}: {old.strip()} -> {new.strip()}: {lines[line].strip()}")
                print(survivors[-1], flush=True)
    finally:
        (copy / file).write_text(original)
    valid = counts["killed"] + counts["survived"]
    print(f"{file}: {counts['killed']} of {valid} mutants were noticed ({counts['not compiled']} more did not compile; "
          f"{len(candidates)} are possible)")
    if options.json:
        options.json.write_text(json.dumps({"file": str(file), "seed": options.seed, **counts, "survivors": survivors}, indent=1) + "\n")


if __name__ == "__main__":
    main()
