# SPDX-License-Identifier: BSD-3-Clause
"""SeedsSurfaceFile.py DIR: calibrated surfaces with their meshes, whole and broken, for the fuzzer to start from."""
import json
import struct
import sys
from pathlib import Path

folder = Path(sys.argv[1])


def stl(triangles):
    return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(struct.pack("<12fH", 0, 0, 0, *triangle, 0) for triangle in triangles)


def surface(centres=0, brightness=True, lights=(1, 2, False, "0011101"), **changed):
    weights = 2 * (centres + 3) if centres else 0
    unknowns = 7 + weights + 6
    content = {
        "schema": "echorama-surface-1", "date": "2026-11-26", "camera": "camera:0", "shell": "belly-7",
        "mesh": {"file": "s.mesh.stl", "checksum": "CHECKSUM", "wallMm": 0},
        "accuracy": {"marks": 9, "inliers": 9, "medianMm": 0.2, "mm95": 0.5, "mostMm": 1, "scatterMm": 0.1, "ownMm": 0.2, "coverage": 0.9},
        "lights": {"lights": lights[0], "offSlots": lights[1], "alternating": lights[2], "words": lights[3], "frameMs": 10, "exposureMs": 8,
                   "rowUs": 10, "slotMs": 10, "latencyMs": 0, "acceleration": 1e4, "maximumSpeed": 1e3, "triggered": lights[2]},
        "detector": {"method": "gaussian", "threshold": 12.5, "significance": 5, "minimumPixels": 2, "minimumSize": 0.4, "maximumSize": 8,
                     "readNoise": 1, "greyPerElectron": 0.02, "saturation": 250, "maximumSpots": 8, "maximumChange": 0.2},
        "lens": {"width": 640, "height": 480, "focal": 300, "centreX": 320, "centreY": 240, "k1": 0, "k2": 0, "k3": 0, "k4": 0,
                 "maximumAngle": 80},
        "cameraToShell": {"position": [0, 0, -100], "x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1]},
        "residual": {"middleX": 320, "middleY": 240, "scale": 200, "centres": [10 + 9 * i for i in range(2 * centres)],
                     "weights": [0.1] * weights},
        "covered": {"pixels": [320, 240, 300, 200], "reach": [200, 200], "hull": [0, 0, 640, 0, 640, 480, 0, 480]},
        "brightness": {"columns": 2, "rows": 2, "width": 640, "height": 480, "peak": [100] * 4, "size": [2] * 4},
        "marks": [0, 0, 0, 10, 0, 0],
        "covariance": [0.01 * (row == column) for row in range(unknowns) for column in range(row + 1)],
    }
    if not brightness:
        del content["brightness"]
    for key, value in changed.items():
        content[key] = {**content[key], **value} if isinstance(value, dict) else value
    return json.dumps(content).encode() + b"\0"


square = [(-50, -50, 0, 50, -50, 0, 50, 50, 5), (-50, -50, 0, 50, 50, 5, -50, 50, 0)]
bad = [(0, 0, 0, float("nan"), 0, 0, 1, 1, 1), (0, 0, 0, 0, 0, 0, 0, 0, 0), (1e38, 0, 0, 0, 1e38, 0, 0, 0, 1e38)]
seeds = {
    "plain": surface() + stl(square),
    "plate": surface(centres=4, brightness=False) + stl(square),
    "wall": surface(mesh={"wallMm": 2}) + stl(square),
    "nan": surface() + stl(bad[:1]),
    "point": surface() + stl(bad[1:2]),
    "huge": surface() + stl(bad[2:]),
    "cut": surface() + stl(square)[:-7],
    "folder": surface(mesh={"file": "../s.mesh.stl"}) + stl(square),
    "turned": surface(cameraToShell={"x": [0, 1, 0]}) + stl(square),
    "mesh": surface(mesh={"checksum": "0123456789abcdef"}) + stl(square),
}
for name, content in seeds.items():
    (folder / name).write_bytes(content)
