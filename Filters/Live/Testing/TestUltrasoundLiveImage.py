# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped live image: where it lies, what it carries, states, what is refused, beams on request, and that a new pose alone redoes
nothing."""
import math
import tempfile
import time

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkDoubleArray
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkMultiBlockDataSet
from vtkmodules.vtkCommonMath import vtkMatrix4x4

from echorama.EchoramaCore import vtkUltrasoundAcquisition, vtkUltrasoundScanConverter
from echorama.EchoramaFiltersLive import vtkUltrasoundLiveImage
from echorama.EchoramaFiltersStitching import vtkUltrasoundStitcher
from echorama.EchoramaReaders import vtkUltrasoundSequenceReader, vtkUltrasoundSequenceWriter


def volume(value=None, labels=None, dtype=np.uint8, size=(80, 60, 80), spacing=2.0):
    """Of a constant grey, or of a function of world positions; its middle at (0, 0, 75)."""
    image = vtkImageData()
    image.SetDimensions(size)
    image.SetSpacing(spacing, spacing, spacing)
    image.SetOrigin(-0.5 * spacing * (size[0] - 1), -0.5 * spacing * (size[1] - 1), 75 - 0.5 * spacing * (size[2] - 1))
    z, y, x = np.meshgrid(*[np.arange(n) * spacing + image.GetOrigin()[a] for a, n in reversed(list(enumerate(size)))], indexing="ij")
    values = np.full(x.shape, 100.0) if value is None else value(x, y, z)
    for name, array in (("Intensity", values.astype(dtype)), ("Embedding", None if labels is None else labels(x, y, z).astype(np.uint8))):
        if array is not None:
            made = numpy_to_vtk(array.ravel(), deep=True)
            made.SetName(name)
            image.GetPointData().AddArray(made)
    return image


def live_of(*images):
    live = vtkUltrasoundLiveImage()
    live.SetWidth(200)
    live.SetHeight(160)
    live.SetBeams(64)
    live.SetSamples(128)
    for image in images:
        live.AddInputData(image)
    return live


def array(image, name):
    found = image.GetPointData().GetArray(name)
    return None if found is None else vtk_to_numpy(found).reshape(image.GetDimensions()[::-1])[0].copy()


def errors_of(live, action):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    tags = [(each, each.AddObserver(vtkCommand.ErrorEvent, note)) for each in (live, live.GetExecutive())]
    action()
    for each, tag in tags:
        each.RemoveObserver(tag)
    return " ".join(messages)


def pose_of(angle, place):
    matrix = vtkMatrix4x4()
    matrix.SetElement(0, 0, math.cos(angle))
    matrix.SetElement(0, 1, -math.sin(angle))
    matrix.SetElement(1, 0, math.sin(angle))
    matrix.SetElement(1, 1, math.cos(angle))
    for axis, value in enumerate(place):
        matrix.SetElement(axis, 3, value)
    return matrix


def elements(matrix):
    return np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])


# Where it lies: a ramp along world z is read back at each pixel from the image's own geometry.
live = live_of(volume(lambda x, y, z: z + 0.3 * x, dtype=np.float32))
live.SetProbe(live.LINEAR)
assert live.SetProbeToWorld(pose_of(0.7, (5, -3, 20)))
live.Update()
image = live.GetOutput()
assert image.GetDimensions() == (200, 160, 1) and len(set(image.GetSpacing())) == 1
grey, valid = array(image, "Intensity"), array(image, "ValidRegion")
assert grey.dtype == np.uint8 and set(np.unique(valid)) == {0, 1} and image.GetPointData().GetScalars().GetName() == "Intensity"
points = np.array([image.GetPoint(i) for i in range(image.GetNumberOfPoints())]).reshape(160, 200, 3)
expected = points[..., 2] + 0.3 * points[..., 0]
assert np.abs(grey - expected)[valid == 1].max() < 1.0 and (grey[valid == 0] == 0).all() and valid.mean() > 0.4
assert live.GetState() == live.SEES_VOLUME and live.GetStateText() == "" and live.GetSeenShare() == 1.0
kept = vtkMatrix4x4()
assert vtkUltrasoundAcquisition.GetProbeToWorld(image, kept) and np.allclose(elements(kept), elements(pose_of(0.7, (5, -3, 20))))
direction = np.array([[image.GetDirectionMatrix().GetElement(i, j) for j in range(3)] for i in range(3)])
assert np.isclose(np.linalg.det(direction), 1) and np.allclose(direction[:, 1], [0, 0, 1])
live.FlipOn()
live.Update()
assert np.abs(array(live.GetOutput(), "Intensity").astype(int) - grey[:, ::-1]).max() <= 1
assert array(image, "Embedding") is None

# Labels come through where an input has them, in blocks as well.
labelled = volume(labels=lambda x, y, z: np.where(x < 0, 1, 3))
blocks = vtkMultiBlockDataSet()
blocks.SetBlock(0, labelled)
for live in (live_of(labelled), live_of()):
    if live.GetNumberOfInputConnections(0) == 0:
        live.AddInputDataObject(0, blocks)
    live.SetProbe(live.LINEAR)
    live.SetPosition(0, 0, 20)
    live.Update()
    labels, valid = array(live.GetOutput(), "Embedding"), array(live.GetOutput(), "ValidRegion")
    assert (labels[:, 60:95][valid[:, 60:95] == 1] == 1).all() and (labels[:, 105:140][valid[:, 105:140] == 1] == 3).all()
    assert ((labels > 0) == (valid == 1)).all()

# Beams on request, and what the scan converter makes of them.
assert live.GetOutput(1).GetNumberOfPoints() == 0
live.BeamsOutputOn()
live.Update()
beams = live.GetOutput(1)
assert beams.GetDimensions() == (128, 64, 1) and array(beams, "Intensity").dtype == np.float32
assert set(np.unique(array(beams, "Embedding"))) <= {1, 2, 3}
converter = vtkUltrasoundScanConverter()
converter.SetInputConnection(live.GetOutputPort(1))
converter.Update()
made = converter.GetOutput()
assert np.allclose(array(made, "Intensity")[array(made, "ValidRegion") == 1], 100, atol=1e-3)
assert np.allclose(made.GetBounds(), live.GetOutput().GetBounds(), atol=20)

# States: nothing connected, nothing under the probe.
empty = live_of()
empty.Update()
assert empty.GetState() == empty.NO_VOLUME and empty.GetStateText() and array(empty.GetOutput(), "ValidRegion").max() == 0
live = live_of(volume())
live.SetNoiseDb(-20)
live.SetPosition(0, 500, 0)
live.Update()
assert live.GetState() == live.OUTSIDE and "no volume" in live.GetStateText() and live.GetSeenShare() == 0
assert array(live.GetOutput(), "Intensity").max() == 0 and array(live.GetOutput(), "ValidRegion").max() == 0

# Poses that are none are refused by name, and the old one stays.
live.SetPosition(0, 0, 20)
for spoil in (lambda m: m.SetElement(0, 3, math.nan), lambda m: m.SetElement(1, 1, math.inf), lambda m: m.SetElement(0, 0, 2.0)):
    bad = pose_of(0.0, (1, 2, 3))
    spoil(bad)
    assert "ProbeToWorld" in errors_of(live, lambda: live.SetProbeToWorld(bad))
assert live.GetPosition() == (0, 0, 20)
live.SetPosition(math.nan, 0, 0) # numbers are checked when they are used
assert "Position" in errors_of(live, live.Update) and live.GetState() == live.FAILED
live.SetPosition(0, 0, 20)
live.SetDynamicRangeDb(0)
assert "DynamicRangeDb" in errors_of(live, live.Update)
live.SetDynamicRangeDb(60)
live.Update()
assert live.GetState() == live.SEES_VOLUME

# A failure is told, leaves nothing behind, and is over with its reason.
live.SetWhite(-5)
assert "White" in errors_of(live, live.Update)
assert live.GetState() == live.FAILED and live.GetStateText()
live.SetWhite(255)
live.Update()
assert live.GetState() == live.SEES_VOLUME and array(live.GetOutput(), "ValidRegion").max() == 1
spoiled = volume()
spoiled.GetPointData().AddArray(numpy_to_vtk(np.zeros(spoiled.GetNumberOfPoints()), deep=True))
spoiled.GetPointData().GetArray(1).SetName("Embedding")
failing = live_of(spoiled)
assert "Embedding" in errors_of(failing, failing.Update) and failing.GetState() == failing.FAILED

# A probe from a volume that knows its own.
recorded = volume()
assert "ProbeGeometry" in errors_of(live, lambda: live.SetProbeFrom(recorded))
field = vtkDoubleArray()
field.SetName(vtkUltrasoundAcquisition.ProbeGeometryName())
field.SetNumberOfComponents(6)
field.InsertNextTuple([50.0, 40.0, 60.0, 30.0, 4.0, 90.0])
recorded.GetFieldData().AddArray(field)
assert live.SetProbeFrom(recorded)
live.Update()
probe = vtk_to_numpy(live.GetOutput().GetFieldData().GetArray(vtkUltrasoundAcquisition.ProbeGeometryName())).ravel()
assert np.allclose(probe, [50, 40, 0, 0, 4, 90]), probe

# Voxels that change are seen; a volume is looked at anew only then.
changing = volume(spacing=1.0, size=(160, 120, 160))
seen = numpy_to_vtk(np.ones(changing.GetNumberOfPoints(), np.uint8), deep=True)
seen.SetName("ValidRegion")
changing.GetPointData().AddArray(seen)
live = live_of(changing)
live.SetProbe(live.LINEAR)
live.SetPosition(0, 0, 20)
live.Update()
before = array(live.GetOutput(), "Intensity").max()
vtk_to_numpy(changing.GetPointData().GetArray("Intensity"))[:] = 150
changing.GetPointData().GetArray("Intensity").Modified()


def cpu_seconds(action):
    start = time.process_time()
    action()
    return time.process_time() - start


first = cpu_seconds(live.Update)
assert before == 100 and array(live.GetOutput(), "Intensity").max() == 150
moves = []
for step in range(7):
    live.SetPosition(0.5 * step, 0, 20)
    moves.append(cpu_seconds(live.Update))
assert np.median(moves) < 0.5 * first, (first, moves) # three million voxels are not looked at again

# The described controls reach the image.
live.SetGainDb(6)
live.Update()
assert array(live.GetOutput(), "Intensity").max() in (175, 176)
for name in ("convex", "linear", "phased", "endocavity", "radial"):
    assert live.SetParameterAsText("Probe", name)
    live.SetPosition(0, 0, 75 if name == "radial" else 10)
    live.Update()
    assert live.GetState() == live.SEES_VOLUME, name

# A recording says of each frame where it lies: flipped or not, its pixels are at the same places of the world, and no mirror image.
with tempfile.TemporaryDirectory() as folder:
    for flip in (0, 1):
        live = live_of(volume(lambda x, y, z: 100 + 50 * np.tanh(x / 20) + 0.3 * z, dtype=np.float32))
        live.SetProbe(live.LINEAR)
        live.SetProbeToWorld(pose_of(0.7, (5, -3, 20)))
        live.SetFlip(flip)
        writer = vtkUltrasoundSequenceWriter()
        writer.SetInputConnection(live.GetOutputPort())
        writer.SetFileName(f"{folder}/frame{flip}.igs.mha")
        assert writer.Write() == 1
        reader = vtkUltrasoundSequenceReader()
        reader.SetFileName(writer.GetFileName())
        reader.Update()
        frame = reader.GetOutput()
        grey, made = array(frame, "Intensity"), array(live.GetOutput(), "Intensity")
        assert frame.GetDimensions() == (200, 160, 1) and (grey == made).all()
        at = np.array([frame.GetPoint(i) for i in range(frame.GetNumberOfPoints())]).reshape(160, 200, 3)
        valid = array(live.GetOutput(), "ValidRegion") == 1
        assert valid.mean() > 0.4 and np.abs(grey - (100 + 50 * np.tanh(at[..., 0] / 20) + 0.3 * at[..., 2]))[valid].max() < 1.5
        axes = np.array([[frame.GetDirectionMatrix().GetElement(i, j) for j in range(3)] for i in range(3)])
        side = axes[:, 0] @ elements(pose_of(0.7, (0, 0, 0)))[:3, 0]
        assert np.isclose(np.linalg.det(axes), 1) and np.isclose(side, 1 - 2 * flip)

# What is invented can be hidden: it is then as where no volume reaches.
live = live_of(labelled)
live.SetProbe(live.LINEAR)
live.SetPosition(0, 0, 20)
live.Update()
shown = {name: array(live.GetOutput(), name) for name in ("Intensity", "ValidRegion", "Embedding")}
share = live.GetSeenShare()
live.ShowInventedOff()
live.Update()
hidden = {name: array(live.GetOutput(), name) for name in shown}
assert (hidden["Embedding"][:, 60:95] == shown["Embedding"][:, 60:95]).all() and (hidden["Embedding"] != 3).all()
assert (shown["ValidRegion"][:, 105:140] == 1).mean() > 0.5
for name in hidden:
    assert (hidden[name][:, 105:140] == 0).all(), name
assert 0.4 * share < live.GetSeenShare() < 0.6 * share
live.SetPosition(60, 0, 20) # over what is invented alone
live.Update()
assert live.GetState() == live.OUTSIDE and array(live.GetOutput(), "Intensity").max() == 0 and "measured" in live.GetStateText()

# Overlapping volumes of other gains: the mean has no seam, and is close to the stitched volume.
def part(low, high, gain):
    made = vtkImageData()
    made.SetDimensions(high - low + 1, 81, 101)
    made.SetOrigin(low, -40, 0)
    z, y, x = np.meshgrid(np.arange(101.0), np.arange(81.0) - 40, np.arange(low, high + 1.0), indexing="ij")
    values = numpy_to_vtk((100 + gain + 20 * np.sin(x / 9) * np.cos(z / 11) + 0.2 * y).astype(np.float32).ravel(), deep=True)
    values.SetName("Intensity")
    made.GetPointData().SetScalars(values)
    return made


parts = part(-60, 20, 15), part(-20, 60, -15)
stitcher = vtkUltrasoundStitcher()
for each in parts:
    stitcher.AddInputData(each)
stitcher.Update()
images, steps = {}, {}
for name, inputs, overlap in (("stitched", (stitcher.GetOutput(),), "first"), ("first", parts, "first"), ("mean", parts, "mean")):
    live = live_of(*inputs)
    assert live.SetParameterAsText("Overlap", overlap)
    live.SetProbe(live.CONVEX)
    live.SetPosition(0, 0, 5)
    live.SetDepthMm(80)
    live.Update()
    images[name] = array(live.GetOutput(), "Intensity").astype(float)
    valid = array(live.GetOutput(), "ValidRegion")
    both = (valid[:, 1:] == 1) & (valid[:, :-1] == 1)
    steps[name] = np.abs(np.diff(images[name], axis=1))[both].max()
errors = {name: np.sqrt(np.mean((images[name] - images["stitched"])[valid == 1] ** 2)) for name in ("first", "mean")}
print("overlap: largest steps " + str(steps) + ", RMS to the stitched volume " + str(errors) + ", grey")
assert errors["mean"] < 1.5 and errors["first"] > 8, errors
assert steps["mean"] <= steps["stitched"] + 1 and steps["first"] > 20, steps
