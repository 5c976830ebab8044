"""What a read, a read of some strength, or no read says of where the tag lies: tables about the antenna."""

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.special import ndtr

from rfiddesign.geometry import DetectionArea, Disc, ProbabilityMap
from rfiddesign.models.read_field import tabulated
from rfiddesign.models.shape import radius_of

# Chance left to what cannot be, so that one odd read does not end a filter.
LEAST_PROBABILITY = 1e-3
# A border blurred by a Gaussian is done with beyond so many of its sigmas.
_SIGMAS = 3.1
_SIGMAS_HEARD = 2.33
_MAX_CELLS_PER_SIDE = 512
# A step t^2 (3 - 2 t) over twice this has the variance of a Gaussian: w^2 / 5.
_HALF_WIDTH_PER_SIGMA = math.sqrt(5.0)
_LEAST_HALF_WIDTH_MM = 0.01
_NO_INNER = -1e9


def blur_mm(area: DetectionArea, softness_mm: float, radius_tolerance: float) -> float:
    """Standard deviation of a border [mm]: its own, and what a field is larger or smaller by, squares added.

    `radius_tolerance` is a share of `radius_of` the area.
    """
    return math.hypot(softness_mm, radius_tolerance * radius_of(area)) if radius_tolerance else softness_mm


@lru_cache(maxsize=64)
def read_tables(
    area: DetectionArea, rssi_radii_mm: tuple[float, ...], softness_mm: float, read_probability: float
) -> tuple[np.ndarray, float, float]:
    """Log probabilities in square cells about the antenna, of each thing that a poll may say of one tag.

    Table 0: it is read; table j + 1: it is read with RSSI j, thus between the radii of steps j and j + 1 (there is none
    without radii); last table: it is not read.  Borders of the area are blurred by a Gaussian of `softness_mm`.

    Returns
    -------
    (n_tables, n, m) float32, whose border cells hold the value for every place beyond; side of a cell [mm]; distance
    beyond which a tag that is not read says next to nothing: it would be read with a chance below 1 % [mm].
    """
    field, cell = _soft(area, softness_mm)
    fields = [field]
    radii = (*rssi_radii_mm, 0.0)
    for outer, inner in pairwise(radii):
        disc = _soft_disc(outer, field.shape, cell, softness_mm)
        fields.append(disc - _soft_disc(inner, field.shape, cell, softness_mm) if inner > 0 else disc)
    tables = _log_tables(fields, field, read_probability)
    # Far away a tag is never read, to the last bit.
    tables[-1, [0, -1], :] = tables[-1, :, [0, -1]] = 0.0
    reach = 0.5 * cell * math.hypot(*field.shape) if isinstance(area, ProbabilityMap) else area.reach_mm
    return tables, cell, float(reach + _SIGMAS_HEARD * softness_mm + cell)


def soft_discs(
    radius_mm: float, rssi_radii_mm: tuple[float, ...], softness_mm: float, read_probability: float
) -> tuple[np.ndarray, float, float]:
    """As `read_tables`, for a disc, whose probabilities need no table.

    With S(r) the chance to be within r, a step that rises from 0 to 1 over r -+ w as t^2 (3 - 2 t), which has the
    variance of a Gaussian blur of `softness_mm`, each thing that a poll may say has probability a + b (S(outer) -
    S(inner)), at least 0.001.

    Returns
    -------
    (n_things, 4, 1) float32 outer, inner [mm], a, b; 1 / (2 w) [1/mm]; distance beyond which a tag that is not read
    says next to nothing [mm].
    """
    half_width = max(_HALF_WIDTH_PER_SIGMA * softness_mm, _LEAST_HALF_WIDTH_MM)
    outer = (radius_mm, *rssi_radii_mm)
    inner = (_NO_INNER, *rssi_radii_mm[1:], _NO_INNER)[: len(outer)]
    things = [(r, hole, 0.0, read_probability) for r, hole in zip(outer, inner, strict=True)]
    things.append((radius_mm, _NO_INNER, 1.0, -read_probability))
    return np.array(things, np.float32)[:, :, None], 0.5 / half_width, float(radius_mm + half_width)


def _log_tables(fields: list[np.ndarray], field: np.ndarray, read_probability: float) -> np.ndarray:
    seen = [np.log(np.maximum(read_probability * part, LEAST_PROBABILITY)) for part in fields]
    return np.ascontiguousarray([*seen, np.log1p(-read_probability * np.clip(field, 0.0, 1.0))], np.float32)


def _soft(area: DetectionArea, softness_mm: float) -> tuple[np.ndarray, float]:
    """Chance to be in the blurred area in cells over u (rows) and v, one cell of nothing around, and their side."""
    if isinstance(area, ProbabilityMap):
        table, cell = tabulated(area)
        margin = 1 + math.ceil(_SIGMAS * softness_mm / cell)
        return gaussian_filter(np.pad(table.astype(float), margin), softness_mm / cell, mode="constant"), cell
    extent = 2.0 * (area.reach_mm + _SIGMAS * softness_mm)
    cell = max(1.0, extent / _MAX_CELLS_PER_SIDE)
    n = math.ceil(extent / cell) + 2
    if isinstance(area, Disc):
        return _soft_disc(area.radius_mm, (n, n), cell, softness_mm), cell
    return _border(-area.signed_distance(_centres((n, n), cell)), softness_mm), cell


def _soft_disc(radius_mm: float, shape: tuple[int, int], cell: float, softness_mm: float) -> np.ndarray:
    return _border(radius_mm - np.hypot(*np.moveaxis(_centres(shape, cell), -1, 0)), softness_mm)


def _border(depth_mm: np.ndarray, softness_mm: float) -> np.ndarray:
    """Chance to be inside, by the depth inside the border."""
    return ndtr(depth_mm / softness_mm) if softness_mm > 0 else (depth_mm >= 0).astype(float)


def _centres(shape: tuple[int, int], cell: float) -> np.ndarray:
    u, v = np.meshgrid(*((np.arange(n) - (n - 1) / 2) * cell for n in shape), indexing="ij")
    return np.stack([u, v], axis=-1)
