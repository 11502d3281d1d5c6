#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The tracker as a source: tools and images, live, replayed and simulated; statistics, transforms by name, and what is refused."""
import gc
import json
import math
import pathlib
import tempfile
import time

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkCommonMath import vtkMatrix4x4

from echorama import vtkUltrasoundTrackerSource, vtkUltrasoundVolume

folder = pathlib.Path(tempfile.mkdtemp())
INVALID, COUNT = 4, 10


def pose(x, y, z):
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def text_of(matrix):
    return " ".join(str(v) for v in np.asarray(matrix).ravel())


# The probe goes along x by 10 mm per frame, the reference stays; frame 4 has no probe.
lines = (f"ObjectType = Image\nNDims = 3\nDimSize = 8 6 {COUNT}\nKinds = domain domain list\nElementType = MET_UCHAR\n"
         "ElementSpacing = 1 1 1\nUltrasoundImageOrientation = MF\n")
for i in range(COUNT):
    frame = f"Seq_Frame{i:04}_"
    lines += f"{frame}ProbeToTrackerTransform = {text_of(pose(10 * i, 0, 0))}\n"
    lines += f"{frame}ProbeToTrackerTransformStatus = {'MISSING' if i == INVALID else 'OK'}\n"
    lines += f"{frame}ReferenceToTrackerTransform = {text_of(pose(0, 100, 0))}\n{frame}ReferenceToTrackerTransformStatus = OK\n"
    lines += f"{frame}Timestamp = {50 + 0.25 * i}\n"
pixels = np.repeat(np.arange(COUNT, dtype="u1"), 48)
sequence = folder / "tracked.igs.mha"
sequence.write_bytes((lines + "ElementDataFile = LOCAL\n").encode() + pixels.tobytes())
transforms = folder / "calibration.json"
transforms.write_text(json.dumps({"schema": "echorama-transforms-1", "unit": "mm", "transforms": [
    {"from": "Image", "to": "Probe", "matrix": np.diag([0.5, 0.25, 1, 1]).tolist(), "errorMm": 0.75}]}))


def make(device, **properties):
    source = vtkUltrasoundTrackerSource()
    source.errors = []
    source.AddObserver(vtkCommand.ErrorEvent, lambda *_: source.errors.append(1))
    source.SetDevice(device)
    for name, value in properties.items():
        getattr(source, "Set" + name)(value)
    return source


def tools_of(source):
    source.Update()
    output = source.GetOutput()
    fields = output.GetFieldData()
    names = fields.GetAbstractArray("ToolNames")
    arrays = output.GetPointData()
    result = {}
    for point in range(output.GetNumberOfPoints()):
        tool = names.GetValue(int(arrays.GetArray("Tool").GetValue(point)))
        result[tool] = (np.array(output.GetPoint(point)), int(arrays.GetArray("Status").GetValue(point)),
                        arrays.GetArray("TimeStamp").GetValue(point), np.array(arrays.GetArray("ToolToWorld").GetTuple(point)))
        assert (output.GetPointData().GetArray("ToolToWorld").GetNumberOfComponents()) == 16
        for axis, name in enumerate(("XAxis", "YAxis", "ZAxis")):
            assert np.allclose(arrays.GetArray(name).GetTuple(point), result[tool][3].reshape(4, 4)[:3, axis]), name
    axes, valid = source.GetOutputDataObject(2), [tool for tool in result if result[tool][1] == 0]
    assert axes.GetNumberOfLines() == 3 * len(valid)
    for line in range(axes.GetNumberOfLines()):
        axis, tool = axes.GetCellData().GetArray("Axis").GetValue(line), names.GetValue(axes.GetCellData().GetArray("Tool").GetValue(line))
        start, end = (np.array(axes.GetCell(line).GetPoints().GetPoint(i)) for i in range(2))
        assert tool in valid and np.allclose(start, result[tool][0])
        assert np.allclose(end - start, source.GetAxisLengthMm() * result[tool][3].reshape(4, 4)[:3, axis])
    assert output.GetNumberOfVerts() == sum(status == 0 for _, status, _, _ in result.values())
    return result, (fields.GetAbstractArray("WorldFrame").GetValue(0) if fields.GetAbstractArray("WorldFrame") else None)


