#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Names, acquisition fields and moves of a volume, through the wrapped classes."""
import math

import echorama
from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkFloatArray, vtkUnsignedCharArray
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4

Volume, Acquisition = echorama.vtkUltrasoundVolume, echorama.vtkUltrasoundAcquisition


def expect(condition, what):
    if not condition:
        raise AssertionError(what)


def close(a, b, tolerance=1e-12):
    return len(a) == len(b) and all(abs(x - y) <= tolerance for x, y in zip(a, b))


def matrix(*values):
    result = vtkMatrix4x4()
    result.DeepCopy(values)
    return result


def rows(m):
    return [m.GetElement(r, c) for r in range(4) for c in range(4)]


def turn_about_z(degrees, x, y, z):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return matrix(c, -s, 0, x, s, c, 0, y, 0, 0, 1, z, 0, 0, 0, 1)


def field(name, values):
    array = vtkDoubleArray()
    array.SetName(name)
    array.SetNumberOfComponents(len(values))
    array.InsertNextTuple(values)
    return array


def volume():
    image = vtkImageData()
    image.SetExtent(2, 5, -1, 3, 0, 4)  # an extent need not begin at zero
    image.SetOrigin(1, 2, 3)
    image.SetSpacing(0.5, 0.7, 0.9)
    image.SetDirectionMatrix(0, -1, 0, 1, 0, 0, 0, 0, 1)
    return image


def scalars(kind, name, image):
    array = kind()
    array.SetName(name)
    array.SetNumberOfTuples(image.GetNumberOfPoints())
    array.Fill(1)
    return array


def test_names():
    expect((Volume.IntensityName(), Volume.ValidRegionName()) == ("Intensity", "ValidRegion"), "arrays")
    names = [getattr(Acquisition, f + "Name")() for f in ("ProbeGeometry", "ProbeToWorld", "ImageToWorld", "TimeStamp", "Seed", "Scene")]
    expect(names == ["ProbeGeometry", "ProbeToWorld", "ImageToWorld", "TimeStamp", "Seed", "Scene"], "fields")


def test_arrays_are_found():
    image = volume()
    expect(Volume.GetIntensity(image) is None and Volume.GetValidRegion(image) is None, "an empty volume")
    expect(Volume.GetIntensity(None) is None and Volume.GetValidRegion(None) is None, "no volume")
    other = scalars(vtkFloatArray, "ImageScalars", image)
    image.GetPointData().SetScalars(other)
    expect(Volume.GetIntensity(image) is other, "the active scalars stand in")
    intensity, valid = scalars(vtkFloatArray, "Intensity", image), scalars(vtkUnsignedCharArray, "ValidRegion", image)
    image.GetPointData().AddArray(intensity)
    image.GetPointData().AddArray(valid)
    expect(Volume.GetIntensity(image) is intensity, "the name counts for more")
    expect(Volume.GetValidRegion(image) is valid, "ValidRegion")


def test_a_move_moves_every_voxel_and_the_probe():
    image = volume()
    image.GetPointData().SetScalars(scalars(vtkFloatArray, "Intensity", image))
    image.GetFieldData().AddArray(field("ProbeToWorld", rows(turn_about_z(30, 4, 5, 6))))
    image.GetFieldData().AddArray(field("ImageToWorld", rows(turn_about_z(30, 4, 5, 6))))
    before = [image.GetPoint(i) for i in range(image.GetNumberOfPoints())]
    voxels = image.GetPointData().GetScalars()
    pose = turn_about_z(25, -7, 8, 9)
    expect(Volume.Move(image, pose), "Move")
    for i, point in enumerate(before):
        expect(close(image.GetPoint(i), pose.MultiplyPoint((*point, 1.0))[:3]), f"voxel {i}")
    expect(image.GetPointData().GetScalars() is voxels, "voxels are shared, not resampled")
    expected, found = vtkMatrix4x4(), vtkMatrix4x4()
    vtkMatrix4x4.Multiply4x4(pose, turn_about_z(30, 4, 5, 6), expected)
    expect(Acquisition.GetProbeToWorld(image, found), "ProbeToWorld is there")
    expect(close(rows(found), rows(expected)), "ProbeToWorld moved")
    expect(close(image.GetFieldData().GetArray("ImageToWorld").GetTuple(0), rows(expected)), "ImageToWorld moved")


def test_a_move_without_a_probe_invents_none():
    image = volume()
    expect(Volume.Move(image, turn_about_z(25, -7, 8, 9)), "Move")
    unchanged = turn_about_z(1, 2, 3, 4)
    copy = vtkMatrix4x4()
    copy.DeepCopy(unchanged)
    expect(not Acquisition.GetProbeToWorld(image, unchanged), "no ProbeToWorld")
    expect(rows(unchanged) == rows(copy), "the matrix is left alone")


def test_what_is_not_rigid_is_refused():
    mirror = matrix(-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)
    scale = matrix(2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1)
    perspective = matrix(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1)
    lost = matrix(1, 0, 0, math.nan, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)
    for wrong in (mirror, scale, perspective, lost):
        image = volume()
        before = image.GetPoint(17)
        expect(not Volume.Move(image, wrong), "a matrix that is not rigid")
        expect(image.GetPoint(17) == before, "the volume was moved all the same")


def test_fields_of_the_wrong_shape_are_not_read():
    pose = vtkMatrix4x4()
    for values in ([1.0] * 15, [1.0] * 17, [math.nan] * 16):
        image = volume()
        image.GetFieldData().AddArray(field("ProbeToWorld", values))
        expect(not Acquisition.GetProbeToWorld(image, pose), f"{len(values)} values, the first {values[0]}")
    # Files may bring it back as 16 tuples of one number.
    image = volume()
    array = field("ProbeToWorld", rows(turn_about_z(30, 4, 5, 6)))
    array.SetNumberOfComponents(1)
    image.GetFieldData().AddArray(array)
    expect(Acquisition.GetProbeToWorld(image, pose), "16 tuples")
    expect(close(rows(pose), rows(turn_about_z(30, 4, 5, 6))), "in the same order")


for name, test in list(globals().items()):
    if name.startswith("test_"):
        test()
        print("passed", name)
