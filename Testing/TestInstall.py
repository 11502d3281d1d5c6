#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a stranger does: install, build a project of their own against the install tree, run it, import the Python package."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
build = pathlib.Path(os.environ["ECHORAMA_BUILD_DIR"])


def run(*command, cwd=None, environment=None):
    """The standard output of a command that must succeed. It sees nothing of the build tree."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("ECHORAMA", "PYTHONPATH", "LD_LIBRARY_PATH"))}
    answer = subprocess.run([str(part) for part in command], cwd=cwd, env={**clean, **(environment or {})},
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if answer.returncode != 0:
        print(answer.stdout)
        sys.exit(f"TestInstall: {' '.join(str(part) for part in command)} ended with status {answer.returncode}")
    return answer.stdout


def check(truth, what):
    if not truth:
        sys.exit(f"TestInstall: {what}")


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    prefix, example = folder / "prefix", folder / "example"
    run("cmake", "--install", build, "--prefix", prefix)
    # Moved after it was installed: nothing in it may know where it was.
    prefix = prefix.rename(folder / "moved prefix")
    shutil.copytree(source / "Examples" / "cpp", folder / "cpp")

    compiler_cache = shutil.which("ccache")
    run("cmake", "-G", "Ninja", "-S", folder / "cpp", "-B", example, f"-DCMAKE_PREFIX_PATH={prefix}",
        *([f"-DCMAKE_CXX_COMPILER_LAUNCHER={compiler_cache}"] if compiler_cache else []))
    run("cmake", "--build", example)

    stitched = run(example / "stitch_volumes", cwd=example)
    check("wrote stitched.vti" in stitched, f"stitch_volumes said {stitched!r}")
    check((example / "stitched.vti").stat().st_size > 10_000, "stitched.vti is too small")
    again = run(example / "stitch_volumes", "stitched.vti", "stitched.vti", cwd=example)
    check("wrote stitched.vti" in again, f"stitch_volumes with files said {again!r}")

    kernels = run(example / "make_phantom")
    check("mean grey" in kernels, f"make_phantom said {kernels!r}")
    needed = run("readelf", "-d", example / "make_phantom")
    check("libvtk" not in needed, "a program that uses the kernels alone links VTK")
    loaded = run("ldd", example / "make_phantom")
    check("libvtk" not in loaded, "the installed kernels load VTK")
    check(str(build) not in loaded + run("ldd", example / "stitch_volumes"), "a library comes from the build tree")

    program = prefix / "bin" / "echorama"
    check("echorama" in run(program, "--version"), "the installed program does not say its version")
    commands = re.findall(r"^  ([a-z][a-z-]*) ", run(program, "--help"), re.MULTILINE)
    check(len(commands) > 10, f"the installed program has the commands {commands}")
    for command in commands:
        check("--threads" in run(program, command, "--help"), f"echorama {command} does not explain itself")
    for end in ("vdb", "mha"):
        run(program, "convert", "stitched.vti", f"stitched.{end}", cwd=example)
    check("OpenVDB" in run(program, "info", "stitched.vdb", cwd=example), "the installed program does not read OpenVDB")
    # What is missing (so it was this one that was loaded, none of the build tree) is named; what does not need it goes on.
    for pattern, words, start in (("libEchoramaCommand-view.so", ("view", "stitched.mha"), "echorama: view: "),
                                  ("libEchoramaReadersOpenVdbKernels.so.*", ("info", "stitched.vdb"), "echorama: stitched.vdb: ")):
        for gone in [*prefix.rglob(pattern)]:
            gone.unlink()
        done = subprocess.run([program, *words], cwd=example, capture_output=True, text=True)
        check(done.returncode == 1 and done.stderr.startswith(start) and gone.name.split(".so")[0] in done.stderr and "install" in done.stderr
              and done.stderr.count("\n") == 1, f"without {pattern} it ends with status {done.returncode} and says {done.stderr!r}")
        check("MetaImage" in run(program, "info", "stitched.mha", cwd=example), f"without {pattern} nothing is read")

    lights = run(prefix / "bin" / "echorama-leds", "--line", "17", "--dry-run")
    check("light 0" in lights, f"echorama-leds said {lights!r}")

    packages = next(prefix.rglob("echorama/__init__.py")).parent.parent
    where = run("/usr/bin/python3", "-c", "import echorama; print(echorama.__file__); echorama.vtkUltrasoundStitcher()",
                environment={"PYTHONPATH": str(packages)})
    check(str(prefix) in where, f"Python imported {where}")

print("installed, moved, built against, run and imported")
