#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundDeformGeometry: what follows a displacement and how, which way it runs, what is told and what is refused. (Pose and arrays
of volumes: TestDataContract.py.)"""
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import VTK_TETRA, vtkCellArray, vtkImageData, vtkMultiBlockDataSet, vtkPolyData, vtkUnstructuredGrid
from vtkmodules.vtkFiltersSources import vtkSphereSource

import echorama

TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # of all lattices here
STRETCH = np.array([[1.1, 0.2, 0.0], [-0.1, 0.9, 0.1], [0.0, 0.15, 1.2]])
SHIFT = np.array([1.0, -2.0, 0.5])


def affine(points):
    return points @ STRETCH.T + SHIFT


def image(size, spacing, first=(-20.0, -20.0, -20.0)):
    made = vtkImageData()
    made.SetDimensions(*size)
    made.SetSpacing(spacing, spacing, spacing)
    made.SetDirectionMatrix(*TURN.ravel())
    made.SetOrigin(*(TURN @ first))
    return made


def points_of(data):
    return np.array([data.GetPoint(i) for i in range(data.GetNumberOfPoints())]).reshape(-1, 3)


def add(data, name, values):
    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    array.SetName(name)
    data.AddArray(array)
    return array


def lattice(field, size=(9, 9, 9), spacing=5.0):
    """A displacement image; field says where the points go."""
    made = image(size, spacing)
    at = points_of(made)
    add(made.GetPointData(), echorama.vtkUltrasoundDisplacement.DisplacementName(), field(at) - at)
    return made


def values(data, name):
    array = data.GetPointData().GetArray(name)
    return None if array is None else vtk_to_numpy(array)


def field_value(data, name):
    return vtk_to_numpy(data.GetFieldData().GetArray(name)).ravel().tolist()


class DeformGeometry(unittest.TestCase):
    def filter(self, data, displacement, **properties):
        made = echorama.vtkUltrasoundDeformGeometry()
        if data is not None:
            made.SetInputDataObject(0, data)
        if displacement is not None:
            made.SetDisplacementData(displacement)
        for name, value in properties.items():
            self.assertTrue(made.SetParameterAsText(name, value))
        self.messages = {"ErrorEvent": [], "WarningEvent": []}
        for event in self.messages:

            def remember(caller, _, message, kept=self.messages[event]):
                kept.append(message)

            remember.CallDataType = "string0"
            made.AddObserver(getattr(vtkCommand, event), remember)
        made.Update()
        return made

    def deformed(self, data, displacement, **properties):
        output = self.filter(data, displacement, **properties).GetOutputDataObject(0)
        self.assertEqual(self.messages["ErrorEvent"], [])
        return output

    def refused(self, data, displacement, words, **properties):
        output = self.filter(data, displacement, **properties).GetOutputDataObject(0)
        said = " ".join(self.messages["ErrorEvent"])
        for word in words:
            self.assertIn(word, said)
        self.assertEqual(output.GetNumberOfPoints(), 0)

    def surface(self):
        ball = vtkSphereSource()
        ball.SetRadius(8.0)
        ball.SetOutputPointsPrecision(1)  # double
        ball.Update()
        data = vtkPolyData()
        data.DeepCopy(ball.GetOutput())
        add(data.GetPointData(), "Flow", np.tile([[1.0, 2.0, 3.0]], (data.GetNumberOfPoints(), 1)))
        data.GetPointData().SetActiveVectors("Flow")
        add(data.GetCellData(), "Normals", np.ones((data.GetNumberOfCells(), 3)))
        data.GetCellData().SetActiveNormals("Normals")
        add(data.GetCellData(), "Organ", np.arange(data.GetNumberOfCells()))
        add(data.GetFieldData(), "Remark", np.array([4.0]))
        return data

    def test_a_surface_moves_from_rest_to_now_and_back(self):
        ball = self.surface()
        moved = self.deformed(ball, lattice(affine))
        self.assertIsInstance(moved, vtkPolyData)
        at = points_of(ball)
        self.assertLess(np.abs(points_of(moved) - affine(at)).max(), 1e-12 * 40)
        self.assertEqual(moved.GetNumberOfPolys(), ball.GetNumberOfPolys())
        self.assertTrue(np.array_equal(vtk_to_numpy(moved.GetPolys().GetConnectivityArray()), vtk_to_numpy(ball.GetPolys().GetConnectivityArray())))
        back = self.deformed(moved, lattice(affine), Direction="backward")
        self.assertLess(np.abs(points_of(back) - at).max(), 1e-12 * 40)
        self.assertLess(np.abs(points_of(ball) - at).max(), 1e-15)  # the input is as it was
        self.assertEqual(field_value(moved, "DeformationFolded"), [0.0, 0.0])
        self.assertEqual(field_value(moved, "DeformationOutside"), [0.0])
        self.assertAlmostEqual(field_value(moved, "DeformationJacobian")[0], np.linalg.det(STRETCH), 12)
        self.assertEqual(field_value(moved, "Remark"), [4.0])

    def test_normals_turn_and_vectors_as_asked(self):
        ball = self.surface()
        moved = self.deformed(ball, lattice(affine))
        normals = values(ball, "Normals").astype(float) @ np.linalg.inv(STRETCH)
        normals /= np.linalg.norm(normals, axis=1)[:, np.newaxis]
        self.assertLess(np.abs(values(moved, "Normals") - normals).max(), 1e-6)  # they are floats
        self.assertEqual(moved.GetPointData().GetNormals().GetName(), "Normals")
        self.assertTrue(np.array_equal(values(moved, "Flow"), values(ball, "Flow")))
        self.assertIsNone(moved.GetCellData().GetArray("Normals"))
        self.assertIsNotNone(moved.GetCellData().GetArray("Organ"))
        turned = self.deformed(ball, lattice(affine), MoveVectors="on")
        self.assertLess(np.abs(values(turned, "Flow") - STRETCH @ [1, 2, 3]).max(), 1e-12)
        back = self.deformed(turned, lattice(affine), MoveVectors="on", Direction="backward")
        self.assertLess(np.abs(values(back, "Flow") - [1, 2, 3]).max(), 1e-12)
        self.assertLess(np.abs(values(back, "Normals") - values(ball, "Normals")).max(), 1e-6)

    def test_meshes_landmarks_and_blocks(self):
        mesh = vtkUnstructuredGrid()
        points = vtkPoints()
        points.SetDataTypeToFloat()
        for point in ((0, 0, 0), (3, 0, 0), (0, 4, 0), (0, 0, 5)):
            points.InsertNextPoint(point)
        mesh.SetPoints(points)
        mesh.InsertNextCell(VTK_TETRA, 4, [0, 1, 2, 3])
        landmarks = vtkPolyData()
        marks = vtkPoints()
        marks.InsertNextPoint(1.0, -7.0, 2.0)
        landmarks.SetPoints(marks)
        labels = vtkStringArray()
        labels.SetName("Label")
        labels.InsertNextValue("apex")
        landmarks.GetPointData().AddArray(labels)
        moved = self.deformed(mesh, lattice(affine))
        self.assertIsInstance(moved, vtkUnstructuredGrid)
        self.assertEqual(moved.GetCellType(0), VTK_TETRA)
        self.assertEqual(moved.GetPoints().GetDataType(), points.GetDataType())
        self.assertLess(np.abs(points_of(moved) - affine(points_of(mesh))).max(), 1e-5)
        blocks = vtkMultiBlockDataSet()
        blocks.SetBlock(0, mesh)
        blocks.SetBlock(1, landmarks)
        both = self.deformed(blocks, lattice(affine))
        for number, data in enumerate((mesh, landmarks)):
            self.assertLess(np.abs(points_of(both.GetBlock(number)) - affine(points_of(data))).max(), 1e-5)
        self.assertEqual(both.GetBlock(1).GetPointData().GetAbstractArray("Label").GetValue(0), "apex")

    def volume(self):
        made = image((31, 33, 29), 0.9, (-14.0, -15.0, -13.0))
        at = points_of(made)
        add(made.GetPointData(), "Intensity", at @ [0.5, -1.0, 2.0] + 100.0)
        made.GetPointData().SetActiveScalars("Intensity")
        add(made.GetPointData(), "Organ", (at[:, 0] > 0).astype(np.int32))
        return made

    def test_images_show_what_has_come_and_where_nothing_has(self):
        start = self.volume()
        moved = self.deformed(start, lattice(affine))
        there = values(moved, "ValidRegion") != 0
        came_from = np.linalg.solve(STRETCH, (points_of(moved) - SHIFT).T).T
        inside = (np.abs((came_from @ TURN - [-14.0, -15.0, -13.0]) / 0.9 - [15, 16, 14]) < [15, 16, 14]).all(1)
        self.assertGreater(inside.sum(), 10000)
        self.assertTrue(there[inside].all())
        self.assertFalse(there.all())
        self.assertLess(np.abs(values(moved, "Intensity") - came_from @ [0.5, -1.0, 2.0] - 100.0)[inside].max(), 1e-10)
        clear = inside & (np.abs(came_from[:, 0]) > 0.9)
        self.assertTrue(np.array_equal(values(moved, "Organ")[clear], (came_from[clear, 0] > 0).astype(np.int32)))
        self.assertTrue((values(moved, "Intensity")[~there] == 0).all())
        self.assertEqual(moved.GetPointData().GetScalars().GetName(), "Intensity")

    def test_an_image_lands_on_another_grid(self):
        grid = image((12, 5, 6), 1.3, (-6.0, -2.0, -3.0))
        made = echorama.vtkUltrasoundDeformGeometry()
        made.SetInputDataObject(0, self.volume())
        made.SetDisplacementData(lattice(affine))
        made.SetGridData(grid)
        made.Update()
        moved = made.GetOutputDataObject(0)
        self.assertEqual(moved.GetDimensions(), grid.GetDimensions())
        self.assertLess(np.abs(points_of(moved) - points_of(grid)).max(), 1e-12)
        came_from = np.linalg.solve(STRETCH, (points_of(grid) - SHIFT).T).T
        self.assertLess(np.abs(values(moved, "Intensity") - came_from @ [0.5, -1.0, 2.0] - 100.0).max(), 1e-10)

    def test_the_inverse_is_a_displacement_again(self):
        there = lattice(affine)
        inverse = self.deformed(image((17, 17, 17), 1.5, (-12.0, -12.0, -12.0)), there, Result="displacement", Outside="mask")
        self.assertTrue(values(inverse, "ValidRegion").all())
        at = points_of(inverse)
        self.assertLess(np.abs(affine(at + values(inverse, "Displacement")) - at).max(), 1e-11)
        ball = self.surface()
        back = self.deformed(self.deformed(ball, there), inverse)
        self.assertLess(np.abs(points_of(back) - points_of(ball)).max(), 1e-11)
        # Backward it is the displacement itself.
        same = self.deformed(image((5, 5, 5), 3.0, (-6.0, -6.0, -6.0)), there, Result="displacement", Direction="backward")
        self.assertLess(np.abs(values(same, "Displacement") - affine(points_of(same)) + points_of(same)).max(), 1e-12)
        self.refused(ball, there, ["Result"], Result="displacement")

    def test_one_direction_with_smooth_displacements(self):
        """What a smooth displacement says of the points of its lattice is what happens here."""
        def pressed(at):
            return at + np.exp(-(at ** 2).sum(1) / 200.0)[:, np.newaxis] * [0.5, 0.3, 2.0]

        there = lattice(pressed)
        nodes = vtkPolyData()
        points = vtkPoints()
        points.SetDataTypeToDouble()
        some = points_of(there)[::37]
        for point in some:
            points.InsertNextPoint(point)
        nodes.SetPoints(points)
        moved = points_of(self.deformed(nodes, there))
        for start, end in zip(some, moved):
            shift, belongs = [0.0] * 3, [0.0] * 3
            self.assertTrue(echorama.vtkUltrasoundDisplacement.Evaluate(there, start, shift))
            self.assertLess(np.abs(start + shift - end).max(), 1e-10)
            self.assertTrue(echorama.vtkUltrasoundDisplacement.Invert(there, end, belongs))
            self.assertLess(np.abs(belongs - start).max(), 1e-5)

    def test_outside_is_refused_marked_kept_or_follows(self):
        far = vtkPolyData()
        points = vtkPoints()
        points.InsertNextPoint(0.0, 0.0, 0.0)
        points.InsertNextPoint(50.0, 0.0, 0.0)
        far.SetPoints(points)
        there = lattice(lambda at: at + [0.0, 1.0, 0.0])
        self.refused(far, there, ["1 of 2 points", "(50, 0, 0)", "Outside"])
        masked = self.deformed(far, there, Outside="mask")
        self.assertEqual(values(masked, "ValidRegion").tolist(), [1, 0])
        self.assertEqual(field_value(masked, "DeformationOutside"), [1.0])
        for outside, y in (("mask", 0.0), ("keep", 0.0), ("nearest", 1.0)):
            self.assertAlmostEqual(self.deformed(far, there, Outside=outside).GetPoint(1)[1], y, 6)
        self.assertIsNone(values(self.deformed(far, there, Outside="keep"), "ValidRegion"))

    def test_folds_are_refused_or_marked_and_counted(self):
        fold = lattice(lambda at: at * [1.0, 1.0, -1.0])
        self.refused(self.surface(), fold, ["folds 3072 of the 3072", "volume ratio is -1"])
        ball = self.deformed(self.surface(), fold, MaskFolds="on")
        self.assertFalse(values(ball, "ValidRegion").any())
        self.assertEqual(field_value(ball, "DeformationFolded"), [3072.0, ball.GetNumberOfPoints()])
        self.assertIn("folds 3072 of 3072", " ".join(self.messages["WarningEvent"]))
        volume = self.deformed(self.volume(), fold, MaskFolds="on", Outside="mask")
        self.assertFalse(values(volume, "ValidRegion").any())

    def test_voxels_that_are_no_numbers_do_not_spread(self):
        start = self.volume()
        intensity = values(start, "Intensity")
        broken = intensity.size // 2
        intensity[broken] = np.nan
        moved = self.deformed(start, lattice(lambda at: at + [0.3, 0.2, 0.1]))
        self.assertTrue(np.isfinite(values(moved, "Intensity")).all())
        self.assertEqual(values(moved, "ValidRegion")[broken], 0)

    def test_where_the_displacement_is_unknown(self):
        there = lattice(affine)
        known = (points_of(there)[:, 0] < 1.0).astype(np.uint8)
        values(there, "Displacement")[known == 0] = np.nan
        self.refused(self.surface(), there, ["lattice point (0, 0, 0)", "not finite"])
        add(there.GetPointData(), "ValidRegion", known)
        moved = self.deformed(self.surface(), there, Outside="mask")
        at = points_of(self.surface())
        self.assertTrue(np.array_equal(values(moved, "ValidRegion") != 0, at[:, 0] <= 1e-9))

    def test_nothing_and_nonsense(self):
        empty = self.deformed(vtkPolyData(), lattice(affine))
        self.assertEqual(empty.GetNumberOfPoints(), 0)
        self.refused(vtkImageData(), lattice(affine), ["the input", "dimension"])
        self.refused(self.surface(), self.volume(), ["the displacement", "Displacement"])
        flat = lattice(affine, size=(9, 9, 1))
        self.refused(self.surface(), flat, ["single point along axis 2"])
        two = lattice(affine)
        two.GetPointData().RemoveArray("Displacement")
        add(two.GetPointData(), "Displacement", np.zeros((729, 2)))
        self.refused(self.surface(), two, ["three components"])
        broken = self.surface()
        broken.GetPoints().SetPoint(3, float("nan"), 0.0, 0.0)
        self.refused(broken, lattice(affine), ["point 3 is not finite"])
        # After all that a good input works.
        made = self.filter(broken, lattice(affine))
        made.SetInputDataObject(0, self.surface())
        made.Update()
        self.assertGreater(made.GetOutputDataObject(0).GetNumberOfPoints(), 0)

    def test_strips_and_vertices_stay(self):
        data = self.surface()
        vertices = vtkCellArray()
        vertices.InsertNextCell(1, [5])
        data.SetVerts(vertices)
        self.assertEqual(self.deformed(data, lattice(affine)).GetNumberOfVerts(), 1)


if __name__ == "__main__":
    unittest.main()
