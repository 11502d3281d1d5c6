# SPDX-License-Identifier: BSD-3-Clause
"""The bench of bodies: pairs of views of invented abdomens, with everything in the way of a match that an abdomen holds.

Six individuals, each scanned under six conditions; each scan is a first view and others that overlap it less and less.
The volumes are made once, by ./run study make --bodies, at some five seconds each, and lie in the user's cache.
"""
import dataclasses
import itertools
import json
import os
import pathlib

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData

import echorama
from cases import Case, both_see, knock_of, read_image, second_view, seen, write_case, write_image
from geometry import Probe, about, apply, matrix_of, pose, random_motion, write_poses

OVERLAPS = (0.75, 0.55, 0.45, 0.35, 0.25)
INDIVIDUALS = range(1, 7)
PROBE = Probe()
STARTS = ((5.0, 5.0), (20.0, 25.0), (120.0, 60.0))  # degrees, mm: of a tracker, by hand, none
DARK = 8.0  # grey: places in a black shadow are no landmarks
REACH_MM = 35.0  # pressed tissue gives way by 1/e at this depth; sideways it is the sigma of a Gaussian


@dataclasses.dataclass(frozen=True)
class Condition:
    """What a scan of a body is like. Noise beside the liver's speckle, in dB; how far the probe presses in the second view."""
    refraction: bool = True
    noise_db: float = -65.0
    ribs: int = 2
    middle: tuple = (-25.0, 0.0, 0.0)  # of where the probe is held: those with ribs in the way lie further to -x
    pressed_mm: float = 0.0
    overlaps: tuple = OVERLAPS


CONDITIONS = {
    "straight": Condition(refraction=False),
    "bent": Condition(),
    "noise": Condition(noise_db=-40.0),
    "ribs": Condition(ribs=4, middle=(-55.0, 0.0, 0.0)),
    "pressed": Condition(pressed_mm=3.0),
    "pressed_6": Condition(pressed_mm=6.0, overlaps=OVERLAPS[:2]),
}


def default_folder():
    """Where the bench lies: in the user's cache, never in the sources."""
    return pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "echorama" / "bodies"


class View:
    """What the probe shows of a body from one place."""

    def __init__(self, seed, condition, place, number, pressed_mm, spacing):
        self.pressed = pressed_mm * place[:3, 2]
        self.face = np.linalg.inv(place)
        self.place = place @ pose(move=(0, 0, pressed_mm))  # the face goes with the tissue
        body = echorama.vtkUltrasoundAnatomySource()
        body.SetSeed(seed)
        body.SetTrunkWidthMm(380.0)  # wide enough for views that overlap little
        body.SetTrunkLengthMm(320.0)
        body.SetRibs(condition.ribs)
        body.Update()
        tissue = body.GetOutput()
        self.source = source = echorama.vtkUltrasoundSynthesizer()
        if pressed_mm:
            points = vtk_to_numpy(tissue.GetPoints().GetData())
            points += self.displacement(points.astype(float)).astype(points.dtype)
            tissue.Modified()
            source.SetInputDataObject(2, self.displacement_image())
        source.SetInputDataObject(0, tissue)
        source.SetSeed(seed)
        source.SetDepthMin(PROBE.depth_min)
        source.SetDepthMax(PROBE.depth_max)
        source.SetElements(96)
        source.SetSteps(64)
        source.SetSamples(384)
        source.SetSubRays(4)  # half of the default's: they take three quarters of its time
        source.SetSpacingMm(spacing)
        source.SetProbeToWorld(matrix_of(self.place))
        source.SetRefraction(condition.refraction)
        source.SetGainDb(4.0 + (2.5 if number else 0.0))
        source.SetNoiseDb(condition.noise_db)
        source.SetNoiseSeed(100 * seed + number)

    def displacement(self, points):
        """Where the probe's pressure moves tissue that lay at these points of the world."""
        x, y, z = apply(self.face, points).T
        return np.exp(-np.maximum(z, 0.0) / REACH_MM - (x * x + y * y) / (2 * REACH_MM ** 2))[:, np.newaxis] * self.pressed

    def displacement_image(self):
        image, step = vtkImageData(), 5.0
        corners = apply(self.place, np.array([[x, y, z] for x in (-130, 130) for y in (-120, 120) for z in (-40, 150)]))
        low, high = corners.min(axis=0), corners.max(axis=0)
        size = np.ceil((high - low) / step).astype(int) + 1
        image.SetDimensions(*size.tolist())
        image.SetOrigin(*low)
        image.SetSpacing(step, step, step)
        k, j, i = np.meshgrid(*(np.arange(n) for n in size[::-1]), indexing="ij")
        array = numpy_to_vtk(self.displacement(low + step * np.stack([i, j, k], axis=-1).reshape(-1, 3)), deep=True)
        array.SetName(echorama.vtkUltrasoundDisplacement.DisplacementName())
        image.GetPointData().AddArray(array)
        return image

    def image(self):
        self.source.Update()
        if self.source.GetOutput().GetNumberOfPoints() == 0:
            raise RuntimeError("the volume could not be made")
        return self.source.GetOutput()


