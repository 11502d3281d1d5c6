#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Slice views of a session: where things are seen, what is drawn when, and pictures of the liver pair.

Usage: TestUltrasoundSliceView.py [FOLDER]   (FOLDER: pictures of the liver are written there)
"""
import pathlib
import sys
import unittest

import numpy as np
import vtkmodules.vtkRenderingFreeType
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import vtkRenderWindow, vtkWindowToImageFilter

from echorama.EchoramaWidgets import vtkUltrasoundAlignmentSession, vtkUltrasoundSliceView

LIVER = pathlib.Path(__file__).resolve().parents[2] / ".." / "shared" / "data" / "liver"
FOLDER = pathlib.Path(sys.argv.pop(1)) if len(sys.argv) > 1 and not sys.argv[1].startswith("-") else None


def image_of(grey, origin=(0, 0, 0), valid=None):
    """A volume of voxels of 1 mm, [z, y, x]."""
    image = vtkImageData()
    image.SetDimensions(*grey.shape[::-1])
    image.SetOrigin(origin)
    valid = np.ones(grey.shape) if valid is None else valid
    for name, values in (("Intensity", grey), ("ValidRegion", valid.astype(np.uint8))):
        array = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    image.GetPointData().SetActiveScalars("Intensity")
    return image


def pixels(image):
    """[row from below, column, RGBA]"""
    width, height, _ = image.GetDimensions()
    return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)


def window_of(*views, columns=None):
    columns = columns or len(views)
    rows = (len(views) + columns - 1) // columns
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    size = [0, 0]
    views[0].GetPixelSize(size)
    window.SetSize(columns * size[0], rows * size[1])
    for n, view in enumerate(views):
        x, y = n % columns, rows - 1 - n // columns
        view.GetRenderer().SetViewport(x / columns, y / rows, (x + 1) / columns, (y + 1) / rows)
        window.AddRenderer(view.GetRenderer())
    return window


def rendered(window):
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.SetInputBufferTypeToRGB()
    grab.ReadFrontBufferOff()
    grab.Update()
    return grab.GetOutput()


def shot(window, name):
    if FOLDER:
        FOLDER.mkdir(parents=True, exist_ok=True)
        writer = vtkPNGWriter()
        writer.SetFileName(str(FOLDER / name))
        writer.SetInputData(rendered(window))
        writer.Write()


class Errors:
    """Catches what an object reports."""

    def __init__(self, thing):
        self.messages = []
        self.thing = thing

        def report(_, event, message):
            self.messages.append(message)

        report.CallDataType = "string0"
        self.tag = thing.AddObserver(vtkCommand.ErrorEvent, report)

    def __enter__(self):
        return self.messages

    def __exit__(self, *_):
        self.thing.RemoveObserver(self.tag)


def array_of(method, count, *arguments):
    values = [0.0] * count
    method(*arguments, values)
    return np.array(values)


class SliceView(unittest.TestCase):
    def setUp(self):
        random = np.random.default_rng(1)
        self.session = vtkUltrasoundAlignmentSession()
        self.grey = random.integers(30, 220, (24, 32, 40)).astype(np.uint8)
        self.a = self.session.AddVolume(image_of(self.grey, (-20, -16, -12)), None, "A")
        self.b = self.session.AddVolume(image_of(random.integers(0, 255, (20, 20, 20)).astype(np.uint8), (0, 0, 0)), None, "B")
        self.session.SetColour(self.a, 1, 1, 1)
        self.session.SetColour(self.b, 1, 0.5, 0)
        self.session.SetGreyWindow(0, 255)
        self.view = vtkUltrasoundSliceView()
        self.view.SetSession(self.session)
        self.view.SetPixelSize(300, 200)

    def picture(self, view=None):
        view = view or self.view
        view.Update()
        return pixels(view.GetPicture()).copy()

    def test_where_the_body_is(self):
        """Radiology's views in LPS: the marked corner of a volume is seen where the table says."""
        grey = np.zeros((21, 21, 21), np.uint8)
        grey[16:, 16:, 16:] = 255  # left, back and head
        session = vtkUltrasoundAlignmentSession()
        session.AddVolume(image_of(grey), None, "corner")
        session.SetGreyWindow(0, 255)
        for axis, x, y in (("z", 1, 0), ("y", 1, 1), ("x", 1, 1)):  # bright on the right (1), up (1) or down (0)
            view = vtkUltrasoundSliceView()
            view.SetSession(session)
            view.SetAxis(axis)
            view.SetPixelSize(100, 100)
            view.SetPosition(18)
            view.Fit()
            bright = self.picture(view)[:, :, 0] > 128
            rows, columns = np.nonzero(bright)
            self.assertGreater(bright.sum(), 100, axis)
            self.assertEqual((columns.mean() > 50, rows.mean() > 50), (bool(x), bool(y)), axis)
            view.SetPosition(2)
            self.assertEqual((self.picture(view)[:, :, 0] > 128).sum(), 0, axis)

    def test_pixels_and_the_world(self):
        view = self.view
        view.SetMillimetresPerPixel(0.5)
        view.SetFocus(-0.5, -0.5, 3)
        view.SetLinear(False)
        for axis in "xyz":
            view.SetAxis(axis)
            for pixel in ((0, 0), (150.3, 20.7), (299, 199)):
                world = array_of(view.PixelToWorld, 3, *pixel)
                np.testing.assert_allclose(array_of(view.WorldToPixel, 2, *world), pixel, atol=1e-9)
        view.SetAxis("z")
        self.session.SetVisible(self.b, False)
        picture = self.picture()
        for x in range(120, 180, 7):
            for y in range(80, 120, 7):
                i, j, k = np.floor(array_of(view.PixelToWorld, 3, x, y) - (-20, -16, -12) + 0.5).astype(int)
                self.assertEqual(picture[y, x, 0], self.grey[k, j, i])

    def test_the_window_shows_the_picture_pixel_by_pixel(self):
        view = self.view
        view.SetAnnotated(False)
        view.SetNormalAndUp(1, 2, -3, 0, -1, 0.2)
        view.Update()
        window = window_of(view)
        window.Render()
        picture = pixels(view.GetPicture()).astype(int)
        expected = picture[:, :, :3] * picture[:, :, 3:] / 255
        self.assertGreater((picture[:, :, 3] > 0).sum(), 5000)
        self.assertLessEqual(np.abs(pixels(rendered(window)) - expected).max(), 2)
        # The renderer's world is the world: what lies at a pixel's place is drawn there.
        for pixel in ((10, 20), (250.5, 190)):
            view.GetRenderer().SetWorldPoint(*array_of(view.PixelToWorld, 3, *pixel), 1)
            view.GetRenderer().WorldToDisplay()
            np.testing.assert_allclose(view.GetRenderer().GetDisplayPoint()[:2], np.add(pixel, 0.5), atol=1e-6)
        corners = array_of(view.GetPlaneCorners, 12).reshape(4, 3)
        np.testing.assert_allclose(corners[0], array_of(view.PixelToWorld, 3, -0.5, -0.5), atol=1e-9)
        np.testing.assert_allclose(corners[2], array_of(view.PixelToWorld, 3, 299.5, 199.5), atol=1e-9)

    def test_it_draws_only_what_is_out_of_date(self):
        view, heard = self.view, []
        view.Update()
        view.AddObserver(vtkCommand.ModifiedEvent, lambda *_: heard.append(1))
        self.assertFalse(view.Update())
        self.session.Select(self.a, True, True)
        self.assertFalse(view.Update(), "the selection does not show in a blend")
        self.assertEqual(heard, [])
        before = self.picture()
        self.session.TranslateSelection(3, 0, 0)
        self.assertTrue(heard)
        self.assertTrue(view.Update())
        self.assertFalse(view.Update())
        self.assertFalse(np.array_equal(before, self.picture()))
        self.session.Undo()
        np.testing.assert_array_equal(before, self.picture())
        view.SetLinear(view.GetLinear())
        view.SetAxis(view.GetAxis())
        self.assertFalse(view.Update(), "nothing has changed")
        view.SetBrush(0, 0, 0, 5)
        time = view.GetPicture().GetMTime()
        self.assertTrue(view.Update())
        self.assertEqual(view.GetPicture().GetMTime(), time, "a brush is drawn without the picture")
        view.SetSession(None)
        self.assertEqual(self.picture().max(), 0)

    def test_pointer_and_measurements_are_drawn_without_the_picture(self):
        view = self.view
        self.picture()
        window = window_of(view)
        window.Render()
        plain, time = pixels(rendered(window)).copy(), view.GetPicture().GetMTime()

        def differs():
            self.assertTrue(view.Update())
            self.assertEqual(view.GetPicture().GetMTime(), time)
            window.Render()
            return (pixels(rendered(window)) != plain).any()

        cursor = array_of(view.GetCursor, 3)
        view.SetPointer(*(cursor + (3, 2, 0)))
        self.assertTrue(differs())
        view.HidePointer()
        self.assertFalse(differs())
        view.HidePointer()
        self.assertFalse(view.Update())
        self.assertTrue(self.session.SetDistance(1, cursor - (5, 0, 0), cursor + (5, 3, 0)))
        self.assertTrue(differs())
        self.assertTrue(self.session.SetDistance(1, cursor - (5, 0, 6), cursor + (5, 3, -6)), "beyond 5 mm it is not drawn")
        self.assertFalse(differs())

    def test_single_volumes_without_an_edit(self):
        view = self.view
        everything = self.picture()
        view.SetShown("selected")
        self.session.Select(self.a, True, True)
        alone = self.picture()
        view.SetShown("others")
        self.session.SetVisible(self.a, False)
        view.AddOnly(self.a)
        np.testing.assert_array_equal(self.picture(), alone)
        view.ClearOnly()
        self.session.Undo()
        view.SetShown("all")
        np.testing.assert_array_equal(self.picture(), everything)

    def test_shifts_are_laid_over_what_is_seen(self):
        view = self.view
        plain = self.picture()
        shifts = vtkImageData()
        shifts.SetDimensions(2, 1, 1)
        shifts.SetSpacing(1000, 1000, 1000)
        shifts.SetOrigin(-500, 0, 0)
        shifts.GetPointData().SetScalars(numpy_to_vtk(np.array([1.0, np.nan], np.float32), deep=True))
        view.SetShifts(shifts, 2.0)
        laid = self.picture()
        np.testing.assert_array_equal(laid[:, :, 3], plain[:, :, 3])
        cell = np.array([[self.world(x, y)[0] < 0 for x in range(laid.shape[1])] for y in range(laid.shape[0])])
        changed = (laid != plain).any(axis=2)
        self.assertFalse(changed[:, 3:][~cell[:, 3:] & ~cell[:, :-3]].any(), "nothing is known there")
        inside = cell[:, :-3] & cell[:, 3:] & (plain[:, :-3, 3] > 0)
        self.assertGreater(changed[:, :-3][inside].mean(), 0.95 if inside.any() else -1)
        view.SetShifts(shifts, 2.0, True)
        self.assertLess(np.abs(self.picture().astype(int) - plain).sum(), np.abs(laid.astype(int) - plain).sum())
        view.SetShifts(None)
        np.testing.assert_array_equal(self.picture(), plain)
        view.SetShifts(shifts, 2.0)
        np.testing.assert_array_equal(self.picture(), laid)
        values = shifts.GetPointData().GetScalars()  # a filter that has run again has the same output
        values.Fill(2.0)
        values.Modified()
        view.SetShifts(shifts, 2.0)
        self.assertFalse(np.array_equal(self.picture(), laid))
        view.SetShifts(shifts, 2.0)
        self.assertFalse(view.Update(), "nothing has changed")

    def world(self, x, y):
        place = [0.0] * 3
        self.view.PixelToWorld(x, y, place)
        return place

    def test_what_is_shown(self):
        view = self.view
        view.SetPosition(5)
        everything = self.picture()
        seen = {}
        self.session.Select(self.a, True, True)
        for shown in ("selected", "others", "all"):
            view.SetShown(shown)
            seen[shown] = self.picture()
        np.testing.assert_array_equal(seen["all"], everything)
        a, b = seen["selected"].astype(int), seen["others"].astype(int)
        self.assertTrue((a[:, :, 0] == a[:, :, 2]).all(), "A is white")
        self.assertTrue((b[:, :, 2] == 0).all(), "B is orange")
        both = (a[:, :, 3] > 0) & (b[:, :, 3] > 0)
        self.assertGreater(both.sum(), 1000)
        self.assertLessEqual(np.abs(everything[both][:, :3] - (a + b)[both][:, :3] / 2).max(), 1)
        view.SetMode("difference")
        self.session.SetColour(self.b, 1, 1, 1)
        view.SetShown("others")
        b = self.picture().astype(int) * 4  # alone, it is drawn at a quarter
        view.SetShown("all")
        self.assertLessEqual(np.abs(self.picture()[both][:, 0] - np.abs(a - b)[both][:, 0]).max(), 3)
        view.SetMode("checkerboard")
        view.SetSquarePixels(10)
        board = self.picture()
        rows, columns = np.nonzero(both & ((np.indices(both.shape) // 10).sum(axis=0) % 2 == 0))
        np.testing.assert_array_equal(board[rows, columns], seen["selected"][rows, columns])

    def test_zoom_pan_and_fit(self):
        view = self.view
        view.Fit()
        self.assertGreater(self.picture()[:, :, 3].any(axis=1).sum(), 150, "fits the height")
        world = array_of(view.PixelToWorld, 3, 40, 50)
        mm = view.GetMillimetresPerPixel()
        view.Zoom(2.0, 40, 50)
        self.assertAlmostEqual(view.GetMillimetresPerPixel(), mm / 2)
        np.testing.assert_allclose(array_of(view.PixelToWorld, 3, 40, 50), world, atol=1e-9)
        view.Pan(7, -3)
        np.testing.assert_allclose(array_of(view.PixelToWorld, 3, 47, 47), world, atol=1e-9)
        view.Update()
        tag = view.AddObserver(vtkCommand.ModifiedEvent, lambda *_: view.Update())  # who draws at once sees the same
        view.Zoom(2.0, 10, 10)
        view.RemoveObserver(tag)
        view.Update()
        np.testing.assert_allclose(view.GetPicture().GetOrigin(), array_of(view.PixelToWorld, 3, 0, 0), atol=1e-9)
        for axis, low, high in (("z", -12.5, 19.5), ("x", -20.5, 19.5)):
            view.SetAxis(axis)
            np.testing.assert_allclose(array_of(view.GetPositionRange, 2), (low, high))
            view.SetPosition(4.25)
            self.assertAlmostEqual(view.GetPosition(), 4.25)

    def test_linked_views(self):
        other = vtkUltrasoundSliceView()
        other.SetSession(self.session)
        other.SetAxis("x")
        other.LinkTo(self.view)
        self.view.SetPosition(3)
        other.SetPosition(-2)
        np.testing.assert_allclose(array_of(self.view.GetCursor, 3)[[0, 2]], (-2, 3))
        self.view.Zoom(3, 0, 0)
        self.assertEqual(other.GetMillimetresPerPixel(), self.view.GetMillimetresPerPixel())
        focus = array_of(other.GetFocus, 3)
        self.view.Pan(10, 10)
        np.testing.assert_array_equal(array_of(other.GetFocus, 3), focus)
        self.view.SetCursor(1, 2, 4)
        self.assertAlmostEqual(other.GetPosition(), 1)
        self.assertAlmostEqual(self.view.GetPosition(), 4)
        other.Turn(10, 20)
        self.assertEqual(other.GetAxis(), "oblique")
        normal = array_of(other.GetNormal, 3)
        self.assertAlmostEqual(normal @ (array_of(other.GetFocus, 3) - (1, 2, 4)), 0)
        frame = np.array([array_of(other.GetRight, 3), array_of(other.GetUp, 3), normal])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        self.assertAlmostEqual(np.linalg.det(frame), 1)
        del other  # leaves the others in peace
        self.view.SetCursor(0, 0, 0)
        self.assertFalse(self.view.IsLinked())

    def test_the_colour_of_a_linked_plane(self):
        other = vtkUltrasoundSliceView()
        other.SetAxis("x")
        other.LinkTo(self.view)
        self.view.SetSession(None)
        window, lines = window_of(self.view), {}
        for colour in ((1, 0, 1), (0, 1, 0)):
            other.SetColour(*colour)
            self.assertTrue(self.view.Update(), "its line is out of date")
            window.Render()
            seen = pixels(rendered(window)).astype(int)
            lines[colour] = (np.abs(seen - np.multiply(colour, 110)).max(axis=2) < 3).sum()
        self.assertGreater(min(lines.values()), 150, "a line from below to above, but for a gap at the cursor")

    def test_level_of_detail(self):
        full = self.picture()
        self.view.SetInteractiveStep(4)
        self.view.SetInteractive(True)
        self.assertFalse(self.view.Update(), "what is there is good")
        self.view.SetPosition(1.0)
        self.view.SetPosition(0.0)
        self.assertTrue(self.view.Update())
        self.assertEqual(self.view.GetPictureStep(), 4)
        self.view.SetInteractive(False)
        np.testing.assert_array_equal(self.picture(), full)
        self.assertEqual(self.view.GetPictureStep(), 1)
        self.assertGreater(self.view.GetPictureSeconds(), 0)

    def test_bad_input_is_reported_and_changes_nothing(self):
        view, nan = self.view, float("nan")
        before = self.picture()
        for call, word in ((lambda: view.SetAxis("w"), "axis"), (lambda: view.SetMode(None), "mode"),
                           (lambda: view.SetShown("some"), "shows"),
                           (lambda: view.SetSquarePixels(1), "squares"), (lambda: view.SetMillimetresPerPixel(0), "pixel"),
                           (lambda: view.SetMillimetresPerPixel(nan), "pixel"), (lambda: view.SetPixelSize(0, 5), "size"),
                           (lambda: view.SetPosition(nan), "position"), (lambda: view.SetFocus(nan, 0, 0), "focus"),
                           (lambda: view.SetCursor(0, nan, 0), "cursor"), (lambda: view.Zoom(-1, 0, 0), "factor"),
                           (lambda: view.SetNormalAndUp(1, 0, 0, 2, 0, 0), "parallel"),
                           (lambda: view.SetBrush(0, 0, 0, -1), "brush"), (lambda: view.SetPointer(0, nan, 0), "pointer"),
                           (lambda: view.SetShifts(vtkImageData(), 1.0), "floats"), (lambda: view.SetShifts(vtkImageData(), 0.0), "scale"),
                           (lambda: view.SetColour(0, 2, 0), "colour"), (lambda: view.SetColour(0, nan, 0), "colour"),
                           (lambda: view.SetInteractiveStep(17), "step"), (lambda: view.Turn(nan, 0), "angles")):
            with Errors(view) as messages:
                call()
            self.assertEqual(len(messages), 1, word)
            self.assertIn(word, messages[0])
        self.assertFalse(view.Update())
        np.testing.assert_array_equal(self.picture(), before)

    def test_the_session_may_go(self):
        view = vtkUltrasoundSliceView()
        session = vtkUltrasoundAlignmentSession()
        view.SetSession(session)
        volume = session.AddVolume(image_of(self.grey), None, "A")
        self.assertGreater(self.picture(view)[:, :, 3].max(), 0)
        session.RemoveVolume(volume)
        self.assertEqual(self.picture(view).max(), 0, "no volumes, no picture")
        self.assertTrue(np.isfinite(array_of(view.GetFocus, 3)).all())
        del session
        self.assertFalse(view.Update())

    def test_liver(self):
        if not (LIVER / "liver_volume_A.mha").exists():
            self.skipTest(f"{LIVER} is not there")
        session = vtkUltrasoundAlignmentSession()
        ids = [session.OpenVolume(str(LIVER / f"liver_volume_{name}.mha")) for name in "AB"]
        session.SetColour(ids[0], 0.45, 0.85, 1.0)
        session.SetColour(ids[1], 1.0, 0.65, 0.35)
        session.Select(ids[0], True, True)
        views = []
        for axis in "zyx":
            view = vtkUltrasoundSliceView()
            view.SetSession(session)
            view.SetPixelSize(400, 400)
            view.SetAxis(axis)
            if views:
                view.LinkTo(views[0])
            views.append(view)
        views[0].Fit()
        views[0].SetCursor(*(array_of(views[0].GetCursor, 3) + (0, -6, 0)))
        window = window_of(*views)
        for view in views:
            view.Update()
        window.Render()
        shot(window, "slice_views.png")
        seen = pixels(rendered(window))
        self.assertGreater((seen.max(axis=2) > 40).mean(), 0.05, "there is a liver to see")

        modes = []
        for mode in ("blend", "difference", "checkerboard"):
            view = vtkUltrasoundSliceView()
            view.SetSession(session)
            view.SetPixelSize(400, 400)
            view.SetMode(mode)
            view.SetFocus(*array_of(views[0].GetFocus, 3))
            view.SetMillimetresPerPixel(0.35)
            view.Update()
            modes.append(view)
        window = window_of(*modes)
        window.Render()
        shot(window, "slice_modes.png")
        levels = [pixels(view.GetPicture())[:, :, :3].mean() for view in modes]
        self.assertLess(levels[1], 0.8 * levels[0], "the two agree better than either with nothing")

        # Painted, and carved.
        middle = array_of(views[0].GetCursor, 3)
        self.assertTrue(session.BeginStroke(ids[0], "paint", 3.0, 255.0, 1.0, 0.5, True))
        for t in np.linspace(-1, 1, 30):
            self.assertTrue(session.ExtendStroke(*(middle + (25 * t, 12 * np.sin(4 * t), 0))))
        self.assertTrue(session.EndStroke())
        carve = middle + (-20, 30, 0)
        self.assertTrue(session.BeginStroke(ids[0], "carve", 14.0, 0.0, 1.0, 0.5, True))
        self.assertTrue(session.ExtendStroke(*carve))
        self.assertTrue(session.EndStroke())
        for view in modes[:2]:
            view.SetMode("blend")
        modes[0].SetShown("selected")
        modes[1].SetShown("all")
        modes[2].SetNormalAndUp(0.3, 0.5, -1, 0, -1, 0)
        modes[2].SetMode("blend")
        modes[0].SetBrush(*carve, 14.0)
        for view in modes:
            view.Update()
        window.Render()
        shot(window, "painting.png")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v", *sys.argv[1:]])
