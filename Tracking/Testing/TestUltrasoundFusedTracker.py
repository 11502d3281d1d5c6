#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Two trackers as one in the tracker source: place by one, orientation by another; its heading said and corrected by a skin."""
import math
import pathlib
import re
import tempfile
import time

import numpy as np
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkFiltersSources import vtkSphereSource

from echorama import vtkUltrasoundTrackerSource


def make(device):
    source = vtkUltrasoundTrackerSource()
    source.errors = []

    def said(_, event, text):
        source.errors.append(text)
    said.CallDataType = "string0"
    source.AddObserver(vtkCommand.ErrorEvent, said)
    source.SetDevice(device)
    return source


def wait_for(holds, seconds=20):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "it does not come"
        time.sleep(0.005)


def pose_of(source, name="ProbeToTracker"):
    matrix = vtkMatrix4x4()
    status = source.GetTransform(name, matrix)
    return status, np.array([matrix.GetElement(i, j) for i in range(4) for j in range(4)]).reshape(4, 4)


# The same motion seen by both: what is fused is what a tracker of both would see, once the heading is said. A sweep tilts about
# its array, which points the same way all the while.
source = make("fused:simulated:?rate=100&tools=1&motion=sweep|"
              "simulated:?rate=100&tools=1&motion=sweep&driftDegreesPerMinute=5&noiseDegrees=0.2")
truth = make("simulated:?rate=100&tools=1&motion=sweep")
assert source.Start() and truth.Start()
wait_for(lambda: pose_of(source)[0] == 2 and pose_of(truth)[0] == 0)  # it comes, but is not to be trusted
wait_for(lambda: source.GetState() == "running" and "heading is not known" in source.GetMessage())
assert math.isclose(source.GetHeadingSigma(), 180) and math.isnan(truth.GetHeadingSigma())
assert not source.Align(0, 0, 1) and "upright" in source.errors[-1]
assert not source.AlignBySlide(30) and "10 mm" in source.errors[-1]
assert not source.Align(float("nan"), 0, 0) and len(source.errors) == 3
assert source.Align(*pose_of(truth)[1][:3, 0], 1.0)
assert source.GetHeadingSigma() < 2
wait_for(lambda: pose_of(source)[0] == 0)
offs = []
for _ in range(20):
    time.sleep(0.02)
    source.SetTime(float("nan"))
    source.Modified()
    source.Update()
    seconds = source.GetOutput().GetPointData().GetArray("TimeStamp").GetValue(0)
    source.SetTime(seconds - 0.05)  # both are interpolated at the same moment
    truth.SetTime(seconds - 0.05)
    (status, fused), (other, wanted) = pose_of(source), pose_of(truth)
    if status == other == 0:
        turn = fused[:3, :3].T @ wanted[:3, :3]
        offs.append((np.linalg.norm(fused[:3, 3] - wanted[:3, 3]), math.degrees(math.acos(min(1, (np.trace(turn) - 1) / 2)))))
assert len(offs) > 10, offs
assert max(off[0] for off in offs) < 0.5 and max(off[1] for off in offs) < 4, offs
assert source.GetNumberOfTools() == 1 and source.GetRate("Probe") > 50

# An IMU that stops is named with the seconds, and its tool is missing.
stops = make("fused:simulated:|simulated:?unplugAfter=0.3|alignTo=1 0 0")
stops.SetFreshSeconds(0.5)
assert stops.WaitForPoses(5, 20)
assert pose_of(stops)[0] == 0
wait_for(lambda: "the orientation: simulated: unplugged" in stops.GetMessage() and float(re.search("silent for ([0-9.]+)", stops.GetMessage() + " silent for 0")[1]) > 1)
assert stops.GetState() == "lost" and pose_of(stops)[0] == 1

# A skin corrects the heading: the probe rests on a ball, and its axis comes to point inwards, seen from above.
ball = vtkSphereSource()
ball.SetRadius(100)
ball.SetThetaResolution(40)
ball.SetPhiResolution(40)
ball.Update()
for point_normals in (True, False):
    if not point_normals:
        ball.GetOutput().GetPointData().SetNormals(None)
    skin = make("fused:|simulated:?motion=still&tools=1&rate=200|mounting=90 0 0&up=0 1 0&alignTo=1 0 0&alignDegrees=40&heldDegrees=1&heldSeconds=0.01")
    place = np.array([60.0, 0.0, 80.0])
    positions = make("fused:simulated:?motion=still&tools=1|simulated:?motion=still&tools=1|mounting=90 0 0&up=0 1 0&alignTo=1 0 0&alignDegrees=40&"
                     "heldDegrees=1&heldSeconds=0.01")
    positions.SetSkin(ball.GetOutput())
    assert positions.GetSkin() is ball.GetOutput()
    assert skin.SetPlace(*place, *place)
    assert positions.WaitForPoses(2, 20) and skin.WaitForPoses(2, 20)
    for one in (skin, positions):
        def off_axis():
            matrix = pose_of(one)[1]
            axis, inwards = matrix[[0, 2], 2], -matrix[[0, 2], 3]
            return math.degrees(math.acos(axis @ inwards / np.linalg.norm(axis) / np.linalg.norm(inwards)))
        wait_for(lambda: off_axis() < 8, 5)
    assert np.allclose(pose_of(skin)[1][:3, 3], place)
assert not skin.SetPlace(float("inf"), 0, 0)

# Recordings in which an orientation is not finite now and then: these moments are bridged, and all others are there.
folder = pathlib.Path(tempfile.mkdtemp())


def record(name, tool, bad=()):
    lines = ("ObjectType = Image\nNDims = 3\nDimSize = 1 1 200\nKinds = domain domain list\nElementType = MET_UCHAR\n"
             "UltrasoundImageOrientation = MF\n")
    for i in range(200):
        lines += (f"Seq_Frame{i:04}_{tool}Transform = {'nan' if i in bad else 1} 0 0 {0.1 * i} 0 1 0 0 0 0 1 0 0 0 0 1\n"
                  f"Seq_Frame{i:04}_{tool}TransformStatus = OK\nSeq_Frame{i:04}_Timestamp = {0.01 * i}\n")
    (folder / name).write_bytes((lines + "ElementDataFile = LOCAL\n").encode() + bytes(200))
    return folder / name


recorded = make(f"fused:replay:{record('place.igs.mha', 'ProbeToSkin')}?speed=0|"
                f"replay:{record('turn.igs.mha', 'ImuToLevel', (50, 51, 100))}?speed=0|alignTo=1 0 0")
assert recorded.Start()
wait_for(lambda: recorded.GetState() == "ended")
assert recorded.GetNumberOfPoses("Probe") >= 195 and recorded.GetDropoutShare("Probe") == 0
recorded.SetTime(0.505)
status, matrix = pose_of(recorded, "ProbeToSkin")
assert status == 0 and np.allclose(matrix, [[1, 0, 0, 5.05], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])

# Refused: lines that are none, and devices that are no pair.
for line, reason in (("fused:simulated:", "POSITION-LINE|ORIENTATION-LINE"), ("fused:replay:nowhere.mha|simulated:", "nowhere.mha"),
                     ("fused:simulated:|simulated:|nothing=1", "there is no option nothing")):
    bad = make(line)
    assert not bad.Start() and reason in bad.errors[-1] and bad.GetState() == "failed", bad.errors
alone = make("simulated:")
assert not alone.Align(1, 0, 0) and "only fused trackers" in alone.errors[-1]
closed = make("fused:simulated:|simulated:")
closed.SetActive(False)
assert not closed.Align(1, 0, 0) and "not open" in closed.errors[-1]
