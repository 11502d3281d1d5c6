# SPDX-License-Identifier: BSD-3-Clause
"""Hard cases with a known truth, and what the aligner must say about each: where it says `aligned`, it must be right.

Views of the phantom, 1.5 mm voxels; the moving volume starts 10 degrees and 12 mm off unless a case says otherwise.
"""
import math
import sys

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4

from echorama.EchoramaCore import vtkUltrasoundVolume
from echorama.EchoramaFiltersRegistration import vtkUltrasoundAligner

try:
    from echorama.EchoramaFiltersPhantoms import vtkUltrasoundPhantomSource
except ImportError:
    print("skipped: this build has no phantom")
    sys.exit(77)

VOXEL = 1.5


def view(x=0.0, turn=(0.0, 0.0, 0.0), ellipsoids=None, y=0.0, **properties):
    """One view; ellipsoids replace the default scene."""
    source = vtkUltrasoundPhantomSource()
    source.SetSpacingMm(VOXEL)
    source.SetPosition(x, y, 0.0)
    source.SetOrientation(*turn)
    if ellipsoids is not None:
        source.ClearScene()
        for centre, radii, decibels in ellipsoids:
            source.AddEllipsoid(centre, radii, decibels)
    for name, value in properties.items():
        getattr(source, "Set" + name)(value)
    source.Update()
    image = vtkImageData()
    image.DeepCopy(source.GetOutput())
    return image


def arrays(image):
    shape = image.GetDimensions()[::-1]
    return (vtk_to_numpy(image.GetPointData().GetArray(name)).reshape(shape) for name in ("Intensity", "ValidRegion"))


def with_voxels(image, intensity, valid=None, dims=None, spacing=None, origin_index=(0, 0, 0)):
    """The same place, other voxels."""
    new = vtkImageData()
    dims = dims or image.GetDimensions()
    new.SetDimensions(dims)
    new.SetSpacing(spacing or image.GetSpacing())
    d = image.GetDirectionMatrix()  # numbers, not the matrix itself: the images would share it
    new.SetDirectionMatrix(*[d.GetElement(row, column) for row in range(3) for column in range(3)])
    origin = [0.0, 0.0, 0.0]
    image.TransformContinuousIndexToPhysicalPoint(*[float(i) for i in origin_index], origin)
    new.SetOrigin(origin)
    for name, values in (("Intensity", intensity), ("ValidRegion", valid)):
        if values is not None:
            array = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
            array.SetName(name)
            new.GetPointData().AddArray(array)
    return new


def geometry(image):
    d = image.GetDirectionMatrix()
    m = np.eye(4)
    m[:3, :3] = [[d.GetElement(r, c) * image.GetSpacing()[c] for c in range(3)] for r in range(3)]
    m[:3, 3] = image.GetOrigin()
    return m


def points_of(image):
    """Some points of the valid region, homogeneous index coordinates."""
    _, valid = arrays(image)
    k, j, i = np.nonzero(valid)
    some = np.random.default_rng(1).choice(len(i), min(800, len(i)), replace=False)
    return np.stack([i[some], j[some], k[some], np.ones(len(some))])


def motion(degrees, mm, centre, seed):
    rng = np.random.default_rng(seed)
    axis, way = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    a = math.radians(degrees)
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    m = np.eye(4)
    m[:3, :3] = np.eye(3) + math.sin(a) * K + (1 - math.cos(a)) * K @ K
    m[:3, 3] = centre - m[:3, :3] @ centre + mm * way
    return m


def align(fixed, moving, degrees=10.0, mm=12.0, seed=3, start="hand-made", **properties):
    """Verdict, error in voxels, and the filter."""
    points = points_of(moving)
    truth = geometry(moving) @ points
    knock = motion(degrees, mm, truth[:3].mean(1), seed)
    knocked = vtkImageData()
    knocked.ShallowCopy(moving)
    matrix = vtkMatrix4x4()
    matrix.DeepCopy([float(x) for x in knock.ravel()])
    assert vtkUltrasoundVolume.Move(knocked, matrix)
    aligner = vtkUltrasoundAligner()
    aligner.SetStart(start)
    for name, value in properties.items():
        getattr(aligner, "Set" + name)(value)
    aligner.AddInputDataObject(0, fixed)
    aligner.AddInputDataObject(0, knocked)
    aligner.Update()
    found = geometry(aligner.GetOutput().GetBlock(1)) @ points
    error = np.linalg.norm((found - truth)[:3], axis=0).mean() / VOXEL
    return aligner.GetVerdict(1), error, aligner


failures = []


def expect(name, result, verdicts, within):
    """The verdict is one of these, and `aligned` is right to so many voxels."""
    verdict, error, aligner = result
    good = verdict in verdicts and (verdict != "aligned" or error <= within)
    if not good:
        failures.append(name)
    print(f"{'ok  ' if good else 'FAIL'} {name}: {verdict}, off by {error:.2f} voxels, overlap {aligner.GetOverlap(1):.2f}, "
          f"similarity {aligner.GetSimilarity(1):.2f}; {aligner.GetReason(1)}")


RIGHT, ANY, NOT_SURE = ("aligned",), ("aligned", "ambiguous", "failed"), ("ambiguous", "failed")
TURN = (1.0, -6.0, 2.0)
a, b = view(), view(28.0, TURN, GainDb=2.0)

