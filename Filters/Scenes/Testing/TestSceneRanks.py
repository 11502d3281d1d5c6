#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundSceneSource on 1, 2, 4 and 8 MPI ranks: the same volumes, beams and truth to the last bit, an alignment of them, and one rank
that fails ends all with its message."""
import hashlib
import json
import shutil
import unittest

import mpi_ranks
from echorama import vtkUltrasoundAligner, vtkUltrasoundSceneSource
from TestUltrasoundSceneSource import SCENE as ONE_RANK_SCENE
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet
from vtkmodules.vtkCommonMath import vtkMatrix4x4

SCENE = {**ONE_RANK_SCENE, "views": {"poses": [{"face": [x, 0, 7], "target": [x / 3, 1, 50]} for x in (-6, 0, 6)]}}


@unittest.skipUnless(shutil.which("mpiexec"), "mpiexec is not installed")
class Ranks(unittest.TestCase):
    def test_same_as_one_rank(self):
        one = mpi_ranks.told(self, __file__, ["pressed", "resting"], 1)[0]
        self.assertNotEqual(one["pressed"]["made"], one["resting"]["made"])
        self.assertGreater(one["pressed"]["arrays"], 30)
        for ranks, cases in ((2, ["pressed", "resting"]), (4, ["resting"]), (8, ["resting"])):
            for rank in mpi_ranks.told(self, __file__, cases, ranks):
                for case, told in rank.items():
                    self.assertEqual((told["ranks"], told["errors"]), (ranks, []))
                    for key in ("made", "poses", "report", "notes", "arrays"):
                        self.assertEqual(told[key], one[case][key], f"{case}: {key} on {ranks} ranks")
                    self.assertGreater(told["messages"], 0)

    def test_one_view_and_what_comes_after(self):
        one = mpi_ranks.told(self, __file__, ["one view", "aligned"], 1)[0]
        self.assertEqual(one["aligned"]["volumes"], 3)
        for told in mpi_ranks.told(self, __file__, ["one view", "aligned"], 2):
            self.assertEqual(told["one view"]["made"], one["one view"]["made"])
            self.assertEqual(told["aligned"], one["aligned"])

    def test_a_rank_that_fails_ends_all(self):
        for told in mpi_ranks.told(self, __file__, ["bad file", "stop", "resting"], 2):
            self.assertEqual(told["bad file"]["views"], 0)
            self.assertEqual(len(told["bad file"]["errors"]), 1)
            self.assertRegex(told["bad file"]["errors"][0], r"rank 1: .*nowhere\.json")
            self.assertLess(told["bad file"]["progress"], 0.2)  # heard of before any view was made
            self.assertEqual((told["stop"]["views"], told["stop"]["errors"]), (0, []))
            self.assertEqual(told["resting"]["views"], 3)
            self.assertGreater(told["resting"]["progress"], 0.2)


def digest_of(data, digest):
    """Every array of all blocks, by name, which of them are active, and where images are. Returns how many arrays there were."""
    if data.IsA("vtkMultiBlockDataSet"):
        count = 0
        for n in range(data.GetNumberOfBlocks()):
            digest.update(data.GetMetaData(n).Get(vtkCompositeDataSet.NAME()).encode())
            count += digest_of(data.GetBlock(n), digest)
        return count
    digest.update(data.GetClassName().encode())
    if data.IsA("vtkImageData"):
        direction = data.GetDirectionMatrix()
        numbers = [*data.GetOrigin(), *data.GetSpacing(), *(direction.GetElement(r, c) for r in range(3) for c in range(3))]
        digest.update(repr((data.GetExtent(), [float(number).hex() for number in numbers])).encode())
    for attributes in (data.GetPointData(), data.GetCellData()):
        active = [attributes.GetAbstractAttribute(kind) for kind in range(attributes.NUM_ATTRIBUTES)]
        digest.update(repr([array.GetName() if array else None for array in active]).encode())
    count = 0
    for attributes in (data.GetPointData(), data.GetCellData(), data.GetFieldData()):
        for name in sorted(attributes.GetArrayName(n) for n in range(attributes.GetNumberOfArrays())):
            array = attributes.GetAbstractArray(name)
            components = [array.GetComponentName(n) for n in range(array.GetNumberOfComponents())]
            digest.update(f"{name} {array.GetDataType()} {components}".encode())
            if array.IsA("vtkStringArray"):
                digest.update(repr([array.GetValue(n) for n in range(array.GetNumberOfValues())]).encode())
            else:
                digest.update(vtk_to_numpy(array).tobytes())
            count += 1
    if data.IsA("vtkPolyData"):
        digest.update(vtk_to_numpy(data.GetPoints().GetData()).tobytes())
        for cells in (data.GetVerts(), data.GetPolys()):
            digest.update(repr([*vtk_to_numpy(cells.GetConnectivityArray()), *vtk_to_numpy(cells.GetOffsetsArray())]).encode())
    return count


def make(case, rank):
    source = vtkUltrasoundSceneSource()
    scene = dict(SCENE) if case != "resting" else {key: value for key, value in SCENE.items() if key != "press"}
    if case == "bad file" and rank == 1:
        source.SetFileName("nowhere.json")
    else:
        source.SetScene(json.dumps(scene))
    source.SetLandmarks(12)
    if case == "one view":
        source.SetView(2)
    errors, progress = mpi_ranks.errors_of(source), [0.0]  # VTK says 1 at the end, also of what has failed
    source.AddObserver("ProgressEvent", lambda caller, event: progress.append(caller.GetProgress()))
    if case == "stop" and rank == 0:
        source.AddObserver("ProgressEvent", lambda caller, event: caller.SetAbortExecute(caller.GetProgress() > 0.3))
    if case == "aligned":
        aligner = vtkUltrasoundAligner()
        aligner.SetInputConnection(source.GetOutputPort())
        aligner.SetStart("tracked")
        aligner.SetPoints(5000)
        aligner.Update()
        digest = hashlib.sha256()
        digest_of(aligner.GetOutput(), digest)
        return {"made": digest.hexdigest(), "volumes": aligner.GetNumberOfVolumes()}
    source.Update()
    report = json.loads(source.GetReport())
    told = {"errors": errors, "views": source.GetOutputDataObject(0).GetNumberOfBlocks(), "messages": report["messages"],
            "progress": max(part for part in progress if part < 1), "ranks": report["ranks"], "notes": source.GetNotes()}
    if told["views"]:
        digest = hashlib.sha256()
        told["arrays"] = sum(digest_of(source.GetOutputDataObject(port), digest) for port in range(4))
        told["made"] = digest.hexdigest()
        told["report"] = [{key: value for key, value in view["cost"].items() if not key.endswith("seconds")} |
                          {part: {key: value for key, value in view[part].items() if key != "seconds"} for part in ("press",) if part in view}
                          for view in report["volumes"]]
        told["poses"] = []
        for view in range(1, told["views"] + 1):
            pose = vtkMatrix4x4()
            if source.GetVolumeToWorld(view, pose):
                told["poses"].append([pose.GetElement(r, c) for r in range(4) for c in range(4)])
    return told


if mpi_ranks.is_rank():
    mpi_ranks.tell(make)
if __name__ == "__main__":
    unittest.main()
