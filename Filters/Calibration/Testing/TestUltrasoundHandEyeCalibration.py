#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundHandEyeCalibration: pairs given one by one, as points and as tables; what comes out, what is refused."""
import json
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkTable
from vtkmodules.vtkCommonMath import vtkMatrix4x4

import echorama

random = np.random.default_rng(3)


def turn(vector):
    """The rotation by |vector| radians about it."""
    angle = np.linalg.norm(vector)
    x, y, z = np.asarray(vector) / angle if angle > 0 else (1, 0, 0)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def pose(vector, shift):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn(vector), shift
    return matrix


C = pose((0.5, -0.8, 1.2), (30, -20, 140))
O = pose((-0.3, 0.4, 2.0), (200, 50, -70))
TARGET = (0.0, 10.0, 40.0)


def scans(count=8, noise=1.0):
    """(sensor poses, alignments)"""
    sensors, volumes = [], []
    for _ in range(count):
        M = pose(random.uniform(-0.6, 0.6, 3), random.uniform(-40, 40, 3))
        shaken = [pose(random.normal(0, noise * math.radians(0.25), 3), random.normal(0, noise * 0.7, 3)) for _ in range(2)]
        sensors.append(O @ M @ np.linalg.inv(C) @ shaken[0])
        about = pose((0, 0, 0), TARGET)
        volumes.append(M @ about @ shaken[1] @ np.linalg.inv(about))
    return np.array(sensors), np.array(volumes)


def matrix_of(values):
    matrix = vtkMatrix4x4()
    matrix.DeepCopy(values.ravel())
    return matrix


def strings(name, values):
    array = vtkStringArray()
    array.SetName(name)
    for value in values:
        array.InsertNextValue(value)
    return array


def numbers(name, matrices):
    array = numpy_to_vtk(np.ascontiguousarray(matrices.reshape(len(matrices), -1)), deep=1)
    array.SetName(name)
    return array


def points_of(name, matrices, names=None, named=False):
    data, points = vtkPolyData(), vtkPoints()
    for matrix in matrices:
        points.InsertNextPoint(matrix[:3, 3])
    data.SetPoints(points)
    data.GetPointData().AddArray(numbers(name, matrices))
    if names or named:
        data.GetPointData().AddArray(strings("Name", names))
    return data


def table_of(name, matrices):
    table = vtkTable()
    table.AddColumn(numbers(name, matrices))
    return table


def calibrate(pairs=(), sensors=None, volumes=None, names=(), **properties):
    """(filter, its errors)"""
    filter = echorama.vtkUltrasoundHandEyeCalibration()
    filter.SetTarget(TARGET)
    for i, (sensor, volume) in enumerate(pairs):
        filter.AddPair(matrix_of(sensor), matrix_of(volume), names[i] if names else "")
    for port, data in enumerate((sensors, volumes)):
        if data is not None:
            filter.SetInputDataObject(port, data)
    errors = []

    def note(caller, event, text):
        errors.append(text)

    note.CallDataType = "string0"
    filter.AddObserver(vtkCommand.ErrorEvent, note)
    filter.GetExecutive().AddObserver(vtkCommand.ErrorEvent, lambda *_: None)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    filter.Update()
    return filter, errors


def result_of(filter):
    matrix = vtkMatrix4x4()
    assert filter.GetVolumeToSensor(matrix)
    return np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])


def field(data, name):
    return vtk_to_numpy(data.GetFieldData().GetArray(name)).ravel()


def check_exact():
    sensors, volumes = scans(6, noise=0)
    filter, errors = calibrate(zip(sensors, volumes))
    assert not errors, errors
    assert np.allclose(result_of(filter), C, atol=1e-6)
    world = vtkMatrix4x4()
    assert filter.GetWorldToTracker(world)
    assert np.allclose([[world.GetElement(i, j) for j in range(4)] for i in range(4)], O, atol=1e-5)
    assert filter.GetNumberOfPairs() == filter.GetNumberOfInliers() == 6


