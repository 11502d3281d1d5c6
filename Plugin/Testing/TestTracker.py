# SPDX-License-Identifier: BSD-3-Clause
"""A tracker in ParaView: a live source that is asked whether there is something new, drawn, and a recording that follows the animation."""
import json
import os
import pathlib
import tempfile
import time

import numpy
from paraview import servermanager
from paraview.simple import *

LoadPlugin(os.environ["ECHORAMA_PLUGIN"], remote=False, ns=globals())
folder = pathlib.Path(tempfile.mkdtemp())


def needs_update(proxy):
    """As the window asks a live source at every tick of its timer."""
    algorithm = proxy.SMProxy.GetClientSideObject()
    before = algorithm.GetMTime()
    proxy.SMProxy.InvokeCommand("Refresh")
    if algorithm.GetMTime() == before:
        return False
    proxy.SMProxy.MarkModified(proxy.SMProxy)
    return True


def point_arrays(proxy, port=0):
    data = servermanager.Fetch(proxy, idx=port)
    arrays = data.GetPointData()
    return data, {arrays.GetArrayName(i): arrays.GetArray(i) for i in range(arrays.GetNumberOfArrays())}


# Live: the picture follows the tools.
tracker = UltrasoundTracker(Device="simulated:?rate=200&tools=3&motion=sweep")
hints = tracker.SMProxy.GetHints().FindNestedElementByName("LiveSource")
assert hints and hints.GetAttribute("interval") == "40"
view = CreateView("RenderView")
view.ViewSize = [400, 300]
display = Show(tracker, view)
display.PointSize = 20
axes = Show(OutputPort(tracker, 2), view)
axes.LineWidth = 4
ColorBy(axes, ("CELLS", "Axis"))
places, pictures = set(), 0
for _ in range(600):
    if needs_update(tracker):
        if pictures == 0:
            ResetCamera(view)
        Render(view)
        pictures += 1
        data, arrays = point_arrays(tracker)
        if data.GetNumberOfPoints() == 3:
            assert arrays["Status"].GetRange() == (0, 0)
            places.add(round(data.GetPoint(0)[0], 6))
    if len(places) > 4:
        break
    time.sleep(0.04)
assert len(places) > 4, places
ResetCamera(view)
SaveScreenshot(str(folder / "tracker.png"), view)
assert (folder / "tracker.png").stat().st_size > 2000
tracker.UpdatePipelineInformation()
assert tracker.GetPropertyValue("State") == "running" and "simulated" in tracker.GetPropertyValue("Message"), (tracker.GetPropertyValue("State"), tracker.GetPropertyValue("Message"))
assert [tool["name"] for tool in json.loads(tracker.GetPropertyValue("Report"))["tools"]] == ["ProbeToTracker", "ReferenceToTracker", "StylusToTracker"]
tracker.Active = 0
tracker.UpdatePipeline()
tracker.UpdatePipelineInformation()
assert tracker.GetPropertyValue("State") == "idle", tracker.GetPropertyValue("State")
Delete(tracker)

# A recording with images, at the time of the animation.
size, count = 32, 5
text = (f"ObjectType = Image\nNDims = 3\nDimSize = {size} {size} {count}\nKinds = domain domain list\nElementType = MET_UCHAR\n"
        "ElementSpacing = 1 1 1\nUltrasoundImageOrientation = MF\n")
for i in range(count):
    pose = numpy.eye(4)
    pose[:3, 3] = 10 * i, 20, 30
    text += f"Seq_Frame{i:04}_ProbeToTrackerTransform = {' '.join(str(v) for v in pose.ravel())}\n"
    text += f"Seq_Frame{i:04}_ProbeToTrackerTransformStatus = OK\nSeq_Frame{i:04}_Timestamp = {7 + 0.25 * i}\n"
path = folder / "recorded.igs.mha"
path.write_bytes((text + "ElementDataFile = LOCAL\n").encode() + numpy.repeat(numpy.arange(count, dtype="u1"), size * size).tobytes())
recording = UltrasoundTracker(Device=f"replay:{path}", FollowTime=1)
assert list(recording.TimestepValues) == [7 + 0.25 * i for i in range(count)], recording.TimestepValues
scene = GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
Show(recording, view)
Show(OutputPort(recording, 1), view).SetRepresentationType("Slice")
for i in (0, 3, 1, 4):
    scene.AnimationTime = 7 + 0.25 * i
    Render(view)
    data, arrays = point_arrays(recording)
    assert numpy.allclose(data.GetPoint(0), (10 * i, 20, 30)), (i, data.GetPoint(0))
    image, arrays = point_arrays(recording, 1)
    assert arrays["Intensity"].GetRange() == (i, i) and image.GetDimensions()[:2] == (size, size), i
print("tools move, recordings follow the time; the picture is", folder / "tracker.png")
