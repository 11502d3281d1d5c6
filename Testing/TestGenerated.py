#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What ./run generate writes is up to date, and describes what the classes then do."""
import json
import os
import pathlib
import subprocess
import sys

import echorama
from vtkmodules.vtkCommonCore import vtkCommand

source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
done = subprocess.run([sys.executable, source / "Plugin/generate_parameters.py", "--check"], capture_output=True, text=True)
assert done.returncode == 0, done.stdout + done.stderr

names = sorted(path.stem for folder in ("Core", "Readers", "Tracking", "Filters", "Widgets") for path in (source / folder).rglob("vtk*.h")
               if "\n  // BEGIN parameters\n" in path.read_text())
assert len(names) > 0
for name in names:
    made = getattr(echorama, name)()
    errors = []
    made.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
    parameters = json.loads(made.GetParameterDescriptions())
    assert len({one["name"] for one in parameters}) == len(parameters), f"{name}: one name twice"
    for one in parameters:
        place = f"{name}.{one['name']}"
        assert one["help"].endswith("."), f"{place}: its help is no sentence"
        get, change = getattr(made, "Get" + one["name"]), getattr(made, "Set" + one["name"])
        assert (list(get()) if one["type"] == "vector" else get()) == one["value"], f"{place}: a default that is not there"
        if one["type"] in ("choice", "name", "text", "switch"):
            choices = one.get("choices", [" "])
            other = {"choice": len(choices) - 1, "name": choices[-1], "text": "something", "switch": not one["value"]}[one["type"]]
        elif one["type"] == "vector":
            other = (0.25, -1.5, 3.0)
        else:
            infinity = float("inf")
            assert one.get("low", -infinity) <= one["value"] <= one.get("high", infinity), f"{place}: a default out of range"
            low = one.get("low", -10.0)
            high = min(one.get("high", infinity), low + 1000.0)
            other = low + (high - low) / 4 if one["type"] == "number" else int(min(max(low + 1, 2), high))
        before = made.GetMTime()
        change(*other) if one["type"] == "vector" else change(other)
        assert get() == other, f"{place}: {get()} after {other} was set"
        assert (made.GetMTime() > before) == (other != one["value"]), f"{place}: modified or not"
        assert made.GetParameterAsText(one["name"]), place
        if "when" in one:
            shown = next((two for two in parameters if two["name"] == one["when"]["name"]), None)
            assert shown, f"{place}: depends on {one['when']['name']}, which is not there"
            values = shown.get("choices", ["off", "on"])
            assert set(one["when"]["values"]) <= set(values), f"{place}: {one['when']}"
    assert not errors, name
    assert not made.SetParameter("Nonsense", 1.0) and errors, f"{name} took a parameter that it does not have"
    text = str(made)
    assert all(f"{one['name']}: " in text for one in parameters), f"{name}: not all is printed"
