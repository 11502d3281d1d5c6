#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The measures of an embedded volume as a filter: a step, a volume by the feather, the truth of its labels, bad input."""
import json
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData

import echorama

SHAPE = (36, 40, 44) # z, y, x


def volume(origin=(0, 0, 0), **arrays):
    """Arrays of (z, y, x)."""
    image = vtkImageData()
    image.SetOrigin(origin)
    for name, values in arrays.items():
        image.SetDimensions(values.shape[::-1])
        data = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
        data.SetName(name)
        image.GetPointData().AddArray(data)
    return image


def watch(filter):
    messages = []

    def heard(caller, event, message=None):
        messages.append(message)
    heard.CallDataType = "string0"
    filter.AddObserver("ErrorEvent", heard)
    filter.GetExecutive().AddObserver("ErrorEvent", heard)
    return messages


labels = np.full(SHAPE, 3, np.uint8)
labels[:, :, :22] = 1
noise = np.random.default_rng(4).normal(0, 8, SHAPE)

# A step of 9 grey levels and a deviation half as large again.
step = np.where(labels == 1, 100 + noise, 109 + 1.5 * noise).astype(np.float32)
quality = echorama.vtkUltrasoundEmbedQuality()
assert quality.GetShellMm() == 5 and quality.GetFeatherMm() == 3 and quality.GetRandomSurfaces() == 24
assert math.isnan(quality.GetSeamJump()) and quality.GetAlteredVoxels() == -1 and quality.GetReport() == ""
quality.SetInputData(volume(Intensity=step, Embedding=labels))
quality.Update()
report = json.loads(quality.GetReport())
assert abs(report["border"]["bias"] - 9) < 0.3 and abs(report["border"]["mean"] - 9) < 0.3
assert report["border"]["percentile95"] == quality.GetSeamJump() > 9 > quality.GetReferenceJump() > 0.5
assert quality.GetJumpLimit() == max(2.0, quality.GetReferenceJump()) and not quality.GetSeamPasses()
assert abs(quality.GetDeviationRatio() - 1.5) < 0.05
assert quality.GetAlteredVoxels() == -1 and math.isnan(quality.GetCropShare()) and report["crop"]["share"] is None
assert (quality.GetDataVoxels(), quality.GetBlendVoxels(), quality.GetInventedVoxels()) == (36 * 40 * 22, 0, 36 * 40 * 22)
out = quality.GetOutput().GetPointData()
assert (vtk_to_numpy(out.GetArray("Intensity")) == step.ravel()).all() and out.GetArray("Embedding")

# A volume on a background that is alike: the seam is not seen, and the labels are true.
data = (100 + noise).astype(np.uint8)
valid = (labels == 1).astype(np.uint8)
original = volume(Intensity=data, ValidRegion=valid)
feather = echorama.vtkUltrasoundFeather()
feather.SetInputData(0, original)
feather.SetInputData(1, volume(Intensity=np.random.default_rng(5).normal(100, 8, SHAPE).astype(np.float32)))
quality = echorama.vtkUltrasoundEmbedQuality()
quality.SetInputConnection(feather.GetOutputPort())
quality.SetOriginalData(original)
quality.Update()
assert quality.GetSeamPasses(), quality.GetReport()
assert quality.GetAlteredVoxels() == quality.GetPretendedVoxels() == quality.GetLostVoxels() == 0
assert quality.GetBlendVoxels() > 0
quality.SetFeatherMm(1)
quality.Update()
assert quality.GetLostVoxels() > 0 # the feather was wider than that

# One voxel that is not what it says it is.
lie = volume(Intensity=np.where(np.arange(data.size).reshape(SHAPE) == 5, 7, data).astype(np.uint8), Embedding=labels)
quality.SetInputData(lie)
quality.Update()
assert quality.GetAlteredVoxels() == 1, quality.GetReport()

# What cannot be used is refused, and leaves no numbers behind.
for image, source, word in ((volume(Intensity=data), None, "Embedding"),
                            (volume(Intensity=data, Embedding=labels.astype(np.int16)), None, "Embedding"),
                            (lie, volume(Intensity=step), "type"),
                            (lie, volume(origin=(0.5, 0, 0), Intensity=data), "does not lie")):
    quality = echorama.vtkUltrasoundEmbedQuality()
    messages = watch(quality)
    quality.SetInputData(image)
    if source:
        quality.SetOriginalData(source)
    quality.Update()
    assert messages and word in messages[0], (word, messages)
    assert quality.GetReport() == "" and math.isnan(quality.GetSeamJump())
