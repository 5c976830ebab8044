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
    """Logarithms of the chance that a poll reads a tag at (u, v) in the antenna's frame, and that it does not.

    Both are relative to what they are far away, so that the outermost entries, and all places beyond, are 0.

    Fields
    ------
    read, silent : (n_u, n_v) float32 over u (rows), ahead of the antenna, and v, to its left; the same shape.
    low_u, low_v : place of the first entry [mm].
    cell_mm : way from entry to entry [mm].
    far_read, far_silent : the two logarithms far away.
    """

    read: np.ndarray
    silent: np.ndarray
    low_u: float
    low_v: float
    cell_mm: float
    far_read: float
    far_silent: float

    @property
    def reach_mm(self) -> float:
        """Distance of the farthest entry from the antenna [mm]."""
        n_u, n_v = self.read.shape
        far_u, far_v = self.low_u + (n_u - 1) * self.cell_mm, self.low_v + (n_v - 1) * self.cell_mm
        return math.hypot(max(abs(self.low_u), abs(far_u)), max(abs(self.low_v), abs(far_v)))


@lru_cache(maxsize=64)
def log_field(area: DetectionArea, softness_mm: float = 0.0, read_probability: float = 1.0) -> LogField:
    """The field of a detection area whose border is blurred by a Gaussian of `softness_mm`, see `read_tables`."""
    tables, cell, _ = read_tables(area, (), float(softness_mm), float(read_probability))
    n_u, n_v = tables.shape[1:]
    return _cropped(tables[0], tables[-1], -0.5 * (n_u - 1) * cell, -0.5 * (n_v - 1) * cell, cell)


def log_field_of(probability: ArrayLike, cell_mm: float, low_mm: tuple[float, float]) -> LogField:
    """The field of read probabilities (n_u, n_v), the first of them at `low_mm` [mm]; there are none beyond.

    A read has a chance of at least 0.001 everywhere, so that one odd read does not end a belief.

    Raises
    ------
    ValueError : if a value is no probability, or 1, or there are more than 4 million.
    """
    require.positive("cell_mm", cell_mm)
    values = np.asarray(probability, float)
    if values.ndim != 2 or not 1 <= values.size <= MAX_ENTRIES or not ((values >= 0) & (values < 1)).all():
        raise ValueError(
            f"probability of shape {values.shape}: must be two-dimensional, at most {MAX_ENTRIES:,} values from 0 to "
            "below 1"
        )
    low_u, low_v = (require.finite("low_mm", value) for value in low_mm)
    padded = np.pad(values, 1)
    return _cropped(
        np.log(np.maximum(padded, LEAST_PROBABILITY)), np.log1p(-padded), low_u - cell_mm, low_v - cell_mm, cell_mm
    )


def _cropped(read: np.ndarray, silent: np.ndarray, low_u: float, low_v: float, cell: float) -> LogField:
    """Leave out what is as it is far away, but for one entry around."""
    far_read, far_silent = float(read[0, 0]), float(silent[0, 0])
    read, silent = read - far_read, silent - far_silent
    says = (read != 0) | (silent != 0)
    (u0, u1), (v0, v1) = ((np.flatnonzero(says.any(axis=axis))[[0, -1]]) for axis in (1, 0))
    if u0 == 0 or v0 == 0 or u1 == read.shape[0] - 1 or v1 == read.shape[1] - 1:
        raise ValueError("the field does not end within its table")
    rows, columns = slice(u0 - 1, u1 + 2), slice(v0 - 1, v1 + 2)
    return LogField(
        np.ascontiguousarray(read[rows, columns], np.float32), np.ascontiguousarray(silent[rows, columns], np.float32),
        float(low_u + (u0 - 1) * cell), float(low_v + (v0 - 1) * cell), float(cell), far_read, far_silent,
    )  # fmt: skip
