#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The reconstructor as a filter: time steps, grids, sectors, reports, live use, bad input."""
import numpy as np
from tracked_frames import Source, array, frame, messages_of
from vtkmodules.vtkCommonCore import VTK_FLOAT, VTK_UNSIGNED_SHORT
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkImageData
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

from echorama.EchoramaFiltersReconstruction import vtkUltrasoundVolumeReconstructor as Reconstructor


def turn(x, y, z):
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    return (np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
            @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]))


ROTATION = turn(0.3, -0.4, 0.5)
WORLD = np.eye(4)
WORLD[:3, :3], WORLD[:3, 3] = ROTATION, (10, -20, 30)


def field(points):
    """A smooth field, fixed in the world; points [..., 3]."""
    return 120 + 50 * np.sin(0.12 * points[..., 0]) * np.cos(0.1 * points[..., 1]) + 1.2 * points[..., 2]


def straight_sweep(count=21, shape=(40, 50), pixel=0.5, step=0.8, dtype=np.uint8, noise=0):
    """Frames that move along their normal, in an oblique place."""
    random = np.random.default_rng(3)
    y, x = np.mgrid[0:shape[0], 0:shape[1]]
    images, poses = [], []
    for k in range(count):
        pose = WORLD @ np.array([[pixel, 0, 0, 0], [0, pixel, 0, 0], [0, 0, pixel, step * k], [0, 0, 0, 1]])
        points = np.stack([x, y, 0 * x, 1 + 0 * x], -1) @ pose.T
        images.append(np.clip(field(points[..., :3]) + noise * random.normal(size=shape), 0, 255).astype(dtype))
        poses.append(pose)
    return images, poses


def reconstructor(source, **parameters):
    filter = Reconstructor()
    filter.SetInputConnection(source.GetOutputPort())
    filter.SetSector(Reconstructor.ALL)
    for name, value in parameters.items():
        getattr(filter, "Set" + name)(value)
    return filter, messages_of(filter)


def data_like(pixels, pose):
    """An image on the grid of a frame, a few slices thick."""
    image = vtkImageData()
    image.SetDimensions(pixels.shape[1], pixels.shape[0], 4)
    image.SetSpacing(0.5, 0.5, 0.5)
    image.SetOrigin(pose[:3, 3])
    image.SetDirectionMatrix(ROTATION.ravel())
    return image


def direction_of(image):
    matrix = image.GetDirectionMatrix()
    return np.array([[matrix.GetElement(i, j) for j in range(3)] for i in range(3)])


def world_of(image):
    k, j, i = np.meshgrid(*(np.arange(n) for n in image.GetDimensions()[::-1]), indexing="ij")
    return np.array(image.GetOrigin()) + (np.stack([i, j, k], -1) * np.array(image.GetSpacing())) @ direction_of(image).T


def test_a_field_comes_back_in_the_fitted_grid():
    images, poses = straight_sweep()
    for splat, between, bound in ((0, 0, 2.5), (0, 1, 2.0), (1, 1, 1.5), (1, 2, 1.0)):
        filter, messages = reconstructor(Source(images, poses), Splat=splat, Between=between, SpacingMm=0.6)
        filter.Update()
        assert not messages, messages
        out = filter.GetOutput()
        assert np.allclose(direction_of(out), ROTATION), "the grid lies along the frames"
        valid = array(out, "ValidRegion").astype(bool)
        assert valid.mean() > 0.9
        error = np.abs(array(out) - field(world_of(out)))[valid]
        assert error.mean() < bound, (splat, between, error.mean())
        assert (array(out)[~valid] == 0).all()
        assert out.GetPointData().GetScalars().GetName() == "Intensity"
        assert array(out, "Coverage").dtype == np.uint16
        assert ((array(out, "Coverage") > 0) <= valid).all()


