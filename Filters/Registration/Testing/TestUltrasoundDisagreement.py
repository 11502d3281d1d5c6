#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped disagreement: a known shift is told, block by block, of the right pair, and only where both volumes are real."""
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkImageData, vtkMultiBlockDataSet
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkCommonMath import vtkMatrix4x4

from echorama import vtkUltrasoundDisagreement, vtkUltrasoundVolume

SHIFT = np.array([1.3, -0.8, 0.45])
SIDE = 44
waves = np.random.default_rng(3)
directions = waves.normal(size=(60, 3))
WAVES = directions / np.linalg.norm(directions, axis=1)[:, None] * (2 * np.pi / waves.uniform(4, 16, (60, 1)))
PHASES = waves.uniform(0, 2 * np.pi, 60)


def tissue(points):
    return 110 + 5 * np.cos(points @ WAVES.T + PHASES).sum(-1)


def volume(origin, turn, shift=np.zeros(3), seen_to_x=math.inf):
    image = vtkImageData()
    image.SetDimensions(SIDE, SIDE, SIDE)
    image.SetOrigin(origin)
    image.SetDirectionMatrix(math.cos(turn), -math.sin(turn), 0, math.sin(turn), math.cos(turn), 0, 0, 0, 1)
    points = np.array([image.GetPoint(i) for i in range(image.GetNumberOfPoints())])
    grain = np.random.default_rng(int(1000 * turn) + 7).normal(0, 3, len(points))
    seen = points[:, 0] <= seen_to_x
    for name, values in (("Intensity", np.clip(tissue(points - shift) + grain, 0, 255) * seen), ("ValidRegion", seen)):
        array = numpy_to_vtk(values.astype(np.uint8), deep=True)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    return image


def filter_of(*inputs):
    filter = vtkUltrasoundDisagreement()
    filter.messages = []

    def note(caller, event, text):
        filter.messages.append(text)

    note.CallDataType = "string0"
    filter.AddObserver(vtkCommand.ErrorEvent, note)
    for data in inputs:
        filter.AddInputDataObject(0, data)
    return filter


def arrays_of(image):
    return {image.GetPointData().GetArrayName(i): vtk_to_numpy(image.GetPointData().GetArray(i))
            for i in range(image.GetPointData().GetNumberOfArrays())}


fixed, moving = volume([0, 0, 0], 0.0), volume([4, -3, 2], 0.2, SHIFT)

# 1. what comes out lies where it was promised, and says the shift
filter = filter_of(fixed, moving)
filter.UpdateInformation()
promised = filter.GetOutputInformation(0)
extent = promised.Get(vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT())
origin = promised.Get(vtkDataObject.ORIGIN())
filter.Update()
output = filter.GetOutput()
assert not filter.messages, filter.messages
assert output.GetExtent() == extent and output.GetOrigin() == origin and output.GetSpacing() == (6.0, 6.0, 6.0)
assert output.GetPointData().GetScalars().GetName() == "Disagreement" and output.GetPointData().GetVectors().GetName() == "Shift"
arrays = arrays_of(output)
places = np.array([output.GetPoint(i) for i in range(output.GetNumberOfPoints())])
known = arrays["KnownDirections"] > 0
assert known.sum() > 50 and filter.GetNumberOfKnownBlocks() == known.sum() <= filter.GetNumberOfBlocks() <= known.size
assert np.isnan(arrays["Disagreement"][~known]).all() and np.isfinite(arrays["Disagreement"][known]).all()
assert (arrays["FirstVolume"][known] == 0).all() and (arrays["SecondVolume"][known] == 1).all()
assert (arrays["FirstVolume"][~known] == -1).all() and (arrays["SecondVolume"][~known] == -1).all()
full = arrays["KnownDirections"] == 3
errors = np.linalg.norm(arrays["Shift"][full] - SHIFT, axis=1)
print(f"{full.sum()} blocks know all of the shift, to {np.median(errors):.2f} mm in the median")
assert full.sum() > 50 and np.median(errors) < 0.2
assert np.median(errors / arrays["Deviation"][full]) < 3 and (arrays["Correlation"][full] > 0.5).all()
assert abs(filter.GetMedian() - np.linalg.norm(SHIFT)) < 0.15
assert np.isclose(filter.GetMedian(), np.median(arrays["Disagreement"][known]), atol=0.02)
assert filter.GetMedian() < filter.GetPercentile95() <= np.nanmax(arrays["Disagreement"]) + 1e-6
field = lambda name: vtk_to_numpy(output.GetFieldData().GetArray(name)).ravel()
assert field("Median")[0] == filter.GetMedian() and field("Percentile95")[0] == filter.GetPercentile95()
assert tuple(field("Blocks")) == (filter.GetNumberOfBlocks(), filter.GetNumberOfKnownBlocks())

