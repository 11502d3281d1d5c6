# SPDX-License-Identifier: BSD-3-Clause
"""Stitches two volumes of a phantom in ParaView; each rank makes, and writes, its own piece. Run by TestPieces.py.

Usage: pvbatch stitch_pieces.py FOLDER
"""
import os
import sys

from paraview.simple import *

LoadPlugin(os.environ["ECHORAMA_PLUGIN"], remote=False, ns=globals())
volumes = [UltrasoundPhantom(Seed=3, SpacingMm=2.5, Position=[x, 0, 0], Orientation=[0, angle, 0]) for x, angle in ((0, 0), (14, 6))]
for texture in ("Split", "Mix"):
    stitched = UltrasoundStitcher(Input=volumes, Method="Membrane", Texture=texture, OutputSpread=1, SpacingMm=2)
    # Not as raw bytes: VTK 9.1 cannot always read those with a libexpat that has the security fixes of 2024.
    SaveData(os.path.join(sys.argv[1], f"{texture}.pvti"), stitched, DataMode="Binary")
