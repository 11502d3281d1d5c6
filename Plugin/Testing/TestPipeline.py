# SPDX-License-Identifier: BSD-3-Clause
"""Reads, aligns and stitches in ParaView: the liver pair, volume B knocked out of place. Also run on two ranks.

Usage: pvbatch TestPipeline.py [OUT.pvti]   (OUT: the stitched volume, written by all ranks; then nothing is drawn)
"""
import os
import pathlib
import sys
import tempfile

import numpy
from paraview import servermanager
from paraview.simple import *
from vtkmodules.util.numpy_support import vtk_to_numpy

LoadPlugin(os.environ["ECHORAMA_PLUGIN"], remote=False, ns=globals())
data = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"]).parent / "shared" / "data" / "liver"
if not data.is_dir():
    print(f"skipped: no real data in {data}")
    sys.exit(77)
ranks = servermanager.vtkProcessModule.GetProcessModule().GetNumberOfLocalPartitions()

# Volume B, moved in its header alone.
move = numpy.array([4.0, -3.0, 2.0])
folder = tempfile.mkdtemp()
text = (data / "liver_volume_B.mha").read_bytes()
header, rest = text[: text.index(b"ElementDataFile")], text[text.index(b"ElementDataFile"):]
lines = []
for line in header.decode("ascii").splitlines():
    if line.startswith("Offset"):
        numbers = numpy.array([float(n) for n in line.split("=")[1].split()]) + move
        line = "Offset = " + " ".join(repr(float(n)) for n in numbers)
    lines.append(line)
moved = pathlib.Path(folder, "B.mha")
moved.write_bytes(("\n".join(lines) + "\n").encode() + rest)

a = UltrasoundReader(FileName=str(data / "liver_volume_A.mha"))
b = UltrasoundReader(FileName=str(moved))
aligned = UltrasoundAligner(Input=[a, b])
stitched = UltrasoundStitcher(Input=aligned, SpacingMm=1.6)
stitched.UpdatePipeline()

information = aligned.GetDataInformation()
assert information.GetCompositeDataClassName() == "vtkMultiBlockDataSet", information.GetCompositeDataClassName()
blocks = servermanager.Fetch(aligned) if ranks == 1 else None
if blocks:
    for index, before, expected in ((0, a, 0.0), (1, b, 0.0)):
        origin = numpy.array(blocks.GetBlock(index).GetOrigin())
        was = numpy.array(servermanager.Fetch(before).GetOrigin())
        print("block", index, "moved by", origin - was)
    back = numpy.array(blocks.GetBlock(1).GetOrigin()) - numpy.array(servermanager.Fetch(b).GetOrigin())
    # A small rotation about the middle also moves the corner; half a millimetre covers it.
    assert numpy.abs(back + move).max() < 0.7, back

whole = servermanager.Fetch(stitched)  # of several ranks the first one's piece
intensity = vtk_to_numpy(whole.GetPointData().GetArray("Intensity"))
valid = vtk_to_numpy(whole.GetPointData().GetArray("ValidRegion"))
print(f"{ranks} rank(s): {whole.GetDimensions()} voxels, {valid.mean():.3f} of them valid, mean {intensity[valid > 0].mean():.3f}")
assert intensity[valid > 0].mean() > 10.0
if len(sys.argv) > 1:
    SaveData(sys.argv[1], stitched, DataMode="Binary")  # raw bytes and newer libexpat: see stitch_pieces.py
else:
    embedded = UltrasoundEmbedder(Input=stitched, FeatherMm=4.0, Form=a)
    result = servermanager.Fetch(embedded)
    labels = vtk_to_numpy(result.GetPointData().GetArray("Embedding"))
    print(f"embedded: {result.GetDimensions()} voxels, {(labels == 3).mean():.3f} of them invented")
    assert all(x >= y for x, y in zip(result.GetDimensions(), whole.GetDimensions())) and (labels == 3).any()
    assert vtk_to_numpy(result.GetPointData().GetArray("ValidRegion")).sum() == valid.sum()
    invented = Threshold(Input=embedded, Scalars=["POINTS", "Embedding"], LowerThreshold=3, UpperThreshold=3)
    invented.UpdatePipeline()
    assert invented.GetDataInformation().GetNumberOfPoints() > 0

    view = CreateView("RenderView")
    view.ViewSize = [800, 600]
    shown = Show(stitched, view)
    shown.SetRepresentationType("Slice")
    ResetCamera(view)
    SaveScreenshot(str(pathlib.Path(folder, "stitched.png")), view)
    assert pathlib.Path(folder, "stitched.png").stat().st_size > 5000
