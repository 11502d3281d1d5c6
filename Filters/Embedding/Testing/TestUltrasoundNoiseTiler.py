#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundNoiseTiler: noise volumes with and without a recorded probe become one of a larger fan."""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkMultiBlockDataSet

import echorama

acquisition = echorama.vtkUltrasoundAcquisition


def noise(seed, probe=(60, 30, 40, 15, 2, 42), recorded=True, level=100.0):
    """Random samples along the beams of a probe (degrees and mm), brighter with depth, as voxels."""
    random = np.random.default_rng(seed)
    samples = level + random.normal(0, 15, (24, 32, 48)) + np.arange(48)
    image = vtkImageData()
    image.SetDimensions(samples.shape[::-1])
    array = numpy_to_vtk(samples.astype(np.float32).ravel(), deep=1)
    array.SetName("Intensity")
    image.GetPointData().AddArray(array)
    field = numpy_to_vtk(np.array(probe, float)[None], deep=1)
    field.SetName(acquisition.ProbeGeometryName())
    image.GetFieldData().AddArray(field)
    converter = echorama.vtkUltrasoundScanConverter()
    converter.SetInputData(image)
    converter.SetSpacingMm(1.0)
    converter.Update()
    volume = vtkImageData()
    volume.ShallowCopy(converter.GetOutput())
    if not recorded:
        volume.GetFieldData().Initialize()
    return volume


def tile(volumes, **properties):
    """(filter, its errors)"""
    filter = echorama.vtkUltrasoundNoiseTiler()
    for volume in volumes:
        filter.AddInputDataObject(0, volume)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    errors = []

    def note(caller, event, text):
        errors.append(text)

    note.CallDataType = "string0"
    filter.AddObserver(vtkCommand.ErrorEvent, note)
    filter.GetExecutive().AddObserver(vtkCommand.ErrorEvent, lambda *_: None) # it would print that the filter failed
    filter.Update()
    return filter, errors


def array(image, name):
    return vtk_to_numpy(image.GetPointData().GetArray(name))


def probe_of(image):
    return vtk_to_numpy(image.GetFieldData().GetArray(acquisition.ProbeGeometryName())).ravel()


def check_two():
    a, b = noise(1), noise(2)
    filter, errors = tile([a, b])
    output = filter.GetOutput()
    assert not errors and filter.GetNotes() == "", (errors, filter.GetNotes())
    probe = probe_of(output)
    assert 100 < probe[0] < 110 and 34 < probe[2] < 40, probe
    assert abs(probe[1] / np.radians(probe[0]) - 30 / np.radians(60)) < 1e-6, probe
    assert output.GetPointData().GetScalars().GetName() == "Intensity" and output.GetSpacing() == (1.0, 1.0, 1.0)
    values, valid = array(output, "Intensity"), array(output, "ValidRegion")
    assert values.dtype == np.float32 and set(np.unique(valid)) == {0, 1} and np.all(values[valid == 0] == 0)
    assert 100 < values[valid == 1].mean() < 145 and values[valid == 1].min() > 40
    single, errors = tile([a])
    assert not errors and 55 < probe_of(single.GetOutput())[0] < 60
    assert array(single.GetOutput(), "ValidRegion").sum() < 0.62 * valid.sum()
    # More overlap, a smaller fan; the same again for the same; used again where there are too few.
    closer, errors = tile([a, b], OverlapDegrees=25)
    assert not errors and abs(probe_of(closer.GetOutput())[0] - (probe[0] - 15)) < 1.5
    again, errors = tile([a, b])
    assert np.array_equal(array(again.GetOutput(), "Intensity"), values)
    three, errors = tile([a], Columns=3, SpacingMm=2)
    assert not errors and probe_of(three.GetOutput())[0] > 145 and three.GetOutput().GetSpacing()[0] == 2
    rows, errors = tile([a, b], Rows=2)
    assert not errors and 55 < probe_of(rows.GetOutput())[0] < 60 and probe_of(rows.GetOutput())[2] > 58
    # A parameter that changes later.
    rows.SetRows(1)
    rows.Update()
    assert np.array_equal(array(rows.GetOutput(), "Intensity"), values)


def check_fitted_and_blocks():
    blocks = vtkMultiBlockDataSet()
    blocks.SetBlock(0, noise(1, recorded=False))
    blocks.SetBlock(1, noise(2))
    filter, errors = tile([blocks])
    assert not errors, errors
    assert "its fan was fitted to its valid region" in filter.GetNotes()
    probe = probe_of(filter.GetOutput())
    assert 100 < probe[0] < 111 and probe[4] < 2.5, probe # depth 0 is the near edge of what is fitted


def check_refusals():
    good = noise(1)
    ball = vtkImageData()
    ball.SetDimensions(30, 30, 30)
    z, y, x = np.mgrid[:30, :30, :30] - 15.0
    for name, values in {"Intensity": x, "ValidRegion": (x**2 + y**2 + z**2 < 150).astype(np.uint8)}.items():
        data = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=1)
        data.SetName(name)
        ball.GetPointData().AddArray(data)
    for volumes, properties, words in (
        ([good, ball], {}, "no fan explains"),
        ([good, good], {"OverlapDegrees": 70}, "OverlapDegrees is 70"),
        ([good], {"Columns": 9}, "no probe has that"),
        ([good, noise(2, (0, 30, 40, 15, 2, 42))], {}, "runs straight"),
    ):
        filter, errors = tile(volumes, **properties)
        assert errors and words in errors[0], (words, errors)
        assert filter.GetOutput().GetNumberOfPoints() == 0
    for name, value in {"Columns": -3, "Rows": 0, "OverlapDegrees": -1, "OverlapMm": -1, "SpacingMm": -1}.items():
        filter, errors = tile([good], **{name: value})
        assert errors and f"{name} is {value}" in errors[0] and f"{name}: {value}" in str(filter), (name, errors)


check_two()
check_fitted_and_blocks()
check_refusals()
