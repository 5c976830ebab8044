"""A robot on a straight course over a tag pattern: what its antennas sweep, and the rows of tags it may run along."""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from rfiddesign import require
from rfiddesign.geometry.areas import DetectionArea, Disc
from rfiddesign.geometry.coverage import outline_edges
from rfiddesign.geometry.lattice import Lattice
from rfiddesign.geometry.layouts import ReaderLayout
from rfiddesign.geometry.patterns import TagPattern, ThinnedPattern
from rfiddesign.geometry.symmetry import is_layout_mirrored, lattice_mirror, lattice_order

#: No more rows than these, the ones farthest apart, are looked at.
MAX_ROWS = 200
#: Lengths across the rows [mm] below which a difference comes from rounding.
NARROWEST_LANE = 1e-6


@dataclass(frozen=True)
class Row:
    """Rows of a lattice: their direction [rad] in [0, pi), the distance between them and between tags of one [mm]."""

    direction: float
    spacing: float
    period: float


@dataclass(frozen=True, eq=False)
class Travel:
    """A robot on its way, in a frame whose u axis is the direction of travel and whose v axis points to its left.

    Parameters
    ----------
    layout, area, pattern, course_deg : as given to `travel`.
    antennas : (n, 2) offsets u, v of the antennas from the robot's centre [mm].
    radius : of the discs they see [mm]; 0 for other areas.
    edges : (n, m, 4) sides u0, v0, u1, v1 of the outline of what each antenna sees, about that antenna [mm].
    swaths : (n_swaths, 2) intervals of v that the antennas sweep [mm], one for each antenna and part of its area.
    lattice : that on which the tags lie, if not on all of its points; or None.
    rows : the rows of the lattice that are farther apart than any antenna's swath is wide, the farthest apart first.
    """

    layout: ReaderLayout
    area: DetectionArea
    pattern: TagPattern
    course_deg: float
    antennas: NDArray[np.float64]
    radius: float
    edges: NDArray[np.float64]
    swaths: NDArray[np.float64]
    lattice: Lattice | None
    rows: tuple[Row, ...]


def travel(layout: ReaderLayout, area: DetectionArea, pattern: TagPattern, course_deg: float) -> Travel:
    """Describe a robot that drives at `course_deg` [deg] against its own heading."""
    course_deg = require.finite("course_deg", course_deg)
    course = math.radians(course_deg)
    poses = layout.poses_mm
    antennas = rotated(poses[:, :2], -course)
    yaws = poses[:, 2] - course
    corners = outline_edges(area).reshape(-1, 2)
    swaths = _swaths(area, antennas[:, 1], yaws)
    # A thinned lattice has fewer tags than its base, but in the same rows.
    lattice = pattern.base.lattice if isinstance(pattern, ThinnedPattern) else pattern.lattice
    widest = float((swaths[:, 1] - swaths[:, 0]).max())
    return Travel(
        layout=layout,
        area=area,
        pattern=pattern,
        course_deg=course_deg,
        antennas=antennas,
        radius=float(area.radius_mm) if isinstance(area, Disc) else 0.0,
        edges=np.stack([rotated(corners, yaw).reshape(-1, 4) for yaw in yaws]),
        swaths=swaths,
        lattice=lattice,
        rows=() if lattice is None else lattice_rows(lattice, widest),
    )


def lattice_rows(lattice: Lattice, wider_than: float) -> tuple[Row, ...]:
    """Return the rows of a lattice that are farther apart than `wider_than` [mm], the farthest apart first."""
    a, b = lattice.reduced_basis_mm
    cell = lattice.cell_area_mm2
    n_a, n_b = (min(math.floor(math.hypot(*vector) / wider_than), MAX_ROWS) for vector in (b, a))
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(-n_a, n_a + 1), np.arange(n_b + 1)))
    is_primitive = (np.gcd(i, j) == 1) & ((j > 0) | (i > 0))
    vectors = i[is_primitive, None] * a + j[is_primitive, None] * b
    vectors = np.where(((vectors[:, 1] > 0) | ((vectors[:, 1] == 0) & (vectors[:, 0] > 0)))[:, None], vectors, -vectors)
    periods = np.hypot(*vectors.T)
    rows = [
        Row(math.atan2(vectors[at, 1], vectors[at, 0]), float(cell / periods[at]), float(periods[at]))
        for at in np.argsort(periods, kind="stable")[:MAX_ROWS]
    ]
    return tuple(row for row in rows if row.spacing > wider_than + NARROWEST_LANE)


def like_heading(on_its_way: Travel, heading_deg: float) -> float:
    """Return the lowest heading [deg], from 0, that symmetry makes like this one."""
    lattice, course_deg = on_its_way.lattice, on_its_way.course_deg
    if lattice is None:
        return heading_deg
    sector = 360.0 / lattice_order(lattice)
    axis = lattice_mirror(lattice)
    # Distances between reads are the same forward and backward, so that either mirror axis will do.
    mirrors = (math.radians(course_deg), math.radians(course_deg) + math.pi / 2)
    alike = [heading_deg]
    if axis is not None and any(is_layout_mirrored(on_its_way.layout, on_its_way.area, mirror) for mirror in mirrors):
        alike.append(2 * (math.degrees(axis) - course_deg) - heading_deg)
    return min(round(round(heading, 9) % sector, 9) for heading in alike)


def free_lanes(swaths: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Return the widths (n,) [mm] of the lanes, modulo the row spacing, that none of the swaths (n, 2) covers."""
    start = np.mod(swaths[:, 0], spacing)
    end = start + (swaths[:, 1] - swaths[:, 0])
    # Once around, from where the first swath begins to where it begins again.
    first = start.min()
    start, end = (
        np.concatenate([start - spacing, start, [first + spacing]]),
        np.concatenate([end - spacing, end, [0.0]]),
    )
    order = np.argsort(start, kind="stable")
    start, covered_to = start[order], np.maximum.accumulate(end[order])
    free = np.where(start[1:] > first, start[1:] - covered_to[:-1], 0.0)
    return free[free > NARROWEST_LANE]


def rotated(points: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Return points (n, 2) turned to the left about the origin by `angle` [rad]."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return points @ np.array([[cosine, sine], [-sine, cosine]])


def _swaths(area: DetectionArea, offsets: NDArray, yaws: NDArray) -> NDArray:
    if isinstance(area, Disc):
        return offsets[:, None] + np.array([-area.radius_mm, area.radius_mm])
    parts = [shapely.get_coordinates(part) for part in shapely.get_parts(area.outline())]
    swaths = []
    for offset, yaw in zip(offsets, yaws, strict=True):
        across = [rotated(part, yaw)[:, 1] for part in parts]
        swaths += [(offset + v.min(), offset + v.max()) for v in across]
    return np.array(swaths)
