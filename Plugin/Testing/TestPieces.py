#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Four MPI ranks, two and one stitch the same volume, each rank its own piece."""
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
        for texture in ("Split", "Mix"):
            pieces = list(out.rglob(f"{texture}*.vti"))
            assert len(pieces) == ranks, pieces  # every rank has made some of it
            reader = vtkXMLPImageDataReader()
            reader.SetFileName(str(out / f"{texture}.pvti"))
            reader.Update()
            whole = reader.GetOutput()
            results[ranks, texture] = [numpy.array(whole.GetDimensions())]
            results[ranks, texture] += [vtk_to_numpy(whole.GetPointData().GetArray(name)).copy() for name in arrays]
            print(ranks, texture, whole.GetDimensions(), [piece.stat().st_size for piece in pieces])
for (ranks, texture), volume in results.items():
    for name, values, one in zip(("dimensions", *arrays), volume, results[1, texture]):
        assert values.shape == one.shape and numpy.array_equal(values, one), f"{texture}, {name}: {ranks} ranks are not one"
        assert len(set(one)) > 1, name
print("1, 2 and 4 ranks agree in every voxel")
