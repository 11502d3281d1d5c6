#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The alignment widget under recorded mouse and key events: what moves, how far, and what undo makes of it.

Usage: TestUltrasoundAlignmentWidget.py [FOLDER]   (FOLDER: pictures of the handles are written there)
"""
import math
import os
import pathlib
import sys

import numpy as np
import vtkmodules.vtkInteractionStyle
import vtkmodules.vtkRenderingFreeType
import vtkmodules.vtkRenderingOpenGL2
import vtkmodules.vtkRenderingVolumeOpenGL2
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkInteractionStyle import vtkInteractorStyleTrackballCamera
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (vtkInteractorEventRecorder, vtkRenderer, vtkRenderWindow, vtkRenderWindowInteractor,
                                         vtkWindowToImageFilter)

from echorama.EchoramaWidgets import vtkUltrasoundAlignmentRepresentation as Representation
from echorama.EchoramaWidgets import vtkUltrasoundAlignmentSession, vtkUltrasoundAlignmentWidget, vtkUltrasoundSliceView

WIDTH, HEIGHT, MM = 400, 300, 0.5
SHIFT, CONTROL = 1, 2


def volume(origin, size=40):
    """A block of voxels of 1 mm, real in a ball."""
    image = vtkImageData()
    image.SetDimensions(size, size, size)
    image.SetOrigin(origin)
    z, y, x = np.mgrid[:size, :size, :size] - (size - 1) / 2
    inside = (x * x + y * y + z * z <= (size / 2) ** 2).astype(np.uint8)
    grey = (100 + 60 * np.sin(x / 3) * np.sin(y / 4)).astype(np.uint8) * inside
    for name, values in (("Intensity", grey), ("ValidRegion", inside)):
        array = numpy_to_vtk(values.ravel(), deep=True)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    image.GetPointData().SetActiveScalars("Intensity")
    return image


class Bench:
    """Two volumes that overlap, a view of them, and a widget. World: A's middle at (0, 0, 0), B's at (25, 0, 0)."""

    def __init__(self, three_d=False):
        self.session = vtkUltrasoundAlignmentSession()
        self.a = self.session.AddVolume(volume((-19.5, -19.5, -19.5)), None, "A")
        self.b = self.session.AddVolume(volume((5.5, -19.5, -19.5)), None, "B")
        self.entries = self.session.GetUndoCount()
        self.renderer = vtkRenderer()
        self.window = vtkRenderWindow()
        self.window.SetSize(WIDTH, HEIGHT)
        self.window.SetMultiSamples(0)  # software rendering
        self.window.AddRenderer(self.renderer)
        self.interactor = vtkRenderWindowInteractor()
        self.interactor.SetRenderWindow(self.window)
        self.interactor.SetInteractorStyle(vtkInteractorStyleTrackballCamera())
        self.interactor.Initialize()
        camera = self.renderer.GetActiveCamera()
        camera.SetFocalPoint(0, 0, 0)
        if three_d:
            camera.SetPosition(120, -260, 150)
            camera.SetViewUp(0, 0, 1)
        else:
            camera.ParallelProjectionOn()
            camera.SetPosition(0, 0, 100)
            camera.SetViewUp(0, 1, 0)
            camera.SetParallelScale(0.5 * HEIGHT * MM)
        self.renderer.ResetCameraClippingRange(-60, 60, -60, 60, -60, 60)
        self.widget = vtkUltrasoundAlignmentWidget()
        self.widget.SetInteractor(self.interactor)
        self.widget.SetDefaultRenderer(self.renderer)
        self.widget.SetSession(self.session)
        self.widget.On()
        self.shape = self.widget.GetAlignmentRepresentation()
        self.window.Render()

    def play(self, *events):
        """Events as VTK's recorder keeps them: (name, (x, y), modifiers, key)."""
        lines = ["# StreamVersion 1.1"]
        for name, (x, y), *more in events:
            modifiers, key = (more + [0, None][len(more):])[:2]
            code = ord(key) if key and len(key) == 1 else 0
            lines.append(f"{name} {math.floor(x + 0.5)} {math.floor(y + 0.5)} {modifiers} {code} 0 {key or 0}")
        recorder = vtkInteractorEventRecorder()
        recorder.SetInteractor(self.interactor)
        recorder.ReadFromInputStringOn()
        recorder.SetInputString("\n".join(lines) + "\n")
        recorder.Play()
        recorder.Off()

    def drag(self, *places, modifiers=0, release=True):
        places = [tuple(math.floor(n + 0.5) for n in place) for place in places]
        self.play(("MouseMoveEvent", places[0], modifiers), ("LeftButtonPressEvent", places[0], modifiers),
                  *(("MouseMoveEvent", place, modifiers) for place in places[1:]),
                  *([("LeftButtonReleaseEvent", places[-1], modifiers)] if release else []))

    def click(self, place, modifiers=0):
        self.drag(place, modifiers=modifiers)

    def key(self, name, modifiers=0, at=(200, 150)):
        self.play(("KeyPressEvent", at, modifiers, name), ("KeyReleaseEvent", at, modifiers, name))

    def pixel(self, world):
        position = [0.0, 0.0]
        assert self.shape.WorldToPosition(world, position)
        return np.array(position)

    def handle(self, state):
        position = [0.0, 0.0]
        assert self.shape.GetHandlePosition(state, position), f"handle {state} is not shown"
        return np.array(position)

    def pose(self, id):
        matrix = vtkMatrix4x4()
        assert self.session.GetVolumeToWorld(id, matrix)
        return np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])

    def moved(self, id):
        return self.pose(id)[:3, 3]

    def edits(self):
        return self.session.GetUndoCount() - self.entries

    def selected(self):
        return {id for id in (self.a, self.b) if self.session.HasVolume(id) and self.session.IsSelected(id)}

    def save(self, name):
        folder = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.environ.get("ECHORAMA_BUILD_DIR", "/tmp"), "pictures")
        os.makedirs(folder, exist_ok=True)
        self.window.Render()
        grab = vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ReadFrontBufferOff()
        grab.Update()
        writer = vtkPNGWriter()
        writer.SetInputConnection(grab.GetOutputPort())
        writer.SetFileName(os.path.join(folder, name))
        writer.Write()


