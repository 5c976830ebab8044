"""The detection area in the form that the compiled run asks: a rounded rectangle, or a table of read probability."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rfiddesign.geometry import DetectionArea, Disc, ProbabilityMap, Rectangle, RoundedRectangle

# 1 mm cells up to this many per side, coarser beyond: 4 MB at most.
_MAX_CELLS_PER_SIDE = 1024


class ReadField(NamedTuple):
    """Chance to read a tag at (u, v) in the antenna's frame.

    A tag is in view if its distance to the box |u| <= half_length, |v| <= half_width is below `corner_mm`; a disc is a
    box without extent.  Where `table` has cells, the read probability is looked up there instead.

    Fields: half_length_mm, half_width_mm, corner_mm, reach_mm (float); table (n, m) float32 over u (rows) and v;
    cell_mm (float): side of a table cell, the table being centred on the antenna; rssi_radii (m,): radius of each step
    of RSSI, falling, none: reads have no RSSI.
    """

    half_length_mm: float
    half_width_mm: float
    corner_mm: float
    reach_mm: float
    table: np.ndarray
    cell_mm: float
    rssi_radii: np.ndarray


@lru_cache(maxsize=64)
def read_field(area: DetectionArea, rssi_radii_mm: tuple[float, ...] = ()) -> ReadField:
    """The read field of a detection area: exact for disc, rectangle and rounded rectangle, tabulated for the rest."""
    empty, radii = np.zeros((0, 0), np.float32), np.array(rssi_radii_mm, float)
    if isinstance(area, Disc):
        return ReadField(0.0, 0.0, float(area.radius_mm), float(area.reach_mm), empty, 1.0, radii)
    if isinstance(area, Rectangle):
        return ReadField(area.length_mm / 2, area.width_mm / 2, 0.0, float(area.reach_mm), empty, 1.0, radii)
    if isinstance(area, RoundedRectangle):
        corner = float(area.corner_mm)
        return ReadField(
            area.length_mm / 2 - corner, area.width_mm / 2 - corner, corner, float(area.reach_mm), empty, 1.0, radii
        )
    table, cell = tabulated(area)
    reach = 0.5 * cell * float(np.hypot(*table.shape)) if isinstance(area, ProbabilityMap) else area.reach_mm + cell
    return ReadField(0.0, 0.0, 0.0, float(reach), table, cell, radii)


def tabulated(area: DetectionArea) -> tuple[np.ndarray, float]:
    """Read probability in square cells about the antenna, (n, m) float32 over u (rows) and v, and their side [mm]."""
    if isinstance(area, ProbabilityMap):
        return np.ascontiguousarray(np.asarray(area.probability, np.float32).T), float(area.cell_mm)
    cell = max(1.0, 2.0 * area.reach_mm / _MAX_CELLS_PER_SIDE)
    n = int(np.ceil(2.0 * area.reach_mm / cell))
    centres = (np.arange(n) - (n - 1) / 2) * cell
    u, v = np.meshgrid(centres, centres, indexing="ij")
    return area.contains(np.stack([u, v], axis=-1)).astype(np.float32), float(cell)
