#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Three views of a phantom, two of them knocked out of place: aligned, scored against the truth, stitched and written."""
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonTransforms import vtkTransform

from echorama import (vtkUltrasoundAligner, vtkUltrasoundAlignmentScore, vtkUltrasoundPhantomSource, vtkUltrasoundStitcher,
                      vtkUltrasoundVolume, vtkUltrasoundWriter)

aligner, score = vtkUltrasoundAligner(), vtkUltrasoundAlignmentScore()
for x, degrees, mm in ((-35, 0, (0, 0, 0)), (0, 4, (5, -4, 3)), (35, -4, (-4, 5, 2))):
    phantom = vtkUltrasoundPhantomSource()
    phantom.SetSpacingMm(1.5)
    phantom.SetPosition(x, 0, 0)  # the probe slides along the body ...
    phantom.SetOrientation(0, -x / 7, 0)  # ... and turns with it (degrees)
    phantom.Update()
    out_of_place = vtkTransform()
    out_of_place.Translate(mm)
    out_of_place.RotateWXYZ(degrees, 1, 1, 1)
    volume = vtkImageData()
    volume.ShallowCopy(phantom.GetOutput())
    vtkUltrasoundVolume.Move(volume, out_of_place.GetMatrix())  # the geometry is the pose: no voxel changes
    aligner.AddInputDataObject(volume)
    score.AddInputDataObject(volume)
    score.AddTruthData(phantom.GetOutput())

score.Update()
before = score.GetScore()
score.SetInputConnection(aligner.GetOutputPort())
score.Update()
print(f"off by {before:.2f} mm before, {score.GetScore():.2f} mm after")

stitcher, writer = vtkUltrasoundStitcher(), vtkUltrasoundWriter()
stitcher.SetInputConnection(aligner.GetOutputPort())
writer.SetInputConnection(stitcher.GetOutputPort())
writer.SetFileName("stitched.vti")
writer.Write()
