#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundEmbedder: the whole way on a phantom, what stays, what it refuses. (Numbers: TestEmbed.cxx, TestEmbedGrid.cxx.)"""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
import echorama


def arrays(image):
    data = image.GetPointData()
    return {data.GetArrayName(i): vtk_to_numpy(data.GetArray(i)).reshape(image.GetDimensions(), order="F")
            for i in range(data.GetNumberOfArrays())}


def put(image, name, values):
    array = numpy_to_vtk(np.ascontiguousarray(values.ravel(order="F")), deep=1)
    array.SetName(name)
    image.GetPointData().AddArray(array)


def box(kind=np.uint8, shape=(40, 36, 44), **arrays_of):
    image = vtkImageData()
    image.SetDimensions(shape)
    image.SetSpacing(1, 1.1, 0.9)
    image.SetOrigin(-20, 5, 12)
    image.SetDirectionMatrix([0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1])
    put(image, "Intensity", (60 + 60 * np.random.default_rng(4).random(shape)).astype(kind))
    for name, values in arrays_of.items():
        put(image, name, values)
    return image


def run(image, noise=(), form=None, **properties):
    """The output, or None, and the filter."""
    filter = echorama.vtkUltrasoundEmbedder()
    filter.SetInputData(0, image)
    for each in noise:
        filter.AddInputData(1, each)
    if form:
        filter.SetInputData(2, form)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    errors = []
    filter.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
    filter.Update()
    result = filter.GetOutput()
    made = result.GetPointData().GetNumberOfArrays() > 0
    assert bool(errors) != made
    return (result if made else None), filter


