#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundAligner on 1, 2, 4 and 8 MPI ranks: the same poses to the last bit, bytes and messages as counted, and one rank that
fails ends all with its message."""
import hashlib
import json
import math
import os
import shutil
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData

import mpi_ranks
from echorama.EchoramaFiltersRegistration import vtkUltrasoundAligner


@unittest.skipUnless(shutil.which("mpiexec"), "mpiexec is not installed")
class Ranks(unittest.TestCase):
    def test_same_as_one_rank(self):
        one = mpi_ranks.told(self, __file__, ["align"], 1)[0]["align"]
        self.assertEqual((one["ranks"], one["messages"], one["message_bytes"]), (1, 0, 0))
        self.assertGreaterEqual(one["verdicts"].count("aligned"), 5)
        for ranks in (2, 4, 8):
            found = [rank["align"] for rank in mpi_ranks.told(self, __file__, ["align"], ranks)]
            for rank in found:
                self.assertEqual(rank["made"], one["made"], f"{ranks} ranks")
                self.assertEqual(rank["ranks"], ranks)
            # Exchanges: the volumes' coarsest resolutions, pairs of each round, what it cost. Two messages to each other rank.
            exchanges = {rank["messages"] / (2 * (ranks - 1)) for rank in found}
            self.assertTrue(len(exchanges) == 1 and exchanges <= {3.0, 4.0}, exchanges)
            # To each other rank: of a pair 65 numbers and a few bytes, of a volume its coarsest resolution.
            told = sum(rank["message_bytes"] for rank in found) / (ranks - 1) - 6 * 28 * 26 * 24 * 4
            self.assertGreater(told, one["tries"] * 8 * 65)
            self.assertLess(told, one["tries"] * 8 * 80 + 6 * 200 + ranks * 500)

    def test_a_rank_that_fails_ends_all(self):
        # One after the other: what failed leaves nothing behind.
        messages = {"bad volume": "rank 1: volume 3: ", "wrong parameter": "the fixed volume must be one of the 6",
                    "other parameter": "the ranks do not work on the same"}
        for told in mpi_ranks.told(self, __file__, [*messages, "stop", "by itself", "align"], 2):
            for case, message in messages.items():
                self.assertEqual(told[case]["volumes"], 0)
                self.assertEqual(len(told[case]["errors"]), 1, told[case])
                self.assertIn(message, told[case]["errors"][0])
                self.assertEqual("rank " in told[case]["errors"][0], case == "bad volume")
            self.assertEqual((told["stop"]["volumes"], told["stop"]["errors"]), (0, []))
            self.assertEqual((told["by itself"]["ranks"], told["by itself"]["messages"]), (1, 0))
            self.assertEqual(told["align"]["ranks"], 2)

    def test_a_rank_that_dies_ends_all(self):
        done, told = mpi_ranks.run(__file__, ["die"], 2)
        self.assertNotEqual(done.returncode, 0)
        self.assertEqual(told, [])


rng = np.random.default_rng(4)
knocks = rng.uniform(-2, 2, (6, 3))
waves = rng.normal(size=(24, 3)) * 0.12
phases = rng.uniform(0, 2 * math.pi, 24)


def volume(origin, knock):
    """What a grid sees of one smooth scene; it is told to lie elsewhere."""
    dims = (28, 26, 24)
    image = vtkImageData()
    image.SetDimensions(dims)
    image.SetSpacing(2, 2, 2)
    image.SetOrigin(np.add(origin, knock))
    k, j, i = np.meshgrid(*[2.0 * np.arange(n) for n in dims[::-1]], indexing="ij")
    scene = (120 + 9 * np.cos((np.stack([i, j, k], -1) + origin) @ waves.T + phases).sum(-1)).clip(1, 254)
    array = numpy_to_vtk(scene.astype(np.uint8).ravel(), deep=True)
    array.SetName("Intensity")
    image.GetPointData().SetScalars(array)
    return image


def align(case, rank):
    aligner = vtkUltrasoundAligner()
    aligner.SetStart("tracked")
    aligner.SetCandidates(4)
    aligner.SetPoints(4000)
    count = 2 if case == "by itself" else 6
    for v in range(count):
        image = volume((14.0 * v, 3.0 * (v % 2), 0.0), (0, 0, 0) if v == 0 else knocks[v])
        if case == "bad volume" and rank == 1 and v == 2:
            image.GetPointData().Initialize()
        aligner.AddInputDataObject(image)
    errors = mpi_ranks.errors_of(aligner)
    if case == "wrong parameter":
        aligner.SetFixedVolume(9)
    if case == "other parameter":
        aligner.SetMinimumSimilarity(0.06 + 0.01 * rank)
    if case == "by itself":
        aligner.SetController(None)
    if case == "stop" and rank == 1:
        aligner.AddObserver("ProgressEvent", lambda caller, event: caller.SetAbortExecute(caller.GetProgress() > 0.3))
    if case == "die" and rank == 1:
        aligner.AddObserver("ProgressEvent", lambda caller, event: caller.GetProgress() < 0.3 or os._exit(3))
    aligner.Update()
    told = {"volumes": aligner.GetNumberOfVolumes(), "errors": errors}
    if told["volumes"]:
        report = json.loads(aligner.GetReport())
        digest = hashlib.sha256()
        output = aligner.GetOutput()
        for v in range(told["volumes"]):
            block = output.GetBlock(v)
            d = block.GetDirectionMatrix()
            digest.update(np.array([*block.GetOrigin(), *(d.GetElement(r, c) for r in range(3) for c in range(3))]).tobytes())
            fields = block.GetFieldData()
            for name in ("VolumeToWorld", "AlignmentSimilarity", "AlignmentCovariance", "AlignmentCentre"):
                digest.update(vtk_to_numpy(fields.GetArray(name)).tobytes())
        for pair in report["pairs"]:
            digest.update(json.dumps({key: value for key, value in pair.items() if key != "seconds"}).encode())
        told.update({key: report[key] for key in ("ranks", "messages", "message_bytes")}, made=digest.hexdigest(),
                    pairs=len(report["pairs"]), tries=sum(pair["attempts"] for pair in report["pairs"]),
                    verdicts=[each["verdict"] for each in report["volumes"]])
    return told


if mpi_ranks.is_rank():
    mpi_ranks.tell(align)
if __name__ == "__main__":
    unittest.main()
