# SPDX-License-Identifier: BSD-3-Clause
"""SeedsPoseFile.py DIR: pose files, whole and wrong in one place, for the fuzzer to start from."""
import json
import sys
from pathlib import Path

folder = Path(sys.argv[1])
unit = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
turned = [[0.6, -0.8, 0, 1e-5], [0.8, 0.6, 0, -2.5], [0, 0, 1, 3e2], [0, 0, 0, 1]]
geometry = {"origin": [1, -2, 3.5], "spacing": [0.5, 0.5, 0.7], "direction": [row[:3] for row in turned[:3]], "dimensions": [5, 4, 3]}
head = {"schema": "echorama-poses-1", "unit": "mm", "frame": "LPS"}
volumes = [{"file": "a.mha", "geometry": geometry, "VolumeToWorld": unit}, {"file": "sub/b.mha", "VolumeToWorld": turned}]
seeds = {
    "two": {**head, "volumes": volumes},
    "none": {**head, "volumes": []},
    "ras": {**head, "frame": "RAS", "volumes": volumes},
    "scaled": {**head, "volumes": [{"file": "a.mha", "VolumeToWorld": [[2 * v for v in row] for row in unit]}]},
    "flat": {**head, "volumes": [{**volumes[0], "geometry": {**geometry, "dimensions": [5, 4, 0]}}]},
    "twice": {**head, "volumes": [volumes[0], volumes[0]]},
}
for name, content in seeds.items():
    (folder / name).write_text(json.dumps(content))
