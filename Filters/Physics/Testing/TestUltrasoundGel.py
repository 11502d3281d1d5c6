#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundGel: tissue and a probe go in, tissue with gel and the coupling of the face come out, and sound goes where there is
gel. (How gel spreads: TestGelCoat.cxx; how it flows: TestGelSolver.cxx.)"""
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkFiltersCore import vtkFeatureEdges, vtkMassProperties, vtkThreshold
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter

import echorama
from pressing import BACK, TOP, Refusing, acquisition, add_field, block, probe, tissue


def gel(body, *probes, **properties):
    filter = echorama.vtkUltrasoundGel()
    filter.SetInputData(body)
    for each in probes:
        filter.AddProbeData(each)
    filter.SetCellMm(3.0)
    filter.SetSettleS(0.02)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    return filter


def run(*arguments, **properties):
    filter = gel(*arguments, **properties)
    filter.Update()
    return filter.GetOutput(0), filter.GetOutput(1)


def names(data):
    field = data.GetFieldData().GetAbstractArray("BodyName")
    return [field.GetValue(n) for n in range(field.GetNumberOfValues())] if field else []


def first_body(data):
    chosen = vtkThreshold()
    chosen.SetInputData(data)
    chosen.SetInputArrayToProcess(0, 0, 0, 1, "Body")
    chosen.SetLowerThreshold(0)
    chosen.SetUpperThreshold(0)
    chosen.SetThresholdFunction(vtkThreshold.THRESHOLD_BETWEEN)
    surface = vtkGeometryFilter()
    surface.SetInputConnection(chosen.GetOutputPort())
    surface.Update()
    return surface.GetOutput()


def values(data, name):
    return vtk_to_numpy(data.GetPointData().GetArray(name))


def field(data, name):
    return data.GetFieldData().GetArray(name).GetValue(0)


def scan(body, at):
    filter = echorama.vtkUltrasoundSynthesizer()
    filter.SetInputData(body)
    filter.SetInputData(1, at)
    for name, value in {"Elements": 24, "Steps": 2, "Samples": 120, "DepthMin": 0.0, "SpacingMm": 1.0, "NoiseDb": -200.0}.items():
        getattr(filter, "Set" + name)(value)
    filter.Update()
    return filter.GetOutput(1)


class Gel(Refusing):
    def test_gel_is_a_closed_body_of_its_volume(self):
        body = tissue(muscle=block())
        coated, face = run(body, probe(-4.0), AmountMl=3.0)
        self.assertEqual(names(coated)[0], "gel")
        materials = coated.GetFieldData().GetAbstractArray("MaterialName")
        self.assertEqual([materials.GetValue(n) for n in range(3)], ["air", "gel", "muscle"])
        surface = first_body(coated)
        edges = vtkFeatureEdges()
        edges.SetInputData(surface)
        edges.FeatureEdgesOff()
        edges.ManifoldEdgesOff()
        edges.Update()
        self.assertEqual(edges.GetOutput().GetNumberOfCells(), 0, "the surface has open or manifold edges that are none")
        mass = vtkMassProperties()
        mass.SetInputData(surface)
        mass.Update()
        self.assertGreater(mass.GetVolume(), 3000.0)  # what lies within skin and head comes on top
        self.assertLess(mass.GetVolume(), 7500.0)
        self.assertAlmostEqual(field(face, "GelVolume"), 3000.0, delta=150.0)
        points = np.array([surface.GetPoint(n) for n in range(surface.GetNumberOfPoints())])
        self.assertLess(points[:, 2].max(), TOP + 4.5)  # the reach of a particle, a cell and a half, into the skin
        # All else is as it was.
        self.assertEqual(coated.GetNumberOfCells() - surface.GetNumberOfCells(), body.GetNumberOfCells())

    def test_face_says_what_lies_before_it(self):
        _, face = run(tissue(muscle=block()), probe(-4.0), AmountMl=1.0, Coverage=0.5, CellMm=2.0)
        self.assertEqual(face.GetNumberOfPoints(), 48 * 48)
        self.assertEqual(face.GetNumberOfCells(), 47 * 47)
        couples = values(face, "Couples")
        self.assertTrue(0.05 < couples.mean() < 0.95)
        self.assertAlmostEqual(field(face, "Coupled"), couples.mean())
        self.assertTrue((values(face, "Gel")[couples == 1] > 3.0).all())
        self.assertTrue((values(face, "Air")[couples == 1] < 1.0).all())
        middle, corner = 24 * 48 + 24, 0
        self.assertEqual((couples[middle], couples[corner]), (1, 0))
        np.testing.assert_allclose(face.GetPoint(middle), (0.0, 0.0, TOP - 4.0), atol=0.7)

    def test_sound_goes_where_there_is_gel(self):
        body, at = tissue(muscle=block()), probe(-4.0)
        below = {}
        for amount in (4.0, 0.0):
            coated, face = run(body, at, AmountMl=amount)
            beams = scan(coated, at)
            depth = vtk_to_numpy(beams.GetPointData().GetScalars()).reshape(beams.GetDimensions()[::-1])
            below[amount] = float(depth.max()), float(depth.mean())
            self.assertEqual(names(coated)[0] == "gel", amount > 0.0)
            self.assertEqual(field(face, "Coupled") > 0.9, amount > 0.0)
        self.assertGreater(below[4.0][1], 10.0)
        self.assertLess(below[0.0][0], 1.0, "air lets sound pass")

    def test_tissue_that_yields(self):
        body, at = tissue(muscle=block()), probe(5.0)
        press = echorama.vtkUltrasoundTissuePress()
        press.SetInputData(body)
        press.AddProbeData(at)
        press.SetSpacingMm(5.0)
        deform = echorama.vtkUltrasoundDeformGeometry()
        deform.SetInputData(body)
        deform.SetDisplacementConnection(press.GetOutputPort())
        deform.SetOutsideToNearest()
        filter = gel(body, at, AmountMl=6.0)
        filter.SetPressedConnection(deform.GetOutputPort())
        filter.Update()
        coated, face = filter.GetOutput(0), filter.GetOutput(1)
        self.assertEqual(names(coated)[0], "gel")
        self.assertEqual(coated.GetBounds()[5], deform.GetOutput().GetBounds()[5])
        self.assertGreater(field(face, "Coupled"), 0.2)

    def test_goes_on_where_it_was(self):
        """Poses that are added, with the tissue that they press, give what all of them at once give."""
        sunk = block()
        sunk.SetBounds(-30.0, 30.0, -30.0, 30.0, TOP + 3.0, BACK)
        rest, deep = tissue(muscle=block()), tissue(muscle=sunk)
        poses = [probe(-4.0), probe(2.0), probe(-15.0), probe(-4.0, x=6.0)]
        states = [rest, deep, rest, rest]
        for n, each in enumerate(poses):
            add_field(each, acquisition.TimeStampName(), [10.0 + 0.4 * n])
        small = {"AmountMl": 0.5, "Coverage": 0.5, "CellMm": 4.0}
        grown = gel(rest, poses[0], **small)
        grown.AddPressedData(states[0])
        grown.Update()
        self.assertEqual(grown.GetPosesComputed(), 1)
        for n, count in ((1, 1), (2, 1), (3, 1)):
            grown.AddProbeData(poses[n])
            grown.AddPressedData(states[n])
            grown.Update()
            self.assertEqual(grown.GetPosesComputed(), count)
        whole = gel(rest, *poses, **small)
        for state in states:
            whole.AddPressedData(state)
        whole.Update()
        self.assertEqual(whole.GetPosesComputed(), 4)
        for port in (0, 1):
            one, all = (filter.GetOutput(port) for filter in (grown, whole))
            np.testing.assert_array_equal(vtk_to_numpy(one.GetPoints().GetData()), vtk_to_numpy(all.GetPoints().GetData()))
        for name in ("Gel", "Air", "Couples"):
            np.testing.assert_array_equal(values(grown.GetOutput(1), name), values(whole.GetOutput(1), name))
        for name in ("Coupled", "GelVolume", "GelGone", "Seconds"):
            self.assertEqual(field(grown.GetOutput(1), name), field(whole.GetOutput(1), name))
        self.assertGreater(field(whole.GetOutput(1), "Seconds"), 3 * 0.4 + 0.02)
        # Anything else begins anew.
        grown.SetAmountMl(0.4)
        grown.Update()
        self.assertEqual(grown.GetPosesComputed(), 4)
        grown.RemoveAllProbes()
        grown.RemoveAllPressed()
        grown.AddProbeData(poses[1])
        grown.Update()
        self.assertEqual(grown.GetPosesComputed(), 1)

    def test_materials_that_the_tissue_brings(self):
        own = tissue(gel=block(), muscle=block())
        def speed(data, place):
            return data.GetFieldData().GetArray("MaterialProperty").GetComponent(place, 0)

        self.assertNotEqual(speed(own, 1), 1234.0)
        own.GetFieldData().GetArray("MaterialProperty").SetComponent(1, 0, 1234.0)
        coated, _ = run(own, probe(-4.0), AmountMl=0.5, CellMm=4.0)
        names_of = coated.GetFieldData().GetAbstractArray("MaterialName")
        self.assertEqual([names_of.GetValue(n) for n in range(2)], ["air", "gel"])
        self.assertEqual(speed(coated, 1), 1234.0)

    def test_what_is_refused(self):
        body = tissue(muscle=block())
        self.refused(gel(body, vtkPolyData()), "probe 1", "ProbeGeometry")
        self.refused(gel(vtkPolyData(), probe(-4.0)), "no field data MaterialName")
        self.refused(gel(body, probe(-4.0), AmountMl=900.0), "AmountMl", "mm high")
        self.refused(gel(body, probe(-4.0), CellMm=0.0), "CellMm")
        self.refused(gel(body, probe(-4.0), BulkModulus=-5.0), "BulkModulus")
        other = gel(body, probe(-4.0))
        other.SetPressedData(tissue(muscle=block(), liver=block()))
        self.refused(other, "points")
        states = gel(body, probe(-4.0), probe(-3.0), probe(-4.0))
        states.AddPressedData(body)
        states.AddPressedData(body)
        self.refused(states, "3 probes", "2 states")
        times = [probe(-4.0), probe(-3.0)]
        for each in times:
            add_field(each, acquisition.TimeStampName(), [7.0])
        self.refused(gel(body, *times), "time stamp of probe 2")


if __name__ == "__main__":
    unittest.main()
