# SPDX-License-Identifier: BSD-3-Clause
"""Cases of the study: pairs of volumes whose truth is known, and starts from which they are to be aligned.

A case is a folder with two volumes and at least one of `truth.json` (a pose file: where the volumes belong) and `landmarks_1.csv`
with `landmarks_2.csv` (or .fcsv, .mrk.json), in the frames of the files. `floor.json`, if it is there, is the pose in which the
landmarks fit best: no rigid pose is nearer to what both volumes show, where sound is bent or tissue gives way. Every `start*.json` (a pose file) in it is one thing
to align; without one the volumes start where their files say. `case.json` may name properties to plot against; with `impossible` among them the
volumes belong nowhere beside each other, and only the verdict counts. The first volume stays.
"""
import dataclasses
import json
import pathlib

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints

import echorama
from geometry import Probe, about, apply, best_rigid, matrix_of, pose, random_motion, read_poses, write_poses

# What is planted in a pair, one thing at a time, beside a plain pair that overlaps by 55%.
PLAIN = {"overlap": 0.55, "gain_db": 2.5, "noise_db": -120.0, "rib": 0.0, "decorrelation": 0.0, "jets": 0, "deformation_mm": 0.0}
PAIRS = {
    "plain": {},
    "overlap_75": {"overlap": 0.75},
    "overlap_35": {"overlap": 0.35},
    "overlap_20": {"overlap": 0.2},
    "noise_-6dB": {"noise_db": -6.0},
    "noise_6dB": {"noise_db": 6.0},
    "rib_20": {"rib": 0.2},
    "rib_40": {"rib": 0.4},
    "decorrelation_30": {"decorrelation": 0.3},
    "decorrelation_60": {"decorrelation": 0.6},
    "jets": {"jets": 1},
    "deformation_1mm": {"deformation_mm": 1.0},
    "deformation_3mm": {"deformation_mm": 3.0},
    "everything": {"noise_db": -6.0, "rib": 0.2, "decorrelation": 0.3, "jets": 1, "deformation_mm": 1.5, "gain_db": 5.0},
}
STARTS = ((10.0, 15.0), (20.0, 25.0))  # degrees, mm
FAR_STARTS = ((5.0, 5.0), (30.0, 40.0), (60.0, 60.0))  # of the plain pairs
PLAIN_PAIRS = ("plain", "overlap_75", "overlap_35")


def second_view(probe, overlap, random):
    """A pose of the probe, as seen from the first one, whose view overlaps the first by the given share."""
    points = probe.points(random, 20000)
    wobble = pose(np.radians(random.uniform((-5, -5, -12), (5, 5, 12))))

    def at(way):  # sliding along a convex body, turning as it goes
        return pose(way * np.array([0.0004, -0.0022, 0.0009]), way * np.array([1.0, 0.2, 0.0])) @ wobble

    near, far = 0.0, 200.0
    for _ in range(24):
        middle = (near + far) / 2
        near, far = (middle, far) if probe.overlap(at(middle), points) > overlap else (near, middle)
    return at(near)


def both_see(probe, views, count, random, batch=1):
    """So many places of the world that lie in the fans of both, drawn batch by batch."""
    found, back = np.empty((0, 3)), np.linalg.inv(views[1])
    while len(found) < count:
        points = apply(views[0], probe.points(random, batch))
        found = np.concatenate([found, points[probe.sees(apply(back, points))]])
    return found[:count]


def write_landmarks(path, labels, points):
    path.write_text("label,x,y,z\n" + "".join(f"{label},{x!r},{y!r},{z!r}\n" for label, (x, y, z) in zip(labels, points.tolist())))


def seen(source, points):
    """Where the tissue at points of the world is seen."""
    tissue, places = vtkPoints(), vtkPoints()
    tissue.SetDataTypeToDouble()
    tissue.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    source.TissueToSeen(tissue, places)
    return vtk_to_numpy(places.GetData()).copy()


