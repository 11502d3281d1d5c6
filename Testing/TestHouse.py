#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The rules of the house that a compiler does not keep: layers, one threading library, and that no filter is half furnished."""
import os
import pathlib
import re
import subprocess
import sys

source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
build = pathlib.Path(os.environ["ECHORAMA_BUILD_DIR"])
rooms = ["Core", "Readers", "Tracking", "Filters", "Widgets"]
complaints = []


def ours(pattern):
    for room in rooms:
        yield from sorted((source / room).rglob(pattern))


def text_of(paths):
    return "\n".join(path.read_text(errors="replace") for path in paths)


for pattern in ("*.h", "*.cxx", "vtk*.cxx", "vtk*.xml", "Testing/*.py", "Testing/*.cxx"):
    if len(list(ours(pattern))) < 10:
        complaints.append(f"there is hardly any {pattern} to look at in {source}")
for path in [*ours("*.h"), *ours("*.cxx")]:
    name = path.relative_to(source)
    text = path.read_text()
    if "SPDX-License-Identifier: BSD-3-Clause" not in text[:200]:
        complaints.append(f"{name}: no licence line")
    if path.parent.name in ("Testing", "Benchmarks", "Fuzzing"):
        continue
    if not path.name.startswith("vtk") and re.search(r'#include [<"]vtk', text):
        complaints.append(f"{name}: a kernel includes VTK")
    if re.search(r"#include <(tbb|oneapi|thread>|omp)", text) and str(name) not in ("Core/Base/Parallel.cxx", "Core/Base/Worker.cxx"):
        complaints.append(f"{name}: names a threading library; use Core/Base/Parallel.h, or Worker.h to wait for a device")
    if re.search(r"\b(mt19937|std::rand|srand|random_device)\b", text):
        complaints.append(f"{name}: randomness that is not Core/Base/Random.h")

libraries = sorted((build / "lib").glob("libEchorama*Kernels.so"))
if not libraries:
    complaints.append("there are no kernel libraries to look at")
for library in libraries:
    needed = subprocess.run(["readelf", "-d", library], capture_output=True, text=True, check=True).stdout
    if "libvtk" in needed:
        complaints.append(f"{library.name}: kernels link VTK")

tests = text_of([*ours("Testing/*.py"), *ours("Testing/*.cxx"), *sorted((source / "Testing").glob("*.py"))])
pages = text_of(sorted((source / "Documentation").rglob("*.md")))
for path in ours("vtk*.cxx"):
    header = path.with_suffix(".h").read_text()
    name = path.stem
    if "vtkStandardNewMacro" not in path.read_text() or not re.search(rf"class \w+ {name} : public vtk\w*(Algorithm|Writer)\b", header):
        continue
    if not path.with_suffix(".xml").exists():
        complaints.append(f"{name}: no ParaView XML beside it")
    called = [name, *re.findall(rf"\b{name} as (\w+)", tests)]
    if not re.search(rf"\b({'|'.join(called)})\(\)|vtkNew<{name}>", tests):
        complaints.append(f"{name}: no test makes one")
    if name not in pages:
        complaints.append(f"{name}: no page of Documentation names it")

# ParaView's Python calls a property by its label, without what is not a letter or digit: "Spacing (mm)" would be Spacingmm.
for path in ours("vtk*.xml"):
    for tag in re.findall(r"<\w+Property\b[^>]*>", path.read_text()):
        name, label = re.search(r'\bname="(\w+)"', tag), re.search(r'\blabel="([^"]*)"', tag)
        if label and re.sub(r"\W", "", label[1]) != name[1]:
            complaints.append(f"{path.name}: scripts would not find {name[1]} under the label {label[1]}")
        # ParaView 5.13 opens a window of errors otherwise, also for what is only shown.
        count, default = re.search(r'number_of_elements="(\d+)"', tag), re.search(r'default_values="([^"]*)"', tag)
        if re.match(r"<(Int|Double|IdType)", tag) and count and len(default[1].split() if default else ()) != int(count[1]):
            complaints.append(f"{path.name}: {name[1]} has no default_values, or not {count[1]}")

print("\n".join(complaints) or "the house is in order")
sys.exit(1 if complaints else 0)