# A recording step by step: poses, statuses and the image of each frame.
source = make(f"replay:{sequence}?step=1", TransformFile=str(transforms))
tools, world = tools_of(source)
assert tools == {} and source.GetState() == "running", source.GetMessage()
for i in range(COUNT):
    assert source.Step()
    tools, world = tools_of(source)
    assert world == "Tracker" and sorted(tools) == ["Probe", "Reference"]
    where, status, seconds, matrix = tools["Probe"]
    assert status == (1 if i == INVALID else 0)
    if i != INVALID:
        assert np.allclose(where, (10 * i, 0, 0)) and seconds == 50 + 0.25 * i and np.allclose(matrix.reshape(4, 4), pose(10 * i, 0, 0))
    assert np.allclose(tools["Reference"][0], (0, 100, 0)) and tools["Reference"][1] == 0
    image = source.GetOutputDataObject(1)
    shown = i - 1 if i == INVALID else i # the newest that can be placed
    assert image.GetDimensions() == (8, 6, 1)
    assert np.all(vtk_to_numpy(image.GetPointData().GetArray("Intensity")) == shown)
    assert np.all(vtk_to_numpy(image.GetPointData().GetArray(vtkUltrasoundVolume.ValidRegionName())) == 1)
    assert np.allclose(image.GetOrigin(), (10 * shown, 0, 0)) and np.allclose(image.GetSpacing()[:2], (0.5, 0.25))
    assert image.GetFieldData().GetArray("TimeStamp").GetValue(0) == 50 + 0.25 * shown
    assert image.GetFieldData().GetArray("ImageToWorld").GetNumberOfComponents() == 16
    assert not source.GetNeedsUpdate() # all of it is shown
assert not source.Step() and source.GetState() == "ended"
assert source.GetNumberOfTools() == 2 and source.GetToolName(0) == "ProbeToTracker" and source.GetToolName(7) == ""
assert source.GetNumberOfPoses("Probe") == COUNT and source.GetNumberOfPoses("ProbeToTracker") == COUNT
assert math.isclose(source.GetRate("Reference"), 4.0) and math.isclose(source.GetDropoutShare("Probe"), 1 / COUNT)
assert source.GetJitter("Probe") < 1e-9 and math.isnan(source.GetLatency("Probe")) and math.isnan(source.GetRate("Nobody"))
report = json.loads(source.GetReport())
assert [tool["name"] for tool in report["tools"]] == ["ProbeToTracker", "ReferenceToTracker"] and report["live"] is False

# Transforms by name, the newest and at a time between two poses; their errors and what is wrong with them.
matrix = vtkMatrix4x4()
assert source.GetTransform("ImageToReference", matrix) == 0
assert [matrix.GetElement(i, 3) for i in range(3)] == [90, -100, 0] and matrix.GetElement(0, 0) == 0.5
assert source.GetTransformError("ImageToReference") == 0.75 and source.GetTransformError("ProbeToTracker") == -1
source.SetTime(50.1)
assert source.GetTransform("ProbeToReference", matrix) == 0 and math.isclose(matrix.GetElement(0, 3), 4.0)
assert np.allclose(tools_of(source)[0]["Probe"][0], (4, 0, 0))
assert np.all(vtk_to_numpy(source.GetOutputDataObject(1).GetPointData().GetArray("Intensity")) >= COUNT - 4) # what is held
source.SetTime(50 + 0.25 * INVALID)
assert source.GetTransform("ProbeToReference", matrix) == 1 and "ProbeToTracker is missing" in source.GetTransformMessage("ProbeToReference")
assert matrix.GetElement(0, 3) == 0
assert source.GetTransform("ProbeToNowhere", matrix) == 1 and "Nowhere" in source.GetTransformMessage("ProbeToNowhere")
assert source.GetTransform("Nonsense", matrix) == 1 and source.GetTransform(None, None) == 1
source.SetTime(math.nan)
source.SetWorldFrame("Reference")
tools, world = tools_of(source)
assert world == "Reference" and np.allclose(tools["Probe"][0], (90, -100, 0)) and np.allclose(tools["Reference"][0], 0)
source.SetWorldFrame("Nowhere")
assert all(status == 1 for _, status, _, _ in tools_of(source)[0].values())
assert not source.errors

