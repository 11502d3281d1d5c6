# SPDX-License-Identifier: BSD-3-Clause
"""The demo of surface tracking: a belly becomes a skin to print, the camera in it is calibrated by a hand, and two tools are followed on
the skin. Camera, hand and tools are simulated, so everything can be compared with the truth."""
import dataclasses
import datetime
import html
import json
import pathlib
import re
import string
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLookupTable, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkIOGeometry import vtkSTLReader, vtkSTLWriter
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter

from report import data_uri, machine, style, steps_table, version_of

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "Examples" / "python"))
from shell_figures import abdomen, dots, half, shown  # noqa: E402

RESULTS = ["surface.html", "belly.stl", "calibrated.json", "calibrated.mesh.stl", "shell.png", "camera.png", "error.png", "path.png", "wander.igs.mha", "fast.igs.mha",
           "camera.igs.mhd", "camera.igs.raw", "camera.igs.mha"]
TOOLS = ("Probe", "Needle")
RATE = 90
MOST_MM = 0.4  # of the colours


@dataclasses.dataclass(frozen=True)
class Followed:
    """A tool at every moment that was told: where it was said to be, and where it was; not finite where nothing was said or it was away."""
    seconds: np.ndarray
    place: np.ndarray
    truth: np.ndarray

    def errors(self):
        """Of every moment, mm; not finite where there is nothing to compare."""
        return np.linalg.norm(self.place - self.truth, axis=1)

    def both(self):
        return np.isfinite(self.place[:, 0]) & np.isfinite(self.truth[:, 0])

    def missed(self):
        """The share of moments at which it was on the skin and nothing was told, after the half second in which its code is read."""
        there = np.isfinite(self.truth[:, 0]) & (self.seconds > self.seconds[0] + 0.5)
        return float(np.mean(~np.isfinite(self.place[there, 0])))

    def claims(self):
        """Places that were told of a light that was not there."""
        return int(np.count_nonzero(np.isfinite(self.place[:, 0]) & ~np.isfinite(self.truth[:, 0])))


def read_paths(recording):
    """What echorama track recorded."""
    fields = {}
    for frame, name, value in re.findall(r"^Seq_Frame(\d+)_(\w+) = (.*)$", recording.read_text("latin-1"), re.M):
        fields.setdefault(int(frame), {})[name] = value.strip()
    paths = {}
    for tool in TOOLS:
        moments, places, truths = [], [], []
        for _, frame in sorted(fields.items()):
            found = []
            for name in (f"{tool}ToTracker", f"{tool}TruthToTracker"):
                known = frame.get(f"{name}TransformStatus") == "OK"
                found.append(np.array(frame[f"{name}Transform"].split(), float).reshape(4, 4)[:3, 3] if known else np.full(3, np.nan))
            moments.append(float(frame["Timestamp"]))
            places.append(found[0])
            truths.append(found[1])
        paths[tool] = Followed(np.array(moments), np.array(places), np.array(truths))
    return paths


def write_stl(data, path):
    writer = vtkSTLWriter()
    writer.SetInputData(data)
    writer.SetFileName(str(path))
    writer.SetFileTypeToBinary()
    writer.Write()


def read_stl(path):
    reader = vtkSTLReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def cloud(points):
    data, places = vtkPolyData(), vtkPoints()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(points, float), deep=True))
    data.SetPoints(places)
    return data


def render(views, size):
    """Actors in viewports side by side, each seen from a direction, as an array."""
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(4)
    window.SetSize(*size)
    for number, (actors, eye, zoom) in enumerate(views):
        renderer = vtkRenderer()
        renderer.SetViewport(number / len(views), 0, (number + 1) / len(views), 1)
        renderer.SetBackground(1, 1, 1)
        for actor in actors:
            renderer.AddActor(actor)
        window.AddRenderer(renderer)
        camera = renderer.GetActiveCamera()
        camera.SetPosition(eye)
        camera.SetFocalPoint(0, 0, 0)
        camera.SetViewUp(0, 1, 0) if abs(eye[2]) > 10 * abs(eye[0] + eye[1]) else camera.SetViewUp(0, 0, 1)
        renderer.ResetCamera()
        camera.Zoom(zoom)
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.Update()
    image = grab.GetOutput()
    width, height, _ = image.GetDimensions()
    return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)[::-1]