def test_information_is_what_comes_and_has_no_time():
    images, poses = straight_sweep()
    source = Source(images, poses)
    filter, messages = reconstructor(source, SpacingMm=0.7)
    filter.UpdateInformation()
    information = filter.GetOutputInformation(0)
    whole = information.Get(Pipeline.WHOLE_EXTENT())
    assert not information.Has(Pipeline.TIME_STEPS())
    filter.Update()
    out = filter.GetOutput()
    assert not messages and out.GetExtent() == whole
    assert out.GetOrigin() == information.Get(vtkDataObject.ORIGIN())
    # Poses once, splats once; nothing again while nothing changes; only what changed is done again.
    made = len(source.made)
    assert made <= 2 * len(images) + 2, made
    filter.Update()
    assert len(source.made) == made
    full = array(out).copy()
    piece, other = reconstructor(source, SpacingMm=0.7)
    wanted = (whole[0] + 2, whole[1], whole[2], whole[3] - 3, whole[4] + 1, whole[5])
    piece.UpdateExtent(wanted)
    assert piece.GetOutput().GetExtent() == wanted
    assert np.array_equal(array(piece.GetOutput()), full[1:, :-3, 2:])


def test_reference_grid_types_and_subsets():
    reference = vtkImageData()
    reference.SetDimensions(30, 28, 20)
    reference.SetSpacing(0.8, 0.9, 1.0)
    reference.SetOrigin(11, -19, 31)
    reference.SetDirectionMatrix(turn(0.1, 0.2, 0.3).ravel())
    for dtype in (np.uint8, np.int16, np.uint16, np.float32, np.float64):
        images, poses = straight_sweep(dtype=dtype)
        source = Source(images, poses)
        filter, messages = reconstructor(source)
        filter.SetReferenceData(reference)
        filter.Update()
        assert not messages, messages
        out = filter.GetOutput()
        assert out.GetDimensions() == (30, 28, 20) and np.allclose(out.GetOrigin(), (11, -19, 31))
        assert np.allclose(direction_of(out), turn(0.1, 0.2, 0.3))
        assert array(out).dtype == dtype
        assert len(source.made) <= len(images) + 3, "with a grid there is nothing to find out beforehand"
        filter.SetFirstFrame(4)
        filter.SetLastFrame(9)
        filter.SetFrameStep(2)
        filter.Update()
        assert filter.GetFramesUsed() == 3
    filter.SetFirstFrame(40)
    filter.Update()
    assert any("FirstFrame 40" in message for message in messages), messages
    assert filter.GetOutput().GetNumberOfPoints() == 0


def test_times_out_of_order():
    images, poses = straight_sweep()
    order = np.random.default_rng(1).permutation(len(images))
    filter, messages = reconstructor(Source(images, poses), SpacingMm=0.7)
    shuffled, others = reconstructor(Source([images[k] for k in order], [poses[k] for k in order], times=order), SpacingMm=0.7)
    filter.Update()
    shuffled.Update()
    assert not messages + others
    assert np.array_equal(array(filter.GetOutput()), array(shuffled.GetOutput()))


def test_frames_without_a_pose_are_counted():
    images, poses = straight_sweep()
    poses[3] = poses[7] = None
    poses[9] = np.diag([0.0, 1, 1, 1])
    filter, messages = reconstructor(Source(images, poses), SpacingMm=0.7)
    filter.Update()
    assert not messages, messages
    assert filter.GetFramesUsed() == 18 and filter.GetFramesRefused() == 3
    report = filter.GetReport()
    assert "2 refused: it has no valid pose" in report and "1 refused: its pose is singular" in report, report
    lines = filter.GetOutput().GetFieldData().GetAbstractArray("ReconstructionReport")
    assert [lines.GetValue(i) for i in range(lines.GetNumberOfValues())] == report.splitlines()

    filter, messages = reconstructor(Source(images, [None] * len(images)))
    filter.Update()
    assert any("none of the 21 frames has a valid pose" in message for message in messages), messages
    assert filter.GetOutput().GetNumberOfPoints() == 0


