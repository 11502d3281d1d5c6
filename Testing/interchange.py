#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What the code of other programs makes of our files, and we of theirs: ./run interchange fills the table of Documentation/data.md.

Each check hands volumes over in files, one way. What it compares is known without either side: an array of numbers, and the affine
matrix from voxels to mm (LPS). Grey values are compared bit by bit, points in mm. TestInterchange.py runs the same checks.
"""
import argparse
import collections
import itertools
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib
import xml.etree.ElementTree as ElementTree

import numpy

from program_under_test import PLUS, SOURCE, blobs, read_mha, read_sequence, run, turned, write_mha, write_poses, write_sequence

PAGE = SOURCE / "Documentation" / "data.md"
BEGIN, END = "<!-- BEGIN interchange -->\n", "<!-- END interchange -->"
Check = collections.namedtuple("Check", "peer files way compared bound function")  # bound: of the difference of points, mm
CHECKS = []
WRITES, READS, BOTH = "we wrote, it read", "it wrote, we read", "both read it"
LPS = numpy.diag([-1.0, -1.0, 1.0, 1.0])  # from RAS, and back


class Peer:
    """A program or package: its Debian package, a command that must be there, and what the table calls it."""

    def __init__(self, package, title, needs):
        self.package, self.title, self.needs = package, title, needs

    def is_there(self):
        return self.needs()

    def __str__(self):
        return self.title.format(version=version(self.package), itk=version("libinsighttoolkit5*"))


def version(package):
    """The version of what is packaged, without Debian's own."""
    done = subprocess.run(["dpkg-query", "-W", "-f", "${Version}\n", package], capture_output=True, text=True)
    return re.sub(r"^\d+:|[+~-].*$", "", (done.stdout.split() or ["?"])[0])


def imports(name):
    def found():
        try:
            __import__(name)
        except ImportError:
            return False
        return True
    return found


def program(name):
    return lambda: shutil.which(name) is not None


def of_vtk():
    from vtkmodules.vtkCommonCore import vtkVersion
    return vtkVersion.GetVTKVersion()


ITK = Peer("plastimatch", "ITK {itk}, in plastimatch {version}", program("plastimatch"))
ELASTIX = Peer("elastix", "elastix {version} (transformix), with ITK {itk}", program("transformix"))
TEEM = Peer("teem-apps", "Teem {version} (unu), whose format NRRD is", program("teem-unu"))
NIBABEL = Peer("python3-nibabel", "nibabel {version}", imports("nibabel"))
PYDICOM = Peer("python3-pydicom", "pydicom {version}", imports("pydicom"))
DCMTK = Peer("dcmtk", "DCMTK {version}", program("dcmcrle"))
GDCM = Peer("libgdcm-tools", "GDCM {version} (gdcmconv)", program("gdcmconv"))
VTK = Peer("python3-vtk9", "VTK {version}", imports("vtkmodules.vtkIOXML"))
PLUSLIB = Peer("", "Plus, files of its test data", PLUS.is_dir)
PEERS = [ITK, ELASTIX, TEEM, NIBABEL, PYDICOM, DCMTK, GDCM, VTK, PLUSLIB]


def check(peer, files, way, compared, bound=1e-6):
    def keep(function):
        CHECKS.append(Check(peer, files, way, compared, bound, function))
        return function
    return keep


# ---- what is handed over -------------------------------------------------------------------------------------------------------

def direction():
    """Oblique about all axes, with no two numbers alike."""
    def about(axis, degrees):
        c, s, turn = numpy.cos(numpy.radians(degrees)), numpy.sin(numpy.radians(degrees)), numpy.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
        return turn
    return about(2, 23) @ about(1, -37) @ about(0, 51)


SPACING, ORIGIN, DIRECTION = numpy.array([0.31, 0.47, 0.83]), numpy.array([12.25, -87.5, 341.125]), direction()
TYPES = ("u1", "i2", "u2", "f4")


def affine(spacing=SPACING, origin=ORIGIN, rotation=DIRECTION):
    matrix = numpy.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation * spacing, origin
    return matrix


def voxels(kind, shape=(5, 6, 7)):
    """[z, y, x], with values near both ends of the type."""
    random = numpy.random.default_rng(5)
    if kind[0] == "f":
        return random.normal(0, 1e3, shape).astype(kind)
    limits = numpy.iinfo(kind)
    return random.integers(limits.min, limits.max, shape, dtype=kind, endpoint=True)


def assert_same(ours, theirs, matrix_ours, matrix_theirs):
    """Arrays [z, y, x] with their matrices: the same numbers of the same type at the same points, whatever the order of slices. \
Returns by how many mm the points differ."""
    assert ours.dtype == theirs.dtype, f"{ours.dtype} became {theirs.dtype}"
    assert ours.shape == theirs.shape, f"{ours.shape} became {theirs.shape}"
    index = numpy.stack(numpy.meshgrid(*map(numpy.arange, ours.shape[::-1]), indexing="ij"), axis=-1).reshape(-1, 3)
    points = index @ matrix_ours[:3, :3].T + matrix_ours[:3, 3]
    there = numpy.rint((points - matrix_theirs[:3, 3]) @ numpy.linalg.inv(matrix_theirs[:3, :3]).T).astype(int)
    assert there.min() >= 0 and (there < ours.shape[::-1]).all(), "it lies elsewhere"
    off = numpy.linalg.norm(there @ matrix_theirs[:3, :3].T + matrix_theirs[:3, 3] - points, axis=1).max()
    i, j = tuple(index.T[::-1]), tuple(there.T[::-1])
    assert ours[i].tobytes() == theirs[j].tobytes(), f"{(ours[i] != theirs[j]).sum()} of {len(index)} grey values differ"
    return off


