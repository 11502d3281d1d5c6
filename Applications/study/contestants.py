# SPDX-License-Identifier: BSD-3-Clause
"""Who aligns: the program echorama with one set of options or another, the search of the dissertation, elastix where it is installed, and
programs of the user's.

Each gets a case and a start and answers with the second volume's motion as seen from the first, from where their files stand.
"""
import dataclasses
import json
import pathlib
import re
import resource
import shlex
import shutil
import subprocess
import tempfile
import time

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

import echorama
from geometry import matrix_of, read_poses, rotation


@dataclasses.dataclass
class Answer:
    motion: np.ndarray
    seconds: float
    cpu_seconds: float = 0.0  # of all its threads, reading and writing included; other work on the machine does not count
    verdict: str = ""  # aligned, ambiguous or failed; empty: the method gives none
    reason: str = ""
    predicted_mm: float = float("nan")  # root mean square over the second volume, as the method states it


class Failed(Exception):
    """A contestant gave no answer; says why."""


def cpu_seconds():
    """Of all programs that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run_program(arguments, seconds):
    try:
        return subprocess.run([str(argument) for argument in arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, timeout=seconds)
    except subprocess.TimeoutExpired as problem:
        raise Failed(f"no answer within {seconds:g} s") from problem
    except OSError as problem:
        raise Failed(f"{arguments[0]} does not start: {problem.strerror}") from problem


class Echorama:
    """`echorama align` with some options. The time is that of its stage "align": reading and writing do not count."""

    def __init__(self, program, options=()):
        self.program, self.options = program, list(options)

    def align(self, case, start, limit):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "poses.json"
            begin = ["--poses", start.path] if start.path else []
            before = cpu_seconds()
            done = run_program([self.program, "align", *case.files, *begin, "-o", out, "--json", *self.options], limit)
            try:
                said = json.loads(done.stdout)
            except ValueError as problem:
                raise Failed(done.stderr.strip()[-300:] or f"it ended with status {done.returncode}") from problem
            if "error" in said or not out.exists():
                raise Failed(said.get("error", "it wrote no poses"))
            second = said["volumes"][1]
            (_, first), (_, moved) = read_poses(out)
            seconds = stage_seconds(said.get("stages", {}), "align", said["seconds"])
            return Answer(np.linalg.inv(first) @ moved, seconds, cpu_seconds() - before, second["verdict"], second["reason"],
                          second.get("error_mm", float("nan")))


def stage_seconds(stages, name, otherwise):
    """Seconds of a stage, told as {name: seconds} or as a list of {"stage": name, "seconds": ..}."""
    if isinstance(stages, dict):
        return float(stages.get(name, otherwise))
    return float(sum(stage.get("seconds", 0) for stage in stages if name in stage.values()) or otherwise)


PARAMETERS = pathlib.Path(__file__).resolve().parents[2] / "Testing" / "elastix-rigid.txt"  # those of the benchmark as well


def fill_outside(image):
    """Gives what is not real the mean of what is. A pyramid that knows no masks would smooth the black outside into the fan."""
    intensity = vtk_to_numpy(echorama.vtkUltrasoundVolume.GetIntensity(image))
    valid = echorama.vtkUltrasoundVolume.GetValidRegion(image)
    if valid is not None:
        real = vtk_to_numpy(valid) != 0
        intensity[~real] = intensity[real].mean()


def write_moved(folder, case, start, prepare=lambda image: None):
    """Both volumes as files 0.mha and 1.mha, the second where the start puts it."""
    for number, motion in ((0, np.eye(4)), (1, start.motion)):
        image = case.image(number)
        echorama.vtkUltrasoundVolume.Move(image, matrix_of(motion))
        prepare(image)
        writer = echorama.vtkUltrasoundWriter()
        writer.SetInputDataObject(image)
        writer.SetFileName(str(folder / f"{number}.mha"))
        writer.SetUseCompression(False)
        writer.Write()


class Search:
    """The search of the dissertation, by a program of the benchmarks (Filters/Registration/Benchmarks). It judges nothing."""

    def __init__(self, program, minimum_overlap=0.15):
        self.program, self.minimum_overlap = program, minimum_overlap

    def align(self, case, start, limit):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            write_moved(folder, case, start)
            before = cpu_seconds()
            done = run_program([self.program, folder / "0.mha", folder / "1.mha", self.minimum_overlap], limit)
            if done.returncode != 0:
                raise Failed(done.stderr.strip()[-300:] or f"it ended with status {done.returncode}")
            said = json.loads(done.stdout)
            return Answer(np.array(said["VolumeToWorld"]) @ start.motion, said["seconds"], cpu_seconds() - before)


class Elastix:
    """elastix by the parameters of that file, with both masks. The start is put into the geometry of the second volume, so that its
    own transform begins at the identity. The time is that of the whole program, which reads its files too."""

    # Metric, and iterations on each level: its only stopping rule. The same as in the benchmark.
    SETTINGS = {"elastix-mi-250": ("AdvancedMattesMutualInformation", 250), "elastix-mi-1000": ("AdvancedMattesMutualInformation", 1000),
                "elastix-ncc-250": ("AdvancedNormalizedCorrelation", 250)}

    def __init__(self, metric, iterations):
        self.added = f'(Metric "{metric}")\n(MaximumNumberOfIterations {iterations})\n'

    def align(self, case, start, limit):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "parameters.txt").write_text(PARAMETERS.read_text() + self.added)
            write_moved(folder, case, start, fill_outside)
            masks = [[flag, folder / f"{number}.ValidRegion.mha"] for number, flag in ((0, "-fMask"), (1, "-mMask"))]
            begin, before = time.monotonic(), cpu_seconds()
            done = run_program(["elastix", "-f", folder / "0.mha", "-m", folder / "1.mha", "-out", folder, "-p",
                                folder / "parameters.txt", *[word for mask in masks if mask[1].exists() for word in mask]], limit)
            seconds = time.monotonic() - begin
            result = folder / "TransformParameters.0.txt"
            if done.returncode != 0 or not result.exists():
                errors = re.findall(r"(?:Description|ERROR|Error): *(\S.*)", done.stdout + done.stderr)
                raise Failed(errors[-1] if errors else f"elastix ended with status {done.returncode}")
            # It maps the world of the first volume to that of the second where it started.
            return Answer(np.linalg.inv(euler_motion(result.read_text())) @ start.motion, seconds,
                          cpu_seconds() - before)


class Program:
    """Any program, called as COMMAND FIRST.mha SECOND.mha POSES.json: it writes where the two belong, as a pose file. The start is in the
    geometry of the second volume. The time is that of the whole program."""

    def __init__(self, command):
        self.command = shlex.split(command)

    def align(self, case, start, limit):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            write_moved(folder, case, start)
            begin, before, out = time.monotonic(), cpu_seconds(), folder / "poses.json"
            done = run_program([*self.command, folder / "0.mha", folder / "1.mha", out], limit)
            seconds = time.monotonic() - begin
            if done.returncode != 0 or not out.exists():
                raise Failed(done.stderr.strip()[-300:] or f"it ended with status {done.returncode}" + ("" if out.exists() else " and wrote no poses"))
            try:
                (_, first), (_, second) = read_poses(out)
            except (ValueError, KeyError, TypeError) as problem:
                raise Failed(f"its poses: {problem}") from problem
            return Answer(np.linalg.inv(first) @ second @ start.motion, seconds, cpu_seconds() - before)


def euler_motion(text):
    """The motion that a file of elastix's EulerTransform holds."""
    def numbers(key):
        return [float(word) for word in re.search(rf"\({key} ([^)]*)\)", text).group(1).split()]

    x, y, z, *move = numbers("TransformParameters")
    centre = np.array(numbers("CenterOfRotationPoint"))
    order = re.search(r'\(ComputeZYX "(\w+)"\)', text)
    about_x, about_y, about_z = rotation((x, 0, 0)), rotation((0, y, 0)), rotation((0, 0, z))
    turn = about_z @ about_y @ about_x if order and order.group(1) == "true" else about_z @ about_x @ about_y
    motion = np.eye(4)
    motion[:3, :3] = turn
    motion[:3, 3] = centre + move - turn @ centre
    return motion


def contestants(program, own=(), programs=()):
    """By name. Of the user: `own`, "NAME=OPTIONS of echorama align", and `programs`, "NAME=COMMAND"."""
    found = {"echorama": Echorama(program)}
    search = pathlib.Path(shutil.which(program) or program).resolve().parents[1] / "benchmarks" / "BenchmarkAlignSearch"
    if search.exists():
        found["search"] = Search(search)
    if shutil.which("elastix"):
        found.update({name: Elastix(*settings) for name, settings in Elastix.SETTINGS.items()})
    for text in own:
        name, _, options = text.partition("=")
        found[name] = Echorama(program, options.split())
    for text in programs:
        name, _, command = text.partition("=")
        found[name] = Program(command)
    return found