def check_output():
    sensors, volumes = scans(10)
    volumes[3] = volumes[3] @ pose((0.3, 0, 0), (30, 0, 0))
    filter, errors = calibrate(zip(sensors, volumes), names=[f"V{i}" for i in range(10)])
    assert not errors, errors
    output = filter.GetOutput()
    target = np.append(TARGET, 1)
    found = result_of(filter)
    assert np.linalg.norm((found - C) @ target) < 1.5 * filter.GetTargetRadius95()
    assert 0 < filter.GetTargetRms() < filter.GetTargetRadius95() < 5
    assert np.allclose(field(output, "VolumeToSensor").reshape(4, 4), found)
    world = field(output, "WorldToTracker").reshape(4, 4)
    assert np.allclose(field(output, "Covariance").reshape(12, 12), field(output, "Covariance").reshape(12, 12).T)
    assert math.isclose(math.sqrt(np.trace(field(output, "TargetCovariance").reshape(3, 3))), filter.GetTargetRms())
    assert field(output, "TargetRadius95")[0] == filter.GetTargetRadius95()
    residuals = vtk_to_numpy(output.GetPointData().GetArray("Residual"))
    for i in range(10):
        by_alignment = (volumes[i] @ target)[:3]
        by_tracker = (np.linalg.inv(world) @ sensors[i] @ found @ target)[:3]
        assert np.allclose(output.GetPoint(i), by_alignment) and np.allclose(residuals[i], by_tracker - by_alignment)
    assert list(vtk_to_numpy(output.GetPointData().GetArray("Inlier"))) == [i != 3 for i in range(10)]
    assert output.GetPointData().GetAbstractArray("ScanName").GetValue(3) == "V3"
    report = json.loads(filter.GetReport())
    assert report["inliers"] == 9 and not report["scans"][3]["inlier"] and "others place it" in report["scans"][3]["reason"]
    assert np.allclose(report["VolumeToSensor"], found) and np.allclose(report["target"], TARGET)
    assert len(report["advice"]) == 3 and "V3" in " ".join(report["notes"])
    assert np.allclose(report["scans"][0]["mm"], np.linalg.norm(residuals[0]))


def check_inputs():
    sensors, volumes = scans(7)
    wanted = result_of(calibrate(zip(sensors, volumes))[0])
    for make in (points_of, table_of):
        filter, errors = calibrate(sensors=make("SensorToTracker", sensors), volumes=make("VolumeToWorld", volumes))
        assert not errors and np.array_equal(result_of(filter), wanted), errors
    # any name, when there is one array of 16 components
    filter, errors = calibrate(sensors=points_of("A", sensors), volumes=table_of("B", volumes))
    assert not errors and np.array_equal(result_of(filter), wanted), errors
    # by name, in another order, with one too many on either side
    names = [f"V{i}" for i in range(7)]
    order = [4, 2, 6, 0, 1, 3, 5]
    mixed = points_of("VolumeToWorld", np.concatenate([volumes[order], volumes[:1]]), [names[i] for i in order] + ["X"])
    more = points_of("SensorToTracker", np.concatenate([sensors, sensors[:1]]), names + ["Y"])
    filter, errors = calibrate(sensors=more, volumes=mixed)
    assert not errors and np.array_equal(result_of(filter), wanted), errors
    notes = " ".join(json.loads(filter.GetReport())["notes"])
    assert "X has an alignment and no sensor pose" in notes and "Y has a sensor pose and no alignment" in notes
    # both ways at once
    filter, errors = calibrate(zip(sensors[:3], volumes[:3]), points_of("S", sensors[3:]), points_of("M", volumes[3:]))
    assert not errors and np.array_equal(result_of(filter), wanted), errors
    filter.RemoveAllPairs()
    filter.Update()
    assert filter.GetNumberOfPairs() == 0 and filter.GetOutput().GetNumberOfPoints() == 4


