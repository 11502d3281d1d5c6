# SPDX-License-Identifier: BSD-3-Clause
"""Stitches volumes of a phantom in ParaView; each rank makes, and writes, its own piece. Once the ranks share the pairs of these volumes, to
align them first. Run by TestPieces.py.

Usage: pvbatch stitch_pieces.py FOLDER
"""
import json
import os
import sys

from paraview.simple import *

LoadPlugin(os.environ["ECHORAMA_PLUGIN"], remote=False, ns=globals())
volumes = [UltrasoundPhantom(Seed=3, SpacingMm=2.5, Position=[x, 0, 0], Orientation=[0, angle, 0]) for x, angle in ((0, 0), (14, 6), (7, 3))]
aligned = UltrasoundAligner(Input=volumes, Start="tracked", Points=5000)
for name, texture, views in (("Split", "Split", volumes[:2]), ("Mix", "Mix", volumes[:2]), ("Aligned", "Split", aligned)):
    stitched = UltrasoundStitcher(Input=views, Method="Membrane", Texture=texture, OutputSpread=1, SpacingMm=2)
    # Not as raw bytes: VTK 9.1 cannot always read those with a libexpat that has the security fixes of 2024.
    SaveData(os.path.join(sys.argv[1], f"{name}.pvti"), stitched, DataMode="Binary")
sys.path += os.environ["ECHORAMA_PARAVIEW_PYTHONPATH"].split(":")
from echorama import vtkUltrasoundAligner  # so that Python knows the filter behind the proxy

report = json.loads(aligned.GetClientSideObject().GetReport())
print("pairs shared by", report["ranks"], "ranks")
