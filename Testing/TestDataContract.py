#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The contract of Documentation/data.md, held by every algorithm of the package: nothing that a volume carries gets lost.

Every concrete vtkAlgorithm that `echorama` exports is found and run on volumes that lie obliquely in the world, whose spacing
is not cubic, whose extent does not begin at 0, and which carry every array and field there is. A filter that takes one
volume and puts out one on the same grid needs nothing in here. Anything else is named in the table Special, which says how
to feed it and what to expect.
"""
import inspect
import json
import os
import pathlib
import sys
import tempfile

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkDoubleArray, vtkPoints, vtkStringArray, vtkTypeUInt64Array
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet, vtkDataObject, vtkImageData, vtkMultiBlockDataSet, vtkPolyData
from vtkmodules.vtkCommonExecutionModel import vtkAlgorithm, vtkStreamingDemandDrivenPipeline, vtkTrivialProducer
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkFiltersSources import vtkSphereSource

import echorama

acquisition = echorama.vtkUltrasoundAcquisition
INTENSITY = echorama.vtkUltrasoundVolume.IntensityName()
VALID = echorama.vtkUltrasoundVolume.ValidRegionName()
VOXEL_TYPES = (np.uint8, np.int16, np.uint16, np.float32, np.float64)
SIZE = np.array([30, 26, 22])
SPACING = np.array([0.9, 1.1, 1.3])


# ---------------------------------------------------------------------------------------------------------------- volumes


def rotation(x, y, z):
    """Turned by angles (radians) about x, then y, then z."""
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    return (np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
            @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]))


def add_array(image, name, values):
    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    array.SetName(name)
    image.GetPointData().AddArray(array)


def add_field(data, name, values, kind=vtkDoubleArray):
    array = kind()
    array.SetName(name)
    if kind is vtkDoubleArray:
        array.SetNumberOfComponents(len(values))
        array.InsertNextTuple(values)
    else:
        for value in values:
            array.InsertNextValue(value)
    data.GetFieldData().AddArray(array)


def tissue(points):
    """Something to see and to align: blobs that are fixed in the world."""
    blobs = np.random.default_rng(5)
    value = np.zeros(points.shape[:-1])
    for _ in range(40):
        centre, radius = blobs.uniform(-25, 45, 3), blobs.uniform(2, 7)
        value += blobs.uniform(20, 90) * np.exp(-((points - centre) ** 2).sum(-1) / (2 * radius**2))
    return np.clip(value + 20, 0, 255)


def empty_volume(shift=(0, 0, 0), first=(4, -3, 7), size=SIZE, direction=rotation(0.3, -0.4, 0.5)):
    image = vtkImageData()
    image.SetExtent(*np.stack([first, np.add(first, size) - 1], 1).ravel().tolist())
    image.SetSpacing(SPACING)
    image.SetDirectionMatrix(direction.ravel())
    image.SetOrigin(np.add([3.0, -7.0, 11.0], shift))
    return image


def volume(dtype=np.uint8, **place):
    """A volume with everything that a volume can carry."""
    image = empty_volume(**place)
    points = np.array([image.GetPoint(i) for i in range(image.GetNumberOfPoints())])
    add_array(image, INTENSITY, tissue(points).astype(dtype))
    image.GetPointData().SetActiveScalars(INTENSITY)
    extent = np.array(image.GetExtent()).reshape(3, 2)
    axes = [np.arange(a, b + 1) for a, b in extent]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    middle = extent.mean(1)
    add_array(image, VALID, (((x - middle[0]) ** 2 + (y - middle[1]) ** 2 < 170) & (z > extent[2, 0])).astype(np.uint8).ravel())
    add_array(image, "Extra", np.arange(image.GetNumberOfPoints() * 2, dtype=np.float32).reshape(-1, 2))
    add_field(image, acquisition.ProbeGeometryName(), [60.0, 50.0, 40.0, 30.0, 5.0, 60.0])
    probe = np.eye(4)
    probe[:3, :3], probe[:3, 3] = rotation(0.1, 0.2, 0.3), (1, 2, 3)
    add_field(image, acquisition.ProbeToWorldName(), probe.ravel().tolist())
    add_field(image, acquisition.TimeStampName(), [12.25])
    add_field(image, acquisition.SeedName(), [2**63 + 1], vtkTypeUInt64Array)
    add_field(image, acquisition.SceneName(), ["a scene"], vtkStringArray)
    add_field(image, "Remark", ["of somebody else"], vtkStringArray)
    return image


def beam_volume():
    """Samples along beams: what a scan converter takes."""
    return volume(first=(0, 0, 0))


def copy_of(image):
    copy = vtkImageData()
    copy.DeepCopy(image)
    return copy


def block(*images):
    blocks = vtkMultiBlockDataSet()
    for number, image in enumerate(images):
        blocks.SetBlock(number, image)
        blocks.GetMetaData(number).Set(vtkCompositeDataSet.NAME(), f"volume {number}")
    return blocks


# ----------------------------------------------------------------------------------------------------------------- feeding


class Feed:
    """How one class is made, fed and asked: this one takes a volume and puts out one on the same grid."""

    volumes = 1 # that the filter needs
    same_grid = True # the output lies on the grid of the input and carries its arrays
    keeps_fields = True # and its field data
    output = "image" # or "blocks", "points", "file", None
    is_source = False
    needs_input = True
    works_on_blocks = True
    accepts = () # words of what others refuse (Spoils)

    def __init__(self, make):
        self.make = make

    def inputs(self):
        return [volume(shift=(2.0 * number, 1.0 * number, 0.0), first=(4 - number, -3, 7)) for number in range(self.volumes)]

    def connect(self, filter, images):
        for image in images:
            filter.AddInputDataObject(0, image)

    def filter(self, images=()):
        filter = self.make()
        self.connect(filter, images)
        return filter

    def run(self, filter):
        filter.Update()


class Several(Feed):
    volumes = 2


class ToOtherGrid(Feed):
    same_grid = False


class Aligner(Several):
    output = "blocks"

    def filter(self, images=()):
        filter = super().filter(images)
        filter.SetStart("tracked")
        filter.SetPoints(2000)
        return filter


class DeformableAligner(Several):
    output = "blocks"

    def filter(self, images=()):
        filter = super().filter(images)
        filter.SetFinestMm(2.0)
        filter.SetIterations(2)
        return filter


class PoseEditor(Several):
    output = "blocks"

    def filter(self, images=()):
        filter = super().filter(images)
        filter.SetTranslation(1.0, 2.0, 3.0)
        filter.SetRotation(10.0, 20.0, 30.0)
        return filter


class Score(Several):
    output = "points"
    same_grid = False

    def connect(self, filter, images):
        super().connect(filter, images)
        for image in images:
            filter.AddInputDataObject(1, copy_of(image))


class Disagreement(Several):
    """A map of blocks, which is no volume."""

    output = "points"
    same_grid = False


class LandmarkError(Several):
    output = "points"
    same_grid = False
    accepts = () # it reads no voxels

    def connect(self, filter, images):
        super().connect(filter, images)
        filter.ClearLandmarks()
        for number in range(len(images)):
            filter.AddLandmark(number, "apex", 1.0 * number, 2.0, 3.0)


class Stitcher(Several):
    same_grid = False
    keeps_fields = False # an acquisition is that of one volume


class StitchQuality(Feed):
    """A volume, held against itself as the only source."""

    works_on_blocks = False # it measures one result

    def connect(self, filter, images):
        super().connect(filter, images)
        for image in images:
            filter.AddSourceData(copy_of(image))


class EmbedQuality(Feed):
    """A volume whose labels say that it is data where it is valid."""

    works_on_blocks = False # it measures one result

    def inputs(self):
        images = super().inputs()
        for image in images:
            seen = vtk_to_numpy(image.GetPointData().GetArray(VALID))
            add_array(image, "Embedding", np.where(seen, 1, 3).astype(np.uint8))
        return images

    def connect(self, filter, images):
        super().connect(filter, images)
        for image in images:
            filter.SetOriginalData(copy_of(image))


class Embedder(ToOtherGrid):
    keeps_fields = False # the probe is that of the outline


class Feather(Feed):
    """A volume over itself."""

    works_on_blocks = False # there is one background

    def connect(self, filter, images):
        super().connect(filter, images)
        for image in images:
            filter.AddInputDataObject(1, copy_of(image))


class DeformGeometry(ToOtherGrid):
    """A volume in a lattice that does not move. It stays where it is, but what is not real comes out empty."""

    accepts = ("intensit",) # any image can be deformed

    def connect(self, filter, images):
        super().connect(filter, images)
        lattice = vtkImageData()
        lattice.SetDimensions(6, 6, 6)
        lattice.SetOrigin(-300.0, -300.0, -300.0)
        lattice.SetSpacing(120.0, 120.0, 120.0)
        add_array(lattice, "Displacement", np.zeros((216, 3)))
        filter.SetDisplacementData(lattice)


class ScanConverter(ToOtherGrid):
    works_on_blocks = False # where the output lies is in the field data, which VTK's pipeline gives to no block beforehand
    accepts = ("direction", "spacing") # the place of a beam volume says nothing

    def inputs(self):
        return [beam_volume()]


class Reconstructor(ToOtherGrid):
    """A tracked frame into the grid of a volume that it crosses."""

    keeps_fields = False # an acquisition is that of one frame
    works_on_blocks = False # it asks its input for one frame after the other

    def inputs(self):
        grid = empty_volume()
        middle = (grid.GetExtent()[4] + grid.GetExtent()[5]) // 2
        image = empty_volume(first=(0, 0, 0), size=(SIZE[0], SIZE[1], 1))
        place = np.eye(4)
        place[:3, :3] = rotation(0.3, -0.4, 0.5) * SPACING
        place[:3, 3] = np.array(grid.GetPoint(0)) + place[:3, 2] * (middle - grid.GetExtent()[4])
        image.SetOrigin(place[:3, 3])
        points = np.array([image.GetPoint(i) for i in range(image.GetNumberOfPoints())])
        add_array(image, INTENSITY, tissue(points).astype(np.uint8))
        image.GetPointData().SetActiveScalars(INTENSITY)
        add_array(image, VALID, (np.arange(len(points)) % 7 > 0).astype(np.uint8))
        add_field(image, acquisition.ImageToWorldName(), place.ravel().tolist())
        return [image]

    def filter(self, images=()):
        filter = super().filter(images)
        filter.SetSector(filter.ALL)
        filter.SetReferenceData(empty_volume())
        return filter


class Sender(Feed):
    """A server, each at a port of its own."""

    def filter(self, images=()):
        filter = super().filter(images)
        filter.SetPort(0)
        return filter


class ProbeFit(Feed):
    keeps_fields = False # it replaces two of them

    def filter(self, images=()):
        filter = super().filter(images)
        filter.SetMinimumOverlap(0.0) # the regions in here are no fans
        filter.SetMaximumDistance(10.0)
        return filter


class LiveImage(ToOtherGrid):
    """A slice of a volume, under a probe of its own."""

    works_on_blocks = False # they become one image
    keeps_fields = False # the probe is its own
    needs_input = False # without a volume it is empty, and says so

    def filter(self, images=()):
        filter = super().filter(images)
        filter.SetDepthMm(30.0)
        filter.SetBeams(32)
        filter.SetSamples(64)
        filter.SetWidth(64)
        filter.SetHeight(48)
        return filter


class NoiseTiler(ToOtherGrid):
    works_on_blocks = False # they become one volume
    keeps_fields = False # an acquisition is that of one volume


class Phantom(ToOtherGrid):
    is_source = True
    volumes = 0

    def filter(self, images=()):
        filter = self.make()
        filter.SetSpacingMm(3.0)
        filter.SetPosition(1.0, 2.0, 3.0)
        filter.SetOrientation(10.0, 20.0, 30.0)
        return filter


class NoiseSource(Phantom):
    """Made from no input; the volumes that it may take are a matter of its own test."""


class TissueSource(Phantom):
    output = "points"

    def filter(self, images=()):
        return self.make()


class SceneSource(Phantom):
    """Blocks of volumes, from a text."""
    output = "blocks"

    def filter(self, images=()):
        filter = self.make()
        filter.SetScene(json.dumps({"schema": "echorama-scene-1", "background": "tissue", "views": {"count": 2}, "volume": {"spacingMm": 3},
                                    "probe": {"elements": 12, "sweepSteps": 8, "samples": 60}}))
        return filter


class Synthesizer(Phantom):
    """A volume of tissue that never changes; its input is no volume."""

    def filter(self, images=()):
        filter = self.make()
        filter.tissue = echorama.vtkUltrasoundTissueSource()
        filter.SetInputConnection(filter.tissue.GetOutputPort())
        filter.SetElements(12)
        filter.SetSteps(8)
        filter.SetSamples(60)
        filter.SetSpacingMm(3.0)
        filter.SetPosition(1.0, 2.0, 3.0)
        filter.SetOrientation(10.0, 20.0, 30.0)
        return filter


class TissuePress(Phantom):
    """A displacement of tissue, which is no volume."""

    output = "points"

    def filter(self, images=()):
        filter = self.make()
        filter.tissue = echorama.vtkUltrasoundAnatomySource()
        filter.SetInputConnection(filter.tissue.GetOutputPort())
        filter.SetSpacingMm(15.0)
        return filter


class Gel(TissueSource):
    """Tissue with gel, of a probe above it."""

    def filter(self, images=()):
        filter = self.make()
        filter.tissue, filter.probe = echorama.vtkUltrasoundAnatomySource(), echorama.vtkUltrasoundProbeSource()
        filter.probe.SetPosition(0.0, 0.0, -4.0)
        filter.SetInputConnection(filter.tissue.GetOutputPort())
        filter.AddProbeConnection(filter.probe.GetOutputPort())
        filter.SetCellMm(6.0)
        filter.SetSettleS(0.0)
        return filter


class TissueMeshes(TissueSource):
    """From meshes, which its own test feeds."""

    def filter(self, images=()):
        filter = self.make()
        ball = vtkSphereSource()
        ball.Update()
        filter.AddInputDataObject(ball.GetOutput())
        return filter


class Shell(TissueSource):
    """From the surface of a body; its own test looks at what comes out."""

    def filter(self, images=()):
        filter = self.make()
        ball = vtkSphereSource()
        ball.SetRadius(30)
        ball.SetThetaResolution(32)
        ball.SetPhiResolution(32)
        ball.Update()
        filter.SetInputDataObject(ball.GetOutput())
        filter.SetResolutionMm(1)
        filter.SetPoints(30)
        return filter


class RigFit(TissueSource):
    """From a scan of the rig, which its own test makes as well; other volumes show none."""

    def filter(self, images=()):
        filter = self.make()
        rig, scan = echorama.vtkUltrasoundAnatomySource(), echorama.vtkUltrasoundSynthesizer()
        rig.SetKindToCalibrationRig()
        scan.SetInputConnection(rig.GetOutputPort())
        for name, value in (("FanAngle", 70), ("FanRadius", 40), ("SweepAngle", 65), ("SweepRadius", 30), ("DepthMax", 118), ("Elements", 64),
                            ("Steps", 48), ("Samples", 320), ("TgcDbPerCm", 0), ("DynamicRangeDb", 70), ("NoiseDb", -45), ("SpacingMm", 1.2)):
            getattr(scan, "Set" + name)(value)
        filter.SetInputConnection(scan.GetOutputPort())
        filter.SetBalls("A -27 -22 -19 4; B -30 23 -45 5; C -5 -20 -49 3; D -2 18 -28 6; E 27 21 -20 7; F 12 -14 -58 3.5; G 30 -1 -47 4.5")
        return filter


class Skin(TissueSource):
    """A surface of a volume; which volumes are refused is a matter of its own test."""

    def filter(self, images=()):
        filter = self.make()
        phantom = echorama.vtkUltrasoundPhantomSource()
        phantom.SetSpacingMm(3.0)
        filter.SetInputConnection(phantom.GetOutputPort())
        return filter


class HandEye(TissueSource):
    """From poses, which are no volumes."""

    def filter(self, images=()):
        filter = self.make()
        for angles in ((0, 0, 0), (0.5, 0, 0), (0, 0.6, 0), (0, 0, 0.7), (0.3, 0.3, 0.2)):
            pose = vtkMatrix4x4()
            for i, row in enumerate(rotation(*angles)):
                for j, element in enumerate(row):
                    pose.SetElement(i, j, element)
            filter.AddPair(pose, pose)
        return filter


def track(shift=0.0):
    """A tool that is turned about its tip, without a rhythm."""
    line, times, poses = vtkPolyData(), numpy_to_vtk(np.arange(0, 20, 0.02) + shift, deep=True), []
    for t in np.arange(0, 20, 0.02):
        pose = np.eye(4)
        pose[:3, :3] = rotation(0.5 * np.sin(1.3 * t) * np.sin(0.37 * t), 0.4 * np.sin(2.1 * t + 1) * np.sin(0.23 * t), 0.3 * np.sin(1.7 * t))
        pose[:3, 3] = np.array([10, 20, 30]) - pose[:3, :3] @ [0, 0, 100]
        poses.append(pose)
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.array([pose[:3, 3] for pose in poses]), deep=True))
    line.SetPoints(points)
    matrices = numpy_to_vtk(np.array(poses).reshape(-1, 16), deep=True)
    for name, array in (("TimeStamp", times), ("ToolToWorld", matrices)):
        array.SetName(name)
        line.GetPointData().AddArray(array)
    return line


class Pivot(TissueSource):
    """From a track, which is no volume."""

    def filter(self, images=()):
        filter = self.make()
        filter.SetInputDataObject(track())
        return filter


class Temporal(TissueSource):
    def filter(self, images=()):
        filter = self.make()
        filter.SetInputDataObject(0, track())
        filter.SetInputDataObject(1, track(0.25))
        return filter


class TrackerPlacement(Several):
    """With a track that covers the volumes' time stamps."""

    output = "blocks"

    def connect(self, filter, images):
        super().connect(filter, images)
        filter.SetInputDataObject(1, track(10.0))


