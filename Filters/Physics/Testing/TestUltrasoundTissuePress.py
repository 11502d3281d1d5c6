#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundTissuePress: bodies with materials become cells, a probe presses them, and what comes out moves surfaces. (How well the
solver solves: TestTissuePress.cxx.)"""
import time
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

import echorama
from pressing import BACK, TOP, Refusing, ball, block, probe, tissue


def press(body, *probes, **properties):
    filter = echorama.vtkUltrasoundTissuePress()
    filter.SetInputData(body)
    for each in probes:
        filter.AddProbeData(each)
    filter.SetSpacingMm(5.0)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    return filter


def run(*arguments, **properties):
    filter = press(*arguments, **properties)
    filter.Update()
    return filter.GetOutput()


def values(image, name):
    return vtk_to_numpy(image.GetPointData().GetArray(name))


def at(image, name, *place):
    return values(image, name)[image.FindPoint(place)]


def field(image, name):
    return vtk_to_numpy(image.GetFieldData().GetArray(name)).ravel()


class Press(Refusing):
    def test_the_skin_follows_the_face(self):
        body = tissue(muscle=block())
        filter = press(body, probe(6.0))
        filter.UpdateInformation()
        promised = filter.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT())
        filter.Update()
        pressed = filter.GetOutput()
        self.assertEqual((tuple(promised), pressed.GetExtent()), ((0, 12, 0, 12, 0, 7),) * 2)
        np.testing.assert_allclose(pressed.GetOrigin(), (-30.0, -30.0, TOP))
        self.assertEqual(pressed.GetPointData().GetVectors().GetName(), "Displacement")
        below = at(pressed, "Displacement", 0.0, 0.0, TOP)
        np.testing.assert_allclose(below, (0.0, 0.0, 6.0), atol=0.05)
        self.assertEqual((at(pressed, "Contact", 0.0, 0.0, TOP), at(pressed, "Contact", 30.0, 30.0, TOP)), (1, 0))
        self.assertTrue(values(pressed, "Tissue").all())
        points = np.array([pressed.GetPoint(n) for n in range(pressed.GetNumberOfPoints())])
        self.assertEqual(np.abs(values(pressed, "Displacement")[points[:, 2] == BACK]).max(), 0.0)
        force = field(pressed, "ProbeForce")
        self.assertGreater(force[2], 1.0)
        self.assertLess(np.abs(force[:2]).max(), 0.01 * force[2])
        now, least = field(pressed, "RelativeVolume")
        self.assertTrue(0.95 < now < 1.0 and 0.3 < least < now, (now, least))

        deform = echorama.vtkUltrasoundDeformGeometry()
        deform.SetInputData(body)
        deform.SetDisplacementData(pressed)
        deform.SetOutsideToNearest()
        deform.Update()
        self.assertAlmostEqual(deform.GetOutput().GetBounds()[5], BACK, 5)

    def test_force_is_in_proportion_to_stiffness(self):
        forces, shapes = [], []
        for material in ("liver", "muscle"):  # 5 and 15 kPa
            pressed = run(tissue(**{material: block()}), probe(6.0))
            forces.append(field(pressed, "ProbeForce")[2])
            shapes.append(values(pressed, "Displacement").copy())
        self.assertAlmostEqual(forces[1] / forces[0], 3.0, delta=0.03)
        self.assertLess(np.abs(shapes[1] - shapes[0]).max(), 0.05)

    def test_materials_differ_from_cell_to_cell(self):
        inside = (0.0, 0.0, 40.0)
        plain = run(tissue(muscle=block()), probe(6.0))
        moved = at(plain, "Displacement", *inside)[2]
        self.assertGreater(moved, 0.5)
        bone = run(tissue(muscle=block(), bone=ball(8.0, *inside)), probe(6.0))
        self.assertEqual(np.abs(at(bone, "Displacement", *inside)).max(), 0.0)
        self.assertGreater(field(bone, "ProbeForce")[2], 1.1 * field(plain, "ProbeForce")[2])
        free = run(tissue(muscle=block(), bone=ball(8.0, *inside)), probe(6.0), HeldMaterials="")  # stiff, but tied to nothing
        self.assertGreater(at(free, "Displacement", *inside)[2], 0.3)
        fluid = run(tissue(muscle=block(), cyst=ball(8.0, *inside)), probe(6.0))
        gas = run(tissue(muscle=block(), air=ball(8.0, *inside)), probe(6.0))
        self.assertEqual([at(image, "Tissue", *inside) for image in (fluid, gas)], [1, 0])
        self.assertLess(field(fluid, "ProbeForce")[2], field(plain, "ProbeForce")[2])
        self.assertGreater(np.abs(at(gas, "Displacement", *inside)).max(), 0.0)  # what lies around it has

    def test_probe_comes_and_goes(self):
        body = tissue(muscle=block())
        rest = run(body)
        self.assertEqual(np.abs(values(rest, "Displacement")).max(), 0.0)
        lifted = run(body, probe(6.0), probe(-5.0))
        self.assertLess(np.abs(values(lifted, "Displacement")).max(), 6e-3)
        self.assertEqual((np.abs(field(lifted, "ProbeForce")).max(), values(lifted, "Contact").max()), (0.0, 0))
        dragged = run(body, probe(4.0), probe(4.0, 5.0), Friction=1.0)
        direct = run(body, probe(4.0, 5.0), Friction=1.0)
        self.assertGreater(at(dragged, "Displacement", 5.0, 0.0, TOP)[0], at(direct, "Displacement", 5.0, 0.0, TOP)[0] + 1.0)

    def test_appended_poses_go_on_from_where_the_tissue_is(self):
        body, poses = tissue(muscle=block()), [probe(3.0), probe(6.0), probe(6.0, 2.0)]

        def at_once(*poses, **properties):
            return values(run(body, *poses, Friction=0.3, **properties), "Displacement").copy()

        filter = press(body, Friction=0.3)
        for pose in poses:
            filter.AddProbeData(pose)
            filter.Update()
        grown = values(filter.GetOutput(), "Displacement").copy()
        np.testing.assert_array_equal(grown, at_once(*poses))
        clock = [time.process_time()]
        for step in (lambda: run(body, *poses, Friction=0.3), lambda: (filter.AddProbeData(probe(6.0, 2.1)), filter.Update())):
            step()
            clock.append(time.process_time())
        self.assertLess(clock[2] - clock[1], 0.6 * (clock[1] - clock[0]))  # it did not start anew
        # What is not only appended starts anew: other parameters, other poses, other tissue.
        filter.SetFriction(0.0)
        filter.Update()
        self.assertGreater(np.abs(values(filter.GetOutput(), "Displacement") - grown).max(), 1e-3)
        filter.SetFriction(0.3)
        filter.RemoveAllProbes()
        filter.AddProbeData(poses[1])
        filter.Update()
        np.testing.assert_array_equal(values(filter.GetOutput(), "Displacement"), at_once(poses[1]))
        moved = probe(6.0)
        filter.AddProbeData(moved)
        filter.Update()
        moved.DeepCopy(probe(3.0))  # a pose that was used already is another one now
        filter.Update()
        np.testing.assert_array_equal(values(filter.GetOutput(), "Displacement"), at_once(poses[1], poses[0]))
        softer = tissue(liver=block())
        filter.SetInputData(softer)
        filter.Update()
        self.assertLess(field(filter.GetOutput(), "ProbeForce")[2], 0.5 * field(run(body, poses[1], poses[0]), "ProbeForce")[2])
        # After a pose that cannot be, too.
        bony = press(tissue(muscle=block(), bone=ball(8.0, 0.0, 0.0, 32.0)), probe(2.0))
        bony.Update()
        before = values(bony.GetOutput(), "Displacement").copy()
        bony.AddProbeData(probe(15.0))
        self.refused(bony, "probe 2", "rigid")
        bony.RemoveAllProbes()
        bony.AddProbeData(probe(2.0))
        bony.Update()
        np.testing.assert_array_equal(values(bony.GetOutput(), "Displacement"), before)

    def test_gravity_runs_along_the_world(self):
        sagged = run(tissue(muscle=block()), Gravity=(0.0, 9.81, 0.0))
        self.assertGreater(at(sagged, "Displacement", 0.0, 0.0, TOP)[1], 0.1)

    def test_what_is_refused(self):
        body = tissue(muscle=block())
        bony = tissue(muscle=block(), bone=ball(8.0, 0.0, 0.0, 32.0))
        self.refused(press(bony, probe(15.0)), "probe 1", "rigid", "mm far")
        self.refused(press(body, vtkPolyData()), "probe 1", "ProbeGeometry")
        self.refused(press(vtkPolyData(), probe(5.0)), "no field data MaterialName")
        self.refused(press(body, probe(5.0), FixZMax=False), "holds the tissue")
        self.refused(press(body, probe(5.0), HeldMaterials="bone ivory"), "ivory")
        self.refused(press(body, probe(5.0), SpacingMm=0.1), "SpacingMm", "too many")
        self.refused(press(body, probe(5.0), Poisson=0.5), "Poisson", "0.499")
        self.refused(press(body, probe(5.0), HeadEdgeMm=7.0), "HeadEdgeMm")


if __name__ == "__main__":
    unittest.main()
