#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Temporal calibration as a filter: the second track on the first one's clock; tools of one track; what is refused."""
import json
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkPolyData

from echorama import vtkUltrasoundTemporalCalibration

random = np.random.default_rng(2)
waves = np.stack([random.uniform(0.1, 0.4, 15), random.uniform(0.3, 5.0, 15), random.uniform(0, 6, 15)])


def turn(v):
    angle = np.linalg.norm(v) + 1e-300
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]]) / angle
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def moved(times, mount=np.eye(3)):
    """A hand's motion without a rhythm, as a sensor sees it that is mounted on the hand."""
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    for pose, time in zip(poses, times):
        values = waves[0] * np.sin(waves[1] * time + waves[2])
        pose[:3, :3] = turn(values.reshape(3, 5).sum(1)) @ mount
        pose[:3, 3] = 100 * values[:3]
    return poses


def track_of(poses, times, tools=None):
    track, points = vtkPolyData(), vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(poses[:, :3, 3]), deep=True))
    track.SetPoints(points)
    arrays = {"ToolToWorld": poses.reshape(-1, 16), "TimeStamp": times, "Extra": np.arange(len(times))}
    if tools is not None:
        arrays["Tool"] = np.asarray(tools, np.int32)
        names = vtkStringArray()
        names.SetName("ToolNames")
        for name in ("Probe", "Stylus"):
            names.InsertNextValue(name)
        track.GetFieldData().AddArray(names)
    for name, values in arrays.items():
        array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        array.SetName(name)
        track.GetPointData().AddArray(array)
    return track


def make(first, second, **properties):
    filter = vtkUltrasoundTemporalCalibration()
    filter.messages = []

    def keep(_, __, message):
        filter.messages.append(message)

    keep.CallDataType = "string0"
    filter.AddObserver(vtkCommand.ErrorEvent, keep)
    filter.SetInputDataObject(0, first)
    filter.SetInputDataObject(1, second)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    filter.Update()
    return filter


def refused(first, second, words, **properties):
    filter = make(first, second, **properties)
    assert len(filter.messages) == 1 and words in filter.messages[0], (words, filter.messages)
    assert filter.GetOutput().GetNumberOfPoints() == 0 and filter.GetReport() == ""
    assert math.isnan(filter.GetOffset()) and math.isnan(filter.GetStandardError())


first_times, second_times = np.arange(0, 25, 1 / 60), np.arange(1, 24, 1 / 40)
mount = turn(np.array([1.0, 2.0, 0.5]))
first = track_of(moved(first_times), first_times)
second = track_of(moved(second_times, mount), second_times + 0.34)
filter = make(first, second)
assert not filter.messages, filter.messages
report = json.loads(filter.GetReport())
assert abs(filter.GetOffset() + 0.34) < 0.003 and 0 < filter.GetStandardError() < 0.003, report
assert report["kind"] == "temporal" and report["offset_seconds"] == filter.GetOffset() and len(report["correlation_by_offset"]) > 10
assert report["signal"] == "rotation" and report["correlation"] > 0.99 and report["confidence"] > 0.99 and not report["drifts"]
output = filter.GetOutput()
assert np.allclose(vtk_to_numpy(output.GetPointData().GetArray("TimeStamp")), second_times + 0.34 + filter.GetOffset())
assert np.array_equal(vtk_to_numpy(output.GetPointData().GetArray("Extra")), np.arange(len(second_times)))
assert output.GetFieldData().GetArray("TimeOffset").GetValue(0) == filter.GetOffset()
assert np.array_equal(vtk_to_numpy(second.GetPointData().GetArray("TimeStamp")), second_times + 0.34), "the input was modified"

# Drift is taken out, on request.
long_times = np.arange(0, 120, 1 / 30)
steady, drifting = track_of(moved(long_times), long_times), track_of(moved(long_times, mount), long_times * (1 + 4e-4) - 0.1)
filter = make(steady, drifting)
assert json.loads(filter.GetReport())["drifts"]
assert np.abs(vtk_to_numpy(filter.GetOutput().GetPointData().GetArray("TimeStamp")) - long_times).max() < 0.01
filter = make(steady, drifting, CorrectDrift=False)
assert np.abs(vtk_to_numpy(filter.GetOutput().GetPointData().GetArray("TimeStamp")) - long_times).max() > 0.02

# Two tools of one track.
times = np.concatenate([first_times, second_times])
both = track_of(np.concatenate([moved(first_times), moved(second_times + 0.05)]), times, [0] * len(first_times) + [1] * len(second_times))
assert abs(make(both, both, FirstTool="Probe", SecondTool="Stylus").GetOffset() - 0.05) < 0.003
refused(both, first, "the first track: it has several tools; name one of Probe, Stylus")
refused(first, both, 'the second track: there is no tool "Needle"', SecondTool="Needle")

# What has no answer.
refused(vtkPolyData(), second, "the first track: it is empty")
still = track_of(np.tile(np.eye(4), (len(first_times), 1, 1)), first_times)
refused(first, still, "the second stream hardly turns")
refused(first, second, "the speed", Signal=2, LargestOffset=0.1)
refused(first, second, "LargestOffset is 0 s; it must be in (0, 3600]", LargestOffset=0.0)
untimed = track_of(moved(second_times), second_times)
untimed.GetPointData().RemoveArray("TimeStamp")
refused(first, untimed, "a time of the second stream is not finite")