def test_the_sector_is_found():
    """Text and a bar beside a rectangle of echoes stay out; black fluid inside stays in."""
    images, poses = straight_sweep(shape=(60, 80), noise=12)
    for image in images:
        image[20:30, 30:42] = 0
        screen = np.zeros_like(image)
        screen[10:55, 14:70] = 0.7 * image[10:55, 14:70]
        screen[2:6, 3:20:2] = 255
        screen[:, 76:] = np.arange(60)[:, None]
        image[:] = screen
    filter, messages = reconstructor(Source(images, poses), Sector=Reconstructor.DETECTED, SpacingMm=0.5)
    filter.Update()
    assert not messages, messages
    out = filter.GetOutput()
    assert "sector found" in filter.GetReport()
    assert abs(out.GetDimensions()[0] - 56) <= 2 and abs(out.GetDimensions()[1] - 45) <= 2, out.GetDimensions()
    valid = array(out, "ValidRegion")
    assert valid.mean() > 0.95 and (array(out)[valid > 0] == 0).sum() > 500, "fluid is real data"

    for parameters in ({"Sector": Reconstructor.RECTANGLE, "Rectangle": (14, 69, 10, 54)},
                       {"Sector": Reconstructor.FAN, "FanApex": (40, -30), "FanAngles": (-20, 20), "FanDepths": (20, 40)}):
        filter, messages = reconstructor(Source(images, poses), SpacingMm=0.5, **parameters)
        filter.Update()
        assert not messages, messages
        assert (array(filter.GetOutput()) < 255).all(), "text came in"
    filter.SetFanAngles(20, -20)
    filter.Update()
    assert any("FanAngles" in message for message in messages), messages


def test_what_is_too_small_for_a_sector_is_not_believed():
    """A black bath with one small thing that moves in it: all pixels are taken, and that is told."""
    images, poses = straight_sweep(shape=(60, 80), noise=12)
    for image in images:
        bath = np.zeros_like(image)
        bath[20:30, 30:40] = image[20:30, 30:40]
        image[:] = bath
    filter, messages = reconstructor(Source(images, poses), Sector=Reconstructor.DETECTED, SpacingMm=0.5)
    warnings = messages_of(filter, "WarningEvent")
    filter.Update()
    assert not messages, messages
    assert filter.GetOutput().GetDimensions()[:2] == (80, 60), filter.GetOutput().GetDimensions()
    assert len([w for w in warnings if "all pixels were taken" in w]) == 1, warnings
    assert "all pixels were taken" in filter.GetReport()


def test_a_valid_region_keeps_pixels_out():
    images, poses = straight_sweep()
    valids = [np.ones(images[0].shape, np.uint8) for _ in images]
    for valid in valids:
        valid[:, :25] = 0
    filter, messages = reconstructor(Source(images, poses, valids=valids), SpacingMm=0.5)
    filter.Update()
    assert not messages, messages
    assert not array(filter.GetOutput(), "ValidRegion")[:, :, :24].any()
    assert array(filter.GetOutput(), "ValidRegion")[:, :, 26:-1].mean() > 0.95


def test_holes():
    images, poses = straight_sweep(step=1.0)
    filled = {}
    for method, reach in ((0, 1), (1, 1), (1, 3), (2, 3)):
        filter, messages = reconstructor(Source(images, poses), SpacingMm=0.33, Between=0, Holes=method, HoleReach=reach)
        filter.Update()
        assert not messages, messages
        valid, coverage = array(filter.GetOutput(), "ValidRegion"), array(filter.GetOutput(), "Coverage")
        assert filter.GetVoxelsFilled() == ((valid > 0) & (coverage == 0)).sum()
        assert filter.GetVoxelsSeen() == (coverage > 0).sum()
        filled[method, reach] = filter.GetVoxelsFilled()
    assert filled[0, 1] == 0 < filled[1, 1] < filled[1, 3] == filled[2, 3]
    assert (valid > 0).mean() > 0.9, (valid > 0).mean()


