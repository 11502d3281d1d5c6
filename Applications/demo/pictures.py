# SPDX-License-Identifier: BSD-3-Clause
"""The pictures of the demo. Slices are cut in the world (see volumes.py), so that all of them show the same places."""
import dataclasses

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import (vtkColorTransferFunction, vtkRenderer, vtkRenderWindow, vtkVolume, vtkVolumeProperty,
                                         vtkWindowToImageFilter)
from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkOpenGLGPUVolumeRayCastMapper
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 (registers what draws)

from volumes import blurred, blurred_where_real

COLOURS = ["#ffb000", "#4fc3f7", "#ff6f91", "#9ccc65", "#ce93d8", "#fff176", "#80cbc4", "#ffab91"]
NAMES = "xyz"


def colour_of(index):
    return COLOURS[index % len(COLOURS)]


@dataclasses.dataclass(frozen=True)
class View:
    """A plane through a point of the world, drawn with one world axis to the right and one downwards."""
    centre: np.ndarray
    right: int
    down: int
    down_sign: int  # +1: the axis points down
    low: np.ndarray  # of what the picture shows, mm
    high: np.ndarray

    def ends(self):
        """left, right, top and bottom of the picture in world millimetres, as it is drawn."""
        top, bottom = (self.low, self.high) if self.down_sign > 0 else (self.high, self.low)
        return self.low[self.right], self.high[self.right], top[self.down], bottom[self.down]

    def points(self, step):
        left, right, top, bottom = self.ends()
        across = np.arange(left + step / 2, right, step)
        along = top + self.down_sign * np.arange(step / 2, abs(bottom - top), step)
        points = np.empty((len(along), len(across), 3))
        points[:] = self.centre
        points[..., self.right] = across
        points[..., self.down] = along[:, np.newaxis]
        return points

    def title(self):
        through = 3 - self.right - self.down
        return f"{NAMES[through]} = {round(self.centre[through])} mm"


def views_through(centre, down, low, high):
    """Two views that look along the tissue (depth runs down) and one across it, all through one point."""
    axis, sign = down
    across, along = [other for other in range(3) if other != axis]
    return [View(centre, across, axis, sign, low, high), View(centre, along, axis, sign, low, high),
            View(centre, across, along, 1, low, high)]