# A recording at the time of the pipeline.
source = make(f"replay:{sequence}", TransformFile=str(transforms), FollowTime=True)
source.UpdateInformation()
information = source.GetOutputInformation(0)
steps = information.Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
assert list(steps) == [50 + 0.25 * i for i in range(COUNT)], steps
for moment, x in ((51.5, 60), (50, 0), (50.3, 12), (52.25, 90), (1000, 90), (-5, 0)):
    source.UpdateTimeStep(moment)
    output = source.GetOutput()
    assert np.allclose(output.GetPoint(0), (x, 0, 0)), (moment, output.GetPoint(0))
    assert source.GetTransform("ProbeToTracker", matrix) == 0 and math.isclose(matrix.GetElement(0, 3), x, abs_tol=1e-9)
source.UpdateTimeStep(50 + 0.25 * INVALID)
assert source.GetOutput().GetPointData().GetArray("Status").GetValue(0) == 1 and source.GetOutput().GetNumberOfVerts() == 1
for moment, frame in ((51.5, 6), (50.3, 1), (52.25, 9), (50, 0)):
    source.UpdateTimeStep(moment)
    source.Update(1)
    image = source.GetOutputDataObject(1)
    assert np.all(vtk_to_numpy(image.GetPointData().GetArray("Intensity")) == frame), moment
    assert np.allclose(image.GetOrigin(), (10 * frame, 0, 0)), (moment, image.GetOrigin())
    for _ in range(3): # nothing is new, however often it is asked, also after it was changed: else it would be updated for ever
        assert not source.GetNeedsUpdate(), moment
        source.Modified()
        source.UpdateTimeStep(moment)
source.Stop() # what was read stays, but for images
source.UpdateTimeStep(51.5)
assert np.allclose(source.GetOutput().GetPoint(0), (60, 0, 0))
assert not source.errors

# A live device: it runs on by itself, is asked whether there is something new, and can be closed.
source = make("simulated:?rate=200&tools=3&dropout=0.2&seed=3")
assert not source.GetNeedsUpdate() # nothing is open
assert source.WaitForPoses(60, 60.0)
assert source.GetNeedsUpdate()
tools, world = tools_of(source)
assert sorted(tools) == ["Probe", "Reference", "Stylus"] and world == "Tracker" and source.GetState() == "running"
assert source.GetOutputDataObject(1).GetNumberOfPoints() == 0
assert source.WaitForPoses(source.GetNumberOfPoses("Probe") * 3 + 30, 60.0) and source.GetNeedsUpdate()
assert source.GetRate("Probe") > 1 and 0 <= source.GetDropoutShare("Probe") < 0.7 and source.GetSecondsSinceLast("Probe") < 60
assert not source.WaitForPoses(10**9, 0.01)
source.Stop()
assert source.GetState() == "idle"
count = source.GetNumberOfPoses("Probe")
time.sleep(0.05)
assert source.GetNumberOfPoses("Probe") == count > 0
# What is old is not shown as if it were live.
source.SetFreshSeconds(0.01)
assert all(status == 1 for _, status, _, _ in tools_of(source)[0].values()) and source.GetOutput().GetNumberOfVerts() == 0
assert source.Start() and source.GetState() == "running"
source.SetDevice("simulated:?tools=1&rate=100&unplugAfter=0.05")
assert source.WaitForPoses(3, 60.0)
for _ in range(600):
    if source.GetState() == "lost":
        break
    time.sleep(0.1)
assert source.GetState() == "lost" and "unplugged" in source.GetMessage()
assert list(tools_of(source)[0]) == ["Probe"]
assert not source.errors

# A recording of the device, replayed, is the same. It has the first pose too: it subscribes before the device starts.
recording = folder / "recorded.igs.mha"
source = make("simulated:?rate=100&tools=2&start=5&unplugAfter=0.5&noiseMm=1")
assert source.StartRecording(str(recording)) and source.WaitForPoses(100, 60.0)
for _ in range(600):
    if source.GetNumberOfRecordedPoses() == 100:
        break
    time.sleep(0.02)