def near(a, b, tolerance=1e-9):
    assert np.allclose(a, b, rtol=0, atol=tolerance), f"{np.asarray(a)} is not {np.asarray(b)}"


def turn(axis, degrees, centre=(0, 0, 0)):
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    angle = math.radians(degrees)
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k
    matrix[:3, 3] = centre - matrix[:3, :3] @ centre
    return matrix


def angle_around(centre, place):
    return math.degrees(math.atan2(place[1] - centre[1], place[0] - centre[0]))


def pixels_of(window):
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    return vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).astype(int)


# ------------------------------------------------------------------------------------------------------------ translation

def test_pixels_are_millimetres():
    bench = Bench()
    near(bench.pixel((0, 0, 0)), ((WIDTH - 1) / 2, (HEIGHT - 1) / 2))
    bench.session.Select(bench.a, True, True)
    # On a selected volume, where there is no handle.
    start = bench.pixel((-12, -10, 0))
    bench.drag(start, start + (13, 4), start + (37, -21))
    near(bench.moved(bench.a), (37 * MM, -21 * MM, 0), 1e-12)
    near(bench.moved(bench.b), (0, 0, 0), 0)
    assert bench.edits() == 1, bench.edits()
    assert "A" in bench.session.GetUndoLabel(), bench.session.GetUndoLabel()
    bench.session.Undo()
    near(bench.pose(bench.a), np.eye(4), 0)
    # A drag that comes back, and one that trembles, are no edits.
    bench.entries = bench.session.GetUndoCount()
    bench.drag(start, start + (30, 5), start)
    bench.drag(start, start + (1, 1))
    near(bench.pose(bench.a), np.eye(4), 0)
    assert bench.edits() == 0
    assert bench.renderer.GetActiveCamera().GetPosition() == (0, 0, 100), "the style must not see what the widget takes"
    # Several at once.
    bench.session.SelectAll()
    bench.drag(start, start + (8, 8))
    near(bench.moved(bench.a), bench.moved(bench.b), 0)
    assert bench.edits() == 1 and "2 volumes" in bench.session.GetUndoLabel()


def test_sensitivity():
    bench = Bench()
    bench.session.Select(bench.a, True, True)
    bench.widget.SetTranslationSensitivity(0.1)
    start = bench.pixel((-12, -10, 0))
    bench.drag(start, start + (40, 0))
    near(bench.moved(bench.a), (40 * MM * 0.1, 0, 0), 1e-12)
    assert bench.shape.GetTranslationSensitivity() == 0.1