class Files(Feed):
    def __init__(self, make):
        super().__init__(make)
        self.folder = tempfile.TemporaryDirectory()

    def path(self):
        return os.path.join(self.folder.name, "volume.vti")


class Reader(Files):
    is_source = True

    def filter(self, images=()):
        filter = self.make()
        filter.SetFileName(self.path())
        if images:
            writer = echorama.vtkUltrasoundWriter()
            writer.SetFileName(self.path())
            writer.SetInputData(images[0])
            writer.Write()
        return filter


class Writer(Files):
    output = "file"
    accepts = ("type int",) # files hold any number

    def filter(self, images=()):
        filter = super().filter(images)
        filter.SetFileName(self.path())
        return filter

    def run(self, filter):
        filter.Write()


class SequenceReader(Reader):
    """A volume as the one frame of a sequence."""

    same_grid = False # sequences hold intensities alone

    def path(self):
        return os.path.join(self.folder.name, "volume.seq.mha")

    def filter(self, images=()):
        filter = self.make()
        filter.SetFileName(self.path())
        if images:
            writer = echorama.vtkUltrasoundSequenceWriter()
            writer.SetFileName(self.path())
            writer.SetInputData(images[0])
            errors_of(writer, writer.Write)
        return filter


class SequenceWriter(Writer):
    def path(self):
        return os.path.join(self.folder.name, "volume.seq.mha")