def mean_grey(image, points):
    """Around points of the world, within some 4 mm; NaN where the volume does not reach."""
    matrix = image.GetPhysicalToIndexMatrix()
    to_index = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    shape = np.array(image.GetDimensions())
    valid = vtk_to_numpy(echorama.vtkUltrasoundVolume.GetValidRegion(image)).reshape(shape[::-1])
    grey = vtk_to_numpy(echorama.vtkUltrasoundVolume.GetIntensity(image)).reshape(shape[::-1]) * (valid != 0)
    ball = [(x, y, z) for x in (-3, -1.5, 0, 1.5, 3) for y in (-3, -1.5, 0, 1.5, 3) for z in (-3, -1.5, 0, 1.5, 3) if x * x + y * y + z * z <= 16]
    total, count = np.zeros(len(points)), np.zeros(len(points))
    for offset in ball:
        i, j, k = np.rint(np.nan_to_num(apply(to_index, points + offset), nan=-1.0)).astype(int).T
        inside = (i >= 0) & (j >= 0) & (k >= 0) & (i < shape[0]) & (j < shape[1]) & (k < shape[2])
        i, j, k = np.where(inside, (i, j, k), 0)
        real = inside & (valid[k, j, i] != 0)
        total += np.where(real, grey[k, j, i], 0.0)
        count += real
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def make_scan(folder, seed, name, spacing, landmarks, say):
    """Writes the cases of one individual under one condition that are not there yet."""
    condition = CONDITIONS[name]
    scan = folder / f"{name}_{seed}"
    random = np.random.default_rng((seed, *name.encode()))
    place = pose(np.radians(random.uniform((-6, -6, -35), (6, 6, 35))),
                 np.array(condition.middle) + random.uniform((-25, -12, -3), (5, 12, 3)))
    first = View(seed, condition, place, 0, 0.0, spacing)
    for number, overlap in enumerate(condition.overlaps, 1):
        case = scan / f"overlap_{100 * overlap:.0f}"
        random = np.random.default_rng((seed, number, *name.encode()))
        if (case / "case.json").exists():
            continue
        say(case)
        second = View(seed, condition, place @ second_view(PROBE, overlap, random), number, condition.pressed_mm, spacing)
        knock = knock_of(second.place, random)
        places = both_see(PROBE, (place, second.place), landmarks, random, landmarks)
        points = [seen(first.source, places), seen(second.source, places + second.displacement(places))]
        shown = np.minimum(mean_grey(first.image(), points[0]), mean_grey(second.image(), points[1])) >= DARK
        files = [scan / "first.mha", scan / f"overlap_{100 * overlap:.0f}.mha"]
        scan.mkdir(parents=True, exist_ok=True)
        if not files[0].exists():
            write_image(files[0], first.image())
        echorama.vtkUltrasoundVolume.Move(second.image(), matrix_of(knock))
        write_image(files[1], second.source.GetOutput())
        properties = {"scan": name, "individual": seed, "overlap": overlap, "noise_db": condition.noise_db,
                      "pressed_mm": condition.pressed_mm, "refraction": int(condition.refraction), "spacing_mm": spacing}
        write_case(case, files, knock, [side[shown] for side in points], STARTS, properties, random)


