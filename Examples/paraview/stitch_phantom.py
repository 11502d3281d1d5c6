# SPDX-License-Identifier: BSD-3-Clause
"""The demo in ParaView: three views of a phantom, two of them knocked out of place, aligned, stitched, written and drawn.

pvbatch stitch_phantom.py PLUGIN   (PLUGIN: path of Echorama.so; needs a screen, xvfb-run provides one)
"""
import sys

from paraview import servermanager
from paraview.simple import *

LoadPlugin(sys.argv[1], remote=False, ns=globals())


def view_of_phantom(x, knock):
    """What the probe sees at x, taken to lie elsewhere."""
    volume = servermanager.Fetch(UltrasoundPhantom(SpacingMm=1.5, Position=[x, 0, 0], Orientation=[0, -x / 7, 0]))
    volume.SetOrigin([here + mm for here, mm in zip(volume.GetOrigin(), knock)])  # the geometry is the pose: no voxel changes
    source = TrivialProducer()
    source.GetClientSideObject().SetOutput(volume)
    source.UpdatePipeline()
    return source


volumes = [view_of_phantom(-35, [0, 0, 0]), view_of_phantom(0, [5, -4, 3]), view_of_phantom(35, [-4, 5, 2])]
aligned = UltrasoundAligner(Input=volumes)
stitched = UltrasoundStitcher(Input=aligned)
SaveData("stitched.vti", stitched)

blocks = servermanager.Fetch(aligned)
for index, volume in enumerate(volumes):
    before, after = servermanager.Fetch(volume).GetOrigin(), blocks.GetBlock(index).GetOrigin()
    print(f"volume {index + 1}: first voxel moved by", [round(b - a, 2) for a, b in zip(before, after)], "mm")

view = CreateView("RenderView", ViewSize=[1000, 700])
display = Show(stitched, view, "UniformGridRepresentation")
display.Representation = "Volume"
ColorBy(display, ("POINTS", "Intensity"))
GetColorTransferFunction("Intensity").ApplyPreset("Grayscale", True)
view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [120, 350, -60], [0, 0, 60], [0, 0, -1]
ResetCamera(view)
SaveScreenshot("stitched.png", view)