def each(kinds, extensions):
    """Every type in the first format, and every format: programs take long to start."""
    return [(kind, extensions[0]) for kind in kinds] + [(kinds[1], extension) for extension in extensions[1:]]


# ---- our side ------------------------------------------------------------------------------------------------------------------

def we_write(path, array, compressed=True):
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from echorama import vtkUltrasoundWriter
    image = vtkImageData()
    image.SetDimensions(array.shape[::-1])
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    image.SetDirectionMatrix(DIRECTION.ravel())
    data = numpy_to_vtk(array.ravel(), deep=True)
    data.SetName("Intensity")
    image.GetPointData().SetScalars(data)
    writer = vtkUltrasoundWriter()
    writer.SetInputData(image)
    writer.SetFileName(str(path))
    writer.SetUseCompression(compressed)
    assert writer.Write() == 1, f"{path} was not written"


def we_read(path):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from echorama import vtkUltrasoundReader
    reader = vtkUltrasoundReader()
    reader.SetFileName(str(path))
    reader.Update()
    image = reader.GetOutput()
    array = image.GetPointData().GetArray("Intensity")
    assert array is not None, f"{path} was not read"
    rotation = numpy.array([[image.GetDirectionMatrix().GetElement(i, j) for j in range(3)] for i in range(3)])
    return vtk_to_numpy(array).reshape(image.GetDimensions()[::-1]), affine(image.GetSpacing(), image.GetOrigin(), rotation)


# ---- files, read with no code of ours or of a peer -----------------------------------------------------------------------------

def parsed_mha(path):
    header, array = read_mha(path)
    numbers = {key: numpy.array(header[key].split(), float) for key in ("TransformMatrix", "Offset", "ElementSpacing")}
    return array, affine(numbers["ElementSpacing"], numbers["Offset"], numbers["TransformMatrix"].reshape(3, 3).T)


def parsed_nrrd(path):
    """Raw or gzip, in one file, in LPS: array, matrix and the fields."""
    head, data = pathlib.Path(path).read_bytes().split(b"\n\n", 1)
    fields = dict(re.split(r": |:=", line, maxsplit=1) for line in head.decode().split("\n")[1:] if line[0] != "#")
    kind = {"unsigned char": "u1", "uint8": "u1", "uchar": "u1", "short": "i2", "int16": "i2", "unsigned short": "u2", "ushort": "u2", "uint16": "u2",
            "int": "i4", "float": "f4", "double": "f8"}[fields["type"]]
    if fields["encoding"] == "gzip":
        data = zlib.decompress(data, 31)
    array = numpy.frombuffer(data, (">" if fields.get("endian") == "big" else "<") + kind).astype(kind)
    array = array.reshape([int(n) for n in fields["sizes"].split()][::-1])
    matrix = None
    if "space directions" in fields and "none" not in fields["space directions"]:
        assert fields["space"] == "left-posterior-superior", fields["space"]
        matrix = numpy.eye(4)
        matrix[:3, :3] = numpy.array(re.findall(r"[-+.\de]+", fields["space directions"]), float).reshape(3, 3).T
        matrix[:3, 3] = re.findall(r"[-+.\de]+", fields["space origin"])
    return array, matrix, fields


def call(*words, cwd=None):
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, cwd=cwd, timeout=120)
    assert done.returncode == 0, f"{words[0]}: {done.stdout[-500:]}{done.stderr[-500:]}"
    return done.stdout


# ---- ITK -----------------------------------------------------------------------------------------------------------------------

def plastimatch(source, target, *more):
    call("plastimatch", "convert", "--input", source, "--output-img", target, *more)
    assert target.exists(), f"{target.name} was not made of {source.name}"


@check(ITK, ".mha .mhd .nrrd .nhdr", WRITES, "8 and 16 bit, float; oblique, anisotropic; raw and compressed")
def itk_reads(folder):
    worst = 0.0
    for number, (kind, extension) in enumerate(2 * each(TYPES, ("nrrd", "mha", "mhd", "nhdr"))):
        we_write(folder / f"ours.{extension}", voxels(kind), number % 2 == 0)  # an odd number of them, twice: each both ways
        plastimatch(folder / f"ours.{extension}", folder / "itk.mha")
        worst = max(worst, assert_same(voxels(kind), parsed_mha(folder / "itk.mha")[0], affine(), parsed_mha(folder / "itk.mha")[1]))
    return worst


