#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The 3D view of a session: what its pictures show, in each style, while dragging and at rest.

Usage: TestUltrasoundVolumeView.py [FOLDER]   (FOLDER: the pictures are written there)
"""
import math
import os
import pathlib
import sys

import numpy as np
import vtkmodules.vtkRenderingFreeType
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import vtkRenderWindow, vtkWindowToImageFilter

from echorama.EchoramaWidgets import vtkUltrasoundAlignmentSession, vtkUltrasoundVolumeView

WIDTH, HEIGHT = 400, 300
FOLDER = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else None
LIVER = pathlib.Path(os.environ.get("ECHORAMA_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2])) / ".." / "shared" / "data" / "liver"
failures = []


def check(truth, what):
    if not truth:
        failures.append(what)
        print("FAILED:", what)


def volume(grey, origin=(0, 0, 0), spacing=(1, 1, 1), direction=None, valid=None):
    """An image of the voxels grey[z, y, x]."""
    image = vtkImageData()
    image.SetDimensions(grey.shape[::-1])
    image.SetOrigin(origin)
    image.SetSpacing(spacing)
    if direction is not None:
        image.SetDirectionMatrix(*np.asarray(direction).ravel())
    arrays = {"Intensity": grey}
    if valid is not None:
        arrays["ValidRegion"] = valid.astype(np.uint8)
    for name, values in arrays.items():
        array = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    image.GetPointData().SetActiveScalars("Intensity")
    return image


def motion(x=0.0, y=0.0, z=0.0):
    matrix = vtkMatrix4x4()
    for row, value in enumerate((x, y, z)):
        matrix.SetElement(row, 3, value)
    return matrix


class Shown:
    """A session, its view and a window of it."""

    def __init__(self, *images, size=(WIDTH, HEIGHT), window=(0.0, 255.0)):
        self.session = vtkUltrasoundAlignmentSession()
        self.session.SetGreyWindow(*window)
        self.ids = [self.session.AddVolume(image, None, f"v{i}") for i, image in enumerate(images)]
        self.session.SelectNone()
        self.view = vtkUltrasoundVolumeView()
        self.errors = []
        self.view.AddObserver(vtkCommand.ErrorEvent, lambda *_: self.errors.append(1))
        self.view.SetSession(self.session)
        self.window = vtkRenderWindow()
        self.window.SetMultiSamples(0)
        self.window.SetOffScreenRendering(1)
        self.window.SetSize(*size)
        self.window.AddRenderer(self.view.GetRenderer())

    def front(self, distance=200.0, focus=(0, 0, 0)):
        """Seen along +y, from anterior, with +z (superior) up: +x (left) is at the right."""
        self.view.Fit()
        camera = self.view.GetRenderer().GetActiveCamera()
        camera.SetFocalPoint(*focus)
        camera.SetPosition(focus[0], focus[1] - distance, focus[2])
        camera.SetViewUp(0, 0, 1)
        self.view.GetRenderer().ResetCameraClippingRange()

    def picture(self, name=None):
        """Rendered: RGB [y, x, 3], the top row first."""
        self.window.Render()
        grab = vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ReadFrontBufferOff()
        grab.Update()
        if FOLDER and name:
            FOLDER.mkdir(parents=True, exist_ok=True)
            writer = vtkPNGWriter()
            writer.SetFileName(str(FOLDER / f"{name}.png"))
            writer.SetInputConnection(grab.GetOutputPort())
            writer.Write()
        image = grab.GetOutput()
        return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(image.GetDimensions()[1], image.GetDimensions()[0], 3)[::-1].astype(float)

    def colours(self, *rgbs):
        for id, rgb in zip(self.ids, rgbs):
            self.session.SetColour(id, *rgb)


CUBE = np.full((10, 10, 10), 255, np.uint8)
RED, GREEN, WHITE = (1, 0, 0), (0, 1, 0), (1, 1, 1)


def cube_at(x, y, z=-5.0, grey=255, dtype=np.uint8):
    return volume(np.full((10, 10, 10), grey, dtype), (x - 4.5, y - 4.5, z + 0.5))


def middle(picture, x=0.0, y=0.0):
    """Mean colour of a few pixels."""
    row, column = int(HEIGHT / 2 - y), int(WIDTH / 2 + x)
    return picture[row - 2:row + 3, column - 2:column + 3].mean(axis=(0, 1))


def test_depth_order():
    """Two cubes, one behind the other: the nearer one's colour wins, from both sides, whatever the order in the session."""
    for order in (1, -1):
        shown = Shown(*[cube_at(0, y) for y in (-20, 20)][::order])
        shown.colours(*[RED, GREEN][::order])
        shown.view.SetOpacity(0.5)
        shown.view.SetValueOpacity(False)
        shown.view.SetOrientationMarker(False)
        shown.front()
        near_red = middle(shown.picture("depth_front"))
        check(near_red[0] > 230 and near_red[1] < 25, f"the red cube is in front: {near_red}")
        camera = shown.view.GetRenderer().GetActiveCamera()
        camera.Azimuth(180)
        near_green = middle(shown.picture("depth_back"))
        check(near_green[1] > 230 and near_green[0] < 25, f"from behind the green one is: {near_green}")
        # Moved to the other side by its pose alone.
        camera.Azimuth(180)
        red = shown.ids[::order][0]
        shown.session.SetVolumeToWorld(red, motion(y=60))
        moved = middle(shown.picture())
        check(moved[1] > 230 and moved[0] < 25, f"the red cube moved behind: {moved}")
        check(not shown.errors, "an error was told")