class TrackerSource(Feed):
    is_source = True
    volumes = 0
    same_grid = False
    output = "points"

    def filter(self, images=()):
        filter = self.make()
        filter.SetDevice("simulated:?rate=200")
        filter.WaitForPoses(2, 60.0)
        return filter


Special = {
    "vtkUltrasoundReader": Reader,
    "vtkUltrasoundSequenceReader": SequenceReader,
    "vtkUltrasoundSequenceWriter": SequenceWriter,
    "vtkUltrasoundWriter": Writer,
    "vtkUltrasoundNoiseSource": NoiseSource,
    "vtkUltrasoundPhantomSource": Phantom,
    "vtkUltrasoundAligner": Aligner,
    "vtkUltrasoundAlignmentScore": Score,
    "vtkUltrasoundDeformableAligner": DeformableAligner,
    "vtkUltrasoundDeformGeometry": DeformGeometry,
    "vtkUltrasoundLandmarkError": LandmarkError,
    "vtkUltrasoundLiveImage": LiveImage,
    "vtkUltrasoundPoseEditor": PoseEditor,
    "vtkUltrasoundStitcher": Stitcher,
    "vtkUltrasoundEmbedder": Embedder,
    "vtkUltrasoundDisagreement": Disagreement,
    "vtkUltrasoundEmbedQuality": EmbedQuality,
    "vtkUltrasoundFeather": Feather,
    "vtkUltrasoundGel": Gel,
    "vtkUltrasoundHandEyeCalibration": HandEye,
    "vtkUltrasoundPivotCalibration": Pivot,
    "vtkUltrasoundTemporalCalibration": Temporal,
    "vtkUltrasoundStitchQuality": StitchQuality,
    "vtkUltrasoundNoiseTiler": NoiseTiler,
    "vtkUltrasoundOpenIGTLinkSender": Sender,
    "vtkUltrasoundProbeFit": ProbeFit,
    "vtkUltrasoundScanConverter": ScanConverter,
    "vtkUltrasoundAnatomySource": TissueSource,
    "vtkUltrasoundPrintableSource": TissueSource,
    "vtkUltrasoundProbeSource": TissueSource,
    "vtkUltrasoundRigFit": RigFit,
    "vtkUltrasoundSkin": Skin,
    "vtkUltrasoundShell": Shell,
    "vtkUltrasoundTissueMeshes": TissueMeshes,
    "vtkUltrasoundTissuePress": TissuePress,
    "vtkUltrasoundTissueSource": TissueSource,
    "vtkUltrasoundSceneSource": SceneSource,
    "vtkUltrasoundSynthesizer": Synthesizer,
    "vtkUltrasoundTrackerPlacement": TrackerPlacement,
    "vtkUltrasoundTrackerSource": TrackerSource,
    "vtkUltrasoundVolumeReconstructor": Reconstructor,
}