def check_noise():
    sensors, volumes = scans(12)
    filter, errors = calibrate(zip(sensors, volumes), EstimateNoise=True, SensorNoiseDegrees=0.05, SensorNoiseMm=0.14,
                               VolumeNoiseDegrees=0.05, VolumeNoiseMm=0.14)
    assert not errors and 3 < json.loads(filter.GetReport())["noise"]["scale"] < 8, errors
    # a camera that errs by turning about a board
    sensors, volumes = scans(20, noise=0.1)
    board = pose((0, 0, 0), (0, 0, 1300))
    volumes = np.array([M @ board @ pose(random.normal(0, math.radians(0.05), 3), (0, 0, 0)) @ np.linalg.inv(board) for M in volumes])
    filter, errors = calibrate(zip(sensors, volumes))
    report = json.loads(filter.GetReport())
    assert not errors and report["noise"]["estimated"] and report["noise"]["scale"] == 1, report["noise"]
    assert 0.035 < report["noise"]["volume_degrees"] < 0.075 and report["noise"]["sensor_mm"] < 0.2, report["noise"]
    assert "contradict the ratio" in " ".join(report["notes"]), report["notes"]
    filter, errors = calibrate(zip(sensors, volumes), EstimateNoise=False)
    report = json.loads(filter.GetReport())
    assert not errors and report["noise"]["volume_degrees"] == 0.25 and not report["noise"]["estimated"], report["noise"]


def check_refusals():
    sensors, volumes = scans(7)

    def refused(words, *arguments, **properties):
        filter, errors = calibrate(*arguments, **properties)
        assert errors and words in errors[0], errors
        assert filter.GetOutput().GetNumberOfPoints() == 0 and not filter.GetVolumeToSensor(vtkMatrix4x4())
        assert filter.GetReport() == "" and math.isnan(filter.GetTargetRadius95())

    refused("three different scans")
    refused("three different scans", zip(sensors[:2], volumes[:2]))
    bad = sensors.copy()
    bad[2, 0, 0] = math.nan
    refused("sensor pose of scan 3", zip(bad, volumes))
    bad = volumes.copy()
    bad[4, :3, :3] *= 1.2
    refused("alignment of scan 5 is not rigid", zip(sensors, bad))
    metres = sensors.copy()
    metres[:, :3, 3] *= 0.001
    refused("metres", zip(metres, volumes))
    refused("no alignments", sensors=points_of("S", sensors))
    refused("no sensor poses", volumes=points_of("M", volumes))
    refused("7 sensor poses and 6 alignments", sensors=points_of("S", sensors), volumes=points_of("M", volumes[:6]))
    refused("16 components", sensors=vtkPolyData(), volumes=points_of("M", volumes))
    refused("names \"a\" twice", sensors=points_of("S", sensors, list("aabcdef")), volumes=points_of("M", volumes, list("abcdefg")))
    for count in (0, 5, 9):  # names that do not belong to the poses
        refused(f"has {count} names in the array \"Name\" for 7 poses", volumes=points_of("M", volumes),
                sensors=points_of("S", sensors, list("abcdefghi")[:count], named=True))
    refused("SensorNoiseMm is -1 mm; it must be in [0, 100]", zip(sensors, volumes), SensorNoiseMm=-1)
    refused("must not be zero", zip(sensors, volumes), SensorNoiseDegrees=0, VolumeNoiseDegrees=0)
    # and works again
    filter, _ = calibrate(zip(sensors[:2], volumes[:2]))
    for sensor, volume in zip(sensors[2:], volumes[2:]):
        filter.AddPair(matrix_of(sensor), matrix_of(volume))
    filter.Update()
    assert filter.GetNumberOfInliers() == 7


check_exact()
check_output()
check_inputs()
check_noise()
check_refusals()
print("hand-eye calibration: all is well")