def draw_shell(path, out, prints):
    skin, base = read_stl(prints / "skin.stl"), read_stl(prints / "base.stl")
    marks = np.loadtxt(prints / "points.csv", delimiter=",", skiprows=1)[:, 1:]
    skin_colour, base_colour = (0.87, 0.8, 0.72), (0.5, 0.58, 0.66)
    picture = render([([shown(skin, skin_colour), dots(cloud(marks), 1.8)], (0.5, -1, 0.9), 1.4),
                      ([shown(half(skin), skin_colour), shown(half(base), base_colour, 25)], (0.2, -1, 0.35), 1.3)], (1400, 480))
    plt.imsave(path, picture)


def draw_camera(path, film):
    """What the camera saw: a frame in which most lights are on."""
    header = dict(re.findall(r"^(\w+) = (.*)$", film.read_text("latin-1"), re.M))
    width, height, count = (int(word) for word in header["DimSize"].split())
    frames = np.fromfile(film.with_suffix(".raw"), np.uint8)[:width * height * count].reshape(count, height, width)
    frame = max(frames, key=lambda each: int(np.count_nonzero(each > 120)))
    plt.imsave(path, np.sqrt(frame / 255), cmap="gray", vmin=0, vmax=1)


def draw_error(path, belly, wander):
    """Every place of both tools, in the colour of its error, on the belly."""
    truth = np.concatenate([followed.truth[followed.both()] for followed in wander.values()])
    errors = np.concatenate([followed.errors()[followed.both()] for followed in wander.values()])
    points, table = cloud(truth), vtkLookupTable()
    colours = plt.get_cmap("viridis")(np.linspace(0, 1, 256))
    table.SetNumberOfTableValues(256)
    for number, colour in enumerate(colours):
        table.SetTableValue(number, *colour)
    points.GetPointData().SetScalars(numpy_to_vtk(errors, deep=True))
    actor = dots(points, 1.3)
    mapper = actor.GetMapper()
    mapper.ScalarVisibilityOn()
    mapper.SetLookupTable(table)
    mapper.SetScalarRange(0, MOST_MM)
    picture = render([([shown(belly, (0.93, 0.88, 0.83)), actor], (0.4, -0.8, 1.1), 1.5)], (1000, 620))
    figure, axes = plt.subplots(figsize=(9, 5.2), dpi=130)
    axes.imshow(picture)
    axes.axis("off")
    bar = figure.colorbar(matplotlib.cm.ScalarMappable(matplotlib.colors.Normalize(0, MOST_MM), "viridis"), ax=axes, shrink=0.7)
    bar.set_label("off, mm")
    figure.savefig(path, bbox_inches="tight")
    plt.close(figure)


def draw_path(path, followed):
    """The needle, seen from above, and how far off it was told to be."""
    figure, (above, over) = plt.subplots(1, 2, figsize=(10, 4), dpi=130, gridspec_kw={"width_ratios": [1, 1.3]})
    above.plot(followed.truth[:, 0], followed.truth[:, 1], color="#b5651d", linewidth=3, label="truth")
    above.plot(followed.place[:, 0], followed.place[:, 1], ".", color="#0b5e8a", markersize=2.5, label="told")
    above.set_aspect("equal")
    above.set_xlabel("x, mm")
    above.set_ylabel("y, mm")
    above.legend(frameon=False, loc="upper left", bbox_to_anchor=(0, 1.16), ncol=2)
    over.plot(followed.seconds - followed.seconds[0], followed.errors(), color="#0b5e8a", linewidth=0.8)
    over.set_xlabel("seconds")
    over.set_ylabel("off, mm")
    over.set_ylim(0)
    figure.tight_layout()
    figure.savefig(path, bbox_inches="tight")
    plt.close(figure)


def quantiles(followed):
    errors = np.concatenate([each.errors()[each.both()] for each in followed.values()])
    return float(np.median(errors)), float(np.quantile(errors, 0.95)), float(errors.max()), len(errors)