def test_blending_is_exact():
    """One layer of particles of a known opacity over black, and over another."""
    layer = np.full((10, 1, 10), 255, np.uint8)
    shown = Shown(volume(layer, (-4.5, 0, -4.5)))
    shown.view.SetDownsampling(1)
    shown.view.SetValueOpacity(False)
    shown.view.SetOpacity(0.4)
    shown.view.SetParticleSize(1.0)
    shown.front(distance=40)
    alpha = round(0.4 * 255) / 255
    got = middle(shown.picture())[0]
    check(abs(got - 255 * alpha) <= 12, f"one layer: {got} for {255 * alpha}")  # touching squares: edges may overlap by a pixel
    two = Shown(volume(layer, (-4.5, 0, -4.5)), volume(layer, (-4.5, 5, -4.5)))
    two.colours(RED, GREEN)
    two.view.SetDownsampling(1)
    two.view.SetValueOpacity(False)
    two.view.SetOpacity(0.4)
    two.view.SetParticleSize(1.0)
    two.front(distance=40)
    got = middle(two.picture())
    check(abs(got[0] - 255 * alpha) <= 12 and abs(got[1] - 255 * alpha * (1 - alpha)) <= 15, f"two layers: {got}")


def test_parameters():
    """Opacity, value-based opacity, thresholds, colour, visibility."""
    shown = Shown(cube_at(-8, 0, grey=80), cube_at(8, 0, grey=200))
    shown.view.SetOrientationMarker(False)
    shown.view.SetOpacity(0.3)
    shown.front(distance=60)
    at = HEIGHT / (2 * math.tan(math.radians(15))) / 60 * 8
    left, right = (lambda p: middle(p, x=-at)[0]), (lambda p: middle(p, x=at)[0])

    def both():
        picture = shown.picture()
        return left(picture), right(picture)

    plain = both()
    check(0 < plain[0] < plain[1] - 50, f"grey levels: {plain}")
    shown.view.SetValueOpacity(False)
    check(both()[0] > plain[0], "without value-based opacity the dark one is more opaque")
    shown.view.SetValueOpacity(True)
    shown.view.SetMinimum(100)
    check(both()[0] == 0 and both()[1] == plain[1], f"minimum: {both()}")
    shown.view.SetMinimum(1)
    shown.view.SetMaximum(100)
    check(both() == (plain[0], 0), f"maximum: {both()}")
    shown.view.SetMaximum(1e300)
    shown.view.SetOpacity(0.05)
    check(both()[1] < plain[1], "opacity")
    shown.view.SetOpacity(0.3)
    shown.session.SetOpacity(shown.ids[1], 0.1)
    check(both()[1] < plain[1] and both()[0] == plain[0], "opacity of a volume")
    shown.session.SetOpacity(shown.ids[1], 1.0)
    shown.session.SetVisible(shown.ids[1], False)
    check(both() == (plain[0], 0), "visibility")
    shown.session.SetVisible(shown.ids[1], True)
    check(both() == plain, "and back")
    whole = shown.picture()
    shown.view.SetParticleSize(0.3)
    lit = [(each.max(axis=2) > 0).sum() for each in (whole, shown.picture())]
    check(0 < lit[1] < 0.8 * lit[0], f"smaller particles cover less: {lit}")
    shown.view.SetParticleSize(99)
    check(shown.view.GetParticleSize() == 10, "clamped")
    shown.view.SetOpacity(math.nan)
    check(shown.errors and shown.view.GetOpacity() == 0.3, "not a number is refused")
    shown.errors.clear()
    check(not shown.view.SetStyle("cloud") and shown.errors and shown.view.GetStyle() == "points", "an unknown style is refused")


