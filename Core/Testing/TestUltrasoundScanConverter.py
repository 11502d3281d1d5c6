#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped scan converter: values, pose, field data, masks, what it refuses."""
import math

import echorama
from vtkmodules.vtkCommonCore import (VTK_DOUBLE, VTK_FLOAT, VTK_INT, VTK_SHORT, VTK_UNSIGNED_CHAR, VTK_UNSIGNED_SHORT,
                                      vtkDataArray, vtkDoubleArray)
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonExecutionModel import vtkTrivialProducer

CONVEX = [70.0, math.radians(70) * 40, 60.0, math.radians(60) * 25, 10.0, 90.0]
POSE = [0.0, -1.0, 0.0, 5.0, 1.0, 0.0, 0.0, -7.0, 0.0, 0.0, 1.0, 11.0, 0.0, 0.0, 0.0, 1.0]


def field(name, values):
    array = vtkDoubleArray()
    array.SetName(name)
    array.SetNumberOfComponents(len(values))
    array.InsertNextTuple(values)
    return array


def beam_volume(dimensions=(33, 17, 13), value=lambda i, j, k: i, kind=VTK_FLOAT, geometry=CONVEX, pose=POSE, name="Intensity"):
    image = vtkImageData()
    image.SetDimensions(dimensions)
    array = vtkDataArray.CreateDataArray(kind)
    array.SetName(name)
    for k in range(dimensions[2]):
        for j in range(dimensions[1]):
            for i in range(dimensions[0]):
                array.InsertNextTuple1(value(i, j, k))
    image.GetPointData().SetScalars(array)
    if geometry:
        image.GetFieldData().AddArray(field("ProbeGeometry", geometry))
    if pose:
        image.GetFieldData().AddArray(field("ProbeToWorld", pose))
    return image


class Errors:
    """Collects the error messages of a filter."""

    def __init__(self, algorithm):
        self.messages = []

        def remember(caller, event, text):
            self.messages.append(text)

        remember.CallDataType = "string0"
        for each in (algorithm, algorithm.GetExecutive()):
            each.AddObserver("ErrorEvent", remember)

    def text(self):
        return "\n".join(self.messages)


def convert(image, **properties):
    converter = echorama.vtkUltrasoundScanConverter()
    converter.SetInputData(image)
    for name, value in properties.items():
        getattr(converter, "Set" + name)(value)
    errors = Errors(converter)
    converter.Update()
    return converter.GetOutput(), errors.text()


def expect(condition, what):
    if not condition:
        raise AssertionError(what)


def test_depth_comes_back():
    # Samples that hold their own depth: every voxel must read its distance from the face, wherever the probe is.
    image = beam_volume(value=lambda i, j, k: 10.0 + i * 80.0 / 32)
    image.GetFieldData().AddArray(field("TimeStamp", [12.5]))
    output, errors = convert(image, SpacingMm=4.0)
    expect(not errors, errors)
    intensity, valid = output.GetPointData().GetArray("Intensity"), output.GetPointData().GetArray("ValidRegion")
    expect(output.GetPointData().GetScalars() is intensity, "Intensity is not active")
    expect(intensity.GetDataType() == VTK_FLOAT and valid.GetDataType() == VTK_UNSIGNED_CHAR, "types")
    direction = output.GetDirectionMatrix()
    expect(all(abs(direction.GetElement(r, c) - POSE[4 * r + c]) < 1e-12 for r in range(3) for c in range(3)), "direction")
    expect(output.GetSpacing() == (4.0, 4.0, 4.0), "spacing")
    inside = 0
    for point in range(output.GetNumberOfPoints()):
        if not valid.GetValue(point):
            expect(intensity.GetValue(point) == 0.0, "intensity outside the fan")
            continue
        inside += 1
        world = [a - b for a, b in zip(output.GetPoint(point), (POSE[3], POSE[7], POSE[11]))]
        x, y, z = (sum(POSE[4 * r + c] * world[r] for r in range(3)) for c in range(3))
        rho = math.hypot(y, z + 25) - 25
        depth = min(90.0, max(10.0, math.hypot(x, rho + 40) - 40))
        expect(abs(intensity.GetValue(point) - depth) < 1e-4, f"depth {depth} read {intensity.GetValue(point)}")
    expect(inside > 3000, f"only {inside} voxels are inside")
    for name in ("ProbeGeometry", "ProbeToWorld", "TimeStamp"):
        expect(output.GetFieldData().GetArray(name), f"field data {name} is lost")


def test_a_fan_off_centre():
    # The fan begins in the middle of the array: no voxel lies on the other side.
    image = beam_volume(geometry=CONVEX + [0.5], pose=None)
    output, errors = convert(image, SpacingMm=4.0)
    expect(not errors, errors)
    xmin, xmax, _, _, _, zmax = output.GetBounds()
    expect(-2.1 < xmin <= 0.0 and xmax > 60, f"x from {xmin} to {xmax}")
    expect(output.GetFieldData().GetArray("ProbeGeometry").GetTuple(0)[6] == 0.5, "the offset is lost")


def test_types_and_names():
    for kind in (VTK_UNSIGNED_CHAR, VTK_SHORT, VTK_UNSIGNED_SHORT, VTK_FLOAT, VTK_DOUBLE):
        output, errors = convert(beam_volume(value=lambda i, j, k: 7, kind=kind, name="ImageScalars"), SpacingMm=6.0)
        expect(not errors, errors)
        array = output.GetPointData().GetArray("ImageScalars")
        expect(array.GetDataType() == kind and array.GetRange() == (0.0, 7.0), f"type {kind}")
    output, errors = convert(beam_volume(kind=VTK_INT))
    expect("not supported" in errors and output.GetNumberOfPoints() == 0, "int voxels: " + errors)
    # A chosen array.
    image = beam_volume(value=lambda i, j, k: 1)
    other = beam_volume(value=lambda i, j, k: 2, name="Other").GetPointData().GetArray("Other")
    image.GetPointData().AddArray(other)
    converter = echorama.vtkUltrasoundScanConverter()
    converter.SetInputData(image)
    converter.SetInputArrayToProcess(0, 0, 0, 0, "Other")
    converter.Update()
    expect(converter.GetOutput().GetPointData().GetArray("Other").GetRange() == (0.0, 2.0), "the chosen array")


