# SPDX-License-Identifier: BSD-3-Clause
"""Opens the state Examples/paraview/paint_and_align.py, and the same from a .pvsm file that ParaView writes of it: what comes out of
every step, and that a change is followed. ECHORAMA_UPDATE_PICTURES=1 replaces the picture of the page with that of the state.

Usage: pvbatch TestState.py
"""
import os
import pathlib
import runpy
import tempfile

import numpy
from paraview import servermanager
from paraview.simple import *
from vtkmodules.util.numpy_support import vtk_to_numpy

LoadPlugin(os.environ["ECHORAMA_PLUGIN"], remote=False)
source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
voxels = lambda data, name="Intensity": vtk_to_numpy(data.GetPointData().GetArray(name)).copy()
NAMES = ["Left view", "Right view", "Stroke", "Ball", "Marks on the left", "Marks on the right", "Out of place", "Aligned", "Landmark error",
         "Stitched", "Disagreement"]


def check(steps):
    """What the page says of the state; returns numbers that are to be the same when it is opened again."""
    data = {name: servermanager.Fetch(step) for name, step in steps.items()}
    left, painted = voxels(data["Left view"]), voxels(data["Stroke"])
    changed = left != painted
    assert 100 < changed.sum() < 0.02 * len(left) and painted.max() <= 255
    right, carved = data["Right view"], data["Ball"]
    points = numpy.array([right.GetPoint(i) for i in range(right.GetNumberOfPoints())])
    in_ball = numpy.linalg.norm(points - [45, 0, 50], axis=1) <= 12
    assert in_ball.sum() > 1000 and numpy.array_equal(voxels(carved, "ValidRegion"), voxels(right, "ValidRegion") * ~in_ball)
    blocks = data["Aligned"]
    verdicts = [blocks.GetBlock(i).GetFieldData().GetAbstractArray("AlignmentVerdict").GetValue(0) for i in range(2)]
    assert verdicts == ["aligned", "aligned"]
    # The right view was knocked out of place by 8.8 mm and some degrees; it is back where the phantom has it.
    truth, found = (numpy.array([image.GetPoint(i) for i in (0, image.GetNumberOfPoints() // 2, image.GetNumberOfPoints() - 1)])
                    for image in (right, blocks.GetBlock(1)))
    off = numpy.linalg.norm(found - truth, axis=1).max()
    marks = data["Landmark error"].GetFieldData().GetArray("Max").GetValue(0)
    print(f"off by {off:.2f} mm at most, landmarks by {marks:.2f} mm")
    assert off < 1.0 and data["Landmark error"].GetNumberOfPoints() == 3 and marks < 1.0
    whole = data["Stitched"]
    assert whole.GetBounds()[1] - whole.GetBounds()[0] > 190
    assert (voxels(whole) > 200).sum() > 100, "the stroke is in the result"
    known = voxels(data["Disagreement"], "KnownDirections") > 0
    assert known.sum() > 10 and numpy.median(voxels(data["Disagreement"], "Disagreement")[known]) < 0.5
    return [changed.sum(), off, marks, voxels(whole).astype(float).sum(), known.sum()]


names = runpy.run_path(str(source / "Examples" / "paraview" / "paint_and_align.py"))
steps = {name: FindSource(name) for name in NAMES}
assert all(steps.values()), [name for name, step in steps.items() if not step]
numbers = check(steps)

with tempfile.TemporaryDirectory() as folder:
    # The picture: a stroke as bright as it was painted, a hole where it was carved, in views that are not empty.
    picture = os.path.join(folder, "state.png")
    SaveScreenshot(picture, names["layout"], ImageResolution=[1200, 330])
    if os.environ.get("ECHORAMA_UPDATE_PICTURES"):
        (source / "Documentation" / "pictures" / "paraview-painting.png").write_bytes(pathlib.Path(picture).read_bytes())
    reader = PNGSeriesReader(FileNames=[picture])
    pixels = vtk_to_numpy(servermanager.Fetch(reader).GetPointData().GetScalars()).reshape(330, 1200, -1)[..., :3].astype(int)
    for part in numpy.array_split(pixels, 3, axis=1):
        lit = part.min(-1)
        assert ((lit > 60) & (lit < 200)).mean() > 0.2 and (lit < 20).mean() > 0.2
    assert (pixels[:, :360].min(-1) > 215).mean() > 0.005, "the stroke"
    colours = pixels[:, 760:].max(-1) - pixels[:, 760:].min(-1)
    assert (colours > 60).sum() > 200, "what disagrees, and its scale"
    Delete(reader)

    # As ParaView writes it, and opens it again.
    state = os.path.join(folder, "painting.pvsm")
    SaveState(state)
    ResetSession()
    LoadPlugin(os.environ["ECHORAMA_PLUGIN"], remote=False)
    assert FindSource("Stroke") is None
    LoadState(state)
steps = {name: FindSource(name) for name in NAMES}
assert all(steps.values()), [name for name, step in steps.items() if not step]
assert len(steps["Stroke"].Points) == 9 and list(steps["Marks on the left"].Labels) == ["cyst", "fork", "wall"]
again = check(steps)
assert numpy.allclose(again, numbers, rtol=1e-9), (again, numbers)

# A handle that is moved is followed by what comes after it: the ball a little farther, the right view carved elsewhere.
steps["Ball"].Shape.Radius = 2.0
steps["Stroke"].Points = []
assert (voxels(servermanager.Fetch(steps["Stroke"])) == voxels(servermanager.Fetch(steps["Left view"]))).all()
assert (voxels(servermanager.Fetch(steps["Stitched"])) > 200).sum() < 30, "no stroke any more"
