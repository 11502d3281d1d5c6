#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The stitcher as a filter: poses, composite inputs, images, updates in pieces, bad input."""
import json
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import VTK_DOUBLE, VTK_FLOAT, VTK_UNSIGNED_CHAR, VTK_UNSIGNED_SHORT
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet, vtkDataObject, vtkImageData, vtkMultiBlockDataSet
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
from vtkmodules.vtkCommonExecutionModel import vtkTrivialProducer
from vtkmodules.vtkCommonMath import vtkMatrix3x3
from vtkmodules.vtkFiltersCore import vtkArrayCalculator

from echorama.EchoramaFiltersStitching import vtkUltrasoundStitcher


def turn(angle_z, angle_x):
    cz, sz, cx, sx = math.cos(angle_z), math.sin(angle_z), math.cos(angle_x), math.sin(angle_x)
    return np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])


def volume(values, origin=(0, 0, 0), spacing=(1, 1, 1), direction=np.eye(3), valid=None):
    """values: (z, y, x)."""
    image = vtkImageData()
    image.SetDimensions(values.shape[::-1])
    image.SetOrigin(origin)
    image.SetSpacing(spacing)
    matrix = vtkMatrix3x3()
    for row in range(3):
        for column in range(3):
            matrix.SetElement(row, column, direction[row, column])
    image.SetDirectionMatrix(matrix)
    for name, array in (("Intensity", values), ("ValidRegion", valid)):
        if array is not None:
            data = numpy_to_vtk(np.ascontiguousarray(array).ravel(), deep=True)
            data.SetName(name)
            image.GetPointData().AddArray(data)
    image.GetPointData().SetActiveScalars("Intensity")
    return image


def stitcher(*inputs):
    """A stitcher and the list of messages it gives."""
    filter = vtkUltrasoundStitcher()
    for data in inputs:
        filter.AddInputDataObject(data)
    return filter, watch(filter)


def watch(filter):
    messages = []

    def heard(caller, event, message=None):
        messages.append(message)
    heard.CallDataType = "string0"
    filter.AddObserver("ErrorEvent", heard)
    filter.GetExecutive().AddObserver("ErrorEvent", heard)
    return messages


def array(image, name="Intensity"):
    data = image.GetPointData().GetArray(name)
    return vtk_to_numpy(data).reshape(image.GetDimensions()[::-1])


def direction_of(image):
    matrix = image.GetDirectionMatrix()
    return np.array([[matrix.GetElement(row, column) for column in range(3)] for row in range(3)])


def expect_error(words, *inputs, prepare=None):
    filter, messages = stitcher(*inputs)
    if prepare:
        prepare(filter)
    filter.Update()
    assert messages and any(words in message for message in messages), f"wanted '{words}', got {messages}"
    assert filter.GetOutput().GetNumberOfPoints() == 0, "a filter that failed has an output"


def test_common_lattice_is_copied():
    random = np.random.default_rng(1)
    world = random.integers(1, 255, (20, 24, 40)).astype(np.uint8)
    pose, spacing, origin = turn(0.4, -0.3), np.array([0.5, 0.4, 0.7]), np.array([10.0, -20.0, 30.0])
    a = volume(world[:, :, :26], origin, spacing, pose)
    b = volume(world[2:, 3:, 15:], origin + pose @ (spacing * [15, 3, 2]), spacing, pose)
    filter, messages = stitcher(a, b)
    for texture in range(2):
        filter.SetTexture(texture)
        filter.Update()
        assert not messages, messages
        out = filter.GetOutput()
        valid = array(out, "ValidRegion").astype(bool)
        assert np.array_equal(array(out)[valid], world[valid]), "what both volumes see must come out as it is"
    assert np.allclose(out.GetOrigin(), origin) and np.allclose(out.GetSpacing(), spacing)
    assert np.allclose(direction_of(out), pose)
    assert not array(out)[~valid].any()
    assert not valid[:2, :, 26:].any() and valid[2:, 3:, :].all()
    coverage = array(out, "Coverage")
    assert coverage.max() == 2 and (coverage == 2).sum() == 18 * 21 * 11
    assert out.GetPointData().GetScalars().GetName() == "Intensity"
    assert out.GetPointData().GetScalars().GetDataType() == VTK_UNSIGNED_CHAR
    names = out.GetFieldData().GetAbstractArray("StitchedVolumes")
    assert [names.GetValue(i) for i in range(names.GetNumberOfValues())] == ["volume 1", "volume 2"]