def test_pose_defaults_to_identity():
    output, errors = convert(beam_volume(pose=None), SpacingMm=6.0)
    expect(not errors and output.GetDirectionMatrix().IsIdentity(), "identity: " + errors)
    # It is written all the same, or a later move of the volume would leave the probe behind.
    expect(output.GetFieldData().GetArray("ProbeToWorld").GetTuple(0)[:5] == (1.0, 0.0, 0.0, 0.0, 0.0), "ProbeToWorld")


def test_hidden_samples():
    image = beam_volume(value=lambda i, j, k: 100 if i < 16 else 7, kind=VTK_UNSIGNED_CHAR)
    mask = beam_volume(value=lambda i, j, k: int(i >= 16), kind=VTK_UNSIGNED_CHAR, name="ValidRegion")
    image.GetPointData().AddArray(mask.GetPointData().GetArray("ValidRegion"))
    output, errors = convert(image, SpacingMm=3.0)
    expect(not errors, errors)
    expect(output.GetPointData().GetArray("Intensity").GetRange() == (0.0, 7.0), "hidden samples bled into their neighbours")
    whole, _ = convert(beam_volume(kind=VTK_UNSIGNED_CHAR), SpacingMm=3.0)
    count = [sum(int(v.GetPointData().GetArray("ValidRegion").GetValue(i)) for i in range(v.GetNumberOfPoints()))
             for v in (output, whole)]
    expect(0 < count[0] < count[1], f"valid voxels: {count}")


def test_single_plane():
    plane = [70.0, math.radians(70) * 40, 0.0, 0.0, 10.0, 90.0]
    output, errors = convert(beam_volume((33, 17, 1), geometry=plane))
    expect(not errors and output.GetDimensions()[2] == 1 and output.GetNumberOfPoints() > 300, "a 2D image: " + errors)


def test_pipeline():
    # The grid follows the field data, also when that changes under a standing pipeline.
    image = beam_volume()
    producer = vtkTrivialProducer()
    producer.SetOutput(image)
    converter = echorama.vtkUltrasoundScanConverter()
    converter.SetInputConnection(producer.GetOutputPort())
    expect(converter.GetSpacingMm() == 0.0 and converter.GetMaximumVoxels() == 2**30, "defaults")
    converter.SetSpacingMm(5.0)
    converter.Update()
    before = converter.GetOutput().GetDimensions()
    image.GetFieldData().AddArray(field("ProbeGeometry", CONVEX[:5] + [130.0]))
    image.Modified()
    converter.Update()
    expect(converter.GetOutput().GetDimensions()[2] == before[2] + 8, "40 mm deeper")
    # What is asked for is put out, and only that.
    converter = echorama.vtkUltrasoundScanConverter()
    converter.SetInputData(image)
    converter.UpdateInformation()
    converter.UpdateExtent([2, 6, 3, 5, 1, 9])
    expect(converter.GetOutput().GetExtent() == (2, 6, 3, 5, 1, 9), "a piece")


def test_refusals():
    def refused(image, sentence, **properties):
        output, errors = convert(image, **properties)
        expect(sentence in errors, f"expected '{sentence}', got '{errors}'")
        expect(output.GetNumberOfPoints() == 0, "an output in spite of an error")

    refused(beam_volume(geometry=None), "no field data ProbeGeometry")
    refused(beam_volume(geometry=CONVEX[:5]), "no field data ProbeGeometry")
    refused(beam_volume(geometry=CONVEX[:5] + [math.nan]), "no field data ProbeGeometry")
    refused(beam_volume(geometry=CONVEX[:5] + [1.0]), "the depths go from")
    refused(beam_volume(geometry=[400.0] + CONVEX[1:]), "fan angle")
    refused(beam_volume(pose=POSE[:15]), "ProbeToWorld is not 16 finite numbers")
    refused(beam_volume(pose=[2.0] + POSE[1:]), "not rigid")
    refused(beam_volume((33, 17, 1)), "single step")
    refused(beam_volume((1, 17, 13)), "1 samples")
    refused(beam_volume(), "larger spacing", SpacingMm=0.001)
    refused(beam_volume(), "larger spacing", MaximumVoxels=1000)
    refused(beam_volume(), "SpacingMm is -3 mm; it must be in [0, 1000]", SpacingMm=-3.0)
    refused(beam_volume(), "SpacingMm is nan", SpacingMm=math.nan)
    refused(beam_volume(), "MaximumVoxels is 0; it must be at least 1", MaximumVoxels=0)
    empty = vtkImageData()
    empty.SetDimensions(4, 4, 4)
    refused(empty, "no intensities")
    refused(vtkImageData(), "the beam volume")


def test_stops_on_request():
    converter = echorama.vtkUltrasoundScanConverter()
    converter.SetInputData(beam_volume())
    converter.SetSpacingMm(1.0)
    converter.AddObserver("ProgressEvent", lambda caller, event: caller.SetAbortExecute(caller.GetProgress() > 0.2))
    converter.Update()
    expect(converter.GetOutput().GetNumberOfPoints() == 0, "an aborted filter put something out")


for name, test in list(globals().items()):
    if name.startswith("test_"):
        test()
        print("passed", name)