@check(ITK, ".nii .nii.gz", WRITES, "the same; NIfTI holds its geometry in 32-bit floats", 1e-4)
def itk_reads_nifti(folder):
    worst = 0.0
    for number, (kind, extension) in enumerate(each(TYPES, ("nii", "nii.gz"))):  # numbered: it reads the voxels of a.nii where a.nii.gz is named
        we_write(folder / f"ours{number}.{extension}", voxels(kind))
        plastimatch(folder / f"ours{number}.{extension}", folder / "itk.mha")
        worst = max(worst, assert_same(voxels(kind), parsed_mha(folder / "itk.mha")[0], affine(), parsed_mha(folder / "itk.mha")[1]))
    return worst


def itk_to_us(folder, extensions):
    worst = 0.0
    for (kind, extension), mirrored in zip(each(TYPES, extensions), itertools.cycle((False, True))):
        rotation = DIRECTION @ numpy.diag([1, 1, -1.0]) if mirrored else DIRECTION  # left-handed axes are read with their slices in reverse
        write_mha(folder / "known.mha", voxels(kind), SPACING, ORIGIN, rotation)
        plastimatch(folder / "known.mha", folder / f"itk.{extension}")
        read, matrix = we_read(folder / f"itk.{extension}")
        worst = max(worst, assert_same(voxels(kind), read, affine(rotation=rotation), matrix))
    return worst


@check(ITK, ".mha .mhd .nrrd", READS, "8 and 16 bit, float; oblique, anisotropic, also left-handed; raw and gzip")
def itk_writes(folder):
    return itk_to_us(folder, ("mha", "mhd", "nrrd"))


@check(ITK, ".nii .nii.gz", READS, "the same", 1e-4)
def itk_writes_nifti(folder):
    return itk_to_us(folder, ("nii", "nii.gz"))


@check(ITK, "DICOM series of slices", READS, "16 bit, oblique, anisotropic; DICOM has decimal texts of 16 letters", 1e-4)
def itk_writes_dicom(folder):
    known = (voxels("u2") % 4000).astype("i2")
    write_mha(folder / "known.mha", known, SPACING, ORIGIN, DIRECTION)
    call("plastimatch", "convert", "--input", folder / "known.mha", "--output-dicom", folder / "series")
    read, matrix = we_read(folder / "series")
    return assert_same(known, read.astype("i2"), affine(), matrix)


def sequence():
    """Pixels [frame, y, x] and poses of a probe that moves."""
    poses = []
    for i in range(5):
        matrix = numpy.eye(4)
        matrix[:3, :3], matrix[:3, 3] = numpy.linalg.matrix_power(DIRECTION, i), (1.5 * i, -2 / 3, 30.1)
        poses.append({"ProbeToTracker": (matrix, "INVALID" if i == 3 else "OK")})
    return voxels("u1", (5, 6, 7)), poses


def we_convert(source, target, *more):
    done = run("convert", source, target, *more)
    assert done.returncode == 0, done.stderr


@check(ITK, ".igs.mha, a tracked sequence", WRITES, "pixels of all frames (ITK knows no poses of frames)")
def itk_reads_sequence(folder):
    pixels, poses = sequence()
    write_sequence(folder / "known.igs.mha", pixels, poses, times=range(5))
    we_convert(folder / "known.igs.mha", folder / "ours.igs.mha")
    plastimatch(folder / "ours.igs.mha", folder / "itk.mha")
    assert parsed_mha(folder / "itk.mha")[0].tobytes() == pixels.tobytes()


def moved():
    """A pose that volumes are aligned with: far, and about another axis."""
    pose = numpy.eye(4)
    pose[:3, :3], pose[:3, 3] = DIRECTION @ DIRECTION.T[:, [1, 2, 0]], (3.7, -21.3, 8.9)
    return pose


@check(ITK, ".tfm, a pose", WRITES, "a volume under it, resampled where the pose puts it: the same voxels")
def itk_applies_pose(folder):
    known = voxels("u2")
    write_mha(folder / "known.mha", known, SPACING, ORIGIN, DIRECTION)
    write_poses(folder / "poses.json", ["known.mha"], [moved()])
    we_convert(folder / "poses.json", folder / "pose.tfm")
    there = moved() @ affine()
    write_mha(folder / "grid.mha", numpy.zeros_like(known), SPACING, there[:3, 3], there[:3, :3] / SPACING)
    plastimatch(folder / "known.mha", folder / "itk.mha", "--xf", folder / "pose.tfm", "--fixed", folder / "grid.mha", "--interpolation", "nn",
                "--algorithm", "itk")
    return assert_same(known, parsed_mha(folder / "itk.mha")[0], there, parsed_mha(folder / "itk.mha")[1])


def we_pose(folder, transform):
    """How `echorama align` moves known.mha by another program's transform, beside stays.mha."""
    done = run("align", folder / "stays.mha", folder / "known.mha", "--transforms", "-", transform, "--transforms-only", "-o", folder / "poses.json", "--json")
    assert done.returncode == 0, done.stderr
    stays, pose = [numpy.array(one["VolumeToWorld"]) for one in json.loads(done.stdout)["volumes"]]
    assert (stays == numpy.eye(4)).all(), stays
    return pose


def we_place(folder, transform):
    """The matrix of known.mha, whose geometry is affine(), where it is then."""
    write_mha(folder / "stays.mha", voxels("u1"))
    return we_pose(folder, transform) @ affine()


