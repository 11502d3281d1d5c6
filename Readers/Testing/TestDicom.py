# SPDX-License-Identifier: BSD-3-Clause
"""DICOM objects of known geometry, made with pydicom, read by vtkUltrasoundReader."""
import io
import os
import shutil
import sys
import tempfile
import unittest
import warnings
from pathlib import Path

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

import echorama

try:
    import pydicom
    from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
    from pydicom.encaps import encapsulate
    from pydicom.sequence import Sequence
    from pydicom.uid import UID, generate_uid
except ImportError:
    print("skipped: pydicom is not there")
    sys.exit(77)

warnings.filterwarnings("ignore")
ENHANCED, MULTIFRAME, SINGLE = (
    "1.2.840.10008.5.1.4.1.1.6.2", "1.2.840.10008.5.1.4.1.1.3.1", "1.2.840.10008.5.1.4.1.1.6.1")
IMPLICIT, EXPLICIT, DEFLATED, BIG_ENDIAN, RLE, JPEG, JPEG2000 = (
    "1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.1.99", "1.2.840.10008.1.2.2", "1.2.840.10008.1.2.5",
    "1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.90")
KRETZ = Path(os.environ["ECHORAMA_SOURCE_DIR"]) / ".." / "shared" / "data" / "kretz" / "sphere_phantom.vol"


def turned(x, y, z):
    """A rotation by three angles."""
    def about(axis, angle):
        c, s = np.cos(angle), np.sin(angle)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        matrix = np.eye(3)
        matrix[i, i] = matrix[j, j] = c
        matrix[i, j], matrix[j, i] = -s, s
        return matrix
    return about(2, z) @ about(1, y) @ about(0, x)


R = turned(0.3, -0.8, 2.1)
ORIGIN = np.array([12.25, -87.5, 341.125])
SPACING = np.array([0.31, 0.47, 0.83])
VOXELS = (np.arange(5 * 6 * 7).reshape(5, 6, 7) * 37 % 251).astype(np.uint8)  # slices, rows, columns


def decimal(number):
    return f"{number:.12g}"[:16]


def dataset(syntax=EXPLICIT, sop=SINGLE):
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = sop
    meta.MediaStorageSOPInstanceUID = generate_uid()
    meta.TransferSyntaxUID = UID(syntax)
    meta.ImplementationClassUID = generate_uid()
    data = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
    data.is_little_endian = syntax != BIG_ENDIAN
    data.is_implicit_VR = syntax == IMPLICIT
    data.SOPClassUID = sop
    data.SOPInstanceUID = meta.MediaStorageSOPInstanceUID
    data.SeriesInstanceUID = "1.2.3.4"
    data.StudyInstanceUID = "1.2.3"
    data.PatientName = "Doe^Jane"
    data.PatientID = "4711"
    data.PatientBirthDate = "19700101"
    data.InstitutionName = "St. Elsewhere"
    data.StudyDate = "20200202"
    data.Modality = "US"
    data.Manufacturer = "Maker"
    data.ManufacturerModelName = "Model 7"
    data.TransducerType = "SECTOR_PHASED"
    return data


def pixels(data, array, photometric="MONOCHROME2"):
    """Array: (frames,) rows, columns (, 3)."""
    colour = array.shape[-1] == 3 and photometric not in ("MONOCHROME1", "MONOCHROME2")
    shape = array.shape[:-1] if colour else array.shape
    data.Rows, data.Columns = shape[-2:]
    if len(shape) == 3:
        data.NumberOfFrames = shape[0]
    data.SamplesPerPixel = 3 if colour else 1
    if colour:
        data.PlanarConfiguration = 0
    data.PhotometricInterpretation = photometric
    data.BitsAllocated = data.BitsStored = array.dtype.itemsize * 8
    data.HighBit = data.BitsStored - 1
    data.PixelRepresentation = int(array.dtype.kind == "i")
    data.PixelData = array.tobytes() + b"\0" * (array.nbytes % 2)
    data["PixelData"].VR = "OW" if array.dtype.itemsize > 1 else "OB"
    return data


