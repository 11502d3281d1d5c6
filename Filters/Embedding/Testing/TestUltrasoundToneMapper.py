#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundToneMapper: grain, grain on levels, and what it refuses. (Pose and arrays: TestDataContract.py; numbers: TestToneMapping.cxx.)"""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
import echorama

shape = (48, 40, 32)
random = np.random.default_rng(5)


def volume(**arrays):
    image = vtkImageData()
    image.SetDimensions(next(iter(arrays.values())).shape)
    for name, values in arrays.items():
        array = numpy_to_vtk(np.ascontiguousarray(values.ravel(order="F")), deep=1)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    return image


def run(image, levels=None, **properties):
    """The result, or None when it failed."""
    filter = echorama.vtkUltrasoundToneMapper()
    filter.SetInputData(0, image)
    if levels:
        filter.SetInputData(1, levels)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    errors = []
    filter.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
    filter.Update()
    array = filter.GetOutput().GetPointData().GetArray("Intensity")
    assert bool(errors) == (array is None)
    return None if array is None else vtk_to_numpy(array).reshape(shape, order="F")


noise = volume(Intensity=(60 + np.arange(48)[:, None, None] + 12 * random.standard_normal(shape)).clip(0, 255).astype(np.uint8))

# 1. The grain.
grain = run(noise)
assert grain.dtype == np.float32
assert abs(grain.mean()) < 0.02 and abs(grain.std() - 1) < 0.03
assert abs(grain[:10].mean()) < 0.05 and abs(grain[-10:].mean()) < 0.05
quotient = run(noise, MatchDeviation=False)
assert abs(quotient.mean() - 1) < 0.01 and 0.1 < quotient.std() < 0.2

# 2. On levels.
mean, deviation = np.full(shape, 40, np.float32), np.full(shape, 9, np.float64)
mean[24:] = 80
np.testing.assert_allclose(run(noise, volume(Intensity=mean, Deviation=deviation)), mean + 9 * grain, rtol=1e-5)
np.testing.assert_allclose(run(noise, volume(Intensity=mean), MatchDeviation=False), mean * quotient, rtol=1e-5)

# 3. What is refused.
assert run(noise, volume(Intensity=mean)) is None  # no Deviation
assert run(noise, volume(Intensity=np.zeros((4, 4, 4), np.float32), Deviation=np.zeros((4, 4, 4)))) is None  # another grid
assert run(volume(Coverage=np.zeros((4, 4, 4), np.uint8).reshape(4, 4, 4)[:, :, :0])) is None  # no intensities