def two_oblique(dtype=np.float32):
    """Two views of one linear field, both turned: it must come out as it is wherever anything is valid."""
    volumes = []
    for angle, origin in ((0.3, (0.0, 0.0, 0.0)), (-0.2, (9.0, 1.0, 2.0))):
        pose = turn(angle, 0.5 * angle)
        index = np.stack(np.meshgrid(range(24), range(22), range(20), indexing="ij"), -1)  # x, y, z
        at = np.array(origin) + (index * 0.9) @ pose.T
        field = 50 + at @ [1.0, 2.0, -0.5]
        volumes.append(volume(field.transpose(2, 1, 0).astype(dtype), origin, (0.9,) * 3, pose))
    return volumes


def expect_linear_field(out):
    shape = out.GetDimensions()
    assert np.allclose(direction_of(out), np.eye(3))
    index = np.stack(np.meshgrid(*(range(n) for n in shape), indexing="ij"), -1)
    at = np.array(out.GetOrigin()) + index * np.array(out.GetSpacing())
    field = (50 + at @ [1.0, 2.0, -0.5]).transpose(2, 1, 0)
    # The rim of a volume lies up to half a voxel beyond its last sample, where the value is that of the sample.
    valid = array(out, "ValidRegion").astype(bool)
    assert valid.sum() > 10000
    error = np.abs(array(out) - field)[valid]
    assert error.max() < 0.9 * 0.5 * 3.5 + 1e-3, error.max()
    assert np.median(error) < 1e-4


def test_oblique_volumes_in_every_kind_of_connection():
    a, b = two_oblique()
    reference, messages = stitcher(a, b)
    reference.Update()
    assert not messages, messages
    expect_linear_field(reference.GetOutput())

    blocks = vtkMultiBlockDataSet()
    inner = vtkMultiBlockDataSet()
    inner.SetBlock(1, b)
    inner.GetMetaData(1).Set(vtkCompositeDataSet.NAME(), "right")
    blocks.SetBlock(0, a)
    blocks.GetMetaData(0).Set(vtkCompositeDataSet.NAME(), "left")
    blocks.SetBlock(3, inner)
    filter, messages = stitcher(blocks)
    filter.Update()
    assert not messages, messages
    assert np.array_equal(array(filter.GetOutput()), array(reference.GetOutput()))
    names = filter.GetOutput().GetFieldData().GetAbstractArray("StitchedVolumes")
    assert [names.GetValue(i) for i in range(names.GetNumberOfValues())] == ["left", "right"]

    # A filter that announces an extent and nothing else.
    calculator = vtkArrayCalculator()
    calculator.SetInputData(a)
    calculator.AddScalarArrayName("Intensity")
    calculator.SetFunction("Intensity + 0")
    calculator.SetResultArrayName("Intensity")
    calculator.SetResultArrayType(VTK_FLOAT)
    filter = vtkUltrasoundStitcher()
    filter.AddInputConnection(calculator.GetOutputPort())
    filter.AddInputDataObject(b)
    messages = watch(filter)
    filter.Update()
    assert not messages, messages
    assert np.array_equal(array(filter.GetOutput()), array(reference.GetOutput()))


def test_composite_inputs_are_made_once():
    from vtkmodules.vtkFiltersGeneral import vtkMultiBlockDataGroupFilter
    group = vtkMultiBlockDataGroupFilter()
    for image in two_oblique():
        group.AddInputDataObject(image)
    runs = []
    group.AddObserver("StartEvent", lambda *_: runs.append(1))
    filter = vtkUltrasoundStitcher()
    filter.AddInputConnection(group.GetOutputPort())
    own = []
    filter.AddObserver("StartEvent", lambda *_: own.append(1))
    messages = watch(filter)
    filter.Update()
    filter.Update()
    filter.SetSharpness(2.0)
    filter.Update()
    assert not messages, messages
    assert len(runs) == 1 and len(own) == 2, (len(runs), len(own))
    group.Modified()
    filter.Update()
    assert len(runs) == 2 and len(own) == 3


