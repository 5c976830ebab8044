"""One motion of a robot and what an antenna sweeps in it, as the arrays that kernels take."""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign.geometry import Disc
from rfiddesign.optimize.reader_placement._first_read_kernels import first_reads, first_reads_turning
from rfiddesign.optimize.reader_placement.problem import MOTIONS, PlacementProblem


@dataclass(frozen=True, eq=False)
class Sweep:
    """What an antenna at the robot's centre sees in one motion.

    Parameters
    ----------
    motion : a name of `MOTIONS`.
    course : direction of travel against the heading [rad]; 0 if the robot turns on the spot.
    distance : driven straight on [mm]; 0 if it turns.
    turn : turned to the left on the spot [rad]; 0 if it drives.
    reach : largest distance of what the antenna sees from its centre [mm]: the radius, if that is a disc.
    planes : (p, 3) half-planes a x + b y <= c of what it sees [mm], with unit normals; none if that is a disc.
    swept : (q, 3) the same of all that it sweeps as the robot drives.
    width : of the swath across the way [mm]; nan if the robot turns.
    area : of what is swept as the robot drives [mm^2]; nan if it turns.
    """

    motion: str
    course: float
    distance: float
    turn: float
    reach: float
    planes: NDArray[np.float64]
    swept: NDArray[np.float64]
    width: float
    area: float

    @property
    def numbers(self) -> NDArray[np.float64]:
        """Course, distance, turn and reach (4,)."""
        return np.array([self.course, self.distance, self.turn, self.reach])

    def first_reads(
        self, poses: NDArray[np.float64], basis: NDArray[np.float64], mounts: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """How far each antenna (m,) is from its first read at each pose (n,), as a share of the motion; inf if none.

        Parameters
        ----------
        poses : (n, 3) places against the lattice [mm] and headings [rad].
        basis : (2, 2) of the lattice [mm].
        mounts : (m, 2) antennas in the robot's frame [mm].
        """
        if self.turn > 0:
            return first_reads_turning(poses, basis, mounts, self.turn, self.reach) / np.float32(self.turn)
        reads = first_reads(poses, basis, mounts, self.course, self.distance, self.reach, self.planes)
        return reads / np.float32(self.distance)


def sweeps(problem: PlacementProblem) -> tuple[Sweep, ...]:
    """What an antenna sweeps in each motion of the problem."""
    return tuple(_sweep(problem, motion) for motion in problem.motions)


def _sweep(problem: PlacementProblem, motion: str) -> Sweep:
    area, course = problem.antenna.area, MOTIONS[motion]
    is_disc, none = isinstance(area, Disc), np.zeros((0, 3))
    if course is None:
        return Sweep(motion, 0.0, 0.0, problem.turn_rad, area.reach_mm, none, none, math.nan, math.nan)
    distance = float(problem.distance_mm)
    width = 2 * area.reach_mm if is_disc else _extent_across(area.outline(), course)
    size = area.area_mm2 + distance * width
    if is_disc:
        return Sweep(motion, course, distance, 0.0, area.reach_mm, none, none, width, size)
    corners = shapely.get_coordinates(area.outline().convex_hull)
    way = distance * np.array([math.cos(course), math.sin(course)])
    swept = shapely.MultiPoint(np.concatenate([corners, corners + way]))
    return Sweep(
        motion, course, distance, 0.0, area.reach_mm, half_planes(area.outline()), half_planes(swept), width, size
    )


def half_planes(shape: BaseGeometry) -> NDArray[np.float64]:
    """Half-planes (n, 3), a x + b y <= c [mm] with unit normals, whose intersection is the shape's convex hull."""
    hull = shapely.orient_polygons(shapely.simplify(shape.convex_hull, 0.0))
    ring = shapely.get_coordinates(hull.exterior)
    sides = np.diff(ring, axis=0)
    normals = np.stack([sides[:, 1], -sides[:, 0]], axis=-1) / np.hypot(*sides.T)[:, None]
    return np.column_stack([normals, (normals * ring[:-1]).sum(axis=1)])


def _extent_across(shape: BaseGeometry, course: float) -> float:
    corners = shapely.get_coordinates(shape)
    return float(np.ptp(corners @ (-math.sin(course), math.cos(course))))