# 2. a multi-block of both is the same
blocks = vtkMultiBlockDataSet()
blocks.SetBlock(0, fixed)
blocks.SetBlock(1, moving)
together = filter_of(blocks)
together.Update()
assert all(np.array_equal(values, arrays_of(together.GetOutput())[name], equal_nan=True) for name, values in arrays.items())

# 3. moved back by the shift, both agree
back = vtkImageData()
back.ShallowCopy(moving)
motion = vtkMatrix4x4()
for axis in range(3):
    motion.SetElement(axis, 3, -SHIFT[axis])
assert vtkUltrasoundVolume.Move(back, motion)
agreeing = filter_of(fixed, back)
agreeing.Update()
assert agreeing.GetNumberOfKnownBlocks() > 50 and agreeing.GetMedian() < 0.1, agreeing.GetMedian()

# 4. nothing is told where one of both has seen nothing; a third volume that agrees with the first is told where it is alone
half = volume([4, -3, 2], 0.2, SHIFT, seen_to_x=20.0)
partly = filter_of(fixed, half)
partly.Update()
there = arrays_of(partly.GetOutput())["KnownDirections"] > 0
where = np.array([partly.GetOutput().GetPoint(i) for i in range(partly.GetOutput().GetNumberOfPoints())])
assert there.sum() > 20 and (where[there, 0] <= 20.0).all(), where[there, 0].max()
three = filter_of(fixed, half, volume([2, 1, -2], 0.1))
three.Update()
pairs = arrays_of(three.GetOutput())
where = np.array([three.GetOutput().GetPoint(i) for i in range(three.GetOutput().GetNumberOfPoints())])
beyond = (where[:, 0] > 21.0) & (pairs["KnownDirections"] > 0)
assert beyond.sum() > 20 and (pairs["FirstVolume"][beyond] == 0).all() and (pairs["SecondVolume"][beyond] == 2).all()
assert np.median(pairs["Disagreement"][beyond]) < 0.15
of_half = (pairs["FirstVolume"] == 1) | (pairs["SecondVolume"] == 1)
known_there = {tuple(np.round(place, 6)) for place in np.array([partly.GetOutput().GetPoint(i) for i in np.flatnonzero(there)])}
told = [of_half[i] for i in range(len(where)) if tuple(np.round(where[i], 6)) in known_there]
assert len(told) > 20 and np.mean(told) > 0.95, ("the pair that disagrees most is told", len(told), np.mean(told))

# 5. parameters arrive: larger blocks, larger steps between them
filter.SetBlockMm(20)
filter.Update()
assert filter.GetOutput().GetSpacing() == (10.0, 10.0, 10.0)

# 6. what cannot be done is said, nothing comes out, and the next good input works
for spoil, said in ((lambda f: f.SetStepMm(0.01), "StepMm is too small"), (lambda f: f.SetSearchMm(0), "SearchMm"),
                    (lambda f: f.RemoveInputConnection(0, 1), "at least two")):
    bad = filter_of(fixed, moving)
    spoil(bad)
    bad.Update()
    assert any(said in message for message in bad.messages), (said, bad.messages)
    assert bad.GetOutput().GetNumberOfPoints() == 0 and math.isnan(bad.GetMedian())
apart = filter_of(fixed, volume([500, 0, 0], 0.3))
apart.Update()
assert not apart.messages and apart.GetNumberOfBlocks() == 0 and apart.GetOutput().GetNumberOfPoints() == 1
assert np.isnan(arrays_of(apart.GetOutput())["Disagreement"]).all() and math.isnan(apart.GetMedian())
