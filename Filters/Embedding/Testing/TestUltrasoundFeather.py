#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundFeather: what it adds, what it leaves alone, what it refuses. (Pose and arrays: TestDataContract.py; numbers: TestFeather.cxx.)"""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
import echorama

shape = (40, 30, 20)
random = np.random.default_rng(5)


def volume(**arrays):
    image = vtkImageData()
    image.SetDimensions(next(iter(arrays.values())).shape)
    for name, values in arrays.items():
        array = numpy_to_vtk(np.ascontiguousarray(values.ravel(order="F")), deep=1)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    return image


def run(image, background, **properties):
    """The arrays of the result by name; empty when it failed."""
    filter = echorama.vtkUltrasoundFeather()
    filter.SetInputData(0, image)
    filter.SetInputData(1, background)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    errors = []
    filter.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
    filter.Update()
    data = filter.GetOutput().GetPointData()
    assert bool(errors) == (data.GetNumberOfArrays() == 0)
    return {data.GetArrayName(i): vtk_to_numpy(data.GetArray(i)).reshape(filter.GetOutput().GetDimensions(), order="F")
            for i in range(data.GetNumberOfArrays())}


region = np.zeros(shape, np.uint8)
region[10:, 5:25, 4:] = 1
other = volume(Intensity=(100 + 20 * random.random(shape)).astype(np.float32))

for kind in (np.uint8, np.uint16, np.int16, np.float32, np.float64):
    data = (100 * random.random(shape)).astype(kind)
    result = run(volume(Intensity=data, ValidRegion=region), other, FeatherMm=3)
    assert result["Intensity"].dtype == kind and result["Embedding"].dtype == np.uint8
    assert set(np.unique(result["Embedding"])) == {1, 2, 3}
    assert (result["ValidRegion"] == region).all()
    untouched = result["Embedding"] == 1
    assert (result["Intensity"][untouched] == data[untouched]).all() and untouched[20, 15, 12]
    assert ((result["Embedding"] == 3) == (region == 0)).all()
    assert result["Intensity"][region == 0].min() >= 99

# A voxel that is no number is not seen, and where all is data nothing fades.
data = (100 * random.random(shape)).astype(np.float32)
data[20, 15, 12] = np.nan
result = run(volume(Intensity=data), other)
assert result["Embedding"][20, 15, 12] == 3 and result["ValidRegion"].sum() == data.size - 1
assert (result["Embedding"] == 1).mean() > 0.9
result = run(volume(Intensity=data, ValidRegion=np.ones(shape, np.uint8)), other)
assert result["Embedding"][20, 15, 12] == 3 and result["ValidRegion"][20, 15, 12] == 0
data[20, 15, 12] = 5
assert (run(volume(Intensity=data), other)["Embedding"] == 1).all()

# What is refused: also what was embedded before.
again = run(volume(Intensity=data, ValidRegion=region), other)
assert not run(volume(**again), other)
assert not run(volume(Intensity=data, ValidRegion=np.zeros(shape, np.uint8)), other)
assert not run(volume(Intensity=data), volume(Intensity=np.zeros((4, 4, 4), np.float32)))
assert not run(volume(Intensity=data, ValidRegion=region.astype(np.int16)), other)
