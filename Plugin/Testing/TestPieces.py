#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Four MPI ranks, two and one stitch the same volume, each rank its own piece, also when they have aligned it together."""
import pathlib
import subprocess
import tempfile

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLPImageDataReader

script = str(pathlib.Path(__file__).resolve().parent / "stitch_pieces.py")
arrays = ("Intensity", "ValidRegion", "Coverage", "Spread")
results = {}
with tempfile.TemporaryDirectory() as folder:
    for ranks in (1, 2, 4):
        out = pathlib.Path(folder, str(ranks))
        out.mkdir()
        run = subprocess.run(["mpirun", "-np", str(ranks), "pvbatch", script, str(out)], capture_output=True, text=True)
        print(run.stdout, run.stderr)
        assert run.returncode == 0, f"{ranks} rank(s): exit status {run.returncode}"
        assert f"pairs shared by {ranks} ranks" in run.stdout
        for name in ("Split", "Mix", "Aligned"):
            pieces = list(out.rglob(f"{name}*.vti"))
            assert len(pieces) == ranks, pieces  # every rank has made some of it
            reader = vtkXMLPImageDataReader()
            reader.SetFileName(str(out / f"{name}.pvti"))
            reader.Update()
            whole = reader.GetOutput()
            results[ranks, name] = [numpy.array(whole.GetDimensions())]
            results[ranks, name] += [vtk_to_numpy(whole.GetPointData().GetArray(array)).copy() for array in arrays]
            print(ranks, name, whole.GetDimensions(), [piece.stat().st_size for piece in pieces])
for (ranks, name), volume in results.items():
    for array, values, one in zip(("dimensions", *arrays), volume, results[1, name]):
        assert values.shape == one.shape and numpy.array_equal(values, one), f"{name}, {array}: {ranks} ranks are not one"
        assert len(set(one)) > 1, array
print("1, 2 and 4 ranks agree in every voxel")
