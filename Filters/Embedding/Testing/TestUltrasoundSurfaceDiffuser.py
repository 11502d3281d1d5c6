#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundSurfaceDiffuser: what it spreads, and what it refuses. (Pose and arrays: TestDataContract.py; numbers: TestDiffusion.cxx.)"""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
import echorama

shape = (40, 32, 24)
random = np.random.default_rng(5)


def run(arrays, spacing=(1, 1, 1), **properties):
    """Mean and deviation; None when it failed, with its message."""
    image = vtkImageData()
    image.SetDimensions(shape)
    image.SetSpacing(spacing)
    for name, values in arrays.items():
        array = numpy_to_vtk(np.ascontiguousarray(values.ravel(order="F")), deep=1)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    filter = echorama.vtkUltrasoundSurfaceDiffuser()
    filter.SetInputData(image)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    errors = []

    def failed(_, __, message):
        errors.append(message)

    failed.CallDataType = "string0"
    filter.AddObserver(vtkCommand.ErrorEvent, failed)
    filter.Update()
    data = filter.GetOutput().GetPointData()
    assert bool(errors) == (data.GetNumberOfArrays() == 0), errors
    if errors:
        return None, errors[0]
    return [vtk_to_numpy(data.GetArray(name)).reshape(shape, order="F") for name in ("Intensity", "Deviation")]


def naive(values, voxels, spacing, at, d):
    distance = np.linalg.norm((voxels - at) * spacing, axis=1)
    if distance.min() == 0:
        return values[distance.argmin()]
    weights = (distance.min() / distance) ** d
    return (weights * values).sum() / weights.sum()


x, y, z = np.indices(shape)
region = ((x - 18) ** 2 + (y - 15) ** 2 + (z - 11) ** 2 < 64).astype(np.uint8)
inner = np.ones(shape, bool)
for shift in np.ndindex(3, 3, 3):
    inner &= np.roll(region, np.subtract(shift, 1), (0, 1, 2)) != 0
surface = np.argwhere((region != 0) & ~inner)

# The values of the surface, without smoothing, against the sum written out; each side with its exponent.
for kind in (np.uint8, np.int16, np.float32):
    data = (250 * random.random(shape)).astype(kind)
    own = data[tuple(surface.T)].astype(float)
    spacing = np.array([0.7, 1.0, 1.2])
    for exact in (False, True):
        mean, deviation = run({"Intensity": data, "ValidRegion": region}, spacing, SmoothMm=0, InsideExponent=5, OutsideExponent=3, Exact=exact)
        assert mean.dtype == np.float32 and (deviation == 0).all()
        for at in [(18, 15, 11), (16, 13, 9), (0, 0, 0), (39, 31, 23), (30, 15, 11), (18, 26, 3), tuple(surface[7])]:
            expected = naive(own, surface, spacing, at, 5 if region[at] else 3)
            assert abs(mean[at] - expected) < 0.5, (kind, exact, at, mean[at], expected)

# Smoothed, a constant stays, what is outside does not darken it, and noise keeps its deviation.
data = np.where(region != 0, 80, 0).astype(np.uint8)
mean, deviation = run({"Intensity": data, "ValidRegion": region})
assert (np.abs(mean - 80) < 1e-4).all() and (np.abs(deviation) < 1e-3).all()
data = np.where(region != 0, 100 + 20 * random.standard_normal(shape), 0).astype(np.float32)
mean, deviation = run({"Intensity": data, "ValidRegion": region}, SmoothMm=4)
assert 95 < mean.min() and mean.max() < 105 and 17 < deviation.min() and deviation.max() < 23

# A voxel that is no number has no say, and no surface through it.
data[18, 15, 11] = np.nan
mean, deviation = run({"Intensity": data, "ValidRegion": region})
assert np.isfinite(mean).all() and np.isfinite(deviation).all()

# One valid voxel is everywhere; none is refused, and so is a volume without a region.
one = np.zeros(shape, np.uint8)
one[3, 4, 5] = 1
mean, _ = run({"Intensity": data, "ValidRegion": one}, SmoothMm=0)
assert (mean == data[3, 4, 5]).all()
assert "no valid voxel" in run({"Intensity": data, "ValidRegion": one * 0})[1]
assert "no ValidRegion" in run({"Intensity": data})[1]

# Parameters, and what is out of their ranges.
filter = echorama.vtkUltrasoundSurfaceDiffuser()
assert (filter.GetInsideExponent(), filter.GetOutsideExponent(), filter.GetSmoothMm(), filter.GetExact()) == (6, 4, 3, False)
for name, value in {"InsideExponent": 0, "OutsideExponent": 100, "Accuracy": 1, "SmoothMm": -1}.items():
    assert f"{name} is {value}" in run({"Intensity": data, "ValidRegion": region}, **{name: value})[1]