def test_every_style_and_type_at_the_same_place():
    """An oblique volume of each voxel type in each style lies where its geometry says: centroids of the pictures agree."""
    angle = math.radians(30)
    turn = [[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]]
    for dtype in (np.uint8, np.int16, np.uint16, np.float32, np.float64):
        centres = {}
        for style in ("points", "volume", "outline"):
            image = volume(np.full((20, 12, 30), 200, dtype), (2, -5, -6), (1.0, 1.0, 0.7), turn)
            shown = Shown(image)
            shown.view.SetOrientationMarker(False)
            shown.view.SetOpacity(0.9)
            shown.view.SetStyle(style)
            shown.front(distance=120)
            shown.session.SetVolumeToWorld(shown.ids[0], motion(x=-8, z=5))
            picture = shown.picture(f"style_{style}").sum(axis=2)
            check(picture.max() > 100, f"{style} of {dtype.__name__} shows something")
            rows, columns = np.nonzero(picture > 0.3 * picture.max())
            centres[style] = ((columns.min() + columns.max()) / 2, (rows.min() + rows.max()) / 2,
                              np.ptp(columns), np.ptp(rows))
            check(not shown.errors, f"{style} of {dtype.__name__}: an error was told")
        for style in ("points", "volume"):
            check(np.abs(np.subtract(centres[style], centres["outline"])).max() <= 10, f"{style} of {dtype.__name__}: {centres}")


def test_valid_region_and_painting():
    """What is not real is not seen; what is carved vanishes."""
    valid = np.zeros((20, 20, 20))
    valid[:, :, 10:] = 1
    for style in ("points", "volume"):
        shown = Shown(volume(np.full((20, 20, 20), 255, np.uint8), (-9.5, -9.5, -9.5), valid=valid))
        shown.view.SetOrientationMarker(False)
        shown.view.SetOpacity(0.9)
        shown.view.SetStyle(style)
        shown.front(distance=80)
        picture = shown.picture()
        check(middle(picture, x=-40)[0] == 0 and middle(picture, x=40)[0] > 200, f"{style}: half is real")
        check(shown.session.BeginStroke(shown.ids[0], "carve", 30.0, 0.0, 1.0, 1.0, True), f"{style}: a stroke begins")
        check(shown.session.ExtendStroke(0.0, 0.0, 0.0) and shown.session.EndStroke(), f"{style}: and is drawn")
        check(shown.picture().max() == 0, f"{style}: all is carved")
        shown.session.Undo()
        check(np.array_equal(shown.picture(), picture), f"{style}: and back")


def texture(size, seed):
    """A ball of speckle with a dark cyst."""
    z, y, x = np.mgrid[:size, :size, :size] / (size - 1) * 2 - 1
    grey = np.random.default_rng(seed).rayleigh(60, (size, size, size))
    grey[(x - 0.2) ** 2 + y ** 2 + z ** 2 < 0.12] *= 0.1
    return np.clip(grey, 0, 255).astype(np.uint8), x * x + y * y + z * z < 1


