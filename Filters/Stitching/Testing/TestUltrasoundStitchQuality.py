#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The measures of a stitched volume as a filter: the stitcher's own output, one by hand, a reference, bad input."""
import json
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkMultiBlockDataSet

from echorama.EchoramaFiltersStitching import vtkUltrasoundStitcher, vtkUltrasoundStitchQuality


def volume(values, origin=(0, 0, 0)):
    """values: (z, y, x)."""
    image = vtkImageData()
    image.SetDimensions(values.shape[::-1])
    image.SetOrigin(origin)
    data = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
    data.SetName("Intensity")
    image.GetPointData().SetScalars(data)
    return image


def speckle(seed, level=100, shape=(20, 30, 40)):
    return np.clip(np.random.default_rng(seed).normal(level, 12, shape), 0, 255).astype(np.uint8)


def watch(filter):
    messages = []

    def heard(caller, event, message=None):
        messages.append(message)
    heard.CallDataType = "string0"
    filter.AddObserver("ErrorEvent", heard)
    filter.GetExecutive().AddObserver("ErrorEvent", heard)
    return messages


a, b = volume(speckle(1)), volume(speckle(2), (20, 0, 0))
stitcher = vtkUltrasoundStitcher()
stitcher.SetMethodToAverage()
for source in (a, b):
    stitcher.AddInputDataObject(source)

quality = vtkUltrasoundStitchQuality()
assert quality.GetStride() == 3
quality.SetStride(1)
assert math.isnan(quality.GetTextureKept()) and quality.GetReport() == ""
quality.SetInputConnection(stitcher.GetOutputPort())
for source in (a, b):
    quality.AddSourceData(source)
quality.Update()

# The volume goes through as it came.
out, stitched = quality.GetOutput(), stitcher.GetOutput()
assert out.GetDimensions() == (60, 30, 20) == stitched.GetDimensions()
for name in ("Intensity", "ValidRegion", "Coverage"):
    assert np.array_equal(vtk_to_numpy(out.GetPointData().GetArray(name)), vtk_to_numpy(stitched.GetPointData().GetArray(name))), name
assert out.GetFieldData().GetAbstractArray("StitchedVolumes").GetNumberOfValues() == 2

# A mean of two keeps 71 % of independent speckle.
assert abs(quality.GetTextureKept() - 0.71) < 0.02, quality.GetTextureKept()
assert abs(quality.GetSpeckleSnr() / quality.GetSourceSpeckleSnr() - math.sqrt(2.0)) < 0.04
assert 0.7 < quality.GetSeamMean() < 1.3 and quality.GetSeamGradient() > 1.3
assert math.isnan(quality.GetErrorOverlap()) and math.isnan(quality.GetErrorOutside())
report = json.loads(quality.GetReport())
assert report["texture_kept"] == quality.GetTextureKept() and report["seam_mean"] == quality.GetSeamMean()
assert report["error_overlap"] is None and report["overlap_voxels"] == 20 * 30 * 20
assert set(report["borders"]) == set(report["cuts"]) == {"mean", "gradient", "faces"} and report["borders"]["faces"] > 0

# Sources as blocks, and a reference.
blocks = vtkMultiBlockDataSet()
for number, source in enumerate((a, b)):
    blocks.SetBlock(number, source)
quality.RemoveAllSources()
quality.AddSourceData(blocks)
quality.SetReferenceData(volume(np.full((20, 30, 60), 100.0)))
quality.Update()
assert json.loads(quality.GetReport())["texture_kept"] == report["texture_kept"]
values = vtk_to_numpy(stitched.GetPointData().GetArray("Intensity")).reshape(20, 30, 60).astype(float)
assert abs(quality.GetErrorOverlap() - np.abs(values[:, :, 20:40] - 100).mean()) < 1e-6
outside = np.concatenate([values[:, :, :20], values[:, :, 40:]], axis=2)
assert abs(quality.GetErrorOutside() - np.abs(outside - 100).mean()) < 1e-6

# A hard cut keeps the texture, and shows where levels differ.
bright = volume(speckle(2, 130), (20, 0, 0))
cut = np.concatenate([speckle(1)[:, :, :30], speckle(2, 130)[:, :, 10:]], axis=2)
quality = vtkUltrasoundStitchQuality()
quality.SetInputData(volume(cut))
for source in (a, bright):
    quality.AddSourceData(source)
quality.Update()
assert abs(quality.GetTextureKept() - 1.0) < 0.03 and quality.GetSeamMean() > 5.0

# What cannot be used is refused, and leaves no numbers behind.
messages = watch(quality)
quality.RemoveAllSources()
quality.AddSourceData(volume(np.zeros((4, 4, 4), np.int32)))
quality.Update()
assert messages and "volume 1" in messages[0], messages
assert quality.GetReport() == "" and math.isnan(quality.GetSeamMean())
