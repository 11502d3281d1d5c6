#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Placement by tracker as a filter: volumes come back to where they belong, by a track or a recording; what is refused."""
import json
import math
import pathlib
import tempfile

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkCommand, vtkDoubleArray, vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet, vtkImageData, vtkMultiBlockDataSet, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4

from echorama import vtkUltrasoundAcquisition, vtkUltrasoundTrackerPlacement, vtkUltrasoundVolume

random = np.random.default_rng(5)
folder = tempfile.TemporaryDirectory()


def pose():
    """A random rigid matrix, mm."""
    q = random.standard_normal(4)
    w, x, y, z = q / np.linalg.norm(q)
    matrix = np.eye(4)
    matrix[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                      [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                      [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    matrix[:3, 3] = random.uniform(-100, 100, 3)
    return matrix


def add_field(data, name, values):
    array = vtkDoubleArray()
    array.SetName(name)
    array.SetNumberOfComponents(len(values))
    array.InsertNextTuple(values)
    data.GetFieldData().AddArray(array)


def volume(place, probe, time=None):
    image = vtkImageData()
    image.SetDimensions(4, 5, 6)
    image.SetSpacing(1.0, 1.5, 2.0)
    image.SetDirectionMatrix(place[:3, :3].ravel().tolist())
    image.SetOrigin(place[:3, 3].tolist())
    array = numpy_to_vtk(np.arange(120, dtype=np.uint8), deep=True)
    array.SetName(vtkUltrasoundVolume.IntensityName())
    image.GetPointData().SetScalars(array)
    if probe is not None:
        add_field(image, vtkUltrasoundAcquisition.ProbeToWorldName(), probe.ravel().tolist())
    if time is not None:
        add_field(image, vtkUltrasoundAcquisition.TimeStampName(), [time])
    return image


def place_of(image):
    matrix, direction = np.eye(4), image.GetDirectionMatrix()
    matrix[:3, :3] = [[direction.GetElement(i, j) for j in range(3)] for i in range(3)]
    matrix[:3, 3] = image.GetOrigin()
    return matrix


# Where the probe truly was (probes), by which each file lies wrong (wrong), and what the tracker saw: S = O P C^-1.
calibration, world = pose(), pose()
probes, wrong, places = [pose() for _ in range(3)], [np.eye(4), pose(), pose()], [pose() for _ in range(3)]
sensor = [world @ probe @ np.linalg.inv(calibration) for probe in probes]
TIMES = [5.0, 6.0, 7.0]


def volumes(probed=True, timed=True):
    return [volume(w @ place, w @ probe if probed else None, t if timed else None) for w, place, probe, t in zip(wrong, places, probes, TIMES)]


def track(tool=None, times=TIMES):
    """Each pose for 0.4 s about its time; of two tools, the other one stays where it is."""
    rows = [(t + dt, 0, s) for t, s in zip(times, sensor) for dt in (-0.2, 0.0, 0.2)]
    if tool:
        rows += [(t, 1, np.eye(4)) for t, _, _ in rows]
    data, points = vtkPolyData(), vtkPoints()
    points.SetData(numpy_to_vtk(np.array([matrix[:3, 3] for _, _, matrix in rows]), deep=True))
    data.SetPoints(points)
    arrays = {"TimeStamp": np.array([t for t, _, _ in rows]), "ToolToWorld": np.array([matrix.ravel() for _, _, matrix in rows])}
    if tool:
        arrays["Tool"] = np.array([number for _, number, _ in rows], np.int32)
        names = vtkStringArray()
        names.SetName("ToolNames")
        for name in (tool, "Reference"):
            names.InsertNextValue(name)
        data.GetFieldData().AddArray(names)
    for name, values in arrays.items():
        array = numpy_to_vtk(values, deep=True)
        array.SetName(name)
        data.GetPointData().AddArray(array)
    return data


def calibration_file(name, sensor_name, report):
    path = pathlib.Path(folder.name) / name
    path.write_text(json.dumps({"schema": "echorama-transforms-1", "unit": "mm", "report": report, "transforms": [
        {"from": "Volume", "to": sensor_name, "matrix": calibration.tolist(), "error_mm": 0.75}]}))
    return str(path)


def make(images, poses=None, **properties):
    filter = vtkUltrasoundTrackerPlacement()
    filter.messages = []

    def keep(_, __, message):
        filter.messages.append(message)

    keep.CallDataType = "string0"
    filter.AddObserver(vtkCommand.ErrorEvent, keep)
    filter.SetVolumeToSensor(calibration.ravel().tolist())
    for image in images:
        filter.AddInputDataObject(0, image)
    if poses is not None:
        filter.SetInputDataObject(1, poses)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    filter.Update()
    return filter


def check_placed(filter, fixed=0):
    """All lie as the fixed volume lies: wrong by the same."""
    assert not filter.messages and filter.GetNumberOfVolumes() == 3, filter.messages
    output = filter.GetOutput()
    for i in range(3):
        image = output.GetBlock(i)
        assert np.allclose(place_of(image), wrong[fixed] @ places[i], atol=1e-6), i
        probe = np.array(image.GetFieldData().GetArray(vtkUltrasoundAcquisition.ProbeToWorldName()).GetTuple(0)).reshape(4, 4)
        assert np.allclose(probe, wrong[fixed] @ probes[i], atol=1e-6), i
        found = vtkMatrix4x4()
        assert filter.GetPose(i, found)
        found = np.array([[found.GetElement(r, c) for c in range(4)] for r in range(4)])
        assert np.allclose(found, wrong[fixed] @ np.linalg.inv(wrong[i]), atol=1e-6), i
        field = image.GetFieldData().GetArray(filter.VolumeToWorldName()).GetTuple(0)
        assert np.array_equal(np.reshape(field, (4, 4)), found)
    return output


def check_refused(filter, *words):
    assert filter.messages and all(word in filter.messages[0] for word in words), filter.messages
    assert filter.GetNumberOfVolumes() == 0 and filter.GetNotes() == "" and math.isnan(filter.GetErrorMm())
    assert not any(filter.GetOutput().GetBlock(i) for i in range(filter.GetOutput().GetNumberOfBlocks()))


# By time stamps; the fixed volume, and only it, stays.
images = volumes()
output = check_placed(make(images, track()))
assert output.GetBlock(1).GetPointData().GetScalars() is images[1].GetPointData().GetScalars()  # voxels are shared
assert np.allclose(place_of(images[1]), wrong[1] @ places[1])  # and the input is left as it was
check_placed(make(volumes(), track(), FixedVolume=2), fixed=2)

# As blocks of a tree, which keep their names.
blocks = vtkMultiBlockDataSet()
for i, image in enumerate(volumes()):
    blocks.SetBlock(i, image)
    blocks.GetMetaData(i).Set(vtkCompositeDataSet.NAME(), f"scan {i}")
output = check_placed(make([blocks], track()))
assert [output.GetMetaData(i).Get(vtkCompositeDataSet.NAME()) for i in range(3)] == ["scan 0", "scan 1", "scan 2"]

# By times that are given, against the stamps of the volumes.
filter = make(volumes(), track(times=[25.0, 26.0, 27.0]))
check_refused(filter, "volume 1", "is not known")
filter.messages.clear()
for t in (25.0, 26.0, 27.0):
    filter.AddTime(t)
filter.Update()
check_placed(filter)
assert "given times" in filter.GetNotes()

# One of two tools, with the calibration of a file, which says how good it is.
path = calibration_file("probe.json", "Probe", {"volume_frame": "probe"})
filter = make(volumes(), track("Probe"), Tool="Probe", CalibrationFile=path, VolumeToSensor=np.eye(4).ravel().tolist())
check_placed(filter)
assert filter.GetErrorMm() == 0.75
check_refused(make(volumes(), track("Probe"), CalibrationFile=path), "Probe, Reference")
check_refused(make(volumes(), track("Stylus"), Tool="Stylus", CalibrationFile=path), "VolumeToStylus")

# Files that lie as they were acquired: by the calibration, by the property, and where no volume knows its probe.
old = calibration_file("old.json", "Sensor", {"volumeFrame": "file"})  # as older files spell it
for filter in (make(volumes(), track(), CalibrationFile=old), make(volumes(), track(), VolumeFrame=filter.FILE_FRAME),
               make(volumes(probed=False), track())):
    assert not filter.messages, filter.messages
    for i in range(3):
        motion = np.linalg.inv(probes[0]) @ probes[i]  # of a file that is in the probe's frame
        assert np.allclose(place_of(filter.GetOutput().GetBlock(i)), motion @ wrong[i] @ places[i], atol=1e-6)
check_refused(make(volumes(probed=False), track(), VolumeFrame=filter.PROBE), "volume 1", "ProbeToWorld")

# From a recording: a table of poses, of volumes without time stamps, one by one; then in metres.
for unit in (1.0, 1000.0):
    table = pathlib.Path(folder.name) / "log.csv"
    lines = ["time,tool,tx,ty,tz,qw,qx,qy,qz"]
    for t, matrix in zip(TIMES, sensor):
        values, vectors = np.linalg.eigh(np.array([
            [matrix[0, 0] + matrix[1, 1] + matrix[2, 2], matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]],
            [0, matrix[0, 0] - matrix[1, 1] - matrix[2, 2], matrix[1, 0] + matrix[0, 1], matrix[2, 0] + matrix[0, 2]],
            [0, 0, matrix[1, 1] - matrix[0, 0] - matrix[2, 2], matrix[2, 1] + matrix[1, 2]],
            [0, 0, 0, matrix[2, 2] - matrix[0, 0] - matrix[1, 1]]]).T)
        lines.append(",".join(map(repr, [t, "ProbeToTracker", *(matrix[:3, 3] / unit).tolist(), *vectors[:, -1].tolist()])).replace("'", ""))
    table.write_text("\n".join(lines) + "\n")
    filter = make(volumes(timed=False), Recording=str(table), RecordingUnitMm=unit, CalibrationFile=path)
    check_placed(filter)
assert "one pose of ProbeToTracker for each volume" in filter.GetNotes()
check_refused(make(volumes()[:2], Recording=str(table), WindowSeconds=0.0, LongestGapSeconds=0.5, VolumeFrame=filter.PROBE,
                   CalibrationFile=calibration_file("other.json", "Stylus", {})), "VolumeToProbe")

# A window and a gap: between two scans nothing is known, unless so long a gap is bridged.
between = volumes()
add_field(between[1], vtkUltrasoundAcquisition.TimeStampName(), [5.5])
check_refused(make(between, track()), "volume 2", "is not known")
assert not make(between, track(), LongestGapSeconds=2.0).messages
check_refused(make(volumes(), track(), LongestGapSeconds=-1.0), "LongestGapSeconds is -1 s; it must be in (0, 600]")

# What else is refused.
some = volumes()
some[2] = volumes(timed=False)[2]
check_refused(make(some, track()), "1 of 3 volumes have no time stamp")
check_refused(make(volumes()), "neither a track")
check_refused(make(volumes(), track(), FixedVolume=3), "fixed volume")
check_refused(make(volumes(), track(), VolumeToSensor=(2 * np.eye(4)).ravel().tolist()), "not a rigid pose")
check_refused(make(volumes(), Recording=str(pathlib.Path(folder.name) / "absent.csv")), "absent.csv")
