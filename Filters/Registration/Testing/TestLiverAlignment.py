# SPDX-License-Identifier: BSD-3-Clause
"""Two real volumes of a liver, truly aligned where their files say: B is knocked out of place and has to come back.

Six of the twenty trials that `./run bench align_search` makes, read through the pipeline and with its default parameters.
"""
import math
import os
import pathlib
import sys

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonTransforms import vtkTransform

from echorama.EchoramaCore import vtkUltrasoundVolume
from echorama.EchoramaFiltersRegistration import vtkUltrasoundAligner, vtkUltrasoundAlignmentScore

try:
    from echorama.EchoramaReaders import vtkUltrasoundReader
except ImportError:
    print("skipped: this build has no readers")
    sys.exit(77)

data = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"]).parent / "shared" / "data" / "liver"
if not data.is_dir():
    print(f"skipped: there are no liver volumes in {data}")
    sys.exit(77)

TRIALS = 6
volumes = []
for name in ("liver_volume_A.mha", "liver_volume_B.mha"):
    reader = vtkUltrasoundReader()
    reader.SetFileName(str(data / name))
    reader.Update()
    volumes.append(reader.GetOutput())
a, b = volumes

valid = vtk_to_numpy(b.GetPointData().GetArray("ValidRegion")).reshape(b.GetDimensions()[::-1])
centre = [np.mean(axis) for axis in np.nonzero(valid)][::-1] * np.array(b.GetSpacing()) + b.GetOrigin()

rng = np.random.default_rng(2026)
scores = []
for trial in range(TRIALS):
    axis, way = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    motion = vtkTransform()
    motion.Translate(*(centre + 8.0 * way))
    motion.RotateWXYZ(6.0, *axis)
    motion.Translate(*-centre)
    knocked = vtkImageData()
    knocked.ShallowCopy(b)
    assert vtkUltrasoundVolume.Move(knocked, motion.GetMatrix())

    aligner = vtkUltrasoundAligner()
    aligner.AddInputDataObject(0, a)
    aligner.AddInputDataObject(0, knocked)
    score = vtkUltrasoundAlignmentScore()
    score.SetInputConnection(aligner.GetOutputPort())
    score.AddTruthData(a)
    score.AddTruthData(b)
    score.Update()
    scores.append(score.GetScore())
    print(f"trial {trial}: score {scores[-1]:.3f} mm, overlap {aligner.GetOverlap(1):.3f}")

assert not any(math.isnan(s) for s in scores), scores
assert np.median(scores) <= 0.3, scores
assert sum(s <= 1.0 for s in scores) >= TRIALS - 1, scores
