#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""THIRD_PARTY.md names all that is linked to our libraries and programs, and whose headers were compiled into any object.

Packages are compared by their source package without the version at its end, which is the same for a library and its headers,
and in every release of Debian."""
import os
import pathlib
import re
import subprocess
import sys

source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
build = pathlib.Path(os.environ["ECHORAMA_BUILD_DIR"])
complaints = []


def run(*command):
    return subprocess.run(command, capture_output=True, text=True).stdout


def stems(packages):
    """The source of each installed package, by package: libceres3 -> ceres-solver, libboost1.74-dev -> boost."""
    lines = run("dpkg-query", "-W", "-f", "${binary:Package} ${source:Package}\n", *packages).split("\n")
    return {line.split()[0].split(":")[0]: re.sub(r"[-\d.]*(-defaults)?$", "", line.split()[1]) for line in lines if " " in line}


def owners(paths):
    """The packages that files belong to. A file in /lib may be registered below /usr/lib, and the other way round."""
    packages = set()
    names = {name for path in paths for name in (path, os.path.realpath(path))}
    names |= {name[4:] if name.startswith("/usr/lib") else "/usr" + name for name in names if "/lib" in name[:8]}
    names = sorted(names)
    for first in range(0, len(names), 1000):
        packages |= {line.split(":")[0].split(",")[0] for line in run("dpkg", "-S", *names[first : first + 1000]).splitlines()}
    return packages


if not pathlib.Path("/usr/bin/dpkg-query").exists():
    print("skipped: this is not Debian")
    sys.exit(77)

binaries = [path for folder in ("lib", "bin", "python3") for path in (build / folder).rglob("*") if path.is_file() and not path.is_symlink()]
linked, found = set(), {}
for path in binaries:
    with path.open("rb") as file:
        if file.read(4) != b"\x7fELF":
            continue
    linked |= set(re.findall(r"NEEDED.*\[(.+)\]", run("readelf", "-d", str(path))))
    found.update(re.findall(r"(\S+) => (/\S+)", run("ldd", str(path))))
libraries = {found[name] for name in linked if name in found and not found[name].startswith(str(build))}

# What objects and precompiled headers were compiled from; ninja knows too what programs were linked from, and what CMake read.
depended = "\n".join(each for each in run("ninja", "-C", str(build), "-t", "deps").split("\n\n") if re.match(r"\S+\.(o|gch): ", each))
headers = {os.path.normpath(path) for path in re.findall(r"^    (/usr/\S+)", depended, re.MULTILINE)}
if not libraries or not headers:
    complaints.append(f"{build} tells of no libraries or no headers: was it built with ninja?")

page = (source / "THIRD_PARTY.md").read_text()
named = set(re.findall(r"`([a-z0-9][a-z0-9+.-]+)`", "\n".join(line for line in page.splitlines() if line.startswith("| "))))
known = set(stems(named).values())
for how, paths in ("is linked", libraries), ("is compiled in", headers):
    for package, stem in sorted(stems(owners(paths)).items()):
        if stem not in known:
            complaints.append(f"THIRD_PARTY.md does not name {package}, which {how} (source package {stem})")

# Whoever installs by packages.txt has what the page names, directly or by what depends on it, and no library is left over.
listed = {line.split()[0] for line in (source / "packages.txt").read_text().splitlines() if line and line[0] not in "#["}
development = {package for package in listed if re.fullmatch(r"(lib.*|.*json.*|.*base\d?)-dev|zlib1g-dev", package)} & set(stems(listed))
for package, stem in sorted(stems(development).items()):
    if stem not in known and not package.startswith("libclang-rt"):
        complaints.append(f"THIRD_PARTY.md does not name {package} of packages.txt")

print("\n".join(complaints) or f"{len(libraries)} libraries and {len(headers)} headers of others, of packages that THIRD_PARTY.md names")
sys.exit(1 if complaints else 0)