def phantom(view, number, properties, seed, spacing):
    """The view of one of both volumes of a pair, and how its tissue moves points of the world."""
    source = echorama.vtkUltrasoundPhantomSource()
    source.SetSeed(seed)
    source.SetSpacingMm(spacing)
    source.SetProbeToWorld(matrix_of(view))
    source.SetGainDb(properties["gain_db"] * number)
    source.SetNoiseDb(properties["noise_db"])
    source.SetDecorrelation(properties["decorrelation"])
    source.SetChangeSeed(number + 1)
    if number == 1:
        source.SetRibShare(properties["rib"])
        source.SetJets(bool(properties["jets"]))
        source.SetDeformationMm(properties["deformation_mm"])
    source.Update()
    return source.GetOutput(), lambda points: seen(source, points)


def knock_of(view, random):
    """A motion by which a file says something wrong about the place of a view, as files do; the truth undoes it."""
    return about((view @ (0, 0, 55, 1))[:3], random_motion(random, 12, 30))


def read_image(path):
    reader = echorama.vtkUltrasoundReader()
    reader.SetFileName(str(path))
    reader.Update()
    if reader.GetOutput().GetNumberOfPoints() == 0:
        raise OSError(f"{path}: cannot be read")
    return reader.GetOutput()


def write_image(path, image):
    writer = echorama.vtkUltrasoundWriter()
    writer.SetInputDataObject(image)
    writer.SetFileName(str(path))
    writer.Write()


def write_case(folder, files, knock, landmarks, starts, properties, random):
    """Landmarks, truth, rigid floor, starts and properties of two volumes, the second of which was knocked out of its place."""
    folder.mkdir(parents=True, exist_ok=True)
    landmarks = landmarks[0], apply(knock, landmarks[1])
    for number, points in enumerate(landmarks, 1):
        write_landmarks(folder / f"landmarks_{number}.csv", [f"L{i + 1}" for i in range(len(points))], points)
    truth = np.linalg.inv(knock)
    write_poses(folder / "truth.json", files, [np.eye(4), truth])
    write_poses(folder / "floor.json", files, [np.eye(4), best_rigid(*landmarks)])
    centre = apply(truth, Case(folder).points(1, 1000)).mean(axis=0)
    for degrees, mm in starts:
        wrong = about(centre, random_motion(random, degrees, mm))
        write_poses(folder / f"start_{degrees:g}deg_{mm:g}mm.json", files, [np.eye(4), wrong @ truth])
    (folder / "case.json").write_text(json.dumps(properties, indent=1))


def make_case(folder, planted, starts, seed, spacing=1.0, landmarks=200):
    """Writes one case of the phantom. The same seed gives the same volumes."""
    properties = {**PLAIN, **planted}
    random = np.random.default_rng(seed)
    probe = Probe()
    # Where on the body the pair lies differs from pair to pair, so that they do not all show the same structures.
    first = pose(np.radians(random.uniform((-6, -6, -35), (6, 6, 35))), random.uniform((-25, -12, -3), (5, 12, 3)))
    views = [first, first @ second_view(probe, properties["overlap"], random)]
    knock = knock_of(views[1], random)
    places = both_see(probe, views, landmarks, random)
    files = [folder / f"volume_{number}.mha" for number in (1, 2)]
    folder.mkdir(parents=True, exist_ok=True)
    points = []
    for number, view in enumerate(views):
        image, moved = phantom(view, number, properties, seed, spacing)
        if image.GetNumberOfPoints() == 0:
            raise RuntimeError(f"{folder.name}: the volume could not be made")
        points.append(moved(places))
        if number == 1:
            echorama.vtkUltrasoundVolume.Move(image, matrix_of(knock))
        write_image(files[number], image)
    write_case(folder, files, knock, points, starts, {**properties, "seed": seed, "spacing_mm": spacing}, random)


