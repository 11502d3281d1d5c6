# SPDX-License-Identifier: BSD-3-Clause
"""Runs Examples/paraview/stitch_phantom.py as a user would."""
import os
import pathlib
import runpy
import sys
import tempfile

script = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"]) / "Examples" / "paraview" / "stitch_phantom.py"
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    sys.argv = [str(script), os.environ["ECHORAMA_PLUGIN"]]
    names = runpy.run_path(str(script))
    assert pathlib.Path("stitched.vti").stat().st_size > 10_000
    assert pathlib.Path("stitched.png").stat().st_size > 5_000
    # Each volume was slid out of place by whole millimetres; the last two must have come back.
    for index, knock in ((1, (5, -4, 3)), (2, (-4, 5, 2))):
        centre = lambda image: [sum(image.GetBounds()[2 * axis : 2 * axis + 2]) / 2 for axis in range(3)]
        before = centre(names["servermanager"].Fetch(names["volumes"][index]))
        after = centre(names["blocks"].GetBlock(index))
        assert all(abs(b + mm - a) < 1.5 for a, b, mm in zip(before, after, knock)), (before, after, knock)
    os.chdir("/")
