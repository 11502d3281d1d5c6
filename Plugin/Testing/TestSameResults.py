#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The same numbers for VTK and ParaView, tuned and portable kernels, one thread and two.

TestSameResults.py TREE...: under VTK with the kernels of other build trees instead (./run test --cpus).
"""
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy

here = pathlib.Path(__file__).resolve().parent
release = pathlib.Path(os.environ["ECHORAMA_KERNELS_DIR"])
release_path = f"{release}/python3/dist-packages"
runs = {"VTK": ([], {"PYTHONPATH": release_path})}
trees = [pathlib.Path(path).resolve() for path in sys.argv[1:]]
if not trees:
    runs["VTK, one thread"] = (["taskset", "-c", "0"], {"PYTHONPATH": release_path})
    runs["ParaView"] = ([], {"PYTHONPATH": os.environ["ECHORAMA_PARAVIEW_PYTHONPATH"]})
    trees = [release.parent / "portable"]
for tree in trees:
    if not (tree / "lib" / "libEchoramaCoreKernels.so").exists():  # else those of the release would be found, and agree
        sys.exit(f"{tree} was not built: there are no kernels to compare with")
    runs[f"VTK, {tree.name} kernels"] = ([], {"PYTHONPATH": release_path, "LD_LIBRARY_PATH": f"{tree}/lib"})

results = {}
with tempfile.TemporaryDirectory() as folder:
    for name, (prefix, settings) in runs.items():
        out = f"{folder}/{name}.npz"
        environment = {key: value for key, value in os.environ.items() if key != "LD_LIBRARY_PATH"}
        subprocess.run([*prefix, "/usr/bin/python3", str(here / "pipeline_results.py"), out], check=True, env={**environment, **settings})
        results[name] = dict(numpy.load(out))

reference = results.pop("VTK")
failed = False
for name, other in results.items():
    if sorted(other) != sorted(reference):
        print(f"{name}: other results: {sorted(set(other) ^ set(reference))}")
        failed = True
        continue
    for key, expected in reference.items():
        got = other[key]
        if got.shape != expected.shape or got.dtype != expected.dtype:
            print(f"{name}: {key} has another shape or type")
            failed = True
            continue
        # Threads change nothing at all; other instruction sets may change the last bits of floating results, and with
        # them, at a tie of rounding, a byte by one.
        exact = numpy.array_equal(got, expected, equal_nan=got.dtype.kind == "f")
        if not exact and got.dtype.kind == "f":
            fine = "thread" not in name and numpy.allclose(got, expected, rtol=1e-5, atol=1e-5)
        elif not exact:
            difference = numpy.abs(got.astype(int) - expected.astype(int))
            fine = "thread" not in name and difference.max() <= 1 and (difference > 0).mean() < 1e-5
        if not exact and not fine:
            print(f"{name}: {key} differs, by up to {numpy.abs(got.astype(float) - expected.astype(float)).max()}")
            failed = True
    print(f"{name}: {len(reference)} results compared with VTK")
sys.exit(1 if failed else 0)
