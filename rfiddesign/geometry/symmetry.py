"""Symmetries that coverage inherits: over which sector of headings it has to be looked at.

Coverage over all phases of a lattice does not change when the robot turns by an angle that maps the lattice, or the
robot's own layout, onto itself; with a mirror axis in both, it is even about one heading.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rfiddesign.geometry.areas import DetectionArea, Disc, Rectangle, Ring, RoundedRectangle
from rfiddesign.geometry.ellipse_area import Ellipse
from rfiddesign.geometry.lattice import Lattice
from rfiddesign.geometry.layouts import ReaderLayout

#: Antennas, in mm, and yaws, in rad, nearer than this count as alike.
ALIKE = 1e-6
#: Above so many antennas the search for symmetries would take longer than it saves.
MAX_READERS_SEARCHED = 500


@dataclass(frozen=True)
class Sector:
    """Headings from `start_rad`, over `width_rad`: the mean over them is the mean over a full turn."""

    start_rad: float
    width_rad: float

    def midpoints(self, n: int) -> NDArray[np.float64]:
        """Return the headings (n,) [rad] in the middles of n equal parts."""
        return self.start_rad + self.width_rad * (np.arange(n) + 0.5) / n


def lattice_order(lattice: Lattice) -> int:
    """Return how many turns map the lattice onto itself: 4 if square, 6 if triangular, else 2."""
    basis = lattice.reduced_basis_mm
    return next((order for order in (6, 4) if _is_lattice_mapped(basis, _rotation(2 * math.pi / order))), 2)


def lattice_mirror(lattice: Lattice) -> float | None:
    """Return the direction [rad] of a mirror axis of the lattice, or None."""
    a, b = basis = lattice.reduced_basis_mm
    for axis in (a, b, a + b, a - b):
        direction = math.atan2(axis[1], axis[0])
        if _is_lattice_mapped(basis, _reflection(direction)):
            return direction
    return None


def layout_order(layout: ReaderLayout, area: DetectionArea) -> int:
    """Return how many turns about their mean position map the antennas, with their areas, onto each other."""
    n = layout.n_readers
    if n > MAX_READERS_SEARCHED:
        return 1
    # Under a turn all antennas but one in the centre come in groups of that order.
    orders = (order for order in range(max(n, 12), 1, -1) if n % order in (0, 1))
    return next((order for order in orders if _is_layout_mapped(layout, area, _Isometry(1, 2 * math.pi / order))), 1)


def is_layout_mirrored(layout: ReaderLayout, area: DetectionArea, axis_rad: float) -> bool:
    """Tell whether the antennas, with their areas, map onto each other by the mirror axis of that direction."""
    return layout.n_readers <= MAX_READERS_SEARCHED and _is_layout_mapped(layout, area, _Isometry(-1, 2 * axis_rad))


def layout_mirror(layout: ReaderLayout, area: DetectionArea) -> float | None:
    """Return the direction [rad] in the robot's frame of a mirror axis of the layout, or None."""
    if layout.n_readers > MAX_READERS_SEARCHED:
        return None
    x, y = _centred_positions(layout).T
    radius, direction = np.hypot(x, y), np.arctan2(y, x)
    outermost = int(np.argmax(radius))
    # The axis lies midway between the outermost antenna and its image, which is as far out.
    images = np.flatnonzero(radius > radius[outermost] - ALIKE)
    axes = np.unique(np.round((direction[outermost] + direction[images]) / 2, 12)).tolist()
    if radius[outermost] < ALIKE:
        axes = layout.poses_mm[:, 2].tolist()
    return next((axis for axis in axes if is_layout_mirrored(layout, area, axis)), None)


def heading_sector(layout: ReaderLayout, area: DetectionArea, lattice: Lattice) -> Sector:
    """Return the smallest sector of headings over which coverage has to be averaged."""
    width = 2 * math.pi / math.lcm(lattice_order(lattice), layout_order(layout, area))
    lattice_axis, layout_axis = lattice_mirror(lattice), layout_mirror(layout, area)
    if lattice_axis is None or layout_axis is None:
        return Sector(0.0, width)
    return Sector(lattice_axis - layout_axis, width / 2)


@dataclass(frozen=True)
class _Isometry:
    """A turn (`sign` 1) by `angle`, or (`sign` -1) the reflection that takes direction 0 to `angle`."""

    sign: int
    angle: float

    def points(self, points: NDArray) -> NDArray:
        matrix = _rotation(self.angle) if self.sign > 0 else _reflection(self.angle / 2)
        return points @ matrix.T

    def yaws(self, yaws: NDArray) -> NDArray:
        return self.sign * yaws + self.angle


def _is_layout_mapped(layout: ReaderLayout, area: DetectionArea, mapping: _Isometry) -> bool:
    order, is_mirrored = _area_symmetry(area)
    if mapping.sign < 0 and not is_mirrored:
        return False
    positions, yaws = _centred_positions(layout), layout.poses_mm[:, 2]
    offsets = mapping.points(positions)[:, None] - positions[None]
    is_alike = (np.abs(offsets) < ALIKE).all(axis=-1)
    if order:
        turns = (mapping.yaws(yaws)[:, None] - yaws[None]) * order / (2 * math.pi)
        is_alike &= np.abs(turns - np.round(turns)) < ALIKE
    return bool(is_alike.any(axis=1).all() and is_alike.any(axis=0).all())


def _centred_positions(layout: ReaderLayout) -> NDArray:
    positions = layout.poses_mm[:, :2]
    return positions - positions.mean(axis=0)


def _area_symmetry(area: DetectionArea) -> tuple[int, bool]:
    """Return how many turns map the area onto itself (0: every one), and whether x is a mirror axis of it."""
    if isinstance(area, Disc | Ring):
        return 0, True
    if isinstance(area, Rectangle | RoundedRectangle):
        return (4 if area.length_mm == area.width_mm else 2), True
    if isinstance(area, Ellipse):
        return 2, True
    return 1, False


def _is_lattice_mapped(basis: NDArray, matrix: NDArray) -> bool:
    coordinates = basis @ matrix.T @ np.linalg.inv(basis)
    return bool((np.abs(coordinates - np.round(coordinates)) < 1e-9).all())


def _rotation(angle: float) -> NDArray:
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def _reflection(axis: float) -> NDArray:
    return np.array([[math.cos(2 * axis), math.sin(2 * axis)], [math.sin(2 * axis), -math.cos(2 * axis)]])
