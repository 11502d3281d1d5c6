#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundDistanceMap: what it measures, of which region, and what it refuses. (Pose and arrays: TestDataContract.py.)"""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
import echorama

spacing = np.array([0.5, 0.8, 1.25])
size = (9, 8, 7)  # x, y, z
x, y, z = np.meshgrid(*[np.arange(n) for n in size], indexing="ij")


def volume(**arrays):
    image = vtkImageData()
    image.SetDimensions(size)
    image.SetSpacing(spacing)
    image.SetDirectionMatrix(0, -1, 0, 1, 0, 0, 0, 0, 1)
    for name, values in arrays.items():
        array = numpy_to_vtk(np.ascontiguousarray(values.ravel(order="F")), deep=1)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    return image


def distance(image, chosen=None, **properties):
    filter = echorama.vtkUltrasoundDistanceMap()
    filter.SetInputData(image)
    if chosen:
        filter.SetInputArrayToProcess(0, 0, 0, 0, chosen)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    errors = []
    filter.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
    filter.Update()
    array = filter.GetOutput().GetPointData().GetArray("Distance")
    assert bool(errors) == (array is None)
    return None if array is None else vtk_to_numpy(array).reshape(size, order="F")


def brute_force(sites):
    """Squared distance to the nearest of some index positions."""
    offsets = [(x - i) ** 2 * spacing[0] ** 2 + (y - j) ** 2 * spacing[1] ** 2 + (z - k) ** 2 * spacing[2] ** 2 for i, j, k in sites]
    return np.min(offsets, axis=0)


intensity = np.full(size, 7, np.uint8)
intensity[2, 3, 4] = 0
valid = ((x - 4) ** 2 + (y - 3) ** 2 + (z - 3) ** 2 < 8).astype(np.uint8)
inside = valid != 0
image = volume(Intensity=intensity, ValidRegion=valid)
rim = [(i, j, k) for i in range(-1, 10) for j in range(-1, 9) for k in range(-1, 8) if not (0 <= i < 9 and 0 <= j < 8 and 0 <= k < 7)]

# The three measures, in mm and squared.
outside = brute_force(np.argwhere(inside))
depth = brute_force([*np.argwhere(~inside), *rim])
for measure, truth in ((0, outside), (1, depth), (2, np.where(inside, -depth, outside))):
    assert np.allclose(distance(image, Measure=measure, Squared=True), truth, rtol=1e-6), measure
    assert np.allclose(distance(image, Measure=measure), np.sign(truth) * np.sqrt(np.abs(truth)), rtol=1e-6), measure

# A voxel that is not a number is not in the region; without ValidRegion every other one is.
broken = np.full(size, 1.0, np.float32)
broken[4, 3, 3] = np.nan
assert distance(volume(Intensity=broken, ValidRegion=valid))[4, 3, 3] == np.float32(0.5)
assert distance(volume(Intensity=broken))[4, 3, 3] == np.float32(0.5)
assert np.count_nonzero(distance(volume(Intensity=broken))) == 1
assert np.allclose(distance(volume(Intensity=intensity), Measure=1), np.sqrt(brute_force(rim)))

# A chosen array is the region, even where it is not valid.
label = np.zeros(size, np.int16)
label[8, 7, 6] = -3
assert np.allclose(distance(volume(Intensity=intensity, ValidRegion=valid, Label=label), "Label"), np.sqrt(brute_force([(8, 7, 6)])))

# An empty region is infinitely far and nowhere deep.
nothing = volume(Intensity=intensity, ValidRegion=np.zeros(size, np.uint8))
assert np.all(np.isposinf(distance(nothing)))
assert np.all(np.isposinf(distance(nothing, Measure=2)))
assert np.all(distance(nothing, Measure=1) == 0)

# What it cannot work on: no such array, no intensities, several numbers per voxel.
assert distance(image, "Nothing") is None
assert distance(volume()) is None
pair = volume(Intensity=intensity)
vectors = numpy_to_vtk(np.zeros((intensity.size, 3), np.float32), deep=1)
vectors.SetName("Vectors")
pair.GetPointData().AddArray(vectors)
assert distance(pair, "Vectors") is None

# A measure that there is not is refused, and the parameters say themselves.
filter = echorama.vtkUltrasoundDistanceMap()
filter.SetMeasureToSigned()
complaints = []
filter.AddObserver("ErrorEvent", lambda *_: complaints.append(1))
filter.SetMeasure(9)
assert complaints and filter.GetMeasure() == filter.SIGNED
assert "Measure: signed" in str(filter)
