# SPDX-License-Identifier: BSD-3-Clause
"""SeedsLandmarkFile.py DIR: lists of landmarks in all formats, whole and wrong in one place, for the fuzzer to start from."""
import json
import sys
from pathlib import Path

folder = Path(sys.argv[1])
point = {"id": "1", "label": "F-1", "position": [1.5, -2e1, 3], "positionStatus": "defined"}
markup = {"type": "Fiducial", "coordinateSystem": "RAS", "coordinateUnits": "mm", "controlPoints": [point, point]}
head = "# Markups fiducial file version = 4.11\n# CoordinateSystem = {}\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc\n"
row = 'n_0,22.3,31.4,-1e1,0,0,0,1,1,1,0,"a, ""b""",,\r\n'
seeds = {
    "two.mrk.json": json.dumps({"@schema": "markups-schema-v1.0.3.json#", "markups": [markup, {**markup, "coordinateSystem": "LPS"}]}),
    "unit.mrk.json": json.dumps({"markups": [{**markup, "coordinateUnits": ["cm", "UCUM", "centimeter"]}]}),
    "short.mrk.json": json.dumps({"markups": [{"controlPoints": [{"position": [1, 2]}]}]}),
    "ras.fcsv": head.format(0) + row * 2,
    "lps.fcsv": head.format("LPS") + row,
    "ijk.fcsv": head.format(2) + row,
    "bare.fcsv": "# Markups fiducial file version = 4.6\n" + row,
    "plain.csv": "a,1,2,3\nb, 4 ,5,6\n",
    "named.csv": "\ufefflabel,r,a,s,defined\n# x\na,1,2,3,1\nb,4,5,6,0\n",
    "open.csv": 'label,x,y,z\n"a,1,2,3\n',
}
for name, content in seeds.items():
    (folder / name).write_text(content, encoding="utf-8")
