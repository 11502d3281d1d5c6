# SPDX-License-Identifier: BSD-3-Clause
"""SeedsFinishedPairs.py DIR: files of finished pairs, whole and wrong in one place, for the fuzzer to start from."""
import json
import sys
from pathlib import Path

folder = Path(sys.argv[1])
numbers = ("similarity", "overlap", "score", "peak_ratio", "split_mm", "error_mm", "voxel_mm", "global_seconds", "local_seconds",
           "confidence_seconds")
pair = {"key": "a", "verdict": 1, "reason": "", "anywhere": False, **{name: 0.5 for name in numbers},
        "VolumeToWorld": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1], "centre": [1, 2, 3], "information": [1e-3] * 36}


def file(*pairs, **changed):
    return json.dumps({"schema": "echorama-finished-pairs-1", "checksum": "CHECKSUM", "pairs": list(pairs), **changed})


seeds = {
    "one": file(pair),
    "two": file(pair, {**pair, "key": "b", "reason": "too far"}),
    "none": file(),
    "damaged": file(pair, checksum="0123456789abcdef"),
    "another": file(pair, schema="echorama-finished-pairs-0"),
    "verdict": file({**pair, "verdict": 1.5}),
    "short": file({**pair, "information": [1e-3] * 35}),
    "text": file({**pair, "overlap": "half"}),
    "list": json.dumps([pair]),
    "cut": file(pair)[:-40],
}
for name, content in seeds.items():
    (folder / name).write_text(content)
