# SPDX-License-Identifier: BSD-3-Clause
"""SeedsProjectFile.py DIR: projects, whole and wrong in one place, for the fuzzer to start from."""
import json
import sys
from pathlib import Path

folder = Path(sys.argv[1])
unit = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
turned = [[0.6, -0.8, 0, 1e-5], [0.8, 0.6, 0, -2.5], [0, 0, 1, 3e2], [0, 0, 0, 1]]
geometry = {"origin": [1, -2, 3.5], "spacing": [0.5, 0.5, 0.7], "direction": [row[:3] for row in turned[:3]], "dimensions": [5, 4, 3]}
stroke = {"mode": "paint", "radiusMm": 2.5, "intensity": 200.0, "opacity": 0.5, "hardness": 0.25, "insideValid": True,
          "pathMm": [[1, 2, 3], [4.5, -2, 1e-3]]}
head = {"schema": "echorama-project-1", "unit": "mm", "frame": "LPS", "truth": "truth.json", "comment": "seed"}
first = {"name": "A", "file": "a.mha", "path": "/data/a.mha", "geometry": geometry, "VolumeToWorld": turned, "colour": [1, 0.5, 0],
         "opacity": 0.5, "visible": True, "group": 2, "strokes": [stroke, {**stroke, "mode": "carve"}, {**stroke, "mode": "restore"}]}
second = {"file": "sub/b.mha", "VolumeToWorld": unit}
seeds = {
    "two": {**head, "volumes": [first, second]},
    "none": {**head, "volumes": []},
    "poses": {**head, "schema": "echorama-poses-1", "volumes": [second]},
    "brush": {**head, "volumes": [{**first, "strokes": [{**stroke, "radiusMm": -1}]}]},
    "path": {**head, "volumes": [{**first, "strokes": [{**stroke, "pathMm": []}]}]},
    "twice": {**head, "volumes": [first, {**second, "name": "A"}]},
    "pipeline": {**head, "volumes": [{**first, "file": ""}]},
    "result": {**head, "centreOfRotation": [1, 2, 3], "volumes": [
        {**first, "TrueVolumeToWorld": unit, "fixed": True}, {**second, "name": "B"},
        {"name": "whole", "file": "", "geometry": geometry, "VolumeToWorld": turned, "madeOf": {"options": {"Stitch.Method": "membrane"}, "sources": [
            {"name": "A", "file": "a.mha", "geometry": geometry, "VolumeToResult": turned, "strokes": "0123456789abcdef", "making": ""},
            {"name": "B", "geometry": geometry, "VolumeToResult": unit}]}}]},
    "backup": {**head, "volumes": [second], "backup": {"number": 3, "time": 1700000000, "label": "Move A", "checksum": "0123456789abcdef"}},
}
for name, content in seeds.items():
    (folder / name).write_text(json.dumps(content))