def make(folder, pairs=None, seed=1, repeats=1, spacing=1.0, say=print):
    """Writes the cases of the phantom that are not there yet: those named, else all."""
    for repeat in range(repeats):
        for number, (name, planted) in enumerate(PAIRS.items()):
            if pairs and name not in pairs:
                continue
            case = pathlib.Path(folder) / (name if repeats == 1 else f"{name}_{repeat + 1}")
            if (case / "case.json").exists():
                continue
            say(f"{case}")
            make_case(case, planted, STARTS + (FAR_STARTS if name in PLAIN_PAIRS else ()),
                      seed=seed * 1000 + repeat * 100 + number, spacing=spacing)


@dataclasses.dataclass(frozen=True)
class Start:
    name: str
    path: pathlib.Path  # of a pose file, or None: where the files say
    motion: np.ndarray  # the second volume's place as seen from the first


class Case:
    """A case on disk, a user's or ours."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.name = self.folder.name
        own = self.folder / "case.json"
        self.properties = json.loads(own.read_text()) if own.exists() else {}
        truth = self.folder / "truth.json"
        self.truth = self.relative(truth) if truth.exists() else None
        floor = self.folder / "floor.json"
        self.floor = self.relative(floor) if floor.exists() else None
        poses = [truth] if truth.exists() else sorted(self.folder.glob("start*.json"))
        self.files = ([file for file, _ in read_poses(poses[0])] if poses else
                      sorted(path for path in self.folder.iterdir()
                             if path.suffix in (".mha", ".mhd", ".nrrd", ".nhdr", ".vti", ".nii", ".gz", ".vol")
                             and "ValidRegion" not in path.name))
        if len(self.files) != 2:
            raise ValueError(f"{self.folder}: two volumes are needed; there are {len(self.files)}")
        self.landmarks = [next((path for path in self.folder.glob(f"landmarks_{number}.*")), None) for number in (1, 2)]
        self.impossible = self.properties.get("impossible", "")
        if self.truth is None and None in self.landmarks and not self.impossible:
            raise ValueError(f"{self.folder}: neither truth.json nor landmarks_1 and landmarks_2 is there")

    @staticmethod
    def relative(path):
        """The second volume's motion as seen from the first one."""
        (_, first), (_, second) = read_poses(path)
        return np.linalg.inv(first) @ second

    def starts(self):
        paths = sorted(self.folder.glob("start*.json"))
        if not paths:
            return [Start("files", None, np.eye(4))]
        return [Start(path.stem, path, self.relative(path)) for path in paths]

    def image(self, number):
        return read_image(self.files[number])

    def points(self, number, count):
        """The same points of the valid region of a volume every time, in the frame of its file."""
        image = self.image(number)
        valid = echorama.vtkUltrasoundVolume.GetValidRegion(image)
        real = np.flatnonzero(vtk_to_numpy(valid)) if valid is not None else np.arange(image.GetNumberOfPoints())
        chosen = np.random.default_rng(1).choice(real, min(count, len(real)), replace=False)
        index = np.stack(np.unravel_index(chosen, image.GetDimensions()[::-1])[::-1], axis=1)
        direction = image.GetDirectionMatrix()
        axes = np.array([[direction.GetElement(i, j) for j in range(3)] for i in range(3)])
        return (index * image.GetSpacing()) @ axes.T + image.GetOrigin()

    def voxel_mm(self):
        return float(min(min(self.image(number).GetSpacing()) for number in (0, 1)))


def cases_in(folder):
    """All cases below a folder (or the folder itself, when it is one), by name."""
    folder = pathlib.Path(folder)
    marks = ("truth.json", "landmarks_1.*", "case.json")
    found = sorted({path.parent for mark in marks for path in folder.rglob(mark)})
    if not found:
        raise ValueError(f"{folder}: there are no cases in it (folders with truth.json or landmarks_1 and landmarks_2)")
    return found
