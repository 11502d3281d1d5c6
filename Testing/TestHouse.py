#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The rules of the house that a compiler does not keep: layers, who may use whom, sizes, one threading library, and that no filter
is half furnished."""
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
    threading = ("Core/Base/Parallel.cxx", "Core/Base/Worker.cxx", "Core/Sharing/SideBySide.cxx")
    if re.search(r"#include <(tbb|oneapi|thread>|omp)", text) and str(name) not in threading:
        complaints.append(f"{name}: names a threading library; use Core/Base/Parallel.h, SideBySide.h for long tasks, or Worker.h to wait for a device")
    if re.search(r"\b(mt19937|std::rand|srand|random_device)\b", text):
        complaints.append(f"{name}: randomness that is not Core/Base/Random.h")

# Who may use whom: the table of Documentation/house.md, of lines | `room` | `used` `used` | what it holds |.
house = (source / "Documentation" / "house.md").read_text()
uses = {room: re.findall(r"`([\w/]+)`", used) for room, used in re.findall(r"^\| `([\w/]+)` \| ((?:`[\w/]+` ?)*|all )\|", house, re.M)}
built = re.search(r"set\(ECHORAMA_ROOMS (Core [^)]*)\)", (source / "CMakeLists.txt").read_text())[1].split()
above = []
for room, used in uses.items():
    complaints += [f"house.md: {room} uses {other}, which is not above it in the table" for other in used if other not in above]
    above.append(room)
for room in built:
    if room not in uses:
        complaints.append(f"house.md: {room} is not in the table of who may use whom")
for place in re.findall(r"`([\w/]+/[\w./]*)`", house):
    if not (source / place).exists() and place not in ("Testing/", "Benchmarks/", "Fuzzing/"):
        complaints.append(f"house.md: there is no {place}")


def room_of(path):  # rooms may lie in rooms: Tracking/Optical is none of Tracking's
    inner = "/".join(path.parts[:2])
    return inner if path.parts[0] == "Filters" or inner in built else path.parts[0]


def check_use(file, room, used):
    if used != room and used not in uses[room]:
        complaints.append(f"{file}: {room} may not use {used}; Documentation/house.md says who may")


classes = {path.name: room_of(path.relative_to(source)) for path in ours("vtk*.h")}
for room in [room for room in built if room in uses]:
    for path in [*sorted((source / room).rglob("*.h")), *sorted((source / room).rglob("*.cxx"))]:
        name = path.relative_to(source)
        if room_of(name) != room:
            continue
        for include in re.findall(r'^#include "([^"]+)"', path.read_text(), re.M) if path.parent.name != "Benchmarks" else ():
            parts = pathlib.PurePath(include)
            if include in classes or parts.parts[0] in (*rooms, "Applications", "Plugin"):
                check_use(name, room, classes.get(include) or room_of(parts))
    named = {other.replace("/", ""): other for other in built}
    for file in ("vtk.module", "CMakeLists.txt"):
        if file == "vtk.module" and not (source / room / file).exists():  # kernels alone
            continue
        text = re.sub(r"BENCHMARK_DEPENDS[^)\n]*", "", (source / room / file).read_text())
        for other in re.findall(rf"\b(?:Echorama::)?({'|'.join(named)})(?:Kernels)?\b", text):
            check_use(f"{room}/{file}", room, named[other])

# A build of some rooms has what their kernels link: run builds such a one, for any CPU.
for some in re.findall(r'-DECHORAMA_ROOMS="([^"]*)"', (source / "run").read_text()):
    for room in some.split(";"):
        linked = re.search(r"KERNEL_DEPENDS ([\w ]*)", (source / room / "CMakeLists.txt").read_text())
        for other in linked[1].split() if linked else ():
            if named[other] not in some.split(";"):
                complaints.append(f"run: it builds {room} without {named[other]}, which its kernels link")

# Sizes. What is too large as yet; whoever mends one takes it off the list.
too_large = set()
GENERATED = re.compile(r"(?<=// BEGIN parameters\n).*?(?=  // END parameters\n)", re.S)  # nobody reads or writes these
lines, limits = dict.fromkeys(built, 0), dict.fromkeys(built, 12000)
for path in [*ours("*.h"), *ours("*.cxx")]:
    name = path.relative_to(source)
    if path.parent.name in ("Testing", "Benchmarks", "Fuzzing") or room_of(name) not in built:
        continue
    lines[str(name)] = GENERATED.sub("", path.read_text()).count("\n")
    lines[room_of(name)] += lines[str(name)]
    if not path.name.startswith("vtk"):
        limits[str(name)] = 700
    if name.parts[0] == "Widgets" and path.suffix == ".cxx":
        limits[str(name)] = 600
for name, limit in limits.items():
    if lines[name] > limit and name not in too_large:
        complaints.append(f"{name}: {lines[name]} lines; no more than {limit} of one idea")
for name in sorted(too_large):
    if lines.get(name, 0) <= limits.get(name, 0):
        complaints.append(f"{name}: it is not too large any more; take it off the list in {pathlib.Path(__file__).name}")

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