def itk_text(kind, parameters, fixed):
    numbers = lambda values: " ".join(repr(float(value)) for value in values)
    return f"#Transform 0\nTransform: {kind}_double_3_3\nParameters: {numbers(parameters)}\nFixedParameters: {numbers(fixed)}\n"


CENTRE = (11.5, -70.25, 330.0)  # of rotation


@check(ITK, ".tfm: VersorRigid3D, QuaternionRigid, Affine, Translation", BOTH,
       "a volume that it resampled under its transform lies, voxel by voxel, where we put it")
def itk_transforms(folder):
    known, worst = voxels("u2"), 0.0
    write_mha(folder / "known.mha", known, SPACING, ORIGIN, DIRECTION)
    versor, shift = (0.3, -0.45, 0.6), (3.7, -21.3, 8.9)
    scalar = (1 - numpy.dot(versor, versor))**0.5
    for kind, parameters, fixed in (("VersorRigid3DTransform", (*versor, *shift), CENTRE), ("QuaternionRigidTransform", (*versor, scalar, *shift), CENTRE),
                                    ("AffineTransform", (*DIRECTION.ravel(), *shift), CENTRE), ("TranslationTransform", shift, ())):
        (folder / "theirs.tfm").write_text("#Insight Transform File V1.0\n" + itk_text(kind, parameters, fixed))
        there = we_place(folder, folder / "theirs.tfm")
        write_mha(folder / "grid.mha", numpy.zeros_like(known), SPACING, there[:3, 3], there[:3, :3] / SPACING)
        plastimatch(folder / "known.mha", folder / "itk.mha", "--xf", folder / "theirs.tfm", "--fixed", folder / "grid.mha", "--interpolation", "nn",
                    "--algorithm", "itk")
        worst = max(worst, assert_same(known, parsed_mha(folder / "itk.mha")[0], there, parsed_mha(folder / "itk.mha")[1]))
    return worst


# ---- elastix -------------------------------------------------------------------------------------------------------------------

def transformix(folder, source, transform, kind, extension, there, *more):
    """Resamples with the nearest neighbour on the grid of the matrix `there`."""
    numbers = lambda values: " ".join(repr(float(value)) for value in numpy.ravel(values))
    (folder / "transform.txt").write_text(f"""(Transform "AffineTransform")
(NumberOfParameters 12)
(TransformParameters {numbers(transform)})
(CenterOfRotationPoint 0 0 0)
(InitialTransformParametersFileName "NoInitialTransform")
(HowToCombineTransforms "Compose")
(FixedImageDimension 3)
(MovingImageDimension 3)
(FixedInternalImagePixelType "float")
(MovingInternalImagePixelType "float")
(Size 7 6 5)
(Index 0 0 0)
(Spacing {numbers(SPACING)})
(Origin {numbers(there[:3, 3])})
(Direction {numbers((there[:3, :3] / SPACING).T)})
(UseDirectionCosines "true")
(ResampleInterpolator "FinalBSplineInterpolator")
(FinalBSplineInterpolationOrder 0)
(Resampler "DefaultResampler")
(DefaultPixelValue 0)
(ResultImageFormat "{extension}")
(ResultImagePixelType "{kind}")
(CompressResultImage "true")
""")
    call("transformix", "-in", source, "-tp", folder / "transform.txt", "-out", folder, *more)
    return folder / f"result.{extension}"


NAMES = {"u1": "unsigned char", "i2": "short", "u2": "unsigned short", "f4": "float"}
STILL = (1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0)


@check(ELASTIX, ".mha .nrrd .nii.gz, compressed", READS, "8 and 16 bit, float; oblique, anisotropic", 1e-4)
def elastix_writes(folder):
    worst = 0.0
    for kind, extension in each(TYPES, ("mha", "nrrd", "nii.gz")):
        write_mha(folder / "known.mha", voxels(kind), SPACING, ORIGIN, DIRECTION)
        made = transformix(folder, folder / "known.mha", STILL, NAMES[kind], extension, affine())
        read, matrix = we_read(made)
        worst = max(worst, assert_same(voxels(kind), read, affine(), matrix))
    return worst


def points_of(folder):
    """Points for transformix, in points.txt."""
    points = numpy.random.default_rng(2).uniform(-100, 100, (20, 3))
    (folder / "points.txt").write_text(f"point\n{len(points)}\n" + "".join(" ".join(map(repr, map(float, point))) + "\n" for point in points))
    return points


def points_off(folder, points, pose):
    """By how much what transformix made of the points differs from the inverse of the pose: from the result to what is moved."""
    found = [re.search(r"OutputPoint = \[ (.*?) \]", line)[1].split() for line in (folder / "outputpoints.txt").read_text().splitlines()]
    return numpy.linalg.norm(numpy.array(found, float) - (points - pose[:3, 3]) @ pose[:3, :3], axis=1).max()


