#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Two views of one body, a shadow in one of them: with reliability the stitched volume is nearer to that of a body without shadows."""
import sys

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData

from echorama.EchoramaCore import vtkUltrasoundReliabilityMap
from echorama.EchoramaFiltersStitching import vtkUltrasoundStitcher

try:
    from echorama.EchoramaFiltersPhantoms import vtkUltrasoundPhantomSource
except ImportError:
    print("skipped: the phantom was not built")
    sys.exit(77)


def array(image, name="Intensity"):
    return vtk_to_numpy(image.GetPointData().GetArray(name)).reshape(image.GetDimensions()[::-1]).astype(float)


def view(x, turn, shadows):
    source = vtkUltrasoundPhantomSource()
    source.SetSpacingMm(1.5)
    source.SetPosition(x, 0, 0)
    source.SetOrientation(0, turn, 0)
    source.SetShadows(shadows)
    source.Update()
    return source.GetOutput()


def trusted(image):
    map = vtkUltrasoundReliabilityMap()
    map.SetInputData(image)
    map.Update()
    return map.GetOutput()


def stitched(volumes, errors=None, **properties):
    filter = vtkUltrasoundStitcher()
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    for volume in volumes:
        filter.AddInputData(volume)
    if errors is not None:
        filter.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
    filter.Update()
    return filter.GetOutput()


# The second view looks at the stone from 30 mm aside, tilted: its shadow falls elsewhere.
places = ((0, 0), (-30, 18))
shadowed = [trusted(view(*place, True)) for place in places]
clear = stitched([view(*place, False) for place in places])
with_trust, without = stitched(shadowed, OutputWeights=True), stitched(shadowed, UseReliability=False)
overlap = array(clear, "Coverage") > 1
truth = array(clear)
hurt = overlap & (truth - array(without) > 15)  # where shadows show
errors = [np.sqrt(np.mean((array(image) - truth)[hurt] ** 2)) for image in (without, with_trust)]
print(f"where a shadow shows ({hurt.sum()} voxels), rms error {errors[0]:.1f} without, {errors[1]:.1f} with reliability")
missing = [np.mean((truth - array(image))[hurt]) for image in (without, with_trust)]
print(f"grey levels too dark there: {missing[0]:.1f} without, {missing[1]:.1f} with")
assert hurt.sum() > 500
assert errors[1] < 0.6 * errors[0]
assert missing[1] < 0.4 * missing[0]  # right behind the stone both views are in shadow
everywhere = [np.sqrt(np.mean((array(image) - truth)[overlap] ** 2)) for image in (without, with_trust)]
print(f"in the whole overlap {everywhere[0]:.2f} without, {everywhere[1]:.2f} with")
assert everywhere[1] < everywhere[0]
weights = array(with_trust, "Weight0") + array(with_trust, "Weight1")
assert np.allclose(weights[array(with_trust, "ValidRegion") > 0], 1, atol=1e-5)

# Where one volume is alone it is shown, shadow and all.
alone = array(with_trust, "Coverage") == 1
assert np.array_equal(array(with_trust)[alone], array(without)[alone])

# The switch, and volumes without the array, are the plain stitcher.
plain = [vtkImageData() for _ in shadowed]
for copy, image in zip(plain, shadowed):
    copy.ShallowCopy(image)
    copy.GetPointData().RemoveArray("Reliability")
assert np.array_equal(array(stitched(plain)), array(without))
assert np.array_equal(array(stitched(shadowed, ReliabilityFloor=1.0)), array(without))

# An array of that name and another type is refused.
for bad in (np.ones(plain[1].GetNumberOfPoints()), np.ones((plain[1].GetNumberOfPoints(), 2), np.float32)):
    wrong = vtkImageData()
    wrong.ShallowCopy(plain[1])
    data = numpy_to_vtk(bad, deep=1)
    data.SetName("Reliability")
    wrong.GetPointData().AddArray(data)
    failures = []
    assert stitched([plain[0], wrong], failures).GetNumberOfPoints() == 0 and failures
    assert stitched([plain[0], wrong], UseReliability=False).GetNumberOfPoints() > 0