def item(**elements):
    data = Dataset()
    for name, value in elements.items():
        setattr(data, name, value)
    return data


def enhanced(voxels=VOXELS, times=(None,), order=None, syntax=EXPLICIT, patient=False, positions=None):
    """An Enhanced US Volume: frames of all times and slices, shuffled as order says."""
    data = dataset(syntax, ENHANCED)
    frames, groups = [], []
    for t, time in enumerate(times):
        for k in range(len(voxels)):
            position = ORIGIN + R[:, 2] * (positions[k] if positions is not None else k * SPACING[2])
            group = Dataset()
            group.PlanePositionVolumeSequence = Sequence([item(ImagePositionVolume=list(position))])
            if patient:  # the patient lies elsewhere: moved by (1, 2, 3)
                group.PlanePositionSequence = Sequence([item(ImagePositionPatient=[decimal(n) for n in position + (1, 2, 3)])])
            if time is not None:
                group.TemporalPositionSequence = Sequence([item(TemporalPositionTimeOffset=float(time))])
            groups.append(group)
            frames.append((voxels[k] + t).astype(voxels.dtype))
    order = list(order if order is not None else range(len(groups)))
    shared = Dataset()
    shared.PlaneOrientationVolumeSequence = Sequence([item(ImageOrientationVolume=list(R[:, 0]) + list(R[:, 1]))])
    if patient:
        directions = [decimal(n) for n in list(R[:, 0]) + list(R[:, 1])]
        shared.PlaneOrientationSequence = Sequence([item(ImageOrientationPatient=directions)])
    shared.PixelMeasuresSequence = Sequence([item(PixelSpacing=[decimal(SPACING[1]), decimal(SPACING[0])], SliceThickness="1")])
    shared.ImageDataTypeSequence = Sequence([item(DataType="TISSUE_INTENSITY")])
    data.SharedFunctionalGroupsSequence = Sequence([shared])
    data.PerFrameFunctionalGroupsSequence = Sequence([groups[i] for i in order])
    return pixels(data, np.stack([frames[i] for i in order]))


def slice_of(k, voxels=VOXELS, syntax=EXPLICIT, position=None, rotation=R):
    data = dataset(syntax)
    data.InstanceNumber = k + 1
    place = ORIGIN + R[:, 2] * (k * SPACING[2] if position is None else position)
    data.ImagePositionPatient = [decimal(n) for n in place]
    data.ImageOrientationPatient = [decimal(n) for n in list(rotation[:, 0]) + list(rotation[:, 1])]
    data.PixelSpacing = [decimal(SPACING[1]), decimal(SPACING[0])]
    return pixels(data, voxels[k])


class Reading:
    def __init__(self, path, time=None):
        self.reader = echorama.vtkUltrasoundReader()
        self.reader.SetFileName(str(path))
        self.messages = []

        def remember(caller, event, text):
            self.messages.append(text)

        remember.CallDataType = "string0"
        for each in (self.reader, self.reader.GetExecutive()):
            each.AddObserver("ErrorEvent", remember)
        if time is None:
            self.reader.Update()
        else:
            self.reader.UpdateTimeStep(time)
        self.image = self.reader.GetOutput()
        self.error = "\n".join(self.messages)
        self.notes = self.reader.GetNotes()

    @property
    def voxels(self):
        return vtk_to_numpy(self.image.GetPointData().GetArray("Intensity")).reshape(self.image.GetDimensions()[::-1])


