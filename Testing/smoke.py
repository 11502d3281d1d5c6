#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""smoke.py BENCHMARK: starts a benchmark, cut short (Testing/Benchmark.h); it must end well and print JSON objects, one a line."""
import json
import os
import pathlib
import subprocess
import sys

done = subprocess.run(sys.argv[1:], env={**os.environ, "ECHORAMA_SMOKE": "1"}, stdout=subprocess.PIPE, text=True)
print(done.stdout, end="")
if done.returncode != 0:
    sys.exit(f"smoke: exit status {done.returncode}")
lines = done.stdout.splitlines()
if not lines and not (pathlib.Path(__file__).resolve().parents[2] / "shared" / "data").is_dir():
    print("skipped: there are no real data to measure")
    sys.exit(77)
if not lines or not all(isinstance(json.loads(line), dict) for line in lines):
    sys.exit("smoke: no results")