# ---------------------------------------------------------------------------------------------------------------- checking


complaints = []
current = ""


def check(condition, what):
    if not condition:
        complaints.append(f"{current}: {what}")
    return condition


def values(array):
    if isinstance(array, vtkStringArray):
        return [array.GetValue(i) for i in range(array.GetNumberOfValues())]
    return vtk_to_numpy(array)


def same(a, b):
    """Whether two arrays hold the same numbers of the same size, or the same strings."""
    a, b = values(a), values(b)
    return getattr(a, "dtype", None) == getattr(b, "dtype", None) and np.array_equal(a, b)


def arrays_of(attributes):
    return {attributes.GetAbstractArray(i).GetName(): attributes.GetAbstractArray(i) for i in range(attributes.GetNumberOfArrays())}


def geometry(image):
    direction = image.GetDirectionMatrix()
    return {"extent": image.GetExtent(), "origin": image.GetOrigin(), "spacing": image.GetSpacing(),
            "direction": tuple(direction.GetElement(i, j) for i in range(3) for j in range(3))}


def promised_geometry(filter, port=0):
    """What the pipeline says of an output before there is any data; None for what it does not say."""
    information = filter.GetOutputInformation(port)
    keys = {"extent": vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT(), "origin": vtkDataObject.ORIGIN(),
            "spacing": vtkDataObject.SPACING(), "direction": vtkDataObject.DIRECTION()}
    return {name: tuple(information.Get(key)) if information.Has(key) else None for name, key in keys.items()}