def test_information_and_pieces():
    a, b = two_oblique()
    filter, messages = stitcher(a, b)
    filter.UpdateInformation()
    information = filter.GetOutputInformation(0)
    whole = information.Get(Pipeline.WHOLE_EXTENT())
    filter.Update()
    full = array(filter.GetOutput()).copy()
    assert whole == filter.GetOutput().GetExtent()
    assert information.Get(vtkDataObject.SPACING()) == filter.GetOutput().GetSpacing()
    assert information.Get(vtkDataObject.ORIGIN()) == filter.GetOutput().GetOrigin()
    piece = (whole[0] + 3, whole[1] - 2, whole[2], whole[3] - 5, whole[4] + 4, whole[4] + 9)
    fresh, messages = stitcher(a, b)
    fresh.UpdateExtent(piece)
    out = fresh.GetOutput()
    assert out.GetExtent() == piece
    assert np.array_equal(array(out), full[piece[4]:piece[5] + 1, piece[2]:piece[3] + 1, piece[0]:piece[1] + 1])
    assert not messages, messages


def test_a_plan_is_that_of_the_volumes_that_come():
    """Volumes that are older than the filter, put in the place of others upstream, between two pieces."""
    a, b, common = (volume(np.full((6, 20, 30), value, np.uint8), origin) for value, origin in ((50, (0, 0, 0)), (150, (0, 0, 0)), (90, (20, 0, 0))))
    producer, filter = vtkTrivialProducer(), vtkUltrasoundStitcher()
    messages = watch(filter)
    producer.SetOutput(a)
    filter.AddInputConnection(producer.GetOutputPort())
    filter.AddInputDataObject(common)
    filter.UpdateInformation()
    whole = filter.GetOutputInformation(0).Get(Pipeline.WHOLE_EXTENT())
    halves = [(*whole[:4], *part) for part in ((0, 2), (3, 5))]
    filter.UpdateExtent(halves[0])
    assert (array(filter.GetOutput())[:, :, :15] == 50).all()
    producer.SetOutput(b)
    filter.UpdateExtent(halves[1])
    assert (array(filter.GetOutput())[:, :, :15] == 150).all(), "the piece is of the volume that was there before"
    assert not messages, messages


def test_methods_and_parameters():
    filter = vtkUltrasoundStitcher()
    assert filter.GetMethodAsString() == "membrane" and filter.GetTextureAsString() == "split"
    assert filter.GetSharpness() == 1.5 and filter.GetSpacingMm() == 0
    assert not filter.GetAllowDisjoint() and not filter.GetOutputWeights()
    for number, name in enumerate(("distance", "feather", "average", "maximum", "membrane")):
        assert filter.SetParameterAsText("Method", name) and filter.GetMethod() == number
        getattr(filter, "SetMethodTo" + name.capitalize())()
        assert filter.GetMethod() == number and filter.GetMethodAsString() == name
    for number, name in enumerate(("mix", "split")):
        assert filter.SetParameterAsText("Texture", name) and filter.GetTexture() == number
        getattr(filter, "SetTextureTo" + name.capitalize())()
        assert filter.GetTexture() == number and filter.GetTextureAsString() == name
    messages = watch(filter)
    filter.SetMethod(5)
    assert not filter.SetParameterAsText("Texture", "nothing") and len(messages) == 2 and filter.GetMethodAsString() == "membrane"

    a, b = volume(np.full((3, 20, 30), 100, np.uint8)), volume(np.full((3, 20, 30), 201, np.uint8), (20, 0, 0))
    middle = {"distance": range(101, 201), "feather": range(101, 201), "average": [151], "maximum": [201],
              "membrane": range(101, 201)}
    for name, allowed in middle.items():
        filter, messages = stitcher(a, b)
        filter.SetParameterAsText("Method", name)
        filter.OutputWeightsOn()
        filter.Update()
        assert not messages, messages
        out = filter.GetOutput()
        assert array(out)[1, 10, 25] in allowed, name
        assert array(out)[1, 10, 5] == 100 and array(out)[1, 10, 45] == 201
        weights = array(out, "Weight0") + array(out, "Weight1")
        assert np.allclose(weights, 1, atol=1e-6) and array(out, "Weight0").min() >= 0
    filter.SetSpacingMm(2.5)
    filter.Update()
    assert filter.GetOutput().GetSpacing() == (2.5, 2.5, 2.5)


