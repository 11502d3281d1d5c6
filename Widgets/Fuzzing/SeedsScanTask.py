# SPDX-License-Identifier: BSD-3-Clause
"""SeedsScanTask.py DIR: small tasks of each kind, whole and broken in one place, for the fuzzer to start from."""
import json
import sys
from pathlib import Path

folder = Path(sys.argv[1])
geometry = {
    "dimensions": [3, 4, 5],
    "origin": [0, 1, 2],
    "spacing": [0.5, 0.5, 1],
    "directionI": [1, 0, 0],
    "directionJ": [0, 1, 0],
    "directionK": [0, 0, 1],
}
goals = {
    "findPlane": {"face": [1, 2, 3], "array": [1, 0, 0], "beam": [0, 0, 1], "depthMm": 50, "distanceMm": 5, "degrees": 10},
    "measureLength": {"lengthMm": 30.5, "toleranceMm": 2, "from": [0, 0, 0], "to": [30.5, 0, 0]},
    "reachTarget": {"target": [1, 2, 3], "radiusMm": 4},
}
for name, goal in goals.items():
    task = {"schema": "echorama-scan-task-1", "name": name, "instruction": "Do it.", "hint": True,
            "body": {"file": "a.mha", "checksum": "0123456789abcdef", "geometry": geometry}, name: goal}
    text = json.dumps(task)
    (folder / name).write_text(text)
    (folder / f"{name}-cut").write_text(text[: len(text) // 2])
    (folder / f"{name}-bad").write_text(text.replace("0.5", "1e999", 1))
    del task["body"]["geometry"]
    (folder / f"{name}-scene").write_text(json.dumps(task))
