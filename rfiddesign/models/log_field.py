"""What a poll that read a tag, and one that did not, say of where the tag lies: logarithms about the antenna."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rfiddesign import require
from rfiddesign.geometry import DetectionArea
from rfiddesign.models.soft_field import LEAST_PROBABILITY, read_tables

MAX_ENTRIES = 4_000_000


class LogField(NamedTuple):
    """Logarithms of the chances of all that a poll may say of a tag at (u, v) in the antenna's frame.

    First that it is read, last that it is not; between them, where reads have a strength, that it is read with each,
    as in `soft_field.read_tables`.  All are relative to what they are far away, so that the outermost entries, and all
    places beyond, are 0.

    Fields
    ------
    tables : (n_things, n_u, n_v) float32 over u (rows), ahead of the antenna, and v, to its left; at least two of each.
    low_u, low_v : place of the first entry [mm].
    cell_mm : way from entry to entry [mm].
    far : (n_things,) the logarithms far away.
    """

    tables: np.ndarray
    low_u: float
    low_v: float
    cell_mm: float
    far: np.ndarray

    @property
    def reach_mm(self) -> float:
        """Distance of the farthest entry from the antenna [mm]."""
        n_u, n_v = self.tables.shape[1:]
        far_u, far_v = self.low_u + (n_u - 1) * self.cell_mm, self.low_v + (n_v - 1) * self.cell_mm
        return math.hypot(max(abs(self.low_u), abs(far_u)), max(abs(self.low_v), abs(far_v)))


@lru_cache(maxsize=64)
def log_field(
    area: DetectionArea, softness_mm: float = 0.0, read_probability: float = 1.0, rssi_radii_mm: tuple[float, ...] = ()
) -> LogField:
    """The field of a detection area whose border is blurred by a Gaussian of `softness_mm`, see `read_tables`."""
    tables, cell, _ = read_tables(area, rssi_radii_mm, float(softness_mm), float(read_probability))
    n_u, n_v = tables.shape[1:]
    return _cropped(tables, (-0.5 * (n_u - 1) * cell, -0.5 * (n_v - 1) * cell), cell)


def log_field_of(probability: ArrayLike, cell_mm: float, low_mm: tuple[float, float]) -> LogField:
    """The field of read probabilities (n_u, n_v), the first of them at `low_mm` [mm]; there are none beyond.

    Where a poll tries several powers, one after the other until the tag is read: (n_powers, n_u, n_v), the least first.
    Its tables are: read at all, read at each power, not read.  A read has a chance of at least 0.001 everywhere, so
    that one odd read does not end a belief.

    Raises
    ------
    ValueError : if a value is no probability, or 1, or there are more than 4 million.
    """
    require.positive("cell_mm", cell_mm)
    values = np.asarray(probability, float)
    if values.ndim not in (2, 3) or not 1 <= values.size <= MAX_ENTRIES or not ((values >= 0) & (values < 1)).all():
        raise ValueError(
            f"probability of shape {values.shape}: must be (n_u, n_v) or (n_powers, n_u, n_v), at most {MAX_ENTRIES:,} "
            "values from 0 to below 1"
        )
    low = tuple(require.finite("low_mm", value) - cell_mm for value in low_mm)
    powers = np.pad(np.atleast_3d(values.T).T, ((0, 0), (1, 1), (1, 1)))
    missed = np.cumprod(1.0 - powers, axis=0)
    at_each = powers * np.concatenate([np.ones_like(missed[:1]), missed[:-1]])
    seen = [1.0 - missed[-1], *(at_each if values.ndim == 3 else ())]
    return _cropped(
        np.stack([*(np.log(np.maximum(part, LEAST_PROBABILITY)) for part in seen), np.log(missed[-1])]), low, cell_mm
    )


def _cropped(tables: np.ndarray, low: tuple[float, float], cell: float) -> LogField:
    """Leave out what is as it is far away, but for one entry around."""
    far = np.array(tables[:, 0, 0], float)
    tables = tables - far[:, None, None]
    says = (tables != 0).any(axis=0)
    if not says.any() or says[[0, -1]].any() or says[:, [0, -1]].any():
        raise ValueError("the field must say something, and end within its table")
    (u0, u1), (v0, v1) = (np.flatnonzero(says.any(axis=axis))[[0, -1]] for axis in (1, 0))
    cropped = np.ascontiguousarray(tables[:, u0 - 1 : u1 + 2, v0 - 1 : v1 + 2], np.float32)
    return LogField(cropped, float(low[0] + (u0 - 1) * cell), float(low[1] + (v0 - 1) * cell), float(cell), far)