def test_arrows_and_square():
    bench = Bench()
    bench.session.Select(bench.a, True, True)
    start = bench.handle(Representation.OnArrowX)
    near(start - bench.pixel((0, 0, 0)), (100, 0))
    bench.drag(start, start + (20, 35))
    near(bench.moved(bench.a), (20 * MM, 0, 0), 1e-12)
    start = bench.handle(Representation.OnArrowY)
    bench.drag(start, start + (20, -12))
    near(bench.moved(bench.a), (20 * MM, -12 * MM, 0), 1e-12)
    start = bench.handle(Representation.OnSquareZ)
    bench.drag(start, start + (-20, 12))
    near(bench.moved(bench.a), (0, 0, 0), 1e-12)
    assert bench.edits() == 3


def test_constraints():
    bench = Bench()
    bench.session.Select(bench.a, True, True)
    place = bench.pixel((-12, -10, 0))
    for presses, name, expected in ((1, "x", (10, 0, 0)), (2, "yz", (0, 6, 0)), (3, "free", (10, 6, 0))):
        bench.widget.SetConstraint("free")
        for _ in range(presses):
            bench.key("x")
        assert bench.widget.GetConstraint() == name, bench.widget.GetConstraint()
        bench.drag(place, place + (20, 12))
        near(bench.moved(bench.a), expected, 1e-12)
        bench.session.Undo()
    # Through the slice: the mouse goes up, the volume away from the viewer.
    bench.key("z")
    bench.drag(place, place + (7, 10))
    near(bench.moved(bench.a), (0, 0, -10 * MM), 1e-12)
    bench.key("z")
    assert bench.widget.GetConstraint() == "xy"
    bench.key("y")
    assert bench.widget.GetConstraint() == "y", "another letter begins anew"


# --------------------------------------------------------------------------------------------------------------- rotation

def test_ring():
    bench = Bench()
    bench.session.Select(bench.a, True, True)
    bench.session.SetCentreOfRotation(-4, 6, 0)
    centre = bench.pixel((-4, 6, 0))
    start = np.round(bench.handle(Representation.OnRingZ))
    # Thirty degrees of the mouse around the centre, as near as whole pixels come, at another radius and by a way round.
    radians = math.radians(angle_around(centre, start) + 30)
    end = np.round(centre + 140 * np.array([math.cos(radians), math.sin(radians)]))
    degrees = angle_around(centre, end) - angle_around(centre, start)
    assert abs(degrees - 30) < 0.5
    bench.drag(start, start + (0, 25), end)
    near(bench.pose(bench.a), turn((0, 0, 1), degrees, (-4, 6, 0)))
    assert bench.edits() == 2 and bench.session.GetUndoLabel().startswith("Turn")  # and before it the centre
    # More than a whole turn, at half the sensitivity.
    bench.session.Undo()
    bench.widget.SetRotationSensitivity(0.5)
    places = [centre + 70 * np.array([math.cos(math.radians(a)), math.sin(math.radians(a))]) for a in range(20, 421, 40)]
    bench.shape.ComputeInteractionState(*(int(round(n)) for n in places[0]))
    places = [np.round(place) for place in places]
    radius = np.linalg.norm(start - centre)
    places[0] = np.round(centre + (places[0] - centre) * radius / 70)
    bench.drag(*places)
    total = 360 + angle_around(centre, places[-1]) - angle_around(centre, places[0])
    near(bench.pose(bench.a), turn((0, 0, 1), 0.5 * total, (-4, 6, 0)))


def test_shift_turns_in_the_slice():
    bench = Bench()
    bench.session.Select(bench.a, True, True)
    centre = bench.pixel((0, 0, 0))
    start, end = np.round(centre + (-24, -20)), np.round(centre + (30, -30))
    bench.drag(start, centre + (0, -40), end, modifiers=SHIFT)
    near(bench.pose(bench.a), turn((0, 0, 1), angle_around(centre, end) - angle_around(centre, start)))


