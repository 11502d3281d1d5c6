#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""How ranks share work: seconds, bytes and messages of one filter on as many ranks as mpiexec starts; the first one prints a line of JSON.

    for n in 1 2 4 8; do mpiexec -n $n --oversubscribe /usr/bin/python3 Testing/Benchmarks/ranks.py align; done

What it makes has a checksum ("made"), the same on any number of ranks. "busy" is the processor time of the filter on the rank that needs
most of it: what a machine with a core for every rank would take, communication left out. Open MPI binds each of up to two ranks to a core of its own, so
that it has one thread; ECHORAMA_THREADS=1 does so for any number.

  align [VOLUMES]        views of a phantom along a line, each overlapping six others (default 20)
  synthesize [VIEWS]     views of an invented abdomen (default 8)
"""
import hashlib
import json
import os
import pathlib
import sys
import time

cores = sorted(os.sched_getaffinity(0))
if os.environ.get("ECHORAMA_THREADS"):
    place = int(os.environ.get("OMPI_COMM_WORLD_LOCAL_RANK", 0)) % len(cores)
    os.sched_setaffinity(0, (cores * 2)[place:place + int(os.environ["ECHORAMA_THREADS"])])  # before any thread begins

import mpi4py.MPI  # begins MPI
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkParallelCore import vtkMultiProcessController
from vtkmodules.vtkParallelMPI import vtkMPIController

from echorama import vtkUltrasoundAligner, vtkUltrasoundAlignmentScore, vtkUltrasoundPhantomSource, vtkUltrasoundSceneSource, vtkUltrasoundVolume
from vtkmodules.vtkCommonTransforms import vtkTransform

controller = vtkMPIController()
controller.Initialize()
vtkMultiProcessController.SetGlobalController(controller)
ranks = controller.GetNumberOfProcesses()


def aligning(count="20"):
    aligner, score = vtkUltrasoundAligner(), vtkUltrasoundAlignmentScore()
    aligner.SetStart("tracked")
    rng = np.random.default_rng(7)
    for v in range(int(count)):
        phantom = vtkUltrasoundPhantomSource()
        phantom.SetSpacingMm(1.5)
        x = 6.0 * (v - 0.5 * (int(count) - 1))
        phantom.SetPosition(x, 0, 0)
        phantom.SetOrientation(0, -x / 7, 0)
        phantom.Update()
        out_of_place = vtkTransform()
        out_of_place.Translate(rng.uniform(-4, 4, 3) if v else (0, 0, 0))
        out_of_place.RotateWXYZ(4 if v else 0, *rng.normal(size=3))
        volume = vtkImageData()
        volume.ShallowCopy(phantom.GetOutput())
        vtkUltrasoundVolume.Move(volume, out_of_place.GetMatrix())
        aligner.AddInputDataObject(volume)
        score.AddTruthData(phantom.GetOutput())
    yield aligner
    score.SetInputConnection(aligner.GetOutputPort())
    score.Update()
    report = json.loads(aligner.GetReport())
    yield {"error": score.GetScore(), "error_unit": "mm", "pairs": sum(pair["attempts"] for pair in report["pairs"]),
           **{key: report[key] for key in ("messages", "message_bytes", "times_prepared")}, "of_which": report["seconds"]}


def synthesizing(views="8"):
    scene = json.loads((pathlib.Path(__file__).parents[2] / "Examples/scenes/anatomy.json").read_text())
    scene["views"] = {"count": int(views), "overlap": 0.8}
    scene["probe"].update(elements=64, sweepSteps=32, samples=256)
    source = vtkUltrasoundSceneSource()
    source.SetScene(json.dumps(scene))
    yield source
    report = json.loads(source.GetReport())
    yield {"views": len(report["volumes"]), **{key: report[key] for key in ("messages", "message_bytes")}}


def checksum(data, digest=None):
    """Of all images: their voxels and where they are."""
    digest = digest or hashlib.sha256()
    for block in range(data.GetNumberOfBlocks()):
        image = data.GetBlock(block)
        direction = image.GetDirectionMatrix()
        digest.update(np.array([*image.GetOrigin(), *image.GetSpacing(), *(direction.GetElement(i // 3, i % 3) for i in range(9))]).tobytes())
        digest.update(vtk_to_numpy(image.GetPointData().GetArray("Intensity")).tobytes())
    return digest.hexdigest()[:16]


what, *arguments = sys.argv[1:]
steps = {"align": aligning, "synthesize": synthesizing}[what](*arguments)
filter = next(steps)
mpi4py.MPI.COMM_WORLD.Barrier()
begin, busy = time.perf_counter(), time.process_time()
filter.Update()
seconds, busy = time.perf_counter() - begin, time.process_time() - busy
told = next(steps)
line = {"bench": "ranks", "case": what, "method": f"{ranks} ranks", "ranks": ranks, "threads": len(os.sched_getaffinity(0)),
        "seconds": seconds, "busy": busy, "made": checksum(filter.GetOutput()), **told}
all_lines = mpi4py.MPI.COMM_WORLD.gather(line)
if controller.GetLocalProcessId() == 0:
    assert len({each["made"] for each in all_lines}) == 1, "the ranks have made different things"
    line["busy_of_ranks"] = [round(each["busy"], 3) for each in all_lines]
    line["seconds"] = max(each["seconds"] for each in all_lines)
    line["busy"] = max(each["busy"] for each in all_lines)
    line["message_bytes"] = sum(each["message_bytes"] for each in all_lines)
    line["messages"] = sum(each["messages"] for each in all_lines)
    print(json.dumps(line), flush=True)
vtkMultiProcessController.SetGlobalController(None)
