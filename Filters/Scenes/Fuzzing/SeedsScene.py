# SPDX-License-Identifier: BSD-3-Clause
"""SeedsScene.py DIR: the example scenes, and small ones of everything else, for the fuzzer to start from."""
import json
import sys
from pathlib import Path

folder = Path(sys.argv[1])
for path in (Path(__file__).resolve().parents[3] / "Examples" / "scenes").glob("*.json"):
    if not path.name.endswith(".schema.json"):
        (folder / path.stem).write_text(path.read_text())
head = {"schema": "echorama-scene-1"}
unit = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
seeds = {
    "empty": head,
    "shapes": {**head, "materials": {"a": {"like": "liver", "density": 1e3}}, "tissue": [
        {"name": "s", "sphere": {"centre": [0, 1, 2], "radius": 3, "material": "a"}},
        {"box": {"size": [1, 2, 3], "rotationDegrees": [0, 0, 9], "material": "bone"}},
        {"cylinder": {"from": [0, 0, 1], "to": [0, 0, 9], "radius": 2, "material": "blood"}}]},
    "mesh": {**head, "tissue": [{"mesh": {"file": "a.ply", "unit": "m", "axes": "y-up", "material": "fat", "transform": unit}},
                                {"mesh": {"file": "a.ply", "material": "fat", "transform": {"scale": 2}}}]},
    "probe": {**head, "probe": {"preset": "linear", "sweepSteps": 8, "sweepWidthMm": 20, "fanRadiusMm": 3, "samples": 9}},
    "recording": {**head, "views": {"recording": {"file": "r.mha", "smoothSeconds": 0.2, "count": 2}}, "sweep": {"seconds": 1, "alongRecording": True}},
    "poses": {**head, "views": {"poses": [unit, {"face": [0, 0, 1], "target": [0, 0, 9], "fan": [0, 1, 0]}]}},
    "keys": {**head, "press": {}, "background": "air", "gel": {}, "views": {"keys": [{"seconds": 0, "pose": unit}, {"seconds": 1, "pose": {"face": [1, 0, 0]}}],
                                                                         "times": [0.5, 1], "stepMm": 9}},
    "phantom": {**head, "change": {"decorrelation": 0.1, "ribShare": 0.2, "gainDb": 1}, "tissue": [
        {"phantom": {"bodies": "jets"}, "firstView": 2, "lastView": 3},
        {"phantom": {"background": "liver", "inclusions": [
            {"name": "a", "ellipsoid": {"centre": [0, 0, 9], "radii": [1, 2, 3], "rotation": [0, 1, 0]}, "wallMm": 0.2, "wallDb": 3},
            {"tube": {"path": [[0, 0, 1], [0, 1, 9]], "radius": 2}, "echogenicityDb": -9}]}}]},
    "scanner": {**head, "transducer": {"bandwidth": 0.5}, "receiver": {"tgcDbPerCm": 0, "tgcPoints": [{"depthMm": 1, "gainDb": 2}]},
                "transport": {"mode": "counting", "sampling": "sobol", "counting": {"clarity": 0}}},
}
for name, content in seeds.items():
    (folder / name).write_text(json.dumps(content))