def test_membranes_are_certified():
    a, b = volume(np.full((9, 20, 40), 100, np.uint8)), volume(np.full((9, 20, 40), 200, np.uint8), (20, 0, 0))
    filter, messages = stitcher(a, b)
    filter.SetSharpness(1)
    ramp = 100 + 100 * (np.arange(20) + 1) / 21
    for step, factor, largest in ((1, 1, 1), (0, 2, 6)):
        filter.SetPlanStep(step)
        filter.Update()
        assert not messages, messages
        assert 0 < filter.GetMembraneBound() < 1 / 512 and filter.GetPlanFactor() == factor
        off = np.abs(array(filter.GetOutput()).astype(int)[4, 10, 20:40] - ramp).max()
        assert off < largest, (step, off)


def test_gains_spread_and_cost():
    random = np.random.default_rng(2)
    world = 100 + 20 * random.standard_normal((12, 24, 60))
    a, b = volume(world[:, :, :40].astype(np.float32)), volume((0.5 * world[:, :, 20:] + 10).astype(np.float32), (20, 0, 0))
    filter, messages = stitcher(a, b)
    filter.EqualizeGainOn()
    filter.OutputSpreadOn()
    filter.Update()
    assert not messages, messages
    assert abs(filter.GetGain(1) / filter.GetGain(0) - 2) < 0.05, (filter.GetGain(0), filter.GetGain(1))
    assert filter.GetGain(7) == 1 and filter.GetOffset(-1) == 0
    spread, coverage = array(filter.GetOutput(), "Spread"), array(filter.GetOutput(), "Coverage")
    assert spread[coverage < 2].max() == 0 and 0 < spread[coverage > 1].mean() < 5, "after the gains they all but agree"
    cost = json.loads(filter.EstimateCost())
    assert cost["volumes"] == 2 and cost["slabs"] == 1 and cost["plan_factor"] == 1
    assert cost["dimensions"] == list(filter.GetOutput().GetDimensions())
    assert cost["output_bytes"] == 10 * filter.GetOutput().GetNumberOfPoints()


def test_types():
    a = np.full((4, 10, 20), 7)
    wanted = {(np.uint8, np.uint16): VTK_UNSIGNED_SHORT, (np.int16, np.uint16): VTK_FLOAT, (np.float32, np.float64): VTK_DOUBLE,
              (np.uint8, np.uint8): VTK_UNSIGNED_CHAR}
    for (first, second), expected in wanted.items():
        filter, messages = stitcher(volume(a.astype(first)), volume(a.astype(second), (10, 0, 0)))
        filter.UpdateInformation()
        filter.Update()
        assert not messages, messages
        scalars = filter.GetOutput().GetPointData().GetScalars()
        assert scalars.GetDataType() == expected
        assert (vtk_to_numpy(scalars) == 7).all(), "a constant did not stay that constant"


def test_images_in_an_oblique_plane():
    plane = turn(0.7, 1.0)
    image = np.add.outer(np.arange(30.0), 2 * np.arange(40.0))[None].astype(np.float32)
    a = volume(image[:, :, :25], (5, 6, 7), (0.5, 0.5, 1), plane)
    b = volume(image[:, :, 15:], np.array((5, 6, 7)) + plane @ [7.5, 0, 0], (0.5, 0.5, 1), plane)
    filter, messages = stitcher(a, b)
    filter.Update()
    assert not messages, messages
    out = filter.GetOutput()
    assert out.GetDimensions() == (40, 30, 1) and np.allclose(direction_of(out), plane)
    assert np.allclose(array(out), image, atol=1e-4)