@check(ELASTIX, ".mha, and the numbers of .tfm", WRITES, "our pose applied to our volume: the same voxels where the pose puts them; points in six decimals", 2e-6)
def elastix_applies_pose(folder):
    known, there = voxels("u2"), moved() @ affine()
    we_write(folder / "ours.mha", known)
    write_poses(folder / "poses.json", ["ours.mha"], [moved()])
    we_convert(folder / "poses.json", folder / "pose.tfm")
    parameters = re.search(r"^Parameters: (.*)$", (folder / "pose.tfm").read_text(), re.MULTILINE)[1].split()
    points = points_of(folder)
    made = transformix(folder, folder / "ours.mha", parameters, NAMES["u2"], "mha", there, "-def", folder / "points.txt")
    array, matrix = parsed_mha(made)
    off = points_off(folder, points, moved())
    return max(off, assert_same(known, array, there, matrix))


@check(ELASTIX, "transform parameters: Euler in both orders, Affine, a chain", BOTH,
       "points, in six decimals, and a volume that it resampled: where we put them", 2e-6)
def elastix_transforms(folder):
    known, worst, text = voxels("u2"), 0.0, lambda values: " ".join(repr(float(value)) for value in values)
    write_mha(folder / "known.mha", known, SPACING, ORIGIN, DIRECTION)
    points = points_of(folder)
    angles, shift = (0.4, -0.7, 1.1), (3.7, -21.3, 8.9)
    for name, kind, parameters, more in (("first", "EulerTransform", (*angles, *shift), ""),
                                         ("turned", "EulerTransform", (*angles, *shift), '(ComputeZYX "true")'),
                                         ("affine", "AffineTransform", (*DIRECTION.ravel(), *shift), ""),
                                         ("chain", "EulerTransform", (0.1, 0.2, -0.3, 4, 5, 6), '(ComputeZYX "false")')):
        before = folder / "first.txt" if name == "chain" else "NoInitialTransform"
        (folder / f"{name}.txt").write_text(f"""(Transform "{kind}")
(NumberOfParameters {len(parameters)})
(TransformParameters {text(parameters)})
(InitialTransformParametersFileName "{before}")
(HowToCombineTransforms "Compose")
(CenterOfRotationPoint {text(CENTRE)})
{more}
(FixedImageDimension 3)
(MovingImageDimension 3)
(FixedInternalImagePixelType "float")
(MovingInternalImagePixelType "float")
(UseDirectionCosines "true")
(ResampleInterpolator "FinalBSplineInterpolator")
(FinalBSplineInterpolationOrder 0)
(Resampler "DefaultResampler")
(DefaultPixelValue 0)
(ResultImageFormat "mha")
(ResultImagePixelType "unsigned short")
(Size 7 6 5)
(Index 0 0 0)
(Spacing {text(SPACING)})
""")
        there = we_place(folder, folder / f"{name}.txt")
        with open(folder / f"{name}.txt", "a") as more:
            more.write(f"(Origin {text(there[:3, 3])})\n(Direction {text((there[:3, :3] / SPACING).T.ravel())})\n")
        call("transformix", "-in", folder / "known.mha", "-tp", folder / f"{name}.txt", "-out", folder, "-def", folder / "points.txt")
        off = points_off(folder, points, there @ numpy.linalg.inv(affine()))
        array, matrix = parsed_mha(folder / "result.mha")
        worst = max(worst, off, assert_same(known, array, there, matrix))
    return worst


@check(ELASTIX, "TransformParameters.0.txt of a registration", READS, "points, in six decimals; the moved volume comes back to where the fixed one is", 2e-6)
def elastix_registers(folder):
    pose = numpy.eye(4)
    pose[:3, :3], pose[:3, 3] = turned(4, 1), (1.5, -1, 0.7)
    write_mha(folder / "stays.mha", blobs())
    write_mha(folder / "known.mha", blobs(), origin=pose[:3, 3], direction=pose[:3, :3])
    (folder / "parameters.txt").write_text((SOURCE / "Testing" / "elastix-rigid.txt").read_text() +
                                           '(Metric "AdvancedMeanSquares")\n(MaximumNumberOfIterations 200)\n')
    call("elastix", "-f", folder / "stays.mha", "-m", folder / "known.mha", "-p", folder / "parameters.txt", "-out", folder)
    points = points_of(folder)
    call("transformix", "-tp", folder / "TransformParameters.0.txt", "-out", folder, "-def", folder / "points.txt")
    found = we_pose(folder, folder / "TransformParameters.0.txt")
    corners = numpy.array(list(itertools.product((0, blobs().shape[0] - 1), repeat=3)))
    left = numpy.linalg.norm(corners @ (found @ pose)[:3, :3].T + (found @ pose)[:3, 3] - corners, axis=1).max()
    assert left < 0.5, f"it lies {left:.2f} mm from where it was"
    return points_off(folder, points, found)


# ---- Teem ----------------------------------------------------------------------------------------------------------------------

@check(TEEM, ".nrrd .nhdr", WRITES, "8 and 16 bit, 32-bit integers, float, double; oblique, anisotropic; raw and compressed")
def teem_reads(folder):
    worst = 0.0
    for kind, extension, compressed in itertools.product((*TYPES, "i4", "f8"), ("nrrd", "nhdr"), (False, True)):
        we_write(folder / f"ours.{extension}", voxels(kind), compressed)
        call("teem-unu", "save", "-f", "nrrd", "-e", "raw", "-i", f"ours.{extension}", "-o", "teem.nrrd", cwd=folder)
        array, matrix, _ = parsed_nrrd(folder / "teem.nrrd")
        worst = max(worst, assert_same(voxels(kind), array, affine(), matrix))
    return worst


