#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pose packets as the page tells other programs to write them, received by the tracker source."""
import pathlib
import re
import socket
import struct
import time
import zlib

from vtkmodules.util.numpy_support import vtk_to_numpy

from echorama import vtkUltrasoundTrackerSource

page = (pathlib.Path(__file__).resolve().parents[2] / "Documentation/trackers/udp.md").read_text()
snippet = re.search(r"```python\n(.*?)```", page, re.S).group(1)


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


source = vtkUltrasoundTrackerSource()
for _ in range(5):  # somebody may take the port in between
    port = free_port()
    source.SetDevice(f"udp://127.0.0.1:{port}")
    if source.Start():
        break
assert source.GetState() == "connecting", source.GetMessage()

sender = {}
exec(snippet.replace("18950", str(port)), sender)  # sends one packet itself
for i in range(1, 20):
    sender["send"]("ProbeToTracker", (10.0 * i, -20.0, 5.0), (0.6, 0.0, 0.0, 0.8))
    time.sleep(0.002)
assert source.WaitForPoses(20, 20.0), source.GetReport()
assert source.GetState() == "running", source.GetMessage()
source.Update()
tools = source.GetOutput()
assert tools.GetNumberOfPoints() == 1
matrix = vtk_to_numpy(tools.GetPointData().GetArray("ToolToWorld"))[0].reshape(4, 4)
assert abs(matrix[:3, 3] - (190.0, -20.0, 5.0)).max() < 1e-9, matrix
assert abs(matrix[:3, 0] - (-0.28, 0.96, 0.0)).max() < 1e-9, matrix  # turned by 106 degrees about z
assert source.GetNumberOfPoses("Probe") == 20

# A damaged packet, a replayed one, and one of another session.
body = b"EPPK" + struct.pack("<HHQQdH", 1, 1, sender["session"], 1, 0.0, 1) + b"\x05Probe\0" + struct.pack("<7d", 9, 9, 9, 1, 0, 0, 0)
for packet in (body + b"0000", body + struct.pack("<I", zlib.crc32(body)),
               (other := body[:8] + struct.pack("<Q", sender["session"] ^ 2) + body[16:]) + struct.pack("<I", zlib.crc32(other))):
    sender["out"].sendto(packet, ("127.0.0.1", port))
end = time.monotonic() + 20.0
while source.GetNumberOfRejected() < 3 and time.monotonic() < end:
    time.sleep(0.01)
assert source.GetNumberOfRejected() == 3, source.GetReport()
assert source.GetNumberOfPoses("Probe") == 20
source.Stop()
print("ok")
