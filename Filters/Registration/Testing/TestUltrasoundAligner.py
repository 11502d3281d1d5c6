# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped aligner and score: motions found, voxels shared, geometry and ProbeToWorld moved, errors that say why."""
import json
import math
import os
import tempfile

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkCommand, vtkDoubleArray
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkMultiBlockDataSet
from vtkmodules.vtkCommonExecutionModel import vtkTrivialProducer
from vtkmodules.vtkCommonMath import vtkMatrix4x4

from echorama.EchoramaCore import vtkUltrasoundAcquisition, vtkUltrasoundVolume
from echorama.EchoramaFiltersRegistration import vtkUltrasoundAligner, vtkUltrasoundAlignmentScore

rng = np.random.default_rng(4)
waves = rng.normal(size=(24, 3)) * 0.12
phases = rng.uniform(0, 2 * math.pi, 24)
OBLIQUE = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])


def volume(origin, dtype=np.uint8, dims=(44, 40, 36), direction=OBLIQUE):
    """What a grid sees of one smooth random scene."""
    image = vtkImageData()
    image.SetDimensions(dims)
    image.SetSpacing(2, 2, 2)
    image.SetOrigin(origin)
    image.SetDirectionMatrix(direction.ravel())
    k, j, i = np.meshgrid(*[2.0 * np.arange(n) for n in dims[::-1]], indexing="ij")
    world = np.stack([i, j, k], -1) @ direction.T + np.array(origin)
    scene = (120 + 9 * np.cos(world @ waves.T + phases).sum(-1)).clip(1, 254)
    array = numpy_to_vtk(scene.astype(dtype).ravel(), deep=True)
    array.SetName("Intensity")
    image.GetPointData().SetScalars(array)
    valid = np.ones(dims[::-1], np.uint8)
    valid[:2] = 0
    mask = numpy_to_vtk(valid.ravel(), deep=True)
    mask.SetName("ValidRegion")
    image.GetPointData().AddArray(mask)
    probe = vtkDoubleArray()
    probe.SetName(vtkUltrasoundAcquisition.ProbeToWorldName())
    probe.SetNumberOfComponents(16)
    probe.InsertNextTuple([1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7, 0, 0, 0, 1])
    image.GetFieldData().AddArray(probe)
    return image


def matrix(rows):
    m = vtkMatrix4x4()
    m.DeepCopy([float(x) for x in np.asarray(rows).ravel()])
    return m


def numbers(m):
    return np.array([[m.GetElement(r, c) for c in range(4)] for r in range(4)])


def knocked(image, rows):
    moved = vtkImageData()
    moved.ShallowCopy(image)
    assert vtkUltrasoundVolume.Move(moved, matrix(rows))
    return moved


def geometry(image):
    d = image.GetDirectionMatrix()
    m = np.eye(4)
    m[:3, :3] = [[d.GetElement(r, c) for c in range(3)] for r in range(3)]
    m[:3, 3] = image.GetOrigin()
    return m


def errors_of(algorithm):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    algorithm.AddObserver(vtkCommand.ErrorEvent, note)
    algorithm.GetExecutive().AddObserver(vtkCommand.ErrorEvent, note)
    algorithm.Update()
    return " ".join(messages)


def aligner(*images):
    filter = vtkUltrasoundAligner()
    filter.SetStart("tracked")
    filter.SetPoints(20000)
    filter.SetMetric("ncc")  # one scene seen twice, without speckle or drift: the most exact one
    for image in images:
        filter.AddInputDataObject(0, image)
    return filter


a, b = volume((0, 0, 0)), volume((20, 14, 4), np.float32)
c, s = math.cos(math.radians(4)), math.sin(math.radians(4))
push = np.array([[c, 0, s, 2.0], [0, 1, 0, -4.0], [-s, 0, c, 6.0], [0, 0, 0, 1]])
wrong = knocked(b, push)
before = geometry(wrong)

