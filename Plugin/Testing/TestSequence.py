# SPDX-License-Identifier: BSD-3-Clause
"""A tracked sequence in ParaView: found by its extension, stepped through by the animation, drawn where it lies, written."""
import os
import pathlib
import tempfile

import numpy
from paraview import servermanager
from paraview.simple import *
from vtkmodules.util.numpy_support import vtk_to_numpy

LoadPlugin(os.environ["ECHORAMA_PLUGIN"], remote=False, ns=globals())
folder = pathlib.Path(tempfile.mkdtemp())
size, count = 64, 6

# A bright bar that moves through the frames, which are 2 mm apart; the tracker lost frame 4.
text = (f"ObjectType = Image\nNDims = 3\nDimSize = {size} {size} {count}\nKinds = domain domain list\nElementType = MET_UCHAR\n"
        "ElementSpacing = 1 1 1\nUltrasoundImageOrientation = MF\n")
pixels = numpy.full((count, size, size), 30, "u1")
for i in range(count):
    pixels[i, :, 8 * i:8 * i + 8] = 220
    pose = numpy.diag([0.5, 0.5, 1.0, 1.0])
    pose[:3, 3] = 10, 20, 2 * i
    text += f"Seq_Frame{i:04}_ImageToReferenceTransform = {' '.join(str(v) for v in pose.ravel())}\n"
    text += f"Seq_Frame{i:04}_ImageToReferenceTransformStatus = {'INVALID' if i == 4 else 'OK'}\n"
    text += f"Seq_Frame{i:04}_Timestamp = {50 + 0.5 * i}\n"
path = folder / "my.sweep.igs.mha"
path.write_bytes((text + "ElementDataFile = LOCAL\n").encode() + pixels.tobytes())

# ParaView's own readers of .mha come first for scripts; ours must at least be among those that can read the file.
factory = servermanager.vtkSMProxyManager.GetProxyManager().GetReaderFactory()
session = servermanager.ActiveConnection.Session
readers = factory.GetReaders(str(path), session)
offered = [readers.GetString(i) for i in range(readers.GetNumberOfStrings())]
print("offered:", offered)
assert "UltrasoundSequenceReader" in offered and "UltrasoundReader" not in offered, offered

reader = UltrasoundSequenceReader(FileName=str(path))
assert list(reader.TimestepValues) == [50 + 0.5 * i for i in range(count)], reader.TimestepValues
scene = GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
view = CreateView("RenderView")
view.ViewSize = [400, 300]
Show(reader, view).SetRepresentationType("Slice")
Show(OutputPort(reader, 1), view)
ResetCamera(view)
for i in (0, 3, 5, 1):
    scene.AnimationTime = 50 + 0.5 * i
    Render(view)
    frame = servermanager.Fetch(reader)
    assert numpy.array_equal(vtk_to_numpy(frame.GetPointData().GetArray("Intensity")), pixels[i].ravel()), i
    assert numpy.allclose(frame.GetOrigin(), (10, 20, 2 * i)) and numpy.allclose(frame.GetSpacing()[:2], 0.5), i
SaveScreenshot(str(folder / "frame.png"), view)
assert (folder / "frame.png").stat().st_size > 2000
points = OutputPort(reader, 1).GetDataInformation().GetNumberOfPoints()
assert points == count - 1, points

out = folder / "out.seq.nrrd"
SaveData(str(out), proxy=reader)
again = UltrasoundSequenceReader(FileName=str(out))
assert list(again.TimestepValues) == list(reader.TimestepValues), again.TimestepValues
again.UpdatePipeline(52.5)
frame = servermanager.Fetch(again)
assert numpy.array_equal(vtk_to_numpy(frame.GetPointData().GetArray("Intensity")), pixels[5].ravel())
print("frames, track and file agree; the picture is", folder / "frame.png")