def test_memory_is_stated_and_refused():
    images, poses = straight_sweep()
    filter, messages = reconstructor(Source(images, poses), SpacingMm=0.1, MemoryLimitMb=50)
    filter.Update()
    assert messages and "MB" in messages[0] and "SpacingMm = " in messages[0], messages
    assert filter.GetOutput().GetNumberOfPoints() == 0
    spacing = float(messages[0].split("SpacingMm = ")[1].split()[0])
    filter.SetSpacingMm(spacing)
    messages.clear()
    filter.Update()
    assert not messages, messages
    assert 15 < filter.GetMemoryMb() < 50
    filter.SetSpacingMm(1e-7)
    filter.Update()
    assert messages, "4e20 voxels"


def test_live_is_as_the_whole():
    images, poses = straight_sweep()
    whole, messages = reconstructor(Source(images, poses), SpacingMm=0.7, Holes=0)
    whole.Update()
    live = Reconstructor()
    heard = messages_of(live)
    live.SetSector(Reconstructor.ALL)
    grid = vtkImageData()
    grid.CopyStructure(whole.GetOutput())
    assert live.GetLiveOutput() is None
    assert live.BeginLive(grid)
    out = live.GetLiveOutput()
    seen = 0
    for image, pose in zip(images, poses):
        time = out.GetMTime()
        assert live.AddFrame(frame(image, pose))
        assert out.GetMTime() > time
        now = (array(out, "ValidRegion") > 0).sum()
        assert now > seen, "the volume is up to date after each frame"
        seen = now
    for name in ("Intensity", "ValidRegion", "Coverage"):
        assert np.array_equal(array(out, name), array(whole.GetOutput(), name))
    assert live.GetFramesUsed() == len(images) and live.GetFramesBetween() == whole.GetFramesBetween()

    # What cannot be used changes nothing.
    before = array(out).copy()
    far = poses[0].copy()
    far[0, 3] += 1e5
    for pose in (None, far, np.zeros((4, 4))):
        assert not live.AddFrame(frame(images[0], pose))
    assert not live.AddFrame(frame(images[0].astype(np.float32), poses[0]))
    assert live.GetFramesRefused() == 4 and not heard, live.GetReport()
    assert not live.AddFrame(vtkImageData()) and heard
    assert np.array_equal(array(out), before)
    assert live.FillLiveHoles() == live.GetVoxelsFilled()
    live.EndLive()
    assert live.GetLiveOutput() is None and array(out).any(), "who holds the volume keeps it"
    heard.clear()
    assert not live.AddFrame(frame(images[0], poses[0])) and "BeginLive" in heard[0]

    # Other types, a sector by numbers, and what is refused.
    live.SetSector(Reconstructor.RECTANGLE)
    live.SetRectangle(10, 20, 5, 15)
    assert live.BeginLive(grid, VTK_FLOAT) and live.AddFrame(frame(images[0].astype(np.float32), poses[0]))
    assert 0 < (array(live.GetLiveOutput(), "ValidRegion") > 0).sum() < 200
    # The scanner changes its format while the tracker has lost the probe: refused, and the sector is that of the next one with a pose.
    larger = np.ones((80, 100), np.float32)
    refused = live.GetFramesRefused()
    heard.clear()
    assert not live.AddFrame(frame(larger, np.zeros((4, 4))))
    assert live.GetFramesRefused() == refused + 1 and "singular" in live.GetReport() and not heard, (live.GetReport(), heard)
    assert live.AddFrame(frame(larger, poses[0])), live.GetReport()
    heard.clear()
    assert not live.BeginLive(vtkImageData()) and heard
    assert not live.BeginLive(None)
    live.SetMemoryLimitMb(0.001)
    heard.clear()
    assert not live.BeginLive(grid, VTK_UNSIGNED_SHORT) and "MemoryLimitMb" in heard[0]


def test_a_single_image_without_time():
    images, poses = straight_sweep(1)
    filter = Reconstructor()
    messages = messages_of(filter)
    filter.SetInputData(frame(images[0], poses[0]))
    filter.SetSector(Reconstructor.ALL)
    filter.Update()
    assert not messages, messages
    assert filter.GetOutput().GetDimensions() == (50, 40, 1)
    assert np.array_equal(array(filter.GetOutput())[0], images[0])