expect("neighbouring views", align(a, b), RIGHT, 0.5)
for x, share, verdicts in ((62.0, 50, RIGHT), (84.0, 30, RIGHT), (96.0, 20, RIGHT), (110.0, 10, ANY)):
    expect(f"overlap of about {share}%", align(a, view(x, TURN)), verdicts, 1.0)
expect("shadow of a rib in one volume", align(a, view(28.0, TURN, RibShare=0.4)), RIGHT, 0.7)
expect("changed speckle, noise and jets in one volume",
       align(a, view(28.0, TURN, Decorrelation=0.6, ChangeSeed=9, NoiseDb=-15.0, Jets=True)), RIGHT, 1.0)
expect("gain times 0.3", align(a, with_voxels(b, *[(v * s).astype(np.uint8) for v, s in zip(arrays(b), (0.3, 1))])), RIGHT, 0.7)
inverted, valid = arrays(b)
expect("inverted contrast", align(a, with_voxels(b, 255 - inverted, valid)), ANY, 1.0)

# Nothing in common, or nothing that tells.
speckle = [view(x, TURN if x else (0, 0, 0), [], Seed=s) for x, s in ((0.0, 5), (28.0, 6))]
expect("speckle of different tissue", align(*speckle), NOT_SURE, 0)
expect("speckle of different tissue, no start", align(*speckle, start="automatic"), NOT_SURE, 0)
ball = [((14.0, 0.0, 50.0), (18.0, 18.0, 18.0), -14.0)]
expect("a sphere in changed speckle", align(view(0.0, ellipsoids=ball, Seed=5), view(28.0, TURN, ball, Seed=6), 30.0), NOT_SURE, 0)
expect("disjoint volumes of one scene", align(view(-75.0), view(75.0, TURN)), NOT_SURE, 0)
expect("disjoint volumes of different scenes", align(a, view(0.0, (0, 25.0, 90.0), y=400.0)), NOT_SURE, 0)

# Any type, any voxels.
intensity, valid = arrays(b)
for dtype, scale, shift in ((np.uint16, 200, 50), (np.int16, 60, -9000), (np.float32, 1e-3, 0.0)):
    expect(f"{np.dtype(dtype)}", align(a, with_voxels(b, (intensity.astype(float) * scale + shift).astype(dtype), valid)), RIGHT, 0.5)
holes = intensity.astype(np.float32)
holes[np.random.default_rng(2).random(holes.shape) < 0.05] = np.nan
holes[20:30, 10:30, 20:50] = np.inf
expect("NaN and infinite voxels", align(a, with_voxels(b, holes, valid)), RIGHT, 0.7)
n = intensity.shape[0] // 5 * 5
thick = intensity[:n].astype(np.float32).reshape(-1, 5, *intensity.shape[1:]).mean(1)
kept = valid[:n].reshape(-1, 5, *valid.shape[1:]).min(1)
expect("spacings 1 : 1 : 5", align(a, with_voxels(b, thick, kept, (*b.GetDimensions()[:2], n // 5), (VOXEL, VOXEL, 5 * VOXEL),
                                                 (0, 0, 2))), RIGHT, 1.5)
small = (slice(20, 46), slice(24, 58), slice(8, 44))
expect("a small piece of a volume", align(a, with_voxels(b, intensity[small], valid[small], (36, 34, 26), None, (8, 24, 20))), RIGHT, 1.0)

# From anywhere: no start at all.
expect("no start: turned by 140 degrees", align(a, b, 140.0, 60.0, start="automatic"), RIGHT, 0.5)

# What is refused: constant volumes, poses that are not rigid.
def refusal(*images):
    aligner = vtkUltrasoundAligner()
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    aligner.AddObserver(vtkCommand.ErrorEvent, note)
    aligner.GetExecutive().AddObserver(vtkCommand.ErrorEvent, note)
    for image in images:
        aligner.AddInputDataObject(0, image)
    aligner.Update()
    assert aligner.GetOutput().GetNumberOfBlocks() == 0 and not aligner.GetAllAligned()
    return " ".join(messages)


assert "constant" in refusal(a, with_voxels(b, np.full_like(intensity, 7), valid))
for matrix in ((1, 0.3, 0, 0, 1, 0, 0, 0, 1), (1.2, 0, 0, 0, 1, 0, 0, 0, 1), (-1, 0, 0, 0, 1, 0, 0, 0, 1)):
    skewed = with_voxels(b, intensity, valid)
    skewed.SetDirectionMatrix(*matrix)
    message = refusal(a, skewed)
    assert "volume 2" in message and "direction" in message, message

# Cancelled in the middle: no output, and the inputs lie where they lay.
before = geometry(b)
stopped = vtkUltrasoundAligner()
stopped.AddInputDataObject(0, a)
stopped.AddInputDataObject(0, b)
stopped.AddObserver(vtkCommand.ProgressEvent, lambda caller, event: caller.GetProgress() > 0.15 and caller.AbortExecuteOn())
told = lambda caller, event, text: failures.append("on abort: " + text)
told.CallDataType = "string0"
stopped.AddObserver(vtkCommand.ErrorEvent, told)
stopped.GetExecutive().AddObserver(vtkCommand.ErrorEvent, lambda caller, event: None)
stopped.Update()
assert stopped.GetOutput().GetNumberOfBlocks() == 0 and stopped.GetNumberOfVolumes() == 0
assert np.array_equal(geometry(b), before)

assert not failures, failures
