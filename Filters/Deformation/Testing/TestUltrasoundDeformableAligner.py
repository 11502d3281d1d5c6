# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped deformable aligner: displacements found, volumes unchanged, images that say the field, refusals, the stitcher."""
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkMultiBlockDataSet

from echorama.EchoramaCore import vtkUltrasoundDisplacement
from echorama.EchoramaFiltersDeformation import vtkUltrasoundDeformableAligner

try:
    from echorama.EchoramaFiltersStitching import vtkUltrasoundStitcher
except ImportError:
    vtkUltrasoundStitcher = None

rng = np.random.default_rng(4)
lengths = rng.uniform(8, 30, (30, 1))
directions = rng.normal(size=(30, 3))
waves = directions / np.linalg.norm(directions, axis=1, keepdims=True) * 2 * math.pi / lengths
phases = rng.uniform(0, 2 * math.pi, 30)
CENTRE = np.array([42.0, 36.0, 22.0])


def bump(points, mm):
    """Pressure of a probe."""
    push = np.exp(-((points - CENTRE) ** 2).sum(-1, keepdims=True) / (2 * 20.0**2))
    return mm * push * np.array([0.3, -0.2, 0.93])


def volume(origin, mm=0.0, dtype=np.uint8, dims=(40, 36, 32)):
    image = vtkImageData()
    image.SetDimensions(dims)
    image.SetSpacing(2, 2, 2)
    image.SetOrigin(origin)
    k, j, i = np.meshgrid(*[2.0 * np.arange(n) for n in dims[::-1]], indexing="ij")
    world = np.stack([i, j, k], -1) + np.array(origin)
    world = world + bump(world, mm)
    scene = (120 + 8 * np.cos(world @ waves.T + phases).sum(-1)).clip(1, 254)
    array = numpy_to_vtk(scene.astype(dtype).ravel(), deep=True)
    array.SetName("Intensity")
    image.GetPointData().SetScalars(array)
    return image


def errors_of(algorithm):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    algorithm.AddObserver(vtkCommand.ErrorEvent, note)
    algorithm.GetExecutive().AddObserver(vtkCommand.ErrorEvent, note)
    algorithm.Update()
    return " ".join(messages)


def aligner(*images):
    filter = vtkUltrasoundDeformableAligner()
    filter.SetFinestMm(2)
    filter.SetBendingWeight(200)
    for image in images:
        filter.AddInputDataObject(0, image)
    return filter


def field(image, name):
    array = image.GetFieldData().GetAbstractArray(name)
    return [array.GetVariantValue(n) for n in range(array.GetNumberOfValues())]


a, b = volume((0, 0, 0)), volume((16, 6, 4), 3.0, np.float32)

# 1. the bump is found; volumes are what they were
align = aligner(a, b)
align.Update()
volumes, displacements = align.GetOutput(), align.GetOutputDataObject(1)
assert volumes.GetNumberOfBlocks() == displacements.GetNumberOfBlocks() == 2
for i, image in enumerate((a, b)):
    block = volumes.GetBlock(i)
    assert block.GetPointData().GetArray("Intensity") is image.GetPointData().GetArray("Intensity"), "voxels are shared"
    assert block.GetOrigin() == image.GetOrigin() and image.GetFieldData().GetNumberOfArrays() == 0
    for blocks in (volumes, displacements):
        assert blocks.GetMetaData(i).Get(blocks.NAME()) == f"volume {i + 1}"
assert field(volumes.GetBlock(0), "DeformationApplied")[0].ToDouble() == 0
assert "fixed" in field(volumes.GetBlock(0), "DeformationReason")[0].ToString()
moved = volumes.GetBlock(1)
assert field(moved, "DeformationApplied")[0].ToDouble() == 1, field(moved, "DeformationReason")[0].ToString()
before, after = [v.ToDouble() for v in field(moved, "DeformationSimilarity")]
assert after > before + 0.02, (before, after)
assert 2.0 < field(moved, "DeformationLargest")[0].ToDouble() < 4.0
assert 0.3 < field(moved, "DeformationJacobian")[0].ToDouble() <= 1.0 and field(moved, "DeformationBending")[0].ToDouble() > 0

# 2. the image says the field, on its lattice and between
still, bent = displacements.GetBlock(0), displacements.GetBlock(1)
assert not vtk_to_numpy(still.GetPointData().GetArray("Displacement")).any()
values = vtk_to_numpy(bent.GetPointData().GetArray(vtkUltrasoundDisplacement.DisplacementName()))
assert values.shape == (bent.GetNumberOfPoints(), 3)
result, back = [0.0] * 3, [0.0] * 3
node = bent.FindPoint(list(CENTRE))
assert vtkUltrasoundDisplacement.Evaluate(bent, bent.GetPoint(node), result) and np.allclose(result, values[node])
errors, errors_before = [], []
for x in range(26, 74, 8):
    for y in range(16, 66, 8):
        for z in range(10, 56, 8):
            read = np.array([x, y, z], float)
            belongs = read + bump(read, 3.0)
            assert vtkUltrasoundDisplacement.Invert(bent, list(read), back)
            assert vtkUltrasoundDisplacement.Evaluate(bent, back, result)
            assert np.allclose(np.add(back, result), read, atol=1e-5)
            errors.append(np.linalg.norm(back - belongs))
            errors_before.append(np.linalg.norm(read - belongs))