class Dicom(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def save(self, data, name="file.dcm"):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        data.save_as(path, write_like_original=False)
        return path

    def read(self, data, time=None):
        return Reading(self.save(data), time)

    def expect(self, reading, voxels=VOXELS, origin=ORIGIN, spacing=SPACING, rotation=R, tolerance=1e-9):
        self.assertEqual(reading.error, "")
        np.testing.assert_array_equal(reading.voxels, voxels)
        np.testing.assert_allclose(reading.image.GetOrigin(), origin, atol=tolerance)
        np.testing.assert_allclose(reading.image.GetSpacing(), spacing, atol=tolerance)
        direction = reading.image.GetDirectionMatrix()
        found = [[direction.GetElement(r, c) for c in range(3)] for r in range(3)]
        np.testing.assert_allclose(found, rotation, atol=tolerance)

    def refused(self, data, *words):
        reading = Reading(data) if isinstance(data, Path) else self.read(data)
        self.assertEqual(reading.image.GetNumberOfPoints(), 0)
        for word in words:
            self.assertIn(word, reading.error)

    def test_enhanced_volume(self):
        for syntax in (EXPLICIT, IMPLICIT, DEFLATED):
            reading = self.read(enhanced(order=[3, 0, 4, 1, 2], syntax=syntax))
            self.expect(reading)
            self.assertIn("volume frame of reference", reading.notes)

    def test_enhanced_volume_in_the_patient(self):
        reading = self.read(enhanced(patient=True))
        self.expect(reading, origin=ORIGIN + (1, 2, 3), tolerance=1e-7)  # decimal strings have 16 characters
        self.assertEqual(reading.notes.count("reference"), 0)

    def test_enhanced_time_series(self):
        data = enhanced(times=(0.0, 0.25, 0.75), order=np.random.default_rng(3).permutation(15))
        path = self.save(data)
        for t, time in enumerate((0.0, 0.25, 0.75)):
            self.expect(Reading(path, time), VOXELS + np.uint8(t))
        data = enhanced(times=(0.0, 0.25, 0.75))
        data.PerFrameFunctionalGroupsSequence.pop()
        data.NumberOfFrames = 14
        self.refused(data, "different times")

    def test_probe_of_the_enhanced_volume(self):
        data = enhanced()
        turn = turned(0.1, 0.2, 0.3)
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = turn, (5, 6, 7)
        data.VolumeToTransducerMappingMatrix = list(matrix.ravel())
        reading = self.read(data)
        field = reading.image.GetFieldData().GetArray("ProbeToWorld")
        pose = np.array(field.GetTuple(0)).reshape(4, 4)
        # One mm into the tissue is our z and the transducer's y.
        np.testing.assert_allclose(matrix @ pose @ (0, 0, 1, 1), (0, 1, 0, 1), atol=1e-12)
        np.testing.assert_allclose(matrix @ pose @ (1, 0, 0, 1), (1, 0, 0, 1), atol=1e-12)
        matrix[0, 0] = 3
        data.VolumeToTransducerMappingMatrix = list(matrix.ravel())
        self.assertIn("not a rigid", self.read(data).notes)

    def test_other_data_types_are_left_out(self):
        data = enhanced(times=(None, None))
        for i, group in enumerate(data.PerFrameFunctionalGroupsSequence):
            group.ImageDataTypeSequence = Sequence([item(DataType="TISSUE_INTENSITY" if i < 5 else "FLOW_VELOCITY")])
        reading = self.read(data)
        self.expect(reading)
        self.assertIn("5 pictures", reading.notes)
        for group in data.PerFrameFunctionalGroupsSequence:
            group.ImageDataTypeSequence = Sequence([item(DataType="FLOW_POWER")])
        self.refused(data, "none of its pictures")

    def test_enhanced_refusals(self):
        step = SPACING[2]
        self.refused(enhanced(positions=[0, step, 2 * step, 4 * step, 5 * step]), "unevenly", "between frame 3 and frame 4")
        self.refused(enhanced(positions=[0, step, 2 * step, 3.004 * step, 4 * step]), "unevenly")
        self.refused(enhanced(positions=[0, step, step, 2 * step, 3 * step]), "same place")
        data = enhanced()
        data.PerFrameFunctionalGroupsSequence.pop()
        self.refused(data, "functional groups for 4")
        data = enhanced()
        del data.PerFrameFunctionalGroupsSequence[2].PlanePositionVolumeSequence
        self.refused(data, "not all of its pictures say where")
        data = enhanced()
        del data.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence
        self.refused(data, "pixel spacing")
        data = enhanced()
        data.SharedFunctionalGroupsSequence[0].PlaneOrientationVolumeSequence[0].ImageOrientationVolume = [1, 0, 0, 1, 0, 0]
        self.refused(data, "right angle")
        data = enhanced()
        orientation = list(turned(0.3, -0.8, 2.2)[:, :2].T.ravel())
        data.PerFrameFunctionalGroupsSequence[1].PlaneOrientationVolumeSequence = Sequence([item(ImageOrientationVolume=orientation)])
        self.refused(data, "not parallel")
        data = enhanced()
        place = data.PerFrameFunctionalGroupsSequence[1].PlanePositionVolumeSequence[0]
        place.ImagePositionVolume = list(np.array(place.ImagePositionVolume) + 0.1 * R[:, 0])
        self.refused(data, "sheared")

    def test_series_of_slices(self):
        for k in (3, 1, 4, 0, 2):
            self.save(slice_of(k), f"slices/{9 - k}.dcm")
        (self.folder / "slices" / "notes.txt").write_text("not DICOM")
        other = slice_of(0)
        other.SeriesInstanceUID = "1.2.3.5"
        for path in (self.folder / "slices", self.folder / "slices" / "8.dcm"):
            self.expect(Reading(path), tolerance=1e-7)
        self.save(other, "slices/other.dcm")
        self.expect(Reading(self.folder / "slices" / "8.dcm"), tolerance=1e-7)
        self.refused(self.folder / "slices", "2 series", "1.2.3.4 (5 files, the first 5.dcm)", "1.2.3.5 (1 files")
        (self.folder / "slices" / "other.dcm").unlink()
        (self.folder / "slices" / "7.dcm").unlink()
        self.refused(self.folder / "slices", "unevenly", "1.66 mm between 8.dcm and 6.dcm")
        self.save(slice_of(2, position=2.0 * SPACING[2], rotation=turned(0.31, -0.8, 2.1)), "slices/7.dcm")
        self.refused(self.folder / "slices", "not parallel")
        self.save(slice_of(2, voxels=VOXELS[:, :4]), "slices/7.dcm")
        self.refused(self.folder / "slices", "not like those")
        (self.folder / "slices" / "7.dcm").write_bytes((self.folder / "slices" / "8.dcm").read_bytes()[:-9])
        self.refused(self.folder / "slices", "7.dcm", "truncated")

    def test_series_over_time(self):
        for t in range(2):
            for k in range(5):
                data = slice_of(k, VOXELS + np.uint8(t))
                data.TemporalPositionIdentifier = t + 1
                self.save(data, f"slices/{t}{k}.dcm")
        self.expect(Reading(self.folder / "slices", 2.0), VOXELS + np.uint8(1), tolerance=1e-7)
        self.assertIn("not seconds", Reading(self.folder / "slices", 2.0).notes)

    def test_a_cine_is_no_volume(self):
        data = pixels(dataset(sop=MULTIFRAME), VOXELS)
        data.FrameTime = "33.3"
        data.FrameIncrementPointer = 0x00181063
        data.PixelSpacing = ["0.47", "0.31"]
        self.refused(data, "cine", "5 pictures of a plane over time")
        data.SpacingBetweenSlices = "0.83"
        self.refused(data, "cine")
        data.FrameIncrementPointer = 0x00180088
        del data.FrameTime
        reading = self.read(data)
        self.expect(reading, origin=(0, 0, 0), rotation=np.eye(3))
        self.assertIn("where its pictures lie", reading.notes)

    def test_one_picture(self):
        data = pixels(dataset(), VOXELS[0])
        self.assertIn("1 mm is taken", self.read(data).notes)
        region = item(RegionSpatialFormat=1, RegionDataType=1, PhysicalUnitsXDirection=3, PhysicalUnitsYDirection=3,
                      PhysicalDeltaX=0.031, PhysicalDeltaY=0.047)
        data.SequenceOfUltrasoundRegions = Sequence([region])
        self.expect(self.read(data), VOXELS[:1], (0, 0, 0), (0.31, 0.47, 1), np.eye(3))

    def test_philips(self):
        data = dataset(sop=MULTIFRAME)
        volumes = np.stack([VOXELS, VOXELS + np.uint8(1)])
        pixels(data, VOXELS)
        data.NumberOfFrames = 2
        data.PixelData = volumes.tobytes()
        data.add_new(0x0018602C, "FD", 0.031)
        data.add_new(0x0018602E, "FD", 0.047)
        data.add_new(0x30010010, "LO", "someone")
        data.add_new(0x30011001, "UL", 5)
        data.add_new(0x30011003, "FD", 0.083)
        data.FrameTime = "50"
        path = self.save(data)
        self.expect(Reading(path, 0.05), VOXELS + np.uint8(1), (0, 0, 0), SPACING, np.eye(3))
        self.assertIn("private elements of Philips", Reading(path).notes)
        data.PixelData = volumes.tobytes()[:-8]
        self.refused(data, "truncated")

        data = pixels(dataset(sop=MULTIFRAME), VOXELS)
        data.add_new(0x200D0010, "LO", "another")
        data.add_new(0x200D0011, "LO", "Philips US Imaging DD 036")
        data.add_new(0x200D1103, "LO", ["0.31", "0.47", "0.83"])
        self.expect(self.read(data), origin=(0, 0, 0), rotation=np.eye(3))

    def test_kretz_inside(self):
        if not KRETZ.exists():
            self.skipTest(f"{KRETZ} is not there")
        data = pixels(dataset(), VOXELS[0])
        data.add_new(0x7FE10011, "LO", "KRETZ_US")
        data.add_new(0x7FE11101, "OB", KRETZ.read_bytes())
        reading, direct = self.read(data), Reading(KRETZ)
        np.testing.assert_array_equal(reading.voxels, direct.voxels)
        self.assertEqual(reading.image.GetOrigin(), direct.image.GetOrigin())

    def test_movie_groups_are_not_known(self):
        data = dataset()
        data.add_new(0x7FE10010, "LO", "GEMS_Ultrasound_MovieGroup_001")
        data.add_new(0x7FE11001, "OB", b"1234")
        self.refused(data, "GEMS_Ultrasound_MovieGroup_001")
        pixels(data, VOXELS[0])  # the picture that stands for it
        data.PixelSpacing = ["0.47", "0.31"]
        self.assertIn("GEMS_Ultrasound_MovieGroup_001", self.read(data).notes)

    def test_types_of_numbers(self):
        for kind, bits in ((np.int8, 8), (np.uint16, 16), (np.int16, 16), (np.uint16, 12), (np.int16, 12), (np.int32, 32)):
            low = -(1 << bits - 1) if np.dtype(kind).kind == "i" else 0
            voxels = (low + VOXELS.astype(np.int64) * ((1 << bits) // 300)).astype(kind)
            for k in range(5):
                data = slice_of(k, voxels)
                data.BitsStored, data.HighBit = bits, bits - 1
                if bits == 12:  # what lies above the stored bits may be anything
                    mixed = (voxels[k].astype(np.uint16) & 0x0FFF) | 0xA000
                    data.PixelData = mixed.tobytes()
                self.save(data, f"{kind.__name__}{bits}/{k}.dcm")
            self.expect(Reading(self.folder / f"{kind.__name__}{bits}"), voxels, tolerance=1e-7)

    def test_inverted_and_rescaled(self):
        for k in range(5):
            data = slice_of(k)
            data.PhotometricInterpretation = "MONOCHROME1"
            self.save(data, f"inverted/{k}.dcm")
            data = slice_of(k)
            data.RescaleSlope, data.RescaleIntercept = "0.5", str(k)
            self.save(data, f"rescaled/{k}.dcm")
        reading = Reading(self.folder / "inverted")
        self.expect(reading, 255 - VOXELS, tolerance=1e-7)
        self.assertIn("MONOCHROME1", reading.notes)
        reading = Reading(self.folder / "rescaled")
        self.expect(reading, (VOXELS * 0.5 + np.arange(5)[:, None, None]).astype(np.float32), tolerance=1e-7)
        self.assertIn("slope", reading.notes)
        for k in range(5):  # that is how values are shown, and they stay what they are
            data = slice_of(k)
            data.RescaleSlope = "0.5"
            data.PhotometricInterpretation, data.RescaleIntercept = "MONOCHROME1", str(k)
            self.save(data, f"both/{k}.dcm")
        reading = Reading(self.folder / "both")
        self.expect(reading, (VOXELS * 0.5 + np.arange(5)[:, None, None]).astype(np.float32), tolerance=1e-7)
        self.assertIn("MONOCHROME1", reading.notes)

    def test_colours(self):
        colours = np.stack([VOXELS, VOXELS[::-1], 255 - VOXELS], axis=-1)
        luminance = (colours.astype(int) @ (299, 587, 114) + 500) // 1000
        grey = np.repeat(VOXELS[..., None], 3, axis=-1)

        def stack(array, photometric):
            data = pixels(dataset(sop=MULTIFRAME), array, photometric)
            data.PixelSpacing, data.SpacingBetweenSlices = ["0.47", "0.31"], "0.83"
            return data

        place = {"origin": (0, 0, 0), "rotation": np.eye(3)}
        self.expect(self.read(stack(colours, "RGB")), luminance, **place)
        reading = self.read(stack(grey, "RGB"))
        self.expect(reading, VOXELS, **place)
        self.assertIn("luminance", reading.notes)
        self.expect(self.read(stack(colours, "YBR_FULL")), VOXELS, **place)
        data = stack(colours, "RGB")
        data.PlanarConfiguration = 1
        data.PixelData = np.moveaxis(colours, -1, 1).tobytes()
        self.expect(self.read(data), luminance, **place)
        # YBR_FULL_422: two pixels as Y Y Cb Cr, with an even number of columns.
        even = VOXELS[:, :, :6]
        data = stack(np.repeat(even[..., None], 3, axis=-1), "YBR_FULL_422")
        pairs = even.reshape(5, 6, 3, 2)
        data.PixelData = np.concatenate([pairs, np.full_like(pairs, 128)], axis=-1).tobytes()
        self.expect(self.read(data), even, **place)
        data = stack(colours, "PALETTE COLOR")
        self.refused(data, "PALETTE COLOR")

    def compressed(self, syntax, frames, colour="MONOCHROME2"):
        data = enhanced(syntax=EXPLICIT)
        data.file_meta.TransferSyntaxUID = UID(syntax)
        data.PixelData = encapsulate(frames)
        data["PixelData"].VR = "OB"
        data["PixelData"].is_undefined_length = True
        if colour != "MONOCHROME2":
            data.PhotometricInterpretation, data.SamplesPerPixel, data.PlanarConfiguration = colour, 3, 0
        return data

    def test_compressed(self):
        data = enhanced()
        data.compress(RLE, encoding_plugin="pydicom")
        self.expect(self.read(data))
        colours = np.stack([VOXELS, VOXELS[::-1], 255 - VOXELS], axis=-1)
        pixels(data := enhanced(), colours, "RGB").compress(RLE, encoding_plugin="pydicom")
        self.expect(self.read(data), (colours.astype(int) @ (299, 587, 114) + 500) // 1000)
        try:
            from PIL import Image
        except ImportError:
            self.skipTest("pillow is not there")

        def encoded(image, **options):
            stream = io.BytesIO()
            Image.fromarray(image).save(stream, **options)
            return stream.getvalue()

        frames = [encoded(v, format="JPEG2000", irreversible=False) for v in VOXELS]
        frames = [f[f.index(b"\xff\x4f\xff\x51"):] for f in frames]  # the code stream alone
        self.expect(self.read(self.compressed(JPEG2000, frames)))

        smooth = (100 + 50 * np.sin(np.add.outer(np.arange(64), np.arange(48)) / 9.0)).astype(np.uint8)
        colours = np.stack([smooth, smooth // 2, 255 - smooth], axis=-1)
        luminance = (colours.astype(int) @ (299, 587, 114) + 500) // 1000
        for array, colour, sampling, wanted in ((smooth, "MONOCHROME2", 0, smooth), (colours, "YBR_FULL_422", 1, luminance),
                                                (colours, "YBR_FULL", 0, luminance)):
            options = {"subsampling": sampling} if colour != "MONOCHROME2" else {}
            data = self.compressed(JPEG, [encoded(array, format="JPEG", quality=98, **options)] * 5, colour)
            data.Rows, data.Columns = smooth.shape
            reading = self.read(data)
            self.assertEqual(reading.error, "")
            self.assertLess(np.abs(reading.voxels.astype(int) - wanted).max(), 6, colour)

    def test_damaged_compression(self):
        data = enhanced()
        data.compress(RLE, encoding_plugin="pydicom")
        frames = list(pydicom.encaps.generate_pixel_data_frame(data.PixelData, 5))
        self.refused(self.compressed(RLE, frames[:3]), "cannot be decoded")
        self.refused(self.compressed(RLE, [b"\x07" * len(frames[0])] + frames[1:]), "cannot be decoded")
        self.refused(self.compressed(JPEG, [b"nothing at all"] * 5), "cannot be decoded")
        data.Rows = data.Columns = 60000
        self.refused(data, "more than can be compressed")

    def test_nobody_is_named(self):
        data = enhanced()
        data.BurnedInAnnotation = "YES"
        reading = self.read(data)
        fields = reading.image.GetFieldData()
        found = {fields.GetArrayName(i): fields.GetAbstractArray(i).GetValue(0) for i in range(fields.GetNumberOfArrays())}
        self.assertEqual(found, {"Modality": "US", "Manufacturer": "Maker", "ManufacturerModelName": "Model 7",
                                 "TransducerType": "SECTOR_PHASED"})
        self.assertIn("burned", reading.notes)

    def test_bad_input(self):
        whole = self.save(enhanced()).read_bytes()
        path = self.folder / "bad.dcm"
        for length in (131, 140, 300, 900, len(whole) - 20, len(whole) - 1):
            path.write_bytes(whole[:length])
            self.refused(path, "bad.dcm")
        path.write_bytes(b"\0" * 128 + b"DICM" + b"\xff" * 500)
        self.refused(path, "bad.dcm")
        data = enhanced()
        del data.PixelData
        self.refused(data, "no pictures")
        for change, word in ((dict(Rows=7), "truncated or its sizes"), (dict(NumberOfFrames=2000000000), "number of frames"),
                             (dict(BitsAllocated=12), "12 bits"), (dict(BitsStored=9), "9 bits"), (dict(HighBit=9), "bit 9"),
                             (dict(SamplesPerPixel=3), "3 numbers"), (dict(Rows=0), "x 0 pixels")):
            data = enhanced()
            for name, value in change.items():
                setattr(data, name, value)
            self.refused(data, word)
        data = slice_of(0, syntax=BIG_ENDIAN)
        self.refused(data, "big-endian")
        (self.folder / "empty").mkdir()
        self.refused(self.folder / "empty", "folder")


unittest.main(verbosity=1)
