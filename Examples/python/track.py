#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""track.py DEVICE [SECONDS]: where the tools of a tracker are, as lines of text, and at the end how well they came.

DEVICE is a line such as "polhemus:/dev/ttyUSB0?names=Probe,Stylus", "igtl://localhost:18944",
"replay:FILE?speed=2" or "simulated:?rate=100"; SECONDS defaults to 10.
"""
import sys
import time

from vtkmodules.util.numpy_support import vtk_to_numpy

from echorama import vtkUltrasoundTrackerSource

STATUS = ("valid", "missing", "out of range")

if not 2 <= len(sys.argv) <= 3:
    sys.exit(__doc__)
source = vtkUltrasoundTrackerSource()
source.SetDevice(sys.argv[1])
if not source.Start():  # it has said why
    sys.exit(1)

state = None
end = time.monotonic() + (float(sys.argv[2]) if len(sys.argv) == 3 else 10.0)
while time.monotonic() < end and source.GetState() not in ("ended", "failed"):
    if (source.GetState(), source.GetMessage()) != state:
        state = source.GetState(), source.GetMessage()
        print(f"# {state[0]}: {state[1]}")
    time.sleep(0.1)
    if not source.GetNeedsUpdate():
        continue
    source.Update()
    tools = source.GetOutput()
    data = tools.GetPointData()
    names = tools.GetFieldData().GetAbstractArray("ToolNames")
    for i in range(tools.GetNumberOfPoints()):
        name = names.GetValue(int(data.GetArray("Tool").GetTuple1(i)))
        matrix = vtk_to_numpy(data.GetArray("ToolToWorld"))[i].reshape(4, 4)
        status = STATUS[int(data.GetArray("Status").GetTuple1(i))]
        print(f"{data.GetArray('TimeStamp').GetTuple1(i):.3f} {name} {status}: " + " ".join(f"{v:.2f}" for v in matrix[:3, 3]) + " mm")

print(f"# {source.GetState()}: {source.GetMessage()}")
for i in range(source.GetNumberOfTools()):
    name = source.GetToolName(i)
    print(f"# {name}: {source.GetNumberOfPoses(name)} poses, {source.GetRate(name):.1f} Hz, jitter "
          f"{1000 * source.GetJitter(name):.1f} ms, {100 * source.GetDropoutShare(name):.1f} % without a measurement")
print(f"# {source.GetNumberOfRejected()} messages were not taken")