@check(TEEM, ".nrrd .nhdr", READS, "the same types; raw, gzip and text; both byte orders; oblique, anisotropic")
def teem_writes(folder):
    worst = 0.0
    for kind, encoding, order, extension in itertools.product((*TYPES, "i4", "f8"), ("raw", "gzip", "ascii"), ("little", "big"), ("nrrd", "nhdr")):
        if encoding == "ascii" and (kind[0] == "f" or order == "big"):
            continue  # its texts of floats are rounded, and those of integers turned about
        known = voxels(kind)
        rows = " ".join("(" + ",".join(map(repr, map(float, axis))) + ")" for axis in affine()[:3, :3].T)
        (folder / "known.nrrd").write_bytes(
            f"NRRD0004\ntype: {dict(NAMES, i4='int', f8='double')[kind]}\ndimension: 3\nspace: left-posterior-superior\nsizes: 7 6 5\n"
            f"space directions: {rows}\nendian: little\nencoding: raw\nspace origin: ({','.join(map(repr, map(float, ORIGIN)))})\n\n".encode() + known.tobytes())
        call("teem-unu", "save", "-f", "nrrd", "-e", encoding, "-en", order, "-i", "known.nrrd", "-o", f"teem.{extension}", cwd=folder)
        read, matrix = we_read(folder / f"teem.{extension}")
        worst = max(worst, assert_same(known, read, affine(), matrix))
    return worst


@check(TEEM, ".seq.nrrd, a tracked sequence", WRITES, "pixels of all frames; poses and their status, as key and value")
def teem_reads_sequence(folder):
    pixels, poses = sequence()
    write_sequence(folder / "known.igs.mha", pixels, poses, times=range(5))
    we_convert(folder / "known.igs.mha", folder / "ours.seq.nrrd")
    call("teem-unu", "save", "-f", "nrrd", "-e", "raw", "-i", "ours.seq.nrrd", "-o", "teem.nrrd", cwd=folder)
    array, _, fields = parsed_nrrd(folder / "teem.nrrd")
    assert array.squeeze().tobytes() == pixels.tobytes()
    for i, pose in enumerate(poses):
        matrix, status = pose["ProbeToTracker"]
        assert fields[f"Seq_Frame{i:04}_ProbeToTrackerTransformStatus"] == status
        if status == "OK":
            written = numpy.array(fields[f"Seq_Frame{i:04}_ProbeToTrackerTransform"].split(), float).reshape(4, 4)
            assert abs(written - matrix).max() < 1e-6, written


# ---- nibabel -------------------------------------------------------------------------------------------------------------------

@check(NIBABEL, ".nii .nii.gz", WRITES, "8 and 16 bit, float, double; LPS into RAS; oblique, anisotropic; sform and qform", 1e-4)
def nibabel_reads(folder):
    import nibabel
    worst = 0.0
    for kind, extension in itertools.product((*TYPES, "f8"), ("nii", "nii.gz")):
        we_write(folder / f"ours.{extension}", voxels(kind))
        image = nibabel.load(folder / f"ours.{extension}")
        array = numpy.asarray(image.dataobj).T
        worst = max(worst, *(assert_same(voxels(kind), array, affine(), LPS @ form) for form in (image.get_sform(), image.get_qform())))
    return worst


@check(NIBABEL, ".nii .nii.gz, .hdr with .img", READS, "the same types, NIfTI-1 and 2, both byte orders, sform or qform alone, also left-handed", 1e-4)
def nibabel_writes(folder):
    import nibabel
    worst = 0.0
    kinds = ((nibabel.Nifti1Image, nibabel.Nifti1Header, "nii"), (nibabel.Nifti1Image, nibabel.Nifti1Header, "nii.gz"),
             (nibabel.Nifti2Image, nibabel.Nifti2Header, "nii"), (nibabel.Nifti1Pair, nibabel.nifti1.Nifti1PairHeader, "img"))
    for kind, (image_type, header_type, extension), order, mirrored, form in itertools.product((*TYPES, "f8"), kinds, "<>", (False, True), "sq"):
        matrix = affine(rotation=DIRECTION @ numpy.diag([1, 1, -1.0]) if mirrored else DIRECTION)
        header = header_type(endianness=order)
        header.set_data_dtype(kind)
        image = image_type(voxels(kind).T, None, header)
        image.set_sform(LPS @ matrix, code=int(form == "s"))
        image.set_qform(LPS @ matrix, code=int(form == "q"))
        nibabel.save(image, folder / f"theirs.{extension}")
        read, found = we_read(folder / f"theirs.{'hdr' if extension == 'img' else extension}")
        worst = max(worst, assert_same(voxels(kind), read, matrix, found))
    return worst


# ---- DICOM ---------------------------------------------------------------------------------------------------------------------

