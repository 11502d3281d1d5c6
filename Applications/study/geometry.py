# SPDX-License-Identifier: BSD-3-Clause
"""Rigid motions as 4 x 4 matrices (mm, LPS), pose files, and what a convex probe sees."""
import dataclasses
import json
import os
import pathlib

import numpy as np
from vtkmodules.vtkCommonMath import vtkMatrix4x4


def matrix_of(array):
    matrix = vtkMatrix4x4()
    matrix.DeepCopy(np.asarray(array, float).ravel())
    return matrix


def rotation(vector):
    """The rotation by |vector| radians about it."""
    angle = np.linalg.norm(vector)
    if angle == 0:
        return np.eye(3)
    x, y, z = np.asarray(vector) / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def pose(turn=(0, 0, 0), move=(0, 0, 0)):
    """The turn by a rotation vector (radians), then the move (mm)."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation(np.asarray(turn, float))
    matrix[:3, 3] = move
    return matrix


def about(centre, motion):
    """The motion with its turn about a centre."""
    shift = pose(move=centre)
    return shift @ motion @ np.linalg.inv(shift)


def apply(matrix, points):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def best_rigid(fixed, moving):
    """The rigid motion that brings points of one list nearest to those of another, in the sense of least squares."""
    centres = fixed.mean(axis=0), moving.mean(axis=0)
    left, _, right = np.linalg.svd((fixed - centres[0]).T @ (moving - centres[1]))
    motion = np.eye(4)
    motion[:3, :3] = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    motion[:3, 3] = centres[0] - motion[:3, :3] @ centres[1]
    return motion


def degrees_of(matrix):
    """The angle by which a motion turns."""
    sine = 0.5 * np.linalg.norm(matrix[[2, 0, 1], [1, 2, 0]] - matrix[[1, 2, 0], [2, 0, 1]])
    return float(np.degrees(np.arctan2(sine, 0.5 * (np.trace(matrix[:3, :3]) - 1))))


def random_motion(random, degrees, mm):
    """A turn by so many degrees about a random axis and a move by so many mm in a random direction."""
    axis, direction = random.normal(size=3), random.normal(size=3)
    return pose(np.radians(degrees) * axis / np.linalg.norm(axis), mm * direction / np.linalg.norm(direction))


def read_poses(path):
    """[(file, VolumeToWorld)] of a pose file."""
    path = pathlib.Path(path)
    content = json.loads(path.read_text())
    if content.get("schema") != "echorama-poses-1":
        raise ValueError(f"{path}: it is no file of poses")
    return [(path.parent / volume["file"], np.array(volume["VolumeToWorld"], float)) for volume in content["volumes"]]


def write_poses(path, files, matrices):
    path = pathlib.Path(path)
    volumes = [{"file": os.path.relpath(file, path.parent), "VolumeToWorld": np.asarray(matrix).tolist()}
               for file, matrix in zip(files, matrices)]
    path.write_text(json.dumps({"schema": "echorama-poses-1", "unit": "mm", "frame": "LPS", "volumes": volumes}, indent=1))


@dataclasses.dataclass(frozen=True)
class Probe:
    """The probe of the phantom: angles in degrees, lengths in mm."""
    fan_angle: float = 65.0
    fan_radius: float = 40.0
    sweep_angle: float = 55.0
    sweep_radius: float = 30.0
    depth_min: float = 5.0
    depth_max: float = 100.0

    def sees(self, points):
        """Which points of the probe frame lie in its fan."""
        x, y, z = np.moveaxis(np.asarray(points, float), -1, 0)
        plane = np.hypot(y, z + self.sweep_radius) - self.sweep_radius
        depth = np.hypot(x, plane + self.fan_radius) - self.fan_radius
        fan = np.degrees(np.arctan2(x, plane + self.fan_radius))
        sweep = np.degrees(np.arctan2(y, z + self.sweep_radius))
        return ((abs(fan) <= self.fan_angle / 2) & (abs(sweep) <= self.sweep_angle / 2) &
                (depth >= self.depth_min) & (depth <= self.depth_max))

    def points(self, random, count):
        """So many points, evenly in the volume of its fan."""
        reach = self.depth_max + self.fan_radius
        found = np.empty((0, 3))
        while len(found) < count:
            tried = random.uniform((-reach, -reach, -self.fan_radius), (reach, reach, self.depth_max), (20000, 3))
            found = np.concatenate([found, tried[self.sees(tried)]])
        return found[:count]

    def overlap(self, motion, points):
        """The share of the points (in the frame of one view) that a view moved by so much also sees."""
        return float(self.sees(apply(np.linalg.inv(motion), points)).mean())