def survey(steps, out, quick):
    """Runs the subcommands, draws and writes surface.html. Returns its path and lines for the terminal."""
    for old in (out / name for name in RESULTS):
        old.unlink(missing_ok=True)
    belly = abdomen()
    write_stl(belly, out / "belly.stl")
    prints = out / "prints"
    made = steps.run("making a skin and its base to print, with calibration points", "shell", out / "belly.stl", "-o", prints, "--opening-mm", 70,
                     "--marks", "holes", "--points", 60 if quick else 120, "--resolution-mm", 1, "--printer-mm", 400, 400, 400)
    x, y, z = made["camera"]
    # The camera is not quite where it was designed to be, its lens is not quite the nominal one, and its room is not dark.
    camera = (f"cameraMm={x + 0.8} {y - 0.6} {z + 0.5}&cameraTurn=1.5 -2 140&focal=193&centreX=322.5&centreY=236.8&k1=-0.024&k2=0.0015"
              "&ambient=14&slope=0.02&lostFrames=0.005&speed=0")
    found = steps.run("calibrating the camera: a simulated hand puts a light on one point after the other", "calibrate", "surface",
                      f"simulated:?{camera}&placementMm=0.1&wrongMarks=0.03&moveSeconds=0.3&liftMm=8", "--mesh", out / "belly.stl", "--marks",
                      prints / "points.csv", "--camera-position", x, y, z, "-o", out / "calibrated.json")
    line = f"optical:simulated:?shell={out / 'calibrated.json'}&calibrated=off&{camera}&truth=on"
    paths = {}
    for what, name, path, seconds in (("following probe and needle all over the skin", "wander", "wander&radiusMm=62&speedMmPerS=120", 8 if quick else 40),
                                      ("following them at 200 mm/s", "fast", "wander&radiusMm=35&speedMmPerS=200&liftEverySeconds=3", 4 if quick else 12)):
        recording = out / f"{name}.igs.mha"
        steps.run(what, "track", f"{line}&path={path}&frames={seconds * RATE}", "--record", recording)
        paths[name] = read_paths(recording)
    steps.run("filming what the camera sees", "track", f"{line}&path=circle&frames=40&film={out / 'camera.igs.mhd'}", "--record", out / "camera.igs.mha")

    print("  drawing ...", file=sys.stderr, flush=True)
    draw_shell(out / "shell.png", out, prints)
    draw_camera(out / "camera.png", out / "camera.igs.mhd")
    draw_error(out / "error.png", belly, paths["wander"])
    draw_path(out / "path.png", paths["fast"]["Needle"])
    still, fast = quantiles(paths["wander"]), quantiles(paths["fast"])
    missed = float(np.mean([followed.missed() for kind in paths.values() for followed in kind.values()]))
    claims = sum(followed.claims() for kind in paths.values() for followed in kind.values())
    accuracy = found["accuracy"]
    facts = [("off, median, all over the skin", f"{still[0]:.2f} mm"), ("off, 95%", f"{still[1]:.2f} mm"),
             ("off, 95%, at 200 mm/s", f"{fast[1]:.2f} mm"), ("of computing", f"{sum(took for _, _, took in steps.done):.0f} s")]
    page = string.Template((pathlib.Path(__file__).parent / "surface.html").read_text()).substitute(
        style=style(), facts="".join(f"<li><strong>{value}</strong>{name}</li>" for name, value in facts), steps=steps_table(steps),
        wall=f"{made['wall_mm'][0]:.2f} to {made['wall_mm'][1]:.2f}", marks=accuracy["marks"], outliers=len(found["outliers"]),
        coverage=f"{100 * accuracy['coverage']:.0f}", median=f"{accuracy['median_mm']:.2f}", mm95=f"{accuracy['mm95']:.2f}",
        wander=f"{still[3]:,}", wander_median=f"{still[0]:.2f}", wander_95=f"{still[1]:.2f}", wander_most=f"{still[2]:.2f}",
        fast=f"{fast[3]:,}", fast_median=f"{fast[0]:.2f}", fast_95=f"{fast[1]:.2f}", fast_most=f"{fast[2]:.2f}", claims=claims, missed=f"{100 * missed:.1f}",
        shell=data_uri(out / "shell.png"), camera=data_uri(out / "camera.png"), error=data_uri(out / "error.png"), path=data_uri(out / "path.png"),
        folder=html.escape(str(out)), version=html.escape(version_of(steps.program)), date=datetime.date.today().isoformat(),
        machine=html.escape(machine()))
    path = out / "surface.html"
    path.write_text(page)
    return path, "\n".join((f"wall      {made['wall_mm'][0]:.2f} to {made['wall_mm'][1]:.2f} mm",
                            f"map       {accuracy['median_mm']:.2f} mm off in the median at left-out points, {accuracy['mm95']:.2f} mm in 95%",
                            f"tools     {still[0]:.2f} mm off in the median, {still[1]:.2f} mm in 95%; at 200 mm/s {fast[1]:.2f} mm in 95%",
                            f"claims    {claims} places of a light that was not there; {100 * missed:.1f}% of those that were there are missing"))