def test_the_centre_can_be_moved():
    bench = Bench()
    bench.session.Select(bench.a, True, True)
    start = bench.handle(Representation.OnCentre)
    bench.drag(start, start + (-16, 10))
    centre = [0.0, 0.0, 0.0]
    bench.session.GetCentreOfRotation(centre)
    near(centre, (-16 * MM, 10 * MM, 0), 1e-12)
    assert bench.edits() == 1 and bench.session.GetUndoLabel().startswith("Move the centre"), "one, however many steps"
    bench.session.Undo()
    bench.session.GetCentreOfRotation(centre)
    near(centre, (0, 0, 0), 1e-12)
    bench.session.Redo()
    # It goes with the volume; under the mouse by the key c, and back by Shift + c.
    place = bench.pixel((-12, -10, 0))
    bench.drag(place, place + (20, 0))
    bench.session.GetCentreOfRotation(centre)
    near(centre, (-8 + 10, 5, 0), 1e-12)
    bench.key("c", at=(100, 90))
    bench.session.GetCentreOfRotation(centre)
    near(bench.pixel(centre), (100, 90))
    bench.key("C", SHIFT, at=(100, 90))
    bench.session.GetCentreOfRotation(centre)
    near(centre, (10, 0, 0), 1e-9)


# ------------------------------------------------------------------------------------------------------------------ clicks

def test_clicks_select():
    bench = Bench()
    # Away from the handles of either.
    both, only_a, only_b, none = (bench.pixel(point) for point in ((12, -10, 0), (-10, -3, 0), (30, 10, 0), (-60, 10, 0)))
    bench.click(only_a)
    assert bench.selected() == {bench.a}
    bench.click(only_b, CONTROL)
    assert bench.selected() == {bench.a, bench.b}
    bench.click(only_b, CONTROL)
    assert bench.selected() == {bench.a}
    bench.click(only_b)
    assert bench.selected() == {bench.b}
    bench.click(both)
    assert bench.selected() == {bench.a}, "where both are seen, the next below"
    bench.click(both)
    assert bench.selected() == {bench.b}
    bench.click(none)
    assert bench.selected() == {bench.b}
    assert bench.edits() == 0
    corner = bench.pixel((-19, -19, 0))  # in the box of A, but not in its valid region
    bench.click(corner)
    assert bench.selected() == {bench.b}
    bench.session.SetVisible(bench.a, False)
    bench.click(only_a)
    assert bench.selected() == {bench.b}, "what is hidden is not under the mouse"


def test_nothing_selected():
    bench = Bench()
    bench.session.SelectNone()
    place = bench.pixel((-10, 10, 0))
    bench.drag(place, place + (50, 0))
    bench.drag(bench.pixel((0, 0, 0)), bench.pixel((0, 0, 0)) + (50, 0), modifiers=SHIFT)
    for key in ("Left", "Prior", "x", "c", "plus", "Escape"):
        bench.key(key)
    near(bench.pose(bench.a), np.eye(4), 0)
    near(bench.pose(bench.b), np.eye(4), 0)
    assert bench.edits() == 1, "the key c chose a centre"
    assert not bench.shape.GetHandlePosition(Representation.OnArrowX, [0.0, 0.0])
    bench.widget.StepTool(vtkMatrix4x4(), True)
    bench.widget.StepTool(vtkMatrix4x4(), False)
    # No session, no camera, no interactor: nothing happens either.
    bench.widget.SetSession(None)
    bench.drag(place, place + (50, 0))
    bench.key("Left")
    bench.window.Render()
    lonely = vtkUltrasoundAlignmentWidget()
    lonely.SetSession(bench.session)
    lonely.GetAlignmentRepresentation().BuildRepresentation()
    lonely.StepTool(vtkMatrix4x4(), True)
    lonely.CancelDrag()


# -------------------------------------------------------------------------------------------------------------------- keys

