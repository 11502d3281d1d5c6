#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundReliabilityMap: where beams come from, what it adds, and what it refuses. (Pose and arrays: TestDataContract.py.)"""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
import echorama

shape = (48, 40, 56)  # x, y, z
x, y, z = np.meshgrid(*[np.arange(n) for n in shape], indexing="ij")
random = np.random.default_rng(3)


def volume(intensity, valid=None):
    image = vtkImageData()
    image.SetDimensions(intensity.shape)
    image.SetSpacing(1.5, 1.5, 1.5)
    image.SetOrigin(-36, -30, 0)
    for name, values in (("Intensity", intensity), ("ValidRegion", valid)):
        if values is not None:
            array = numpy_to_vtk(np.ascontiguousarray(values.ravel(order="F")), deep=1)
            array.SetName(name)
            image.GetPointData().AddArray(array)
    return image


def run(image, **properties):
    """The map, or None, and the filter."""
    filter = echorama.vtkUltrasoundReliabilityMap()
    filter.SetInputData(image)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    errors = []
    filter.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
    filter.Update()
    array = filter.GetOutput().GetPointData().GetArray("Reliability")
    assert bool(errors) == (array is None)
    return None if array is None else vtk_to_numpy(array).reshape(filter.GetOutput().GetDimensions(), order="F"), filter


def tissue():
    """Log-compressed speckle."""
    return (110 + 42.5 * np.log10(random.exponential(size=shape))).clip(0, 254).astype(np.uint8)


def field(image, name, values):
    data = numpy_to_vtk(np.array(values, float).reshape(1, -1), deep=1)
    data.SetName(name)
    image.GetFieldData().AddArray(data)


# 1. A box: depth runs along z, whatever fits. A shadow below a plate, a cyst with tissue below it.
intensity = tissue()
shadow = (x >= 30) & (x < 42) & (y >= 10) & (y < 26) & (z >= 20)
cyst = (x >= 6) & (x < 16) & (y >= 10) & (y < 26) & (z >= 20) & (z < 36)
intensity[shadow | cyst] = 0
image = volume(intensity)
for properties in ({"FitProbe": False}, {"FitProbe": False, "DepthAxis": 2}, {}):
    reliability, filter = run(image, **properties)
    assert reliability.dtype == np.float32 and reliability.min() >= 0 and reliability.max() <= 1
    assert reliability[33:39, 13:23, 22:].max() < 0.1 and reliability[cyst].min() > 0.9, properties
    assert reliability[:28].mean() > 0.99
    assert ("depth axis" in filter.GetNote()) == ("FitProbe" in properties) and "\n" not in filter.GetNote()
    assert abs(filter.GetShadowFraction() - shadow.mean()) < 0.02 and filter.GetSaturatedFraction() == 0
# Along another axis the same darkness ends among echoes; turned about, the tissue above it is what follows.
assert run(image, FitProbe=False, DepthAxis=0)[0].mean() > 0.97
assert run(image, FitProbe=False, DepthReversed=True)[0][33:39, 13:23, 22:50].mean() > 0.9
reversed_image = volume(np.ascontiguousarray(intensity[:, :, ::-1]))
assert run(reversed_image, FitProbe=False, DepthReversed=True)[0][33:39, 13:23, :34].max() < 0.1

# 2. A fan: beams come from the field data, or from the valid region. The shadow of a wedge, along beams that are not lines of voxels.
apex = np.array([0.0, 0.0, -30.0])
at = np.stack([-36 + 1.5 * x, -30 + 1.5 * y, 1.5 * z], -1) - apex
radius = np.hypot(at[..., 0], np.hypot(at[..., 1], at[..., 2]))
fan, sweep = np.arctan2(at[..., 0], np.hypot(at[..., 1], at[..., 2])), np.arctan2(at[..., 1], at[..., 2])
valid = ((np.abs(fan) < 0.45) & (np.abs(sweep) < 0.4) & (radius > 35) & (radius < 110)).astype(np.uint8)
wedge = (fan > 0.1) & (fan < 0.3) & (np.abs(sweep) < 0.15) & (radius > 65)
intensity = tissue()
intensity[wedge] = 0
core = (fan > 0.14) & (fan < 0.26) & (np.abs(sweep) < 0.1) & (radius > 68) & (valid > 0)
around = (valid > 0) & ((fan < 0.05) | (fan > 0.35) | (radius < 60))
fitted, filter = run(volume(intensity * valid, valid))
assert "fitted" in filter.GetNote(), filter.GetNote()
assert fitted[core].max() < 0.1 and fitted[around].mean() > 0.98
assert not fitted[valid == 0].any()
known = volume(intensity * valid, valid)
field(known, "ProbeGeometry", [np.degrees(0.9), 0, np.degrees(0.8), 0, 35, 110])
field(known, "ProbeToWorld", [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -30, 0, 0, 0, 1])
told, filter = run(known)
assert "volume's probe" in filter.GetNote()
assert told[core].max() < 0.1 and np.abs(told - fitted)[valid > 0].mean() < 0.02

# 3. Saturation, and numbers that are none.
bright = tissue().astype(np.float32)
bright[10:24, 10:24, 10:24] = 300
bright[40, 30, 30] = np.nan
reliability, filter = run(volume(bright), FitProbe=False)
assert reliability[15:19, 15:19, 15:19].max() < 0.05 and reliability[30:, :, :40].mean() > 0.99
assert reliability[40, 30, 30] == 0 and np.isfinite(reliability).all() and filter.GetSaturatedFraction() > 0.01

# 4. Nothing to rely on is said.
reliability, filter = run(volume(np.full(shape, 9, np.int16)), FitProbe=False)
assert not reliability.any() and "one value" in filter.GetNote().split("\n")[1]
assert not run(volume(random.integers(0, 2, shape).astype(np.uint8)), FitProbe=False)[0].any()

# 5. A picture.
reliability, filter = run(volume(intensity[:, 20:21, :].transpose(0, 2, 1)), FitProbe=False)
assert reliability.shape == (48, 56, 1) and reliability.max() == 1

# 6. What it cannot work on, and after that what it can.
assert run(volume(tissue(), np.zeros(shape, np.uint8)))[0] is None
assert run(volume(np.full(shape, np.nan, np.float32)))[0] is None
assert run(vtkImageData())[0] is None
assert run(volume(tissue()), FitProbe=False, ShadowLevel=0.8, TissueLevel=0.5)[0] is None
broken = volume(intensity * valid, valid)
field(broken, "ProbeGeometry", [-5, 0, 40, 0, 35, 110])
field(broken, "ProbeToWorld", np.eye(4).ravel())
assert run(broken)[0] is None
assert run(volume(tissue()), FitProbe=False)[0] is not None

# What is out of range is refused, and the parameters say themselves.
for name, wrong in (("Resolution", 4), ("ShadowLevel", 2), ("TissueLevel", 7), ("LeastEcho", -1), ("LeastShadow", 2), ("SaturatedShare", 1),
                    ("DepthAxis", 5)):
    assert run(volume(tissue()), FitProbe=False, **{name: wrong})[0] is None, name
assert "ShadowLevel: 0.3\n" in str(filter) and "FitProbe: off\n" in str(filter)
