#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pivot calibration as a filter: tip, region and residuals of a track; tools by name; what is refused."""
import json
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkPolyData

from echorama import vtkUltrasoundPivotCalibration

TIP, PIVOT = np.array([10.0, -5.0, 120.0]), np.array([200.0, 50.0, -30.0])
random = np.random.default_rng(3)


def turn(v):
    angle = np.linalg.norm(v) + 1e-300
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]]) / angle
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def turned(count=150, degrees=25.0, noise=0.2):
    poses = np.tile(np.eye(4), (count, 1, 1))
    for pose in poses:
        pose[:3, :3] = turn(np.radians(degrees) * random.standard_normal(3))
        pose[:3, 3] = PIVOT - pose[:3, :3] @ TIP + noise * random.standard_normal(3)
    return poses


def track_of(poses, tools=None, names=("Stylus", "Probe"), status=None):
    track, points = vtkPolyData(), vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(poses[:, :3, 3]), deep=True))
    track.SetPoints(points)
    arrays = {"ToolToWorld": poses.reshape(-1, 16), "TimeStamp": 0.02 * np.arange(len(poses))}
    if tools is not None:
        arrays["Tool"] = np.asarray(tools, np.int32)
        list_of_names = vtkStringArray()
        list_of_names.SetName("ToolNames")
        for name in names:
            list_of_names.InsertNextValue(name)
        track.GetFieldData().AddArray(list_of_names)
    if status is not None:
        arrays["Status"] = np.asarray(status, np.uint8)
    for name, values in arrays.items():
        array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        array.SetName(name)
        track.GetPointData().AddArray(array)
    return track


def make(track, **properties):
    filter = vtkUltrasoundPivotCalibration()
    filter.messages = []

    def keep(_, __, message):
        filter.messages.append(message)

    keep.CallDataType = "string0"
    filter.AddObserver(vtkCommand.ErrorEvent, keep)
    filter.SetInputDataObject(track)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    filter.Update()
    return filter


def refused(track, words, **properties):
    filter = make(track, **properties)
    assert len(filter.messages) == 1 and words in filter.messages[0], (words, filter.messages)
    assert filter.GetOutput().GetNumberOfPoints() == 0 and filter.GetReport() == ""
    assert all(math.isnan(v) for v in (*filter.GetTip(), *filter.GetPivot(), filter.GetRadius95()))


# Tip, region, residuals.
poses = turned()
poses[:10, 0, 3] += 40.0 # not yet in place
filter = make(track_of(poses))
assert not filter.messages, filter.messages
output, report = filter.GetOutput(), json.loads(filter.GetReport())
assert np.linalg.norm(np.subtract(filter.GetTip(), TIP)) < 0.3 and np.linalg.norm(np.subtract(filter.GetPivot(), PIVOT)) < 0.3
assert 0.01 < filter.GetRadius95() < 0.3
assert output.GetNumberOfPoints() == output.GetNumberOfVerts() == 150
data, field = output.GetPointData(), output.GetFieldData()
inlier, residual = vtk_to_numpy(data.GetArray("Inlier")), vtk_to_numpy(data.GetArray("Residual"))
assert not inlier[:10].any() and inlier[10:].sum() >= 138
assert np.allclose(vtk_to_numpy(output.GetPoints().GetData()) - residual, filter.GetPivot())
assert np.allclose(vtk_to_numpy(data.GetArray("TimeStamp")), 0.02 * np.arange(150))
assert field.GetArray("Tip").GetTuple(0) == filter.GetTip() and field.GetArray("TipRadius95").GetValue(0) == filter.GetRadius95()
assert report["inliers"] == inlier.sum() and set(range(10)) <= set(report["outliers"]) and report["tip"] == list(filter.GetTip())
assert any("left out" in note for note in report["notes"]) and abs(report["sphere"]["radius_mm"] - np.linalg.norm(TIP)) < 1.0
assert make(track_of(poses), RejectOutliers=False).GetRadius95() > 2 * filter.GetRadius95()

# One of two tools; poses whose status is not valid do not count.
two = np.concatenate([turned(80), turned(80)])
two[80:, :3, 3] += [0, 0, 500]
tools = [0] * 80 + [1] * 80
probe = make(track_of(two, tools), Tool="Probe")
assert np.linalg.norm(np.subtract(probe.GetPivot(), PIVOT + [0, 0, 500])) < 0.3 and probe.GetOutput().GetNumberOfPoints() == 80
assert json.loads(probe.GetReport())["tool"] == "Probe"
status = np.zeros(160)
status[100:] = 1
assert make(track_of(two, tools, status=status), Tool="Probe").GetOutput().GetNumberOfPoints() == 20
refused(track_of(two, tools), "it has several tools; name one of Stylus, Probe")
refused(track_of(two, tools), 'there is no tool "Needle"; there are: Stylus, Probe', Tool="Needle")
refused(track_of(two), "it names no tools", Tool="Probe")

# What has no answer.
refused(vtkPolyData(), "the track: it is empty")
refused(track_of(poses), 'no point array "ProbeToTracker" of 16 numbers', PoseArray="ProbeToTracker")
refused(track_of(turned(degrees=0.1)), "turned by only")
refused(track_of(poses[:3]), "at least 4 poses")
refused(track_of(poses), "NoiseMm is 0 mm; it must be in (0, 100]", NoiseMm=0.0)
broken = turned()
broken[4, 0, 0] = np.nan
refused(track_of(broken), "pose 5 (at 0.08 s) holds a number that is not finite")