def test_keys():
    bench = Bench()
    bench.session.Select(bench.a, True, True)
    for key, expected in (("Right", (1, 0, 0)), ("Left", (-1, 0, 0)), ("Up", (0, 1, 0)), ("Down", (0, -1, 0)), ("Prior", (0, 0, 1)),
                          ("Next", (0, 0, -1))):
        bench.key(key)
        near(bench.moved(bench.a), expected, 1e-12)
        bench.session.Undo()
    for key, axis in (("Left", (0, 0, 1)), ("Right", (0, 0, -1)), ("Up", (-1, 0, 0)), ("Down", (1, 0, 0)), ("Prior", (0, 1, 0)),
                      ("Next", (0, -1, 0))):
        bench.key(key, CONTROL)
        near(bench.pose(bench.a), turn(axis, 1.0), 1e-12)
        bench.session.Undo()
    bench.key("plus")
    bench.key("equal")
    bench.key("minus")
    assert bench.widget.GetTranslationStep() == 2.0 and bench.widget.GetRotationStep() == 2.0
    before = bench.session.GetUndoCount()
    bench.key("Right")
    bench.key("Up")
    near(bench.moved(bench.a), (2, 2, 0), 1e-12)
    assert bench.session.GetUndoCount() == before + 2
    bench.key("Right", at=(500, 150))
    near(bench.moved(bench.a), (2, 2, 0), 1e-12)


def test_escape():
    bench = Bench()
    bench.session.Select(bench.a, True, True)
    events = []
    for event in (vtkCommand.StartInteractionEvent, vtkCommand.InteractionEvent, vtkCommand.EndInteractionEvent):
        bench.widget.AddObserver(event, lambda caller, name: events.append(name))
    place = bench.pixel((-12, -10, 0))
    bench.drag(place, place + (20, 10), release=False)
    assert bench.widget.IsDragging()
    near(bench.moved(bench.a), (10, 5, 0), 1e-12)
    bench.key("Escape")
    near(bench.pose(bench.a), np.eye(4), 0)
    assert not bench.widget.IsDragging()
    bench.play(("MouseMoveEvent", place + (40, 40)), ("LeftButtonReleaseEvent", place + (40, 40)))
    near(bench.pose(bench.a), np.eye(4), 0)
    assert bench.edits() == 0 and bench.selected() == {bench.a}
    assert events == ["StartInteractionEvent", "InteractionEvent", "InteractionEvent", "EndInteractionEvent"], events
    # The next drag is a drag again.
    bench.drag(place, place + (20, 10))
    near(bench.moved(bench.a), (10, 5, 0), 1e-12)
    assert bench.edits() == 1
    # A chosen centre comes back too; switching the widget off cancels.
    bench.session.SetCentreOfRotation(1, 2, 3)
    bench.drag(place + (20, 10), place, release=False)
    bench.widget.Off()
    centre = [0.0, 0.0, 0.0]
    bench.session.GetCentreOfRotation(centre)
    near(centre, (1, 2, 3), 0)
    near(bench.moved(bench.a), (10, 5, 0), 1e-12)
    bench.play(("LeftButtonReleaseEvent", place))
    assert bench.edits() == 2, "the centre that was chosen is the second"


# ---------------------------------------------------------------------------------------------------- what can go wrong

def test_a_volume_that_goes_during_a_drag():
    bench = Bench()
    bench.session.SelectAll()
    place = bench.pixel((-12, -10, 0))
    bench.drag(place, place + (20, 10), release=False)
    bench.session.RemoveVolume(bench.a)
    bench.play(("MouseMoveEvent", place + (40, 20)))
    near(bench.moved(bench.b), (20, 10, 0), 1e-12)
    bench.session.RemoveVolume(bench.b)
    bench.play(("MouseMoveEvent", place + (50, 20)), ("LeftButtonReleaseEvent", place + (50, 20)))
    assert bench.session.GetNumberOfVolumes() == 0
    bench.session.Undo()
    near(bench.pose(bench.a), np.eye(4), 0)
    near(bench.pose(bench.b), np.eye(4), 0)


def test_tracker():
    bench = Bench()
    bench.session.Select(bench.b, True, True)

    def matrix(values):
        result = vtkMatrix4x4()
        result.DeepCopy(np.asarray(values, float).ravel())
        return result

    start, end = turn((1, 2, 3), 40, (5, 6, 7)), turn((3, -1, 2), 100, (-2, 4, 1))
    assert bench.widget.StepTool(matrix(start), False)
    assert bench.widget.StepTool(matrix(start), True)
    near(bench.pose(bench.b), np.eye(4), 0)
    for t in (0.3, 0.6):
        assert bench.widget.StepTool(matrix(turn((1, 2, 3), 40 + 40 * t, (5, 6, 7))), True)
    assert bench.widget.StepTool(matrix(end), True)
    near(bench.pose(bench.b), end @ np.linalg.inv(start), 1e-10)
    near(bench.pose(bench.a), np.eye(4), 0)
    bad = np.eye(4)
    bad[0, 0] = 2
    errors = []
    bench.shape.AddObserver(vtkCommand.ErrorEvent, lambda caller, event: errors.append(event))
    assert not bench.widget.StepTool(matrix(bad), True) and errors
    near(bench.pose(bench.b), end @ np.linalg.inv(start), 1e-10)
    assert bench.widget.StepTool(matrix(end), False)
    assert bench.edits() == 1 and "tracker" in bench.session.GetUndoLabel()
    bench.session.Undo()
    near(bench.pose(bench.b), np.eye(4), 0)


