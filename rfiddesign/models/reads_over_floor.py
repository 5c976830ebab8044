"""How many tags a robot can expect to read over a floor."""

import math

import numpy as np
import shapely
from numpy.typing import NDArray

from rfiddesign import require
from rfiddesign.floor import Floor, prepared_copy
from rfiddesign.geometry import compose
from rfiddesign.models.detection_field import DetectionField

MAX_CELLS = 1_000_000
# Chances that are held at a time: 32 MB.
_MAX_CHANCES = 8_000_000


def reads_over_floor(
    field: DetectionField, floor: Floor, mountings: tuple[tuple[float, float, float], ...], heading: float,
    n_cycles: int, cell_mm: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    """Expected number of tags that one snapshot of a robot's antennas holds, by its place, at one heading.

    Parameters
    ----------
    field : chances of the tags.
    floor : where the robot's centre may be.
    mountings : poses (x, y [mm], yaw [rad]) of the antennas on the robot; a tag counts once, whoever reads it.
    heading : of the robot [rad].
    n_cycles : cycles of each antenna.
    cell_mm : side of the cells that the floor is looked at in [mm].

    Returns
    -------
    x (n_x,) and y (n_y,) of the cells' centres [mm] and tags (n_y, n_x), nan where the robot's centre cannot be.

    Raises
    ------
    ValueError : if the cell is not positive or there would be more than 1,000,000.
    """
    require.positive("cell_mm", cell_mm)
    low_x, low_y, high_x, high_y = floor.navigable.bounds
    n_x, n_y = (math.ceil(side / cell_mm) for side in (high_x - low_x, high_y - low_y))
    if n_x * n_y > MAX_CELLS:
        raise ValueError(f"cell_mm is {cell_mm:g}: {n_x * n_y:,} cells, at most {MAX_CELLS:,} are allowed")
    x, y = low_x + cell_mm * (np.arange(n_x) + 0.5), low_y + cell_mm * (np.arange(n_y) + 0.5)
    places = np.stack(np.meshgrid(x, y), axis=-1)
    is_inside = shapely.contains_xy(prepared_copy(floor.navigable), *np.moveaxis(places, -1, 0))
    poses = np.column_stack([places[is_inside], np.full(is_inside.sum(), float(heading))])
    n_at_once = max(1, _MAX_CHANCES // max(field.n_tags, 1))
    expected = [np.empty(0)]
    for first in range(0, len(poses), n_at_once):
        missed = np.ones((len(poses[first : first + n_at_once]), field.n_tags))
        for mounting in mountings:
            missed *= (1.0 - field.read_probability(compose(poses[first : first + n_at_once], mounting))) ** n_cycles
        expected.append((1.0 - missed).sum(axis=1))
    reads = np.full(is_inside.shape, np.nan)
    reads[is_inside] = np.concatenate(expected)
    return x, y, reads
