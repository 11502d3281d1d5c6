#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""pipeline_results.py OUT.npz: synthesises, aligns, stitches, embeds and measures distances on small volumes, and saves every number.

Run by TestSameResults.py on each stack and build; nothing here knows which it is on.
"""
import sys

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4

import echorama

volumes = []
for view, (x, angle) in enumerate([(0.0, 0.0), (12.0, 5.0)]):
    source = echorama.vtkUltrasoundPhantomSource()
    source.SetSeed(3)
    source.SetSpacingMm(2.0)
    source.SetPosition(x, 0.0, 0.0)
    source.SetOrientation(0.0, angle, 0.0)
    source.Update()
    volumes.append(source.GetOutput())

knocked = vtkImageData()
knocked.DeepCopy(volumes[1])
motion = vtkMatrix4x4()
motion.SetElement(0, 3, 3.0)
motion.SetElement(1, 3, -2.0)
assert echorama.vtkUltrasoundVolume.Move(knocked, motion)

aligner = echorama.vtkUltrasoundAligner()
aligner.AddInputDataObject(0, volumes[0])
aligner.AddInputDataObject(0, knocked)
aligner.Update()
pose = vtkMatrix4x4()
aligner.GetPose(1, pose)

stitcher = echorama.vtkUltrasoundStitcher()
stitcher.SetSpacingMm(2.0)
for volume in volumes:
    stitcher.AddInputData(volume)
stitcher.Update()

distance = echorama.vtkUltrasoundDistanceMap()
distance.SetInputData(stitcher.GetOutput())
distance.Update()

embedder = echorama.vtkUltrasoundEmbedder()
embedder.SetInputData(0, stitcher.GetOutput())
embedder.Update()

results = {"pose": [pose.GetElement(i, j) for i in range(4) for j in range(4)]}
for name, image in [("phantom", volumes[1]), ("stitched", stitcher.GetOutput()), ("distance", distance.GetOutput()),
                    ("embedded", embedder.GetOutput())]:
    results[name + ".geometry"] = [*image.GetOrigin(), *image.GetSpacing(), *image.GetDimensions()]
    arrays = image.GetPointData()
    for i in range(arrays.GetNumberOfArrays()):
        results[f"{name}.{arrays.GetArrayName(i)}"] = vtk_to_numpy(arrays.GetArray(i))
numpy.savez(sys.argv[1], **results)