def test_dragging():
    """While dragging a slow machine shows less, at a like brightness; at rest the picture is the full one to the last bit; poses
    change no particles."""
    grey, ball = texture(96, 1)
    for style in ("points", "volume"):
        shown = Shown(volume(grey, valid=ball), volume(grey, (40, 10, 0), valid=ball))
        shown.view.SetStyle(style)
        shown.view.SetDownsampling(1)
        shown.colours((1, 0.8, 0.6), (0.6, 0.8, 1))
        full = shown.picture(f"full_{style}")
        particles = shown.view.GetNumberOfParticles()
        check(style == "volume" or particles > 400000, f"{particles} particles")
        shown.view.SetFrameBudget(5)  # no machine can
        shown.view.SetInteractive(True)
        for i in range(4):
            shown.session.SetVolumeToWorld(shown.ids[0], motion(x=i + 1.0))
            shown.window.Render()
        check(shown.view.GetDetailLevel() > 0, "the level of detail rises")
        shown.session.SetVolumeToWorld(shown.ids[0], motion())
        coarse = shown.picture(f"coarse_{style}")
        level = shown.view.GetDetailLevel()
        check(style == "volume" or 0 < shown.view.GetNumberOfParticles() < particles / 2, "fewer particles")
        rms = math.sqrt(((coarse - full) ** 2).mean())
        check(0 < rms < 40, f"{style}: level {level} differs by {rms:.1f} grey levels")
        check(abs(coarse.mean() - full.mean()) < 0.25 * full.mean(), f"{style}: brightness {coarse.mean():.1f} for {full.mean():.1f}")
        shown.view.SetInteractive(False)
        check(shown.view.GetDetailLevel() == 0 and np.array_equal(shown.picture(), full), f"{style}: full again")
        check(shown.view.GetLastFrameSeconds() > 0, "frames are timed")
    shown.view.SetStyle("points")
    shown.view.SetBudget(20000)
    shown.picture()
    check(0 < shown.view.GetNumberOfParticles() <= 20000, "the budget is kept by all together")


def test_refining():
    """After a drag the picture becomes finer step by step, or at once where that is quick, as far as the time of a frame allows; a stroke and the grey window are
    shown then, and not during the drag."""
    grey, ball = texture(96, 1)
    shown = Shown(volume(grey, valid=ball), volume(grey, (40, 10, 0), valid=ball))
    shown.view.SetDownsampling(1)
    full = shown.picture()
    shown.view.SetFrameBudget(5)
    shown.view.SetRestBudget(1e6)
    shown.view.SetInteractive(True)
    levels = [-1]
    while levels[0] != shown.view.GetDetailLevel():  # frames that were slow have changed it for the next
        levels[0] = shown.view.GetDetailLevel()
        coarse = shown.picture()
    shown.session.SetGreyWindow(100.0, 200.0)
    check(np.array_equal(shown.picture(), coarse) or shown.view.GetDetailLevel() != levels[0], "the grey window waits")
    shown.session.SetGreyWindow(0.0, 255.0)
    levels[0] = shown.view.GetDetailLevel()
    while shown.view.Refine() and len(levels) < 10:
        shown.window.Render()
        levels.append(shown.view.GetDetailLevel())
    steps = list(zip(levels, levels[1:]))
    check(levels[0] > 0 and levels[-1] == 0 and all(b in (a - 1, 0) for a, b in steps), f"levels {levels}")
    check(not shown.view.GetInteractive() and np.array_equal(shown.picture(), full), "refined to the full picture")
    shown.view.SetInteractive(True)
    shown.picture()
    shown.view.SetRestBudget(5)  # no machine can
    before = shown.view.GetDetailLevel()
    check(not shown.view.Refine() and shown.view.GetDetailLevel() == before > 0, "what would take too long is not drawn")
    shown.session.SetGreyWindow(100.0, 200.0)
    waited = shown.picture()
    check(shown.view.Refine(), "what waited is drawn all the same")
    check(not np.array_equal(shown.picture(), waited), "and seen")


def test_planes():
    """A picture on a plane lies in its place: opaque where it shows something, see-through elsewhere."""
    shown = Shown(cube_at(0, 0))
    shown.colours(RED)
    shown.view.SetOpacity(0.9)
    shown.view.SetOrientationMarker(False)
    picture = vtkImageData()
    picture.SetDimensions(20, 1, 1)
    rgba = numpy_to_vtk(np.repeat(np.array([[0, 0, 255, 255], [0, 0, 0, 0]], np.uint8), 10, axis=0), deep=True)
    picture.GetPointData().SetScalars(rgba)
    shown.front(distance=80)
    corners = [-20, -10, -20, 20, -10, -20, 20, -10, 20, -20, -10, 20]  # in front of the cube
    check(shown.view.SetPlane(7, corners, picture), "a plane")
    image = shown.picture("plane")
    check(middle(image, x=-20)[2] > 200 and middle(image, x=-20)[0] < 30, f"its left half hides the cube: {middle(image, x=-20)}")
    check(middle(image, x=20)[0] > 200, f"its right half is see-through: {middle(image, x=20)}")
    check(shown.view.GetNumberOfPlanes() == 1, "one plane")
    behind = [c + 30 if i % 3 == 1 else c for i, c in enumerate(corners)]
    shown.view.SetPlane(7, behind, picture)
    check(middle(shown.picture(), x=-20)[0] > 150, "behind the cube")
    shown.view.SetShowPlanes(False)
    check(shown.picture()[..., 2].max() < 50, "hidden")
    shown.view.SetShowPlanes(True)
    shown.view.RemovePlane(7)
    check(shown.view.GetNumberOfPlanes() == 0 and shown.picture()[..., 2].max() < 50, "removed")
    check(not shown.view.SetPlane(7, [math.nan] * 12) and shown.errors, "corners that are no numbers")