assert source.GetNumberOfRecordedPoses() == 100 and source.GetNumberOfUnrecordedPoses() == 0 and source.GetRecordingProblem() == ""
assert source.StopRecording() and source.StopRecording() and not source.errors
assert not source.StartRecording(str(recording)) and source.errors # it is there
again = make(f"replay:{recording}?speed=0")
assert again.WaitForPoses(100, 60.0)
matrices = [vtkMatrix4x4(), vtkMatrix4x4()]
for moment in (5.0, 5.2, 5.49):
    for which, matrix in zip((source, again), matrices):
        which.SetTime(moment)
        assert which.GetTransform("ProbeToReference", matrix) == 0
    assert all(matrices[0].GetElement(i, j) == matrices[1].GetElement(i, j) for i in range(4) for j in range(4))

# One recording after another: one that got no pose is none, and a new one that cannot be leaves the earlier one as it is.
other = make(f"replay:{sequence}?step=1")
first, second = folder / "first.igs.mha", folder / "second.igs.mha"
assert other.StartRecording(str(first)) and other.StartRecording(str(second)) and not other.errors
assert not first.exists()
assert other.Step()
for _ in range(600):
    if other.GetNumberOfRecordedPoses() == 2:
        break
    time.sleep(0.02)
assert other.GetNumberOfRecordedPoses() == 2
assert not other.StartRecording(str(recording)) and other.errors and other.GetNumberOfRecordedPoses() == 2
other.errors.clear()
assert other.StopRecording() and second.exists() and not other.errors

# A device that is opened anew, or another one, ends the recording, which says so.
source = make("simulated:?rate=100&tools=1")
for i, restart in enumerate((lambda: source.Stop() or source.Start(), lambda: source.SetDevice("simulated:?tools=2"))):
    ended = folder / f"ended-{i}.igs.mha"
    assert source.StartRecording(str(ended)) and source.GetRecordingProblem() == ""
    for _ in range(600):
        if source.GetNumberOfRecordedPoses() >= 10:
            break
        time.sleep(0.02)
    restart()
    assert "ended with its device" in source.GetRecordingProblem() and source.GetNumberOfRecordedPoses() >= 10 and ended.exists()
assert source.StartRecording(str(folder / "next.igs.mha")) and source.GetRecordingProblem() == ""
assert source.WaitForPoses(1, 60.0) and source.StopRecording() and not source.errors

# A tool that becomes too old makes a picture of its own.
source = make("simulated:?rate=100&tools=1&unplugAfter=0.05&motion=still", FreshSeconds=0.2)
assert source.WaitForPoses(3, 60.0)
for _ in range(600):
    source.GetNeedsUpdate()
    if tools_of(source)[0]["Probe"][1] == 1:
        break
    time.sleep(0.02)
assert source.GetState() == "lost" and tools_of(source)[0]["Probe"][1] == 1

# What cannot be opened is an error and an empty output, and a good device works afterwards.
damaged = folder / "damaged.csv"
damaged.write_bytes(b"\0\1\2")
source = make("replay:" + str(sequence) + "?speed=0")
assert source.WaitForPoses(2 * COUNT, 60.0) and len(tools_of(source)[0]) == 2
for device in ("", "nonsense", "nonsense://", "simulated:?rate=0", "simulated:?colour=red", f"replay:{folder}/nothing.csv",
               f"replay:{damaged}", "replay:", None):
    source.errors.clear()
    source.SetDevice(device)
    source.Update()
    assert source.errors, device
    assert source.GetOutput().GetNumberOfPoints() == 0 and source.GetOutputDataObject(1).GetNumberOfPoints() == 0, device
    assert source.GetState() == "failed" and source.GetMessage(), device
    assert not source.WaitForPoses(1, 0.0) and not source.GetNeedsUpdate() and source.GetReport() == ""
source.errors.clear()
source.SetDevice("simulated:")
source.SetTransformFile(str(folder / "nothing.json"))
source.Update()
assert source.errors and "nothing.json" in source.GetMessage()
source.errors.clear()
source.SetTransformFile(None)
assert source.WaitForPoses(1, 60.0) and not source.errors
assert "simulated" in source.GetDeviceKinds() and "replay" in source.GetDeviceKinds()

# Opened and left a hundred times: no thread stays.
before = len(list(pathlib.Path("/proc/self/task").iterdir()))
for _ in range(100):
    other = vtkUltrasoundTrackerSource()
    other.SetDevice("simulated:?rate=1000")
    other.Update()
    del other
gc.collect()
assert len(list(pathlib.Path("/proc/self/task").iterdir())) <= before
print(source)
print("tools, images, transforms and statistics are those of the device")
