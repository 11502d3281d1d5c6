# SPDX-License-Identifier: BSD-3-Clause
"""SeedsTransformFile.py DIR: named transforms in both formats, whole and wrong in one place, for the fuzzer to
start from."""
import json
import sys
from pathlib import Path

folder = Path(sys.argv[1])
unit = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"
image = "0.08 0 0 -32.8 0 0.07 1e-005 +5 0 .0 0.08 0\n0 0 0 1"


def element(start, end, matrix, more=""):
    return f'<Transform From="{start}" To="{end}" Matrix="{matrix}" {more}/>'


def plus(*elements):
    return ('<?xml version="1.0"?><PlusConfiguration version="2.1"><!-- a --><CoordinateDefinitions>' + "".join(elements)
            + "</CoordinateDefinitions></PlusConfiguration>")


chain = element("Image", "Probe", image, 'Error="1.68" Date="022312_110631"') + element("Probe", "Tracker", unit, 'Status="MISSING"')
rows = [[0.6, -0.8, 0, 1e-5], [0.8, 0.6, 0, -2.5], [0, 0, 1, 3e2], [0, 0, 0, 1]]
edge = {"from": "Probe", "to": "Tracker", "matrix": rows, "status": "OUT_OF_VIEW", "errorMm": 0.5, "date": "today"}
head = {"schema": "echorama-transforms-1", "unit": "mm"}
seeds = {
    "chain.xml": plus(chain),
    "cycle.xml": plus(chain, element("Tracker", "Image", unit)),
    "closed.xml": plus(element("A", "B", unit), element("B", "C", unit), element("A", "C", unit)),
    "fifteen.xml": plus(element("A", "B", unit[2:])),
    "entity.xml": "<!DOCTYPE a [<!ENTITY b '1'>]>" + plus(element("A", "B", "&b;" + unit[1:])),
    "two.json": json.dumps({**head, "transforms": [edge, {"from": "A", "to": "B", "matrix": rows}]}),
    "unit.json": json.dumps({**head, "unit": "m", "transforms": [edge]}),
    "row.json": json.dumps({**head, "transforms": [{**edge, "matrix": rows[:3]}]}),
}
for name, content in seeds.items():
    (folder / name).write_text(content)
