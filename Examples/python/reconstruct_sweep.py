#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""reconstruct_sweep.py SEQUENCE [CONFIGURATION.xml]: a tracked 2D sweep becomes a volume, sweep.vti; its probe is fitted."""
import sys

from echorama import (vtkUltrasoundProbeFit, vtkUltrasoundSequenceReader, vtkUltrasoundVolumeReconstructor,
                      vtkUltrasoundWriter)

if len(sys.argv) < 2:
    sys.exit(__doc__)

frames = vtkUltrasoundSequenceReader()
frames.SetFileName(sys.argv[1])
if len(sys.argv) > 2:
    frames.SetTransformFile(sys.argv[2]) # where ImageToProbe is, when the sequence has none

reconstructor = vtkUltrasoundVolumeReconstructor()
reconstructor.SetInputConnection(frames.GetOutputPort())
reconstructor.SetSpacingMm(1.0)
reconstructor.Update()
print(reconstructor.GetReport())

fit = vtkUltrasoundProbeFit() # passes the volume on, with ProbeGeometry and ProbeToWorld
fit.SetInputConnection(reconstructor.GetOutputPort())
fit.Update()
if fit.GetOverlap() > 0:
    print(f"probe: {100 * fit.GetOverlap():.0f}% overlap, {fit.GetResidualMm():.1f} mm off")

writer = vtkUltrasoundWriter()
writer.SetInputData(fit.GetOutput() if fit.GetOverlap() > 0 else reconstructor.GetOutput())
writer.SetFileName("sweep.vti")
if not writer.Write():
    sys.exit("sweep.vti was not written")
print("wrote sweep.vti")