def slices(folder, array):
    """A series of single slices by pydicom; DICOM's decimal texts have 16 letters."""
    import warnings
    import pydicom
    from pydicom.dataset import FileDataset, FileMetaDataset
    warnings.simplefilter("ignore")
    folder.mkdir()
    decimal = lambda values: [f"{value:.10f}"[:16] for value in values]
    for k, pixels in enumerate(array):
        meta = FileMetaDataset()
        meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.6.1"
        meta.MediaStorageSOPInstanceUID = f"1.2.3.4.5.{k + 1}"
        meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        meta.ImplementationClassUID = "1.2.3.9"
        one = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
        one.is_little_endian, one.is_implicit_VR = True, False
        one.SOPClassUID, one.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
        one.StudyInstanceUID, one.SeriesInstanceUID, one.FrameOfReferenceUID = "1.2.3", "1.2.3.4", "1.2.3.5"
        one.Modality, one.InstanceNumber, one.PatientName, one.PatientID = "US", k + 1, "A^B", "1"
        one.Rows, one.Columns = pixels.shape
        one.SamplesPerPixel, one.PhotometricInterpretation = 1, "MONOCHROME2"
        one.BitsAllocated = one.BitsStored = 8 * pixels.itemsize
        one.HighBit, one.PixelRepresentation = one.BitsStored - 1, int(pixels.dtype.kind == "i")
        one.PixelSpacing = decimal([SPACING[1], SPACING[0]])
        one.ImageOrientationPatient = decimal([*DIRECTION[:, 0], *DIRECTION[:, 1]])
        one.ImagePositionPatient = decimal(affine()[:3, 3] + k * affine()[:3, 2])
        one.PixelData = pixels.tobytes()
        one["PixelData"].VR = "OW" if pixels.itemsize > 1 else "OB"
        one.save_as(folder / f"{k}.dcm", write_like_original=False)


def dicom_to_us(folder, *encodings):
    """`encodings`: for each a function that makes one file of another. Of slices with an even number of bytes."""
    worst = 0.0
    for kind in ("u1", "u2", "i2"):
        known = voxels(kind, (4, 6, 8))
        slices(folder / f"plain-{kind}", known)
        for number, encode in enumerate(encodings):
            target = folder / f"{kind}-{number}"
            target.mkdir()
            for file in (folder / f"plain-{kind}").iterdir():
                encode(file, target / file.name)
            read, matrix = we_read(target)
            worst = max(worst, assert_same(known, read, affine(), matrix))
    return worst


@check(PYDICOM, "DICOM series of slices", READS, "8 and 16 bit, signed, too; oblique, anisotropic; enhanced volumes, colours, movies: `TestDicom.py`")
def pydicom_writes(folder):
    return dicom_to_us(folder, shutil.copy)


@check(DCMTK, "the same series", READS, "implicit and explicit, deflated, RLE, lossless JPEG")
def dcmtk_writes(folder):
    if not PYDICOM.is_there():
        raise AssertionError("it needs python3-pydicom, too")
    return dicom_to_us(folder, lambda a, b: call("dcmconv", "+ti", a, b), lambda a, b: call("dcmconv", "+te", a, b), lambda a, b: call("dcmconv", "+td", a, b),
                       lambda a, b: call("dcmcrle", a, b), lambda a, b: call("dcmcjpeg", "+e1", a, b))


@check(GDCM, "the same series", READS, "implicit, RLE, lossless JPEG, JPEG-LS")
def gdcm_writes(folder):
    if not PYDICOM.is_there():
        raise AssertionError("it needs python3-pydicom, too")
    return dicom_to_us(folder, *(lambda a, b, how=how: call("gdcmconv", how, a, b) for how in ("--implicit", "--rle", "--jpeg", "--jpegls")))


# ---- VTK and Plus --------------------------------------------------------------------------------------------------------------

def of_image(image, name):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    rotation = numpy.array([[image.GetDirectionMatrix().GetElement(i, j) for j in range(3)] for i in range(3)])
    return (vtk_to_numpy(image.GetPointData().GetArray(name)).reshape(image.GetDimensions()[::-1]),
            affine(image.GetSpacing(), image.GetOrigin(), rotation))


@check(VTK, ".vti", WRITES, "8 and 16 bit, float, double; oblique, anisotropic: every bit")
def vtk_reads(folder):
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader
    worst = 0.0
    for kind in (*TYPES, "f8"):
        we_write(folder / "ours.vti", voxels(kind))
        reader = vtkXMLImageDataReader()
        reader.SetFileName(str(folder / "ours.vti"))
        reader.Update()
        worst = max(worst, assert_same(voxels(kind), of_image(reader.GetOutput(), "Intensity")[0], affine(), of_image(reader.GetOutput(), "Intensity")[1]))
    return worst