def errors_of(filter, run):
    """Runs and returns the error messages of filter and pipeline, which are kept off the terminal."""
    errors = []

    def remember(caller, event, message):
        errors.append(message)

    remember.CallDataType = "string0"
    observed = (filter, filter.GetExecutive())
    tags = [(each, each.AddObserver(vtkCommand.ErrorEvent, remember)) for each in observed]
    run()
    for each, tag in tags:
        each.RemoveObserver(tag)
    return errors


def output_images(data):
    if isinstance(data, vtkImageData):
        return [data]
    if isinstance(data, vtkMultiBlockDataSet):
        return [data.GetBlock(i) for i in range(data.GetNumberOfBlocks())]
    return []


def is_empty(data):
    if isinstance(data, vtkMultiBlockDataSet):
        return all(image is None or image.GetNumberOfPoints() == 0 for image in output_images(data))
    return data is None or data.GetNumberOfPoints() == 0


def check_is_volume(image):
    """The arrays that every volume has."""
    point_data = image.GetPointData()
    intensity, valid = point_data.GetArray(INTENSITY), point_data.GetArray(VALID)
    count = image.GetNumberOfPoints()
    check(count > 0, "the output has no voxels")
    if check(intensity is not None, f"the output has no {INTENSITY}"):
        check(intensity.GetNumberOfComponents() == 1 and intensity.GetNumberOfTuples() == count, f"{INTENSITY} is not one number per voxel")
        check(values(intensity).dtype in VOXEL_TYPES, f"{INTENSITY} is of type {values(intensity).dtype}")
        check(point_data.GetScalars() is not None and point_data.GetScalars().GetName() == INTENSITY, f"{INTENSITY} is not the active scalars")
    if check(valid is not None, f"the output has no {VALID}"):
        check(values(valid).dtype == np.uint8 and valid.GetNumberOfTuples() == count, f"{VALID} is not one unsigned char per voxel")
        check(set(np.unique(values(valid))) <= {0, 1}, f"{VALID} has values other than 0 and 1")
    direction = np.array(geometry(image)["direction"]).reshape(3, 3)
    check(np.allclose(direction @ direction.T, np.eye(3)) and np.linalg.det(direction) > 0, "the direction of the output is no rotation")