assert np.mean(errors) < 0.35 * np.mean(errors_before), (np.mean(errors), np.mean(errors_before))

# 3. composite input, another fixed volume
blocks = vtkMultiBlockDataSet()
for i, (image, name) in enumerate(((b, "left"), (a, "right"))):
    blocks.SetBlock(i, image)
    blocks.GetMetaData(i).Set(blocks.NAME(), name)
tree = aligner()
tree.SetInputDataObject(blocks)
tree.SetFixedVolume(1)
tree.Update()
assert [tree.GetOutputDataObject(1).GetMetaData(i).Get(blocks.NAME()) for i in range(2)] == ["left", "right"]
assert np.allclose(vtk_to_numpy(tree.GetOutputDataObject(1).GetBlock(0).GetPointData().GetArray("Displacement")), values)

# 4. what overlaps nothing stays rigid, and says so
far = volume((900, 0, 0))
alone = aligner(a, far)
alone.Update()
assert field(alone.GetOutput().GetBlock(1), "DeformationApplied")[0].ToDouble() == 0
assert "volume 2" in field(alone.GetOutput().GetBlock(1), "DeformationReason")[0].ToString()

# 5. errors: a sentence, empty outputs
assert "at least two volumes, got 1" in errors_of(aligner(a))
constant = vtkImageData()
constant.DeepCopy(b)
constant.GetPointData().GetArray("Intensity").Fill(9)
failed = aligner(a, constant)
assert "volume 2: it is constant" in errors_of(failed)
assert failed.GetOutput().GetNumberOfBlocks() == 0 and failed.GetOutputDataObject(1).GetNumberOfBlocks() == 0
none = aligner(a, b)
none.SetFixedVolume(2)
assert "fixed volume must be one of the 2" in errors_of(none)
none.SetControlSpacingMm(1)
assert "ControlSpacingMm is 1 mm; it must be in [5, 500]" in errors_of(none)

# 6. abort: no output, and the filter itself reports no error
stopped, messages = aligner(a, b), []
stopped.AddObserver(vtkCommand.ProgressEvent, lambda caller, event: caller.AbortExecuteOn())
stopped.AddObserver(vtkCommand.ErrorEvent, lambda caller, event: messages.append(event))
stopped.GetExecutive().AddObserver(vtkCommand.ErrorEvent, lambda caller, event: None)
stopped.Update()
assert not messages
assert stopped.GetOutput().GetNumberOfBlocks() == 0

# 7. the stitcher reads through the displacements
if vtkUltrasoundStitcher:

    def stitched(displaced):
        stitcher = vtkUltrasoundStitcher()
        stitcher.SetInputConnection(0, align.GetOutputPort(0))
        if displaced:
            stitcher.AddDisplacementConnection(align.GetOutputPort(1))
        stitcher.Update()
        image = stitcher.GetOutput()
        n = image.GetDimensions()
        k, j, i = np.meshgrid(*[2.0 * np.arange(m) for m in n[::-1]], indexing="ij")
        world = np.stack([i, j, k], -1) + np.array(image.GetOrigin())
        scene = 120 + 8 * np.cos(world @ waves.T + phases).sum(-1)
        inside = vtk_to_numpy(image.GetPointData().GetArray("Coverage")).reshape(n[::-1]) == 2
        error = np.abs(vtk_to_numpy(image.GetPointData().GetArray("Intensity")).reshape(n[::-1]) - scene)[inside]
        return error.mean()

    rigid, through = stitched(False), stitched(True)
    assert through < 0.7 * rigid, (through, rigid)

    few = vtkUltrasoundStitcher()
    few.SetInputConnection(0, align.GetOutputPort(0))
    few.AddDisplacementData(bent)
    assert "1 displacements came in for 2 volumes" in errors_of(few)
    wrong = vtkUltrasoundStitcher()
    wrong.SetInputConnection(0, align.GetOutputPort(0))
    wrong.AddDisplacementData(tree.GetOutputDataObject(1))
    assert "displacement 1 is that of left" in errors_of(wrong)
    noise = vtkUltrasoundStitcher()
    noise.SetInputConnection(0, align.GetOutputPort(0))
    noise.AddDisplacementData(a)
    noise.AddDisplacementData(b)
    assert "no displacement image" in errors_of(noise)
    noise.RemoveAllDisplacements()
    noise.Update()
    assert noise.GetOutput().GetNumberOfPoints() > 1000