def make_bodies(folder, scans=None, individuals=INDIVIDUALS, spacing=1.0, landmarks=400, say=print):
    """Writes the cases of the bench that are not there yet."""
    for name in scans or CONDITIONS:
        for seed in individuals:
            make_scan(pathlib.Path(folder), seed, name, spacing, landmarks, say)


def changed(path, out, change):
    """Writes a volume whose grey values and valid region a function of their array, slowest axis first, has changed."""
    if not out.exists():
        image = read_image(path)
        shape = image.GetDimensions()[::-1]
        for array in (echorama.vtkUltrasoundVolume.GetIntensity(image), echorama.vtkUltrasoundVolume.GetValidRegion(image)):
            values = vtk_to_numpy(array).reshape(shape)
            values[:] = change(values.copy(), array.GetName())
        out.parent.mkdir(parents=True, exist_ok=True)
        write_image(out, image)
    return out


def probe_to_world(image):
    return np.array(image.GetFieldData().GetArray("ProbeToWorld").GetTuple(0)).reshape(4, 4)


def mirrored(values, _):
    return values[:, :, ::-1]


def inverted(values, name):
    return values if name == echorama.vtkUltrasoundVolume.ValidRegionName() else 255 - values


def make_impossible(folder, scans=None, individuals=INDIVIDUALS, say=print):
    """Cases without an answer, of the volumes that are there: the second view shows another body, or is a mirror image or a negative.

    They start where the right second view would lie, turned and moved as by a hand: nothing but the images tells that they are wrong.
    """
    folder = pathlib.Path(folder)
    wanted = []
    for name in scans or [name for name, condition in CONDITIONS.items() if condition.overlaps == OVERLAPS]:
        wanted += [("other body", name, *two) for two in itertools.permutations(individuals, 2)]
        wanted += [(kind, name, one, one) for one in individuals for kind in ("mirror image", "negative")]
    for kind, name, one, other in wanted:
        overlap = OVERLAPS[(2 * one + other) % len(OVERLAPS)]
        case = folder / "impossible" / f"{name}_{one}_{kind.replace(' ', '_')}_{other}_{100 * overlap:.0f}"
        first, second = folder / f"{name}_{one}" / "first.mha", folder / f"{name}_{other}" / f"overlap_{100 * overlap:.0f}.mha"
        truth = folder / f"{name}_{one}" / f"overlap_{100 * overlap:.0f}" / "truth.json"
        if (case / "case.json").exists() or not (first.exists() and second.exists() and truth.exists()):
            continue
        say(case)
        if kind != "other body":
            second = changed(second, case / "second.mha", mirrored if kind == "mirror image" else inverted)
        random = np.random.default_rng((one, other, *case.name.encode()))
        right = Case(truth.parent)
        place = right.truth @ probe_to_world(right.image(1)) @ np.linalg.inv(probe_to_world(read_image(second)))
        middle = apply(place, np.array(read_image(second).GetCenter())[np.newaxis])[0]
        place = about(middle, random_motion(random, *STARTS[1])) @ place
        case.mkdir(parents=True, exist_ok=True)
        write_poses(case / "start_20deg_25mm.json", [first, second], [np.eye(4), place])
        (case / "case.json").write_text(json.dumps({"impossible": kind, "scan": name, "individual": one, "overlap": overlap}, indent=1))