def check_carries(image, source, keeps_fields):
    """Arrays on the same grid, and the field data."""
    there = arrays_of(image.GetPointData())
    for name, array in arrays_of(source.GetPointData()).items():
        if check(name in there, f"the point array {name} got lost") and name == "Extra":
            check(same(there[name], array), f"the point array {name} was changed")
    if keeps_fields:
        check_carries_fields(image, source)


def check_carries_fields(image, source):
    there = arrays_of(image.GetFieldData())
    for name, array in arrays_of(source.GetFieldData()).items():
        if check(name in there, f"the field {name} got lost") and name != acquisition.ProbeToWorldName():
            check(same(there[name], array), f"the field {name} was changed")
    name = acquisition.ProbeToWorldName()
    if name in there and name in arrays_of(source.GetFieldData()):
        now, then = (values(each.GetFieldData().GetArray(name)).reshape(4, 4) for each in (image, source))
        went = np.eye(4) if current == "vtkUltrasoundScanConverter" else motion(image, source)  # beams lie in no world of their own
        check(np.allclose(now, went @ then, atol=1e-9), "ProbeToWorld did not go where the volume went")


def motion(image, source):
    """From where the source lies to where the image lies, by their directions and origins."""
    to, start = (np.array(geometry(each)["direction"]).reshape(3, 3) for each in (image, source))
    matrix = np.eye(4)
    matrix[:3, :3] = to @ start.T
    matrix[:3, 3] = np.array(image.GetPoint(0)) - matrix[:3, :3] @ source.GetPoint(0)
    return matrix