@check(VTK, ".vti", READS, "the same types; text, binary and appended, raw and base64; zlib, LZ4, LZMA; both byte orders")
def vtk_writes(folder):
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkIOXML import vtkXMLImageDataWriter
    worst = 0.0
    for kind, mode, encoded, compressor, big in itertools.product((*TYPES, "f8"), ("Ascii", "Binary", "Appended"), (False, True), ("None", "ZLib", "LZ4", "LZMA"),
                                                                  (False, True)):
        if mode == "Ascii" and (kind[0] == "f" or compressor != "None"):
            continue  # its texts of floats are rounded
        image = vtkImageData()
        image.SetDimensions(7, 6, 5)
        image.SetSpacing(SPACING)
        image.SetOrigin(ORIGIN)
        image.SetDirectionMatrix(DIRECTION.ravel())
        data = numpy_to_vtk(voxels(kind).ravel(), deep=True)
        data.SetName("values")
        image.GetPointData().SetScalars(data)
        writer = vtkXMLImageDataWriter()
        writer.SetInputData(image)
        writer.SetFileName(str(folder / "theirs.vti"))
        getattr(writer, f"SetDataModeTo{mode}")()
        getattr(writer, f"SetCompressorTypeTo{compressor}")()
        writer.SetEncodeAppendedData(encoded)
        writer.SetByteOrder(0 if big else 1)
        assert writer.Write() == 1
        read, matrix = we_read(folder / "theirs.vti")
        worst = max(worst, assert_same(voxels(kind), read, affine(), matrix))
    return worst


def fields_of_frames(path):
    """The fields of each frame of a file that has no pixels."""
    frames = collections.defaultdict(dict)
    for number, key, value in re.findall(r"^Seq_Frame(\d+)_(\w+) = (.*)$", path.read_bytes().decode("latin-1"), re.MULTILINE):
        frames[int(number)][key] = value
    return [frames[i] for i in sorted(frames)]


@check(PLUSLIB, ".igs.mha (9), volumes (2), device sets (2)", READS,
       "pixels, poses, status and times of all frames, written again as Plus has them; geometry of volumes; every calibration matrix")
def plus_writes(folder):
    worst, counts = 0.0, [0, 0, 0]
    for path in sorted(PLUS.glob("*.igs.mha")):
        we_convert(path, folder / "again.igs.mha")
        if b"MET_OTHER" in path.read_bytes()[:2000]:  # trackers alone
            frames, again = fields_of_frames(path), fields_of_frames(folder / "again.igs.mha")
        else:
            (theirs, frames), (ours, again) = read_sequence(path), read_sequence(folder / "again.igs.mha")
            assert theirs.tobytes() == ours.tobytes(), path.name
        assert len(frames) == len(again), path.name
        for i, (one, two) in enumerate(zip(frames, again)):
            for key in one:
                same = one[key].strip() == two[key].strip()
                if key.endswith("Transform") and not same:
                    off = abs(numpy.array(one[key].split(), float) - numpy.array(two[key].split(), float)).max()
                    worst, same = max(worst, off), off < 1e-6
                elif key == "Timestamp":
                    same = float(one[key]) == float(two[key])
                assert same, f"{path.name}, frame {i}, {key}: {one[key]} became {two.get(key)}"
        counts[0] += 1
    for path in sorted(PLUS.glob("*Reconstructed.mha")):
        theirs, matrix = parsed_mha(path)
        ours, found = we_read(path)
        worst = max(worst, assert_same(theirs, ours, matrix, found))
        counts[1] += 1
    for path in sorted(PLUS.glob("*.xml")):
        we_convert(path, folder / "set.json")
        ours = {f"{one['from']}To{one['to']}": numpy.array(one["matrix"]) for one in json.loads((folder / "set.json").read_text())["transforms"]}
        for one in ElementTree.parse(path).iterfind(".//CoordinateDefinitions/Transform"):
            matrix = numpy.array(one.get("Matrix").split(), float).reshape(4, 4)
            worst = max(worst, abs(matrix - ours[f"{one.get('From')}To{one.get('To')}"]).max())
        counts[2] += 1
    assert counts == [9, 2, 2], counts
    return worst


def perform(one):
    """The difference in mm, or None where no points are compared; AssertionError when it is not what it was."""
    with tempfile.TemporaryDirectory() as folder:
        off = one.function(pathlib.Path(folder))
    assert off is None or off <= one.bound, f"points differ by {off:.3g} mm, more than {one.bound:g}"
    return off


def row(one, off):
    told = "" if off is None else "0" if off == 0 else f"{off:.0e}".replace("e-0", "e-")
    title = one.peer.title.format(version=of_vtk()) if one.peer is VTK else str(one.peer)
    return f"| {title} | {one.files} | {one.way} | {one.compared} | {told} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.parse_args()
    missing = [peer for peer in PEERS if not peer.is_there()]
    if missing:
        sys.exit("not there: " + ", ".join(peer.package or peer.title for peer in missing) + "; the table would lack them")
    rows, wrong = [], 0
    for one in CHECKS:
        try:
            rows.append(row(one, perform(one)))
            print(rows[-1])
        except AssertionError as reason:
            wrong += 1
            print(f"{one.function.__name__}: {reason}")
    if wrong:
        sys.exit(f"{wrong} of {len(CHECKS)} disagree; the page is as it was")
    text = PAGE.read_text()
    start, stop = text.index(BEGIN) + len(BEGIN), text.index(END)
    table = "| program | files | way | compared | points differ by, mm |\n| --- | --- | --- | --- | --- |\n" + "\n".join(rows) + "\n"
    PAGE.write_text(text[:start] + table + text[stop:])


if __name__ == "__main__":
    main()
