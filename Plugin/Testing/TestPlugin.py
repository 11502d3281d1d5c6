# SPDX-License-Identifier: BSD-3-Clause
"""The plugin loads, every proxy of our XML can be made, explains each property, and has the defaults of its class."""
import os
import pathlib
import sys
import xml.etree.ElementTree as tree

from paraview import servermanager
from paraview.simple import LoadPlugin

sys.path[:0] = os.environ["ECHORAMA_PARAVIEW_PYTHONPATH"].split(":")
import echorama

LoadPlugin(os.environ["ECHORAMA_PLUGIN"], remote=False, ns=globals())
source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
complaints = []
count = 0

for path in sorted(p for room in ("Core", "Readers", "Tracking", "Filters", "Widgets") for p in (source / room).rglob("vtk*.xml")):
    for group in tree.parse(path).getroot().iter("ProxyGroup"):
        for element in group:
            if element.tag not in ("SourceProxy", "UltrasoundSourceProxy", "WriterProxy"):
                continue
            count += 1
            name, label = element.get("name"), element.get("label")
            complain = lambda what: complaints.append(f"{path.name}: {name}: {what}")
            proxy = servermanager.ProxyManager().SMProxyManager.NewProxy(group.get("name"), name)
            if not proxy:
                complain("ParaView cannot make it")
                continue
            if not label:
                complain("no label")
            if not (element.findtext("Documentation") or "").strip():
                complain("no documentation")
            plain = getattr(echorama, element.get("class"))()
            for child in element:
                if not child.tag.endswith("VectorProperty") or child.get("information_only") == "1":
                    continue
                title = child.get("name")
                if child.find("Documentation") is None:
                    complain(f"{title} is not explained")
                command, values = child.get("command", ""), (child.get("default_values") or "").split()
                if child.tag not in ("IntVectorProperty", "DoubleVectorProperty") or not command.startswith("Set"):
                    continue
                getter = getattr(plain, "Get" + command[3:], None)
                if getter is None or not values or values == ["none"]:
                    continue
                got = getter()
                got = list(got) if isinstance(got, (tuple, list)) else [got]
                if any(abs(float(a) - float(b)) > 1e-9 for a, b in zip(got, values)) or len(got) != len(values):
                    complain(f"{title} is {values} here and {got} in the class")

print("\n".join(complaints) or f"{count} proxies made")
if complaints or count == 0:
    sys.exit(1)