def test_processor_and_graphics_draw_the_same():
    """Particles of two volumes that interpenetrate, with a plane through them and a box: whoever draws them."""
    shown = Shown(*[volume(grey, corner, valid=ball) for corner, (grey, ball) in
                    (((-30, -20, -20), texture(40, 1)), ((-10, -15, -25), texture(40, 2)))])
    shown.colours((1, 0.7, 0.2), (0.3, 0.6, 1))
    shown.session.Select(shown.ids[1])
    shown.front(distance=150)
    shown.view.GetRenderer().GetActiveCamera().Azimuth(35)
    shown.view.GetRenderer().GetActiveCamera().Elevation(20)
    picture = vtkImageData()
    picture.SetDimensions(2, 1, 1)
    picture.GetPointData().SetScalars(numpy_to_vtk(np.array([[0, 200, 0, 255], [0, 90, 0, 255]], np.uint8), deep=True))
    shown.view.SetPlane(0, [-40, 0, -15, 40, 10, -15, 40, 10, 15, -40, 0, 15], picture)
    pictures = {}
    for parallel in (False, True):
        shown.view.GetRenderer().GetActiveCamera().SetParallelProjection(parallel)
        shown.view.GetRenderer().GetActiveCamera().SetParallelScale(40)
        for who in ("processor", "graphics"):
            check(shown.view.SetDrawnBy(who) and shown.view.GetDrawnBy() == who, who)
            pictures[who] = shown.picture(f"drawn_by_{who}{'_parallel' * parallel}")
        difference = np.abs(pictures["processor"] - pictures["graphics"])
        rms = math.sqrt((difference**2).mean())
        check(pictures["graphics"].mean() > 10, "something is seen")
        check(rms < 1.5 and np.percentile(difference, 99.5) < 10, f"the same picture: RMS {rms:.2f}, at most {difference.max():.0f} of 255")
    shown.session.SetVolumeToWorld(shown.ids[0], motion(x=15, y=-10))  # what was moved while the other drew
    moved = [shown.view.SetDrawnBy(who) and shown.picture() for who in ("processor", "graphics")]
    check(math.sqrt(((moved[0] - moved[1])**2).mean()) < 1.5 and np.abs(moved[0] - pictures["graphics"]).mean() > 2, "also after a move")
    shown.view.SetStyle("volume")
    rendered = [shown.view.SetDrawnBy(who) and shown.picture(f"rendered_by_{who}") for who in ("processor", "graphics")]
    rms = math.sqrt(((rendered[0] - rendered[1])**2).mean())
    check(rms < 4 and abs(rendered[0].mean() / rendered[1].mean() - 1) < 0.05, f"volume rendering: RMS {rms:.2f}")
    check(not shown.view.SetDrawnBy("magic") and shown.errors and shown.view.GetDrawnBy() == "graphics", "others are refused")


def test_which_volumes_are_on_a_line_of_sight():
    session, view, window = scene_of_two_in_a_row()
    front, back = session.GetVolumeId(0), session.GetVolumeId(1)
    window.Render()
    middle = (WIDTH / 2, HEIGHT / 2)
    check([view.GetVolumeAt(*middle, i) for i in range(3)] == [front, back, 0], "the nearest comes first")
    check(view.GetVolumeAt(3, 3) == 0, "beside all volumes there is none")
    view.GetRenderer().GetActiveCamera().Azimuth(180)
    check(view.GetVolumeAt(*middle) == back, "seen from behind")
    view.AddOnly(front)
    view.Update()
    check([view.GetVolumeAt(*middle, i) for i in range(2)] == [front, 0], "the others are hidden")
    view.ClearOnly()
    view.Update()
    check(view.GetVolumeAt(*middle) == back, "and are back")
    view.SetMinimum(150)
    check(view.GetVolumeAt(*middle) == front, "what is too dark to be seen is seen through")