# ---------------------------------------------------------------------------------------------------------------------- 3D

def test_arrows_in_3d():
    for parallel in (False, True):
        bench = Bench(three_d=True)
        if parallel:
            bench.renderer.GetActiveCamera().ParallelProjectionOn()
            bench.renderer.GetActiveCamera().SetParallelScale(80)
            bench.shape.SetViewKind("3d")
        bench.session.Select(bench.a, True, True)
        for axis, state in enumerate((Representation.OnArrowX, Representation.OnArrowY, Representation.OnArrowZ)):
            # From the tip to where the point 9 mm further along the axis is seen; whole pixels are what the mouse can say.
            unit = np.eye(3)[axis]
            start = bench.handle(state)
            tip = 100 * millimetres_per_pixel(bench) * unit
            near(bench.pixel(tip), start)
            bench.drag(start, bench.pixel(tip + 9 * unit))
            moved = bench.moved(bench.a)
            near(np.delete(moved, axis), (0, 0), 1e-12)
            assert abs(moved[axis] - 9) < 1.0, (parallel, axis, moved)
            bench.session.Undo()
        # What is grasped at the centre's depth stays under the mouse: a square.
        start = np.round(bench.handle(Representation.OnSquareZ))
        bench.drag(start, start + (25, 5))
        moved = bench.moved(bench.a)
        assert abs(moved[2]) < 1e-12 and np.linalg.norm(moved) > 1
        bench.session.Undo()


def test_rings_and_ball_in_3d():
    bench = Bench(three_d=True)
    bench.session.Select(bench.a, True, True)
    for axis, state in enumerate((Representation.OnRingX, Representation.OnRingY, Representation.OnRingZ)):
        start = np.round(bench.handle(state))
        bench.drag(start, start + (10, 4), start + (18, 14))
        pose = bench.pose(bench.a)
        near(pose[:3, :3] @ np.eye(3)[axis], np.eye(3)[axis], 1e-12)
        assert not np.allclose(pose, np.eye(4), atol=1e-3)
        bench.session.Undo()
    # Shift-drag anywhere: a ball of the rings' size whose front follows the mouse. The camera stays.
    before = bench.renderer.GetActiveCamera().GetPosition()
    bench.drag((40, 40), (40 + 39, 40), modifiers=SHIFT)
    assert bench.renderer.GetActiveCamera().GetPosition() == before
    near(bench.pose(bench.a), turn(up_of(bench), math.degrees(39 / 78)), 1e-9)
    # Without it the camera's style has the mouse.
    bench.drag((40, 40), (80, 40))
    assert bench.renderer.GetActiveCamera().GetPosition() != before


def millimetres_per_pixel(bench):
    camera = bench.renderer.GetActiveCamera()
    if camera.GetParallelProjection():
        return 2 * camera.GetParallelScale() / HEIGHT
    return 2 * camera.GetDistance() * math.tan(math.radians(camera.GetViewAngle() / 2)) / HEIGHT


def up_of(bench):
    camera = bench.renderer.GetActiveCamera()
    sight = np.array(camera.GetDirectionOfProjection())
    right = np.cross(sight, camera.GetViewUp())
    up = np.cross(right, sight)
    return up / np.linalg.norm(up)


# ------------------------------------------------------------------------------------------------------------- what is seen