# 1. the motion is found; the output is the input, moved, and nothing else is new
align = aligner(a, wrong)
align.Update()
output = align.GetOutput()
assert output.IsA("vtkMultiBlockDataSet") and output.GetNumberOfBlocks() == 2
for i, image in enumerate((a, wrong)):
    block = output.GetBlock(i)
    assert output.GetMetaData(i).Get(output.NAME()) == f"volume {i + 1}"
    assert block.GetPointData().GetArray("Intensity") is image.GetPointData().GetArray("Intensity"), "voxels are shared"
    assert block.GetPointData().GetArray("ValidRegion") is image.GetPointData().GetArray("ValidRegion")
    pose = matrix(np.zeros((4, 4)))
    assert align.GetPose(i, pose)
    pose = numbers(pose)
    assert np.allclose(geometry(block), pose @ geometry(image), atol=1e-9)
    written = block.GetFieldData().GetArray(align.VolumeToWorldName())
    assert np.allclose([written.GetComponent(0, n) for n in range(16)], pose.ravel())
    probe, was = vtkMatrix4x4(), vtkMatrix4x4()
    assert vtkUltrasoundAcquisition.GetProbeToWorld(block, probe)
    assert vtkUltrasoundAcquisition.GetProbeToWorld(image, was)
    assert np.allclose(numbers(probe), pose @ numbers(was))
    assert image.GetFieldData().GetArray(align.VolumeToWorldName()) is None, "the input must not change"
assert np.array_equal(geometry(wrong), before), "the input must not change"
assert np.array_equal(geometry(output.GetBlock(0)), geometry(a)), "the fixed volume stays"
assert np.abs(geometry(output.GetBlock(1)) - geometry(b)).max() < 0.5
assert 0.4 < align.GetOverlap(1) < 1 and align.GetOverlap(0) == align.GetOverlap(1), "two volumes, one pair"
assert output.GetBlock(1).GetFieldData().GetArray("AlignmentOverlap").GetValue(0) == align.GetOverlap(1)
assert not align.GetPose(2, vtkMatrix4x4()) and align.GetNumberOfVolumes() == 2

