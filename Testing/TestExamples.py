#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The example in Python runs as a user would run it, and its volumes come together."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])

with tempfile.TemporaryDirectory() as folder:
    answer = subprocess.run(["/usr/bin/python3", source / "Examples" / "python" / "stitch_phantom.py"], cwd=folder, capture_output=True, text=True)
    print(answer.stdout, answer.stderr, sep="")
    written = pathlib.Path(folder) / "stitched.vti"
    scores = re.search(r"off by ([\d.]+) mm before, ([\d.]+) mm after", answer.stdout)
    if answer.returncode != 0 or not written.is_file() or written.stat().st_size < 10_000:
        sys.exit("TestExamples: stitched.vti was not written")
    if not scores or float(scores[1]) < 3.0 or float(scores[2]) > 1.0:
        sys.exit("TestExamples: the volumes did not come together")