def test_invalid_voxels_stay_out():
    values = np.full((3, 20, 30), 100, np.float32)
    values[1, 10, 5] = np.nan
    valid = np.ones_like(values, np.uint8)
    valid[:, :, :3] = 0
    values[:, :, :3] = 1e6
    filter, messages = stitcher(volume(values, valid=valid), volume(np.full((3, 20, 30), 100, np.float32), (20, 0, 0)))
    filter.Update()
    assert not messages, messages
    out = filter.GetOutput()
    assert np.isfinite(array(out)).all()
    assert array(out, "ValidRegion")[1, 10, 5] == 0
    assert not array(out, "ValidRegion")[:, :, :3].any()
    assert set(np.unique(array(out))) == {0, 100}


def test_bad_input():
    good = volume(np.full((4, 10, 20), 7, np.uint8))
    right = volume(np.full((4, 10, 20), 7, np.uint8), (10, 0, 0))
    far = volume(np.full((4, 10, 20), 7, np.uint8), (1000, 0, 0))
    expect_error("at least two volumes, got 1", good)
    expect_error("at least two volumes, got 0", vtkMultiBlockDataSet())
    expect_error("volume 3 overlaps no other volume", good, right, far)
    filter, messages = stitcher(good, right, far)
    filter.AllowDisjointOn()
    filter.Update()
    assert not messages and filter.GetOutput().GetDimensions()[0] == 1020
    expect_error("volume 2", good, volume(np.full((4, 10, 20), 7, np.int64), (10, 0, 0)))
    expect_error("volume 2", good, volume(np.full((4, 10, 20), np.nan, np.float32), (10, 0, 0)))
    expect_error("volume 2", good, volume(np.full((4, 10, 20), 7, np.uint8), (10, 0, 0), (1, 0, 1)))
    expect_error("volume 2", good, volume(np.full((4, 10, 20), 7, np.uint8), (10, 0, 0), direction=np.diag([1.0, 1.0, 0.5])))
    expect_error("volume 2", good, volume(np.full((4, 10, 20), 7, np.uint8), (10, 0, 0), valid=np.zeros((4, 10, 20), np.uint8)))
    expect_error("volume 1: no voxel is valid and finite", volume(np.zeros((4, 10, 20), np.uint8), valid=np.zeros((4, 10, 20), np.uint8)), good)
    for name, value, words in (("SpacingMm", -1, "at least 0"), ("Sharpness", 2000, "[0, 1000]"), ("DetailScale", 0.5, "[1, 100]"),
                               ("ReliabilityFloor", 0, "(0, 1]")):
        expect_error(f"{name} is {value}", good, right, prepare=lambda f: f.SetParameter(name, value))
        expect_error(words, good, right, prepare=lambda f: f.SetParameter(name, value))
    expect_error("MaximumMemoryGb", good, right, prepare=lambda f: f.SetMaximumMemoryGb(1e-6))
    expect_error("SpacingMm", good, right, prepare=lambda f: f.SetSpacingMm(1e-9))
    empty = vtkImageData()
    expect_error("volume 2", good, empty)


def test_errors_leave_no_old_result():
    good, right = volume(np.full((4, 10, 20), 7, np.uint8)), volume(np.full((4, 10, 20), 7, np.uint8), (10, 0, 0))
    producer = vtkTrivialProducer()
    producer.SetOutput(right)
    filter = vtkUltrasoundStitcher()
    filter.AddInputDataObject(good)
    filter.AddInputConnection(producer.GetOutputPort())
    messages = watch(filter)
    filter.Update()
    assert not messages and filter.GetOutput().GetNumberOfPoints() > 0
    producer.SetOutput(volume(np.full((4, 10, 20), 7, np.uint8), (500, 0, 0)))
    filter.Update()
    assert messages and filter.GetOutput().GetNumberOfPoints() == 0


if __name__ == "__main__":
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            test()
            print("passed", name)