def check(image, result, factor=1):
    """Every voxel of the data is where it was; those labelled so are the same to the last bit; nothing else is valid."""
    before, after = arrays(image), arrays(result)
    labels, n = after["Embedding"], image.GetDimensions()
    start = [(min(size, factor) - 1) // 2 for size in n]
    corner = [0.0] * 3
    image.TransformIndexToPhysicalPoint(*start, corner)
    index = [0.0] * 3
    result.TransformPhysicalPointToContinuousIndex(corner, index)
    assert np.allclose(index, np.round(index), atol=1e-6)
    first = np.round(index).astype(int)
    assert (first >= 0).all()
    small = tuple(slice(s, None, factor) for s in start)
    data = before["Intensity"][small]
    valid = before.get("ValidRegion", np.ones(n, np.uint8))[small] > 0
    inside = tuple(slice(f, f + s) for f, s in zip(first, data.shape))
    assert after["Intensity"].dtype == before["Intensity"].dtype
    untouched = labels[inside] == 1
    assert untouched.any() and (after["Intensity"][inside][untouched] == data[untouched]).all()
    assert (valid == ((labels[inside] == 1) | (labels[inside] == 2))).all()
    region = np.zeros(labels.shape, bool)
    region[inside] = valid
    assert (after["ValidRegion"].astype(bool) == region).all() and not ((labels == 1) | (labels == 2))[~region].any()
    assert (after["Intensity"][labels == 0] == 0).all()
    return first, labels


# 1. Two views of a phantom, stitched.
views = []
for x in (-20, 20):
    views.append(echorama.vtkUltrasoundPhantomSource())
    views[-1].SetSpacingMm(2)
    x0, y, z = views[-1].GetPosition()
    views[-1].SetPosition(x0 + x, y, z)
stitcher = echorama.vtkUltrasoundStitcher()
for view in views:
    stitcher.AddInputConnection(view.GetOutputPort())
stitcher.Update()
stitched = stitcher.GetOutput()
result, filter = run(stitched, FeatherMm=4)
first, labels = check(stitched, result)
assert (labels == 3).sum() > 0.05 * labels.size
after = arrays(result)
assert set(arrays(stitched)) <= set(after)  # Coverage and its like come along
assert (after["Coverage"][labels == 3] == 0).all()
ring = after["Intensity"][labels == 3].astype(float)
assert 0.3 * after["Intensity"][labels == 1].mean() < ring.mean() < 2 * after["Intensity"][labels == 1].mean() and ring.std() > 2
fields = result.GetFieldData()
assert fields.GetArray("ProbeGeometry") and fields.GetArray("ProbeToWorld")
assert "found from the data" in filter.GetNotes() and "noise is made" in filter.GetNotes()

# 2. The same seed gives the same, another another; the data stay.
again, _ = run(stitched, FeatherMm=4)
other, _ = run(stitched, FeatherMm=4, Seed=2)
assert (arrays(again)["Intensity"] == after["Intensity"]).all()
assert (arrays(other)["Intensity"] != after["Intensity"]).sum() > 0.5 * (labels == 3).sum()

# 3. A preview has every other voxel; another outline holds all the data too.
check(stitched, run(stitched, PreviewFactor=2)[0], 2)
found = vtkImageData()
found.DeepCopy(result)
same, filter = run(stitched, form=found)
assert "fan of the form" in filter.GetNotes() and same.GetDimensions() == result.GetDimensions()

# 4. Real noise: a volume that is smaller than the target, and two.
tiles = [view.GetOutput() for view in views]
for count in (1, 2):
    real, filter = run(stitched, noise=tiles[:count])
    check(stitched, real)
    assert f"that of {count} volume" in filter.GetNotes()

# 5. Types, and volumes that are all data, or hardly any.
for kind in (np.uint8, np.uint16, np.int16, np.float32):
    image = box(kind)
    check(image, run(image, FeatherMm=2)[0])
constant = box()
put(constant, "Intensity", np.full((40, 36, 44), 90, np.uint8))
flat = arrays(run(constant)[0])
assert (flat["Intensity"][flat["Embedding"] > 0] == 90).all()
one = np.zeros((40, 36, 44), np.uint8)
one[20, 18, 22] = 1
result, filter = run(box(ValidRegion=one), FeatherMm=0)
assert result and (arrays(result)["Embedding"] == 1).sum() == 1
assert "a grain of its own" in filter.GetNotes()

# 6. Where there is too little speckle it says so, and what it is of: a tank of water with a wall and a block of speckle.
def tank(block):
    shape = (70, 60, 64)
    chance = np.random.default_rng(7)
    voxels = np.maximum(2 + 1.2 * chance.standard_normal(shape), 0)
    voxels[:, :, 50:53] = 230
    if block:
        real, imaginary = chance.standard_normal((2, *shape))
        for axis in range(3): # grains of some voxels
            real, imaginary = (part + np.roll(part, 1, axis) for part in (real, imaginary))
        voxels[20:, 20:, :40] = (18 * np.hypot(real, imaginary))[20:, 20:, :40]
    image = vtkImageData()
    image.SetDimensions(shape)
    image.SetSpacing(0.25, 0.25, 0.25)
    put(image, "Intensity", np.minimum(voxels, 255).astype(np.uint8))
    return image


for block in (False, True):
    warnings = []
    image = tank(block)
    filter = echorama.vtkUltrasoundEmbedder()
    filter.SetInputData(image)
    filter.AddObserver(vtkCommand.WarningEvent, lambda *_: warnings.append(1))
    filter.Update()
    first, labels = check(image, filter.GetOutput())
    assert filter.GetEnoughSpeckle() == block and len(warnings) == (not block)
    assert (filter.GetSpeckleGrains() > 400) == block and "box" in filter.GetNotes()
    assert 0.15 < filter.GetSpeckleShare() < 0.45 if block else filter.GetSpeckleShare() < 0.05
    assert ("with the grain of the data" if block else "a grain of its own") in filter.GetNotes(), filter.GetNotes()
    # The border is as fine as the data, and so is the margin; both can be set.
    assert 0.75 <= filter.GetUsedFeatherMm() < 2 and (labels == 2).mean() < 0.25
    assert (labels == 3).mean() < 0.25
    # Beside the wall, which runs to the border, the background is as dark as the water.
    invented = arrays(filter.GetOutput())["Intensity"][:first[0], first[1] + 5:first[1] + 55, first[2] + 44:first[2] + 59]
    assert invented.size and invented.mean() < 12, invented.mean()
result, filter = run(tank(True), FeatherMm=1.5, MarginMm=4, Outline=3)
assert filter.GetUsedFeatherMm() == 1.5
assert result.GetFieldData().GetArray("ProbeGeometry").GetTuple(0)[5] > 15.9 + 8
assert run(tank(True), MatchGrain=False)[1].GetSpeckleGrains() == -1

# 7. Blocks that are older than the filter, and lie elsewhere, keep their places; so do volumes that a source exchanges.
first_block, second_block = box(), box(shape=(30, 40, 36))
second_block.SetOrigin(100, 50, -30)
from vtkmodules.vtkCommonDataModel import vtkMultiBlockDataSet
from vtkmodules.vtkCommonExecutionModel import vtkTrivialProducer
blocks = vtkMultiBlockDataSet()
blocks.SetBlock(0, first_block)
blocks.SetBlock(1, second_block)
filter = echorama.vtkUltrasoundEmbedder()
filter.SetMarginMm(3)
filter.SetInputDataObject(0, blocks)
filter.Update()
for number, block in enumerate((first_block, second_block)):
    check(block, filter.GetOutputDataObject(0).GetBlock(number))
producer = vtkTrivialProducer()
producer.SetOutput(first_block)
filter = echorama.vtkUltrasoundEmbedder()
filter.SetInputConnection(producer.GetOutputPort())
filter.Update()
producer.SetOutput(second_block)
filter.Update()
check(second_block, filter.GetOutput())

# 8. What is refused: nothing valid, a form without a fan, what was embedded before.
assert run(run(box())[0])[0] is None
assert run(box(ValidRegion=np.zeros((40, 36, 44), np.uint8)))[0] is None
assert run(box(ValidRegion=one.astype(np.int16)))[0] is None
nothing = box(ValidRegion=np.zeros((40, 36, 44), np.uint8))
assert run(box(), form=nothing)[0] is None

# 9. What needs more memory than is allowed is made slab by slab: from a volume in memory, and from a file that is read by slices.
shape = (90, 70, 240)
long = box(shape=shape, ValidRegion=(np.indices(shape)[0] + np.indices(shape)[1] > 60).astype(np.uint8))
whole, _ = run(long, FeatherMm=2)
writer = echorama.vtkUltrasoundWriter()
writer.SetFileName("long.mha")
writer.SetInputData(long)
assert writer.Write()
reader = echorama.vtkUltrasoundReader()
reader.SetFileName("long.mha")
made = []
for number, source in enumerate((None, reader)):
    filter = echorama.vtkUltrasoundEmbedder()
    if source:
        filter.SetInputConnection(source.GetOutputPort())
    else:
        filter.SetInputData(long)
    filter.SetFeatherMm(2)
    assert not filter.IsLargerThanMemory()
    filter.SetMaximumMemoryGb(0.385)
    assert filter.IsLargerThanMemory()
    filter.UpdateInformation()
    slabs = filter.GetSlabs()
    assert slabs > 3, slabs
    writer = echorama.vtkUltrasoundWriter()
    writer.SetFileName(f"embedded{number}.mha")
    writer.SetInputConnection(filter.GetOutputPort())
    writer.SetNumberOfSlabs(slabs)
    assert writer.Write()
    assert "slab by slab" in filter.GetNotes() and filter.GetUsedFeatherMm() == 2
    back = echorama.vtkUltrasoundReader()
    back.SetFileName(f"embedded{number}.mha")
    back.Update()
    made.append(back.GetOutput())
    _, labels = check(long, made[-1])
    grey = arrays(made[-1])["Intensity"].astype(float)
    expected, now = arrays(whole)["Intensity"].astype(float)[arrays(whole)["Embedding"] == 3], grey[labels == 3]
    assert abs(now.mean() - expected.mean()) < 0.05 * expected.mean() and abs(now.std() - expected.std()) < 0.15 * expected.std()
assert all((a == b).all() for a, b in zip(arrays(made[0]).values(), arrays(made[1]).values()))
errors = []
filter.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
filter.UpdateWholeExtent()  # as a whole it does not fit
assert errors
filter.SetMaximumMemoryGb(0.2)  # nor does what has to be known of it
filter.UpdateInformation()
assert len(errors) > 1