def world_of_voxels(image):
    """Where some voxels lie."""
    count = image.GetNumberOfPoints()
    return np.array([image.GetPoint(i) for i in (0, count // 3, count // 2, count - 1)])


def check_geometry(feed, images):
    """The pose is promised before the data are made, the data keep the promise, and nothing else is touched."""
    before = [copy_of(image) for image in images]
    times = [image.GetMTime() for image in images]
    filter = feed.filter(images)
    filter.UpdateInformation()
    promised = promised_geometry(filter) if feed.output == "image" else None
    errors = errors_of(filter, lambda: feed.run(filter))
    if not check(not errors, f"it does not run as it was fed: {' / '.join(errors)}\n"
                 "  (a class that needs more than one volume is to be named in the table Special of Testing/TestDataContract.py)"):
        return
    for image, copy, time in zip(images, before, times):
        check(image.GetMTime() == time and geometry(image) == geometry(copy), "the input was modified")
        for now, then in ((image.GetPointData(), copy.GetPointData()), (image.GetFieldData(), copy.GetFieldData())):
            now, then = arrays_of(now), arrays_of(then)
            check(now.keys() == then.keys() and all(same(now[name], then[name]) for name in then), "an array of the input was modified")
    if feed.output == "file":
        check(os.path.getsize(feed.path()) > 0, "no file was written")
        return
    data = filter.GetOutputDataObject(0)
    if feed.output == "points":
        check(not is_empty(data), "the output is empty")
        return
    expected = {"image": vtkImageData, "blocks": vtkMultiBlockDataSet}[feed.output]
    if not check(isinstance(data, expected), f"the output is a {type(data).__name__}, not a {expected.__name__}; a class with "
                 "another output is to be named in the table Special of Testing/TestDataContract.py"):
        return
    outputs = output_images(data)
    check(outputs and all(isinstance(image, vtkImageData) for image in outputs), "a block is no volume")
    for image in outputs:
        check_is_volume(image)
    if promised:
        for name, value in geometry(outputs[0]).items():
            check(promised[name] == value, f"RequestInformation says {name} {promised[name]}, the output has {value}")
    if feed.output == "blocks" and not feed.is_source:
        check(len(outputs) == len(images), f"{len(images)} volumes went in, {len(outputs)} came out")
    if feed.same_grid:
        for image, source in zip(outputs, images):
            check(image.GetDimensions() == source.GetDimensions(), "the output has other dimensions than the input")
            if feed.output == "image": # several volumes come out moved
                check(np.allclose(world_of_voxels(image), world_of_voxels(source), atol=1e-9), "the output lies elsewhere than the input")
            check_carries(image, source, feed.keeps_fields)
    elif feed.keeps_fields:
        for image, source in zip(outputs, images):
            check_carries_fields(image, source)


def check_piece(feed, images):
    """A part of the output is the same part of the whole (as under MPI)."""
    whole = feed.filter(images)
    whole.Update()
    whole = whole.GetOutputDataObject(0)
    extent = list(whole.GetExtent())
    wanted = [extent[0] + 1, extent[1], extent[2], (extent[2] + extent[3]) // 2, (extent[4] + extent[5]) // 2, max(extent[4], extent[5] - 1)]
    filter = feed.filter(images)
    filter.UpdateInformation()
    filter.UpdateExtent(wanted)
    piece = filter.GetOutputDataObject(0)
    if not check(list(piece.GetExtent()) == wanted, f"asked for {wanted} it puts out {piece.GetExtent()}"):
        return
    whole.Crop(wanted)
    check({**geometry(piece), "extent": 0} == {**geometry(whole), "extent": 0}, "a piece lies elsewhere than the whole")
    there = arrays_of(piece.GetPointData())
    for name, array in arrays_of(whole.GetPointData()).items():
        check(name in there and same(there[name], array), f"a piece has another {name} than the whole")
    check_carries_fields(piece, whole)


def check_composite(feed, images):
    """A filter of one volume works on each block of a multi-block, as VTK's pipeline runs it."""
    images = [images[0], volume(shift=(9, 9, 9), first=(0, 0, 0), direction=rotation(-0.2, 0.1, 1.2))]
    blocks = block(*images)
    filter = feed.filter([blocks])
    errors = errors_of(filter, lambda: feed.run(filter))
    outputs = output_images(filter.GetOutputDataObject(0))
    if not check(not errors and len(outputs) == 2 and all(outputs), f"it does not run on the blocks of a multi-block: {' / '.join(errors)}"):
        return
    for image, source in zip(outputs, images):
        check_is_volume(image)
        if feed.same_grid:
            check(np.allclose(world_of_voxels(image), world_of_voxels(source), atol=1e-9), "a block lies elsewhere than the input's block")
            check_carries(image, source, feed.keeps_fields)


def without_arrays(image):
    for name in list(arrays_of(image.GetPointData())):
        image.GetPointData().RemoveArray(name)


def with_intensity(kind, components=1):
    def spoil(image):
        shape = (image.GetNumberOfPoints(), components) if components > 1 else image.GetNumberOfPoints()
        add_array(image, INTENSITY, np.ones(shape, kind))

    return spoil


def with_valid_region_of_floats(image):
    add_array(image, VALID, np.ones(image.GetNumberOfPoints(), np.float32))


def with_short_valid_region(image):
    add_array(image, VALID, np.ones(image.GetNumberOfPoints() - 1, np.uint8))


Spoils = {
    "no intensities": without_arrays,
    "intensities of type int": with_intensity(np.int32),
    "three intensities per voxel": with_intensity(np.uint8, 3),
    "a valid region of floats": with_valid_region_of_floats,
    "a valid region that is too short": with_short_valid_region,
    "a sheared direction": lambda image: image.SetDirectionMatrix(1, 0.5, 0, 0, 1, 0, 0, 0, 1),
    "a singular direction": lambda image: image.SetDirectionMatrix(1, 0, 0, 1, 0, 0, 0, 0, 1),
    "a spacing of zero": lambda image: image.SetSpacing(1.0, 0.0, 1.0),
    "a spacing that is not a number": lambda image: image.SetSpacing(1.0, 1.0, float("nan")),
}


def check_refusals(feed):
    """Bad volumes give an error and an empty output; a good one after that works again."""
    for what, spoil in Spoils.items():
        if any(word in what for word in feed.accepts):
            continue
        images = feed.inputs()
        good = [copy_of(image) for image in images]
        spoil(images[-1])
        if feed.output == "file" and os.path.exists(feed.path()):
            os.remove(feed.path())
        filter = feed.filter(images)
        errors = errors_of(filter, lambda: feed.run(filter))
        check(errors, f"no error for {what}")
        if feed.output == "file":
            check(not os.path.exists(feed.path()), f"a file was written for {what}")
            continue
        check(is_empty(filter.GetOutputDataObject(0)), f"the output is not empty for {what}")
        for port in range(filter.GetNumberOfInputPorts()):
            filter.RemoveAllInputConnections(port)
        feed.connect(filter, good)
        errors = errors_of(filter, lambda: feed.run(filter))
        check(not errors and not is_empty(filter.GetOutputDataObject(0)), f"after {what}, a good input does not work: {' / '.join(errors)}")


def check_abort(feed, images):
    """Stopping it leaves the output empty, and it can be run again. (Work that was done by then may be put out.)"""
    filter = feed.filter(images)
    calls = []

    def stop(caller, event):
        calls.append(filter.GetProgress())
        filter.SetAbortExecute(1)

    tag = filter.AddObserver(vtkCommand.ProgressEvent, stop)
    errors_of(filter, lambda: feed.run(filter))
    filter.RemoveObserver(tag)
    if feed.output == "file":
        return
    if calls and calls[0] < 1.0:
        check(is_empty(filter.GetOutputDataObject(0)), f"stopped at {calls[0]:.0%} it still has an output")
    filter.Modified()
    errors = errors_of(filter, lambda: feed.run(filter))
    check(not errors and not is_empty(filter.GetOutputDataObject(0)), f"it does not run again after it was stopped: {' / '.join(errors)}")


def check_missing_input(feed):
    """Nothing to work on is an error (of the filter or of the pipeline), not a crash."""
    filter = feed.filter()
    if isinstance(feed, Reader):
        filter.SetFileName(os.path.join(feed.folder.name, "missing.vti"))
    errors = errors_of(filter, lambda: feed.run(filter))
    check(errors, "no error without an input")


def algorithms():
    """Every class of the package that can be made and is an algorithm."""
    for name, kind in inspect.getmembers(echorama):
        if isinstance(kind, type) and issubclass(kind, vtkAlgorithm) and kind.__name__ == name:
            try:
                kind()
            except (TypeError, NotImplementedError): # abstract
                continue
            yield name, kind


source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
furnished = {path.stem for room in ("Core", "Readers", "Tracking", "Filters", "Widgets") for path in (source / room).rglob("vtk*.xml")}
check(furnished, "there is nothing to test")
for current in sorted((furnished | set(Special)) - {name for name, _ in algorithms()}):
    check(False, "the package has no such algorithm, or it cannot be made")

for name, kind in algorithms():
    current = name
    feed = Special.get(name, Feed)(kind)
    found = len(complaints)
    images = feed.inputs()
    check_geometry(feed, images)
    if len(complaints) == found: # else the rest would say the same again
        if feed.output == "image":
            check_piece(feed, images)
        if feed.output == "image" and feed.volumes == 1 and feed.works_on_blocks and not feed.is_source:
            check_composite(feed, images)
        if not feed.is_source:
            check_refusals(feed)
        if feed.needs_input and not (feed.is_source and feed.volumes == 0):
            check_missing_input(feed)
        check_abort(feed, images)
    print(f"{name}: {'kept' if len(complaints) == found else 'BROKEN'}")

for complaint in complaints:
    print(complaint, file=sys.stderr)
sys.exit(1 if complaints else 0)