def window_of(volume):
    """Grey levels that become black and white: the same for all pictures of one report."""
    real = volume.intensity[volume.valid]
    low, high = np.percentile(real[:: max(1, len(real) // 1_000_000)], [0.5, 99.5])
    return float(low), float(max(high, low + 1))


def averaged(volumes, points):
    """The plain mean of the volumes that are real at each point: shows misplacement as blur and double contours."""
    values = np.stack([volume.at(points) for volume in volumes])
    real = np.isfinite(values)
    count = real.sum(axis=0)
    return np.where(count > 0, np.where(real, values, 0).sum(axis=0) / np.maximum(count, 1), np.nan)


def _grey(axes, values, view, window):
    axes.imshow(np.where(np.isfinite(values), values, window[0]), cmap="gray", vmin=window[0], vmax=window[1],
                extent=_extent(view), interpolation="bilinear")
    _bare(axes, view)


def _extent(view):
    left, right, top, bottom = view.ends()
    return left, right, bottom, top


def _bare(axes, view):
    left, right, top, bottom = view.ends()
    axes.set(xticks=[], yticks=[], xlim=(left, right), ylim=(bottom, top), aspect="equal")
    axes.set_facecolor("black")
    for side in axes.spines.values():
        side.set_visible(False)


def _scale_bar(axes, view):
    left, right, top, bottom = view.ends()
    length = next((length for length in (100, 50, 20, 10, 5, 2, 1) if length < (right - left) / 4), 1)
    x, y = right - 0.04 * (right - left) - length, bottom - 0.05 * (bottom - top)
    axes.plot([x, x + length], [y, y], color="white", linewidth=2, solid_capstyle="butt")
    axes.text(x + length / 2, y - 0.02 * (bottom - top), f"{length} mm", color="white", fontsize=7, ha="center", va="bottom")
    axes.text(0.025, 0.03, f"{NAMES[view.right]} \u2192   {NAMES[view.down]} {'↓' if view.down_sign > 0 else '↑'}", color="#cfcfcf",
              transform=axes.transAxes, fontsize=7)


def _grid_of_axes(views, columns, width):
    """One row per view, heights as the views need them."""
    heights = []
    for view in views:
        left, right, top, bottom = view.ends()
        heights.append(abs(bottom - top) / (right - left))
    # Views of different widths are drawn to one scale within a column, so a row's height follows the widest view.
    figure = plt.figure(figsize=(width, width / columns * sum(heights) + 0.35), facecolor="white")
    grid = figure.add_gridspec(len(views), columns, height_ratios=heights, wspace=0.02, hspace=0.02, left=0.005, right=0.995,
                               bottom=0.005, top=1 - 0.3 / figure.get_figheight())
    return figure, [[figure.add_subplot(grid[row, column]) for column in range(columns)] for row in range(len(views))]


def _save(figure, path, dither=Image.Dither.NONE):
    figure.savefig(path, dpi=120, facecolor=figure.get_facecolor())
    plt.close(figure)
    # 256 colours are enough for grey pictures with a few coloured lines, and make a third of the size.
    Image.open(path).convert("RGB").quantize(256, dither=dither).save(path, optimize=True)


def draw_slices(path, before, after, stitched, views, window, step,
                titles=("before alignment, averaged", "after alignment, averaged", "stitched")):
    """Planes (rows), before and after the alignment and stitched (columns)."""
    figure, axes = _grid_of_axes(views, 3, 12)
    for column, title in enumerate(titles):
        axes[0][column].set_title(title, fontsize=10, color="#333333")
    for view, row in zip(views, axes):
        points = view.points(step)
        for panel, volumes in zip(row, (before, after, [stitched])):
            _grey(panel, averaged(volumes, points), view, window)
        _scale_bar(row[0], view)
        row[2].text(0.975, 0.97, view.title(), color="#cfcfcf", transform=row[2].transAxes, fontsize=7, ha="right", va="top")
    _save(figure, path)


def draw_edges(path, volumes, stitched, views, window, step):
    """The stitched volume with the border of each volume drawn on it, and without."""
    figure, axes = _grid_of_axes(views[:1], 2, 12)
    view = views[0]
    points = view.points(step)
    values = stitched.at(points)
    for panel, title in zip(axes[0], ("stitched, with the border of each volume", "the same without: no border should be seen")):
        _grey(panel, values, view, window)
        panel.set_title(title, fontsize=10, color="#333333")
    for index, volume in enumerate(volumes):
        real = np.isfinite(volume.at(points))
        if real.any():
            axes[0][0].contour(points[0, :, view.right], points[:, 0, view.down], real.astype(float), [0.5],
                               colors=[colour_of(index)], linewidths=1.4)
        axes[0][0].text(0.025, 0.965 - 0.05 * index, volume.name, color=colour_of(index), transform=axes[0][0].transAxes,
                        fontsize=8, va="top")
    _scale_bar(axes[0][1], view)
    _save(figure, path)


def draw_embedded(path, stitched, embedded, views, window, step):
    """One plane: stitched, embedded, and embedded with what was invented in colour."""
    figure, axes = _grid_of_axes(views[:1], 3, 12)
    view = views[0]
    points = view.points(step)
    values = embedded.as_seen().at(points)
    for panel, title, shown in zip(axes[0], ("stitched", "embedded", "what was invented (orange) and mixed (blue)"),
                                   (stitched.at(points), values, values)):
        _grey(panel, shown, view, window)
        panel.set_title(title, fontsize=10, color="#333333")
    labels = embedded.labels_at(points)
    tint = np.zeros((*labels.shape, 4))
    tint[labels == 2] = (0.34, 0.71, 0.91, 0.4)
    tint[labels == 3] = (0.9, 0.62, 0.0, 0.4)
    axes[0][2].imshow(tint, extent=_extent(view), interpolation="nearest")
    _bare(axes[0][2], view)
    _scale_bar(axes[0][0], view)
    _save(figure, path)


def draw_overlays(path, before, after, pairs, down, low, high, window, step, titles=("before alignment", "after alignment")):
    """Each overlapping pair laid over each other in two colours, before and after: where they agree, the colours are grey."""
    views = []
    for pair in pairs:
        both = views_through(pair.centre, down, low, high)[:2]
        real = [np.isfinite(after[pair.first].at(view.points(2 * step))) & np.isfinite(after[pair.second].at(view.points(2 * step)))
                for view in both]
        views.append(both[int(real[1].sum() > real[0].sum())])
    figure, axes = _grid_of_axes(views, 2, 12)
    for panel, title in zip(axes[0], titles):
        panel.set_title(title, fontsize=10, color="#333333")
    for pair, view, row in zip(pairs, views, axes):
        points = view.points(step)
        for panel, volumes in zip(row, (before, after)):
            first, second = (blurred_where_real(volumes[index].at(points)) for index in (pair.first, pair.second))
            both = np.isfinite(first) & np.isfinite(second)
            if both.sum() > 100:  # gains differ from volume to volume; the colours should not show that
                spread = first[both].std() / max(second[both].std(), 1e-9)
                second = (second - second[both].mean()) * min(max(spread, 0.5), 2) + first[both].mean()
            first, second = ((values - window[0]) / (window[1] - window[0]) for values in (first, second))
            alone = 0.45 * np.nan_to_num(np.where(np.isfinite(first), first, second))
            picture = np.stack([np.where(both, second, alone), np.where(both, first, alone), np.where(both, second, alone)], axis=-1)
            panel.imshow(picture.clip(0, 1), extent=_extent(view), interpolation="bilinear")
            _bare(panel, view)
        row[0].text(0.025, 0.965, after[pair.first].name, color="#7CFC7C", transform=row[0].transAxes, fontsize=8, va="top")
        row[0].text(0.025, 0.915, after[pair.second].name, color="#FF8CFF", transform=row[0].transAxes, fontsize=8, va="top")
        _scale_bar(row[1], view)
    _save(figure, path, Image.Dither.FLOYDSTEINBERG)


def _block(volume, window, light, margin=3, most_voxels=200):
    """Two numbers per voxel for the renderer: brightness, and how solid the place is.

    Brightness is carried a little beyond the border, so that the border is not mixed with black. The outside of the block is
    darkened as if lit from one side; shading by the renderer itself would follow the speckle.
    """
    stride = max(1, -(-max(volume.dimensions) // most_voxels))
    valid = np.pad(volume.valid[::stride, ::stride, ::stride], margin)
    grey = volume.intensity[::stride, ::stride, ::stride].astype(np.float32)
    grey = np.pad(((grey - window[0]) / (window[1] - window[0])).clip(0, 1), margin)
    weight = valid.astype(np.float32)
    total = np.where(valid, grey, 0)
    solid = blurred(blurred(weight))
    for _ in range(3):
        total, weight = blurred(total), blurred(weight)
    grey = np.where(valid, grey, total / np.maximum(weight, 1e-6))
    slopes = np.gradient(blurred(blurred(solid)))[::-1]
    steepness = np.sqrt(sum(slope * slope for slope in slopes))
    facing = -sum(slope * part for slope, part in zip(slopes, light)) / np.maximum(steepness, 1e-6)
    skin = (steepness / max(float(steepness.max()), 1e-6) * 2).clip(0, 1)
    grey = grey * (1 - skin * (0.55 - 0.35 * facing.clip(-1, 1)))

    image = vtkImageData()
    image.SetDimensions(valid.shape[::-1])
    spacing = volume.spacing * stride
    direction = volume.index_to_world[:3, :3] / volume.spacing
    image.SetSpacing(spacing)
    image.SetDirectionMatrix(direction.ravel())
    image.SetOrigin(volume.index_to_world[:3, 3] - direction @ (margin * spacing))
    image.GetPointData().SetScalars(numpy_to_vtk((255 * np.stack([grey, solid], axis=-1)).astype(np.uint8).reshape(-1, 2), deep=True))
    return image


def draw_rendering(path, volume, centre, down, window, size=(1100, 800)):
    """A volume rendering of the tissue as a solid block, seen from the front, with a corner cut out of it at centre.

    The volume's own axes must be those of the world, as the stitcher's are: a mapper crops along them.
    """
    depth, sign = down
    across = min(axis for axis in range(3) if axis != depth)
    up, right = np.zeros(3), np.zeros(3)
    up[depth], right[across] = -sign, 1
    towards = np.cross(right, up)  # out of the picture
    front = int(np.abs(towards).argmax())

    image = _block(volume, window, (towards + 0.8 * up + 0.5 * right) / np.sqrt(1.89))
    mapper = vtkOpenGLGPUVolumeRayCastMapper()
    mapper.SetInputData(image)
    mapper.SetSampleDistance(0.5 * min(image.GetSpacing()))
    mapper.AutoAdjustSampleDistancesOff()
    mapper.UseJitteringOn()
    # Three slabs along each axis; here the cut is the middle one's lower side, and the high slab is empty.
    bounds = np.array(image.GetBounds()).reshape(3, 2)
    planes = np.column_stack([centre, bounds[:, 1] + 1])
    mapper.SetCroppingRegionPlanes(planes.ravel())
    mapper.CroppingOn()
    removed = {across: True, front: towards[front] > 0, depth: sign < 0}  # the side of the cut that goes: True for above it
    flags = 0
    for z, y, x in np.ndindex(3, 3, 3):
        if not all((slab >= 1) == removed[axis] for axis, slab in enumerate((x, y, z))):
            flags |= 1 << (x + 3 * y + 9 * z)
    mapper.SetCroppingRegionFlags(flags)

    look = vtkVolumeProperty()
    look.IndependentComponentsOff()
    look.SetInterpolationTypeToLinear()
    look.SetScalarOpacityUnitDistance(min(image.GetSpacing()) / 2)
    opacity, colour = vtkPiecewiseFunction(), vtkColorTransferFunction()
    for solid, value in ((0, 0), (110, 0), (140, 1), (255, 1)):
        opacity.AddPoint(solid, value)
    for grey, *rgb in ((0, 0.03, 0.02, 0.02), (80, 0.34, 0.22, 0.16), (150, 0.74, 0.56, 0.43), (255, 1, 0.96, 0.88)):
        colour.AddRGBPoint(grey, *rgb)
    look.SetScalarOpacity(opacity)
    look.SetColor(colour)
    block = vtkVolume()
    block.SetMapper(mapper)
    block.SetProperty(look)

    renderer = vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    renderer.AddVolume(block)
    window = vtkRenderWindow()
    window.OffScreenRenderingOn()
    window.SetMultiSamples(0)
    window.SetSize(*size)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    middle = bounds.mean(axis=1)
    camera.SetFocalPoint(middle)
    camera.SetPosition(middle + 1000 * (towards + 0.5 * up + 0.4 * right))
    camera.SetViewUp(up)
    camera.SetViewAngle(15)
    renderer.ResetCamera()
    camera.Zoom(1.35)
    renderer.ResetCameraClippingRange()
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    shot = grab.GetOutput()
    pixels = vtk_to_numpy(shot.GetPointData().GetScalars()).reshape(shot.GetDimensions()[1], shot.GetDimensions()[0], -1)[::-1]
    drawn = (pixels < 255).any(axis=-1)
    if not drawn.any():
        raise RuntimeError("the volume rendering came out empty")
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    pixels = pixels[max(rows[0] - 10, 0) : rows[-1] + 11, max(columns[0] - 10, 0) : columns[-1] + 11]
    Image.fromarray(np.ascontiguousarray(pixels)).quantize(256).save(path, optimize=True)