def test_handles_are_seen_and_marked():
    bench = Bench()
    bench.window.Render()
    empty = pixels_of(bench.window)
    assert empty.max() == 0, "nothing is selected: no handles"
    bench.session.Select(bench.a, True, True)
    bench.window.Render()
    plain = pixels_of(bench.window)
    assert 2000 < (plain.max(axis=1) > 100).sum() < 20000
    bench.play(("MouseMoveEvent", bench.handle(Representation.OnArrowX)))
    marked = pixels_of(bench.window)
    changed = np.abs(marked - plain).max(axis=1).reshape(HEIGHT, WIDTH) > 50
    rows, columns = np.nonzero(changed)
    assert changed.sum() > 100 and columns.min() > WIDTH // 2 and np.abs(rows - HEIGHT / 2).max() < 12, "the arrow alone is marked"
    bench.play(("MouseMoveEvent", (5, 5)))
    assert np.array_equal(pixels_of(bench.window), plain)
    bench.play(("MouseMoveEvent", bench.handle(Representation.OnArrowX)), ("LeaveEvent", (300, 150)))
    assert np.array_equal(pixels_of(bench.window), plain), "the mouse has left the window"
    # As large at another zoom.
    bench.renderer.GetActiveCamera().SetParallelScale(20)
    bench.window.Render()
    assert np.abs(pixels_of(bench.window) - plain).max(axis=1).astype(bool).sum() < 50
    bench.shape.ShowHandlesOff()
    bench.window.Render()
    assert pixels_of(bench.window).max() == 0
    assert bench.shape.ComputeInteractionState(200, 150) == Representation.OnSelected


def test_names_that_are_not_there():
    bench = Bench()
    errors = []
    bench.shape.AddObserver(vtkCommand.ErrorEvent, lambda caller, event: errors.append(event))
    bench.widget.SetConstraint("w")
    bench.shape.SetViewKind("4d")
    assert len(errors) == 2 and bench.widget.GetConstraint() == "free" and bench.shape.GetViewKind() == "automatic"


def test_the_views_of_a_session():
    """The widget in the renderers that the workbench puts into its windows; the pictures of the manual are made here."""
    liver = pathlib.Path(__file__).resolve().parents[2] / ".." / "shared" / "data" / "liver"
    bench = Bench()
    if liver.is_dir():
        session = bench.session = vtkUltrasoundAlignmentSession()
        bench.a, bench.b = (session.OpenVolume(str(liver / f"liver_volume_{letter}.mha")) for letter in "AB")
    session = bench.session
    session.Select(bench.b, True, True)
    slice = vtkUltrasoundSliceView()
    for view, name, state in ((slice, "slice", Representation.OnArrowX),):
        bench.widget.Off()
        bench.widget.SetSession(session)
        bench.window.RemoveRenderer(bench.renderer)
        bench.renderer = view.GetRenderer()
        bench.window.AddRenderer(bench.renderer)
        bench.window.SetSize(560, 420)
        bench.widget.SetDefaultRenderer(bench.renderer)
        bench.widget.SetCurrentRenderer(bench.renderer)
        view.SetSession(session)
        if view is slice:
            view.SetPixelSize(560, 420)
        view.Fit()
        view.Update()
        bench.window.Render()
        bench.widget.On()
        if view is slice:
            # What both say of a pixel is the same.
            for pixel in ((0, 0), (300, 123), (559, 419)):
                one, other = [0.0] * 3, [0.0] * 3
                view.PixelToWorld(*pixel, one)
                assert bench.shape.PositionToWorld(*pixel, other)
                near(one, other, 1e-6)
            # A drag of what is seen there, by millimetres of this view.
            before, count = bench.pose(bench.b), session.GetUndoCount()
            place = next((x, y) for y in range(100, 400, 20) for x in range(60, 500, 20)
                         if bench.shape.ComputeInteractionState(x, y) == Representation.OnSelected)
            bench.drag(place, (place[0] + 30, place[1] - 10))
            right, up, mm = [0.0] * 3, [0.0] * 3, view.GetMillimetresPerPixel()
            view.GetRight(right)
            view.GetUp(up)
            near((bench.pose(bench.b) - before)[:3, 3], mm * (30 * np.array(right) - 10 * np.array(up)), 1e-9)
            assert session.GetUndoCount() == count + 1
            session.Undo()
        bench.play(("MouseMoveEvent", bench.handle(state)))
        view.Update()
        bench.save(f"alignment-widget-{name}.png")


for name, test in sorted((name, value) for name, value in globals().items() if name.startswith("test_")):
    test()
    print(name)