def test_bad_input():
    images, poses = straight_sweep(4)

    def refused(words, change=None, **parameters):
        source = Source(list(images), list(poses))
        if change:
            change(source)
        filter, messages = reconstructor(source, SpacingMm=1.0, **parameters)
        filter.Update()
        assert messages and any(words in message for message in messages), (words, messages)
        assert filter.GetOutput().GetNumberOfPoints() == 0

    refused("Alpha", Alpha=0.0)
    refused("StepMm", StepMm=-1.0)
    refused("MaximumGapMm", MaximumGapMm=0.0)
    refused("MemoryLimitMb", MemoryLimitMb=-1.0)
    refused("Rectangle", Sector=Reconstructor.RECTANGLE, Rectangle=(90, 95, 0, 3))
    refused("type", lambda s: setattr(s, "images", [i.astype(np.int64) for i in images]))
    refused("different sizes", lambda s: s.images.__setitem__(2, np.zeros((9, 9), np.uint8)), Sector=Reconstructor.DETECTED)
    refused("no sector", lambda s: setattr(s, "images", [images[0]] * 4), Sector=Reconstructor.DETECTED)
    # Frames of another size or type than the first are left out where that is possible.
    source = Source([images[0], images[1].astype(np.float32), images[2], images[3]], poses)
    filter, messages = reconstructor(source, SpacingMm=1.0)
    filter.Update()
    assert not messages and filter.GetFramesUsed() == 3 and filter.GetFramesRefused() == 1, (messages, filter.GetReport())

    volume = frame(images[0], poses[0])
    thick = vtkImageData()
    thick.SetDimensions(3, 3, 3)
    thick.AllocateScalars(3, 1)
    filter = Reconstructor()
    messages = messages_of(filter)
    filter.SetInputData(thick)
    filter.Update()
    assert any("slices" in message for message in messages), messages
    # And a good one after that works.
    filter.SetInputData(volume)
    filter.SetSector(Reconstructor.ALL)
    messages.clear()
    filter.Update()
    assert not messages and filter.GetOutput().GetNumberOfPoints() == volume.GetNumberOfPoints()


def test_it_can_be_stopped():
    images, poses = straight_sweep()
    filter, _ = reconstructor(Source(images, poses), SpacingMm=0.7)
    tag = filter.AddObserver("ProgressEvent", lambda f, e: f.SetAbortExecute(1))
    filter.Update()
    assert filter.GetOutput().GetNumberOfPoints() == 0
    filter.RemoveObserver(tag)
    filter.Modified()
    filter.Update()
    assert filter.GetOutput().GetNumberOfPoints() > 0

    # While poses are looked up, and without anything else to make it run again.
    for after in (5, 25):
        source = Source(images, poses)
        filter, messages = reconstructor(source, SpacingMm=0.7)
        tag = filter.AddObserver("ProgressEvent", lambda f, e: f.SetAbortExecute(int(len(source.made) >= after)))
        filter.Update()
        assert filter.GetOutput().GetNumberOfPoints() == 0
        assert after <= len(source.made) <= after + 2, (after, len(source.made))
        filter.RemoveObserver(tag)
        messages.clear()
        filter.Update()
        assert filter.GetOutput().GetNumberOfPoints() > 0 and not messages, messages


def test_a_failing_input_fails():
    """Frame 7 cannot be made: frame 6 must not take its place."""
    images, poses = straight_sweep()

    class Failing(Source):
        broken = True

        def RequestData(self, request, inputs, outputs):
            super().RequestData(request, inputs, outputs)
            return 0 if self.broken and self.made[-1] == 7 else 1

    for given in (False, True):
        source = Failing(images, poses)
        filter, messages = reconstructor(source, SpacingMm=0.7)
        if given:
            filter.SetReferenceData(data_like(images[0], poses[0]))
        filter.Update()
        assert any("frame 7 could not be made" in message for message in messages), messages
        assert filter.GetOutput().GetNumberOfPoints() == 0
        source.broken = False
        source.Modified()
        messages.clear()
        filter.Update()
        assert not messages and (0 if given else 20) < filter.GetFramesUsed(), messages


if __name__ == "__main__":
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            test()
            print("passed", name)