# 1b. a dry run moves nothing; a pair that is in the file is not aligned again unless a volume has changed; memory changes nothing
with tempfile.TemporaryDirectory() as folder:
    known = os.path.join(folder, "pairs.json")

    def again(*images, memory=0.0):
        filter = aligner(*images)
        filter.SetFinishedPairs(known)
        filter.SetMemoryGb(memory)
        filter.Update()
        pose = vtkMatrix4x4()
        assert filter.GetPose(1, pose)
        return numbers(pose), json.loads(filter.GetReport())

    first, report = again(a, wrong)
    assert (report["pairs_finished_before"], report["times_prepared"]) == (0, 2) and report["prepared_bytes"] > 1e5
    assert align.GetPose(1, (pose := vtkMatrix4x4())) and np.array_equal(first, numbers(pose))
    same, report = again(a, wrong, memory=1e-6)
    assert (report["pairs_finished_before"], report["times_prepared"]) == (1, 0) and np.array_equal(same, first)
    plan = aligner(a, wrong)
    plan.DryRunOn()
    plan.Update()
    anew = json.loads(plan.GetPlan())
    assert anew["pairs_finished_before"] == 0 and anew["seconds"] > anew["seconds_per_pair"] > 0
    plan = aligner(a, wrong)
    plan.SetFinishedPairs(known)
    plan.DryRunOn()
    plan.Update()
    told = json.loads(plan.GetPlan())
    assert told["pairs"] == [[0, 1]] and told["pairs_finished_before"] == 1
    assert told["seconds_per_pair"] == 0 and told["seconds"] < anew["seconds_per_pair"], "what is left is to outline the volumes"
    assert np.array_equal(geometry(plan.GetOutput().GetBlock(1)), before) and plan.GetReport() == ""
    other = vtkImageData()
    other.DeepCopy(wrong)
    other.GetPointData().GetArray("Intensity").SetComponent(5000, 0, 77)
    assert again(a, other)[1]["pairs_finished_before"] == 0, "one voxel is another"
    other.DeepCopy(wrong)
    other.GetPointData().GetArray("ValidRegion").SetComponent(5000, 0, 0)
    assert again(a, other)[1]["pairs_finished_before"] == 0, "one voxel is not real"
    assert again(a, knocked(wrong, np.array([[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])))[1]["pairs_finished_before"] == 0
    assert again(a, wrong)[1]["pairs_finished_before"] == 1

# 2. composite input keeps its names; the fixed volume can be another one
blocks = vtkMultiBlockDataSet()
blocks.SetBlock(0, wrong)
blocks.SetBlock(1, a)
blocks.GetMetaData(0).Set(blocks.NAME(), "left")
blocks.GetMetaData(1).Set(blocks.NAME(), "right")
tree = aligner()
tree.SetInputDataObject(blocks)
tree.SetFixedVolume(1)
tree.Update()
assert [tree.GetOutput().GetMetaData(i).Get(blocks.NAME()) for i in range(2)] == ["left", "right"]
assert np.array_equal(geometry(tree.GetOutput().GetBlock(1)), geometry(a))
assert np.allclose(geometry(tree.GetOutput().GetBlock(0)), geometry(output.GetBlock(1)))

# 3. every rank is handed the whole: a request for piece 1 of 2 gives what piece 0 gives
piece = aligner()
producers = []
for image in (a, wrong):
    producers.append(vtkTrivialProducer())
    producers[-1].SetOutput(image)
    piece.AddInputConnection(0, producers[-1].GetOutputPort())
piece.UpdatePiece(1, 2, 0)
assert piece.GetOutput().GetNumberOfBlocks() == 2
for i in range(2):
    assert piece.GetOutput().GetBlock(i).GetDimensions() == (44, 40, 36)
    assert np.array_equal(geometry(piece.GetOutput().GetBlock(i)), geometry(output.GetBlock(i)))

# 4. errors: a sentence, an empty output, and a filter that works again afterwards
assert "two volumes are needed" in errors_of(aligner(a))
constant = vtkImageData()
constant.DeepCopy(b)
constant.GetPointData().GetArray("Intensity").Fill(9)
failed = aligner(a, constant)
assert "volume 2: it is constant" in errors_of(failed)
assert failed.GetOutput().GetNumberOfBlocks() == 0 and failed.GetNumberOfVolumes() == 0
greedy = aligner(a, wrong)
greedy.SetMinimumOverlap(0.98)
assert errors_of(greedy) == "" and greedy.GetVerdict(1) == "failed" and greedy.GetReason(1)
assert np.array_equal(geometry(greedy.GetOutput().GetBlock(1)), geometry(wrong)), "a volume that fails stays where it was"
strict = aligner(a, wrong)  # its pose is found, and then refused
strict.SetMinimumSimilarity(1)
assert errors_of(strict) == "" and strict.GetVerdict(1) == "failed" and "more similar" in strict.GetReason(1)
assert np.array_equal(geometry(strict.GetOutput().GetBlock(1)), geometry(wrong)), "a volume that fails stays where it was"
none = aligner(a, wrong)
none.SetFixedVolume(2)
assert "fixed volume must be one of the 2" in errors_of(none)
none.SetFixedVolume(0)
none.Update()
assert none.GetNumberOfVolumes() == 2

# 5. parameters by name
named = vtkUltrasoundAligner()
assert (named.GetStart(), named.GetMetric()) == ("automatic", "local-ncc")
assert named.SetParameter("Candidates", 5) and named.GetCandidates() == 5
assert named.SetParameter("UseReliability", 0) and not named.GetUseReliability()
assert named.SetParameter("MinimumOverlap", 0.25) and named.GetMinimumOverlap() == 0.25
assert named.SetParameterAsText("Metric", "mad") and named.GetMetric() == "mad"
named.SetMetric("local-ncc")
for name, value, expected in (("Candidates", 2.5, "whole number"), ("Metric", 5, "lc2"), ("Colour", 1.0, "MinimumPeakRatio")):
    messages = []
    note = lambda caller, event, text: messages.append(text)
    note.CallDataType = "string0"
    tag = named.AddObserver(vtkCommand.ErrorEvent, note)
    assert not named.SetParameter(name, value)
    named.RemoveObserver(tag)
    assert expected in messages[0], messages
assert named.GetMinimumOverlap() == 0.25 and named.GetCandidates() == 5
messages = []
named.AddObserver(vtkCommand.ErrorEvent, note)
named.SetStart("nowhere")
assert "nowhere" in messages[0] and "hand-made" in messages[0]
named.SetMetric("banana")
assert "banana" in messages[1] and "mind-ssc" in messages[1] and "mad" in messages[1]
assert (named.GetStart(), named.GetMetric()) == ("automatic", "local-ncc") and len(messages) == 2

out_of_range = aligner(a, wrong)
for name, value, expected in (("MinimumOverlap", 2.0, "[0.01, 1]"), ("Candidates", 0, "[1, 1000]"), ("Points", 99, "[100, 10000000]"),
                              ("FinestMm", float("nan"), "FinestMm"), ("FixedVolume", -1, "at least 0")):
    was = out_of_range.GetParameter(name)
    out_of_range.SetParameter(name, value)
    assert f"{name} is" in (said := errors_of(out_of_range)) and expected in said, said
    assert out_of_range.GetNumberOfVolumes() == 0
    out_of_range.SetParameter(name, was)

# 6. abort: no output, and the filter itself reports no error
stopped = aligner(a, wrong)
stopped.AddObserver(vtkCommand.ProgressEvent, lambda caller, event: caller.AbortExecuteOn())
messages = []
stopped.AddObserver(vtkCommand.ErrorEvent, note)
stopped.GetExecutive().AddObserver(vtkCommand.ErrorEvent, lambda caller, event: None)
stopped.Update()
assert not messages, messages
assert stopped.GetNumberOfVolumes() == 0 and stopped.GetOutput().GetNumberOfBlocks() == 0


# 7. the method that needs no start: what it says of each volume, and the report
sure = vtkUltrasoundAligner()
assert not sure.GetAllAligned() and sure.GetReport() == "" and sure.GetVerdict(0) == ""
sure.SetStart("tracked")
sure.SetPoints(20000)
for image in (a, wrong):
    sure.AddInputDataObject(0, image)
sure.Update()
assert np.abs(geometry(sure.GetOutput().GetBlock(1)) - geometry(b)).max() < 0.5
assert [sure.GetVerdict(i) for i in range(3)] == ["aligned", "aligned", ""] and sure.GetReason(1) == "" and sure.GetAllAligned()
fields = sure.GetOutput().GetBlock(1).GetFieldData()
assert fields.GetAbstractArray("AlignmentVerdict").GetValue(0) == "aligned" and fields.GetAbstractArray("AlignmentReason").GetValue(0) == ""
assert fields.GetArray("AlignmentSimilarity").GetValue(0) == sure.GetSimilarity(1) > 0.5
covariance = np.array(fields.GetArray("AlignmentCovariance").GetTuple(0)).reshape(6, 6)
assert np.allclose(covariance, covariance.T) and np.linalg.eigvalsh(covariance).min() > 0
sd = np.sqrt(np.diag(covariance))
assert sd[:3].max() < 1.0 and sd[3:].max() < 0.05, sd  # its inverse would be far above
assert fields.GetArray("AlignmentCentre").GetNumberOfComponents() == 3
middles = [(geometry(sure.GetOutput().GetBlock(i)) @ [43, 39, 35, 1])[:3] for i in (0, 1)]
assert np.linalg.norm(fields.GetArray("AlignmentCentre").GetTuple3(0) - np.mean(middles, axis=0)) < 10
report = json.loads(sure.GetReport())
assert len(report["volumes"]) == 2 and len(report["pairs"]) == 1
assert report["pairs"][0]["verdict"] == "aligned" and not report["pairs"][0]["voted_down"]
forward = np.linalg.inv(geometry(sure.GetOutput().GetBlock(0))) @ geometry(sure.GetOutput().GetBlock(1))
sure.SetFixedVolume(1)  # the other way round is the inverse motion, within a tenth of a voxel
sure.Update()
swapped = np.linalg.inv(geometry(sure.GetOutput().GetBlock(0))) @ geometry(wrong)
corners = np.array([[i, j, k, 1.0] for i in (0, 86) for j in (0, 78) for k in (0, 70)]).T
assert np.linalg.norm(((swapped - forward) @ corners)[:3], axis=0).mean() < 0.2, "voxels of 2 mm"


# 8. landmarks: they bring a volume back from far away, wherever it was; wrong ones yield no answer
far = [[-1, 0, 0, 300], [0, -1, 0, -100], [0, 0, 1, 50], [0, 0, 0, 1]]
lost = knocked(b, far)
marked = aligner(a, lost)
marked.SetStart("automatic")
places = np.array([[20.0, 40, 30], [45, 60, 20], [30, 70, 50]])
for number, place in enumerate(places):
    marked.AddLandmark(0, str(number), *place)
    marked.AddLandmark(1, str(number), *(np.array(far) @ [*place, 1])[:3])
marked.Update()
assert marked.GetVerdict(1) == "aligned", marked.GetReason(1)
assert np.allclose(geometry(marked.GetOutput().GetBlock(1)), geometry(b), atol=0.3)
assert not json.loads(marked.GetReport())["pairs"][0]["anywhere"], "landmarks say where to look"
marked.AddLandmark(0, "wrong", 0, 0, 0)
marked.AddLandmark(1, "wrong", 0, 0, 0)
marked.Update()
assert marked.GetVerdict(1) == "failed" and "contradict each other" in marked.GetReason(1)
marked.AddLandmark(2, "beyond", 0, 0, 0)
assert "landmarks of volume 2" in errors_of(marked)
marked.ClearLandmarks()


# 9. the score
def score(aligned, truth):
    filter = vtkUltrasoundAlignmentScore()
    filter.SetPoints(500)
    for image in aligned:
        filter.AddInputDataObject(0, image)
    for image in truth:
        filter.AddTruthData(image)
    return filter


shift = knocked(b, [[1, 0, 0, 2], [0, 1, 0, -1], [0, 0, 1, 2], [0, 0, 0, 1]])
measured = score([a, shift], [a, b])
measured.Update()
points = measured.GetOutput()
assert abs(measured.GetScore() - 3.0) < 1e-12 and measured.GetVolumeScore(0) < 1e-12 and measured.GetNumberOfVolumes() == 2
assert points.GetNumberOfPoints() == points.GetNumberOfVerts() == 1000
vectors = points.GetPointData().GetVectors()
assert vectors.GetName() == "Error" and np.allclose(vectors.GetTuple3(700), (2, -1, 2))
assert points.GetPointData().GetArray("Volume").GetValue(700) == 1
assert abs(points.GetFieldData().GetArray("Score").GetValue(0) - 3.0) < 1e-12
assert abs(points.GetFieldData().GetArray("VolumeMax").GetValue(1) - 3.0) < 1e-12
inverse = np.linalg.inv(geometry(shift) @ np.diag([2, 2, 2, 1]))
for p in range(500, 1000, 37):  # of the valid region only: two slices are not real
    assert (inverse @ np.array([*points.GetPoint(p), 1]))[2] > 1.4
both = score([output], [blocks])
both.RemoveAllInputConnections(1)
both.AddTruthData(a)
both.AddTruthData(b)
both.Update()
assert both.GetScore() < 0.05, both.GetScore()

assert "1 aligned volumes and 2 true ones" in errors_of(score([a], [a, b]))
small = volume((0, 0, 0), dims=(43, 40, 36))
bad = score([a, b], [a, small])
assert "dimensions" in errors_of(bad) and math.isnan(bad.GetScore()) and bad.GetOutput().GetNumberOfPoints() == 0