def scene_of_two_in_a_row():
    session = vtkUltrasoundAlignmentSession()
    for y, grey in ((-40, 200), (40, 100)):
        session.AddVolume(volume(np.full((20, 20, 20), grey, np.uint8), (-10, y, -10)), None)
    view = vtkUltrasoundVolumeView()
    view.SetSession(session)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(WIDTH, HEIGHT)
    window.AddRenderer(view.GetRenderer())
    view.Update()
    view.Fit()
    camera = view.GetRenderer().GetActiveCamera()
    camera.SetFocalPoint(0, 9, 0)
    camera.SetPosition(0, -300, 0)
    camera.SetViewUp(0, 0, 1)
    view.GetRenderer().ResetCameraClippingRange()
    return session, view, window


def test_error_vectors():
    shown = Shown(cube_at(0, 0), cube_at(20, 0))
    shown.view.SetOrientationMarker(False)
    shown.view.SetErrorVectors(True)
    shown.view.SetStyle("outline")
    shown.front(distance=120)
    nothing = shown.picture()
    if not all(shown.session.SetTruth(id, motion()) for id in shown.ids):
        check(False, "the session takes no truth")
        return
    shown.session.SetVolumeToWorld(shown.ids[1], motion(z=10))
    arrows = shown.picture("error_vectors")
    changed = np.abs(arrows - nothing).sum(axis=2) > 30
    check(changed.sum() > 500, "arrows are seen")
    # Arrows of the longest errors are of the bright end of the colours.
    check((arrows[..., 0] > 150).sum() > 100, "their colour follows their length")
    shown.view.SetErrorVectors(False)
    without = shown.picture()
    check((np.abs(without - nothing).sum(axis=2) > 30).sum() < changed.sum() / 2, "off")


def test_limits():
    view = vtkUltrasoundVolumeView()
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(100, 80)
    window.AddRenderer(view.GetRenderer())
    window.Render()  # without a session
    view.Fit()
    session = vtkUltrasoundAlignmentSession()
    session.SetGreyWindow(0, 255)
    view.SetSession(session)
    window.Render()  # an empty one
    id = session.AddVolume(cube_at(0, 0), None, "cube")
    window.Render()
    check(view.GetNumberOfParticles() == 125, f"{view.GetNumberOfParticles()} particles")
    other = session.AddVolume(volume(np.zeros((4, 4, 4), np.float32) * np.nan), None, "nothing real")
    window.Render()
    check(view.GetNumberOfParticles() == 125, "nothing real shows nothing")
    session.RemoveVolume(id)
    session.RemoveVolume(other)
    window.Render()
    check(view.GetNumberOfParticles() == 0, "removed")
    session.Undo()
    session.Undo()
    window.Render()
    check(view.GetNumberOfParticles() == 125, "and back")
    view.SetSession(None)
    window.Render()
    check(view.GetNumberOfParticles() == 0 and view.GetSession() is None, "no session")
    session.AddVolume(cube_at(0, 0), None, "more")  # is not told any more
    view.SetSession(session)
    window.Render()
    check("points" in str(view), "it prints")


def test_liver():
    """The liver pair, for a person to look at."""
    if not LIVER.exists() or FOLDER is None:
        return
    shown = Shown(size=(800, 600))
    shown.session = vtkUltrasoundAlignmentSession()
    shown.ids = [shown.session.OpenVolume(str(LIVER / f"liver_volume_{v}.mha")) for v in "AB"]
    shown.colours((1.0, 0.8, 0.55), (0.55, 0.8, 1.0))
    shown.session.SelectNone()
    shown.view.SetSession(shown.session)
    for style in ("points", "volume", "outline"):
        shown.view.SetStyle(style)
        image = shown.picture(f"liver_{style}")
        check(image.max() > 100, f"the liver as {style}")
    shown.view.SetStyle("points")
    shown.view.SetMinimum(120)
    shown.picture("liver_bright")
    shown.view.SetMinimum(1)
    for id in shown.ids:
        shown.session.SetTruth(id, motion())
    shown.session.Select(shown.ids[1], True, True)
    shown.session.SetVolumeToWorld(shown.ids[1], motion(12, 4, -6))
    shown.view.SetErrorVectors(True)
    shown.view.SetOpacity(0.08)
    shown.picture("liver_errors")


for name, test in list(globals().items()):
    if name.startswith("test_"):
        print(name, flush=True)
        test()
sys.exit(1 if failures else 0)
